#!/usr/bin/env python3
"""What do the multipliers of the saddle point cost? Mortar against penalty on the same meshes of the brake.

    multiplier_cost.py SQUEAL [--repeat 3] [--set "Section/Key=value"]...

Condensing multipliers by a dual basis leaves a matrix with at least the couplings of the penalty matrix, so penalty is
what condensation could reach. Printed: unknowns, multipliers, memory of the factors, peak memory, seconds of the
eigenproblem and of the run (the least of the repetitions). Steady pressure is uniform: contact is closed everywhere.
"""

import argparse
import os
import re
import subprocess
import tempfile

from accuracy import read_csv

MESHES = {"default, degree 2": ["Discretization/Degree=2"],
          "default, degree 3": ["Discretization/Degree=3"],
          "pads 10,20,1, degree 2": ["Discretization/Pad cells=10,20,1"],
          "prm/brake.prm, degree 2": ["Discretization/Rotor cells=10,72,2", "Discretization/Pad cells=6,12,2"]}


def run(squeal, settings):
    with tempfile.TemporaryDirectory() as directory:
        prm = os.path.join(directory, "cost.prm")
        open(prm, "w").close()
        settings = settings + [f"Output/Directory={directory}/out", "Output/Fields=none"]
        subprocess.run([squeal, prm] + [a for s in settings for a in ("--set", s)], check=True, capture_output=True)
        with open(f"{directory}/out/log.txt") as log:
            factors = int(re.search(r"shift-invert (\d+) MiB", log.read()).group(1))
        return read_csv(f"{directory}/out/cycles.csv")[0], factors


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    print("mesh                      contact   unknowns  multipliers  factors, MiB  peak, MiB  eigenproblem, s  total, s")
    for name, mesh in MESHES.items():
        for formulation in ("mortar", "penalty"):
            runs = [run(arguments.squeal, mesh + ["Contact/Steady pressure=uniform",
                                                  f"Contact/Formulation={formulation}"] + arguments.set)
                    for _ in range(arguments.repeat)]
            cycle, factors = runs[0]
            seconds = [min(float(c[key]) for c, _ in runs) for key in ("seconds_eigenproblem", "seconds_total")]
            print(f"{name:25s} {formulation:8s} {cycle['dofs']:>9s} {cycle['multipliers']:>12s} {factors:13d} "
                  f"{float(cycle['memory_mib']):10.0f} {seconds[0]:16.2f} {seconds[1]:9.2f}", flush=True)


if __name__ == "__main__":
    main()
