"""What README and the tutorial print of runs is what these runs give, to the digits printed.

The default brake: lines of modes in README's *A first result* and the tutorial's step 2. The realistic brake: the numbers of
modes and of undecided ones in doc/mesh.md, the whole brake likewise in doc/joints.md; skipped where there is no Gmsh. Scripts
shown as commands can be started, links lead somewhere, and files of the code that are named exist.
"""

import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

MODE = re.compile(r"^ {4}[> ] +(\d+) +([-\d.]+) \+- ([-\d.e]+) +([-\d.]+) \+- ([-\d.e]+) .* (\w+)$", re.M)


def section(document, begin, end):
    text = (st.PROJECT / document).read_text()
    return text[text.index(begin):text.index(end)]


def seconds_of_bars_and_right_vectors(log):
    """Processor seconds of the error bars, and of the right vectors with the factorisation that they need."""
    factorisation, right, bars = map(float, re.search(
        r"factorisation ([\d.]+), right vectors ([\d.]+), .*error bars ([\d.]+)", log).groups())
    return bars, factorisation + right


class Commands(st.TestCase):
    def test_can_be_started(self):
        """In documents commands are indented by four spaces, in parameter files they stand in comments."""
        texts = [st.PROJECT / "README.md", *(st.PROJECT / "doc").glob("*.md"), *(st.PROJECT / "prm").glob("**/*.prm")]
        command_in = re.compile(r"^(?:    |# {3})(scripts/[\w.-]+)", re.M)
        commands = {command for file in texts for command in command_in.findall(file.read_text())}
        self.assertGreater(len(commands), 5)
        for command in sorted(commands):
            self.assertTrue(os.access(st.PROJECT / command, os.X_OK), command)


def documents():
    """{path: text} of what users and contributors read, but for the history."""
    return {path: path.read_text() for path in [st.PROJECT / "README.md", st.PROJECT / "CONTRIBUTING.md",
                                                *sorted((st.PROJECT / "doc").glob("*.md"))]}


def anchors(text):
    """Of the headings, as GitHub makes them."""
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
            for heading in re.findall(r"(?m)^#+ (.+)$", text)}


class Names(st.TestCase):
    def test_links(self):
        """Files and headings that links lead to are there, and every page of the manual is reached from README."""
        texts = documents()
        dead, reached = [], set()
        for path, text in texts.items():
            for link in re.findall(r"\]\(([^)\s]+)\)", text):
                file, _, anchor = link.partition("#")
                if file.startswith("http"):
                    continue
                target = (path.parent / file).resolve() if file else path
                if not target.exists() or anchor and anchor not in anchors(target.read_text()):
                    dead.append(f"{path.name}: {link}")
                if path.name == "README.md":
                    reached.add(target)
        self.assertFalse(dead, "\n".join(dead))
        self.assertFalse([path.name for path in texts if path.name != "README.md" and path not in reached])

    def test_files_of_the_code(self):
        """What is written as room/name.cc or .h exists, and in extending.md as room/, too."""
        rooms = re.findall(r"`(\w+)/`", (st.PROJECT / "doc/extending.md").read_text())
        missing = [room for room in rooms if not (st.PROJECT / "source" / room).is_dir()]
        for path, text in documents().items():
            for name in re.findall(r"(?<![\w./-])(?:\.\./)?((?:[\w-]+/)+\w+\.(?:cc|h))\b", text):
                places = ("", "source", "include/squeal", "tests")
                if "NAME" not in name and not any((st.PROJECT / place / name).exists() for place in places):
                    missing.append(f"{path.name}: {name}")
        self.assertFalse(missing, "\n".join(missing))

    def test_functions_of_the_code(self):
        """So do functions and classes of theory.md's table *Where each term and step stands*."""
        code = "\n".join(path.read_text() for folder in ("source", "include") for path in (st.PROJECT / folder).glob("**/*.*"))
        words = set(re.findall(r"\w+", code))
        rows = [line.split(" | ") for line in section("doc/theory.md", "## 9.", "## 10.").splitlines() if line.startswith("| ")]
        names = [name.split("::")[-1] for row in rows[1:] for name in re.findall(r"`([\w:]+)`", " ".join(row[1:3]))]
        self.assertGreater(len(names), 40)
        self.assertFalse(set(names) - words)


