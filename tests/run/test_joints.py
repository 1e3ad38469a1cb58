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
        for ranks in (2, 3):
            self.assertSameModes(eigenvalues(self.modes({**BRAKE, **cut}, ranks=ranks)), eigenvalues(tied), 1e-7)

    def test_disc_around(self):
        """A cylindrical tie: the disc inside of the pads, 18 cells around, and the ring that they touch, 20."""
        whole = self.modes_of(mesh_files.brake(rotor_cells=(4, 18, 1)))
        mesh = add_pads(disc([("rotor", [0.05, 0.075], 18, (LOW, HIGH)),
                              ("ring", mesh_files.equal(0.075, 0.15, 3), 20, (LOW, HIGH))]))
        tied = self.modes_of(mesh, **{"Mesh/Rotor": "rotor, ring", "Joints/Ties": "ring.inner : rotor.outer",
                                      "Mesh/Contact pairs": "upper.low : ring.high, lower.high : ring.low"})
        self.assertWithinBars(tied, whole)


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
        expected = eigenvalues(self.modes(self.settings(**tiny)))
        self.assertGreater(len(expected), 3)
        for what in [{"Eigenproblem/Mirror symmetry": "false"}, {"Eigenproblem/Solver": "krylov"}]:
            with self.subTest(what):
                self.assertSameModes(eigenvalues(self.modes(self.settings(**tiny, **what))), expected, 1e-7)
        for sweep in [{"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.4, 0.6"},
                      {"Sweep/Parameter": "Mesh/Part 1/Material/Young modulus", "Sweep/Values": "1.5e11, 2.1e11"}]:
            with self.subTest(sweep):
                rows = st.read_table(self.analyse(self.settings(**tiny, **sweep)) / "sweep.csv")
                last = max(row["parameter"] for row in rows)
                self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == last], expected, 1e-6)

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


def eigenvalues(modes):
    return [st.eigenvalue(row) for row in modes]


if __name__ == "__main__":
    unittest.main(verbosity=2)
