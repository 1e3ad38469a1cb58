"""The number of ranks changes nothing but the time. The longer tests with ranks are here, since ranks that wait for each other beside
another test take several times as long: ctest runs this one alone."""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import error_statistics as es  # noqa: E402
import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

COST_OR_ROUNDING = ("backward_error", "rayleigh_defect", "reduction_error", "seconds", "memory", "solves", "mib")
# A brake of 22 cells, and runs with tables of two kinds.
FEW_CELLS = {**st.TINY_BRAKE, "Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 4000,
             "Contact/Steady pressure": "uniform"}
KINDS = {
    "single run": {"Discretization/Degree": 2, "Eigenproblem/Maximum frequency": 2500,
                   "Contact/Steady pressure": "computed"},
    "sweep": {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.2, 0.5"},
    "map": {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.2, 0.9", "Eigenproblem/Maximum frequency": 2500,
            "Sweep/Second parameter": "Operation/Angular velocity", "Sweep/Second values": "5, 10"},
    "samples": {"Sampling/Samples": 4, "Sampling/Parameters": "Contact/Friction/Coefficient uniform 0.2 0.9; "
                "Pads/Material/Young modulus uniform 9e9 1.1e10", "Eigenproblem/Maximum frequency": 2500},
    "relaxation": {"Pads/Material/Prony series": "0.2 : 3e-4", "Rotor/Material/Loss factor": 0.004, "Output/Sensitivities": "true",
                   "Eigenproblem/Maximum frequency": 2500},
}


class Parallel(st.TestCase):
    def test_brake(self):
        for name, contact in {"mortar": st.MORTAR, "penalty": st.PENALTY}.items():
            serial = self.eigenvalues({**st.SMALL_BRAKE, **contact})
            self.assertGreater(len(serial), 10)
            for ranks in [2, 4]:
                with self.subTest(contact=name, ranks=ranks):
                    self.assertSameModes(self.eigenvalues({**st.SMALL_BRAKE, **contact}, ranks=ranks), serial, 1e-8)

    def test_steady_state(self):
        serial, parallel = (st.read_table(self.analyse(st.SMALL_BRAKE, ranks=ranks) / "static.csv")
                            for ranks in [1, 2])
        self.assertEqual(len(serial), 2)
        for a, b in zip(serial, parallel):
            for key in ["normal_force_n", "friction_force_n", "friction_torque_nm", "contact_area_m2",
                        "max_pressure_pa"]:
                self.assertLessEqual(abs(a[key] - b[key]), 1e-8 * abs(a[key]), key)

    def test_error_bars(self):
        """Which cells are refined does not depend on the ranks: the same meshes, modes and bars."""
        settings = {**st.SMALL_BRAKE, **st.PENALTY, **es.ADAPTIVE, "Refinement/Cycles": 2,
                    "Eigenproblem/Maximum frequency": 1500}
        serial, parallel = (self.analyse(settings, ranks=ranks) for ranks in [1, 3])
        meshes = [[(row["cells"], row["dofs"]) for row in st.read_table(results / "cycles.csv")]
                  for results in [serial, parallel]]
        self.assertEqual(len(meshes[0]), 2)
        self.assertLess(meshes[0][0], meshes[0][1])
        self.assertEqual(*meshes)
        rows = [st.read_table(results / "modes.csv") for results in [serial, parallel]]
        self.assertEqual(len(rows[0]), len(rows[1]))
        for a, b in zip(*rows):
            self.assertEqual((a["cycle"], a["mode"], a["verdict"]), (b["cycle"], b["mode"], b["verdict"]))
            l = abs(st.eigenvalue(a))
            self.assertLessEqual(abs(st.eigenvalue(a) - st.eigenvalue(b)), 1e-8 * l)
            # Differences of the eigenvalues, which the solver knows to 1e-9 of their size at most, enter the bars.
            for key in ["frequency_error_hz", "growth_rate_error_1_per_s"]:
                self.assertLessEqual(abs(a[key] - b[key]), 1e-6 * abs(a[key]) + 1e-12 * l, f"mode {a['mode']}: {key}")

    def compare_tables(self, name, settings, others):
        """Every column of every table; @p others are options of analyse(). What only tells the cost, or how far rounding has been
        kept away, may differ. Numbers may by 1e-6 of the largest in their column: eigenvalues are known to 1e-9 of theirs."""
        first = self.analyse(settings)
        tables = sorted(path.name for path in first.glob("*.csv"))
        self.assertTrue(any(st.read_table(first / table) for table in tables))
        for options in others:
            results = self.analyse(settings, **options)
            self.assertEqual(tables, sorted(path.name for path in results.glob("*.csv")))
            for table in tables:
                a, b = (st.read_table(directory / table) for directory in (first, results))
                self.assertEqual(len(a), len(b), f"{name}: {table}")
                for column in [] if not a else a[0]:
                    if any(part in column for part in COST_OR_ROUNDING):
                        continue
                    with self.subTest(kind=name, table=table, column=column, ranks=options.get("ranks", 1)):
                        self.assertSameColumn([row[column] for row in a], [row[column] for row in b])

    def assertSameColumn(self, a, b):
        is_number = [isinstance(value, (int, float)) and math.isfinite(value) for value in a]
        largest = max([abs(value) for value, number in zip(a, is_number) if number], default=0)
        for row, (x, y) in enumerate(zip(a, b)):
            if is_number[row]:
                self.assertLessEqual(abs(x - y), 1e-6 * largest, f"row {row}: {x} and {y}")
            else:
                self.assertEqual(str(x), str(y), f"row {row}")

    def test_every_column(self):
        for name, settings in KINDS.items():
            # Each further run costs seconds.
            self.compare_tables(name, {**FEW_CELLS, **settings}, [{"ranks": n} for n in ([2, 3] if name == "single run" else [2])])

    def test_every_column_with_joints(self):
        """Pads on springs and dashpots, with a mass."""
        self.write("brake.msh", mesh_files.msh2(mesh_files.brake(rotor_cells=(2, 9, 1), pad_cells=(1, 2, 1))))
        foot = "{0} : ground : 1e8 1e8 1e8 1e4 1e4 1e4"
        self.compare_tables("joints", {
            **FEW_CELLS, **mesh_files.SCENE, "Mesh/File": "brake.msh", "Mesh/Guided": "",
            "Joints/Points": "up : upper.high, down : lower.low", "Joints/Masses": "up : 0.1 1e-4 1e-4 1e-4",
            "Joints/Springs": ", ".join(foot.format(point) for point in ("up", "down")),
            "Joints/Dashpots": "up : down : 20 20 20"}, [{"ranks": 3}])

    def test_every_column_with_another_blas(self):
        """Kernels of OpenBLAS for two processors sum in different orders."""
        self.compare_tables("kernels", {**FEW_CELLS, **KINDS["sweep"]},
                            [{"environment": {**st.ENVIRONMENT, "OPENBLAS_CORETYPE": kernel}}
                             for kernel in ["Haswell", "Nehalem"]])

    def test_modes_without_factors(self):
        """In a window of few modes."""
        settings = {**st.SMALL_BRAKE, "Discretization/Rotor cells": "2, 10, 1", "Discretization/Pad cells": "1, 2, 1",
                    "Eigenproblem/Error bars": "false", "Eigenproblem/Maximum frequency": 1500}
        expected = self.eigenvalues(settings)
        self.assertTrue(expected)
        for ranks in [2, 3]:
            with self.subTest(ranks=ranks):
                self.assertSameModes(self.eigenvalues({**settings, "Eigenproblem/Solver": "block_davidson"}, ranks=ranks),
                                     expected, 1e-9)

    def test_fewer_unknowns_than_ranks(self):
        """More ranks than rows are either put up with or refused with a message; they do not hang."""
        self.write("one.mtx", "%%MatrixMarket matrix array real general\n2 2\n2\n0\n0\n3\n")
        self.write("case.prm", {"Scene": "matrices", "Matrices/Mass": "one.mtx", "Matrices/Stiffness": "one.mtx",
                                "Eigenproblem/Maximum frequency": 1})
        result = st.run("case.prm", ranks=3, directory=self.directory, timeout=60)
        if result.returncode == 0:
            rows = st.read_table(self.directory / "output/case/modes.csv")
            self.assertSameModes([st.eigenvalue(row) for row in rows], [1j, 1j], 1e-10)
        else:
            self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
            self.assertIn("rank", result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
