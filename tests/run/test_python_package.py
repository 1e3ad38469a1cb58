"""The package python/: running, reading, matrices, shapes; and that pip installs it without a network."""

import os
import pathlib
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

st.start_with_python_that_has("numpy", "scipy.sparse.linalg")

import numpy  # noqa: E402

sys.path.insert(0, str(st.PROJECT / "python"))
import squeal  # noqa: E402

BRAKE = {**st.TINY_BRAKE, "Output/Fields": "all", "Output/Animation frames": 1, "Output/Matrices": "true",
         "Eigenproblem/Maximum frequency": 3000}


class Package(st.TestCase):
    def setUp(self):
        super().setUp()
        self.file = self.write("brake.prm", BRAKE)
        os.environ["SQUEAL"] = str(st.SQUEAL)
        os.environ.update(OMP_NUM_THREADS="1")

    def run_squeal(self, name, **overrides):
        return squeal.run(self.file, **{"Output/Directory": self.directory / name, **overrides})

    def test_run_and_read(self):
        results = self.run_squeal("a", **{"Contact/Friction/Coefficient": numpy.float64(0.25), "Discretization/Align rotor": False,
                                          "Discretization/Rotor cells": (2, 10, 1)})
        self.assertEqual(results.directory, self.directory / "a")
        self.assertEqual(float(results.parameters["Contact/Friction/Coefficient"]), 0.25)
        self.assertEqual(results.parameters["Discretization/Align rotor"], "false")
        self.assertEqual(results.parameters["Discretization/Rotor cells"], "2, 10, 1")
        expected = st.read_table(self.directory / "a/modes.csv")
        self.assertGreater(len(expected), 2)
        for results in (results, squeal.read(self.directory / "a")):
            self.assertEqual([int(mode) for mode in results.modes["mode"]], [row["mode"] for row in expected])
            for column in ("frequency_hz", "growth_rate_error_1_per_s", "verdict"):
                self.assertEqual(list(results.modes[column]), [row[column] for row in expected])
            self.assertEqual(list(results.eigenvalues), [st.eigenvalue(row) for row in expected])
            self.assertIn("friction constant 0.25", results.log)

    def test_byte_order_mark(self):
        """Tables that another program saved with a mark in front are read as they were."""
        table = self.directory / "t.csv"
        table.write_text("frequency_hz,verdict\n1.5,stable\n", encoding="utf-8-sig")
        rows = squeal.results.read_table(table)
        self.assertEqual(rows.dtype.names, ("frequency_hz", "verdict"))
        self.assertEqual(list(rows["frequency_hz"]), [1.5])

    def test_empty_fields_and_last_mesh(self):
        results = self.run_squeal("a", **{"Refinement/Strategy": "uniform", "Refinement/Cycles": 2, "Output/Fields": "none",
                                          "Output/Matrices": False, "Eigenproblem/Error bars": False, "Discretization/Degree": 1})
        self.assertEqual(set(results.table("modes")["cycle"]), {0, 1})
        self.assertEqual(set(results.modes["cycle"]), {1})
        self.assertTrue(numpy.isnan(results.modes["growth_rate_error_1_per_s"]).all())

    def test_sample(self):
        """Distributions as text and as tuples, a correlation, a file of samples; probabilities as their table has them."""
        brief = {"Output/Fields": "none", "Output/Matrices": False, "Eigenproblem/Error bars": False}
        uncertain = {"Contact/Friction/Coefficient": ("uniform", 0.2, numpy.float64(0.7)), "Pads/Pressure": "normal 1e6 1e5"}
        results = squeal.sample(self.file, uncertain, 4, correlation=[[1, 0.5], [0.5, 1]], indices=False,
                                **{"Output/Directory": self.directory / "a", **brief})
        samples = results.table("samples")
        self.assertEqual(len(samples), 4)
        frictions = samples["Contact/Friction/Coefficient"]
        self.assertTrue(0.2 < frictions.min() < frictions.max() < 0.7)
        self.assertEqual(results.parameters["Sampling/Correlation"].replace(" ", ""), "1,0.5;0.5,1")
        of_all = results.table("probability")[0]
        self.assertAlmostEqual(of_all["probability"], (samples["growth_rate_1_per_s"] > 0).mean())

        given = self.directory / "given.csv"
        given.write_text("Contact/Friction/Coefficient\n" + "\n".join(repr(float(value)) for value in frictions[:2]) + "\n")
        of_file = squeal.sample(self.file, given, **{"Output/Directory": self.directory / "b", **brief})
        self.assertEqual(list(of_file.table("samples")["Contact/Friction/Coefficient"]), list(frictions[:2]))

    def test_failures(self):
        with self.assertRaisesRegex(squeal.InputError, "unknown key 'Output/Matrces'.*Output/Matrices") as caught:
            self.run_squeal("a", **{"Output/Matrces": True})
        self.assertEqual(caught.exception.status, 2)
        with self.assertRaises(FileNotFoundError):
            squeal.read(self.directory / "nothing")

    def test_another_program(self):
        """One that ends well and writes no results is not squeal."""
        with self.assertRaisesRegex(squeal.ProgramError, "ended without results"):
            squeal.run(self.file, program="/bin/true")
        with self.assertRaises(squeal.ProgramError):
            squeal.run(self.file, program="/bin/false")

    def test_damaged_files(self):
        """DamagedError, whatever is wrong; a table without lines is one."""
        directory = pathlib.Path(self.directory)
        (directory / "log.txt").write_text("")
        results, modes = squeal.read(directory), directory / "modes.csv"
        header = "cycle,mode,growth_rate_1_per_s,frequency_hz,verdict\n"
        for text in ("", "\n", "a,a\n1,2\n", "mode,frequency_hz\n1,2\n", header + "x,1,2,3,stable\n",
                     header.replace("cycle", "circle") + "0,1,2,3,stable\n", header + "0,1,2\0,3,stable\n",
                     header + ",1,2,3,stable\n", header + "0,1,2," + "3" * 200000 + ",stable\n"):
            modes.write_text(text)
            with self.assertRaisesRegex(squeal.DamagedError, "modes.csv", msg=text[:60]):
                print(results.modes)
            with self.assertRaises(squeal.DamagedError):
                results.shape(1)
        modes.write_text(header)
        self.assertEqual(len(results.modes), 0)
        self.assertEqual(len(results.eigenvalues), 0)
        with self.assertRaisesRegex(FileNotFoundError, "no modes"):
            results.shape(1)
        modes.unlink()
        os.mkfifo(modes)
        with self.assertRaises(squeal.DamagedError):
            print(results.modes)
        (directory / "parameters.prm").write_text("end\nset A = 1\n")
        self.assertEqual(results.parameters, {"A": "1"})
        (directory / "M.mtx").write_text("%%MatrixMarket matrix coordinate real general\n2 2 5\n1 1 x\n")
        with self.assertRaises(squeal.DamagedError):
            results.matrix("M")
        for text in ("", "<a/>", '<VTKFile><Piece Source="p.vtu"/></VTKFile>'):
            (directory / "mode-0-001.pvtu").write_text(text)
            (directory / "p.vtu").write_text("<VTKFile><Piece NumberOfCells='1'><Points/></Piece></VTKFile>")
            with self.assertRaises(squeal.DamagedError):
                results.shape(1, cycle=0)

    def test_one_body_for_all_points(self):
        """u = (x, y, z) at other points: of body 0, which is not given, given once, or for each; wrong numbers are refused."""
        generator = numpy.random.default_rng(1)
        nodes, points = generator.random((50, 3)), generator.random((7, 3))
        shape = squeal.Shape(nodes, nodes)
        for body in (None, 0, 0.0, [0] * 7, numpy.zeros((), int)):
            numpy.testing.assert_allclose(shape.at(points, body), points, atol=1e-6)
        for body in ([0, 0], [[0]] * 7, float("nan"), [float("nan")] * 7, 1, "rotor"):
            with self.assertRaises(ValueError):
                shape.at(points, body)
        for wrong in (points[0], points[:, :2]):
            with self.assertRaises(ValueError):
                shape.at(wrong)
        self.assertEqual(list(squeal.MeasuredShape(points, points, points[:, 0], 2).body), [2] * 7)

    def test_matrices(self):
        """(l^2 M + l P + Q) x = 0 for the modes of the table, with scipy's matrices."""
        results = self.run_squeal("a")
        M, P, Q = results.matrices()
        x, l = results.matrix("right_vectors"), results.matrix("eigenvalues").ravel()
        numpy.testing.assert_allclose(l, results.eigenvalues, rtol=1e-9)
        for j, value in enumerate(l):
            terms = value**2 * (M @ x[:, j]), value * (P @ x[:, j]), Q @ x[:, j]
            self.assertLess(numpy.linalg.norm(sum(terms)), 1e-8 * max(map(numpy.linalg.norm, terms)))

    def test_mac(self):
        a = numpy.array([[1, 1], [1j, -1j], [0, 0]])
        numpy.testing.assert_allclose(squeal.mac(a, 3j * a), numpy.eye(2), atol=1e-15)
        numpy.testing.assert_allclose(squeal.mac(numpy.array([1, 0, 0]), numpy.array([1, 1, 0])), [[0.5]])

    def test_shapes(self):
        """A mode is like itself, and like itself on another mesh; the pairs of a plain disc have no shape of their own."""
        mesh = {"Discretization/Rotor cells": "3, 18, 1", "Discretization/Pad cells": "2, 3, 1", "Output/Matrices": False,
                "Eigenproblem/Maximum frequency": 2000}
        coarse = self.run_squeal("coarse", **mesh)
        shapes = coarse.shapes()
        self.assertEqual(len(shapes), len(coarse.modes))
        own = squeal.mac(shapes, shapes)
        numpy.testing.assert_allclose(own.diagonal(), 1, atol=1e-12)
        self.assertLess((own - numpy.eye(len(own))).max(), 0.9)
        fine = self.run_squeal("fine", **mesh, **{"Discretization/Degree": 3}).shapes()
        self.assertFalse(shapes[0].same_points(fine[0]))
        across = squeal.mac(shapes, fine)
        self.assertEqual(list(across.argmax(axis=1)), list(range(len(shapes))))
        self.assertGreater(across.diagonal().min(), 0.99)
        self.assertEqual([(i, j) for i, j, _ in squeal.pair(shapes, fine[::-1])],
                         [(i, len(fine) - 1 - i) for i in range(len(shapes))])
        self.check_measured(shapes, fine)

    def check_measured(self, shapes, fine):
        """A vibrometer that sees 60 points of the disc's upper face along the axis, with noise, from the fine mesh: modes
        that move along the axis are found again."""
        import csv
        generator = numpy.random.default_rng(2)
        height, of_disc = fine[0].points[:, 2], fine[0].body == 0
        face = numpy.flatnonzero(of_disc & (height > height[of_disc].max() - 1e-6))
        face = generator.choice(face, 60, replace=False)
        seen = [k for k, shape in enumerate(fine) if numpy.abs(shape.displacement[face, 2]).max() >
                0.5 * numpy.abs(shape.displacement).max()]
        self.assertGreater(len(seen), 3)
        path = pathlib.Path(self.directory) / "measured.csv"
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["mode", "x_m", "y_m", "z_m", "nx", "ny", "nz", "real", "imaginary"])
            for k in seen:
                size = numpy.abs(fine[k].displacement[face, 2]).max()
                for i in face:
                    value = 3 * fine[k].displacement[i, 2] / size + 0.01 * generator.normal()
                    writer.writerow([k, *fine[k].points[i], 0, 0, 2, value.real, value.imag])
        measured = squeal.read_measured(path)
        self.assertEqual(len(measured), len(seen))
        alike = squeal.mac(measured, shapes)
        numpy.testing.assert_allclose(squeal.mac(shapes, measured), alike.T, atol=1e-12)
        pairs = squeal.pair(measured, shapes, least=0.9)
        self.assertEqual([(i, j) for i, j, _ in pairs], list(enumerate(seen)))
        self.assertGreater(min(value for *_, value in pairs), 0.98)
        numpy.testing.assert_allclose(squeal.mac(measured, measured).diagonal(), 1, atol=1e-12)
        path.write_text("x_m,y_m\n0,0\n")
        with self.assertRaisesRegex(ValueError, "no columns z_m"):
            squeal.read_measured(path)
        path.write_text("x_m,y_m,z_m,nx,ny,nz,real\n0,0,0,0,0,1,a\n")
        with self.assertRaisesRegex(ValueError, "line 2"):
            squeal.read_measured(path)

    def test_interpolation(self):
        """Linear displacements are met exactly, also beside nodes of other bodies."""
        generator = numpy.random.default_rng(1)
        points = generator.random((400, 3))
        body = (points[:, 2] > 0.5).astype(int)
        slope = generator.random((3, 3))
        displacement = points @ slope + 5 * body[:, None]
        where = 0.1 + 0.8 * generator.random((50, 3))
        of = (where[:, 2] > 0.5).astype(int)
        numpy.testing.assert_allclose(squeal.Shape(points, displacement, body).at(where, of), where @ slope + 5 * of[:, None],
                                      atol=1e-6)


