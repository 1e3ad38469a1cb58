"""Is this a brake? Mistakes of users end with a reason or a warning, never with a quiet "0 unstable".

The brake is the small one of mesh_files: twice 6 and 54 cells. What needs no computing is asked of --check.
"""

import pathlib
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

# Degree 1 and no bars: a run takes less than half a second.
SMALL = {**mesh_files.SCENE, "Mesh/File": "small.msh", "Discretization/Degree": 1, "Eigenproblem/Error bars": "false",
         "Eigenproblem/Maximum frequency": 4000, "Output/Fields": "none"}
MPA = {"Rotor/Material/Young modulus": 115000}
TONNES = {"Rotor/Material/Density": 7.2e-9}
# name: (settings, what --check must say; nothing: no warning)
CHECKED = {
    "base": ({}, ""),
    "mu0": ({"Contact/Friction/Coefficient": 0}, ""),
    "backward": ({"Operation/Angular velocity": -20}, ""),
    "still": ({"Operation/Angular velocity": 0, "Stage": "friction"}, ""),
    "mpa": (MPA, "Warning, units: Rotor/Material: waves run with sqrt(E/rho) = 4 m/s"),
    "gigantic": ({"Rotor/Material/Young modulus": 1.15e14}, "Warning, units: Rotor/Material: Young modulus = 1.15e+14 Pa"),
    "mmdens": (TONNES, "in t/mm^3 it would be 7200 kg/m^3"),
    "gcm3": ({"Pads/Material/Density": 2.5}, "Warning, units: Pads/Material: Density = 2.5 kg/m^3"),
    "bothmpa": ({**MPA, **TONNES, "Pads/Material/Young modulus": 8000}, "Warning, units: Pads/Material: Young modulus = 8000"),
    "khz": ({"Eigenproblem/Maximum frequency": 4}, "Warning, window: Eigenproblem/Maximum frequency = 4 Hz"),
    "rpm": ({"Operation/Angular velocity": 600}, "would be 62.83 rad/s"),
    "fast": ({"Operation/Angular velocity": 6000}, "Warning, speed: Operation/Angular velocity = 6000 rad/s"),
    "pmpa": ({"Pads/Pressure": 1}, "Warning, pressure: Pads/Pressure = 1 Pa"),
    "nopress": ({"Mesh/Pressure on": ""}, "Warning, no load: Mesh/Pressure on is empty"),
    "ownpress": ({"Mesh/Pressure on": "", "Mesh/Pressures": "upper.high : 1e6, lower.low : 1e6"}, ""),
    "ownmpa": ({"Mesh/Pressures": "upper.high : 1, lower.low : 1"}, "Warning, pressure: Mesh/Pressures/upper.high = 1 Pa"),
    "ownzero": ({"Mesh/Pressure on": "", "Mesh/Pressures": "upper.high : 0"}, "Warning, no load"),
    "nopressure": ({"Pads/Pressure": 0}, "Warning, no load: Pads/Pressure = 0"),
    "swept": ({"Pads/Pressure": 0, "Sweep/Parameter": "Pads/Pressure", "Sweep/Values": "1e6, 2e6"}, ""),
    "swept to MPa": ({"Sweep/Parameter": "Pads/Pressure", "Sweep/Values": "1e6, 2, 1, 0"},
                     "Pads/Pressure = 2 Pa. Usual are 1e3 to 1e8 Pa; 1 MPa is 1e6. (Value 2 of 4; 2 of them are like this)"),
    "swept by a map": ({"Sweep/Parameter": "Rotor/Material/Density", "Sweep/Values": "7200, 7.2",
                        "Sweep/Second parameter": "Pads/Material/Young modulus", "Sweep/Second values": "1e10, 1e9"},
                       "Warning, units: Rotor/Material: Density = 7.2 kg/m^3"),
    "sampled rpm": ({"Sampling/Parameters": "Operation/Angular velocity uniform 100 900", "Sampling/Samples": 4},
                    "Warning, speed: Operation/Angular velocity = "),
    "every value": ({**MPA, "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.1, 0.2"}, "1.15e+11 Pa. Units are"),
    "window": ({"Scene": "brake", "Eigenproblem/Maximum frequency": 60000}, "Warning, coarse mesh: shear waves in Rotor"),
}
# name: (settings, exit status, what the screen must say)
RUN = {
    "pmpa": ({"Pads/Pressure": 1}, 0, "Warning, pressure: the mean pressure of the pad upper"),
    "nopress": ({"Mesh/Pressure on": ""}, 2, "carries no force in the static state"),
    "clamppad": ({"Mesh/Clamped": "rotor.inner, upper.high, lower.low"}, 2, "carries no force"),
    "onesided": ({"Mesh/Pressure on": "upper.high"}, 2, "The pad 'lower.high'"),
    "wrongp": ({"Mesh/Pressure on": "upper.end, lower.end"}, 2, "The loads act across the axis only"),
    "ownonesided": ({"Mesh/Pressure on": "", "Mesh/Pressures": "upper.high : 1e6"}, 2, "The pad 'lower.high'"),
    "elastic": ({"Pads/Pressure": 0, "Stage": "elastic"}, 0, "modes up to 4000 Hz"),
    "khz": ({"Eigenproblem/Maximum frequency": 4}, 0, "Warning, no modes: there is none up to 4 Hz"),
    "window": ({"Eigenproblem/Solver": "none", "Eigenproblem/Maximum frequency": 60000}, 0, "Static equilibrium"),
}


