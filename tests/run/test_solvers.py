"""Every eigen-solver against LAPACK on the whole problem. A new solver is one more name in SOLVERS."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

SOLVERS = ["block_krylov", "krylov"]


class Solvers(st.TestCase):
    def compare(self, settings):
        dense = self.eigenvalues({**st.TINY_BRAKE, **settings, "Eigenproblem/Solver": "dense"})
        self.assertGreater(len(dense), 10)
        for solver in SOLVERS:
            self.assertSameModes(self.eigenvalues({**st.TINY_BRAKE, **settings, "Eigenproblem/Solver": solver}),
                                 dense, 1e-8)

    def test_exhausted_space(self):
        """A mesh so small that the search runs out of new directions. What is left over is rounding, and once gave left
        vectors whose contact pressures, and so error bars, were noise."""
        for pressure in ["uniform", "computed"]:
            case = {**st.COARSE_STRIP, "Contact/Friction/Coefficient": 0.5, "Contact/Steady pressure": pressure}
            expected = self.modes({**case, "Eigenproblem/Solver": "dense"})
            self.assertEqual(len(expected), 1)
            for solver in SOLVERS:
                modes = self.modes({**case, "Eigenproblem/Solver": solver})
                self.assertEqual(len(modes), 1)
                self.assertLess(modes[0]["left_backward_error"], 1e-8)
                for column in ["growth_rate_1_per_s", "frequency_hz", "growth_rate_error_1_per_s", "frequency_error_hz"]:
                    self.assertLess(abs(modes[0][column] / expected[0][column] - 1), 1e-6, (pressure, solver, column))

    def test_mortar_elastic(self):
        self.compare({**st.MORTAR, "Stage": "elastic"})

    def test_mortar_friction(self):
        self.compare({**st.MORTAR, "Stage": "friction"})

    def test_mortar_full(self):
        self.compare({**st.MORTAR, "Stage": "full"})

    def test_penalty_friction(self):
        self.compare({**st.PENALTY, "Stage": "friction"})

    def test_penalty_full(self):
        self.compare({**st.PENALTY, "Stage": "full"})

    def test_free_rotor(self):
        """A body without support has six zero eigenvalues, each double: they are left out, the others are found."""
        free = {"Pads/Arrangement": "none", "Rotor/Clamped boundary": "none", "Stage": "elastic"}
        self.compare(free)


if __name__ == "__main__":
    unittest.main(verbosity=2)
