#!/usr/bin/env python3
"""Ranks: wall time by phase, speed-up, efficiency and memory by rank, side by side on one machine.

    parallel.py [PARAMETER_FILE] [--ranks 1 2 4] [--repeat N] [--program SQUEAL] [--set "Section/Key=value"]...

The default is prm/brake.prm with 101 000 unknowns. Phases are those of the log, seconds of wall time, the least of the
repetitions; memory is that of all ranks. The machine must be free and have a core for each rank, or the efficiency says nothing. Below: the largest
relative difference of an eigenvalue to that on the first number of ranks.
"""

import argparse
import os
import re

import runs

MESH = ["Discretization/Rotor cells=9,64,1", "Discretization/Pad cells=4,11,1"]
PHASES = ["mesh", "assembly", "contact", "static", "eigenproblem", "estimate", "output", "total"]


def run(arguments, ranks):
    """Seconds by phase, memory of all ranks in MiB, eigenvalues, unknowns."""
    log, modes, cycle = runs.run(arguments.program, arguments.file, MESH + arguments.set, ranks)
    seconds = {}
    for phase in PHASES:
        found = re.findall(rf"^  {phase} +([\d.]+)", log, re.MULTILINE)
        seconds[phase] = float(found[-1]) if found else 0.
    return seconds, float(cycle["memory_mib"]), runs.eigenvalues(modes), int(cycle["dofs"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", default=runs.DEFAULT_BRAKE)
    parser.add_argument("--ranks", nargs="+", type=int, default=[1, 2, 4])
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--program", default=runs.PROGRAM)
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    first, reference = None, None
    for ranks in arguments.ranks:
        results = [run(arguments, ranks) for _ in range(arguments.repeat)]
        seconds = {phase: min(r[0][phase] for r in results) for phase in PHASES}
        _, memory, eigenvalues, n_unknowns = results[0]
        if first is None:
            first, reference = seconds, eigenvalues
            print(f"{n_unknowns} unknowns, {len(eigenvalues)} modes, {os.cpu_count()} cores")
            print("ranks          " + "".join(f"{phase:>14s}" for phase in PHASES) + "    memory, MiB")
        print(f"{ranks:5d}  seconds " + "".join(f"{seconds[phase]:14.2f}" for phase in PHASES) + f"{memory:15.0f}")
        if ranks != arguments.ranks[0]:
            print("       speed-up" + "".join(f"{first[phase] / seconds[phase]:14.2f}" if seconds[phase] > 0 else f"{'-':>14s}"
                                             for phase in PHASES))
            print(f"       eigenvalues differ by {runs.largest_difference(reference, eigenvalues):.1e}", flush=True)


if __name__ == "__main__":
    main()