class Installation(st.TestCase):
    def test_pip_without_network(self):
        environment = {"PATH": os.environ["PATH"], "HOME": str(self.directory), "PIP_CONFIG_FILE": os.devnull}

        def execute(*command):
            result = subprocess.run([str(word) for word in command], cwd=self.directory, env=environment, capture_output=True,
                                    text=True, timeout=300)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            return result.stdout

        made = subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", self.directory / "venv"],
                              capture_output=True, text=True, timeout=300)
        if made.returncode and os.environ.get("CI") != "true":
            self.skipTest("python3 -m venv fails: scripts/install-dependencies.sh --tests")
        self.assertEqual(made.returncode, 0, made.stdout + made.stderr)
        python = self.directory / "venv/bin/python"
        # --no-index: nothing is looked for elsewhere.
        execute(python, "-m", "pip", "install", "--no-index", st.PROJECT / "python")
        where = execute(python, "-c", "import squeal; print(squeal.__file__, squeal.run.__name__)")
        self.assertTrue(where.startswith(str(self.directory / "venv")), where)
        self.assertIn("squeal", execute(python, "-m", "pip", "show", "--files", "squeal"))
        execute(python, "-m", "pip", "uninstall", "-y", "squeal")
        self.assertFalse(list((st.PROJECT / "python").rglob("*.egg-info")))


if __name__ == "__main__":
    unittest.main(verbosity=2)
