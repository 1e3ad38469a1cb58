"""scripts/report.py: one page about a run, without anything from elsewhere; what cannot be drawn is named, not fatal.

matplotlib may be missing on a machine that only tests: then the page lists the pictures it lacks. Both ways are right.
"""

import os
import pathlib
import re
import subprocess
import sys
import unittest
from html.parser import HTMLParser

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

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


class Reports(st.TestCase):
    def report(self, directory, *arguments):
        return subprocess.run([sys.executable, SCRIPT, directory, *arguments], capture_output=True, text=True, check=False,
                              timeout=600)

    def page(self, directory):
        result = self.report(directory, "--modes", "0")
        self.assertEqual(result.returncode, 0, result.stderr)
        page = Page((directory / "report.html").read_text())
        self.assertEqual(page.open, [])
        for link in page.links:
            self.assertTrue(link.startswith("data:image/png;base64,"), link[:60])
        return page, " ".join(page.words)

    def test_modes(self):
        results = self.analyse({**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Degree": 1,
                                "Eigenproblem/Maximum frequency": 2500})
        page, words = self.page(results)
        rows = st.read_table(results / "modes.csv")
        self.assertGreater(len(rows), 3)
        for row in rows:
            self.assertTrue(any(cell.startswith(f"{row['frequency_hz']:.3f}") for cell in page.cells), row)
            self.assertIn(row["verdict"], page.cells)
        self.assertIn(f"{len(rows)} modes up to 2500 Hz", words)
        n_undecided = sum(row["verdict"] == "undecided" for row in rows)
        self.assertEqual(n_undecided > 0, "undecided: their error bars" in words)
        self.assertIn("Discretization", words)  # the parameters
        # A picture, or the reason why there is none
        self.assertTrue(page.links or "matplotlib" in words)

    def test_sweep(self):
        results = self.analyse({**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Degree": 1,
                                "Eigenproblem/Maximum frequency": 1500, "Sweep/Parameter": "Contact/Friction/Coefficient",
                                "Sweep/Values": "0.1, 0.2"})
        _, words = self.page(results)
        self.assertIn("Sweep over Contact/Friction/Coefficient", words)
        self.assertRegex(words, "Lock-in diagram")
        branches = {row["branch"] for row in st.read_table(results / "sweep.csv")}
        self.assertIn(f"{len(branches)} modes at 2 values of Contact/Friction/Coefficient from 0.1 to 0.2", words)

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
            self.assertEqual((result.returncode, result.stderr), (0, ""), damage[:40])

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
