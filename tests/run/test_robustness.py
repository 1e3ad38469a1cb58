"""Runs that are ended from outside: signals, kill -9, too little memory, a full disk, a directory that is not writable."""

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

import squeal_testing as st  # noqa: E402

ADAPTIVE_SWEEP = {**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Degree": 1, "Output/Fields": "unstable",
                  "Output/Animation frames": 2, "Eigenproblem/Maximum frequency": 2500,
                  "Refinement/Strategy": "adaptive", "Refinement/Cycles": 3, "Refinement/Tolerance": 1e-4,
                  "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.3 : 0.4 : 4"}
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
        return {path.name: re.sub(rb"<!--.*?-->", b"", path.read_bytes(), flags=re.DOTALL)
                for path in results.iterdir() if path.name not in MAY_DIFFER}

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
        for limit in [1200, 1500, 1800, 2100]:
            size = limit * 2 ** 20
            process = self.start(file, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size)))
            status, out, err = self.finish(process)
            self.assertIn(status, [0, 3], out + err)
            if status == 3:
                self.assertRegex(err, r"memory|needs about .* GiB")
                messages += err
        self.assertRegex(messages, r"The factorisation of .* needs about .* GiB, .* times what is available")

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
