"""What the end-to-end tests share: running the program in a temporary directory, reading its tables, comparing modes.

The program under test is named by the environment variable SQUEAL (ctest sets it), else build/release/squeal.
Only Python's standard library is needed, so that a fresh machine can run the tests.
"""

import array
import atexit
import csv
import math
import os
import pathlib
import resource
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

PROJECT = pathlib.Path(__file__).resolve().parents[2]
SQUEAL = pathlib.Path(os.environ.get("SQUEAL", PROJECT / "build/release/squeal")).resolve()
REFERENCE = PROJECT / "tests/data/reference"
SKIPPED = 77  # SKIP_RETURN_CODE in tests/CMakeLists.txt

# Data too large for this repository lie beside it.
SHARED = pathlib.Path(os.environ.get("SQUEAL_SHARED", PROJECT.parent / "shared"))

ENVIRONMENT = {
    **os.environ,
    # One thread per rank: ctest runs several tests at a time, and equal runs shall give equal digits.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    # Open MPI refuses root, binds the ranks of all tests to the same cores, and assumes that containers allow
    # one process to read another's memory.
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
}

# A brake small enough for a second. The pad's contact mesh and the rotor's do not match.
SMALL_BRAKE = {
    "Discretization/Degree": 2,
    "Discretization/Rotor cells": "3, 18, 1",
    "Discretization/Pad cells": "2, 3, 1",
    "Output/Fields": "none",
}

# 888 unknowns: small enough for the dense solver, which needs the eigenvalues of a matrix of twice that size.
TINY_BRAKE = {
    "Discretization/Degree": 2,
    "Discretization/Rotor cells": "2, 9, 1",
    "Discretization/Pad cells": "1, 2, 1",
    "Discretization/Clamp layers": 0,
    "Output/Fields": "none",
}

# 156 unknowns: LAPACK takes a moment for all eigenvalues, which others are compared with.
DENSE_BRAKE = {**TINY_BRAKE, "Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1",
               "Eigenproblem/Maximum frequency": 3000, "Eigenproblem/Error bars": "false", "Eigenproblem/Tolerance": 1e-10}

# 44 unknowns, of which one or two modes lie in the window.
COARSE_STRIP = {"Scene": "strip", "Operation/Angular velocity": 2, "Discretization/Rotor cells": "1, 12, 1",
                "Discretization/Degree": 1, "Discretization/Pad cells": "1, 4, 1", "Contact/Friction/Law": "falling",
                "Contact/Friction/Decay speed": 2, "Pads/Material/Stiffness proportional damping": 1e-7,
                "Eigenproblem/Maximum frequency": 20000, "Output/Fields": "none"}

# Of reference.md's tables of the brake; the stage is added by the test.
REFERENCE_BRAKE = {
    "Operation/Angular velocity": 5,
    "Contact/Steady pressure": "uniform",
    "Contact/Friction/Coefficient": 0.4,
    "Eigenproblem/Maximum frequency": 6300,
    "Output/Fields": "none",
}
PENALTY = {"Contact/Formulation": "penalty", "Contact/Penalty stiffness": 1e12}
MORTAR = {"Contact/Formulation": "mortar"}


