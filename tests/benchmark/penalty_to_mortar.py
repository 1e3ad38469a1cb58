#!/usr/bin/env python3
"""Penalty tends to mortar: eigenvalues of the default brake for growing contact stiffness k_C against mortar.

    penalty_to_mortar.py SQUEAL [--set "Section/Key=value"]...

Printed for k_C = 1e11 ... 1e19: the largest relative difference of an eigenvalue, its ratio to the row before (0.1:
the difference falls like 1/k_C), and the largest backward error. Steady pressure is uniform, so that both
formulations touch everywhere.
"""

import argparse
import math

from accuracy import match, run

SCENE = ["Contact/Steady pressure=uniform", "Discretization/Rotor cells=5,36,1", "Discretization/Pad cells=3,6,1",
         "Discretization/Degree=3"]


def eigenvalues(squeal, settings):
    modes, _ = run(squeal, settings)
    values = [(float(m["growth_rate_1_per_s"]), float(m["frequency_hz"])) for m in modes]
    return values, max(float(m["backward_error"]) for m in modes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    settings = SCENE + arguments.set
    mortar, error = eigenvalues(arguments.squeal, settings + ["Contact/Formulation=mortar"])
    print("  k_C, N/m^3   |l - l_mortar|/|l|   ratio   backward error")
    print(f"      mortar                    -       -          {error:.1e}", flush=True)
    before = None
    for exponent in range(11, 20):
        penalty, error = eigenvalues(arguments.squeal, settings + ["Contact/Formulation=penalty",
                                                                   f"Contact/Penalty stiffness=1e{exponent}"])
        difference = max(math.hypot(a[0] - b[0], 2 * math.pi * (a[1] - b[1])) / math.hypot(a[0], 2 * math.pi * a[1])
                         for a, b in zip(mortar, match(mortar, penalty)) if b is not None)
        ratio = "      -" if before is None else f"{difference / before:7.3f}"
        print(f"       1e{exponent}            {difference:9.2e} {ratio}          {error:.1e}", flush=True)
        before = difference


if __name__ == "__main__":
    main()
