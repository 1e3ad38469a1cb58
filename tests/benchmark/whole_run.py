"""What a whole run costs beside the part that any solver of the same equations would have: LU, right and left vectors.

    python3 tests/benchmark/whole_run.py [parameter file ...]

The default is prm/brake.prm. One run with error bars. Processor seconds: total, the three parts and their sum, the ratio,
counting and what is left. Then seconds that one waits by phase, which are more where others use the machine; peak memory."""

import argparse
import re
from pathlib import Path

from runs import DEFAULT_BRAKE, PARTS, PROGRAM, processor_seconds, run


def waited_by_phase(log):
    """Of the table at the end of the log."""
    table = log[log.index("  phase            seconds"):]
    return {name: float(seconds) for name, seconds in re.findall(r"(?m)^  (\w+) +([\d.]+)(?: +[\d.]+ %)?$", table)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, default=[DEFAULT_BRAKE])
    print("file                     dofs   total s      LU   right    left     sum   total/sum   counting   the rest    MiB   waited, s")
    for file in parser.parse_args().files:
        before = processor_seconds()
        log, _, last = run(PROGRAM, file, ["Eigenproblem/Error bars=true"])
        total = processor_seconds() - before
        counting, *parts = map(float, re.search(PARTS, log).groups())
        peak = re.search(r"Peak memory (\d+) MiB", log)[1]
        waited = ", ".join(f"{name} {seconds:.2f}" for name, seconds in waited_by_phase(log).items() if seconds >= 0.005)
        print(f"{file.name:20s} {int(last['dofs']):8d} {total:9.2f} " + " ".join(f"{s:7.2f}" for s in parts) +
              f" {sum(parts):7.2f} {total / sum(parts):11.2f} {counting:10.2f} {total - counting - sum(parts):10.2f} {peak:>6s}   {waited}")


if __name__ == "__main__":
    main()
