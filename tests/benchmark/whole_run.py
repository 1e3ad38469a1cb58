"""What a whole run costs beside the part that any solver of the same equations would have: LU, right and left vectors.

    python3 tests/benchmark/whole_run.py [parameter file ...]

The default is prm/brake.prm. Processor seconds of one run, with error bars: total, the three parts and their sum, the ratio, what
the rest goes to, peak memory."""

import re
import sys
from pathlib import Path

from runs import DEFAULT_BRAKE, PARTS, PROGRAM, run


def seconds_by_phase(log):
    """Of the table at the end of the log."""
    table = log[log.index("  phase            seconds"):]
    return {name: float(seconds) for name, seconds in re.findall(r"(?m)^  (\w+) +([\d.]+)(?: +[\d.]+ %)?$", table)}


def main():
    print("file                     dofs   total s      LU   right    left     sum   total/sum   MiB   the rest, s")
    for file in [Path(name) for name in sys.argv[1:]] or [DEFAULT_BRAKE]:
        log, _, last = run(PROGRAM, file, ["Eigenproblem/Error bars=true"])
        counting, *parts = map(float, re.search(PARTS, log).groups())
        phases = seconds_by_phase(log)
        total = phases.pop("total")
        phases["counting"] = counting
        phases["other eigenproblem"] = phases.pop("eigenproblem") - counting - sum(parts)
        peak = re.search(r"Peak memory (\d+) MiB", log)[1]
        rest = ", ".join(f"{name} {seconds:.2f}" for name, seconds in phases.items() if seconds >= 0.005)
        print(f"{file.name:20s} {int(last['dofs']):8d} {total:9.2f} " + " ".join(f"{s:7.2f}" for s in parts) +
              f" {sum(parts):7.2f} {total / sum(parts):11.2f} {peak:>5s}   {rest}")


if __name__ == "__main__":
    main()
