"""Every value of a sweep or map has the modes of a run of its own by LAPACK: their number and their values.

The solver `dense` computes all eigenvalues and knows nothing of neighbouring values, so a mode that a projection lost, kept
or took for another shows as a difference in number or value. What may come or go on the way: modes that become overdamped
or oscillate again, that grow without oscillating, that come into the search disc by its sides, contacts that open, friction
that turns round. Sweeps know an eigenvalue to some hundred times the tolerance of its backward error (test_sweep.py,
test_long): 1e-10 gives 1e-7 here, near coalescence the root of it. How far each may be off, reduction_error_1_per_s, must hold.
"""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

BRAKE = {**st.DENSE_BRAKE, "Contact/Steady pressure": "uniform"}
# Falls so steeply that pads grow by 1e5 1/s without oscillating.
STEEP = {"Pads/Pressure": 1e7, "Contact/Friction/Law": "falling", "Contact/Friction/Coefficient at speed": 0.1,
         "Contact/Friction/Decay speed": 0.5}
AT_REST = {"Stage": "friction", "Operation/Angular velocity": 0}
FRICTION, SPEED = "Contact/Friction/Coefficient", "Operation/Angular velocity"


# Pads of 1 mm by 1 degree, hard, with fixed backs: pins that hold the disc by the penalty.
PINS = {
    "Stage": "transport",
    "Pads/Inner radius": 0.1145,
    "Pads/Outer radius": 0.1155,
    "Pads/Sector angle": 1,
    "Pads/Thickness": 0.001,
    "Pads/Back face": "fixed",
    "Pads/Material/Young modulus": 1e13,
    "Contact/Formulation": "penalty",
    "Contact/Penalty stiffness": 6e12,
    "Contact/Steady pressure": "uniform",
    "Discretization/Degree": 2,
    "Discretization/Rotor cells": "1, 12, 1",
    "Discretization/Pad cells": "1, 1, 1",
    "Discretization/Clamp layers": 0,
    "Eigenproblem/Maximum frequency": 300,
    "Eigenproblem/Error bars": "false",
    "Eigenproblem/Tolerance": 1e-10,
    "Output/Fields": "none",
}


