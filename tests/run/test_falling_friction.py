"""Friction that falls with the sliding speed destabilises a mode that constant friction leaves stable.

prm/falling_friction.prm: a block of height H = 0.02 and density rho = 2500, pressed by p_0 = 1e6 with uniform steady
pressure, its back held along x. Both runs have the same mu = mu(v_0) at the sliding speed v_0 = 2 m/s, so they differ
only in the terms of the slope (theory.md, section 3),

    P_falling = int mu' p_0 (d[[u]].e)(e.[[u_t]]),    Q_falling = V int mu' p_0 (d[[u]].e)(e.d_x u_R),

with mu' = -(mu_s - mu_k)/v_d exp(-v_0/v_d) = -0.3/2 exp(-1) = -0.0552 s/m.

A mode with u^H M u = 1 has l^2 + (d + j g) l + k + j n = 0, so that Re l = -(d + n/|l|)/2 for small damping. P_falling
adds d' = mu' p_0 int |[[u]].e|^2 < 0 to d. To first order in mu', with the left eigenvector z (theory.md, section 6),

    dl = - z^H (l P_falling + Q_falling) u / (z^H (2 l M + P) u),

proportional to mu'. Where friction hardly couples the mode to others, z = u and dl = -d'/2. (Q_falling is smaller by
V |d_x u_R| / |l u|, a few per cent and less.)

How large is d'? The lowest mode shears the block against a layer that is twelve times as stiff. A block that is long
against its height would shear as u_x = U cos(pi y / 2H), free at the contact y = 0 and held at y = H:

    rho H/2 U^2 L = 1   =>   int |[[u]].e|^2 = U^2 L = 2 / (rho H)   =>   d' = 2 mu' p_0 / (rho H) = -2207 1/s,

a change of the growth rate by -mu' p_0 / (rho H) = +1104 1/s. The block is 2.5 times as long as high and the layer yields,
so this holds within some per cent. Material damping takes 337 1/s: it loses.
"""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

MU_REST, MU_MOVING, DECAY_SPEED, SPEED = 0.6, 0.3, 2, 2
MU = MU_MOVING + (MU_REST - MU_MOVING) * math.exp(-SPEED / DECAY_SPEED)
SLOPE = -(MU - MU_MOVING) / DECAY_SPEED
PRESSURE, DENSITY, HEIGHT = 1e6, 2500, 0.02


class FallingFriction(st.TestCase):
    def lowest_modes(self, *settings):
        """All modes below 20 kHz with these settings of Contact/Friction."""
        output = self.directory / f"out{len(list(self.directory.iterdir()))}"
        arguments = [f"Contact/Friction/{s}" for s in settings] + [f"Output/Directory={output}", "Output/Fields=none"]
        result = st.run(st.PROJECT / "prm/falling_friction.prm", *(a for s in arguments for a in ("--set", s)))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return st.read_table(output / "modes.csv")

    def setUp(self):
        super().setUp()
        self.constant = self.lowest_modes("Law=constant", f"Coefficient={MU!r}")
        self.falling = self.lowest_modes()

    def test_verdicts(self):
        self.assertEqual([mode["verdict"] for mode in self.constant], ["stable"] * len(self.constant))
        self.assertEqual(self.falling[0]["verdict"], "flutter")
        self.assertEqual([mode["verdict"] for mode in self.falling[1:]], ["stable"] * (len(self.constant) - 1))
        self.assertLess(self.constant[0]["growth_rate_1_per_s"], -300)
        self.assertGreater(self.falling[0]["growth_rate_1_per_s"], 700)
        for a, b in zip(self.constant, self.falling):
            # The frequency feels the slope only to second order, (d'/l)^2/8, and by Q_falling.
            self.assertLess(abs(a["frequency_hz"] - b["frequency_hz"]), 1e-3 * a["frequency_hz"])

    def change(self, modes, key="growth_rate_1_per_s", mode=0):
        return modes[mode][key] - self.constant[mode][key]

    def test_shearing_block(self):
        """The derivation above, without any number from the program."""
        expected = -SLOPE * PRESSURE / (DENSITY * HEIGHT)
        self.assertAlmostEqual(expected, 1103.6, delta=0.1)
        self.assertLess(abs(self.change(self.falling) - expected), 0.05 * expected)

    def test_rayleigh_quotient(self):
        """Re l of the shearing mode changes by -d'/2. (The other mode is coupled by friction: z differs from u.)
        Both lose damping."""
        growth, d = self.change(self.falling), self.change(self.falling, "d_1_per_s")
        self.assertLess(abs(growth + d / 2), 0.06 * growth)
        for i in range(len(self.constant)):
            self.assertGreater(self.change(self.falling, mode=i), 0)
            self.assertLess(self.change(self.falling, "d_1_per_s", i), 0)

    def test_proportional_to_the_slope(self):
        """A quarter of the slope at the same mu gives a quarter of the change, up to terms of second order."""
        # mu(v_0) = mu_k + (mu_s - mu_k)/e; the differences to mu are a quarter of those of the file.
        moving = MU - (MU - MU_MOVING) / 4
        quarter = self.lowest_modes(f"Coefficient={MU + (MU_REST - MU) / 4!r}", f"Coefficient at speed={moving!r}")
        for i in range(len(self.constant)):
            self.assertLess(abs(4 * self.change(quarter, mode=i) - self.change(self.falling, mode=i)),
                            0.02 * self.change(self.falling, mode=i))

    def test_only_value_and_slope_count(self):
        """A straight line through the same point with the same slope, given as an expression: the same modes."""
        line = self.lowest_modes("Law=expression", f"Expression={MU!r} + ({SLOPE!r})*(v - {SPEED})")
        self.assertSameModes([st.eigenvalue(mode) for mode in line], [st.eigenvalue(mode) for mode in self.falling],
                             1e-8)

    def test_rising_friction_damps(self):
        """The opposite slope changes the growth rate by as much downwards."""
        rising = self.lowest_modes("Law=expression", f"Expression={MU!r} - ({SLOPE!r})*(v - {SPEED})")
        for i in range(len(self.constant)):
            self.assertLess(abs(self.change(rising, mode=i) + self.change(self.falling, mode=i)),
                            0.1 * self.change(self.falling, mode=i))


if __name__ == "__main__":
    unittest.main(verbosity=2)
