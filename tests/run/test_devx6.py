"""A brake model of industrial origin, 4669 unknowns, given as matrices (lies outside of this repository)."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import devx6  # noqa: E402
import squeal_testing as st  # noqa: E402

DATA = st.require_shared("data/devx6")


class Devx6(st.TestCase):
    def test_unstable_modes(self):
        modes = self.modes(devx6.settings(DATA))
        values = [st.eigenvalue(mode) for mode in modes]
        growing = [l for l in values if l.real > 1e-6 * abs(l)]
        # As published, and computed anew
        for l, expected in self.pairs(growing, [5.474174 + 4932.238867j, 74.830642 + 17399.587753j]):
            self.assertLess(abs(l - expected), 1e-6)
        for l, expected in self.pairs(growing, devx6.GROWING):
            self.assertLess(abs(l - expected), 1e-9 * abs(l))
        # A third mode grows by less than 1e-4 1/s; Newton's method as above: 9.58716e-5 + 5130.604865237853 i.
        faint = [l for l in values if 0 < l.real <= 1e-6 * abs(l)]
        self.assertEqual(len(faint), 1, faint)
        self.assertLess(abs(faint[0] - (9.58716e-5 + 5130.604865237853j)), 1e-6)
        self.assertEqual(len(values), 18)


if __name__ == "__main__":
    unittest.main(verbosity=2)
