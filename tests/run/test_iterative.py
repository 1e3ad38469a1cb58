"""The iterative solvers against the direct ones, which test_brake_reference.py compares with references. Both solve the
same equations, so that static.csv must agree to what either solves to, 1e-8, and eigenvalues to the tolerance."""

import math
import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

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


class ModesWithoutFactors(st.TestCase):
    """Solver block_davidson against block_krylov."""
    BRAKE = {**st.SMALL_BRAKE, "Discretization/Rotor cells": "3, 14, 1", "Eigenproblem/Error bars": "false",
             "Eigenproblem/Maximum frequency": 2500}
    DAVIDSON = {"Eigenproblem/Solver": "block_davidson"}
    TOLERANCE = 1e-9

    def compare(self, settings):
        expected = self.eigenvalues({**self.BRAKE, **settings})
        self.assertTrue(expected)
        with self.subTest(settings=settings):
            self.assertSameModes(self.eigenvalues({**self.BRAKE, **settings, **self.DAVIDSON}), expected, self.TOLERANCE)

    def test_contact(self):
        """Each kind of contact, pads that lift off, a given pressure. (Ranks: test_parallel.py.)"""
        for settings in ({}, {"Contact/Formulation": "penalty"},
                         {"Contact/Formulation": "mortar_penalty", "Contact/Penalty stiffness": 5e12},
                         {"Pads/Pressure profile": "1 - 20*y", "Contact/Friction/Coefficient": 1.0},
                         {"Contact/Steady pressure": "uniform"}):
            self.compare(settings)

    def test_terms(self):
        """Without what is not symmetric, left vectors are the right ones. A rotor alone has no contact at all. Terms of
        the prestress have matrices. The strip has two dimensions."""
        for settings in ({"Stage": "elastic"}, {"Stage": "transport", "Operation/Angular velocity": 200},
                         {"Pads/Arrangement": "none", "Discretization/Align rotor": "false"},
                         {"Operation/Angular velocity": 200, "Prestress/Centrifugal load": "true",
                          "Prestress/Stress stiffness": "true", "Prestress/Turning contact": "true",
                          "Rotor/Material/Mass proportional damping": 100},
                         {"Scene": "strip", "Operation/Angular velocity": 2, "Contact/Friction/Coefficient": 0.3,
                          "Eigenproblem/Maximum frequency": 30000}):
            self.compare(settings)

    def test_degree_three_and_what_is_reported(self):
        """Error bars and contributions are the same but for the border of contact, which a given pressure does not
        have. They follow from vectors, which are as good as the root of the eigenvalues' tolerance, 3e-5, in the norm
        of energy; the bars are residuals of these and of what is left of them."""
        settings = {**self.BRAKE, "Discretization/Degree": 3, "Discretization/Rotor cells": "2, 12, 1",
                    "Eigenproblem/Maximum frequency": 4000,
                    "Eigenproblem/Error bars": "true", "Contact/Steady pressure": "uniform"}
        direct, found = (self.analyse({**settings, **solver}) for solver in ({}, self.DAVIDSON))
        for table, keys in {"modes.csv": ["growth_rate_error_1_per_s", "frequency_error_hz", "condition_number"],
                            "contributions.csv": ["growth_rate_1_per_s"]}.items():
            a, b = (st.read_table(results / table) for results in (found, direct))
            self.assertEqual(len(a), len(b))
            for key in keys:
                scale = max(abs(row[key]) for row in b)
                for one, other in zip(a, b):
                    self.assertLessEqual(abs(one[key] - other[key]), 1e-3 * scale, (table, key))
        log = (found / "log.txt").read_text()
        self.assertIn("Completeness: not proven without factors.", log)
        self.assertIn("modes of degree 2 up to 5200 Hz, proven complete, were corrected", log)

    def test_window_without_modes(self):
        """The first mode above it tells how far the degree lowers frequencies."""
        results = self.analyse({**self.BRAKE, **self.DAVIDSON, "Eigenproblem/Maximum frequency": 300})
        self.assertEqual(st.read_table(results / "modes.csv"), [])
        found = re.search(r"Completeness: not proven without factors. ([1-9]\d*) modes of degree 1 up to (\d+)\S* Hz.* by up "
                          r"to ([0-9.]+) %, and for ([0-9.]+) %", (results / "log.txt").read_text())
        self.assertGreater(float(found[2]), 600)
        self.assertGreater(float(found[3]), 1)
        self.assertGreater(float(found[4]), float(found[3]))

    def test_tolerance(self):
        """The tolerance is one of eigenvalues: what is loose is quicker, and not further off than it says."""
        expected = self.eigenvalues(self.BRAKE)
        for tolerance in [1e-5, 1e-11]:
            with self.subTest(tolerance=tolerance):
                found = self.eigenvalues({**self.BRAKE, **self.DAVIDSON, "Eigenproblem/Tolerance": tolerance})
                self.assertSameModes(found, expected, tolerance)

    def test_what_it_refuses(self):
        for settings, message in (({"Discretization/Degree": 1}, "allowed for Discretization/Degree are 2 and more"),
                                  ({"Stage": "ladder"}, "Stage = ladder need block_krylov"),
                                  ({"Output/Sensitivities": "true"}, "need factors"),
                                  ({"Static equilibrium/Linear solver": "direct"}, "iterative and auto"),
                                  ({"Eigenproblem/Minimum frequency": 1000}, "Eigenproblem/Minimum frequency is 0"),
                                  ({"Pads/Back face": "free"}, "free to move as a rigid body")):
            self.write("bad.prm", {**self.BRAKE, **self.DAVIDSON, **settings})
            result = st.run("bad.prm", directory=self.directory)
            self.assertEqual(result.returncode, 2, settings)
            self.assertIn("Eigenproblem/Solver = block_davidson", result.stderr)
            self.assertIn(message, result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
