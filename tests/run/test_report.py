"""scripts/report.py: one page about a run, without anything from elsewhere; what cannot be drawn is named, not fatal.

matplotlib may be missing on a machine that only tests: then the page lists the pictures it lacks, and the screen says so.
Both ways are right.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest
from html.parser import HTMLParser

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402
import test_joints as joints  # noqa: E402

SCRIPT = st.PROJECT / "scripts/report.py"
VOID = {"meta", "img", "br", "hr", "link"}


class Page(HTMLParser):
    """Cells of tables, links, and whether every element is closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.cells, self.words = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        self.links += [value for name, value in attributes if name in ("src", "href")]
        if tag == "td":
            self.cells.append("")

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            raise AssertionError(f"</{tag}> closes nothing")

    def handle_data(self, data):
        self.words.append(data)
        if self.open and self.open[-1] == "td":
            self.cells[-1] += data


sys.path.insert(0, str(st.PROJECT / "scripts"))
from plotting import has_matplotlib, other_python_that_draws, rounded  # noqa: E402

MINUS, PLUS_MINUS = "\N{MINUS SIGN}", " \N{PLUS-MINUS SIGN} "


CAN_DRAW = has_matplotlib() or other_python_that_draws() is not None
needs_matplotlib = unittest.skipUnless(CAN_DRAW, "needs matplotlib: scripts/install-dependencies.sh --pictures")


class Rounding(unittest.TestCase):
    def test_value_and_bar(self):
        """The bar has two digits, the value ends at the same place."""
        for value, bar, expected in [(1885.547, 121.3, "1890 + 120"), (4675.3864, 2.61, "4675.4 + 2.6"),
                                     (-0.46, 1.3, "-0.5 + 1.3"), (11.0558, 8.46, "11.1 + 8.5"), (53.4, 277, "50 + 280"),
                                     (0.3, 357, "0 + 360"), (-0.3, 357, "0 + 360"), (1.2345, 0.0996, "1.23 + 0.10"),
                                     (99.96, 9.96, "100 + 10"), (-18.251266, 3.0e-5, "-18.251266 + 0.000030"),
                                     (12, 0, "12 + 0"), (4e11, 3.7e9, "4e+11 + 3.7e+09")]:
            self.assertEqual(" + ".join(rounded(value, bar)).replace(MINUS, "-"), expected)


