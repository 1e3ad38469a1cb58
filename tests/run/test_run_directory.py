"""The run directory: one run at a time, no foreign file touched, no results of another run deleted unasked, and a resumed
run that is the uninterrupted one or says why it begins anew. doc/reliability.md has what is promised."""

import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import element_files  # noqa: E402
import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

FRICTION = "Contact/Friction/Coefficient"
BRAKE = {"Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1", "Discretization/Pad cells": "1, 2, 1",
         "Eigenproblem/Maximum frequency": 3000, "Eigenproblem/Error bars": "false", "Output/Fields": "none"}
SWEEP = {**BRAKE, "Sweep/Parameter": FRICTION, "Sweep/Values": "0.1 : 0.5 : 9"}
# Long enough to be killed on its way; where it is run again as a whole, too, and where another run is to meet it.
MEDIUM = {**SWEEP, "Sweep/Values": "0.1 : 0.5 : 50"}
LONG = {**SWEEP, "Sweep/Values": "0.1 : 0.5 : 400"}
MAP = {**BRAKE, "Sweep/Parameter": FRICTION, "Sweep/Values": "0.1 : 1.5 : 9",
       "Sweep/Second parameter": "Operation/Angular velocity", "Sweep/Second values": "5 : 20 : 3"}
FALLING_MAP = {**MAP, "Contact/Friction/Law": "falling", "Eigenproblem/Maximum frequency": 6000,
               "Sweep/Values": "0.1 : 0.6 : 9", "Sweep/Second values": "1 : 10 : 3"}
# Large enough for values to be projected
PROJECTED_MAP = {**st.SMALL_BRAKE, "Eigenproblem/Error bars": "false", "Eigenproblem/Maximum frequency": 2500,
                 "Contact/Steady pressure": "uniform", "Sweep/Parameter": FRICTION, "Sweep/Values": "0.2 : 0.3 : 4",
                 "Sweep/Second parameter": "Operation/Angular velocity", "Sweep/Second values": "10, 11"}
ADAPTIVE = {**BRAKE, "Eigenproblem/Error bars": "true", "Refinement/Strategy": "adaptive", "Refinement/Cycles": 2,
            "Refinement/Tolerance": 1e-4, "Sweep/Parameter": FRICTION, "Sweep/Values": "0.3, 0.4"}
MESH = {**BRAKE, **mesh_files.SCENE, "Mesh/File": "brake.msh", "Sweep/Parameter": FRICTION, "Sweep/Values": "0.1 : 0.5 : 40"}
MESH_MAP = {**MESH, "Sweep/Values": "0.1 : 0.5 : 8", "Sweep/Second parameter": "Operation/Angular velocity",
            "Sweep/Second values": "5 : 20 : 3"}
MESH_REFINEMENT = {**{key: value for key, value in MESH.items() if not key.startswith("Sweep/")},
                   "Eigenproblem/Error bars": "true", "Refinement/Strategy": "adaptive", "Refinement/Cycles": 2,
                   "Refinement/Tolerance": 1e-9}
# Times and memory differ from run to run, and the log says that it was resumed.
MAY_DIFFER = {"cycles.csv", "log.txt", "original.prm", "parameters.prm", "run.manifest", "run.lock"}

# A run is killed at every fifth of the places, a map at every third; with SQUEAL_ALL_KILLS in the environment at all of
# them (ten minutes).
STEP = 1 if os.environ.get("SQUEAL_ALL_KILLS") else 5


