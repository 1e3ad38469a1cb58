"""The field of friction's work per cycle and area in mode-*-contact.vtu, summed over the pads' faces.

tests/unit/contact/friction_work.cc derives the field and compares its integral with the contributions to rounding. Here the
files: with degree 1 the field is bilinear on each face and what the file holds are the values at the corners, so that
mean times area is its integral up to the small change of the surface element along a sector's face. Both must be the
work of contributions.csv, friction damping included, for mortar and penalty contact, on one and two ranks.
"""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402
from vtu_files import numbers, pieces

SETTINGS = {
    **st.SMALL_BRAKE,
    "Discretization/Degree": 1,
    "Discretization/Pad cells": "3, 5, 1",
    "Contact/Friction/Law": "falling",
    "Eigenproblem/Maximum frequency": 1500,
    "Output/Fields": "all",
    "Output/Animation frames": 0,
}
ORIGINS = {"pressure_work_j_per_m2": "friction", "direction_work_j_per_m2": "friction damping",
           "speed_work_j_per_m2": "falling friction"}


def integrals(record):
    """The sums over the quadrilaterals of all pieces, by field: [mean times area, its absolute value]."""
    result = {}
    for part, arrays, xyz in pieces(record):
        corners = numbers(arrays["connectivity"])
        for array in part.find("PointData").iter("DataArray"):
            values, sums = numbers(array), result.setdefault(array.get("Name"), [0, 0])
            for at in range(0, len(corners), 4):
                (a, b, c, d) = ((xyz[3 * i], xyz[3 * i + 1]) for i in corners[at:at + 4])
                area = abs((c[0] - a[0]) * (d[1] - b[1]) - (c[1] - a[1]) * (d[0] - b[0])) / 2
                work = sum(values[i] for i in corners[at:at + 4]) / 4 * area
                sums[0] += work
                sums[1] += abs(work)
    return result


class FrictionWork(st.TestCase):
    def test_files(self):
        for formulation, ranks in [(st.MORTAR, 2), (st.PENALTY, 1)]:
            with self.subTest(**formulation):
                directory = self.analyse({**SETTINGS, **formulation}, ranks=ranks)
                parts = st.read_table(directory / "contributions.csv")
                modes = st.read_table(directory / "modes.csv")
                self.assertGreater(len(modes), 3)
                for mode in modes:
                    sums = integrals(directory / f"mode-0-{int(mode['mode']):03}-contact.pvtu")
                    self.assertEqual(set(sums), {*ORIGINS, "friction_work_j_per_m2"})
                    for name, origin in ORIGINS.items():
                        expected = sum(part["energy_per_cycle_j"] for part in parts
                                       if part["mode"] == mode["mode"] and part["origin"] == origin)
                        self.assertGreater(sums[name][1], 0)
                        self.assertLess(abs(sums[name][0] - expected), 1e-2 * sums[name][1], name)
                    total = sum(sums[name][0] for name in ORIGINS)
                    self.assertLess(abs(sums["friction_work_j_per_m2"][0] - total),
                                    1e-5 * sum(sums[name][1] for name in ORIGINS))

    def test_without_friction(self):
        directory = self.analyse({**SETTINGS, "Stage": "transport"})
        self.assertTrue(list(directory.glob("mode-*.pvtu")))
        self.assertFalse(list(directory.glob("mode-*-contact*")))


if __name__ == "__main__":
    unittest.main(verbosity=2)
