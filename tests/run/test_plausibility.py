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
    "nopressure": ({"Pads/Pressure": 0}, "Warning, no load: Pads/Pressure = 0"),
    "swept": ({"Pads/Pressure": 0, "Sweep/Parameter": "Pads/Pressure", "Sweep/Values": "1e6, 2e6"}, ""),
    "window": ({"Scene": "brake", "Eigenproblem/Maximum frequency": 60000}, "Warning, coarse mesh: shear waves"),
}
# name: (settings, exit status, what the screen must say)
RUN = {
    "pmpa": ({"Pads/Pressure": 1}, 0, "Warning, pressure: the mean pressure of the pad upper"),
    "nopress": ({"Mesh/Pressure on": ""}, 2, "carries no force in the static state"),
    "clamppad": ({"Mesh/Clamped": "rotor.inner, upper.high, lower.low"}, 2, "carries no force"),
    "onesided": ({"Mesh/Pressure on": "upper.high"}, 2, "The pad 'lower.high'"),
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

    def test_value_without_load_is_left_out(self):
        """A sweep goes on after it."""
        settings = {"Scene": "brake", **st.TINY_BRAKE, "Discretization/Degree": 1, "Sweep/Parameter": "Pads/Pressure"}
        status, text = self.say({**settings, "Sweep/Values": "0, 5e5, 1e6"})
        self.assertEqual(status, 0, text)
        self.assertIn("Warning, left out: ", text)
        values = {row["parameter"] for row in st.read_table(self.directory / "output/it/sweep.csv")}
        self.assertEqual(values, {5e5, 1e6})


if __name__ == "__main__":
    unittest.main(verbosity=2)
