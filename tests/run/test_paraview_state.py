"""scripts/paraview_state.py: a ParaView state that opens again, from any directory, and shows the mode that grows
fastest.

What the script decides is derived: the run writes every mode, so that the one shown must be that with the largest growth
rate in modes.csv; its four frames are the time steps; the largest displacement drawn is the fraction --scale of the
diagonal of the model's box. The rotor's radius is 0.15 m, it and both pads are 12 mm thick: the diagonal is
sqrt(0.3^2 + 0.3^2 + 0.036^2) m = 0.4258 m. The file has the ring as a polygon with sides of 25 degrees at most, so that
a corner is within 12.5 degrees of each axis: its box is short by less than 1 - cos(12.5 degrees) = 2.4 %.

Opening needs ParaView; errors are told without it.
"""

import math
import pathlib
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

SCRIPT = st.PROJECT / "scripts/paraview_state.py"
SCALE = 0.05
FRAMES = 4

# Opens a state, prints what it holds and draws the second frame.
OPEN = """
import sys
import paraview.simple as pv
pv.LoadState(sys.argv[1])
scene = pv.GetAnimationScene()
times = list(scene.TimeKeeper.TimestepValues)
print("loop", scene.Loop)
print("times", len(times))
for (name, _), source in pv.GetSources().items():
    if name == "caption":
        print("caption", source.Text)
    if name == "rotor, displaced":
        largest = 0
        for time in times:
            source.UpdatePipeline(time)
            largest = max(largest, source.PointData.GetArray("displacement_m").GetRange(-1)[1])
        print("drawn", source.ScaleFactor * largest)
    print("source", name)
scene.AnimationTime = times[1]
pv.SaveScreenshot(sys.argv[2], list(pv.GetLayouts().values())[0], ImageResolution=[400, 225])
"""


class States(st.TestCase):
    def in_paraview(self, *arguments):
        # Without -noreset Xvfb starts anew when its last client leaves, which happens between the views of a state.
        command = ["xvfb-run", "-a", "-s", "-screen 0 1280x1024x24 -noreset", "pvbatch", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, cwd=self.directory)

    def test_state(self):
        for program in ("pvbatch", "xvfb-run"):
            if not shutil.which(program):
                self.skipTest(f"{program} is missing (scripts/install-dependencies.sh --pictures)")
        results = self.analyse({**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Degree": 1, "Output/Fields": "all",
                                "Output/Animation frames": FRAMES, "Eigenproblem/Maximum frequency": 1500})
        rows = st.read_table(results / "modes.csv")
        self.assertGreater(len(rows), 1)
        fastest = max(rows, key=lambda row: row["growth_rate_1_per_s"])

        # The directory is named relative to where one stands; the state opens from elsewhere.
        made = self.in_paraview(SCRIPT, results.relative_to(self.directory), "--scale", SCALE)
        self.assertEqual(made.returncode, 0, made.stderr)
        state = results / (results.name + ".pvsm")
        self.assertEqual(made.stdout.split()[:2], ["paraview", str(state.relative_to(self.directory))])
        self.write("open.py", OPEN)
        elsewhere = self.directory / "elsewhere"
        elsewhere.mkdir()
        picture = elsewhere / "frame.png"
        here, self.directory = self.directory, elsewhere
        opened = self.in_paraview(here / "open.py", state, picture)
        self.directory = here
        self.assertEqual(opened.returncode, 0, opened.stderr)
        self.assertGreater(picture.stat().st_size, 2000)

        found = {}
        for line in opened.stdout.splitlines():
            key, _, value = line.partition(" ")
            found.setdefault(key, []).append(value)
        self.assertEqual(found["loop"], ["1"])
        self.assertEqual(found["times"], [str(FRAMES)])
        self.assertIn(f"mode {fastest['mode']:.0f}: {fastest['frequency_hz']:.0f} Hz", found["caption"][0])
        mode = f"mode-0-{fastest['mode']:03.0f}"
        for source in (f"{mode}.pvd", f"{mode}-contact.pvtu", "contact-0.pvtu", "rotor, displaced", "pads, displaced"):
            self.assertIn(source, found["source"])
        # The rotor moves most: it is what pads are pressed on.
        drawn, expected = float(found["drawn"][0]), SCALE * math.hypot(0.3, 0.3, 0.036)
        self.assertLess(drawn, 1.001 * expected)
        self.assertGreater(drawn, 0.97 * expected)

    def test_errors(self):
        def error_of(*arguments):
            result = subprocess.run([sys.executable, SCRIPT, *arguments], capture_output=True, text=True, check=False,
                                    timeout=60)
            self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
            return result.stderr

        self.assertRegex(error_of(self.directory), r"modes.csv cannot be read.*Give the output directory of a run")
        (self.directory / "modes.csv").write_text("cycle,mode,growth_rate_1_per_s\n0,1,2\n0,2,3\n")
        self.assertRegex(error_of(self.directory), "holds no mode-.*pvd: run with Output/Fields")
        (self.directory / "mode-0-002.pvd").write_text("")
        self.assertRegex(error_of(self.directory, "--mode", "1"), "mode 1 of cycle 0 was not written; written are: 2")
        self.assertRegex(error_of(self.directory, "--cycle", "3"), "no mode of cycle 3 was written; there are: 0")
        try:
            import paraview  # noqa: F401
        except ImportError:
            self.assertRegex(error_of(self.directory), "ParaView cannot be loaded .*install-dependencies.sh --pictures")


if __name__ == "__main__":
    unittest.main(verbosity=2)
