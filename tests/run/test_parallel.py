"""The number of ranks changes nothing but the time."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402


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
