"""The iterative solver of the static equilibrium against the direct one, which test_brake_reference.py compares with
references. Both solve the same equations, so that static.csv must agree to what either solves to: 1e-8."""

import math
import unittest

import squeal_testing as st

STATIC = {**st.SMALL_BRAKE, "Eigenproblem/Solver": "none"}
ITERATIVE = {"Static equilibrium/Linear solver": "iterative"}
DIRECT = {"Static equilibrium/Linear solver": "direct"}
QUANTITIES = ["normal_force_n", "friction_force_n", "friction_torque_nm", "contact_area_m2", "max_pressure_pa"]


class Iterative(st.TestCase):
    def static(self, settings, ranks=1):
        return st.read_table(self.analyse({**STATIC, **settings}, ranks=ranks) / "static.csv")

    def assertSameState(self, given, expected, tolerance=1e-8):
        self.assertEqual(len(given), len(expected))
        for a, b in zip(given, expected):
            for key in QUANTITIES:
                self.assertLessEqual(abs(a[key] - b[key]), tolerance * abs(b[key]), key)
            # The deepest point is some 1e-3 of the pads' displacement, and has so many digits less.
            self.assertLessEqual(abs(a["max_penetration_m"] - b["max_penetration_m"]), 1e-14)

    def test_same_as_direct(self):
        """Each kind of contact with friction 0.6 and pads that lift off at one end; 1 and 2 ranks; degrees 1 and 3."""
        face = 0.5 * math.radians(50) * (0.14**2 - 0.09**2)
        for contact in ({"Contact/Formulation": "mortar"}, {"Contact/Formulation": "penalty"},
                        {"Contact/Formulation": "mortar_penalty", "Contact/Penalty stiffness": 1e12}):
            contact = {**contact, "Pads/Pressure profile": "1 - 20*y"}
            direct = self.static({**contact, **DIRECT})
            self.assertLess(direct[0]["contact_area_m2"], 0.99 * face)
            for ranks in [1, 2]:
                with self.subTest(contact=contact, ranks=ranks):
                    self.assertSameState(self.static({**contact, **ITERATIVE}, ranks), direct)
        for degree in [1, 3]:
            with self.subTest(degree=degree):
                settings = {"Discretization/Degree": degree}
                self.assertSameState(self.static({**settings, **ITERATIVE}), self.static({**settings, **DIRECT}))

    def test_every_multigrid(self):
        direct = self.static(DIRECT)
        for multigrid in ["gamg", "ml", "boomeramg"]:
            with self.subTest(multigrid=multigrid):
                self.assertSameState(self.static({**ITERATIVE, "Static equilibrium/Multigrid": multigrid}), direct)

    def test_terms_of_the_rotor_and_other_scenes(self):
        """M* and, with mass-proportional damping, G act on the static state: at 400 rad/s -Omega^2 M* is no longer
        small. The strip has two dimensions and periodic nodes. The law of friction may depend on the pressure."""
        cases = {
            "turning": {"Operation/Angular velocity": 400, "Prestress/Centrifugal load": "true",
                        "Rotor/Material/Mass proportional damping": 100},
            "strip": {"Scene": "strip", "Operation/Angular velocity": 2, "Contact/Friction/Coefficient": 0.3},
            "expression": {"Contact/Friction/Law": "expression",
                           "Contact/Friction/Expression": "0.4 - 1e-8*p"},
            "gap": {"Contact/Initial gap": "1e-7 + 1e-5*y*y"},
        }
        for name, settings in cases.items():
            with self.subTest(case=name):
                self.assertSameState(self.static({**settings, **ITERATIVE}), self.static({**settings, **DIRECT}))

    def test_state_under_modes(self):
        """Modes stand on the iterative state as on the direct one."""
        settings = {**st.SMALL_BRAKE, "Eigenproblem/Maximum frequency": 3000, "Eigenproblem/Error bars": "false"}
        direct, iterative = ([st.eigenvalue(row) for row in self.modes({**settings, **solver})]
                             for solver in [DIRECT, ITERATIVE])
        self.assertSameModes(iterative, direct, 1e-8)

    def test_too_few_iterations(self):
        self.write("few.prm", {**STATIC, **ITERATIVE, "Static equilibrium/Maximum iterations": 3})
        result = st.run("few.prm", directory=self.directory)
        self.assertEqual(result.returncode, 3, result.stdout + result.stderr)
        self.assertIn("has not converged in 3 steps of GMRES (Static equilibrium/Maximum iterations)", result.stderr)

    def test_no_modes_no_eigenproblem(self):
        results = self.analyse({**STATIC, **DIRECT})
        self.assertFalse((results / "modes.csv").exists())
        self.assertEqual(len(st.read_table(results / "cycles.csv")), 1)
        for settings in ({"Stage": "ladder"}, {"Refinement/Strategy": "adaptive", "Refinement/Cycles": 2},
                         {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.1, 0.2"}):
            self.write("bad.prm", {**STATIC, **settings})
            result = st.run("bad.prm", directory=self.directory)
            self.assertEqual(result.returncode, 2, settings)
            self.assertIn("Eigenproblem/Solver = none", result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
