"""What a sweep costs beside single runs: processor seconds of a sweep over the friction coefficient and of one run at its
last value, full solutions, peak memory, and what took the time.

    python3 tests/benchmark/sweep.py [--bars] [parameter file] [number of values ...]

The default is prm/brake.prm with 40 values from 0 to 0.6; the figures of one machine in one go are to be compared. With
--bars single runs and sweeps have error bars, else neither."""

import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
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


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--bars"]
    bars = f"Eigenproblem/Error bars={str('--bars' in sys.argv).lower()}"
    file = arguments[0] if arguments else PROJECT / "prm/brake.prm"
    numbers = [int(n) for n in arguments[1:]] or [40]
    single, memory, _ = run(file, f"{FRICTION}=0.6", bars)
    print(f"one run: {single:.1f} processor seconds, {memory} MiB")
    print("values   processor s   full solutions   of as many runs   single runs   MiB   seconds by phase")
    for n in numbers:
        seconds, memory, log = run(file, f"Sweep/Parameter={FRICTION}", f"Sweep/Values=0 : 0.6 : {n}",
                                   "Sweep/Critical values=false", bars)
        full = re.search(r"(\d+) full solutions", log)
        phases = re.search(r"Processor seconds: (.*)\.", log)
        print(f"{n:6}   {seconds:11.1f}   {full[1]:>14}   {seconds / (n * single):14.1%}   {seconds / single:11.1f}   "
              f"{memory:5}   {phases[1]}", flush=True)


if __name__ == "__main__":
    main()
