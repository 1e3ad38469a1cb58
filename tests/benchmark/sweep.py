"""What a sweep costs beside single runs: processor seconds of a sweep over the friction coefficient and of one run at its
last value, full solutions, peak memory, and what took the time.

    python3 tests/benchmark/sweep.py [--bars] [--check M] [parameter file] [number of values ...]

The default is prm/brake.prm with 40 values from 0 to 0.6; the figures of one machine in one go are to be compared. With
--bars single runs and sweeps have error bars, else neither. With --check M of the values, drawn at random, are run by
themselves: has every mode its partner, and are the eigenvalues within the sum of what both may be off by solving?"""

import argparse
import math
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(PROJECT / "tests/lib"))

import squeal_testing as st  # noqa: E402

PROGRAM = PROJECT / "build/release/squeal"
FRICTION = "Contact/Friction/Coefficient"


def run(file, *settings, directory=None):
    """Processor seconds, peak memory (MiB) and the log of a run, whose results stay in the directory if one is given."""
    with tempfile.TemporaryDirectory() as scratch:
        directory = directory or scratch
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        arguments = [argument for setting in (*settings, f"Output/Directory={directory}", "Output/Fields=none")
                     for argument in ("--set", setting)]
        result = subprocess.run([PROGRAM, file, *arguments], capture_output=True, text=True, check=True,
                                env={**os.environ, "OMP_NUM_THREADS": "1"})
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    memory = re.search(r"Peak memory (\d+) MiB", result.stdout)
    return seconds, int(memory[1]) if memory else 0, result.stdout


def check(file, rows, n, bars):
    """Some of the values by runs of their own, whose eigenvalues may be off by condition x |l| x backward error."""
    values = sorted({row["parameter"] for row in rows})
    others, beyond, of_error, of_growth, relative = [], 0, 0, 0, 0
    drawn = random.Random(1).sample(values, min(n, len(values)))
    for value in sorted(drawn):
        own = {st.eigenvalue(row): row["reduction_error_1_per_s"] for row in rows if row["parameter"] == value}
        with tempfile.TemporaryDirectory() as directory:
            run(file, f"{FRICTION}={value!r}", bars, directory=directory)
            alone = {st.eigenvalue(row): row["condition_number"] * abs(st.eigenvalue(row)) * row["backward_error"]
                     for row in st.read_table(Path(directory, "modes.csv"))}
        if len(own) != len(alone):
            others.append(value)
            continue
        for ours, theirs in st.TestCase().pairs(list(own), list(alone)):
            error = own[ours] + alone[theirs]
            of_error = max(of_error, abs(ours - theirs) / error if error > 0 else math.inf)
            beyond += abs(ours - theirs) > error
            of_growth = max(of_growth, abs(ours.real - theirs.real))
            relative = max(relative, abs(ours - theirs) / abs(theirs))
    print(f"{len(drawn)} values by themselves: {len(others)} with another number of modes {others}; {beyond} eigenvalues beyond "
          f"the reduction error, at most {of_error:.2g} of it; growth rates differ by up to {of_growth:.2g} 1/s, eigenvalues by "
          f"{relative:.2g} of them", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bars", action="store_true")
    parser.add_argument("--check", type=int, default=0)
    parser.add_argument("file_and_numbers", nargs="*", metavar="FILE NUMBER")
    arguments = parser.parse_args()
    numbers = [int(word) for word in arguments.file_and_numbers if word.isdigit()]
    files = [word for word in arguments.file_and_numbers if not word.isdigit()]
    if len(files) > 1:
        parser.error(f"one parameter file and numbers of values, not {' '.join(files)}")
    file, bars = files[0] if files else PROJECT / "prm/brake.prm", f"Eigenproblem/Error bars={str(arguments.bars).lower()}"
    single, memory, _ = run(file, f"{FRICTION}=0.6", bars)
    print(f"one run: {single:.1f} processor seconds, {memory} MiB")
    print("values   processor s   full solutions   of as many runs   single runs   MiB   seconds by phase")
    for n in numbers or [40]:
        with tempfile.TemporaryDirectory() as directory:
            seconds, memory, log = run(file, f"Sweep/Parameter={FRICTION}", f"Sweep/Values=0 : 0.6 : {n}",
                                       "Sweep/Critical values=false", bars, directory=directory)
            rows = st.read_table(Path(directory, "sweep.csv"))
        full = re.search(r"(\d+) full solutions", log)
        phases = re.search(r"Processor seconds: (.*)\.", log)
        print(f"{n:6}   {seconds:11.1f}   {full[1]:>14}   {seconds / (n * single):14.1%}   {seconds / single:11.1f}   "
              f"{memory:5}   {phases[1]}", flush=True)
        if arguments.check:
            check(file, rows, arguments.check, bars)


if __name__ == "__main__":
    main()
