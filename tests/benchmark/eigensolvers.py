#!/usr/bin/env python3
"""The block eigen-solver against SLEPc's PEP: processor seconds by part, side by side on one machine.

    eigensolvers.py SQUEAL [--large] [--set "Section/Key=value"]...

Each line is one run of the default brake with all modes below a frequency: seconds of the inertia count, the factorisation,
the right vectors, the left vectors, the number of right-hand sides, the largest backward error of a right and of a left
vector. Below each pair: how many times faster the block solver is (right; left), the left vectors' cost relative to the
right ones, and the largest relative difference of an eigenvalue. --large adds a mesh of 150 000 unknowns (10 GiB).
"""

import argparse
import os
import re
import subprocess
import tempfile

from accuracy import read_csv

MESHES = {"prm/brake.prm": ["Discretization/Rotor cells=10,72,2", "Discretization/Pad cells=6,12,2"]}
LARGE = {"150 000": ["Discretization/Rotor cells=14,104,3", "Discretization/Pad cells=9,18,3"]}
FREQUENCIES = [6000, 12000]
SOLVERS = ["krylov", "block_krylov"]
PARTS = r"counting ([\d.]+), factorisation ([\d.]+), right vectors ([\d.]+), left vectors ([\d.]+); (\d+) right"


def run(squeal, settings):
    with tempfile.TemporaryDirectory() as directory:
        prm = os.path.join(directory, "run.prm")
        open(prm, "w").close()
        settings = settings + [f"Output/Directory={directory}/out", "Output/Fields=none"]
        subprocess.run([squeal, prm] + [a for s in settings for a in ("--set", s)], check=True, capture_output=True,
                       env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
        with open(f"{directory}/out/log.txt") as log:
            parts = [float(value) for value in re.search(PARTS, log.read()).groups()]
        return parts, read_csv(f"{directory}/out/modes.csv"), read_csv(f"{directory}/out/cycles.csv")[0]


def eigenvalues(modes):
    return [complex(float(m["growth_rate_1_per_s"]), 6.283185307179586 * float(m["frequency_hz"])) for m in modes]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    print("unknowns  below, Hz  solver        modes  count     LU  right   left  solves  error, right     left")
    for mesh in {**MESHES, **(LARGE if arguments.large else {})}.values():
        for frequency in FREQUENCIES:
            runs = {}
            for solver in SOLVERS:
                parts, modes, cycle = runs[solver] = run(
                    arguments.squeal, mesh + [f"Eigenproblem/Maximum frequency={frequency}",
                                              f"Eigenproblem/Solver={solver}"] + arguments.set)
                errors = [max(float(m[key]) for m in modes) for key in ("backward_error", "left_backward_error")]
                print(f"{cycle['dofs']:>8s} {frequency:10d}  {solver:12s} {len(modes):6d} {parts[0]:6.2f} {parts[1]:6.2f} "
                      f"{parts[2]:6.2f} {parts[3]:6.2f} {parts[4]:7.0f} {errors[0]:13.1e} {errors[1]:8.1e}", flush=True)
            pep, block = (runs[solver][0] for solver in SOLVERS)
            a, b = (eigenvalues(runs[solver][1]) for solver in SOLVERS)
            difference = max(min(abs(x - y) for y in b) / abs(x) for x in a)
            print(f"          block_krylov is {pep[2] / block[2]:.1f} (right) and {pep[3] / block[3]:.1f} (left) times faster; "
                  f"left/right {block[3] / block[2]:.2f}; eigenvalues differ by {difference:.0e}", flush=True)


if __name__ == "__main__":
    main()
