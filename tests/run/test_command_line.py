"""The command line, the manual of parameters, and the record that each run keeps of its input."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

TINY_ROTOR = {
    "Pads/Arrangement": "none",
    "Stage": "transport",
    "Discretization/Degree": 1,
    "Discretization/Rotor cells": "2, 9, 1",
    "Output/Fields": "none",
}


class CommandLine(st.TestCase):
    def assertPrints(self, *arguments):
        """Runs the program where it must succeed and compute nothing; returns what it prints."""
        before = sorted(self.directory.rglob("*"))
        result = st.run(*arguments, directory=self.directory, timeout=60)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("squeal:", result.stderr)
        self.assertEqual(sorted(self.directory.rglob("*")), before, "nothing may be written")
        return result.stdout

    def test_version(self):
        """The revision is known where the program was built in git."""
        self.assertRegex(self.assertPrints("--version"),
                         r"^squeal \d+\.\d+\.\d+( \(revision [0-9a-f]{7,}(, modified)?\))?\n"
                         r"  deal\.II 9\.\d+\.\d+\S*\n  PETSc .*\d\n  SLEPc .*\d\n  .*MPI.*\n"
                         r"(  OpenBLAS with kernels for \w+\n)?$")

    def test_kernels_of_blas(self):
        """OpenBLAS takes those of the processor, or what OPENBLAS_CORETYPE says."""
        def kernels(**told):
            environment = {name: value for name, value in st.ENVIRONMENT.items() if name != "OPENBLAS_CORETYPE"}
            text = st.run("--version", environment={**environment, **told}).stdout
            found = re.search(r"OpenBLAS with kernels for (\w+)", text)
            return found and found[1]

        cpu = pathlib.Path("/proc/cpuinfo")
        if kernels() is None or not cpu.exists() or " avx2 " not in cpu.read_text():
            self.skipTest("this test needs OpenBLAS and a processor with AVX2")
        self.assertNotEqual(kernels(), "Prescott")
        self.assertEqual(kernels(OPENBLAS_CORETYPE="Nehalem"), "Nehalem")

    def test_help(self):
        text = self.assertPrints("--help")
        for option in ["--set", "--check", "--print-parameters", "--version", "--help"]:
            self.assertIn(option, text)

    def test_help_of_a_key(self):
        text = self.assertPrints("--help", "rotor/THICK")
        self.assertRegex(text, r"(?s)^Rotor/Thickness = 0\.012\n  Thickness of the disc, m\..*\n  Allowed: \S")
        self.assertEqual(text.count("Allowed:"), 1)
        self.assertGreater(self.assertPrints("--help", "Friction").count("Allowed:"), 3)
        result = st.run("--help", "Thicknes of rotor", directory=self.directory)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("Thicknes of rotor", result.stderr)

    def test_output_that_cannot_be_written(self):
        """What was asked for has not arrived: status 1 and one message. /dev/full is a disk that is full."""
        file = self.write("brake.prm", {})
        small = self.write("small.prm", {**st.SMALL_BRAKE, "Discretization/Degree": 1,
                                         "Eigenproblem/Maximum frequency": 2000})
        for arguments in (["--print-parameters"], ["--print-parameters=md"], ["--help"], ["--version"], ["--check", file],
                          [small]):
            with open("/dev/full", "w") as full:
                result = subprocess.run([st.SQUEAL, *arguments], stdout=full, stderr=subprocess.PIPE, text=True,
                                        env=st.ENVIRONMENT, cwd=self.directory, timeout=100)
            self.assertEqual(result.returncode, 1, f"{arguments}: {result.stderr}")
            self.assertRegex(result.stderr, r"^\s*squeal: the standard output cannot be written", arguments)
        self.assertTrue((self.directory / "output/small/modes.csv").exists())

    def project_of_dummies(self, programs):
        """A project with the true run.sh, whose other programs are shell commands, by name."""
        root = self.directory / "project"
        for folder in ("scripts", "prm", "build/release", "bin"):
            (root / folder).mkdir(parents=True)
        shutil.copy(st.PROJECT / "scripts/run.sh", root / "scripts")
        for name, text in {"scripts/install-dependencies.sh": "", "scripts/build.sh": "", "build/release/squeal": "",
                           **programs}.items():
            (root / name).write_text(f"#!/bin/bash\n{text}\n")
            (root / name).chmod(0o755)
        return root

    def test_run_script_names_what_was_written(self):
        """Of runs with modes and of those without, as sweeps, maps and samples, whose page is made, too."""
        table_of = {"sweep": "sweep.csv", "map": "map.csv", "sampling": "samples.csv", "modes": "modes.csv"}
        root = self.project_of_dummies({"build/release/squeal": """