class RunDirectory(st.TestCase):
    def squeal(self, *arguments, **options):
        return st.run(*arguments, directory=self.directory, **options)

    def tables(self, results):
        return {path.name: path.read_bytes() for path in sorted(results.iterdir()) if path.name not in MAY_DIFFER}

    def write_mesh(self, thickness=1.):
        mesh = mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1))
        mesh.move(lambda x, y, z: (x, y, thickness * z))
        self.write("brake.msh", mesh_files.msh2(mesh))

    def stopped(self, settings, n_lines=30):
        """A sweep that was killed after some lines, with a state to resume from."""
        results = self.kill(settings, lambda results: (results / "sweep.state").exists() and
                            (results / "sweep.csv").read_text().count("\n") > n_lines)
        self.assertTrue((results / "sweep.state").exists(), "the sweep ended too early for this test")
        return results

    def put_back(self, results, kept):
        """The directory of a run that was stopped, as it was."""
        shutil.rmtree(results)
        shutil.copytree(kept, results)

    def assertBeginsAnew(self, settings, reason, ranks=1):
        """killed.prm started again gives the tables of a run of its own, and says why it does not go on."""
        result = self.squeal("killed.prm", ranks=ranks)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("Resumed after", result.stdout)
        self.assertRegex(result.stdout, "not resumed.*begins? anew.*" + reason)
        results, whole = self.directory / "output/killed", self.analyse(settings, ranks=ranks)
        if ranks == 1:
            self.assertEqual(self.tables(results), self.tables(whole))
            return
        # Sums over ranks have no order: the last digits of equal runs differ.
        rows, expected = (st.read_table(place / "sweep.csv") for place in (results, whole))
        self.assertEqual([(row["parameter"], row["branch"]) for row in rows],
                         [(row["parameter"], row["branch"]) for row in expected])
        for a, b in zip(rows, expected):
            self.assertLess(abs(st.eigenvalue(a) - st.eigenvalue(b)), 1e-8 * abs(st.eigenvalue(b)))

    # Point 1: the files that the parameters name.

    def test_mesh_that_changed(self):
        self.write_mesh()
        self.stopped(MESH)
        self.write_mesh(thickness=1.1)
        self.assertBeginsAnew(MESH, "Mesh/File = brake.msh")

    def test_mesh_that_changed_in_a_map_or_refinement(self):
        for settings, state in [(MESH_MAP, "map.state"), (MESH_REFINEMENT, "refinement.state")]:
            with self.subTest(state=state):
                self.write_mesh()
                results = self.kill(settings, lambda results, name=state: (results / name).exists())
                self.assertTrue((results / state).exists(), "the run ended too early for this test")
                self.write_mesh(thickness=1.1)
                self.assertBeginsAnew(settings, "Mesh/File = brake.msh")

    def test_matrix_that_changed(self):
        for name in ["mass", "damping", "stiffness", "load"]:
            shutil.copy(st.PROJECT / f"prm/theory/ziegler_{name}.mtx", self.directory)
        pendulum = {"Scene": "matrices", "Matrices/Mass": "ziegler_mass.mtx", "Matrices/Velocity": "ziegler_damping.mtx",
                    "Matrices/Stiffness": "ziegler_stiffness.mtx", "Matrices/Circulatory": "ziegler_load.mtx",
                    "Eigenproblem/Maximum frequency": 1, "Sweep/Parameter": "Matrices/Circulatory factor",
                    "Sweep/Values": "1 : 1.4 : 300"}
        self.stopped(pendulum)
        stiffness = self.directory / "ziegler_stiffness.mtx"
        stiffness.write_text((st.PROJECT / "prm/theory/ziegler_mass.mtx").read_text())
        self.assertBeginsAnew(pendulum, "Matrices/Stiffness = ziegler_stiffness.mtx")

    def test_other_number_of_ranks(self):
        short = {**SWEEP, "Sweep/Values": "0.1 : 0.5 : 40"}
        self.stopped(short, n_lines=1)
        self.assertBeginsAnew(short, "ranks", ranks=2)

    # Point 2: two runs at once.

    def test_two_runs_at_once(self):
        file = self.write("b.prm", LONG)
        first = subprocess.Popen([str(st.SQUEAL), file.name], cwd=self.directory, env=st.ENVIRONMENT,
                                 stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        table = self.directory / "output/b/sweep.csv"
        while not table.exists() and first.poll() is None:
            time.sleep(0.005)
        second = self.squeal(file.name)
        self.assertIsNone(first.poll(), "the first run ended too early for this test")
        self.assertEqual(second.returncode, 2, second.stdout)
        self.assertIn(f"process {first.pid} on ", second.stderr)
        _, err = first.communicate()
        self.assertEqual(first.returncode, 0, err)
        self.assertEqual(len({row["parameter"] for row in st.read_table(table)}), 400)
        self.assertFalse((table.parent / "run.lock").exists())

    def test_lock_of_a_killed_run(self):
        """What kill -9 leaves does not keep others out."""
        results = self.stopped(MEDIUM, n_lines=1)
        self.assertTrue((results / "run.lock").exists())
        self.resume()
        self.assertFalse((results / "run.lock").exists())

    def test_foreign_lock(self):
        """A file run.lock that no run wrote stays, also where the run is refused for another reason; an empty one may be
        somebody's, too. What a killed run left, or the beginning of a manifest, is taken."""
        results = self.directory / "output/b"
        results.mkdir(parents=True)
        lock, manifest = results / "run.lock", results / "run.manifest.part"
        self.write("b.prm", {**BRAKE, "Stage": "elastic"})
        for text, others in (("mine", ["modes.csv"]), ("process 12 on here, my notes\n", []), ("process 1 on here\nmine", [])):
            lock.write_text(text)
            for name in others:
                (results / name).write_text("mine")
            result = self.squeal("b.prm", "--overwrite")
            self.assertEqual((result.returncode, lock.read_text()), (2, text), result.stdout)
            self.assertIn("run.lock, which no run of squeal wrote", result.stderr)
            for name in others:
                (results / name).unlink()
        lock.unlink()
        aside = self.directory / "aside"
        aside.write_text("mine")
        lock.symlink_to(aside)
        self.assertEqual((self.squeal("b.prm").returncode, aside.read_text()), (2, "mine"))
        lock.unlink()
        manifest.write_text("mine")
        result = self.squeal("b.prm")
        self.assertEqual((result.returncode, manifest.read_text()), (2, "mine"))
        self.assertIn("run.manifest.part", result.stderr)
        manifest.write_text("squeal mani")
        lock.write_text("")
        self.assertEqual(self.squeal("b.prm").returncode, 0)
        self.assertEqual((lock.read_text(), manifest.exists()), ("", False))
        lock.write_text("process 1 on elsewhere\n")
        self.assertEqual(self.squeal("b.prm").returncode, 0)
        self.assertFalse(lock.exists())

    # Point 3: a resumed map.

    @st.needs_fork_server
    def test_resumed_map(self):
        """After each of its states a map goes on with the digits of the uninterrupted one. Resumed runs had other
        starts of the static state, and other sums of the terms that vary: 1e-6. What is projected after the resumption is
        projected in the uninterrupted map: its expansion point must know, too, that nothing grows outside of the disc."""
        for settings, least in [(MAP, 2), (FALLING_MAP, 2), (PROJECTED_MAP, 1)]:
            shutil.rmtree(self.directory / "output", ignore_errors=True)
            self.write("killed.prm", settings)
            names = self.renamed("killed.prm")
            whole = self.tables(self.directory / "output/killed")
            # The change of a name after that of a state
            kills = [number + 1 for number, name in enumerate(names[:-1], 1) if name == "map.state"]
            self.assertGreaterEqual(len(kills), least)
            # Each of the large map costs some seconds.
            for number in kills[:1] if settings is PROJECTED_MAP else kills[::min(STEP, 2)]:
                shutil.rmtree(self.directory / "output/killed")
                self.assertTrue(self.traced("rename", number, "killed.prm"))
                result = self.squeal("killed.prm")
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn("Resumed after", result.stdout)
                self.assertEqual(self.tables(self.directory / "output/killed"), whole, number)

    def test_accuracy_of_a_border(self):
        """A point of the border is where Re l = 0 for a run of its own, up to the accuracy that is told.

        The run of its own finds the growth rate to 1e-9 |l| at most. The slope is that of its sensitivities, at the first
        point compared with a difference quotient."""
        directory = self.analyse(FALLING_MAP)
        border = st.read_table(directory / "border.csv")
        self.assertGreater(len(border), 3)
        keys, cell = [FRICTION, "Operation/Angular velocity"], [0.5 / 8, 9 / 2]
        single = {key: value for key, value in FALLING_MAP.items() if not key.startswith("Sweep/")}

        def growth_and_slopes(values, frequency):
            """1/s, and by both numbers 1/s per cell."""
            results = self.analyse({**single, **dict(zip(keys, map(repr, values))), "Eigenproblem/Solver": "dense",
                                    "Eigenproblem/Tolerance": 1e-12, "Output/Sensitivities": "true"})
            mode = min(st.read_table(results / "modes.csv"), key=lambda row: abs(row["frequency_hz"] - frequency))
            by = {row["parameter"]: row["d_growth_rate_1_per_s"] for row in st.read_table(results / "sensitivities.csv")
                  if row["mode"] == mode["mode"]}
            return mode["growth_rate_1_per_s"], [by[key] * width for key, width in zip(keys, cell)]

        for row in border:
            values, frequency = [row[key] for key in keys], row["frequency_hz"]
            growth, slopes = growth_and_slopes(values, frequency)
            if row is border[0]:
                h = 1e-3
                for k in range(2):
                    above, below = (growth_and_slopes([value + sign * h * cell[k] * (i == k) for i, value in enumerate(values)],
                                                      frequency)[0] for sign in (1, -1))
                    self.assertLess(abs((above - below) / (2 * h) - slopes[k]), 1e-3 * math.hypot(*slopes))
            rounding = 1e-12 * 2 * math.pi * frequency
            self.assertLessEqual(abs(growth), row["accuracy_cells"] * math.hypot(*slopes) + rounding)

    # Point 4: the order of writing. A kill at each call that changes a name.

    @st.needs_fork_server
    def test_killed_at_the_start(self):
        """Another brake is started in the directory of an interrupted sweep, and killed while it takes the directory.
        Started again it must not go on with the first brake's values."""
        other = {**MEDIUM, "Pads/Thickness": 0.02}
        whole = self.tables(self.analyse(other))
        results = self.stopped(MEDIUM, n_lines=1)
        kept = shutil.copytree(results, self.directory / "kept")
        self.write("killed.prm", other)
        for call in ["unlink", "rename"]:
            for number in range(1, 6):
                with self.subTest(call=call, number=number):
                    self.put_back(results, kept)
                    self.traced(call, number, "killed.prm", "--overwrite")
                    result = self.squeal("killed.prm", "--overwrite")
                    self.assertEqual(result.returncode, 0, result.stderr)
                    self.assertEqual(self.tables(self.directory / "output/killed"), whole)

    def traced(self, call, number, *arguments):
        """Runs the program and kills it at the number-th such call; whether it got so far."""
        return self.squeal(*arguments, KILL_AT=f"{call}:{number}").returncode == -signal.SIGKILL

    def renamed(self, *arguments):
        """Runs the program; the new names of files that are renamed on the way."""
        return [pathlib.Path(name).name for name in re.findall(r"(?m)^rename (.*)$", self.trace(*arguments))]

    def trace(self, *arguments):
        """Runs the program; its calls that change files, a line each."""
        file = self.directory / "trace"
        file.unlink(missing_ok=True)
        result = self.squeal(*arguments, TRACE=str(file))
        self.assertEqual(result.returncode, 0, result.stderr)
        return file.read_text()

    @st.needs_fork_server
    def test_killed_at_calls(self):
        """Sweep, map, refinement: at renames, unlinks, changes of length and syncs."""
        for settings in [SWEEP, MAP, ADAPTIVE]:
            whole = self.tables(self.analyse(settings))
            for call in ["rename", "unlink", "ftruncate", "fsync"]:
                n_kills = 0
                for number in range(1, 200, STEP * (10 if call == "fsync" else 5)):
                    shutil.rmtree(self.directory / "output/killed", ignore_errors=True)
                    self.write("killed.prm", settings)
                    if not self.traced(call, number, "killed.prm"):
                        break
                    n_kills += 1
                    result = self.squeal("killed.prm")
                    self.assertEqual(result.returncode, 0, f"{call} {number}: {result.stderr}")
                    self.assertEqual(self.tables(self.directory / "output/killed"), whole, f"{call} {number}")
                self.assertGreater(n_kills, 0, call)

    # Point 5: input among the results.

    def test_input_among_the_results(self):
        """The modes of a coarse brake as the reference of a finer one, in the same directory."""
        file = self.write("b.prm", BRAKE)
        self.assertEqual(self.squeal(file.name).returncode, 0)
        reference = self.directory / "output/b/modes.csv"
        before = reference.read_text()
        result = self.squeal(file.name, "--set", f"Refinement/Reference={reference}", "--overwrite")
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn("Refinement/Reference = ", result.stderr)
        self.assertIn("Copy it", result.stderr)
        self.assertEqual(reference.read_text(), before)
        copy = self.directory / "coarse.csv"
        copy.write_text(before)
        result = self.squeal(file.name, "--set", f"Refinement/Reference={copy}", "--overwrite")
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_included_files_among_the_results(self):
        """A parameter file that includes the record of an earlier run, as it is named, or through a link, and a deck one of
        whose files lies there: of a name that the run may need."""
        self.write("b.prm", {**BRAKE, "Stage": "elastic"})
        self.assertEqual(self.squeal("b.prm").returncode, 0)
        record = self.directory / "output/b/parameters.prm"
        before = record.read_text()
        (self.directory / "link.prm").symlink_to(record)
        for name in ("output/b/parameters.prm", "link.prm"):
            (self.directory / "c.prm").write_text(f"include {name}\nsubsection Output\n  set Directory = output/b\nend\n")
            result = self.squeal("c.prm", "--overwrite")
            self.assertEqual((result.returncode, record.read_text()), (2, before), result.stdout)
            self.assertIn("The included file = ", result.stderr)
        result = self.squeal("c.prm", "--set", "Output/Directory=output/c")
        self.assertEqual(result.returncode, 0, result.stderr)

        deck, nodes = element_files.assembly(element_files.Elements(mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1)),
                                                                    lambda name: 8), {"Disc": ["rotor"], "Up": ["upper"], "Low": ["lower"]},
                                             include=True)
        (self.directory / "output/d").mkdir()
        (self.directory / "output/d/log.txt").write_text(nodes)
        self.write("mesh.inp", deck.replace("nodes.txt", "output/d/log.txt"))
        self.write("d.prm", {**BRAKE, **mesh_files.SCENE, "Mesh/File": "mesh.inp", "Mesh/Rotor": "DISC-1",
                             "Mesh/Pads": "UP-1, LOW-1", "Eigenproblem/Solver": "none"})
        result = self.squeal("d.prm")
        self.assertEqual((result.returncode, (self.directory / "output/d/log.txt").read_text()), (2, nodes), result.stdout)
        result = self.squeal("d.prm", "--set", "Output/Directory=output/e")
        self.assertEqual(result.returncode, 0, result.stderr)
        # So that a run that is interrupted notices when it changes
        self.assertIn("Mesh/File includes = output/d/log.txt", (self.directory / "output/e/run.manifest").read_text())

    # Point 6: foreign files, and the results of another run.

    def test_foreign_files_stay(self):
        own = ["thesis.pvd", "shaft.vtu", "video.part", "solver.state", "original.txt", "report.html", "notes.csv"]
        for name in own:
            self.write(name, "mine")
        self.write("b.prm", {**BRAKE, "Output/Directory": "."})
        for _ in range(2):
            result = self.squeal("b.prm")
            self.assertEqual(result.returncode, 0, result.stderr)
            for name in own:
                self.assertTrue((self.directory / name).exists(), name)
                self.assertEqual((self.directory / name).read_text(), "mine")

    def test_foreign_file_of_the_same_name(self):
        for name in ["mesh.csv", "log.txt", "modes.csv", "original.prm", "modes.csv.part", "mode-0-001.vtu",
                     "response.csv", "frames/mode-0-001-frame-000.vtu", "frames"]:
            with self.subTest(name=name):
                results = self.directory / name.replace(".", "-").replace("/", "-in-")
                (results / name).parent.mkdir(parents=True)
                (results / name).write_text("mine")
                self.write("b.prm", {**BRAKE, "Output/Directory": results})
                for option in [[], ["--overwrite"]]:
                    result = self.squeal("b.prm", *option)
                    self.assertEqual(result.returncode, 2, result.stdout)
                    self.assertIn(name, result.stderr)
                    self.assertEqual([path for path in results.rglob("*") if path.is_file()], [results / name])
                    self.assertEqual((results / name).read_text(), "mine")

    def test_results_of_another_run(self):
        file = self.write("b.prm", BRAKE)
        results = self.directory / "output/b"
        self.assertEqual(self.squeal(file.name).returncode, 0)
        before = self.tables(results)
        # The same again is no other run.
        self.assertEqual(self.squeal(file.name).returncode, 0)
        self.assertEqual(self.tables(results), before)
        other = self.write("other.prm", {**BRAKE, FRICTION: 0.3, "Output/Directory": "output/b"})
        result = self.squeal(other.name)
        self.assertEqual(result.returncode, 2, result.stdout)
        for part in ["Output/Directory = output/b", f"{FRICTION} = 0.6 there, 0.3 now", "--overwrite"]:
            self.assertIn(part, result.stderr)
        self.assertEqual(self.tables(results), before)
        result = self.squeal(other.name, "--overwrite")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(f"Replaced: the results of another run ({FRICTION} = 0.6 there, 0.3 now", result.stdout)
        self.assertNotEqual(self.tables(results)["modes.csv"], before["modes.csv"])

    def test_same_file_with_other_parameters(self):
        """Who changes a parameter file and runs it again gets the new results, and is told."""
        file = self.write("b.prm", BRAKE)
        self.assertEqual(self.squeal(file.name).returncode, 0)
        result = self.squeal(file.name, "--set", f"{FRICTION}=0.3")
        self.assertEqual(result.returncode, 0, result.stderr)
        said = f"Replaced: the results of another run ({FRICTION} = 0.6 there, 0.3 now)"
        self.assertIn(said, result.stdout)
        self.assertIn(said, (self.directory / "output/b/log.txt").read_text())

    def test_interrupted_run_of_other_parameters(self):
        results = self.stopped(MEDIUM, n_lines=1)
        before = self.tables(results)
        self.write("killed.prm", {**MEDIUM, "Pads/Thickness": 0.02})
        result = self.squeal("killed.prm")
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertEqual(self.tables(results), before)
        self.write("killed.prm", MEDIUM)
        self.resume()

    def test_older_version(self):
        """Results without a manifest: the same parameters replace them, others are refused."""
        file = self.write("b.prm", BRAKE)
        results = self.directory / "output/b"
        self.assertEqual(self.squeal(file.name).returncode, 0)
        expected = self.tables(results)
        for options, status in [([], 0), (["--set", f"{FRICTION}=0.3"], 2), (["--set", f"{FRICTION}=0.3", "--overwrite"], 0)]:
            (results / "run.manifest").unlink()
            (results / "mine.vtu").write_text("mine")
            result = self.squeal(file.name, *options)
            self.assertEqual(result.returncode, status, result.stderr)
            self.assertEqual((results / "mine.vtu").read_text(), "mine")
            (results / "mine.vtu").unlink()
            if status == 2:
                self.assertEqual(self.tables(results), expected)
                self.assertEqual(self.squeal(file.name).returncode, 0)

    # Point 7: states and tables that somebody changed.

    def test_damaged_state(self):
        whole = self.tables(self.analyse(MEDIUM))
        damages = {"half": lambda data: data[:len(data) // 2], "empty": lambda data: b"",
                   "a bit": lambda data: data[:40] + bytes([data[40] ^ 1]) + data[41:],
                   "a size": lambda data: data[:15] + b"\xff" * 8 + data[23:], "noise": lambda data: os.urandom(len(data)),
                   "longer": lambda data: data + b"12345678"}
        results = self.stopped(MEDIUM, n_lines=1)
        kept = shutil.copytree(results, self.directory / "kept")
        for name, damage in damages.items():
            with self.subTest(damage=name):
                self.put_back(results, kept)
                state = results / "sweep.state"
                state.write_bytes(damage(state.read_bytes()))
                result = self.squeal("killed.prm")
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn("begins anew: sweep.state", result.stdout)
                self.assertEqual(self.tables(results), whole)

    def test_changed_table(self):
        """Shortened, or saved by a spreadsheet: neither bytes of zero nor half lines."""
        whole = self.tables(self.analyse(MEDIUM))
        changes = {"shorter": lambda text: text[:60], "saved": lambda text: text.replace(",", ";"),
                   "carriage returns": lambda text: text.replace("\n", "\r\n")}
        results = self.stopped(MEDIUM, n_lines=1)
        kept = shutil.copytree(results, self.directory / "kept")
        for name, change in changes.items():
            with self.subTest(change=name):
                self.put_back(results, kept)
                table = results / "sweep.csv"
                table.write_bytes(change(table.read_bytes().decode()).encode())
                result = self.squeal("killed.prm")
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn("somebody changed it", result.stdout)
                self.assertEqual(self.tables(results), whole)

    @st.needs_fork_server
    def test_synced_before_renamed(self):
        """Tables and the state are on the disk before the state has its name."""
        self.write("b.prm", SWEEP)
        calls = [line for line in self.trace("b.prm").splitlines() if line.startswith(("fsync", "rename"))]
        renames = [i for i, line in enumerate(calls) if re.match(r"rename .*sweep\.state$", line)]
        self.assertTrue(renames)
        for i in renames:
            before = "\n".join(calls[max(0, i - 4):i])
            self.assertRegex(before, r"(?m)^fsync .*sweep\.csv$")
            self.assertRegex(before, r"(?m)^fsync .*sweep\.state\.part$")

    # Point 8.

    def test_values_that_cannot_be_reproduced(self):
        file = self.write("b.prm", BRAKE)
        for value in ["Output/Directory=a#b", "Pads/Pressure profile=1 # 2", "Pads/Pressure profile=1\nset Stage = elastic"]:
            result = self.squeal(file.name, "--set", value)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn("comment", result.stderr)

    def test_expressions_repeat(self):
        file = self.write("b.prm", BRAKE)
        for key in ["Pads/Pressure profile", "Contact/Initial gap"]:
            result = self.squeal(file.name, "--set", f"{key}=1 + 0.1*rand()")
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn("does not repeat", result.stderr)

    def test_nul_in_a_matrix(self):
        for name in ["mass", "stiffness"]:
            shutil.copy(st.PROJECT / f"prm/theory/ziegler_{name}.mtx", self.directory)
        stiffness = self.directory / "ziegler_stiffness.mtx"
        lines = stiffness.read_bytes().splitlines()
        lines[-1] += b"\0" + b"00"
        stiffness.write_bytes(b"\n".join(lines) + b"\n")
        self.write("m.prm", {"Scene": "matrices", "Matrices/Mass": "ziegler_mass.mtx",
                             "Matrices/Stiffness": "ziegler_stiffness.mtx", "Eigenproblem/Maximum frequency": 1})
        result = self.squeal("m.prm")
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn("NUL", result.stderr)

    # Points 9 and 11: sizes in files, and what waits for ever.

    def assertRefusedSoon(self, *arguments, part):
        result = self.squeal("b.prm", *arguments, timeout=60)
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        self.assertIn(part, result.stderr)

    def test_sizes_of_references(self):
        self.write("b.prm", BRAKE)
        for lines, part in [(["1e155,0"], "no eigenvalue of a brake"), (["100,-1e200"], "no eigenvalue of a brake"),
                            (["100,0"] * 2001, "more than 2000 modes")]:
            self.write("reference.csv", "\n".join(["frequency_hz,growth_rate_1_per_s", *lines, ""]))
            self.assertRefusedSoon("--set", "Refinement/Reference=reference.csv", part=part)

    def test_header_that_promises_too_much(self):
        self.write("mass.mtx", "%%MatrixMarket matrix coordinate real general\n100000000 100000000 1\n1 1 1\n")
        self.write("short.mtx", "%%MatrixMarket matrix coordinate real general\n4 4 90000000\n1 1 1\n")
        for name, part in [("mass", "only 1 entries"), ("short", "too short for 90000000 entries")]:
            self.write("b.prm", {"Scene": "matrices", "Matrices/Mass": f"{name}.mtx", "Matrices/Stiffness": "mass.mtx"})
            self.assertRefusedSoon(part=part)

    def test_pipes(self):
        self.write("b.prm", BRAKE)
        (self.directory / "output/b").mkdir(parents=True)
        os.mkfifo(self.directory / "output/b/parameters.prm")
        self.assertRefusedSoon(part="parameters.prm")
        os.mkfifo(self.directory / "pipe.csv")
        self.assertRefusedSoon("--set", "Refinement/Reference=pipe.csv", part="not a regular file")
        for name in ["pipe.msh", "pipe.mtx"]:
            os.mkfifo(self.directory / name)
        self.assertRefusedSoon("--set", "Scene=mesh", "--set", "Mesh/File=pipe.msh", part="cannot be read")
        self.assertRefusedSoon("--set", "Scene=matrices", "--set", "Matrices/Mass=pipe.mtx", "--set", "Matrices/Stiffness=pipe.mtx",
                               part="cannot be read")
        process = subprocess.run(["mpirun", "-np", "2", str(st.SQUEAL), "/dev/stdin", "--set", "Output/Directory=piped"],
                                 input=st.parameter_file(BRAKE), cwd=self.directory, env=st.ENVIRONMENT, text=True,
                                 capture_output=True, timeout=120)
        self.assertEqual(process.returncode, 0, process.stderr)

    def test_includes_without_bound(self):
        """Each of thirty files includes the next one twice: 2^30 of the last."""
        for ending, line, first in (("prm", "include {}", ""), ("inp", "*INCLUDE, INPUT={}", "*HEADING\n")):
            for k in range(18):
                (self.directory / f"{k}.{ending}").write_text(first + 2 * (line.format(f"{k + 1}.{ending}") + "\n"))
            (self.directory / f"18.{ending}").write_text("")
        for arguments in (("0.prm", "--check"), ("--from-deck", "0.inp")):
            result = self.squeal(*arguments, timeout=60)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn("more than 1000 files", result.stderr)

    def test_pipes_that_nobody_writes_into(self):
        """As the parameter file, as one that it includes, as a deck, in a deck; one with a writer who takes his time is read."""
        os.mkfifo(self.directory / "pipe.prm")
        os.mkfifo(self.directory / "pipe.inp")
        (self.directory / "a.prm").write_text("include pipe.prm\n")
        (self.directory / "a.inp").write_text("*INCLUDE, INPUT=pipe.inp\n")
        for arguments in (("pipe.prm", "--check"), ("a.prm", "--check"), ("--from-deck", "pipe.inp"), ("--from-deck", "a.inp")):
            result = self.squeal(*arguments, timeout=60)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertRegex(result.stderr, "pipe.(prm|inp).*cannot be read")
        writer = subprocess.Popen(["sh", "-c", "sleep 1; echo 'set Stage = elastic' > pipe.prm"], cwd=self.directory)
        result = self.squeal("pipe.prm", "--check", timeout=60)
        writer.wait()
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_full_disk_leaves_whole_lines(self):
        """A limit on the length of files stands for the full disk: what does not fit is not half there."""
        # The table is to be the longest of the files: longer than the parameters with all their keys.
        file = self.write("b.prm", {**SWEEP, "Sweep/Values": "0.1 : 0.5 : 20"})
        import resource

        def limit(n_bytes):
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, n_bytes))

        self.squeal(file.name)
        sizes = {path.name: path.stat().st_size for path in (self.directory / "output/b").iterdir()}
        size = sizes.pop("sweep.csv")
        self.assertGreater(size - 1000, max(sizes.values()))
        statuses = []
        for n_bytes in [size - 1000, size - 333, size - 77, size - 7]:
            shutil.rmtree(self.directory / "output")
            process = subprocess.run([str(st.SQUEAL), file.name], cwd=self.directory, env=st.ENVIRONMENT,
                                     capture_output=True, text=True, preexec_fn=lambda n=n_bytes: limit(n))
            statuses.append(process.returncode)
            text = (self.directory / "output/b/sweep.csv").read_text()
            self.assertTrue(text.endswith("\n"), n_bytes)
            columns = text.splitlines()[0].count(",")
            self.assertEqual({line.count(",") for line in text.splitlines()}, {columns})
        self.assertIn(1, statuses)


if __name__ == "__main__":
    unittest.main(verbosity=2)
