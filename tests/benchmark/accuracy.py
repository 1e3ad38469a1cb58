#!/usr/bin/env python3
"""Error against the independent reference tables, with unknowns, time and memory beside it.

    accuracy.py SQUEAL REFERENCE_DIRECTORY TABLE... [--set "Section/Key=value"]... [--print-modes]

TABLE is a name of TABLES below (T1 ... T8-full-mortar). Every run uses the table's scene and the given
settings. Modes are matched by their nearest complex eigenvalue, each reference mode once. Printed: the largest
relative frequency error, the largest error of the growth rate relative to the table's largest |growth rate|, and
the modes at which they occur.
"""

import argparse
import csv
import math
import os
import subprocess
import sys
import tempfile

BRAKE = ["Operation/Angular velocity=5", "Contact/Friction/Coefficient=0.4", "Contact/Steady pressure=uniform",
         "Eigenproblem/Maximum frequency=6300"]
PENALTY = ["Contact/Formulation=penalty", "Contact/Penalty stiffness=1e12"]
PENALTY_13 = ["Contact/Formulation=penalty", "Contact/Penalty stiffness=1e13"]
MORTAR = ["Contact/Formulation=mortar"]
ROTOR = ["Pads/Arrangement=none", "Eigenproblem/Maximum frequency=6000"]

TABLES = {
    "T1": ("rotor_T1.csv", ROTOR + ["Stage=elastic"]),
    "T2": ("rotor_T2_omega100.csv", ROTOR + ["Stage=transport", "Operation/Angular velocity=100"]),
    "T3": ("brake_T3_transport_k1e12.csv", BRAKE + PENALTY + ["Stage=transport"]),
    "T4": ("brake_T4_friction_k1e12.csv", BRAKE + PENALTY + ["Stage=friction"]),
    "T5": ("brake_T5_friction_damping_k1e12.csv", BRAKE + PENALTY + ["Stage=friction_damping"]),
    "T6": ("brake_T6_full_k1e12.csv", BRAKE + PENALTY + ["Stage=full"]),
}
for stage in ("transport", "friction", "full"):
    TABLES[f"T8-{stage}-k1e13"] = (f"brake_T8_{stage}_k1e13.csv", BRAKE + PENALTY_13 + [f"Stage={stage}"])
    TABLES[f"T8-{stage}-mortar"] = (f"brake_T8_{stage}_mortar.csv", BRAKE + MORTAR + [f"Stage={stage}"])


def read_csv(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def read_reference(path, maximum_frequency):
    """Eigenvalues (growth rate, frequency) with their multiplicity."""
    result = []
    for row in read_csv(path):
        copies = int(row.get("multiplicity") or 1)
        frequency = float(row["frequency_hz"])
        if frequency <= maximum_frequency:
            result += [(float(row.get("growth_rate_1_per_s") or 0), frequency)] * copies
    return result


def match(reference, computed):
    """For each reference mode the computed one: nearest pairs first, each used once."""
    pairs = sorted((math.hypot(r[0] - c[0], 2 * math.pi * (r[1] - c[1])), i, j)
                   for i, r in enumerate(reference) for j, c in enumerate(computed))
    partner, used = {}, set()
    for _, i, j in pairs:
        if i not in partner and j not in used:
            partner[i] = j
            used.add(j)
    return [computed[partner[i]] if i in partner else None for i in range(len(reference))]


def run(squeal, settings):
    with tempfile.TemporaryDirectory() as directory:
        prm = os.path.join(directory, "accuracy.prm")
        open(prm, "w").close()
        command = [squeal, prm] + [f"--set={s}" if False else s for pair in
                                   (("--set", s) for s in settings + [f"Output/Directory={directory}/out",
                                                                      "Output/Fields=none"]) for s in pair]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{' '.join(command)}\nfailed with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr}")
        return read_csv(f"{directory}/out/modes.csv"), read_csv(f"{directory}/out/cycles.csv")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("reference")
    parser.add_argument("tables", nargs="+", choices=sorted(TABLES))
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--print-modes", action="store_true")
    arguments = parser.parse_args()

    print("table             cycle   unknowns  modes  frequency error (at Hz)     growth-rate error (at Hz)"
          "    seconds  MiB")
    for name in arguments.tables:
        filename, settings = TABLES[name]
        maximum = float(next(s.split("=")[1] for s in settings if "Maximum frequency" in s))
        reference = read_reference(os.path.join(arguments.reference, filename), maximum)
        modes, cycles = run(arguments.squeal, settings + arguments.set)
        scale = max(abs(r[0]) for r in reference) or 1.0
        for cycle in cycles:
            # A mode at the window's end may lie just outside on a coarse mesh.
            computed = [(float(m["growth_rate_1_per_s"]), float(m["frequency_hz"])) for m in modes
                        if m["cycle"] == cycle["cycle"]]
            partners = match(reference, computed)
            found = [(r, c) for r, c in zip(reference, partners) if c is not None]
            f_error, f_at = max((abs(c[1] - r[1]) / r[1], r[1]) for r, c in found)
            g_error, g_at = max((abs(c[0] - r[0]) / scale, r[1]) for r, c in found)
            print(f"{name:18s} {cycle['cycle']:>4s} {cycle['dofs']:>10s}  {len(found):2d}/{len(reference):2d}"
                  f"  {f_error:9.2e} ({f_at:8.2f})   {g_error:9.2e} of {scale:8.2f} ({f_at if False else g_at:8.2f})"
                  f"  {float(cycle['seconds_total']):7.1f}  {float(cycle['memory_mib']):5.0f}", flush=True)
            if arguments.print_modes:
                for r, c in zip(reference, partners):
                    print(f"    {r[1]:11.5f} {r[0]:12.5f}   " +
                          ("missing" if c is None else
                           f"{c[1]:11.5f} {c[0]:12.5f}   {abs(c[1] - r[1]) / r[1]:8.1e} {c[0] - r[0]:10.4f}"))


if __name__ == "__main__":
    main()
