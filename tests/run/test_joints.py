"""Joints: ties between surfaces whose meshes do not match (theory.md, section 11).

What is cut and tied again must be what it was: eigenvalues of a cut disc, a disc cut from its hat, pads cut from their
back plates agree with those of the uncut brake within the error bars of both.
"""

import collections
import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402
import test_matrix_export as export  # noqa: E402

BRAKE = {**st.SMALL_BRAKE, **mesh_files.SCENE, "Eigenproblem/Maximum frequency": 4000, "Mesh/File": "brake.msh"}
LOW, HIGH = -0.006, 0.006


def disc(pieces):
    """A mesh of pads and a rotor of pieces: (name, radii, cells around, heights)."""
    mesh = mesh_files.brake(pads=())
    mesh.nodes, mesh.cells, mesh.volumes, mesh.surfaces = [], [], {}, {}
    for name, radii, n, heights in pieces:
        mesh.sector(name, radii, mesh_files.equal(0, 2 * math.pi, n), heights, ring=True)
    return mesh


def add_pads(mesh, n=(2, 3, 1)):
    half = math.radians(25)
    for pad, heights in {"upper": (HIGH, 0.018), "lower": (-0.018, LOW)}.items():
        mesh.sector(pad, mesh_files.equal(0.09, 0.14, n[0]), mesh_files.equal(-half, half, n[1]),
                    mesh_files.equal(*heights, n[2]))
    return mesh


class CutAndTied(st.TestCase):
    def modes_of(self, mesh, ranks=1, **settings):
        self.write("brake.msh", mesh_files.msh2(mesh))
        return self.modes({**BRAKE, **settings}, ranks=ranks)

    def assertWithinBars(self, modes, expected, least_bar=0.0):
        self.assertEqual(len(modes), len(expected))
        self.assertGreater(len(modes), 5)
        for a, b in zip(modes, expected):
            for value, bar in [("frequency_hz", "frequency_error_hz"),
                               ("growth_rate_1_per_s", "growth_rate_error_1_per_s")]:
                self.assertLessEqual(abs(a[value] - b[value]), a[bar] + b[bar] + least_bar, (a["mode"], value))

    def test_disc_across_its_thickness(self):
        """Turning at 20 rad/s; the two layers have 18 and 24 cells around."""
        radii = mesh_files.equal(0.05, 0.15, 3)
        whole = self.modes_of(mesh_files.brake(rotor_cells=(3, 18, 2)))
        cut = {"Mesh/Rotor": "rotor, top", "Mesh/Clamped": "rotor.inner, top.inner",
               "Mesh/Contact pairs": "upper.low : top.high, lower.high : rotor.low", "Joints/Ties": "top.low : rotor.high"}
        mesh = add_pads(disc([("rotor", radii, 18, (LOW, 0)), ("top", radii, 24, (0, HIGH))]))
        tied = self.modes_of(mesh, **cut)
        self.assertWithinBars(tied, whole)
        on_two_ranks = self.modes({**BRAKE, **cut, "Eigenproblem/Error bars": "false"}, ranks=2)
        self.assertSameModes(eigenvalues(on_two_ranks), eigenvalues(tied), 1e-7)

    def test_disc_around(self):
        """A cylindrical tie: the disc inside of the pads, 18 cells around, and the ring that they touch, 20."""
        whole = self.modes_of(mesh_files.brake(rotor_cells=(4, 18, 1)))
        mesh = add_pads(disc([("rotor", [0.05, 0.075], 18, (LOW, HIGH)),
                              ("ring", mesh_files.equal(0.075, 0.15, 3), 20, (LOW, HIGH))]))
        tied = self.modes_of(mesh, **{"Mesh/Rotor": "rotor, ring", "Joints/Ties": "ring.inner : rotor.outer",
                                      "Mesh/Contact pairs": "upper.low : ring.high, lower.high : ring.low"})
        self.assertWithinBars(tied, whole)


    def test_disc_and_hat(self):
        """A plane tie between the disc, 18 cells around, and the hat that holds it, 20; turning."""
        radii = [0.05, 0.058, *mesh_files.equal(0.058, 0.15, 3)[1:]]

        def with_hat(n):
            mesh = disc([("rotor", radii, 18, (LOW, HIGH)), ("hat", radii[:2], n, mesh_files.equal(HIGH, 0.036, 2))])
            inside = [face for face in mesh.surfaces["rotor.high"]
                      if max(math.hypot(*mesh.nodes[v][:2]) for v in face) < 0.0581]
            mesh.surfaces["rotor.seat"] = inside
            mesh.surfaces["rotor.high"] = [face for face in mesh.surfaces["rotor.high"] if face not in inside]
            return add_pads(mesh)

        hat = {"Mesh/Clamped": "hat.high", "Mesh/Rotor": "rotor, hat"}
        glued = with_hat(18)
        glued.volumes["rotor"] += glued.volumes.pop("hat")
        glued.weld()
        whole = self.modes_of(glued, **{**hat, "Mesh/Rotor": "rotor"})
        self.assertWithinBars(self.modes_of(with_hat(20), **hat, **{"Joints/Ties": "hat.low : rotor.seat"}), whole)


