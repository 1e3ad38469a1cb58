"""Tetrahedra and wedges at their own nodes (Mesh/Tetrahedra = own)."""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import element_files  # noqa: E402
import error_statistics as es  # noqa: E402
import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

PART = {"Scene": "mesh", "Stage": "elastic", "Mesh/File": "part.msh", "Mesh/Rotor": "", "Mesh/Part 1/Volumes": "part",
        "Mesh/Part 1/Body": "parts", "Mesh/Curved bodies": "none", "Output/Fields": "none",
        "Eigenproblem/Maximum frequency": 42000}
BRAKE = {**st.SMALL_BRAKE, **mesh_files.SCENE, "Discretization/Degree": 2, "Mesh/Curved bodies": "rotor", "Mesh/File": "brake.msh"}


def block(n):
    """120, 60 and 30 mm."""
    mesh = mesh_files.Mesh()
    mesh.sector("part", mesh_files.equal(1, 1.12, 4 * n), mesh_files.equal(-0.03, 0.03, 2 * n), mesh_files.equal(0, 0.03, n))
    mesh.nodes = [(math.hypot(x, y) - 1, math.atan2(y, x), z) for x, y, z in mesh.nodes]
    return mesh


def brake(n_corners, quadratic=True):
    """The default brake with pads of such elements."""
    elements = element_files.Elements(mesh_files.brake(), lambda name: 8 if name == "rotor" else n_corners)
    if quadratic:
        elements.make_quadratic({"rotor": element_files.on_circle})
    return elements


