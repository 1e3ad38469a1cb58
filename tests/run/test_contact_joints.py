"""Contact between bodies that do not slide: stick and frictionless (theory.md, section 11).

Where stick contact is closed everywhere it is a tie; where it opens, a row of its own says so, in the statics and in the
modes.
"""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402
import test_joints as joints  # noqa: E402

SURFACES = ["upper.high : upper.plate.low", "lower.low : lower.plate.high"]


class PlatesInContact(st.TestCase):
    """The plates of test_joints.Parts, which touch the linings instead of being tied to them."""

    brake = joints.Parts.brake
    write_brake = joints.Parts.write_brake

    def settings(self, kind, **others):
        # With so little friction the plates touch everywhere; half of the pressure's profile lets them lift off.
        return joints.Parts.settings(self, **{
            "Joints/Ties": "", "Joints/Contacts": ", ".join(f"{pair} : {kind}" for pair in SURFACES),
            "Contact/Friction/Coefficient": 0.05, **others})

    def static(self, results):
        return {row["pad"]: row for row in st.read_table(results / "static.csv")}

    def test_stick_is_a_tie(self):
        """Closed everywhere, on the meshes of the lining and on others."""
        for n_around in [(3, 3), (4, 3)]:
            self.write_brake(n_around=n_around)
            tie = {"Joints/Ties": ", ".join(SURFACES), "Joints/Contacts": ""}
            expected = self.modes(self.settings("stick", **tie))
            results = self.analyse(self.settings("stick"))
            # Two multipliers a node more than its pressure
            modes = st.read_table(results / "modes.csv")
            self.assertSameModes(joints.eigenvalues(modes), joints.eigenvalues(expected), 1e-8)
            for mode, other in zip(modes, expected):
                self.assertAlmostEqual(mode["frequency_error_hz"], other["frequency_error_hz"],
                                       delta=0.1 * other["frequency_error_hz"])
            static = self.static(results)
            self.assertEqual(set(static), {"upper.low", "lower.high", *SURFACES})
            # The plates are pressed onto the linings, these onto the disc: the loads, and nothing else.
            load = 1e6 * 0.5 * (0.14**2 - 0.09**2) * math.radians(50)
            for pair in SURFACES:
                pad = static["upper.low" if pair.startswith("upper") else "lower.high"]
                self.assertAlmostEqual(static[pair]["contact_area_m2"], load / 1e6, delta=1e-4 * load / 1e6)
                self.assertAlmostEqual(static[pair]["normal_force_n"], load, delta=1e-4 * load)
                self.assertAlmostEqual(static[pair]["normal_force_n"], pad["normal_force_n"], delta=1e-10 * load)
                self.assertGreater(static[pair]["needed_friction"], 0)
                # The guided plates hold the linings, which the disc drags.
                self.assertAlmostEqual(static[pair]["friction_torque_nm"], -pad["friction_torque_nm"],
                                       delta=1e-9 * abs(pad["friction_torque_nm"]))

    def test_lift_off(self):
        """Partly open: ranks, other solvers, a sweep and a refined mesh agree with a single run; a tie would not."""
        self.write_brake(n_around=(4, 3))
        lifted = {"Pads/Pressure profile": "1 + 25*y", "Contact/Friction/Coefficient": 0.4,
                  "Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 5000}
        for kind in ["stick", "stick 0.1", "frictionless"]:
            with self.subTest(kind):
                held = {} if kind != "frictionless" else {
                    "Mesh/Guided": "upper.plate.high, lower.plate.low, upper.end, lower.begin"}
                settings = self.settings(kind, **lifted, **held)
                results = self.analyse(settings)
                static, log = self.static(results), (results / "log.txt").read_text()
                areas = [static[pair]["contact_area_m2"] for pair in SURFACES]
                self.assertLess(min(areas), 0.99 * 0.5 * (0.14**2 - 0.09**2) * math.radians(50))
                expected = joints.eigenvalues(st.read_table(results / "modes.csv"))
                self.assertGreater(len(expected), 3)
                self.assertEqual("where it needs more it slips" in log, kind == "stick 0.1")
                if kind == "stick 0.1":
                    self.assertGreater(max(static[pair]["needed_friction"] for pair in SURFACES), 0.1)
                    continue
                self.assertSameModes(joints.eigenvalues(self.modes(settings, ranks=2)), expected, 1e-7)
                for other in [{"Eigenproblem/Solver": "dense"}, {"Eigenproblem/Mirror symmetry": "false"}]:
                    self.assertSameModes(joints.eigenvalues(self.modes({**settings, **other})), expected, 1e-7)
                sweep = {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.3, 0.4"}
                rows = st.read_table(self.analyse({**settings, **sweep}) / "sweep.csv")
                self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == 0.4], expected, 1e-6)
                tied = self.modes(self.settings(kind, **lifted, **{
                    "Joints/Ties": ", ".join(SURFACES), "Joints/Contacts": ""}))
                self.assertGreater(max(min(abs(l - m) for m in joints.eigenvalues(tied)) for l in expected), 5)

    def test_bars_hold(self):
        """Bars of a partly open stick contact against a mesh of half the size."""
        self.write_brake(n_around=(4, 3))
        settings = self.settings("stick", **{"Pads/Pressure profile": "1 + 25*y", "Contact/Friction/Coefficient": 0.4,
                                             "Eigenproblem/Maximum frequency": 3000})
        modes = self.modes(settings)
        self.assertGreater(len(modes), 3)
        fine = [row for row in self.modes({**settings, "Refinement/Strategy": "uniform", "Refinement/Cycles": 2})
                if row["cycle"] == 1]
        self.assertEqual(len(fine), len(modes))
        for mode, other in zip(modes, fine):
            for value, bar in [("frequency_hz", "frequency_error_hz"),
                               ("growth_rate_1_per_s", "growth_rate_error_1_per_s")]:
                self.assertLessEqual(abs(mode[value] - other[value]), mode[bar] + other[bar], (mode["mode"], value))

    def test_refusals(self):
        self.write_brake()
        good = self.settings("stick")
        pairs = good["Joints/Contacts"]
        for changed, words in [
                ({"Joints/Contacts": "upper.high : upper.plate.low : glue"}, "is not surface : surface : frictionless"),
                ({"Joints/Contacts": "upper.high : upper.plate.low : stick -1"}, "friction coefficient above zero"),
                ({"Joints/Contacts": "upper.high : upper.plate.low : frictionless 0.2"}, "is not surface : surface"),
                ({"Joints/Contacts": pairs.replace("lower.low", "nothing")}, "there is no surface group 'nothing'"),
                ({"Joints/Contacts": pairs.replace("upper.plate.low", "rotor.outer")}, "is on the rotor, which turns"),
                ({"Joints/Contacts": pairs.replace("upper.plate.low", "upper.begin")}, "are on the same body"),
                ({"Joints/Contacts": pairs.replace("upper.plate.low", "upper.plate.end")}, "only 0 % of"),
                ({"Joints/Contacts": pairs + ", upper.end : upper.plate.end : stick"}, "share nodes"),
                ({"Joints/Ties": "upper.high : upper.plate.low"}, "is in a contact and in Joints/Ties too"),
                ({"Contact/Formulation": "penalty"}, "does not go with Joints/Contacts"),
                ({"Joints/Contacts": pairs.replace("stick", "frictionless")}, "can move rigidly"),
                ({"Static equilibrium/Linear solver": "iterative"}, "has no joints")]:
            with self.subTest(words):
                self.write("refused.prm", st.parameter_file({**good, **changed}))
                result = st.run("refused.prm", directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertIn(words, result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