class ForkServer:
    """Starts the program by forks of one process that has loaded its libraries: fork_server.cc. What is left of a start is
    what the program itself does, a fifth of the processor seconds."""

    LIBRARY = SQUEAL.parent / "tests/libfork_server.so"  # built with everything, not with squeal alone
    CLIENT = SQUEAL.parent / "tests/fork_client"
    _running = None

    @classmethod
    def is_built(cls):
        """Both, and not the library of a version that had no client."""
        return cls.LIBRARY.exists() and cls.CLIENT.exists()

    @classmethod
    def running(cls):
        """The one of this process; None where the library was not built."""
        if cls._running is None and cls.is_built():
            cls._running = cls()
        return cls._running

    def __init__(self):
        self.socket, others = socket.socketpair()
        self.place = pathlib.Path(tempfile.mkdtemp(prefix="squeal-fork-"))
        self.address = self.place / "ranks"
        with others:
            environment = {**ENVIRONMENT, "LD_PRELOAD": str(self.LIBRARY), "FORK_SERVER": str(others.fileno()),
                           "FORK_SERVER_ADDRESS": str(self.address)}
            # Not the test's own output, which must end with the test.
            nothing = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
            self.process = subprocess.Popen([str(SQUEAL)], env=environment, pass_fds=[others.fileno()], **nothing)
        self.seconds_of_single = 0.  # of processors
        atexit.register(self.close)

    @property
    def seconds(self):
        """Of processors, of all that it started."""
        file = self.address.with_suffix(".seconds")
        return self.seconds_of_single + sum(map(float, file.read_text().split())) if file.exists() else self.seconds_of_single

    def close(self):
        """Ends the server, so that its processor seconds count as those of this process's children."""
        self.socket.close()
        self.process.wait()
        shutil.rmtree(self.place, ignore_errors=True)
        self.seconds_of_single = 0.

    def rank(self, command):
        """What mpirun starts for a rank, and what its environment has besides."""
        while not self.address.exists() and self.process.poll() is None:
            time.sleep(0.01)
        return [str(self.CLIENT), *command], {"FORK_SERVER_ADDRESS": str(self.address)}

    def receive(self, layout):
        data = b""
        while len(data) < struct.calcsize(layout):
            part = self.socket.recv(struct.calcsize(layout) - len(data))
            if not part:
                raise AssertionError("The server that starts the program has ended.")
            data += part
        return struct.unpack(layout, data)

    def run(self, command, directory, timeout, **environment):
        """As subprocess.run() with text captured; raises TimeoutExpired once the program was told to end and did."""
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err, open(os.devnull) as nothing:
            fields = [str(directory or os.getcwd()), str(len(command)), *command,
                      *map("=".join, {**ENVIRONMENT, **environment}.items())]
            text = b"".join(os.fsencode(field) + b"\0" for field in fields)
            files = array.array("i", [nothing.fileno(), out.fileno(), err.fileno()])
            self.socket.sendmsg([struct.pack("I", len(text))], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, files)])
            self.socket.sendall(text)
            [pid] = self.receive("i")
            self.socket.settimeout(timeout)
            try:
                status, _, seconds = self.receive("iid")
            except socket.timeout:
                os.kill(pid, signal.SIGTERM)
                self.socket.settimeout(None)
                status, _, seconds = self.receive("iid")
                timeout = None
            self.socket.settimeout(None)
            self.seconds_of_single += seconds
            texts = []
            for file in (out, err):
                file.seek(0)
                texts.append(file.read().decode())
        if timeout is None:
            raise subprocess.TimeoutExpired(command, timeout, *texts)
        return subprocess.CompletedProcess(command, os.waitstatus_to_exitcode(status), *texts)


def processor_seconds():
    """What this process and all that it started and waited for have taken."""
    return sum(usage.ru_utime + usage.ru_stime
               for usage in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))) + (
                   ForkServer._running.seconds if ForkServer._running else 0)


def settings_in(text):
    """(number of the line from 0, path, value) of each line of a parameter file that sets a key."""
    sections = []
    for number, line in enumerate(text.split("\n")):
        words = line.split("#")[0].split(None, 1)
        if words[:1] == ["subsection"]:
            sections.append(words[1].strip())
        elif words[:1] == ["end"] and sections:
            sections.pop()
        elif words[:1] == ["set"]:
            key, _, value = words[1].partition("=")
            yield number, "/".join([*sections, key.strip()]), value.strip()


def parameter_file(settings):
    """The text of a parameter file, from {"Section/Key": value}."""
    lines = []
    for path, value in settings.items():
        *sections, key = path.split("/")
        lines += [f"subsection {section}" for section in sections]
        lines += [f"set {key} = {value}"]
        lines += ["end"] * len(sections)
    return "\n".join(lines) + "\n"


def read_table(path):
    """The rows of a CSV file as dictionaries: numbers where the field is one, None where it is empty."""

    def value(field):
        try:
            return float(field) if field else None
        except ValueError:
            return field

    with open(path, newline="") as file:
        return [{key: value(field) for key, field in row.items()} for row in csv.DictReader(file)]


def eigenvalue(row):
    """The eigenvalue of a line of modes.csv or of a reference table, 1/s."""
    return complex(row["growth_rate_1_per_s"], 2 * math.pi * row["frequency_hz"])


needs_fork_server = unittest.skipUnless(ForkServer.is_built(), "needs the library fork_server, built with all tests")


