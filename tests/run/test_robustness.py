"""Runs that are ended from outside: signals, kill -9, too little memory, a full disk, a directory that is not writable.

With SQUEAL_ALL_FAILURES=1 at 20 sizes of the memory and the disk in place of a few: doc/reliability.md, "Outcomes".
"""

import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

ADAPTIVE_SWEEP = {**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Degree": 1, "Output/Fields": "unstable",
                  "Output/Animation frames": 2, "Eigenproblem/Maximum frequency": 2500,
                  "Refinement/Strategy": "adaptive", "Refinement/Cycles": 3, "Refinement/Tolerance": 1e-4,
                  "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.3 : 0.4 : 4"}
EVERY_SIZE = bool(os.environ.get("SQUEAL_ALL_FAILURES"))
BRAKE_OF_SECONDS = {**st.SMALL_BRAKE, "Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1",
                    "Discretization/Pad cells": "1, 2, 1", "Eigenproblem/Maximum frequency": 3000}
# Times and memory differ from run to run, the log says that it was resumed, and the manifest names the parameter file.
MAY_DIFFER = {"cycles.csv", "log.txt", "original.prm", "parameters.prm", "run.manifest"}


class Robustness(st.TestCase):
    def start(self, file, **options):
        return subprocess.Popen([str(st.SQUEAL), file.name], cwd=self.directory, env=st.ENVIRONMENT, text=True,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)

    def finish(self, process, timeout=300):
        out, err = process.communicate(timeout=timeout)
        return process.returncode, out, err

    def contents(self, results):
        """The files of a run by name, without those that may differ and without the date in those for ParaView."""
        return {name: re.sub(rb"<!--.*?-->", b"", (results / name).read_bytes(), flags=re.DOTALL)
                for name in self.names(results)}

    def names(self, results):
        """The files of a run that may not differ, frames/… included."""
        return sorted(str(path.relative_to(results)) for path in results.rglob("*")
                      if path.is_file() and path.name not in MAY_DIFFER)

    def test_killed_at_any_moment(self):
        """An adaptive sweep that is killed again and again at random moments ends with the files of one that is not."""
        whole = self.write("whole.prm", ADAPTIVE_SWEEP)
        started = time.monotonic()
        status, _, err = self.finish(self.start(whole))
        self.assertEqual(status, 0, err)
        duration = time.monotonic() - started
        expected = self.contents(self.directory / "output/whole")
        self.assertIn("sweep.csv", expected)
        self.assertEqual({row["cycle"] for row in st.read_table(self.directory / "output/whole/modes.csv")}, {0, 1, 2})

        killed = self.write("killed.prm", ADAPTIVE_SWEEP)
        moments = random.Random(7)
        kills = 0
        for _ in range(5):
            process = self.start(killed)
            time.sleep(moments.uniform(0.1, 0.5) * duration)
            process.kill()
            kills += self.finish(process)[0] == -signal.SIGKILL
        self.assertGreaterEqual(kills, 2)
        status, out, err = self.finish(self.start(killed))
        self.assertEqual(status, 0, err)
        found = self.contents(self.directory / "output/killed")
        self.assertEqual(sorted(found), sorted(expected))
        for name, content in expected.items():
            self.assertEqual(found[name], content, name)

    def assertSameTables(self, found, expected, exactly):
        """Files of two runs; with several ranks numbers may differ in their last digits."""
        self.assertEqual(self.names(found), self.names(expected))
        if exactly:
            for name, content in self.contents(expected).items():
                self.assertEqual(self.contents(found)[name], content, name)
            return
        for path in expected.glob("*.csv"):
            if path.name in MAY_DIFFER:
                continue
            for row, other in zip(st.read_table(path), st.read_table(found / path.name), strict=True):
                for key, value in row.items():
                    if key in ("frequency_hz", "verdict", "parameter", "cycle", "mode", "branch", "kind"):
                        same = value == other[key] or (isinstance(value, float) and
                                                       abs(value - other[key]) <= 1e-7 * abs(value) + 1e-6)
                        self.assertTrue(same, f"{path.name}: {key} {value} {other[key]}")

    @unittest.skipUnless(EVERY_SIZE, "minutes; test_killed_at_any_moment and test_run_directory.py are short")
    def test_killed_sixty_times(self):
        """kill -9 at 15 random moments each, three in a row and then to the end: the tables of the uninterrupted run.

        What is left of a run that was killed late may be over before its moment comes: that is no kill, and the three
        begin anew."""
        coarse = {**BRAKE_OF_SECONDS, "Sweep/Parameter": "Contact/Friction/Coefficient"}
        kinds = {"refinement": ({**BRAKE_OF_SECONDS, "Refinement/Strategy": "uniform", "Refinement/Cycles": 3}, 1),
                 "sweep": ({**coarse, "Sweep/Values": "0 : 0.6 : 60"}, 1),
                 "map": ({**coarse, "Sweep/Values": "0.1 : 0.6 : 6", "Sweep/Second parameter": "Operation/Angular velocity",
                          "Sweep/Second values": "2 : 30 : 6"}, 1),
                 "adaptive": ({**ADAPTIVE_SWEEP, "Output/Fields": "none"}, 2)}
        moments = random.Random(25)
        for kind, (settings, ranks) in kinds.items():
            whole, killed = self.write(f"{kind}.prm", settings), self.write(f"{kind}_killed.prm", settings)
            command = ["mpirun", "-np", "2"] if ranks == 2 else []

            def start(file):
                return subprocess.Popen([*command, str(st.SQUEAL), file.name], cwd=self.directory, env=st.ENVIRONMENT, text=True,
                                        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                        start_new_session=True)

            begun = time.monotonic()
            process = start(whole)
            out, _ = process.communicate(timeout=300)
            self.assertEqual(process.returncode, 0, out)
            duration = time.monotonic() - begun
            missed = resumed = anew = 0
            for _ in range(5):
                hits = 0
                while hits < 3:
                    if hits == 0:
                        shutil.rmtree(self.directory / f"output/{killed.stem}", ignore_errors=True)
                    process = start(killed)
                    # Later ones have less to do: they are killed earlier.
                    time.sleep(moments.uniform(0.02, 0.8) * duration / (1 + hits))
                    if self.kill_running(process):
                        hits += 1
                    else:
                        hits, missed = 0, missed + 1
                        self.assertLess(missed, 100, "runs end before they are killed")
                process = start(killed)
                out, _ = process.communicate(timeout=300)
                self.assertEqual(process.returncode, 0, out)
                resumed += "Resumed after" in out
                anew += "Resumed after" not in out
                self.assertSameTables(self.directory / f"output/{killed.stem}", self.directory / f"output/{kind}", ranks == 1)
            print(f"{kind}: a run of {duration:.1f} s, 15 kills while it ran ({missed} more missed it), {resumed} of 5 ends "
                  f"resumed, {anew} begun anew, tables equal", flush=True)

    def kill_running(self, process):
        """kill -9 to all processes of a session; whether squeal was one of them and had not ended."""
        works = False
        for pid in self.processes_of(process.pid):
            try:
                status = pathlib.Path(f"/proc/{pid}/stat").read_text()
                works |= "(squeal)" in status and status.rsplit(")", 1)[1].split()[0] not in "ZX"
                os.kill(pid, signal.SIGKILL)
            except OSError:
                pass
        process.communicate(timeout=60)
        return works and process.returncode == -signal.SIGKILL

    @staticmethod
    def processes_of(session):
        """Processes of a session, mpirun and its ranks (which have process groups of their own)."""
        found = []
        for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
            try:
                if int(stat.read_text().rsplit(")", 1)[1].split()[3]) == session:
                    found.append(int(stat.parent.name))
            except (OSError, IndexError):
                pass
        return found

    def test_removed_directory(self):
        """Results that somebody removes while the run goes on: it ends with the name of what cannot be written."""
        file = self.write("sweep.prm", {**BRAKE_OF_SECONDS, "Sweep/Parameter": "Contact/Friction/Coefficient",
                                        "Sweep/Values": "0 : 0.5 : 1000"})
        results = self.directory / "output/sweep"
        process = self.start(file)
        while process.poll() is None and not (results / "sweep.csv").exists():
            time.sleep(0.01)
        shutil.rmtree(results, ignore_errors=True)
        status, out, err = self.finish(process, timeout=100)
        self.assertEqual(status, 1, err)
        self.assertRegex(err, r"squeal: The file output/sweep/\S+ cannot be written: No such file or directory")
        self.assertEqual(err.count("squeal:"), 1, err)

    def test_resumes_between_meshes(self):
        """After the first mesh is complete it is not solved again."""
        settings = {key: value for key, value in ADAPTIVE_SWEEP.items() if not key.startswith("Sweep/")}
        file = self.write("run.prm", settings)
        results = self.directory / "output/run"
        process = self.start(file)
        while not (results / "refinement.state").exists() and process.poll() is None:
            time.sleep(0.01)
        process.kill()
        self.finish(process)
        first_line = (results / "modes.csv").read_text().splitlines()[1]
        status, out, err = self.finish(self.start(file))
        self.assertEqual(status, 0, err)
        self.assertIn("Resumed after", out)
        self.assertNotIn("\nMesh 0:", out)
        self.assertEqual((results / "modes.csv").read_text().splitlines()[1], first_line)
        self.assertFalse((results / "refinement.state").exists())
        self.assertTrue((results / "convergence.csv").exists())

    def test_signals(self):
        file = self.write("long.prm", {**st.SMALL_BRAKE, "Sweep/Parameter": "Contact/Friction/Coefficient",
                                       "Sweep/Values": "0 : 0.5 : 1000"})
        table = self.directory / "output/long/sweep.csv"
        log = table.with_name("log.txt")
        for number, works in [(signal.SIGINT, lambda: table.exists() and len(table.read_text().splitlines()) > 20),
                              (signal.SIGTERM, lambda: "Resumed after" in log.read_text())]:
            process = self.start(file)
            while not works() and process.poll() is None:
                time.sleep(0.01)
            process.send_signal(number)
            status, out, err = self.finish(process, timeout=60)
            self.assertEqual(status, 1, err)
            self.assertIn(signal.Signals(number).name, err)
            self.assertIn("Results so far are kept", err)
            st.read_table(table)
        self.assertIn("Resumed after", out)  # the second run went on where the first had ended

    def test_signal_in_parallel(self):
        """A signal to mpirun ends all ranks."""
        file = self.write("long.prm", {**st.SMALL_BRAKE, "Sweep/Parameter": "Contact/Friction/Coefficient",
                                       "Sweep/Values": "0 : 0.5 : 1000"})
        table = self.directory / "output/long/sweep.csv"
        process = subprocess.Popen(["mpirun", "-np", "2", str(st.SQUEAL), file.name], cwd=self.directory,
                                   env=st.ENVIRONMENT, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
        while not (table.exists() and len(table.read_text().splitlines()) > 20) and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGTERM)
        status, _, _ = self.finish(process, timeout=60)
        self.assertNotEqual(status, 0)
        st.read_table(table)

    def test_too_little_memory(self):
        """With less and less memory: a message each time, and a factorisation that cannot fit is refused before it
        begins. How much the libraries take by themselves differs between machines."""
        file = self.write("large.prm", {"Output/Fields": "none", "Discretization/Degree": 3})
        messages = ""
        for limit in [1200, 1500, 1800]:
            size = limit * 2 ** 20
            process = self.start(file, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size)))
            status, out, err = self.finish(process)
            self.assertIn(status, [0, 3], out + err)
            if status == 3:
                self.assertRegex(err, r"memory|needs about .* GiB")
                messages += err
        self.assertRegex(messages, r"The factorisation of .* needs about .* GiB, .* times what is available")

    def test_predicted_memory(self):
        """The peak of memory that the log expects is right within 25 %, and a run that cannot fit is refused before it has
        a steady state. Thirteen runs with SQUEAL_ALL_FAILURES."""
        discretisation = "Discretization/Rotor cells", "Discretization/Pad cells"
        def run(cells, of_pads, **settings):
            return {**dict(zip(discretisation, (cells, of_pads))), **{key.replace("_", "/"): value
                                                                     for key, value in settings.items()}}

        runs = [run("5, 45, 3", "3, 8, 2", Discretization_Degree=1), run("5, 36, 1", "2, 4, 1", Discretization_Degree=2),
                {"Eigenproblem/Solver": "none", **run("6, 48, 2", "3, 6, 2")}]
        if EVERY_SIZE:  # none of them is among those of the fit
            runs += [run("3, 18, 1", "2, 3, 1", Discretization_Degree=3), run("4, 40, 1", "3, 5, 1", Rotor_Thickness=0.008),
                     {"Eigenproblem/Maximum frequency": 4000, **run("6, 50, 1", "3, 6, 1")},
                     {**st.PENALTY, **run("4, 32, 2", "2, 5, 2")},
                     {"Discretization/Clamp layers": 3, **run("3, 24, 2", "2, 4, 1")},
                     run("5, 40, 1", "4, 8, 1", Pads_Arrangement="upper"),
                     run("2, 10, 1", "1, 3, 1", Discretization_Degree=4),
                     {"Eigenproblem/Error bars": "false", **run("7, 60, 2", "4, 8, 2")},
                     {"Eigenproblem/Solver": "none", "Discretization/Degree": 3, **run("4, 30, 1", "2, 4, 1")},
                     {"Eigenproblem/Solver": "none", "Pads/Arrangement": "upper", **run("5, 40, 1", "4, 8, 1")}]
        # In the fit; without factors.
        runs += [{"Eigenproblem/Solver": "block_davidson", "Eigenproblem/Error bars": "false",
                  "Eigenproblem/Maximum frequency": 2500, **run("5, 40, 1", "3, 6, 1")}]
        for settings in runs:
            log = (self.analyse({"Output/Fields": "none", **settings}, fork=False) / "log.txt").read_text()
            expected, peak = (float(re.search(pattern, log).group(1)) for pattern in
                              (r"Expected peak memory about (\d+) MiB", r"Peak memory (\d+) MiB"))
            if EVERY_SIZE:
                print(f"{settings}: expected {expected:.0f} MiB, used {peak:.0f} MiB, ratio {expected / peak:.2f}")
            self.assertLess(abs(expected / peak - 1), 0.25, settings)
        size = 1400 * 2 ** 20
        file = self.write("large.prm", {"Output/Fields": "none", "Discretization/Rotor cells": "12, 96, 2",
                                        "Discretization/Pad cells": "4, 12, 2"})
        process = self.start(file, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size)))
        status, out, err = self.finish(process, timeout=100)
        self.assertEqual(status, 3, err)
        self.assertRegex(err, r"The run needs about .* GiB, .* times what is available.*Refinement/Check memory = false")
        self.assertNotIn("Static equilibrium", out)

    def test_unchecked_memory(self):
        """Many modes of few unknowns: what is expected is refused, or told only, as the key says."""
        size = 2 ** 31
        for check, refused in [("true", True), ("false", False)]:
            file = self.write(f"{check}.prm", {**BRAKE_OF_SECONDS, "Eigenproblem/Maximum frequency": 1e7,
                                               "Refinement/Check memory": check})
            process = self.start(file, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size)))
            _, out, err = self.finish(process)
            self.assertRegex(out, r"Expected peak memory about \d+ MiB, with about \d+ modes")
            self.assertEqual("The run needs about" in err, refused, err)
            self.assertEqual("Static equilibrium" in out, not refused, out)

    def test_memory_of_a_rotor_beside_the_axis(self):
        """A plate 1 m beside the axis: not the ring about it, which would have thousands of times as many modes."""
        mesh = mesh_files.Mesh()
        mesh.sector("rotor", mesh_files.equal(0.95, 1.15, 6), mesh_files.equal(-0.05, 0.05, 3), [0, 0.005])
        self.write("plate.msh", mesh_files.msh2(mesh))
        log = (self.analyse({"Scene": "mesh", "Mesh/File": "plate.msh", "Mesh/Clamped": "rotor.inner", "Stage": "elastic",
                             "Operation/Angular velocity": 0, "Discretization/Degree": 2,
                             "Eigenproblem/Maximum frequency": 5000, "Output/Fields": "none"}, fork=False) / "log.txt").read_text()
        expected, peak = (float(re.search(pattern, log).group(1)) for pattern in
                          (r"Expected peak memory about (\d+) MiB", r"Peak memory (\d+) MiB"))
        self.assertLess(abs(expected / peak - 1), 0.25)

    def test_small_address_space(self):
        """Whatever a process may take, down to what its libraries need to be loaded: it ends within seconds, finished or
        with one message."""
        file = self.write("small.prm", BRAKE_OF_SECONDS)
        # As users start it: with the threads of OpenBLAS, which once waited for memory for ever.
        environment = {name: value for name, value in st.ENVIRONMENT.items() if not name.endswith("NUM_THREADS")}
        outcomes = {}
        for limit in (range(500, 1100, 30) if EVERY_SIZE else (600, 720, 950)):
            size = limit * 2 ** 20
            process = subprocess.Popen([str(st.SQUEAL), file.name], cwd=self.directory, env=environment, text=True,
                                       stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size)))
            try:
                out, err = process.communicate(timeout=60)
            except subprocess.TimeoutExpired:
                process.kill()
                self.fail(f"{limit} MiB: the run does not end. {process.communicate()[1]}")
            outcomes[limit] = (process.returncode, err.strip()[:90])
            if process.returncode == 127 and "error while loading shared libraries" in err:
                continue
            if process.returncode == 3:
                self.assertRegex(err, r"needs about .* GiB", limit)
            elif process.returncode != 0:
                self.assertEqual(process.returncode, 1, f"{limit} MiB: {err}")
                self.assertRegex(err, r"^\s*squeal: out of memory", f"{limit} MiB")
                self.assertEqual(err.count("squeal:"), 1, f"{limit} MiB: {err}")
        if EVERY_SIZE:
            print(*outcomes.items(), sep="\n")
        self.assertIn(1, [status for status, _ in outcomes.values()])

    def test_one_rank_without_memory(self):
        """One rank of two that lacks memory ends both."""
        file = self.write("small.prm", BRAKE_OF_SECONDS)
        outcomes = {}
        for limit in (range(500, 1100, 30) if EVERY_SIZE else (600, 720)):
            command = ["mpirun", "-np", "1", str(st.SQUEAL), file.name, ":",
                       "-np", "1", "sh", "-c", f"ulimit -v {1024 * limit}; exec {st.SQUEAL} {file.name}"]
            process = subprocess.Popen(command, cwd=self.directory, env=st.ENVIRONMENT, text=True,
                                       stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            try:
                out, err = process.communicate(timeout=60)
            except subprocess.TimeoutExpired:
                process.terminate()
                self.fail(f"{limit} MiB: the run does not end. {process.communicate()[1]}")
            outcomes[limit] = (process.returncode, err.strip()[:90])
            if process.returncode:
                self.assertRegex(err, "out of memory|needs about .* GiB|error while loading shared libraries",
                                 f"{limit} MiB")
        if EVERY_SIZE:
            print(*outcomes.items(), sep="\n")
        self.assertNotIn(0, [status for limit, (status, _) in outcomes.items() if limit < 720])

    def test_second_signal(self):
        """Whatever a run does, the second signal ends it, be it the same or the other one."""
        dense = {**st.SMALL_BRAKE, "Discretization/Rotor cells": "2, 9, 1", "Eigenproblem/Solver": "dense"}
        sweep = {**BRAKE_OF_SECONDS, "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0 : 0.5 : 1000"}
        cases = {"dense": dense, "sweep": sweep,
                 "map": {**sweep, "Sweep/Values": "0 : 0.5 : 30", "Sweep/Second parameter": "Operation/Angular velocity",
                         "Sweep/Second values": "1 : 30 : 30"},
                 "refinement": {**ADAPTIVE_SWEEP, "Refinement/Cycles": 6},
                 "statics": {"Discretization/Rotor cells": "8, 72, 4", "Output/Fields": "none"}}
        signals = [(signal.SIGINT, signal.SIGTERM), (signal.SIGTERM, signal.SIGTERM), (signal.SIGTERM, signal.SIGINT),
                   (signal.SIGINT, signal.SIGINT)]
        for number, (name, settings) in enumerate(cases.items()):
            file = self.write(f"{name}.prm", settings)
            for first, second in (signals if EVERY_SIZE else [signals[number % 4]]):
                process = self.start(file)
                log = self.directory / f"output/{name}/log.txt"
                while process.poll() is None and not log.exists():
                    time.sleep(0.01)
                time.sleep(0.4)
                process.send_signal(first)
                time.sleep(0.02)
                process.send_signal(second)
                sent = time.monotonic()
                status, out, err = self.finish(process, timeout=60)
                self.assertLess(time.monotonic() - sent, 5, f"{name}, {first.name} {second.name}")
                # The first one may have done it before the second came.
                self.assertIn(status, [-second, 1], f"{name}, {first.name} {second.name}: {err}")

    def test_one_signal_in_a_long_step(self):
        """LAPACK does not ask whether a signal has come: after some seconds it ends all the same."""
        file = self.write("long.prm", {**st.SMALL_BRAKE, "Eigenproblem/Solver": "dense", "Eigenproblem/Error bars": "false"})
        process = self.start(file)
        log = self.directory / "output/long/log.txt"
        while process.poll() is None and not (log.exists() and "Static equilibrium" in log.read_text()):
            time.sleep(0.05)
        time.sleep(2)
        process.send_signal(signal.SIGINT)
        sent = time.monotonic()
        status, _, err = self.finish(process, timeout=60)
        self.assertLess(time.monotonic() - sent, 10)
        self.assertEqual(status, 1, err)
        self.assertIn("in the middle of a step. Results so far are kept", err)

    def test_not_writable(self):
        if os.geteuid() != 0:
            self.skipTest("needs root, to become a user who may not write.")
        file = self.write("run.prm", st.SMALL_BRAKE)
        self.directory.chmod(0o755)

        def become_nobody():
            os.setgid(65534)
            os.setuid(65534)

        process = self.start(file, preexec_fn=become_nobody)
        status, out, err = self.finish(process)
        self.assertEqual(status, 2, out + err)
        self.assertIn("Output/Directory = output/run", err)
        self.assertIn("Permission denied", err)

    @unittest.skipUnless(EVERY_SIZE, "minutes; test_full_disk is short")
    def test_disks_of_twenty_sizes(self):
        """Whatever the disk holds: an end with a message, or the whole run; tables have whole lines only."""
        disk = pathlib.Path(tempfile.mkdtemp(prefix="squeal-disk-"))
        self.addCleanup(shutil.rmtree, disk, ignore_errors=True)
        for kilobytes in (4, 8, 12, 16, 20, 24, 32, 40, 48, 56, 64, 72, 80, 100, 120, 150, 200, 300, 500, 1000):
            if subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(disk)],
                              capture_output=True).returncode:
                self.skipTest("a small disk cannot be mounted here.")
            try:
                file = self.write("run.prm", {**BRAKE_OF_SECONDS, "Output/Fields": "unstable", "Output/Directory": disk / "run",
                                              "Refinement/Strategy": "uniform", "Refinement/Cycles": 2,
                                              "Sweep/Parameter": "Contact/Friction/Coefficient",
                                              "Sweep/Values": "0.1 : 0.5 : 20"})
                status, out, err = self.finish(self.start(file))
                print(f"{kilobytes} KiB: status {status} {err.strip()[:110]}", flush=True)
                if status:
                    self.assertIn(status, (1, 2), err)
                    self.assertRegex(err, "No space left on device|is the disk full")
                    self.assertEqual(err.count("squeal:"), 1, err)
                for table in (disk / "run").glob("*.csv"):
                    lines = table.read_text().split("\n")
                    self.assertEqual(lines[-1], "", f"{kilobytes} KiB: {table.name}")
                    self.assertEqual({line.count(",") for line in lines[:-1]}, {lines[0].count(",")}, table.name)
            finally:
                subprocess.run(["umount", str(disk)], check=True)

    def test_full_disk(self):
        disk = pathlib.Path(tempfile.mkdtemp(prefix="squeal-disk-"))
        self.addCleanup(shutil.rmtree, disk, ignore_errors=True)
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=100k", "tmpfs", str(disk)], capture_output=True).returncode:
            self.skipTest("a small disk cannot be mounted here.")
        self.addCleanup(subprocess.run, ["umount", str(disk)])
        file = self.write("run.prm", {**st.SMALL_BRAKE, "Output/Fields": "all", "Output/Directory": disk / "run"})
        status, out, err = self.finish(self.start(file))
        self.assertEqual(status, 1, out + err)
        self.assertIn("No space left on device", err)
        self.assertIn(".vtu", err)
        self.assertGreater(len(st.read_table(disk / "run/modes.csv")), 3)
        self.assertFalse(list((disk / "run").glob("*.part")))
        # A disk that is full from the start.
        (disk / "filler").write_bytes(b"0" * (os.statvfs(disk).f_bavail * os.statvfs(disk).f_frsize))
        status, out, err = self.finish(self.start(file))
        self.assertEqual(status, 2, out + err)
        self.assertIn("No space left on device", err)


if __name__ == "__main__":
    unittest.main(verbosity=2)