class Mistakes(st.TestCase):
    def setUp(self):
        super().setUp()
        self.write("small.msh", mesh_files.msh2(mesh_files.brake()))

    def say(self, settings, *options):
        self.write("it.prm", {**SMALL, **settings})
        result = st.run("it.prm", *options, directory=self.directory)
        return result.returncode, result.stdout + result.stderr

    def test_checked(self):
        for name, (settings, words) in CHECKED.items():
            with self.subTest(name):
                status, text = self.say(settings, "--check")
                self.assertEqual(status, 0, text)
                self.assertIn(words or "valid", text)
                self.assertEqual("\nWarning" in text, bool(words), text)

    def test_run(self):
        for name, (settings, expected, words) in RUN.items():
            with self.subTest(name):
                status, text = self.say(settings, "--overwrite")
                self.assertEqual(status, expected, text)
                self.assertIn(words, text)
                if "Warning, no modes" in text:
                    self.assertNotIn("0 unstable", text)

    def test_warnings_stand_again(self):
        """After the table, and at the head of the page."""
        _, text = self.say({"Pads/Pressure": 1, "Output/Directory": "out"})
        before, after = text.split("unstable (marked >)")
        warnings = [line for line in before.splitlines() if line.startswith("Warning")]
        self.assertEqual(len(warnings), 3, text)
        for warning in warnings:
            self.assertIn(warning, after)
        subprocess.run([sys.executable, st.PROJECT / "scripts/report.py", "out", "--modes", "0"], cwd=self.directory,
                       capture_output=True, timeout=120)
        page = (self.directory / "out/report.html").read_text()
        self.assertLess(page.index("Warning, pressure"), page.index('<p class="summary "') if '<p class="summary "' in page
                        else page.index("modes up to"))

    def study(self, settings, table):
        """What a study of the smallest brake says, and the rows of its table."""
        status, text = self.say({"Scene": "brake", **st.TINY_BRAKE, "Discretization/Degree": 1, **settings}, "--overwrite")
        self.assertEqual(status, 0, text)
        return text, st.read_table(self.directory / "output/it" / table)

    def test_value_without_load_is_left_out(self):
        """A sweep, a map and samples go on after it."""
        swept = {"Sweep/Parameter": "Pads/Pressure", "Sweep/Values": "0, 5e5, 1e6"}
        text, rows = self.study(swept, "sweep.csv")
        self.assertIn("Warning, left out: ", text)
        self.assertEqual({row["parameter"] for row in rows}, {5e5, 1e6})
        mapped = {"Sweep/Second parameter": "Contact/Friction/Coefficient", "Sweep/Second values": "0.1, 0.6"}
        for bars in ("false", "true"):
            text, rows = self.study({**swept, **mapped, "Eigenproblem/Error bars": bars}, "map.csv")
            self.assertEqual(text.count("Warning, left out: point"), 4, text)  # and again after the table
            self.assertEqual([row["Pads/Pressure"] for row in rows], 2 * [0, 5e5, 1e6])
            self.assertEqual([row["unstable_modes"] is None for row in rows], 2 * [True, False, False])
        self.write("given.csv", "Pads/Pressure,Contact/Friction/Coefficient\n5e5,0.4\n0,0.5\n1e6,0.6\n")
        text, rows = self.study({"Sampling/File": "given.csv"}, "samples.csv")
        self.assertIn("Warning, left out: sample 2. The pad", text)
        self.assertEqual([row["sample"] for row in rows], [1, 3])
        probability = st.read_table(self.directory / "output/it/probability.csv")[0]
        self.assertEqual(probability["samples"], 2)

    def test_no_load_at_all(self):
        """Nothing is left of a study."""
        for study in [{"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.1, 0.2"},
                      {"Sampling/Parameters": "Contact/Friction/Coefficient uniform 0.1 0.2", "Sampling/Samples": 2}]:
            status, text = self.say({"Scene": "brake", **st.TINY_BRAKE, "Discretization/Degree": 1, "Pads/Pressure": 0, **study},
                                    "--overwrite")
            self.assertEqual(status, 2, text)
            self.assertIn("carries no force", text)

    def test_studies_without_modes(self):
        """No number of unstable modes, no probability; the page says it, too."""
        window = {"Eigenproblem/Maximum frequency": 100}
        numbers = {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.1, 0.2"}
        text, rows = self.study({**window, **numbers}, "sweep.csv")
        self.assertEqual(rows, [])
        self.assertIn("Warning, no modes: there is none up to 100 Hz at 2 of 2 values.", text)
        text, rows = self.study({**window, **numbers, "Sweep/Second parameter": "Pads/Pressure", "Sweep/Second values": "1e6, 2e6"},
                                "map.csv")
        self.assertEqual([row["unstable_modes"] for row in rows], 4 * [None])
        self.assertIn("at 4 of 4 points", text)
        text, rows = self.study({**window, "Sampling/Parameters": "Contact/Friction/Coefficient uniform 0.1 0.6",
                                 "Sampling/Samples": 4}, "samples.csv")
        self.assertEqual([row["unstable_modes"] for row in rows], 4 * [None])
        self.assertIn("at 4 of 4 samples", text)
        self.assertNotIn("nan", text)
        rows = st.read_table(self.directory / "output/it/probability.csv")
        self.assertEqual([(row["samples"], row["probability"]) for row in rows], [(0, None)])
        subprocess.run([sys.executable, st.PROJECT / "scripts/report.py", "output/it"], cwd=self.directory, check=True,
                       capture_output=True, timeout=120)
        page = (self.directory / "output/it/report.html").read_text()
        self.assertIn("No sample has a mode in the window", page)
        self.assertNotIn("probability of 0", page)

    def test_checks_of_studies(self):
        """--check refuses a value that a run of its own would refuse."""
        for settings, words in [({"Sweep/Parameter": "Operation/Angular velocity", "Sweep/Values": "20, 0"}, "Value 2 is not allowed"),
                                ({"Sweep/Parameter": "Pads/Material/Poisson ratio", "Sweep/Values": "0.3, 0.6"}, "Value 2"),
                                ({"Sampling/Parameters": "Pads/Material/Poisson ratio uniform 0.4 0.6", "Sampling/Samples": 4},
                                 "is not allowed"),
                                ({"Sweep/Parameter": "Eigenproblem/Tolerance", "Sweep/Values": "1e-9, 1e-8"}, "do not depend on it"),
                                ({"Sweep/Parameter": "Contact/Friction/Coeficient", "Sweep/Values": "0.3, 0.4"}, "nearest known key")]:
            with self.subTest(**settings):
                status, text = self.say(settings, "--check")
                self.assertEqual(status, 2, text)
                self.assertIn(words, text)


if __name__ == "__main__":
    unittest.main(verbosity=2)
