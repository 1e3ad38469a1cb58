"""A window far from zero (Eigenproblem/Minimum frequency) has the modes that all modes below its end have there.

What is expected is computed by the search from zero on, another algorithm with other factors: every mode of its table
inside the window, with growth rate, condition number and verdict. Eigenvalues are compared to 1e-9; both kinds of vectors
have backward errors below 1e-9, and condition numbers, made of both, agree.
"""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

HIGH = {"Eigenproblem/Maximum frequency": 16000}
WINDOW = {**HIGH, "Eigenproblem/Minimum frequency": 12000}


class HighWindow(st.TestCase):
    everything = {}  # of several tests

    def all_modes(self, settings):
        """The part of the table of all modes that is in the window. Computed on one rank, by mirror halves."""
        settings = {key: value for key, value in settings.items() if key != "Eigenproblem/Mirror symmetry"}
        key = tuple(settings.items())
        if key not in self.everything:
            self.everything[key] = [row for row in self.modes({**settings, **HIGH}) if row["frequency_hz"] >= 12000]
        return self.everything[key]

    def compare(self, settings, **options):
        """The window against the part of all modes; returns the log of the window's run."""
        everything = self.all_modes(settings)
        self.assertGreater(len(everything), 2)
        results = self.analyse({**settings, **WINDOW}, **options)
        window = st.read_table(results / "modes.csv")
        self.assertSameModes([st.eigenvalue(row) for row in window], [st.eigenvalue(row) for row in everything], 1e-9)
        for row in window:
            self.assertLessEqual(row["backward_error"], 1e-9)
            self.assertLessEqual(row["left_backward_error"], 1e-9)
            same = min(everything, key=lambda other: abs(st.eigenvalue(other) - st.eigenvalue(row)))
            # Error bars project on the modes of a window: beyond its ends they see no neighbours.
            if row["frequency_hz"] - 2 * same["frequency_error_hz"] > 12000:
                self.assertEqual(row["verdict"], same["verdict"])
            self.assertLessEqual(abs(row["condition_number"] - same["condition_number"]), 1e-5 * same["condition_number"])
        return (results / "log.txt").read_text()

    def test_mortar(self):
        log = self.compare({**st.SMALL_BRAKE, **st.MORTAR})
        self.assertIn("modes around the window", log)
        self.assertIn("nothing is said about divergence", log)
        self.assertNotIn("modes with |lambda|", log)

    def test_two_ranks(self):
        self.compare({**st.SMALL_BRAKE, **st.MORTAR}, ranks=2)

    def test_penalty_friction(self):
        self.compare({**st.SMALL_BRAKE, **st.PENALTY, "Stage": "friction"})

    def test_whole_brake(self):
        self.compare({**st.SMALL_BRAKE, **st.MORTAR, "Eigenproblem/Mirror symmetry": "false"})

    def test_without_velocity_terms(self):
        """Real shift of l^2, nothing to correct: friction at rest."""
        self.compare({**st.SMALL_BRAKE, **st.MORTAR, "Stage": "friction", "Operation/Angular velocity": 0})

    def test_elastic(self):
        self.compare({**st.SMALL_BRAKE, **st.MORTAR, "Stage": "elastic"})

    def test_solvers(self):
        """The other solvers find all modes below and leave out what is not wanted."""
        block = self.eigenvalues({**st.TINY_BRAKE, **WINDOW})
        self.assertGreater(len(block), 2)
        for solver in ["krylov", "dense"]:
            other = self.modes({**st.TINY_BRAKE, **WINDOW, "Eigenproblem/Solver": solver})
            self.assertGreaterEqual(min(row["frequency_hz"] for row in other), 12000)
            self.assertSameModes(block, [st.eigenvalue(row) for row in other], 1e-8)

    def test_free_rotor(self):
        """Rigid-body modes need no look in a window."""
        self.compare({**st.SMALL_BRAKE, "Pads/Arrangement": "none", "Rotor/Clamped boundary": "none",
                      "Stage": "elastic"})

    def test_low_window(self):
        """A window that begins near zero is cut out of all modes."""
        everything = self.modes(st.SMALL_BRAKE)
        window = self.modes({**st.SMALL_BRAKE, "Eigenproblem/Minimum frequency": 1400})
        self.assertLess(len(window), len(everything))
        self.assertSameModes([st.eigenvalue(row) for row in window],
                             [st.eigenvalue(row) for row in everything if row["frequency_hz"] >= 1400], 1e-12)

    def test_empty_window(self):
        frequencies = [row["frequency_hz"] for row in self.modes({**st.TINY_BRAKE, **HIGH})]
        gap, low = max((b - a, a) for a, b in zip(frequencies, frequencies[1:]) if a > 3000)
        window = {"Eigenproblem/Minimum frequency": low + 0.4 * gap, "Eigenproblem/Maximum frequency": low + 0.6 * gap}
        self.assertEqual(self.modes_or_none({**st.TINY_BRAKE, **window}), [])

    def modes_or_none(self, settings):
        return st.read_table(self.analyse(settings) / "modes.csv")

    def test_adaptive(self):
        settings = {**st.TINY_BRAKE, **WINDOW, "Refinement/Strategy": "adaptive", "Refinement/Cycles": 2}
        rows = st.read_table(self.analyse(settings) / "modes.csv")
        self.assertEqual({row["cycle"] for row in rows}, {0, 1})
        self.assertTrue(all(12000 <= row["frequency_hz"] <= 16000 for row in rows))

    def test_refused(self):
        for settings, words in [
                ({"Eigenproblem/Minimum frequency": 6000}, ["Eigenproblem/Minimum frequency", "below Maximum frequency"]),
                ({"Eigenproblem/Minimum frequency": -1}, ["Minimum frequency"]),
                ({**WINDOW, "Sweep/Parameter": "Operation/Angular velocity", "Sweep/Values": "5, 10"},
                 ["Eigenproblem/Minimum frequency", "sweeps"])]:
            result = st.run("--check", self.write("wrong.prm", settings), directory=self.directory)
            self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
            for word in words:
                self.assertIn(word, result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
