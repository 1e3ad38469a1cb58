#!/usr/bin/env python3
"""The block eigen-solver against SLEPc's PEP: processor seconds by part, side by side on one machine.

    eigensolvers.py SQUEAL [--large] [--set "Section/Key=value"]...

Each line is one run of the default brake with all modes below a frequency: seconds of the inertia count, the factorisation,
the right vectors, the left vectors, the number of right-hand sides, the largest backward error of a right and of a left
vector, and the whole eigenvalue phase. "krylov" is PEP with TOAR, "linear" PEP with the linearised problem; these and
"block_krylov" solve the brake as a whole, "by halves" is the block solver as it comes, with the mirror symmetry. Below: how many times faster than "krylov" the two are in right and left
vectors and in the phase, the left vectors' cost relative to the right ones, the phase relative to one LU and the right
vectors' solves alone, and the largest relative difference of an eigenvalue. --large adds a mesh of 150 000 unknowns
in degree 2, 500 000 in degree 3 (10 GiB, and more than 24).
"""

import argparse
import re

import runs

MESHES = {"prm/brake.prm": ["Discretization/Rotor cells=10,72,2", "Discretization/Pad cells=6,12,2"]}
LARGE = {"150 000": ["Discretization/Rotor cells=14,104,3", "Discretization/Pad cells=9,18,3"]}
FREQUENCIES = [6000, 12000]
# Name in the table, solver, whether a symmetric brake is solved by its halves, options of PETSc
SOLVERS = [("krylov", "krylov", "false", ""), ("linear", "krylov", "false", "-pep_type linear"),
           ("block_krylov", "block_krylov", "false", ""), ("by halves", "block_krylov", "true", "")]
RIGHT_HAND_SIDES = r"; (\d+) right-hand sides"


def run(squeal, settings, petsc_options):
    """Seconds of the four parts and the number of solves, the modes, the row of the mesh."""
    log, modes, cycle = runs.run(squeal, runs.DEFAULT_BRAKE, [*settings, "Eigenproblem/Error bars=false"],
                                 environment={"PETSC_OPTIONS": petsc_options})
    parts = [float(value) for value in (*re.search(runs.PARTS, log).groups(), re.search(RIGHT_HAND_SIDES, log)[1])]
    return parts, modes, cycle


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    print("unknowns  below, Hz  solver        modes  count     LU  right   left  phase  solves  error, right     left")
    for mesh in {**MESHES, **(LARGE if arguments.large else {})}.values():
        for frequency in FREQUENCIES:
            first = None
            for name, solver, mirror, petsc_options in SOLVERS:
                parts, modes, cycle = run(
                    arguments.squeal, mesh + [f"Eigenproblem/Maximum frequency={frequency}", f"Eigenproblem/Solver={solver}",
                                              f"Eigenproblem/Mirror symmetry={mirror}"] + arguments.set,
                    petsc_options)
                errors = [max(float(m[key]) for m in modes) for key in ("backward_error", "left_backward_error")]
                phase = sum(parts[:4])
                print(f"{cycle['dofs']:>8s} {frequency:10d}  {name:12s} {len(modes):6d} {parts[0]:6.2f} {parts[1]:6.2f} "
                      f"{parts[2]:6.2f} {parts[3]:6.2f} {phase:6.2f} {parts[4]:7.0f} {errors[0]:13.1e} {errors[1]:8.1e}",
                      flush=True)
                if first is None:
                    first, reference = (*parts[:4], phase), runs.eigenvalues(modes)
                    continue
                difference = runs.largest_difference(reference, runs.eigenvalues(modes))
                print(f"          {first[2] / parts[2]:.1f} (right), {first[3] / parts[3]:.1f} (left), {first[4] / phase:.1f} (phase) "
                      f"times faster; left/right {parts[3] / parts[2]:.2f}; phase/(LU + right) "
                      f"{phase / (parts[1] + parts[2]):.2f}; eigenvalues differ by {difference:.0e}", flush=True)


if __name__ == "__main__":
    main()