def run(*arguments, ranks=1, directory=None, timeout=300, executable=SQUEAL, environment=ENVIRONMENT, fork=True, **watched):
    """Runs the program; returns subprocess.CompletedProcess with text. A hang fails the test. Without `fork` it is started
    as users start it: the memory that libraries take is seen then. `watched`: KILL_AT or TRACE of fork_server.cc."""
    command = [str(executable), *(str(argument) for argument in arguments)]
    server = ForkServer.running() if fork and executable == SQUEAL and environment == ENVIRONMENT else None
    if server and ranks == 1:
        try:
            return server.run(command, directory, timeout, **watched)
        except subprocess.TimeoutExpired as late:
            raise AssertionError(f"{' '.join(command)} did not end within {timeout} s.\n{late.output}{late.stderr}") from None
    assert not watched, "only one rank that the server starts is watched"
    if server:
        command, address = server.rank(command)
        environment = {**environment, **address}
    if ranks > 1:
        command = ["mpirun", "-np", str(ranks), *command]
    process = subprocess.Popen(command, cwd=directory, env=environment, stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        out, err = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        process.terminate()  # unlike kill() this lets mpirun end its ranks
        out, err = process.communicate()
        raise AssertionError(f"{' '.join(command)} did not end within {timeout} s.\n{out}{err}") from None
    return subprocess.CompletedProcess(command, process.returncode, out, err)


class TestCase(unittest.TestCase):
    """A test with a temporary directory of its own, `self.directory`."""

    def setUp(self):
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="squeal-test-"))
        self.addCleanup(self.tell_seconds, processor_seconds())
        self.addCleanup(shutil.rmtree, self.directory, ignore_errors=True)

    def tell_seconds(self, before):
        """For tests/minutes.py."""
        print(f"Processor seconds of {type(self).__name__}.{self._testMethodName}: {processor_seconds() - before:.2f}", flush=True)

    def write(self, name, content):
        """Writes a file into the temporary directory: text, or a parameter file from a dictionary."""
        path = self.directory / name
        path.write_text(parameter_file(content) if isinstance(content, dict) else content)
        return path

    def assertSettingsRefused(self, settings, *words):
        """A run with these settings ends with status 2; the message has every word."""
        self.write("refused.prm", settings)
        result = run("refused.prm", directory=self.directory, timeout=60)
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)

    def analyse(self, settings, **options):
        """Runs an analysis that must succeed, by run() with these options; returns the directory of its results."""
        n_runs = len(list(self.directory.glob("run*.prm")))
        file = self.write(f"run{n_runs}.prm", settings)
        result = run(file.name, directory=self.directory, **options)
        self.assertEqual(result.returncode, 0, f"{settings}\n{result.stdout}{result.stderr}")
        return self.directory / "output" / file.stem

    def kill(self, settings, is_time):
        """Starts an analysis, killed.prm, and kills it once is_time(directory of its results); returns the directory."""
        file = self.write("killed.prm", settings)
        results = self.directory / "output" / file.stem
        shutil.rmtree(results, ignore_errors=True)
        process = subprocess.Popen([str(SQUEAL), file.name], cwd=self.directory, env=ENVIRONMENT,
                                   stdout=subprocess.DEVNULL)
        deadline = time.monotonic() + 120
        while not is_time(results) and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.002)
        process.kill()
        process.wait()
        return results

    def resume(self):
        """Goes on with what was killed; it must succeed and say that it does not begin anew."""
        result = run("killed.prm", directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("Resumed after", result.stdout)

    def modes(self, settings, **options):
        """The modes (lines of modes.csv) of an analysis that must succeed, of its last mesh."""
        rows = read_table(self.analyse(settings, **options) / "modes.csv")
        return [row for row in rows if row["cycle"] == rows[-1]["cycle"]]

    def eigenvalues(self, settings, **options):
        """Without error bars, which take half of a run, unless the settings ask for them or refine by them."""
        if "Refinement/Strategy" not in settings:
            settings = {"Eigenproblem/Error bars": "false", **settings}
        return [eigenvalue(row) for row in self.modes(settings, **options)]

    def pairs(self, computed, expected):
        """Pairs two sets of eigenvalues, the nearest first: every one has exactly one partner.
        Returns [(computed, expected)] in the order of `expected`."""
        self.assertEqual(len(computed), len(expected),
                         f"the numbers of modes differ: computed {computed}, expected {expected}")
        distances = sorted((abs(a - b), i, j) for i, a in enumerate(computed) for j, b in enumerate(expected))
        partner, used = {}, set()
        for _, i, j in distances:
            if i not in used and j not in partner:
                partner[j] = i
                used.add(i)
        return [(computed[partner[j]], b) for j, b in enumerate(expected)]

    def assertSameModes(self, computed, expected, tolerance, rounding=0):
        """Two sets of eigenvalues agree: |l - l'| <= tolerance |l'| for each pair, or both differ by rounding, 1/s."""
        for a, b in self.pairs(computed, expected):
            self.assertLessEqual(abs(a - b), max(tolerance * abs(b), rounding), f"eigenvalue {a}, expected {b}")


def reference_eigenvalues(name):
    """A table of tests/data/reference."""
    return [eigenvalue(row) for row in read_table(REFERENCE / name)]


def start_with_python_that_has(*modules):
    """Starts the test file again with a Python that has these modules where this one lacks one; where none has them the
    test ends as skipped."""
    test = "; ".join(f"import {module}" for module in modules)
    for python in (sys.executable, "/usr/bin/python3", shutil.which("python3")):
        if python and os.path.exists(python) and subprocess.run([python, "-c", test], capture_output=True,
                                                                check=False).returncode == 0:
            if python != sys.executable:
                os.execv(python, [python, *sys.argv])
            return
    print(f"SKIPPED: this test needs a Python with {', '.join(modules)}: scripts/install-dependencies.sh --tests")
    sys.exit(SKIPPED)


def require_shared(name):
    """The path of shared data; where they do not exist, the whole test file ends as skipped."""
    path = SHARED / name
    if not path.exists():
        print(f"SKIPPED: this test needs {name} in the directory named by SQUEAL_SHARED, or in ../shared; "
              f"{path} does not exist.")
        sys.exit(SKIPPED)
    return path
