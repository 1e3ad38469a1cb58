"""Starting the program."""

import os
import pathlib
import shutil
import subprocess

from .results import read


class ProgramError(RuntimeError):
    """The program has not finished; `status` is its exit status, the text what it said."""

    def __init__(self, message, status):
        super().__init__(message)
        self.status = status


class InputError(ProgramError):
    """Exit status 2: the parameter file or an override is wrong."""


class SolverError(ProgramError):
    """Exit status 3: a solver has failed; `results` are those until then."""

    results = None


def find_program():
    """The path of squeal: SQUEAL of the environment, `squeal` of the PATH, build/release/squeal here or above."""
    named = os.environ.get("SQUEAL")
    if named:
        return named
    found = shutil.which("squeal")
    if found:
        return found
    here = pathlib.Path.cwd()
    for directory in (here, *here.parents):
        if (directory / "build/release/squeal").is_file():
            return str(directory / "build/release/squeal")
    raise FileNotFoundError("squeal was not found: set the environment variable SQUEAL to its path, or build it "
                            "(scripts/build.sh)")


def text_of(value):
    """A value as parameter files write it."""
    if isinstance(value, (list, tuple)) or getattr(value, "ndim", 0) > 0:
        return ", ".join(text_of(part) for part in value)
    if hasattr(value, "item"):
        value = value.item()  # numpy's numbers
    return str(value).lower() if isinstance(value, bool) else str(value)


def sample(file, uncertain, samples=None, correlation=None, indices=False, **options):
    """How probable growth is: the run of a parameter file whose numbers are uncertain. Returns its Results.

    `uncertain` is {"Section/Key": distribution}, a distribution as text, "uniform 0.3 0.6", or as a tuple, ("normal", 1e6,
    1e5); or the path of a CSV file of samples. `samples` is their number; `correlation` the matrix between normal scores, in
    the order of `uncertain`. With `indices` sensitivity indices are computed, too. All else is run()'s.
    results.table("probability"), "samples" and "indices" are what comes out (doc/sampling.md).
    """
    settings = {"Sampling/Sensitivity indices": bool(indices)}
    if samples is not None:
        settings["Sampling/Samples"] = int(samples)
    if hasattr(uncertain, "items"):
        words = [f"{key} {law if isinstance(law, str) else ' '.join(text_of(part) for part in law)}"
                 for key, law in uncertain.items()]
        settings["Sampling/Parameters"] = "; ".join(words)
    else:
        settings["Sampling/File"] = os.path.abspath(os.fspath(uncertain))
    if correlation is not None:
        settings["Sampling/Correlation"] = "; ".join(text_of(list(row)) for row in correlation)
    return run(file, **{**settings, **options})


def run(file, ranks=1, echo=False, overwrite=False, program=None, **overrides):
    """Runs a parameter file and returns its Results.

    Overrides are "Section/Key": value, as with --set:  run("prm/brake.prm", **{"Operation/Angular velocity": 10}).
    Output/Directory among them tells where the results go. With echo the screen shows what the program says. Raises
    InputError, SolverError or ProgramError with the program's message.
    """
    command = [program or find_program(), os.fspath(file)]
    for key, value in overrides.items():
        command += ["--set", f"{key}={text_of(value)}"]
    if overwrite:
        command.append("--overwrite")
    environment = dict(os.environ)
    if ranks > 1:
        command = ["mpirun", "--oversubscribe", "-np", str(ranks), *command]
        # One thread a rank; Open MPI refuses root (containers) unless it is told.
        for name, value in (("OMP_NUM_THREADS", "1"), ("OPENBLAS_NUM_THREADS", "1"), ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
                            ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")):
            environment.setdefault(name, value)
    process = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True, errors="replace")
    try:
        if echo:
            said = ""
            for line in process.stdout:
                print(line, end="", flush=True)
                said += line
            complaint = process.stderr.read()
            process.wait()
        else:
            said, complaint = process.communicate()
    except BaseException:
        process.terminate()  # Ctrl-C in a notebook ends the program, too; its results so far are kept
        process.wait()
        raise
    directory = next((line.split("Results go to ", 1)[1] for line in said.splitlines()
                      if line.startswith("Results go to ")), None)
    status = process.returncode
    if status == 0 and directory is None:
        raise ProgramError(f"{command[0]} ended without results: is it squeal? " + said.strip()[:500], status)
    if status == 0:
        return read(directory)
    message = complaint.strip() or said.strip() or f"squeal ended with exit status {status}"
    if status == 3:
        error = SolverError(message, status)
        error.results = read(directory) if directory and os.path.isfile(os.path.join(directory, "log.txt")) else None
        raise error
    raise (InputError if status == 2 else ProgramError)(message, status)
