"""What a window lists: every mode with 0 < |Im l|/2 pi <= Maximum frequency in the search disc, all that grow wherever they
are, and no overdamped ones; by all solvers alike. What was not searched is told.
"""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

SOLVERS = ["dense", "block_krylov", "krylov"]
# 156 unknowns
BRAKE = {
    "Discretization/Degree": 1,
    "Discretization/Rotor cells": "2, 8, 1",
    "Discretization/Pad cells": "1, 2, 1",
    "Discretization/Clamp layers": 0,
    "Contact/Steady pressure": "uniform",
    "Eigenproblem/Error bars": "false",
    "Output/Fields": "none",
}


class Windows(st.TestCase):
    def matrices(self, **diagonals):
        """Settings of a problem of diagonal matrices."""
        settings = {"Scene": "matrices"}
        for key, diagonal in diagonals.items():
            lines = [f"{i + 1} {i + 1} {value!r}" for i, value in enumerate(diagonal)]
            self.write(f"{key}.mtx", "\n".join(["%%MatrixMarket matrix coordinate real general",
                                                f"{len(diagonal)} {len(diagonal)} {len(diagonal)}", *lines]) + "\n")
            settings[f"Matrices/{key}"] = f"{key}.mtx"
        return settings

    def test_growth_outside_of_the_disc(self):
        """(l - 100)^2 + 100 = l^2 - 200 l + 10100 has l = 100 + 10 j; its frequency, 1.6 Hz, is in the window of 5 Hz,
        whose disc ends at |l| = 34.6."""
        for solver in SOLVERS:
            found = self.eigenvalues({**self.matrices(Mass=[1.], Velocity=[-200.], Stiffness=[10100.]),
                                      "Eigenproblem/Maximum frequency": 5, "Eigenproblem/Solver": solver})
            self.assertSameModes(found, [100 + 10j], 1e-9)

    def test_divergence_outside_of_the_disc(self):
        """l^2 = 1e6 beside l^2 = -1: an odd number of real eigenvalues grows."""
        for solver in SOLVERS:
            found = self.eigenvalues({**self.matrices(Mass=[1., 1.], Stiffness=[-1e6, 1.]),
                                      "Eigenproblem/Maximum frequency": 1, "Eigenproblem/Solver": solver})
            self.assertSameModes(found, [1e3, 1j], 1e-9)

    def test_steep_falling_friction(self):
        """Friction that falls by 0.5 within 0.05 m/s: pads grow without oscillating, by 1e4 to 1e6 1/s."""
        steep = {**BRAKE, "Contact/Friction/Law": "falling", "Contact/Friction/Coefficient at speed": 0.1,
                 "Contact/Friction/Decay speed": 0.05, "Operation/Angular velocity": 0.02,
                 "Eigenproblem/Maximum frequency": 700}
        expected = self.eigenvalues({**steep, "Eigenproblem/Solver": "dense"})
        self.assertGreater(len(expected), 10)
        self.assertGreater(min(l.real for l in expected), 1e3)
        for settings in ({}, {"Eigenproblem/Solver": "krylov"}, {"Eigenproblem/Mirror symmetry": "false"}):
            self.assertSameModes(self.eigenvalues({**steep, **settings}), expected, 1e-8)

    def test_search_of_a_larger_problem(self):
        """398 oscillators, (l - 100)(l - 300) and (l - 2e4)^2 + 1: searched around shifts, not by LAPACK on all of them."""
        n = 400
        frequencies = [2 * math.pi * (1 + 0.1 * i) for i in range(n - 2)]
        settings = self.matrices(Mass=[1.] * n, Velocity=[0.] * (n - 2) + [-400., -4e4],
                                 Stiffness=[w * w for w in frequencies] + [3e4, 4e8 + 1])
        directory = self.analyse({**settings, "Eigenproblem/Maximum frequency": 1.55})
        growing = [l for l in map(st.eigenvalue, st.read_table(directory / "modes.csv")) if l.real > 1]
        self.assertSameModes(growing, [100, 300, 2e4 + 1j], 1e-8)
        self.assertIn("searched up to", (directory / "log.txt").read_text())

    def test_log_tells_the_region(self):
        """No sign of growth is what a light brake shows."""
        for solver, words in [("dense", "all eigenvalues were computed; listed are those with |lambda| <= 2 pi 1650 Hz and all that"),
                              ("block_krylov", "Growth beyond: symmetric: no sign of modes that grow outside of that disc")]:
            log = (self.analyse({**BRAKE, "Eigenproblem/Maximum frequency": 1500, "Eigenproblem/Solver": solver}) /
                   "log.txt").read_text()
            self.assertIn(words, log)

    def test_overdamped_modes(self):
        """Strong damping of the pads, beta = 1e-2 s, crowds eigenvalues at -1/beta: they do not oscillate, so they are
        none of the window, whatever rounding makes of them, and keep no solver from its end."""
        damped = {**BRAKE, "Pads/Material/Stiffness proportional damping": 1e-2, "Eigenproblem/Maximum frequency": 3000}
        expected = self.eigenvalues({**damped, "Eigenproblem/Solver": "dense"})
        self.assertGreater(min(l.imag for l in expected), 1)
        for settings in ({}, {"Eigenproblem/Solver": "krylov"}, {"Eigenproblem/Mirror symmetry": "false"},
                         {"Eigenproblem/Solver": "krylov", "Eigenproblem/Mirror symmetry": "false"}):
            self.assertSameModes(self.eigenvalues({**damped, **settings}), expected, 1e-6)

    def test_end_of_the_window(self):
        """Oscillators of 0.5 and 1 Hz up to 1 Hz, without and with a velocity term."""
        for velocity in ({}, {"Velocity": [0., 0.01]}):
            settings = self.matrices(Mass=[1., 1.], Stiffness=[(2 * math.pi) ** 2, math.pi ** 2], **velocity)
            for solver in SOLVERS:
                for lower, number in [(0, 2), (0.9, 1), (1 - 1e-4, 1)]:
                    found = self.eigenvalues({**settings, "Eigenproblem/Maximum frequency": 1, "Eigenproblem/Solver": solver,
                                              "Eigenproblem/Minimum frequency": lower})
                    self.assertEqual(len(found), number, (solver, velocity, lower))

    def test_tight_tolerances(self):
        """Halves whose matrices are symmetric to rounding only: a sweep with a tolerance below that ends well."""
        self.analyse({**BRAKE, "Eigenproblem/Maximum frequency": 3000, "Eigenproblem/Tolerance": 1e-13,
                      "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.1, 0.2"})

    def test_marginal_to_rounding(self):
        """A turning rotor without damping neither grows nor decays, however small the tolerance."""
        rotor = {**BRAKE, "Pads/Arrangement": "none", "Stage": "transport", "Operation/Angular velocity": 100,
                 "Eigenproblem/Maximum frequency": 6000, "Eigenproblem/Tolerance": 1e-15}
        self.assertEqual({row["verdict"] for row in self.modes(rotor)}, {"marginal"})


if __name__ == "__main__":
    unittest.main(verbosity=2)