name=$(basename "${@: -1}" .prm)
if [[ $1 == --check ]]; then name=$(basename "$2" .prm); echo "Results go to output/$name"; exit; fi
mkdir -p output/$name; touch "output/$name/$TABLE\""""})
        (root / "scripts/report.py").write_text("import sys; print(sys.argv[1] + '/report.html')\n")
        for name, table in table_of.items():
            file = self.write(f"{name}.prm", {})
            result = subprocess.run([root / "scripts/run.sh", file], env={**os.environ, "TABLE": table}, text=True,
                                    capture_output=True)
            self.assertEqual(result.returncode, 0, result.stderr)
            for wanted in (f"output/{name}/report.html", f"output/{name}/{table}"):
                self.assertIn(wanted, result.stdout)
            self.assertEqual("scripts/plot.py" in result.stdout, name == "modes")

    def test_gmsh_scripts_of_others_are_not_run(self):
        """scripts/run.sh makes meshes of squeal's examples only: a Gmsh script may start any program. It names the command.
        Names that begin with a dash are no options. Everything that run.sh starts is a dummy here."""
        called = self.directory / "called"
        root = self.project_of_dummies({"bin/gmsh": f'printf "%s\\n" "$@" >> "{called}"'})
        environment = {**os.environ, "PATH": f"{root}/bin:{os.environ['PATH']}"}

        def run(mesh, place):
            (place / mesh).with_suffix(".geo").write_text('SystemCall "touch called";')
            called.unlink(missing_ok=True)
            name = mesh if place == root else place / mesh
            file = self.write("it.prm", {"Scene": "mesh", "Mesh/File": name})
            result = subprocess.run([root / "scripts/run.sh", file], env=environment, cwd=self.directory, text=True,
                                    capture_output=True)
            self.assertEqual(result.returncode, 0, result.stderr)
            return called.read_text().splitlines() if called.exists() else None, result.stderr

        arguments, _ = run("example.msh", root / "prm")
        self.assertEqual(arguments[1], str(root / "prm/example.geo"))
        arguments, err = run("mine.msh", self.directory)
        self.assertIsNone(arguments)
        self.assertIn("if you trust that script: gmsh -3", err)
        arguments, err = run("-x.msh", root)
        self.assertIsNone(arguments)
        self.assertIn(f"gmsh -3 {root}/-x.geo", err)
        # A link from the examples to elsewhere is elsewhere.
        (root / "prm/link.geo").symlink_to(self.directory / "mine.geo")
        file = self.write("it.prm", {"Scene": "mesh", "Mesh/File": "prm/link.msh"})
        subprocess.run([root / "scripts/run.sh", file], env=environment, cwd=self.directory, capture_output=True)
        self.assertFalse(called.exists())

    def test_warns_of_friction_that_is_zero(self):
        """A smoothed law has no friction at rest: what was meant to be a run with friction says so."""
        smoothed = {**st.SMALL_BRAKE, "Contact/Friction/Smoothing speed": 0.1}
        for name, settings, warned in (("rest", {**smoothed, "Operation/Angular velocity": 0}, True), ("turns", smoothed, False),
                                       ("elastic", {**smoothed, "Operation/Angular velocity": 0, "Stage": "elastic"}, False)):
            self.write(f"{name}.prm", settings)
            self.assertEqual("Warning, no friction" in self.assertPrints("--check", f"{name}.prm"), warned, name)

    def test_check_computes_nothing(self):
        self.write("case.prm", {**st.SMALL_BRAKE, "Contact/Friction/Coefficient": 0.123})
        text = self.assertPrints("--check", "case.prm")
        for word in ["case.prm", "0.123", "mortar", "output/case"]:
            self.assertIn(word, text)

    def test_units_of_the_strip(self):
        """A belt has a speed in m/s, and forces are those of one metre of its depth."""
        strip = {"Scene": "strip", "Discretization/Degree": 1, "Discretization/Rotor cells": "1, 8, 1",
                 "Discretization/Pad cells": "1, 2, 1", "Eigenproblem/Solver": "none", "Operation/Angular velocity": 3}
        self.write("strip.prm", strip)
        self.assertIn(", 3 m/s", self.assertPrints("--check", "strip.prm"))
        log = (self.analyse(strip) / "log.txt").read_text()
        # 1e6 Pa on a block of 0.05 m, of whose three nodes the last one has opened
        self.assertRegex(log, r"Block: normal force 50000 N/m, friction force \S+ N/m, length in contact 0.0375 m, ")
        self.assertNotRegex(log, "rad/s|torque")

    def test_runs_without_a_directory_for_temporary_files(self):
        """Many runs that start and end at the same time once shared one, and took it from each other."""
        version = re.search(r"Open MPI v?(\d+)", st.run("--version").stdout)
        if int(version[1]) >= 5:
            self.skipTest("Open MPI 5 does not start without one")
        self.write("case.prm", TINY_ROTOR)
        result = st.run("case.prm", directory=self.directory, environment={**st.ENVIRONMENT, "TMPDIR": "/dev/null"})
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_set_overrides_the_file(self):
        self.write("case.prm", st.SMALL_BRAKE)
        text = self.assertPrints("--check", "case.prm", "--set", "Contact/Friction/Coefficient=0.123",
                                 "--set", "Output/Directory = elsewhere")
        self.assertIn("0.123", text)
        self.assertIn("elsewhere", text)

    def test_the_last_of_two_settings_counts(self):
        self.write("case.prm", st.SMALL_BRAKE)
        text = self.assertPrints("--check", "case.prm", "--set", "Contact/Friction/Coefficient=0.123",
                                 "--set", "Contact/Friction/Coefficient=0.456")
        self.assertIn("0.456", text)
        self.assertNotIn("0.123", text)

    def test_included_files(self):
        """A line 'include name' stands for a file beside; what comes later counts; parameters.prm needs none of them."""
        (self.directory / "base").mkdir()
        self.write("base/brake.prm", "include rotor/thin.prm  # comment\n" + st.parameter_file({**TINY_ROTOR, "Scene": "brake"}))
        (self.directory / "base/rotor").mkdir()
        self.write("base/rotor/thin.prm", st.parameter_file({"Rotor/Thickness": "0.001 * (4 + 6)", "Discretization/Degree": 2}))
        self.write("mine.prm", "include\tbase/brake.prm\nsubsection Operation\n  set Angular velocity = 2*pi*3\nend\n"
                   "subsection Eigenproblem\n  set Maximum frequency = 1e3\nend\n")
        directory = self.directory / "output/mine"
        for ranks in (1, 2):
            result = st.run("mine.prm", "--overwrite", ranks=ranks, directory=self.directory)
            self.assertEqual(result.returncode, 0, result.stderr)
            used = (directory / "parameters.prm").read_text()
            for words in ("set Thickness = 0.01\n", "set Angular velocity = 18.849555921538759\n"):
                self.assertIn(words, re.sub(" +", " ", used))
            self.assertNotIn("include", used)
            # Of the file that includes the other one
            self.assertRegex(re.sub(" +", " ", used), r"set Degree = 1\n")
            self.assertEqual((directory / "original.prm").read_text(), (self.directory / "mine.prm").read_text())
        for text, words in [("include nowhere.prm\n", "nowhere.prm: the parameter file cannot be read"),
                            ("include refused.prm\n", "refused.prm includes itself"),
                            ("include a.prm\n", "refused.prm includes itself"), ("subsection Pads\ninclude mine.prm\nend\n", "outside of subsections"),
                            ("include \\\nmine.prm\n", "in the same line"), ("include\n", "'include file'"),
                            ("subsection Operation\n  set Angular velocity = 1,5\nend\n", "Operation/Angular velocity = 1,5: not allowed"),
                            ("subsection Operation\n  set Angular velocity = 2*omega\nend\n", "not allowed"),
                            ("subsection Operation\n  set Angular velocity = 1/0\nend\n", "not allowed"),
                            ("subsection Operation\n  set Angular velocity = rand()*3\nend\n", "not allowed"),
                            ("subsection Operation\n  set Angular velocity = no_variable*3\nend\n", "not allowed"),
                            ("subsection Discretization\n  set Degree = 3/2\nend\n", "Discretization/Degree = 3/2: not allowed")]:
            with self.subTest(text):
                self.write("a.prm", "include refused.prm\n")
                self.write("refused.prm", text)
                result = st.run("refused.prm", "--check", directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertIn(words, result.stderr)
        self.write("refused.prm", "subsection Discretization\n  set Degree = 4/2\nend\n")
        self.assertEqual(st.run("refused.prm", "--check", directory=self.directory).returncode, 0)

    def test_shipped_parameter_files_are_valid(self):
        files = sorted((st.PROJECT / "prm").glob("**/*.prm"))
        self.assertTrue(files)
        for file in files:
            with self.subTest(file.name):
                # Names of matrix files are relative to the project.
                result = st.run("--check", file, directory=st.PROJECT, timeout=60)
                self.assertEqual(result.returncode, 0, result.stderr)

    # The manual

    def test_manual_as_parameter_file(self):
        manual = self.assertPrints("--print-parameters=prm")
        self.write("manual.prm", manual)
        self.write("empty.prm", "")
        described = [self.assertPrints("--check", name).replace(name[:-4], "") for name in ["manual.prm", "empty.prm"]]
        self.assertEqual(described[0], described[1], "the printed values are not the defaults")

        # Values that differ from the defaults survive being written and read as well.
        directory = self.analyse({**TINY_ROTOR, "Rotor/Material/Density": 7123.456789})
        again = st.run("--check", directory / "parameters.prm", directory=self.directory)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertIn("7123.456789", (directory / "parameters.prm").read_text())

    def test_manual_as_json(self):
        manual = json.loads(self.assertPrints("--print-parameters=json"))
        thickness = manual["Rotor"]["Thickness"]
        self.assertEqual(float(thickness["default_value"]), 0.012)
        self.assertIn("m.", thickness["documentation"])

    def test_manual_as_table(self):
        lines = self.assertPrints("--print-parameters=md").splitlines()
        n_columns = lines[0].count("|")
        for line in lines:
            # A bar inside of a cell must be escaped, or it ends the cell.
            self.assertEqual(line.replace(r"\|", "").count("|"), n_columns, line)
            self.assertNotIn("MAX_DOUBLE", line)

        def keys(tree, path=()):
            for name, node in tree.items():
                name = name.replace("_20", " ")
                yield from ["/".join((*path, name))] if "default_value" in node else keys(node, (*path, name))

        manual = json.loads(self.assertPrints("--print-parameters=json"))
        self.assertEqual([line.split("|")[1].strip() for line in lines[2:]], list(keys(manual)))

    def test_reference_in_the_manual(self):
        """doc/parameters.md is what the program says; its head tells how to make it again."""
        self.assertTrue((st.PROJECT / "doc/parameters.md").read_text().endswith(
            "\n\n" + self.assertPrints("--print-parameters=md")))

    def test_every_parameter_is_explained(self):
        for line in self.assertPrints("--print-parameters=md").splitlines()[2:]:
            self.assertNotEqual(line.replace(r"\|", "").split("|")[4].strip(), "", line)

    # The record of a run

    def test_record_of_the_input(self):
        text = "# A remark\r\nset Stage=elastic\n\n" + st.parameter_file({**TINY_ROTOR, "Stage": "elastic"}) + "  "
        self.write("case.prm", text)
        result = st.run("case.prm", directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stderr)
        results = self.directory / "output/case"
        self.assertEqual((results / "original.prm").read_bytes(), (self.directory / "case.prm").read_bytes())
        self.assertEqual((results / "log.txt").read_text(), result.stdout)

    def test_parameters_prm_reproduces_the_run(self):
        self.write("case.prm", st.SMALL_BRAKE)
        first = st.run("case.prm", "--set", "Contact/Friction/Coefficient=0.4567", directory=self.directory)
        self.assertEqual(first.returncode, 0, first.stderr)
        results = self.directory / "output/case"
        second = st.run(results / "parameters.prm", "--set", "Output/Directory=again", directory=self.directory)
        self.assertEqual(second.returncode, 0, second.stderr)
        self.assertEqual((self.directory / "again/modes.csv").read_bytes(), (results / "modes.csv").read_bytes())
        self.assertTrue(st.read_table(results / "modes.csv"))

    def test_results_of_an_earlier_run_are_removed(self):
        settings = {**TINY_ROTOR, "Output/Directory": "results", "Output/Fields": "all", "Output/Animation frames": 2}
        self.analyse_into_results(settings)
        results = self.directory / "results"
        self.assertTrue(list(results.glob("mode-*")))
        # Frames of animations have a directory of their own, which is not in the way of the tables.
        self.assertFalse(list(results.glob("*frame-*")))
        frames = {path.name for path in (results / "frames").iterdir()}
        self.assertIn("mode-0-001-frame-001.pvtu", frames)
        pvd = (results / "mode-0-001.pvd").read_text()
        for name in re.findall(r'file="([^"]+)"', pvd):
            self.assertTrue((results / name).is_file(), name)
        (results / "notes.txt").write_text("mine")
        self.analyse_into_results({**settings, "Output/Fields": "none"})
        self.assertFalse(list(results.glob("mode-*")))
        self.assertFalse((results / "frames").exists())
        self.assertEqual((results / "notes.txt").read_text(), "mine", "a file of the user's was touched")

    def analyse_into_results(self, settings):
        self.write("case.prm", settings)
        result = st.run("case.prm", directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_tables(self):
        # Names and order of columns that comparison scripts rely on; unknown values are empty.
        results = self.analyse(st.SMALL_BRAKE)
        modes = "cycle,mode,growth_rate_1_per_s,frequency_hz,damping_ratio,verdict," \
                "growth_rate_error_1_per_s,frequency_error_hz,backward_error,condition_number," \
                "d_1_per_s,g_1_per_s,k_1_per_s2,n_1_per_s2"
        self.assertTrue((results / "modes.csv").read_text().startswith(modes))
        rows = st.read_table(results / "modes.csv")
        self.assertEqual([row["mode"] for row in rows], list(range(1, len(rows) + 1)))
        frequencies = [row["frequency_hz"] for row in rows]
        self.assertEqual(frequencies, sorted(frequencies))
        self.assertLessEqual(frequencies[-1], 6000)
        for row in rows:
            l = st.eigenvalue(row)
            self.assertAlmostEqual(row["damping_ratio"], -l.real / abs(l), delta=1e-9)
            self.assertIn(row["verdict"], ["stable", "flutter", "divergence", "marginal", "undecided"])
        cycles = (results / "cycles.csv").read_text().splitlines()
        self.assertTrue(cycles[0].startswith("cycle,cells,dofs,multipliers,seconds_"))
        self.assertTrue(cycles[0].endswith(",seconds_total,memory_mib"))
        static = (results / "static.csv").read_text().splitlines()
        self.assertEqual(static[0], "cycle,pad,normal_force_n,friction_force_n,friction_torque_nm,contact_area_m2,"
                                    "max_pressure_pa,max_penetration_m,self_energising_gain,needed_friction")


if __name__ == "__main__":
    unittest.main(verbosity=2)