class Reports(st.TestCase):
    def report(self, directory, *arguments):
        return subprocess.run([sys.executable, SCRIPT, directory, *arguments], capture_output=True, text=True, check=False,
                              timeout=600, env={**os.environ, "SQUEAL_FRAMES": "2"})

    def page(self, directory):
        result = self.report(directory, "--modes", "0")
        self.assertEqual(result.returncode, 0, result.stderr)
        page = Page((directory / "report.html").read_text())
        self.assertEqual(page.open, [])
        for link in page.links:
            self.assertTrue(link.startswith("data:image/png;base64,"), link[:60])
        return page, " ".join(page.words)

    def test_warnings_head_the_page(self):
        """Each warning of the log once, before what was found."""
        results = self.analyse(st.COARSE_STRIP)
        with (results / "log.txt").open("a") as log:
            log.write(2 * "Warning, size: as large as a house.\n")
        _, text = self.page(results)
        self.assertLess(text.index("Warning, size"), text.index("modes up to"))
        self.assertEqual(text.split("modes up to")[0].count("as large as a house"), 1)

    def test_modes(self):
        results = self.analyse({**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Degree": 1,
                                "Eigenproblem/Maximum frequency": 2500})
        page, words = self.page(results)
        rows = st.read_table(results / "modes.csv")
        self.assertGreater(len(rows), 3)
        for row in rows:
            line = page.cells.index(PLUS_MINUS.join(rounded(row["frequency_hz"], row["frequency_error_hz"])))
            growth = PLUS_MINUS.join(rounded(row["growth_rate_1_per_s"], row["growth_rate_error_1_per_s"]))
            # The verdict is the second column: narrow screens show it.
            self.assertEqual(page.cells[line - 3:line], [f"{row['mode']:.0f}", row["verdict"], growth])
        self.assertIn(f"{len(rows)} modes up to 2500 Hz", words)
        # None grows for certain, which is not to say that none grows.
        undecided = [row for row in rows if row["verdict"] == "undecided"]
        self.assertGreater(len(undecided), 0)
        self.assertFalse([row for row in rows if row["verdict"] == "flutter"])
        self.assertIn(f"Squeal cannot be excluded: {len(undecided)} mode", words)
        worst = max(undecided, key=lambda row: row["growth_rate_1_per_s"])
        self.assertIn(f": mode {worst['mode']:.0f} at ", words)
        self.assertIn("a higher Discretization/Degree (1 now), then Refinement/Strategy = adaptive", words)
        for what in ("Command squeal run0.prm", "Started 20", "Friction 0.6 (constant)", "Pressure 1 MPa",
                     "Speed 20 rad/s = 191 rev/min", "radii 50 to 150 mm", "125 0.25 7200"):
            self.assertIn(what, words)
        if CAN_DRAW:
            self.assertTrue(page.links)
        else:
            self.assertIn("matplotlib", words)

    def test_materials(self):
        """Damping beyond Rayleigh's is named where a material or the brake has it."""
        results = self.analyse({**st.SMALL_BRAKE, "Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1",
                                "Discretization/Pad cells": "1, 2, 1", "Eigenproblem/Maximum frequency": 2000,
                                "Eigenproblem/Error bars": "false", "Pads/Material/Loss factor": 0.02,
                                "Pads/Material/Shear viscosity": 50, "Modal damping/Ratios": "500 : 0.001, 2000 : 0.002"})
        page, words = self.page(results)
        self.assertIn("other damping", words)
        self.assertIn("shear viscosity 50; loss factor 0.02", page.cells)
        self.assertIn("Damping of real modes, frequency in Hz : ratio. 500 : 0.001, 2000 : 0.002", words)

    def test_assembly(self):
        """Plates on ties: joints, the mesh, causes by part, and the mode that grows fastest in motion."""
        mesh = joints.Parts.brake(self)
        settings = joints.Parts.settings(self, **{
            "Stage": "friction", "Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 4000,
            "Eigenproblem/Error bars": "false", "Output/Fields": "unstable", "Contact/Friction/Coefficient": 0.6})
        self.write("brake.msh", mesh_files.msh4(mesh))
        results = self.analyse({**settings, "Mesh/File": self.directory / "brake.msh"})
        page, words = self.page(results)
        at = page.cells.index("tie")
        self.assertEqual(page.cells[at:at + 4], ["tie", "upper.high : upper.plate.low", "tie", "lower.low : lower.plate.high"])
        if CAN_DRAW:
            self.assertIn("The mesh: dark are named surfaces", words)
        verdicts = {row["verdict"] for row in st.read_table(results / "modes.csv")}
        self.assertIn("flutter", verdicts)
        self.assertIn(", by part", words)
        self.assertIn("upper.plate", page.cells)
        if shutil.which("pvbatch") and shutil.which("xvfb-run"):
            result = self.report(results, "--modes", "1")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn("data:image/webp;base64,", (results / "report.html").read_text())

    def test_examples(self):
        """The gallery has picture, command, result, seconds and memory of each example, and leads to its page."""
        script, output = SCRIPT.with_name("examples.py"), self.directory / "gallery"
        result = subprocess.run([sys.executable, script, "falling_friction", "strip", "--program", st.SQUEAL, "--output", output],
                                capture_output=True, text=True, check=False, timeout=300)
        self.assertEqual(result.returncode, 0, result.stderr)
        page = (output / "examples.html").read_text()
        for wanted in ("scripts/run.sh prm/strip.prm", "Two-dimensional, seconds: an elastic layer", "strip/report.html",
                       "Squeal is to be expected: 1 mode grows", "falling_friction/report.html"):
            self.assertIn(wanted, page)
        self.assertEqual(len(re.findall(r"\d+ s, \d+ MiB", page)), 2)
        self.assertEqual(page.count("data:image/png;base64,"), 2 if CAN_DRAW else 0)
        result = subprocess.run([sys.executable, script, "stripe"], capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(result.returncode, 1)
        self.assertIn("there is no example stripe; there are strip, rotor, brake", result.stderr)

    def test_adaptive(self):
        """An adaptive run is not told to refine adaptively."""
        results = self.analyse({**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Degree": 1, "Refinement/Strategy": "adaptive",
                                "Refinement/Cycles": 2, "Eigenproblem/Maximum frequency": 2500})
        _, words = self.page(results)
        self.assertIn("the last of 2 meshes (adaptive)", words)
        self.assertIn("undecided", words)
        self.assertNotIn("Strategy = adaptive", words.split("Input and log")[0])
        self.assertIn("or more Refinement/Cycles", words)

    @unittest.skipUnless(other_python_that_draws(), "needs matplotlib: scripts/install-dependencies.sh --pictures")
    def test_python_without_matplotlib(self):
        """A Python that comes first in the PATH and lacks matplotlib does not cost the pictures: another is looked for."""
        results = self.analyse({**st.SMALL_BRAKE, "Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1",
                                "Discretization/Pad cells": "1, 2, 1", "Eigenproblem/Maximum frequency": 3000})
        for script, picture in ((SCRIPT, "report.html"), (SCRIPT.with_name("plot.py"), "eigenvalues.png")):
            # -S: without the directories of installed packages
            result = subprocess.run([sys.executable, "-S", script, results], capture_output=True, text=True, check=False,
                                    timeout=600)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertTrue((results / picture).exists())
        self.assertIn("data:image/png", (results / "report.html").read_text())

    @needs_matplotlib
    def test_picture_that_fails(self):
        """A picture that was possible and is not there ends with 1 and is named; the page is written all the same."""
        results = self.analyse({**st.SMALL_BRAKE, "Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1",
                                "Discretization/Pad cells": "1, 2, 1", "Eigenproblem/Maximum frequency": 3000})
        scripts = self.directory / "scripts"
        shutil.copytree(SCRIPT.parent, scripts)
        text = (scripts / "plot.py").read_text()
        (scripts / "plot.py").write_text(text.replace("def draw(plt,", "def draw(plt, no_such_argument,"))
        result = subprocess.run([sys.executable, scripts / "report.py", results], capture_output=True, text=True, check=False,
                                timeout=600)
        self.assertEqual(result.returncode, 1)
        self.assertIn("not every picture could be made", result.stderr)
        self.assertIn("Eigenvalues in the complex plane", result.stderr)
        self.assertIn("Verdicts", (results / "report.html").read_text())

    def test_sweep(self):
        results = self.analyse({**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Degree": 1,
                                "Eigenproblem/Maximum frequency": 1500, "Sweep/Parameter": "Contact/Friction/Coefficient",
                                "Sweep/Values": "0.1, 0.2"})
        _, words = self.page(results)
        self.assertIn("No mode grows at any of the values of Contact/Friction/Coefficient.", words)
        self.assertIn("Sweep over Contact/Friction/Coefficient", words)
        self.assertRegex(words, "Lock-in diagram")
        branches = {row["branch"] for row in st.read_table(results / "sweep.csv")}
        self.assertIn(f"{len(branches)} modes at 2 values of Contact/Friction/Coefficient from 0.1 to 0.2", words)
        self.assertNotIn("no error bars", words)
        # Branches are numbered as modes are.
        self.assertEqual(branches, set(range(1, len(branches) + 1)))

    def test_sweep_with_onset(self):
        """Two oscillators of test_theory_scenes.py: growth begins at the critical value, not at the next one computed."""
        results = self.directory / "ziegler"
        result = st.run("prm/theory/ziegler_damped.prm", "--set", f"Output/Directory={results}", directory=st.PROJECT)
        self.assertEqual(result.returncode, 0, result.stderr)
        _, words = self.page(results)
        onset = next(row for row in st.read_table(results / "critical.csv") if row["kind"] == "onset")
        self.assertIn(f"Growth begins at {onset['value']:.5g} (branch {onset['branch']:.0f})", words)
        self.assertIn("This sweep has no error bars", words)  # matrices have no mesh

    def test_samples(self):
        """Two masses of test_sampling.py: the probability with its bars in the first sentence, pictures, indices."""
        theory = st.PROJECT / "prm/theory"
        results = self.analyse({"Scene": "matrices", "Matrices/Mass": theory / "mass.mtx",
                                "Matrices/Stiffness": theory / "stiffness.mtx", "Matrices/Circulatory": theory / "friction.mtx",
                                "Eigenproblem/Maximum frequency": 1,
                                "Sampling/Samples": 16, "Sampling/Sensitivity indices": "true",
                                "Sampling/Parameters": "Matrices/Circulatory factor uniform 0.3 1; "
                                                       "Operation/Angular velocity uniform 1 2"})
        _, words = self.page(results)
        found = st.read_table(results / "probability.csv")[0]
        self.assertRegex(words, f"A mode grows with a probability of {found['probability']:.3g} "
                                f"\\(. {found['sampling_error']:.2g} by the number of samples, .* by the solver\\), of 32 samples")
        self.assertNotIn("Without error bars", words)  # matrices have no mesh
        self.assertRegex(words, "The largest growth rate of each sample")
        self.assertRegex(words, "Which uncertain number governs the growth rate")

    def test_damaged_tables(self):
        """Lines that a full disk has cut, bytes that are no text: the page leaves them out and says so."""
        results = self.analyse({**st.SMALL_BRAKE, "Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1",
                                "Discretization/Pad cells": "1, 2, 1", "Eigenproblem/Maximum frequency": 3000})
        n_modes = len(st.read_table(results / "modes.csv"))
        for path in results.glob("*.csv"):
            whole = path.read_bytes()
            path.write_bytes(whole + whole.splitlines()[-1][:len(whole.splitlines()[-1]) // 2])
        page, words = self.page(results)
        self.assertIn(f"{n_modes} modes up to 3000 Hz", words)
        self.assertIn(f"modes.csv: 1 of {n_modes + 1} lines are incomplete", words)
        modes = results / "modes.csv"
        text = modes.read_bytes()
        for damage in (b"", b"\0" * 100, text.replace(b"verdict", b"\xff\xfe"), text.replace(b".", b","),
                       text.replace(b"cycle", b"circle"), text[:len(text) // 2]):
            modes.write_bytes(damage)
            result = self.report(results, "--modes", "0")
            said = [line for line in result.stderr.splitlines() if "report.py: without pictures" not in line]
            self.assertEqual((result.returncode, said), (0, []), damage[:40])

    def test_names_that_are_no_text(self):
        results = self.analyse({**st.SMALL_BRAKE, "Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1",
                                "Discretization/Pad cells": "1, 2, 1", "Eigenproblem/Maximum frequency": 3000})
        strange = bytes(self.directory) + b"/\xff\xfe"
        os.rename(results, strange)
        (pathlib.Path(os.fsdecode(strange)) / "original.prm").write_bytes(b"# \xe4\n")
        result = subprocess.run([sys.executable, SCRIPT, strange, "--modes", "0"], capture_output=True, check=False, timeout=600)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stdout.strip(), strange + b"/report.html")
        self.assertTrue(os.path.exists(strange + b"/report.html"))

    def test_foreign_files(self):
        """Neither a page of somebody else nor what a link leads to is replaced, and no result of the run; a pipe in place of
        a table is left out."""
        aside = self.directory / "aside"
        page = self.directory / "report.html"
        (self.directory / "log.txt").write_text("")
        (self.directory / "run.manifest").write_text("squeal manifest 1\nfile log.txt\n")
        for text in ("<html>mine</html>", "<title>squeal: my own page</title>"):
            page.write_text(text)
            result = self.report(self.directory)
            self.assertEqual((result.returncode, page.read_text()), (1, text))
            self.assertIn("is not replaced", result.stderr)
        self.assertEqual(self.report(self.directory, "--output", page).returncode, 0)  # who names it wants it
        text = page.read_text()
        page.unlink()
        aside.write_text(text)
        for name in ("report.html", "named.html"):
            (self.directory / name).symlink_to(aside)
            aside.write_text("mine" if name == "named.html" else text)
            before = aside.read_text()
            result = self.report(self.directory, *([] if name == "report.html" else ["--output", self.directory / name]))
            self.assertEqual((result.returncode, aside.read_text()), (1, before))
            self.assertIn("is a link", result.stderr)
            (self.directory / name).unlink()
        page.write_text(text)  # its own is replaced
        (self.directory / "report.html.part").symlink_to(aside)
        os.mkfifo(self.directory / "modes.csv")
        os.mkfifo(self.directory / "parameters.prm")
        self.assertEqual((self.report(self.directory).returncode, aside.read_text()), (0, "mine"))
        result = self.report(self.directory, "--output", self.directory / "log.txt")
        self.assertEqual((result.returncode, (self.directory / "log.txt").read_text()), (1, ""))
        self.assertIn("a result of the run", result.stderr)

    @needs_matplotlib
    def test_foreign_pictures(self):
        aside, picture = self.directory / "aside.png", self.directory / "eigenvalues.png"
        (self.directory / "modes.csv").write_text("cycle,growth_rate_1_per_s,frequency_hz,verdict\n0,1,100,flutter\n")

        def plot(*arguments):
            return subprocess.run([sys.executable, st.PROJECT / "scripts/plot.py", self.directory, *arguments],
                                  capture_output=True, text=True, check=False, timeout=600)
        picture.write_text("mine")
        result = plot()
        self.assertEqual((result.returncode, picture.read_text()), (2, "mine"), result.stderr)
        picture.unlink()
        aside.write_text("mine")
        picture.symlink_to(aside)
        result = plot()
        self.assertEqual((result.returncode, aside.read_text()), (2, "mine"), result.stderr)
        picture.unlink()
        for _ in range(2):  # its own is replaced
            self.assertEqual(plot().returncode, 0)
        self.assertEqual(sorted(path.name for path in self.directory.iterdir()), ["aside.png", "eigenvalues.png", "modes.csv"])

    def test_errors(self):
        result = self.report(self.directory)
        self.assertNotEqual(result.returncode, 0)
        self.assertRegex(result.stderr, "no output directory of a run: log.txt is missing")
        # Text of the run is text of the page.
        (self.directory / "log.txt").write_text("<script>1 & 2</script>")
        self.assertEqual(self.report(self.directory).returncode, 0)
        text = (self.directory / "report.html").read_text()
        self.assertIsNone(re.search("<script>", text))
        self.assertIn("There are no modes yet.", text)


if __name__ == "__main__":
    unittest.main(verbosity=2)