class Part(st.TestCase):
    def solve(self, elements, **settings):
        self.write("part.msh", element_files.msh2(elements))
        results = self.analyse({**PART, **settings})
        self.assertIn("6 rigid-body modes", (results / "log.txt").read_text())
        return st.read_table(results / "modes.csv"), st.read_table(results / "cycles.csv")[0]

    def test_unknowns_frequencies_and_bars(self):
        """A free block: three unknowns a node, six rigid motions, frequencies of a finer discretisation within the bars,
        which are not long."""
        reference = self.solve(element_files.Elements(block(1), lambda name: 8), **{
            "Discretization/Degree": 5, "Eigenproblem/Error bars": "false"})[0]
        exact = [row["frequency_hz"] for row in reference][:8]
        self.assertEqual(len(exact), 8)
        for n_corners, degree, n, refinements in ((4, 2, 2, 0), (6, 2, 2, 0), (4, 3, 1, 0), (4, 2, 1, 1)):
            with self.subTest(corners=n_corners, degree=degree, refinements=refinements):
                elements = element_files.Elements(block(n), lambda name: n_corners)
                elements.make_quadratic()
                modes, cycle = self.solve(elements, **{"Discretization/Degree": degree, "Mesh/Refinements": refinements})
                if (n_corners, degree, refinements) == (4, 2, 0):
                    self.assertEqual(cycle["dofs"], 3 * len(elements.nodes))
                errors = [(row["frequency_hz"] - f, row["frequency_error_hz"], f)
                          for row, f in zip(modes, exact)]
                self.assertEqual(len(errors), len(exact))
                self.assertTrue(all(error > -1e-4 * f for error, _, f in errors), "Rayleigh-Ritz: from above")
                self.assertTrue(all(abs(error) <= bar for error, bar, _ in errors), errors)
                self.assertLess(sorted(bar / abs(error) for error, bar, _ in errors)[len(errors) // 2], 4)
                self.assertLess(max(abs(error) / f for error, _, f in errors), 0.025)

    def test_a_disc_of_tetrahedra_turns(self):
        """A body of revolution of tetrahedra with transport: the frequencies of one of hexahedra within the bars, and
        without friction nothing grows."""
        settings = {**dict.fromkeys(["Mesh/Pads", "Mesh/Contact pairs", "Mesh/Guided", "Mesh/Pressure on"], ""),
                    "Stage": "full", "Operation/Angular velocity": 100, "Eigenproblem/Maximum frequency": 2500,
                    "Rotor/Material/Stiffness proportional damping": 0}
        both = []
        for n_corners in (8, 4):
            elements = element_files.Elements(mesh_files.brake((2, 24, 1), pads=()), lambda name: n_corners)
            elements.make_quadratic({"rotor": element_files.on_circle})
            self.write("brake.msh", element_files.msh2(elements))
            modes = st.read_table(self.analyse({**BRAKE, **settings}) / "modes.csv")
            self.assertLess(max(abs(row["growth_rate_1_per_s"]) for row in modes), 1e-5)
            both.append(modes)
        self.assertGreater(min(map(len, both)), 6)
        for a, b in zip(*(modes[:7] for modes in both)):
            self.assertLessEqual(abs(a["frequency_hz"] - b["frequency_hz"]), a["frequency_error_hz"] + b["frequency_error_hz"])


    def test_flat_tetrahedra(self):
        """A clamped disc of one layer of flat curved tetrahedra against the rotor's table: one degree more has the disc's
        shape, and the whole disc answers to it, so that bars hold and are short. (They were 25 and 8 times the error.)"""
        exact = sorted(row["frequency_hz"] for row in st.read_table(st.REFERENCE / "rotor_T1.csv")
                       for _ in range(round(row["multiplicity"])) if row["frequency_hz"] < 2500)
        elements = element_files.Elements(mesh_files.brake((3, 24, 1), pads=()), lambda name: 4)
        elements.make_quadratic({"rotor": element_files.on_circle})
        self.write("brake.msh", element_files.msh2(elements))
        for degree in (2, 3):
            with self.subTest(degree=degree):
                modes = st.read_table(self.analyse({
                    **BRAKE, **dict.fromkeys(["Mesh/Pads", "Mesh/Contact pairs", "Mesh/Guided", "Mesh/Pressure on"], ""),
                    "Stage": "elastic", "Discretization/Degree": degree, "Eigenproblem/Maximum frequency": 2500}) / "modes.csv")
                self.assertEqual(len(modes), len(exact))
                for row, f in zip(modes, exact):
                    self.assertLess(abs(row["corrected_frequency_hz"] - f), 0.5 * abs(row["frequency_hz"] - f))
                    self.assertLess(abs(row["frequency_hz"] - f), row["frequency_error_hz"])
                    self.assertLess(row["frequency_error_hz"], 4 * abs(row["frequency_hz"] - f))


class Ties(st.TestCase):
    def test_bars_of_tied_blocks(self):
        """Bars of two blocks that are tied, the first or both of tetrahedra or wedges, cover and are a few times the error."""
        def modes_of(n, corners, degree=2):
            mesh = mesh_files.Mesh()
            for number, name in enumerate("ab"):
                mesh.sector(name, mesh_files.equal(1, 1.12, 2 * n[number]), mesh_files.equal(-0.03, 0.03, n[number]),
                            mesh_files.equal(0.03 * number, 0.03 * number + 0.03, n[number] // 2))
            mesh.nodes = [(math.hypot(x, y) - 1, math.atan2(y, x), z) for x, y, z in mesh.nodes]
            elements = element_files.Elements(mesh, lambda name: corners["ab".index(name)])
            elements.make_quadratic()
            self.write("part.msh", element_files.msh2(elements))
            settings = {**PART, "Mesh/Part 1/Volumes": "a, b", "Joints/Ties": "a.high : b.low", "Discretization/Degree": degree,
                        "Eigenproblem/Maximum frequency": 16000}
            return st.read_table(self.analyse(settings) / "modes.csv")
        exact = [row["frequency_hz"] for row in modes_of((2, 2), (8, 8), 4)]
        self.assertEqual(len(exact), 3)
        for n, corners in (((2, 2), (4, 8)), ((4, 2), (4, 8)), ((2, 2), (4, 4)), ((2, 2), (6, 8)), ((2, 2), (8, 4))):
            with self.subTest(cells=n, corners=corners):
                ratios = sorted(row["frequency_error_hz"] / abs(row["frequency_hz"] - f)
                                for row, f in zip(modes_of(n, corners), exact))
                self.assertGreater(ratios[0], 1)
                self.assertLess(ratios[-1], 6)


class Refinements(st.TestCase):
    def test_elements_and_cells(self):
        """Elements of a file are divided as cells of the mesh are: hexahedra curved by middle nodes, those of the rotor on
        circles. The meshes of a uniform refinement of tetrahedra are those of files that are refined so often."""
        one_pad = {"Mesh/Pads": "upper", "Mesh/Contact pairs": "upper.low : rotor.high", "Mesh/Guided": "upper.high",
                   "Mesh/Pressure on": "upper.high"}
        for n_corners in (8, 4):
            elements = element_files.Elements(mesh_files.brake((2, 12, 1), (1, 2, 1), pads=("upper",)),
                                              lambda name: 8 if name == "rotor" else n_corners)
            elements.make_quadratic({"rotor": element_files.on_circle, "upper": element_files.on_circle})
            self.write("brake.msh", element_files.msh2(elements))
            settings = {**BRAKE, **one_pad, "Eigenproblem/Error bars": "false", "Eigenproblem/Maximum frequency": 1500}
            once = st.read_table(self.analyse({**settings, "Mesh/Refinements": 1}) / "modes.csv")
            cycles = st.read_table(self.analyse({**settings, "Refinement/Strategy": "uniform", "Refinement/Cycles": 2}) / "modes.csv")
            self.assertSameModes([st.eigenvalue(row) for row in once],
                                 [st.eigenvalue(row) for row in cycles if row["cycle"] == 1], 1e-9)


class Brake(st.TestCase):
    def solve(self, elements, ranks=1, **settings):
        self.write("brake.msh", element_files.msh2(elements))
        results = self.analyse({**BRAKE, **settings}, ranks=ranks)
        return st.read_table(results / "modes.csv"), st.read_table(results / "static.csv")

    def test_elements_and_ranks(self):
        """Pads of tetrahedra and wedges: the brake of hexahedra within the bars of both. Ranks have the same modes, bars,
        forces, and corrected values."""
        expected, _ = self.solve(brake(8))
        for n_corners in (4, 6):
            with self.subTest(corners=n_corners):
                modes, static = self.solve(brake(n_corners))
                self.assertEqual(len(modes), len(expected))
                for a, b in zip(modes, expected):
                    for value, error in [("frequency_hz", "frequency_error_hz"),
                                         ("growth_rate_1_per_s", "growth_rate_error_1_per_s")]:
                        self.assertLessEqual(abs(a[value] - b[value]), a[error] + b[error], (value, a, b))
                others, other_static = self.solve(brake(n_corners), 3 if n_corners == 4 else 2)
                self.assertSameModes([st.eigenvalue(row) for row in modes], [st.eigenvalue(row) for row in others], 1e-9)
                for a, b in zip(modes, others):
                    for column in ("frequency_error_hz", "growth_rate_error_1_per_s"):
                        self.assertLess(abs(a[column] - b[column]), 1e-5 * a[column] + 1e-6, column)
                for a, b in zip(static, other_static):
                    self.assertLess(abs(a["normal_force_n"] - b["normal_force_n"]), 1e-8 * a["normal_force_n"])

    def test_constant_pressure(self):
        """Contact on triangles: a ring on a ring that is held from below, both without Poisson's ratio, on meshes that do not
        match, has the pressure of its load everywhere."""
        angles = mesh_files.equal(0, 2 * math.pi, 12)
        for n_pad, n_rotor in ((4, 8), (8, 4), (6, 4)):
            mesh = mesh_files.Mesh()
            mesh.sector("rotor", [0.05, 0.09, 0.14], angles, [-0.006, 0.006], ring=True)
            mesh.sector("upper", [0.05, 0.07, 0.11, 0.14], angles, [0.006, 0.018], ring=True)
            elements = element_files.Elements(mesh, lambda name: n_rotor if name == "rotor" else n_pad)
            elements.make_quadratic({name: element_files.on_circle for name in mesh.volumes})
            self.write("brake.msh", element_files.msh2(elements))
            results = self.analyse({
                **BRAKE, "Stage": "friction", "Mesh/Pads": "upper", "Mesh/Contact pairs": "upper.low : rotor.high",
                "Mesh/Guided": "upper.high", "Mesh/Pressure on": "upper.high", "Mesh/Clamped": "rotor.low", "Pads/Pressure": 1e6,
                "Contact/Friction/Coefficient": 0, "Pads/Material/Poisson ratio": 0, "Rotor/Material/Poisson ratio": 0,
                "Eigenproblem/Solver": "none"})
            [pad] = st.read_table(results / "static.csv")
            self.assertLess(abs(pad["max_pressure_pa"] / 1e6 - 1), 2e-10)
            self.assertLess(abs(pad["normal_force_n"] / (1e6 * pad["contact_area_m2"]) - 1), 1e-6)

    def test_formulations_and_materials(self):
        """What pads of tetrahedra have on them: penalties, lift-off, prestress, lossy: values differ from those of divided
        elements by the bars of both at most. Each run has one of the penalties and one of the terms."""
        for name, settings in {
                "penalty, loss": {"Contact/Formulation": "penalty", "Contact/Penalty stiffness": 1e13,
                                  "Pads/Material/Loss factor": 0.02},
                "mortar_penalty, prestress": {"Contact/Formulation": "mortar_penalty", "Contact/Penalty stiffness": 1e13,
                                              "Prestress/Stress stiffness": "true"}}.items():
            with self.subTest(name):
                own, divided = (self.solve(brake(4), **settings, **{"Mesh/Tetrahedra": kind})[0]
                                for kind in ("own", "divided"))
                self.assertEqual(len(own), len(divided))
                for a, b in zip(own, divided):
                    for value, error in [("frequency_hz", "frequency_error_hz"),
                                         ("growth_rate_1_per_s", "growth_rate_error_1_per_s")]:
                        self.assertLessEqual(abs(a[value] - b[value]), a[error] + b[error], (value, a, b))

    def test_against_reference(self):
        """C3D10 pads on a disc of hexahedra against the independent eigenvalues of table T6."""
        self.write("t6.msh", element_files.msh2(element_files.brake_graded_at_the_clamp(4)))
        modes = st.read_table(self.analyse(es.settings_of_file("T6", "t6.msh", 3), timeout=900) / "modes.csv")
        comparisons = es.compare("T6", modes)
        self.assertEqual(len(comparisons), 25)
        for c in comparisons:
            self.assertLess(abs(st.eigenvalue(c.row) - c.reference), 3e-3 * abs(c.reference))
        statistics = es.statistics(comparisons)
        self.assertEqual(statistics.covered, {"frequency": 25, "growth": 25})
        self.assertLess(max(statistics.median.values()), 4)

    def test_what_is_refused(self):
        self.write("brake.msh", element_files.msh2(brake(4)))
        for settings, words in [({"Discretization/Degree": 4}, "Degree = 4"),
                                ({"Refinement/Contact edge levels": 1}, "Contact edge levels"),
                                ({"Static equilibrium/Linear solver": "iterative"}, "iterative")]:
            self.write("brake.prm", {**BRAKE, **settings})
            result = st.run("brake.prm", directory=self.directory, timeout=60)
            self.assertEqual(result.returncode, 2, (settings, result.stdout + result.stderr))
            self.assertIn("Mesh/Tetrahedra", result.stderr)
            self.assertIn(words, result.stderr)
            self.assertIn("divided", result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
