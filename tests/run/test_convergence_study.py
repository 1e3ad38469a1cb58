"""Convergence studies: convergence.csv and convergence.tex beside the screen's table; Refinement/Reference."""

import math
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

# An elastic layer under a block, two-dimensional: three uniform meshes in some seconds.
STRIP = {
    "Scene": "strip",
    "Stage": "full",
    "Operation/Angular velocity": 2,
    "Contact/Steady pressure": "uniform",
    "Contact/Friction/Coefficient": 0.3,
    "Discretization/Rotor cells": "1, 20, 2",
    "Discretization/Pad cells": "1, 5, 2",
    "Discretization/Degree": 1,
    "Eigenproblem/Maximum frequency": 60000,
    "Output/Fields": "none",
}
UNIFORM = {"Refinement/Strategy": "uniform", "Refinement/Cycles": 4}
HEADER = "frequency_hz,growth_rate_1_per_s\n"



class Study(st.TestCase):
    def reference(self, rows):
        return self.write("reference.csv", HEADER + "".join(
            f"{row['frequency_hz']!r},{row['growth_rate_1_per_s']!r}\n" for row in rows))

    def test_against_reference(self):
        # One degree more and one mesh more: its error is small against those of the study.
        better = self.modes({**STRIP, "Discretization/Degree": 3, "Refinement/Strategy": "uniform",
                             "Refinement/Cycles": 2, "Eigenproblem/Error bars": "false"})
        results = self.analyse({**STRIP, **UNIFORM, "Refinement/Reference": self.reference(better)})
        study = st.read_table(results / "convergence.csv")
        modes, cycles = st.read_table(results / "modes.csv"), st.read_table(results / "cycles.csv")
        finest = [row for row in modes if row["cycle"] == 3]
        self.assertGreater(len(finest), 5)
        self.assertEqual(sorted({row["mode"] for row in study}), [row["mode"] for row in finest])
        own = {(row["cycle"], row["frequency_hz"]): row for row in modes}
        extrapolated = improved = 0
        for row in study:
            mode = own[row["cycle"], row["frequency_hz"]]
            self.assertEqual(row["dofs"], cycles[int(row["cycle"])]["dofs"])
            for key in ["growth_rate_1_per_s", "frequency_error_hz", "growth_rate_error_1_per_s",
                        "corrected_frequency_hz", "corrected_growth_rate_1_per_s"]:
                self.assertEqual(row[key], mode[key])
            if row["reference_frequency_hz"] is None:  # beyond the window's end on the better mesh
                continue
            for key, error, bar, effectivity in [
                    ("frequency_hz", "true_frequency_error_hz", "frequency_error_hz", "frequency_effectivity"),
                    ("growth_rate_1_per_s", "true_growth_rate_error_1_per_s", "growth_rate_error_1_per_s",
                     "growth_rate_effectivity")]:
                true = abs(row[key] - row["reference_" + key])
                # Fields have 12 digits.
                self.assertLessEqual(abs(row[error] - true), 1e-10 * abs(row[key]))
                if row[effectivity] is not None:
                    self.assertLessEqual(abs(row[effectivity] * row[error] - row[bar]), 1e-9 * row[bar])
            if row["extrapolated_frequency_hz"] is not None:
                extrapolated += 1
                improved += (abs(row["extrapolated_frequency_hz"] - row["reference_frequency_hz"])
                             < row["true_frequency_error_hz"])
        # Degree 1 converges steadily: most frequencies of the two last meshes can be extrapolated, and it pays.
        self.assertGreaterEqual(extrapolated, len(finest))
        self.assertGreaterEqual(improved, 0.9 * extrapolated)

    def test_changes_and_rates(self):
        results = self.analyse({**STRIP, **UNIFORM, "Refinement/Cycles": 3})
        study = st.read_table(results / "convergence.csv")
        lines = {(row["mode"], row["cycle"]): row for row in study}
        rates = 0
        for (mode, cycle), row in lines.items():
            before, first = lines.get((mode, cycle - 1)), lines.get((mode, cycle - 2))
            self.assertEqual(row["change"] is None, before is None)
            for key in ["reference_frequency_hz", "true_frequency_error_hz", "frequency_effectivity"]:
                self.assertIsNone(row[key])
            if before:
                change = abs(st.eigenvalue(row) - st.eigenvalue(before))
                self.assertLessEqual(abs(row["change"] * abs(st.eigenvalue(row)) - change), 1e-9 * change + 1e-6)
            if first and row["rate"] is not None:
                # Sizes halve: the order is log2 of the ratio of the changes.
                earlier = abs(st.eigenvalue(before) - st.eigenvalue(first))
                self.assertLessEqual(abs(row["rate"] - math.log2(earlier / change)), 1e-4)
                rates += 1
            if row["extrapolated_frequency_hz"] is not None:
                # Aitken's formula.
                a = before["frequency_hz"] - first["frequency_hz"]
                b = row["frequency_hz"] - before["frequency_hz"]
                limit = row["frequency_hz"] + b * (b / a) / (1 - b / a)
                self.assertLessEqual(abs(row["extrapolated_frequency_hz"] - limit), 1e-6 * abs(b) + 1e-6)
        self.assertGreater(rates, 5)
        screen = (results / "log.txt").read_text()
        self.assertIn("Convergence (change", screen)

    def test_tex(self):
        results = self.analyse({**STRIP, **UNIFORM, "Refinement/Cycles": 2})
        study, text = st.read_table(results / "convergence.csv"), (results / "convergence.tex").read_text()
        self.assertEqual(text.count(r"\begin{tabular}"), text.count(r"\end{tabular}"))
        lines = [line for line in text.splitlines() if line.endswith(r"\\") and "mode &" not in line]
        self.assertEqual(len(lines), len(study))
        for line, row in zip(lines, study):
            fields = [field.strip() for field in line.removesuffix(r"\\").split("&")]
            self.assertEqual(len(fields), 8)
            self.assertEqual(fields[3], f"${row['frequency_hz']:.4f}$")
            self.assertTrue(all(re.fullmatch(r"|--|\d+|\$-?\d+(\.\d+)?( \\cdot 10\^\{-?\d+\})?\$", field)
                                for field in fields), line)
        if not shutil.which("latex"):
            print("latex is not installed: the table was not compiled")
            return
        self.write("paper.tex", "\\documentclass{article}\n\\usepackage{booktabs}\n\\begin{document}\n\\scriptsize\n"
                                f"\\input{{{results / 'convergence.tex'}}}\n\\end{{document}}\n")
        done = subprocess.run(["latex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"], cwd=self.directory,
                              capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout[-2000:])

    def test_one_mesh(self):
        """Without a reference one mesh is no study; with one it has true errors. Old studies do not stay."""
        prm = self.write("study.prm", {**STRIP, **UNIFORM, "Refinement/Cycles": 2})
        results = self.directory / "output/study"
        one = "Refinement/Cycles=1"
        for extra, there in [([], True), (["--set", one], False)]:
            done = st.run(prm.name, *extra, directory=self.directory)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((results / "convergence.csv").exists(), there)
            self.assertEqual((results / "convergence.tex").exists(), there)
        reference = self.reference([row for row in st.read_table(results / "modes.csv")])
        done = st.run(prm.name, "--set", one, "--set", f"Refinement/Reference={reference}", directory=self.directory)
        self.assertEqual(done.returncode, 0, done.stderr)
        for row in st.read_table(results / "convergence.csv"):
            self.assertLessEqual(row["true_frequency_error_hz"], 1e-6)

    def test_bad_reference(self):
        """Said before anything is computed, by --check too: exit status 2, the key and what is wrong."""
        cases = {
            "missing": (None, "cannot be read"),
            "empty": ("", "empty"),
            "no_mode": (HEADER, "no mode"),
            "column": ("frequency_hz\n700\n", "growth_rate_1_per_s"),
            "word": (HEADER + "700,0\n750,fast\n", "line 3"),
            "hole": (HEADER + "700,\n", "line 2"),
            "fields": (HEADER + "700,0,1\n", "line 2"),
            "negative": (HEADER + "-700,0\n", "negative"),
            "infinite": (HEADER + "inf,0\n", "line 2"),
        }
        prm = self.write("study.prm", {**STRIP, **UNIFORM})
        for name, (content, message) in cases.items():
            with self.subTest(case=name):
                file = self.directory / f"{name}.csv"
                if content is not None:
                    file.write_text(content)
                for option in [[], ["--check"]]:
                    done = st.run(*option, prm.name, "--set", f"Refinement/Reference={file}",
                                  directory=self.directory, timeout=30)
                    self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
                    self.assertIn("Refinement/Reference", done.stderr)
                    self.assertIn(message, done.stderr)
                self.assertFalse((self.directory / "output").exists())
        file = self.write("good.csv", HEADER + "700,0\n\n")
        for setting in ["Stage=ladder", "Sweep/Parameter=Contact/Friction/Coefficient"]:
            done = st.run("--check", prm.name, "--set", f"Refinement/Reference={file}", "--set", setting, "--set",
                          "Sweep/Values=0, 0.1", "--set", "Refinement/Strategy=none", directory=self.directory)
            self.assertEqual(done.returncode, 2)
            self.assertIn("Refinement/Reference", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