class AgainstSingleRuns(st.TestCase):
    def compare(self, settings, parameter, values, tolerance=1e-7, known=None, rounding=0):
        """Returns the modes of the single runs by value; of those in @p known there are no runs."""
        directory = self.analyse({**settings, "Sweep/Parameter": parameter, "Sweep/Values": ", ".join(map(repr, values))})
        rows = st.read_table(directory / "sweep.csv")
        singles = {}
        for value in values:
            own = {st.eigenvalue(row): row["reduction_error_1_per_s"] for row in rows if row["parameter"] == value}
            singles[value] = (known or {}).get(value) or self.eigenvalues({**settings, parameter: value,
                                                                           "Eigenproblem/Solver": "dense"})
            with self.subTest(parameter=parameter, value=value):
                self.assertSameModes(list(own), singles[value], tolerance, rounding)
                for ours, theirs in self.pairs(list(own), singles[value]):
                    error = own[ours] + max(rounding, 1e-12 * abs(theirs))  # the second one is of `dense`
                    self.assertLessEqual(abs(ours - theirs), error, (ours, theirs))
        return singles

    def matrices(self, files):
        """Writes matrices of two rows as files and returns the settings that name them."""
        for key, entries in files.items():
            lines = [f"{i} {j} {value!r}" for (i, j), value in entries.items()]
            self.write(f"{key}.mtx", "\n".join(["%%MatrixMarket matrix coordinate real general",
                                                f"2 2 {len(entries)}", *lines]) + "\n")
        return {f"Matrices/{key}": f"{key}.mtx" for key in files}

    def test_speed_through_zero(self):
        self.compare(BRAKE, SPEED, [-20, -5, 5, 20])

    def test_slow(self):
        """Friction damping grows like 1/speed: overdamped modes come into the disc, and pairs become overdamped."""
        found = self.compare(BRAKE, SPEED, [2, 0.5, 0.1, 0.02])
        self.assertGreater(len({len(modes) for modes in found.values()}), 1)

    def test_steep_falling_friction(self):
        """Real modes that grow, outside of the disc and inside."""
        found = self.compare({**BRAKE, **STEEP}, SPEED, [6, 5, 4.2, 4])
        self.assertEqual([sum(l.imag == 0 for l in found[speed]) > 0 for speed in (6, 5, 4)], [False, False, True])

    def test_creeping(self):
        self.compare({**BRAKE, **STEEP}, SPEED, [2, 1.9, 1.8])

    def test_coalescence(self):
        """Two oscillators with the coupling [[11, -3 + 5 p], [-3, 9]]: l^2 = -10 +- sqrt(10 - 15 p), p_c = 2/3; and a brake
        whose friction is far from it."""
        files = {"Mass": {(1, 1): 1, (2, 2): 1}, "Stiffness": {(1, 1): 11, (1, 2): -3, (2, 1): -3, (2, 2): 9},
                 "Circulatory": {(1, 2): 5}}
        found = self.compare({"Scene": "matrices", "Eigenproblem/Maximum frequency": 1, **self.matrices(files)},
                             "Matrices/Circulatory factor", [0.5, 0.6, 0.7, 0.8], 1e-9)
        self.assertEqual([sum(l.real > 1e-3 for l in found[p]) for p in (0.6, 0.7)], [0, 1])
        self.compare({**BRAKE, **AT_REST, **st.PENALTY}, FRICTION, [0.1, 0.4, 0.8], 1e-6)

    def test_lift_off(self):
        self.compare({**BRAKE, "Contact/Steady pressure": "computed"}, FRICTION, [0.1, 0.3, 0.5, 0.7])

    def test_strong_damping(self):
        """Pads from lightly to overdamped."""
        self.compare(BRAKE, "Pads/Material/Stiffness proportional damping", [1e-6, 1e-5, 1e-4, 1e-3])

    def test_stiffness(self):
        self.compare(BRAKE, "Pads/Material/Young modulus", [2e9, 3e9, 5e9, 1e10])

    def test_divergence(self):
        """l^2 = 2 p - 1.0001 and l^2 = -4: a pair meets at zero and leaves as two real eigenvalues, of which one grows."""
        files = {"Mass": {(1, 1): 1, (2, 2): 1}, "Stiffness": {(1, 1): 1.0001, (2, 2): 4}, "Circulatory": {(1, 1): -2}}
        found = self.compare({"Scene": "matrices", "Eigenproblem/Maximum frequency": 1, **self.matrices(files)},
                             "Matrices/Circulatory factor", [0.3, 0.5, 0.6, 0.7], 1e-9)
        self.assertEqual([len(found[p]) for p in (0.3, 0.7)], [2, 2])
        self.assertEqual([sum(l.imag == 0 for l in found[p]) for p in (0.3, 0.7)], [0, 1])

    def test_beyond_critical_speed(self):
        """Pins on a thick disc, faster than its waves (D5 of the published closed forms): a wave of n nodal diameters
        diverges from w/n to sqrt(w^2 + k0)/n. Here from 3381.4 to 3411.1 rad/s and from 3513.3 rad/s; between 3434.9 and
        3502.7 rad/s two waves flutter. Values just inside and outside of each end, within the bands, and across a
        band in one step, where pairs become two real eigenvalues and pairs again; up and down.

        At 3513.3 rad/s a real eigenvalue is 1.63 1/s, beside waves of 1e4 1/s. There `dense` itself gives a wave without
        growth 6e-6 1/s of it, and dense, krylov and projected values of that eigenvalue differ by 4e-7 to 1.8e-6 1/s,
        with each set of BLAS kernels by other ones: 1e-5 1/s is rounding here."""
        speeds = [3381.39, 3381.4, 3390, 3411.07, 3411.08, 3434.8, 3435, 3460, 3502.6, 3502.7, 3513.2, 3513.3, 3560]
        # Numbers that grow without oscillating and with it
        expected = [(0, 0), (1, 0), (1, 0), (1, 0), (0, 0), (0, 0), (0, 1), (0, 1), (0, 1), (0, 0), (0, 0), (1, 0), (1, 0)]
        found = self.compare(PINS, SPEED, speeds, 1e-6, rounding=1e-5)
        for speed, numbers in zip(speeds, expected):
            growing = [l for l in found[speed] if l.real > 1e-3]
            self.assertEqual((sum(l.imag == 0 for l in growing), sum(l.imag > 0 for l in growing)), numbers, speed)
        self.compare(PINS, SPEED, speeds[::-1], 1e-6, found, 1e-5)
        self.compare(PINS, SPEED, speeds[::3], 1e-6, found, 1e-5)

    def test_map(self):
        """Numbers of unstable modes and largest growth rates at the points of a map."""
        speeds, coefficients = [5, 15], [0.2, 0.45, 0.7]
        directory = self.analyse({**BRAKE, "Sweep/Parameter": FRICTION, "Sweep/Values": str(coefficients)[1:-1],
                                  "Sweep/Second parameter": SPEED, "Sweep/Second values": str(speeds)[1:-1]})
        points = st.read_table(directory / "map.csv")
        self.assertEqual(len(points), 6)
        for point in points:
            mu, speed = list(point.values())[:2]
            modes = self.modes({**BRAKE, FRICTION: mu, SPEED: speed, "Eigenproblem/Solver": "dense"})
            worst = max(modes, key=lambda row: row["growth_rate_1_per_s"])
            self.assertEqual(point["unstable_modes"], sum(row["verdict"] in ("flutter", "divergence") for row in modes))
            self.assertLess(abs(st.eigenvalue(point) - st.eigenvalue(worst)), 1e-7 * abs(st.eigenvalue(worst)))


if __name__ == "__main__":
    unittest.main(verbosity=2)
