"""Properties that hold on every mesh, whatever its accuracy. Those of Rayleigh's coefficients: test_explanation.py."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

CONTACTS = {"mortar": st.MORTAR, "penalty": st.PENALTY}


class Theory(st.TestCase):
    def test_no_friction_no_growth(self):
        """M and K symmetric, G skew: l = i w, whether the rotor turns or not."""
        for name, contact in CONTACTS.items():
            for omega in [0, 20]:
                with self.subTest(contact=name, omega=omega):
                    modes = self.modes({**st.SMALL_BRAKE, **contact, "Stage": "transport",
                                        "Operation/Angular velocity": omega, "Contact/Friction/Coefficient": 0})
                    self.assertGreater(len(modes), 10)
                    for mode in modes:
                        l = st.eigenvalue(mode)
                        self.assertLessEqual(abs(l.real), 1e-8 * abs(l))
                        self.assertEqual(mode["verdict"], "marginal")

    def test_friction_at_rest_comes_in_pairs(self):
        """l^2 M + K + mu T has no velocity term: with l, so is -conj(l) an eigenvalue, and one of two coalesced
        modes grows as the other decays."""
        for name, contact in CONTACTS.items():
            with self.subTest(contact=name):
                values = self.eigenvalues({**st.SMALL_BRAKE, **contact, "Stage": "friction",
                                           "Operation/Angular velocity": 0})
                self.assertSameModes(values, [-l.conjugate() for l in values], 1e-10)
                self.assertTrue(any(l.real > 1 for l in values), "two modes have coalesced at mu = 0.6")

    def test_friction_is_unstable(self):
        """With friction but no damping the turning brake has a growing mode for any mu > 0."""
        for name, contact in CONTACTS.items():
            for mu in [0.05, 0.6]:
                with self.subTest(contact=name, mu=mu):
                    modes = self.modes({**st.SMALL_BRAKE, **contact, "Stage": "friction",
                                        "Operation/Angular velocity": 5, "Contact/Friction/Coefficient": mu})
                    self.assertTrue(any(mode["verdict"] == "flutter" for mode in modes))
                    self.assertGreater(max(mode["growth_rate_1_per_s"] for mode in modes), 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
