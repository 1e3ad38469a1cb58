#!/usr/bin/env python3
"""Modes without factors: what do time and memory grow to, and how accurate are the eigenvalues?

    modes_without_factors.py [SQUEAL] [--prm prm/brake.prm] [--degrees 3] [--levels 1,1.5,2] [--direct 2]
                             [--ranks 1] [--set "Section/Key=value"]...

The meshes of a level have so many times the cells of prm/brake.prm in each direction. Printed for each: unknowns; modes
below 6 kHz; multigrid cycles; seconds of the eigenproblem, that of the lower degree included, and of the whole run;
peak resident memory of all ranks. Levels up to --direct are also solved by block_krylov, with factors: the last column
is the largest relative difference of the eigenvalues. Error bars are off.
"""

import argparse
import re
import subprocess

from runs import DEFAULT_BRAKE, PROGRAM, eigenvalues, largest_difference, run

ROTOR, PAD = (5, 36, 1), (3, 6, 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal", nargs="?", default=PROGRAM)
    parser.add_argument("--prm", default=DEFAULT_BRAKE)
    parser.add_argument("--degrees", default="3")
    parser.add_argument("--levels", default="1,1.5,2")
    parser.add_argument("--direct", type=float, default=2)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    print("degree   unknowns  solver           modes   cycles   eigenproblem, s    run, s     GiB   difference")
    for degree in arguments.degrees.split(","):
        for level in map(float, arguments.levels.split(",")):
            known = None
            for solver in ["block_krylov"] * (level <= arguments.direct) + ["block_davidson"]:
                cells = [",".join(str(round(level * count)) for count in counts) for counts in (ROTOR, PAD)]
                settings = [f"Discretization/Degree={degree}", f"Discretization/Rotor cells={cells[0]}",
                            f"Discretization/Pad cells={cells[1]}", f"Eigenproblem/Solver={solver}",
                            "Eigenproblem/Error bars=false", *arguments.set]
                try:
                    log, modes, cycle = run(arguments.squeal, arguments.prm, settings, arguments.ranks)
                except subprocess.CalledProcessError as error:
                    print(f"       {solver}, level {level}: {error.stderr.strip()}", flush=True)
                    continue
                found = eigenvalues(modes)
                cycles = re.search(r"without factors: (\d+) multigrid cycles", log)
                difference = f"{largest_difference(found, known):12.1e}" if known else ""
                known = known or found
                print(f"{degree:>6s} {int(cycle['dofs']):10d}  {solver:15s} {len(found):6d} "
                      f"{cycles.group(1) if cycles else '':>8s} {float(cycle['seconds_eigenproblem']):17.1f} "
                      f"{float(cycle['seconds_total']):9.1f} {float(cycle['memory_mib']) / 1024:7.2f} {difference}",
                      flush=True)


if __name__ == "__main__":
    main()