class DefaultBrake(st.TestCase):
    def test_modes(self):
        result = st.run(st.PROJECT / "prm/brake.prm", "--set", "Output/Fields=none", "--set", "Output/Directory=brake",
                        "--set", "Output/Sensitivities=true", directory=self.directory, timeout=1100)
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = {int(row["mode"]): row for row in st.read_table(self.directory / "brake/modes.csv")}
        printed = {"README.md": section("README.md", "## A first result", "## Manual"),
                   "doc/tutorial.md": section("doc/tutorial.md", "**The modes.**", "## 3. ")}
        for document, text in printed.items():
            lines = MODE.findall(text)
            self.assertGreaterEqual(len(lines), 3, document)
            for number, frequency, frequency_bar, growth, growth_bar, verdict in lines:
                row = rows[int(number)]
                with self.subTest(document, mode=number):
                    self.assertEqual(verdict, row["verdict"])
                    # Half a unit of the last digit, and a twentieth for another processor's rounding.
                    for printed, bar, of in ((frequency, frequency_bar, "frequency"), (growth, growth_bar, "growth_rate")):
                        unit_name = "hz" if of == "frequency" else "1_per_s"
                        value, error = row[f"{of}_{unit_name}"], row[f"{of}_error_{unit_name}"]
                        unit = float(f"1e{int(f'{error:.1e}'.split('e')[1]) - 1}")
                        self.assertLessEqual(abs(float(printed) - value), 0.55 * unit)
                        self.assertLessEqual(abs(float(bar) - error), 0.55 * unit)
                        # Neither has more digits.
                        self.assertEqual(len(printed.partition(".")[2]), len(bar.partition(".")[2]))
            n_unstable, n_undecided = (sum(row["verdict"] in verdicts for row in rows.values())
                                       for verdicts in (("flutter", "divergence"), ("undecided",)))
            if "modes up to" in text:
                self.assertIn(f"{len(rows)} modes up to 6000 Hz, {n_unstable} unstable (marked >), {n_undecided} undecided.",
                              text)
            why = re.search(r"Mode 15, growth rate .*", result.stdout)[0]
            self.assertIn(why.split(" = ")[0], text)
        # doc/error_bars.md
        self.assertLessEqual(*seconds_of_bars_and_right_vectors(result.stdout))
        self.check_screen(result.stdout)
        self.check_sensitivities()

    def check_screen(self, screen):
        """The table of modes on the screen has the lines of README, but for backward errors, which are rounding."""
        for line in MODE.finditer(section("README.md", "## A first result", "## Manual")):
            printed = line[0].rsplit(None, 3)[0].removeprefix("    ")
            self.assertIn(printed, screen)
        pad = " ".join(section("doc/tutorial.md", "Pad upper", "The force is").split())
        self.assertIn(pad.split(", torque")[0], screen)
        self.assertIn("pressure 0 to ", pad)
        self.assertRegex(screen, r"Pad upper: .* pressure 0 to ")
        self.assertRegex(screen, r"\nCommand: squeal .*brake\.prm --set .*\nStarted: 20\d\d-\d\d-\d\d \d\d:\d\d:\d\d UTC on ")

    def check_sensitivities(self):
        text = section("doc/tutorial.md", "    parameter,value,", "    ...")
        rows = {row["parameter"]: row for row in st.read_table(self.directory / "brake/sensitivities.csv") if row["mode"] == 15}
        lines = [line.strip().split(",") for line in text.splitlines()[1:]]
        self.assertGreaterEqual(len(lines), 5)
        for parameter, value, derivative, relative in lines:
            row = rows[parameter]
            self.assertEqual(float(value), row["value"])
            for printed, computed in ((derivative, row["d_growth_rate_1_per_s"]),
                                      (relative, row["relative_d_growth_rate_1_per_s"])):
                self.assertLessEqual(abs(float(printed) - computed), 6e-4 * abs(computed), parameter)


