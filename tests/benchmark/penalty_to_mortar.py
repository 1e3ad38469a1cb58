#!/usr/bin/env python3
"""Does penalty tend to mortar? Eigenvalues of a brake for growing contact stiffness k_C against mortar.

    penalty_to_mortar.py SQUEAL [--meshes default matching non-matching refined] [--set "Section/Key=value"]...

default is the default brake, whose contact meshes do not match; matching and non-matching are two meshes of one
brake with pads of 40 degrees, 0.09 < r < 0.13.

Printed for k_C = 1e11 ... 1e19: the largest relative difference of an eigenvalue, its ratio to the row before (0.1:
the difference falls like 1/k_C), the largest backward error, and the tolerance the eigensolver reached (it is asked for
1e-9; ill-conditioned matrices reach less). Steady pressure is uniform, so that both formulations touch everywhere.

What is shown. The penalty p = k_C g acts in every quadrature point, so its limit is [[u]].n = 0 in every point of the
face, whereas mortar asks for it only against its multipliers.
* On matching meshes both sides have the same traces, and both conditions are the same. The difference falls like 1/k_C
  until rounding takes over.
* On non-matching meshes a jump that vanishes everywhere leaves only what both piecewise polynomial spaces contain: one
  polynomial between the nodes that both meshes share, perhaps over the whole face. The face locks. The difference falls
  like 1/k_C while k_C is soft against a cell, then it grows to the distance of the locked limit. Refinement delays this
  and, since halved cells share more nodes, lowers the limit (mesh refined: non-matching with all lengths but the
  thickness halved).
"""

import argparse
import math

from accuracy import match, run

SCENE = ["Contact/Steady pressure=uniform", "Discretization/Rotor cells=5,36,1", "Discretization/Degree=2"]
SHORT_PADS = ["Pads/Sector angle=40", "Pads/Outer radius=0.13"]  # ends on the rotor's lines
MESHES = {"default": ["Discretization/Pad cells=3,6,1"],
          "matching": SHORT_PADS + ["Discretization/Pad cells=2,4,1"],
          "non-matching": SHORT_PADS + ["Discretization/Pad cells=3,5,1"],
          "refined": SHORT_PADS + ["Discretization/Rotor cells=10,72,1", "Discretization/Pad cells=6,10,1"]}
TOLERANCES = ["1e-9", "1e-7", "1e-5", "1e-3"]


def eigenvalues(squeal, settings):
    """Eigenvalues, largest backward error, and the tolerance that could be met; None if none could."""
    for tolerance in TOLERANCES:
        try:
            modes, _ = run(squeal, settings + [f"Eigenproblem/Tolerance={tolerance}"])
        except SystemExit as problem:
            message = str(problem).strip().splitlines()[-1]
            continue
        values = [(float(m["growth_rate_1_per_s"]), float(m["frequency_hz"])) for m in modes]
        return values, max(float(m["backward_error"]) for m in modes), tolerance
    print("      " + message)
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("--meshes", nargs="+", choices=MESHES, default=list(MESHES))
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    for mesh in arguments.meshes:
        settings = SCENE + MESHES[mesh] + arguments.set
        mortar, error, tolerance = eigenvalues(arguments.squeal, settings + ["Contact/Formulation=mortar"])
        print(f"\n{mesh}: {', '.join(MESHES[mesh] + arguments.set)}")
        print("  k_C, N/m^3   |l - l_mortar|/|l|   ratio   backward error   tolerance")
        print(f"      mortar                    -       -          {error:.1e}        {tolerance}", flush=True)
        before = None
        for exponent in range(11, 20):
            result = eigenvalues(arguments.squeal, settings + ["Contact/Formulation=penalty",
                                                               f"Contact/Penalty stiffness=1e{exponent}"])
            if result is None:
                before = None
                continue
            penalty, error, tolerance = result
            difference = max(math.hypot(a[0] - b[0], 2 * math.pi * (a[1] - b[1])) / math.hypot(a[0], 2 * math.pi * a[1])
                             for a, b in zip(mortar, match(mortar, penalty)) if b is not None)
            ratio = "      -" if before is None else f"{difference / before:7.3f}"
            print(f"        1e{exponent}            {difference:9.2e} {ratio}          {error:.1e}        {tolerance}",
                  flush=True)
            before = difference


if __name__ == "__main__":
    main()