class Parts(st.TestCase):
    def settings(self, **others):
        return {**BRAKE, "Mesh/Part 1/Volumes": "upper.plate, lower.plate", "Mesh/Part 1/Body": "parts",
                "Mesh/Part 1/Material/Young modulus": 2.1e11, "Mesh/Part 1/Material/Density": 7850,
                "Joints/Ties": "upper.high : upper.plate.low, lower.low : lower.plate.high",
                "Mesh/Guided": "upper.plate.high, lower.plate.low",
                "Mesh/Pressure on": "upper.plate.high, lower.plate.low", **others}

    def brake(self, n_around=(3, 3), plate=True):
        mesh = mesh_files.brake(pads=())
        half = math.radians(25)
        for pad, sign in {"upper": 1, "lower": -1}.items():
            for name, depths, n in [(pad, (0.006, 0.014), n_around[0]), (f"{pad}.plate", (0.014, 0.018), n_around[1])]:
                mesh.sector(name, mesh_files.equal(0.09, 0.14, 2), mesh_files.equal(-half, half, n),
                            sorted(sign * z for z in depths))
        return mesh

    def write_brake(self, **options):
        mesh = self.brake(**options)
        self.write("brake.msh", mesh_files.msh2(mesh))
        return mesh

    def test_bars_of_a_soft_second_side(self):
        """A soft shim on a plate is the second side of a tie and reaches beyond the lining, whose edges lie inside of its
        cells. The lining holds it, too, and the bars know."""
        mesh, half = mesh_files.brake(), math.radians(25)
        for pad, sign in {"upper": 1, "lower": -1}.items():
            layers = [f"{pad}.shim", f"{pad}.plate"][::sign]
            mesh.sector(f"{pad}.back", mesh_files.equal(0.08, 0.15, 2), mesh_files.equal(-1.15 * half, 1.15 * half, 2),
                        sorted(sign * z for z in (0.018, 0.0185, 0.024)), volume_of=lambda k, layers=layers: layers[k])
        self.write("brake.msh", mesh_files.msh2(mesh))
        back = "upper.back.high, lower.back.low"
        settings = self.settings(**{
            "Joints/Ties": "upper.high : upper.back.low, lower.low : lower.back.high", "Mesh/Guided": back,
            "Mesh/Pressure on": back, "Mesh/Part 2/Volumes": "upper.shim, lower.shim", "Mesh/Part 2/Body": "parts",
            "Mesh/Part 2/Material/Young modulus": 1e8, "Mesh/Part 2/Material/Poisson ratio": 0.4,
            "Pads/Material/Young modulus": 2e11, "Eigenproblem/Maximum frequency": 2000})
        modes, finer = self.modes(settings), self.modes({**settings, "Discretization/Degree": 3})
        # All contacts of a pad are at the edge of its area: what they hold together is not taken for uncertain, else bars
        # are noise.
        for ranks, halves in ((2, "true"), (1, "false")):
            others = self.modes({**settings, "Eigenproblem/Mirror symmetry": halves}, ranks=ranks)
            for mode, other in zip(others, modes, strict=True):
                for bar in ("frequency_error_hz", "growth_rate_error_1_per_s"):
                    self.assertAlmostEqual(mode[bar] / other[bar], 1, delta=1e-5)
        self.assertGreater(len(finer), 5)
        self.assertEqual(len(modes), len(finer))
        for mode, fine in zip(modes, finer):
            for value, bar in [("frequency_hz", "frequency_error_hz"),
                               ("growth_rate_1_per_s", "growth_rate_error_1_per_s")]:
                self.assertLessEqual(abs(mode[value] - fine[value]), mode[bar] + fine[bar], (mode["mode"], value))
            self.assertLess(fine["frequency_error_hz"], 0.04 * fine["frequency_hz"], fine["mode"])
            self.assertLess(fine["growth_rate_error_1_per_s"], 15, fine["mode"])

    def test_plates(self):
        """Plates that share the lining's nodes, tied plates with the same nodes, and with others: the first two are one
        problem, the third agrees within its bars."""
        mesh = self.write_brake()
        mesh.weld()
        self.write("glued.msh", mesh_files.msh2(mesh))
        glued = self.modes({**self.settings(**{"Mesh/Part 1/Body": "pads"}), "Mesh/File": "glued.msh",
                            "Joints/Ties": ""})
        tied = self.modes(self.settings())
        self.assertSameModes(eigenvalues(tied), eigenvalues(glued), 1e-7)
        self.write_brake(n_around=(4, 3))
        for mode, expected in zip(self.modes(self.settings()), glued):
            for value, bar in [("frequency_hz", "frequency_error_hz"),
                               ("growth_rate_1_per_s", "growth_rate_error_1_per_s")]:
                self.assertLessEqual(abs(mode[value] - expected[value]), mode[bar] + expected[bar], value)

    def test_other_paths(self):
        """The dense solver, the whole instead of halves, penalty contact, and a sweep give what a single run gives."""
        tiny = {"Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 5000}
        self.write_brake(n_around=(2, 3))
        expected = self.eigenvalues(self.settings(**tiny))
        self.assertGreater(len(expected), 3)
        for what in [{"Eigenproblem/Mirror symmetry": "false"}, {"Eigenproblem/Solver": "krylov"}]:
            with self.subTest(what):
                self.assertSameModes(self.eigenvalues(self.settings(**tiny, **what)), expected, 1e-7)
        for sweep in [{"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.4, 0.6"},
                      {"Sweep/Parameter": "Mesh/Part 1/Material/Young modulus", "Sweep/Values": "1.5e11, 2.1e11"}]:
            with self.subTest(sweep):
                rows = st.read_table(self.analyse(self.settings(**tiny, **sweep)) / "sweep.csv")
                last = max(row["parameter"] for row in rows)
                self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == last], expected, 1e-6)

    def test_plates_on_springs(self):
        """Springs, dashpots and a mass on each plate in place of guides: ranks, halves that there are none of, a sweep,
        error bars and exported matrices agree with a single run; stiffer springs come closer to rigid links."""
        self.write_brake(n_around=(2, 3))
        foot = "{0} : ground : {1} {1} {1} {1} {1} {1}"

        def held(k):
            return self.settings(**{
                "Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 5000, "Mesh/Guided": "",
                "Joints/Points": "up : upper.plate.high, down : lower.plate.low",
                "Joints/Masses": "up : 0.1 1e-4 1e-4 1e-4, down : 0.2",
                "Joints/Springs": ", ".join(foot.format(point, k) for point in ("up", "down")),
                "Joints/Dashpots": "up : down : 20 20 20"})

        expected = self.modes(held(1e8))
        self.assertGreater(len(expected), 3)
        self.assertSameModes(self.eigenvalues(held(1e8), ranks=2), eigenvalues(expected), 1e-7)
        self.assertSameModes(self.eigenvalues({**held(1e8), "Eigenproblem/Solver": "krylov"}),
                             eigenvalues(expected), 1e-7)
        sweep = {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.4, 0.6"}
        rows = st.read_table(self.analyse({**held(1e8), **sweep}) / "sweep.csv")
        self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == 0.6], eigenvalues(expected), 1e-6)
        results = self.analyse({**held(1e8), "Output/Matrices": "true"})
        self.assertRegex((results / "log.txt").read_text(),
                         r"Point 'up' at \(0.11.*, 0.018\) m, the mean motion of 'upper.plate.high' of upper.plate")
        self.assertIn("joint", {row["origin"] for row in st.read_table(results / "contributions.csv")})
        unknowns = export.table(results / "unknowns.csv")
        self.assertEqual([int(row["row"]) for row in unknowns], list(range(len(unknowns))))
        # With a given pressure: stiff springs would carry the load that presses the pads.
        uniform = {"Contact/Steady pressure": "uniform"}
        rigid = {**held(0), **uniform, "Joints/Springs": "", "Joints/Rigid links": "up : ground, down : ground"}
        limit = self.eigenvalues(rigid)
        found = [self.eigenvalues({**held(k), **uniform}) for k in (1e12, 1e14)]
        distance = [max(min(abs(l - m) for m in modes) for l in limit[:3]) for modes in found]
        self.assertLess(distance[1], 0.02 * distance[0])

    def test_springs_of_nearly_nothing(self):
        """Plates on 1e-4 N/m, or as heavy as a mountain, move at nearly no frequency; all other modes are found beside that."""
        self.write_brake(n_around=(2, 3))
        foot = "{0} : ground : 1e-4 1e-4 1e-4 1e-4 1e-4 1e-4"
        cases = {"soft": {"Joints/Springs": ", ".join(foot.format(point) for point in ("up", "down")), "Mesh/Guided": "",
                          "Contact/Steady pressure": "uniform"},
                 "heavy": {"Joints/Masses": "up : 1e18"}}
        for name, joints in cases.items():
            with self.subTest(name):
                case = self.settings(**{
                    "Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 5000,
                    "Joints/Points": "up : upper.plate.high, down : lower.plate.low", **joints})
                expected = self.eigenvalues({**case, "Eigenproblem/Solver": "dense"})
                self.assertGreater(len(expected), 3)
                self.assertSameModes(self.eigenvalues(case), expected, 1e-7)

    def test_exported_matrices(self):
        """M, P, Q with the tie's rows, a line of unknowns.csv for each, and eigenvectors that they belong to."""
        self.write_brake(n_around=(2, 3))
        results = self.analyse(self.settings(**{"Discretization/Degree": 1, "Output/Matrices": "true"}))
        (n, _), Q = export.sparse(results / "Q.mtx")
        M, P = (export.sparse(results / f"{name}.mtx")[1] for name in "MP")
        unknowns = export.table(results / "unknowns.csv")
        self.assertEqual([int(row["row"]) for row in unknowns], list(range(n)))
        joints = [row for row in unknowns if row["body"] == "joints"]
        self.assertEqual(collections.Counter(row["component"] for row in joints), dict.fromkeys("xyz", 2 * 3 * 3))
        for l, x in zip(map(st.eigenvalue, st.read_table(results / "modes.csv")),
                        export.dense(results / "right_vectors.mtx")):
            parts = [export.times(A, [c * value for value in x], n) for A, c in [(M, l * l), (P, l), (Q, 1)]]
            residual = math.sqrt(sum(abs(sum(values))**2 for values in zip(*parts)))
            self.assertLessEqual(residual, 1e-9 * math.sqrt(sum(abs(value)**2 for value in parts[2])) + 1e-6)

    def test_refusals(self):
        self.write_brake()
        good = self.settings()
        for changed, words in [
                ({"Joints/Ties": "upper.high : rotor.high"}, "tie across the sliding surface"),
                ({"Joints/Ties": "upper.high : nothing"}, "there is no surface group 'nothing'"),
                ({"Joints/Ties": "upper.high upper.plate.low"}, "is not a pair"),
                ({"Joints/Ties": "upper.high : lower.plate.high, lower.low : upper.plate.low"}, "only 0 % of"),
                ({"Joints/Ties": good["Joints/Ties"] + ", upper.high : lower.plate.high"}, "would be tied twice"),
                ({"Joints/Ties": "upper.high : upper.plate.low"}, "no joint"),
                ({"Eigenproblem/Solver": "block_davidson"}, "has no joints"),
                ({"Static equilibrium/Linear solver": "iterative"}, "has no joints"),
                ({"Mesh/Guided": "", "Mesh/Fixed in x": "upper.plate.high, lower.plate.low"}, "tied to it"),
                ({"Scene": "brake"}, "joints connect the bodies of a mesh file")]:
            with self.subTest(words):
                self.write("refused.prm", st.parameter_file({**good, **changed}))
                result = st.run("refused.prm", directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertIn(words, result.stderr)


class OnSprings(st.TestCase):
    """Masses, springs, dashpots and rigid links beside a disc without pads: closed forms of rigid bodies."""

    SETTINGS = {**mesh_files.SCENE, "Mesh/File": "brake.msh", "Mesh/Pads": "", "Mesh/Contact pairs": "",
                "Mesh/Guided": "", "Mesh/Pressure on": "", "Discretization/Degree": 1, "Output/Fields": "none",
                "Stage": "elastic", "Eigenproblem/Maximum frequency": 400, "Eigenproblem/Error bars": "false"}
    MASS, INERTIA = 2.5, (0.02, 0.03, 0.04)
    SPRINGS, DAMPERS = (1e6, 2e6, 3e6, 2e4, 5e4, 7e4), (30, 40, 50, 2, 3, 4)

    def block(self):
        mesh = mesh_files.brake(rotor_cells=(2, 12, 1), pads=())
        half = 0.02
        mesh.sector("block", [1, 1.1], [-half, half], [0, 0.1])
        mesh.nodes = [x if math.hypot(x[0], x[1]) < 0.5 else
                      (math.hypot(*x[:2]) + 0.2, 0.05 * math.atan2(x[1], x[0]) / half, x[2]) for x in mesh.nodes]
        self.write("brake.msh", mesh_files.msh2(mesh))

    def assertHasModes(self, settings, expected, tolerance, **options):
        computed = self.eigenvalues({**self.SETTINGS, **settings}, **options)
        for value in expected:
            nearest = min(computed, key=lambda l: abs(l - value))
            self.assertLessEqual(abs(nearest - value), tolerance * abs(value), (value, computed))

    @staticmethod
    def damped(m, c, k):
        return complex(-c / (2 * m), math.sqrt(k / m - (c / (2 * m))**2))

    def test_mass_in_space(self):
        """Six uncoupled oscillators: m l^2 + c l + k = 0."""
        self.write("brake.msh", mesh_files.msh2(mesh_files.brake(rotor_cells=(2, 12, 1), pads=())))
        number = lambda values: " ".join(map(str, values))
        joints = {"Joints/Points": "weight : 0.3 0.1 0.2", "Joints/Masses": f"weight : {self.MASS} {number(self.INERTIA)}",
                  "Joints/Springs": f"weight : ground : {number(self.SPRINGS)}"}
        masses = [self.MASS] * 3 + list(self.INERTIA)
        self.assertHasModes(joints, [self.damped(m, 0, k) for m, k in zip(masses, self.SPRINGS)], 1e-9)
        joints = {**joints, "Joints/Dashpots": f"weight : ground : {number(self.DAMPERS)}", "Stage": "full"}
        expected = [self.damped(m, c, k) for m, c, k in zip(masses, self.DAMPERS, self.SPRINGS)]
        for ranks in (1, 2):
            self.assertHasModes(joints, expected, 1e-9, ranks=ranks)
        # Along with the error bars, which the point does not have, and with the dense solver
        self.assertHasModes({**joints, "Eigenproblem/Error bars": "true"}, expected, 1e-9)
        self.assertHasModes({**joints, "Eigenproblem/Solver": "dense"}, expected, 1e-8)

    def test_rigid_link(self):
        """A weight on an arm d along x: z and the rotation b about y of the sprung point couple by z_2 = z - d b."""
        self.write("brake.msh", mesh_files.msh2(mesh_files.brake(rotor_cells=(2, 12, 1), pads=())))
        m_1, m_2, inertia, d, k, k_b = 1.5, 2.0, 0.01, 0.2, 1e6, 3e4
        joints = {"Joints/Points": "foot : 0.3 0 0, weight : 0.5 0 0", "Joints/Rigid links": "foot : weight",
                  "Joints/Masses": f"foot : {m_1} {inertia} {inertia} {inertia}, weight : {m_2}",
                  "Joints/Springs": f"foot : ground : {k} {k} {k} {k_b} {k_b} {k_b}"}
        # det(K - w^2 M) = 0 with M = [[m_1 + m_2, -m_2 d], [-m_2 d, inertia + m_2 d^2]]
        a = (m_1 + m_2) * (inertia + m_2 * d**2) - (m_2 * d)**2
        b = -(k * (inertia + m_2 * d**2) + k_b * (m_1 + m_2))
        roots = [(-b + sign * math.sqrt(b * b - 4 * a * k * k_b)) / (2 * a) for sign in (-1, 1)]
        expected = [complex(0, math.sqrt(root)) for root in roots]
        expected += [complex(0, math.sqrt(k / (m_1 + m_2))), complex(0, math.sqrt(k_b / inertia))]
        high = {"Eigenproblem/Maximum frequency": 700}
        self.assertHasModes({**joints, **high}, expected, 1e-9)
        # The link turned round gives the same body, and one to the ground holds it.
        turned = {**joints, "Joints/Rigid links": "weight : foot"}
        self.assertHasModes({**turned, **high}, expected, 1e-9)
        held = {**turned, "Joints/Rigid links": "weight : foot, weight : ground"}
        computed = self.eigenvalues({**self.SETTINGS, **held, **high, "Eigenproblem/Maximum frequency": 4000})
        self.assertGreater(len(computed), 0)
        self.assertTrue(all(min(abs(l - value) for l in computed) > 1 for value in expected))

    def test_stiff_block(self):
        """A block of 0.1 m that hardly deforms, on springs at its lower face."""
        self.block()
        k, m, a = 1e6, 7850e-3, 0.1
        settings = {"Mesh/Part 1/Volumes": "block", "Mesh/Part 1/Body": "parts", "Mesh/Curved bodies": "rotor",
                    "Mesh/Part 1/Material/Young modulus": 1e14, "Mesh/Part 1/Material/Density": 7850,
                    "Joints/Points": "foot : block.low",
                    "Joints/Springs": f"foot : ground : {k} {k} {k} {k / 100} {k / 100} {k / 100}"}
        # Along z, and about it
        expected = [complex(0, math.sqrt(k / m)), complex(0, math.sqrt(k / 100 / (m * a * a / 6)))]
        # x and the rotation b about y: the centre is a/2 above the foot, x_c = x + b a/2.
        inertia, h, r = m * a * a / 6, a / 2, k / 100
        A, B = m * (inertia + m * h * h) - (m * h)**2, -(k * (inertia + m * h * h) + r * m)
        expected += [complex(0, math.sqrt((-B + sign * math.sqrt(B * B - 4 * A * k * r)) / (2 * A))) for sign in (-1, 1)]
        self.assertHasModes(settings, expected, 1e-6)
        self.assertHasModes({**settings, "Discretization/Degree": 2}, expected, 1e-6, ranks=2)
        bars = self.modes({**self.SETTINGS, **settings, "Eigenproblem/Error bars": "true"})
        for value in expected:
            mode = min(bars, key=lambda row: abs(st.eigenvalue(row) - value))
            self.assertLessEqual(abs(mode["frequency_hz"] - value.imag / (2 * math.pi)),
                                 mode["frequency_error_hz"] + 1e-4)  # the closed form is of a rigid block
            self.assertLess(mode["frequency_error_hz"], 1e-3)

    def test_refusals(self):
        self.block()
        point = {"Joints/Points": "foot : block.low", "Mesh/Part 1/Volumes": "block", "Mesh/Part 1/Body": "parts"}
        for changed, words in [
                ({"Joints/Points": "foot : nothing"}, "there is no surface group 'nothing'"),
                ({"Joints/Points": "foot"}, "is not a point"),
                ({"Joints/Points": "foot : block.low, foot : block.high"}, "two points 'foot'"),
                ({"Joints/Masses": "hand : 1"}, "there is no point 'hand'"),
                ({"Joints/Masses": "foot : -1"}, "none negative"),
                ({"Joints/Springs": "foot : ground : 1 2"}, "'foot : ground : 1 2' is not"),
                ({"Joints/Springs": "ground : foot : 1 2 3"}, "there is no point 'ground'"),
                ({"Joints/Points": "foot : block.low, top : block.high", "Joints/Rigid links": "foot : top, top : foot"},
                 "closes a ring of links"),
                ({"Joints/Points": "foot : block.low, free : 1 2 3"}, "the point 'free' can move freely"),
                ({"Stage": "full", "Joints/Points": "foot : block.low, wheel : rotor.outer"}, "is on the rotor, which turns")]:
            with self.subTest(words):
                self.write("refused.prm", st.parameter_file({**self.SETTINGS, **point, **changed}))
                result = st.run("refused.prm", directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertIn(words, result.stderr)


def eigenvalues(modes):
    return [st.eigenvalue(row) for row in modes]


if __name__ == "__main__":
    unittest.main(verbosity=2)
