"""Mirror symmetry about the rotor's mid-plane: half problems give the modes of the whole, and the column `mirror` of
modes.csv is right."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402
from vtu_files import numbers, pieces

WHOLE = {"Eigenproblem/Mirror symmetry": "false"}
# Rounding of values that the backward error leaves open: it reaches 1e-11, and an error bar is a difference.
TOLERANCE = 1e-8


def axial_parity(record, half_thickness):
    """How even u_z is in z: the sum of u_z(x, y, z) u_z(x, y, -z) over the nodes of the rotor that are not on its faces,
    relative to that of squares: 1 where the disc bends, -1 where it is squeezed."""
    axial = {}
    for _, arrays, xyz in pieces(record):
        for name in ("displacement_re_m", "displacement_im_m"):
            u = numbers(arrays[name])
            for at in range(0, len(xyz), 3):
                if 1e-5 < abs(xyz[at + 2]) < half_thickness - 1e-5:
                    x, y, z = (round(1e5 * value) for value in xyz[at:at + 3])
                    axial[name, x, y, z] = u[at + 2]
    pairs = [(u, axial[name, x, y, -z]) for (name, x, y, z), u in axial.items() if (name, x, y, -z) in axial]
    assert len(pairs) > 0.9 * len(axial) > 100
    return sum(u * v for u, v in pairs) / sum(u * u for u, _ in pairs)


class Mirror(st.TestCase):
    def assertSameTables(self, settings):
        """Every column of modes.csv but those of rounding; returns the rows of the half problems."""
        halves, whole = (self.modes({**settings, **more}) for more in ({}, WHOLE))
        self.assertEqual(len(halves), len(whole))
        self.assertGreater(len(whole), 8)
        size = max(abs(st.eigenvalue(row)) for row in whole)
        units = {"1_per_s": size, "hz": size, "ratio": 1, "k_1_per_s2": size**2, "n_1_per_s2": size**2}
        for a, b in zip(halves, whole):
            for key in ("growth_rate_1_per_s", "frequency_hz", "damping_ratio", "d_1_per_s", "g_1_per_s", "k_1_per_s2",
                        "n_1_per_s2"):
                unit = next(value for end, value in units.items() if key.endswith(end))
                self.assertLessEqual(abs(a[key] - b[key]), TOLERANCE * unit, f"{key} of mode {a['mode']}")
            for key in ("condition_number", "frequency_error_hz"):
                if b[key] is not None:
                    self.assertLessEqual(abs(a[key] - b[key]), 1e-4 * abs(b[key]), f"{key} of mode {a['mode']}")
            self.assertEqual(a["verdict"], b["verdict"])
            self.assertIsNone(b["mirror"])
        return halves

    def test_brake(self):
        for name, contact in {"mortar": st.MORTAR, "penalty": st.PENALTY}.items():
            with self.subTest(contact=name):
                found = {row["mirror"] for row in self.assertSameTables({**st.SMALL_BRAKE, **contact})}
                self.assertEqual(found, {"symmetric", "antisymmetric"})

    def test_adaptive(self):
        """Cells are marked on both sides, so finer meshes keep the symmetry."""
        settings = {**st.SMALL_BRAKE, "Refinement/Strategy": "adaptive", "Refinement/Cycles": 2,
                    "Refinement/Tolerance": 1e-4, "Eigenproblem/Maximum frequency": 3000}
        rows = st.read_table(self.analyse(settings) / "modes.csv")
        self.assertEqual({row["cycle"] for row in rows}, {0, 1})
        for row in rows:
            self.assertIn(row["mirror"], ["symmetric", "antisymmetric"])

    def test_column(self):
        """The fields, read back: bending modes are antisymmetric."""
        thickness = 0.012
        directory = self.analyse({**st.SMALL_BRAKE, "Discretization/Rotor cells": "3, 18, 2", "Output/Fields": "all",
                                  "Output/Animation frames": 0, "Rotor/Thickness": thickness,
                                  "Eigenproblem/Maximum frequency": 4000})
        rows = st.read_table(directory / "modes.csv")
        self.assertEqual({row["mirror"] for row in rows}, {"symmetric", "antisymmetric"})
        for row in rows:
            parity = axial_parity(directory / f"mode-0-{int(row['mode']):03}.pvtu", thickness / 2)
            self.assertAlmostEqual(parity, 1 if row["mirror"] == "antisymmetric" else -1, delta=1e-4)

    def test_one_pad(self):
        rows = self.modes({**st.SMALL_BRAKE, "Pads/Arrangement": "upper"})
        self.assertTrue(rows)
        self.assertEqual({row["mirror"] for row in rows}, {None})


if __name__ == "__main__":
    unittest.main(verbosity=2)
