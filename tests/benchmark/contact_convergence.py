#!/usr/bin/env python3
"""Rates of convergence of the first ten eigenvalues under uniform refinement, on the strip, for matching and
non-matching meshes.

    contact_convergence.py SQUEAL [--degrees 1 2 3 4] [--cycles 4]

The reference is the highest degree given on a matching mesh, one refinement finer. The corners of the block are
singular, so the rates end at that of the singularity whatever the degree; the question here is whether non-matching
meshes lose anything against matching ones.
"""

import argparse
import math

from accuracy import match, run

SCENE = ["Scene=strip", "Stage=full", "Operation/Angular velocity=2", "Contact/Steady pressure=uniform",
         "Contact/Friction/Coefficient=0.3", "Eigenproblem/Maximum frequency=40000", "Refinement/Strategy=uniform"]
# 20 cells of 0.01 along the layer; a block of 0.05: 5 cells match, 4 do not.
MESHES = {"matching": ["Discretization/Rotor cells=1,20,2", "Discretization/Pad cells=1,5,2"],
          "non-matching": ["Discretization/Rotor cells=1,20,2", "Discretization/Pad cells=1,4,2"]}


def eigenvalues(modes, cycle):
    return [(float(m["growth_rate_1_per_s"]), float(m["frequency_hz"])) for m in modes if int(m["cycle"]) == cycle][:10]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("--degrees", type=int, nargs="+", default=[1, 2, 3, 4])
    parser.add_argument("--cycles", type=int, default=4)
    arguments = parser.parse_args()

    modes, cycles = run(arguments.squeal, SCENE + MESHES["matching"] +
                        [f"Discretization/Degree={max(arguments.degrees)}", f"Refinement/Cycles={arguments.cycles + 1}"])
    reference = eigenvalues(modes, arguments.cycles)
    print("degree  mesh           cycle   unknowns   error of 10 eigenvalues   rate")
    for degree in arguments.degrees:
        for name, mesh in MESHES.items():
            modes, cycles = run(arguments.squeal, SCENE + mesh + [f"Discretization/Degree={degree}",
                                                                  f"Refinement/Cycles={arguments.cycles}"])
            before = None
            for cycle in cycles:
                found = match(reference, eigenvalues(modes, int(cycle["cycle"])))
                error = max(math.hypot(a[0] - b[0], 2 * math.pi * (a[1] - b[1])) / math.hypot(a[0], 2 * math.pi * a[1])
                            for a, b in zip(reference, found) if b is not None)
                rate = "   -" if before is None else f"{math.log2(before / error):4.2f}"
                print(f"{degree:6d}  {name:13s} {cycle['cycle']:>6s} {cycle['dofs']:>10s}   {error:23.3e}   {rate}",
                      flush=True)
                before = error


if __name__ == "__main__":
    main()