class MeshExample(st.TestCase):
    """Examples whose meshes Gmsh makes."""

    def rows_of(self, name):
        """Lines of modes.csv of prm/NAME.prm."""
        if not shutil.which("gmsh"):
            self.skipTest("this test needs gmsh: scripts/install-dependencies.sh --mesh")
        mesh = self.directory / f"{name}.msh"
        subprocess.run(["gmsh", "-3", st.PROJECT / f"prm/{name}.geo", "-o", mesh], check=True,
                       stdout=subprocess.DEVNULL, timeout=60)
        result = st.run(st.PROJECT / f"prm/{name}.prm", "--set", f"Mesh/File={mesh}", "--set",
                        "Output/Fields=none", "--set", "Output/Directory=brake", directory=self.directory, timeout=1100)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return st.read_table(self.directory / "brake/modes.csv")

    def check_sentence(self, document, rows, below):
        """All that grows flutters, and the document tells the frequencies and how many modes are undecided."""
        text = " ".join((st.PROJECT / document).read_text().split())
        n_undecided = sum(row["verdict"] == "undecided" for row in rows)
        growing = [row for row in rows if row["verdict"] in ("flutter", "divergence")]
        self.assertEqual({row["verdict"] for row in growing}, {"flutter"})
        places = " and ".join(f"{row['frequency_hz'] / 1000:.2f}" for row in growing)
        self.assertIn(f"Of {len(rows)} modes below {below} kHz {len(growing)} {'grows' if len(growing) == 1 else 'grow'} for "
                      f"certain, by flutter at {places} kHz, and {n_undecided} {'is' if n_undecided == 1 else 'are'} undecided",
                      text)
        return text, n_undecided


class RealisticBrake(MeshExample):
    def test_verdicts(self):
        rows = self.rows_of("realistic_brake")
        self.check_geometry()
        text, n_undecided = self.check_sentence("doc/mesh.md", rows, "6.5")
        self.assertLessEqual(n_undecided, 2)
        n_unknowns = st.read_table(self.directory / "brake/cycles.csv")[0]["dofs"]
        self.assertIn(f"{n_unknowns:_.0f} unknowns".replace("_", " "), text)

    def check_geometry(self):
        """Friction ring and hat of Gmsh's script by closed form, and the pads are pressed on them as they are in the file."""
        rows = {(row["kind"], row["name"]): row for row in st.read_table(self.directory / "brake/mesh.csv")}
        # Arcs of 10 degrees by polynomials of degree 2 would be (5 degrees)^4 / 30 = 2e-6 off.
        h, volume = 11, 0
        for r_low, r_high, height in [(35, 72, 6), (66, 72, 26.5), (66, 72, h), (72, 88, h), (88, 140, h)]:
            volume += math.pi * (r_high**2 - r_low**2) * height * 1e-9
        self.assertLessEqual(abs(rows["body", "rotor"]["volume_m3"] - volume), 1e-5 * volume)
        ring = math.pi * (140**2 - 88**2) * 1e-6
        self.assertLessEqual(abs(rows["surface", "disc top"]["area_m2"] - ring), 1e-5 * ring)
        self.assertLessEqual(abs(rows["pair", "upper face : disc top"]["gap_m"]), 1e-12)
        # What presses is carried by contact: 4 MPa on the piston's ring.
        force = 4e6 * rows["surface", "upper piston"]["area_m2"]
        carried = {row["pad"]: row["normal_force_n"] for row in st.read_table(self.directory / "brake/static.csv")}
        self.assertLessEqual(abs(carried["upper face"] - force), 1e-5 * force)


class WholeBrake(MeshExample):
    def test_verdicts(self):
        rows = self.rows_of("whole_brake")
        text, n_undecided = self.check_sentence("doc/joints.md", rows, "2.5")
        self.assertLess(n_undecided, 9)
        mesh = st.read_table(self.directory / "brake/mesh.csv")
        n_bodies = sum(row["kind"] == "body" for row in mesh)
        self.assertIn(f"Its {n_bodies} bodies hang on 4 ties, 4 contacts,", text)
        self.assertLess(st.read_table(self.directory / "brake/cycles.csv")[0]["memory_mib"], 4 * 1024)


if __name__ == "__main__":
    unittest.main(verbosity=2)
