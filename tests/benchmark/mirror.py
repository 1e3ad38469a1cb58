#!/usr/bin/env python3
"""A symmetric brake solved as a whole and by its halves: processor seconds by part, memory, eigenvalues.

    mirror.py [PARAMETER_FILE] [--program SQUEAL] [--set "Section/Key=value"]...

The default is prm/brake.prm. Both runs are made one after the other on one machine, without fields. "whole run" also
has the check of the symmetry and the products that make the halves.
"""

import argparse
import re

import runs


def run(arguments, mirror):
    """Figures by name, and the eigenvalues."""
    log, modes, cycle = runs.run(arguments.program, arguments.file,
                                 [*arguments.set, f"Eigenproblem/Mirror symmetry={mirror}"])
    parts = [float(value) for value in re.findall(runs.PARTS, log)[-1]]
    figures = dict(zip(["counting, s", "factorisation, s", "right vectors, s", "left vectors, s"], parts))
    figures["sum of these, s"] = sum(parts)
    figures["whole run, s"] = float(cycle["processor_seconds"])
    figures["factors, MiB"] = float(re.findall(r"shift-invert (\d+) MiB", log)[-1])
    figures["peak memory, MiB"] = float(cycle["memory_mib"])
    figures["largest backward error"] = max(float(mode["backward_error"]) for mode in modes)
    last = [mode for mode in modes if mode["cycle"] == modes[-1]["cycle"]]
    return figures, runs.eigenvalues(last)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", default=runs.DEFAULT_BRAKE)
    parser.add_argument("--program", default=runs.PROGRAM)
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    (whole, of_whole), (halves, of_halves) = (run(arguments, mirror) for mirror in ("false", "true"))
    print(f"{'':24s} {'whole':>10s} {'halves':>10s} {'ratio':>7s}")
    for name, value in whole.items():
        ratio = f"{value / halves[name]:7.2f}" if halves[name] > 0 else ""
        print(f"{name:24s} {value:10.4g} {halves[name]:10.4g} {ratio}")
    print(f"{len(of_whole)} and {len(of_halves)} modes; largest relative difference of an eigenvalue {runs.largest_difference(of_whole, of_halves):.1e}")


if __name__ == "__main__":
    main()
