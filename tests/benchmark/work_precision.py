#!/usr/bin/env python3
"""Error against wall time, unknowns and memory: the brake's modes of T6 (reference.md).

    work_precision.py [--degrees 1 2 3 4] [--strategies uniform adaptive] [--cycles N] [--timeout 180]
                      [--maximum-unknowns N] [--plot FILE.png]

The error is the largest |l - l_ref|/|l_ref| of the modes that the mesh has in the window, paired with the reference by
assignment; "corrected" is the same of the eigenvalues with the estimated error taken off. Seconds are those of one mesh,
and those since the start of the run, which is what adaptive refinement costs. A run that takes longer than the timeout
ends there; its finished meshes count. Degree 4 begins on a coarser mesh.

The rotor alone (T1) by CalculiX with 20-node hexahedra follows if the program ccx is installed.
"""

import argparse
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))

import error_statistics as es  # noqa: E402
import squeal_testing as st  # noqa: E402

CYCLES = {1: 3, 2: 3, 3: 2, 4: 2}
COARSE = {4: {"Discretization/Rotor cells": "3, 24, 1", "Discretization/Pad cells": "2, 4, 1"}}


def largest_error(rows, reference, value):
    """The largest relative error and the number of modes."""
    values = [value(row) for row in rows]
    partners = es.assign([[abs(l - r) ** 2 for r in reference] for l in values])
    errors = [abs(l - reference[j]) / abs(reference[j]) for l, j in zip(values, partners) if j is not None]
    return max(errors), len(errors)


def measure(degree, strategy, arguments):
    """One line of numbers for each mesh."""
    settings = es.settings("T6", **{
        "Refinement/Strategy": strategy, "Refinement/Cycles": arguments.cycles or CYCLES[degree],
        "Refinement/Tolerance": 1e-6, "Refinement/Maximum unknowns": arguments.maximum_unknowns,
        "Discretization/Degree": degree, **COARSE.get(degree, {})})
    with tempfile.TemporaryDirectory() as directory:
        file = pathlib.Path(directory) / "run.prm"
        file.write_text(st.parameter_file(settings))
        try:
            done = st.run(file.name, directory=directory, timeout=arguments.timeout)
            if done.returncode != 0:
                sys.exit(f"degree {degree}, {strategy}: exit status {done.returncode}\n{done.stdout[-2000:]}"
                         f"{done.stderr}")
        except AssertionError:
            print(f"       {degree}  {strategy:9s} more than {arguments.timeout:.0f} s: later meshes are left out")
        results = pathlib.Path(directory) / "output/run"
        if not (results / "cycles.csv").exists():
            return []
        modes, cycles = st.read_table(results / "modes.csv"), st.read_table(results / "cycles.csv")
    reference = st.reference_eigenvalues(es.TABLES["T6"][0])
    lines, so_far = [], 0
    for cycle in cycles:
        rows = [row for row in modes if row["cycle"] == cycle["cycle"]]
        computed, n_modes = largest_error(rows, reference, st.eigenvalue)
        better, _ = largest_error(rows, reference, es.corrected)
        so_far += cycle["seconds_total"]
        lines.append({"degree": degree, "strategy": strategy, "unknowns": cycle["dofs"], "modes": n_modes,
                      "computed": computed, "corrected": better, "seconds": cycle["seconds_total"],
                      "so far": so_far, "MiB": cycle["memory_mib"]})
    return lines


def show(line):
    print(f"  {line['degree']:6d}  {line['strategy']:9s} {line['unknowns']:9.0f}  {line['modes']:5d}   "
          f"{line['computed']:9.2e}   {line['corrected']:9.2e}   {line['seconds']:8.1f}  {line['so far']:8.1f}  "
          f"{line['MiB']:6.0f}", flush=True)


def calculix_input(n_r, n_phi, n_z, n_modes):
    """The rotor as 20-node hexahedra with reduced integration, nodes of the edges on the circles."""
    inner, outer, thickness = 0.05, 0.15, 0.012
    numbers, nodes, elements, clamped = {}, [], [], []

    def node(i, j, k):  # in half cells; around the axis j is periodic
        key = (i, j % (2 * n_phi), k)
        if key not in numbers:
            numbers[key] = len(numbers) + 1
            r, phi = inner + (outer - inner) * i / (2 * n_r), math.pi * key[1] / n_phi
            nodes.append(f"{numbers[key]}, {r * math.cos(phi):.10e}, {r * math.sin(phi):.10e}, "
                         f"{thickness * (k / (2 * n_z) - 0.5):.10e}")
            if i == 0:
                clamped.append(numbers[key])
        return numbers[key]

    corners = [(0, 0), (2, 0), (2, 2), (0, 2)]
    middles = [(1, 0), (2, 1), (1, 2), (0, 1)]
    for a in range(n_r):
        for b in range(n_phi):
            for c in range(n_z):
                at = lambda i, j, k: node(2 * a + i, 2 * b + j, 2 * c + k)
                element = ([at(i, j, 0) for i, j in corners] + [at(i, j, 2) for i, j in corners]
                           + [at(i, j, 0) for i, j in middles] + [at(i, j, 2) for i, j in middles]
                           + [at(i, j, 1) for i, j in corners])
                elements.append([len(elements) + 1, *element])
    text = ["*NODE, NSET=ALL", *nodes, "*ELEMENT, TYPE=C3D20R, ELSET=ROTOR"]
    for element in elements:
        # At most 16 numbers to a line.
        text += [", ".join(map(str, element[:15])) + ",", ", ".join(map(str, element[15:]))]
    text += ["*NSET, NSET=CLAMP", *(f"{n}," for n in clamped), "*MATERIAL, NAME=IRON", "*ELASTIC", "1.25e11, 0.25",
             "*DENSITY", "7200", "*SOLID SECTION, ELSET=ROTOR, MATERIAL=IRON", "*BOUNDARY", "CLAMP, 1, 3", "*STEP",
             "*FREQUENCY", str(n_modes), "*END STEP"]
    return "\n".join(text) + "\n", 3 * (len(nodes) - len(clamped))


def calculix():
    if not shutil.which("ccx"):
        print("\nSKIPPED: CalculiX on the rotor alone; the program ccx is not installed (Debian: calculix-ccx).")
        return
    reference = []
    for row in st.read_table(st.REFERENCE / "rotor_T1.csv"):
        reference += [row["frequency_hz"]] * int(row["multiplicity"])
    reference.sort()
    print("\nCalculiX, rotor alone (T1), C3D20R\n      cells       unknowns  modes       error    seconds")
    for cells in [(5, 36, 1), (10, 72, 2), (15, 108, 3)]:
        with tempfile.TemporaryDirectory() as directory:
            text, n_unknowns = calculix_input(*cells, len(reference))
            (pathlib.Path(directory) / "rotor.inp").write_text(text)
            start = time.time()
            done = subprocess.run(["ccx", "rotor"], cwd=directory, capture_output=True, text=True)
            seconds = time.time() - start
            data = pathlib.Path(directory) / "rotor.dat"
            table = data.read_text() if data.exists() else ""
        # Mode, eigenvalue, omega, frequency in Hz, and a part that vanishes.
        found = [float(m[1]) for m in re.finditer(r"^\s+\d+\s+\S+E\S+\s+\S+E\S+\s+(\S+E\S+)\s+\S+E\S+\s*$", table,
                                                  re.MULTILINE)][:len(reference)]
        if not found:
            print(f"  {cells}: no eigenvalues\n{done.stdout[-1000:]}")
            continue
        error = max(abs(f - r) / r for f, r in zip(sorted(found), reference))
        print(f"  {cells!s:13s} {n_unknowns:9d}  {len(found):5d}   {error:9.2e}   {seconds:8.1f}", flush=True)


def plot(lines, filename):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.5), sharey=True, layout="constrained")
    for axis, key, label in zip(axes, ["time", "unknowns", "MiB"], ["wall time, s", "unknowns", "peak memory, MiB"]):
        for degree in sorted({line["degree"] for line in lines}):
            for strategy, style in [("uniform", "-"), ("adaptive", "--")]:
                own = [line for line in lines if (line["degree"], line["strategy"]) == (degree, strategy)]
                if not own:
                    continue
                # Adaptive meshes need those before; a uniform one could be had at once.
                x = [line["so far" if strategy == "adaptive" else "seconds"] if key == "time" else line[key]
                     for line in own]
                for value, marker in [("computed", "o"), ("corrected", "^")]:
                    axis.loglog(x, [line[value] for line in own], style + marker, color=f"C{degree - 1}",
                                fillstyle="full" if value == "computed" else "none",
                                label=f"degree {degree}, {strategy}, {value}")
        axis.set_xlabel(label)
        axis.grid(True, which="both", alpha=0.3)
    axes[0].set_ylabel("largest relative error of the eigenvalues of T6")
    axes[2].legend(fontsize=7, bbox_to_anchor=(1.02, 1), loc="upper left")
    figure.savefig(filename, dpi=130)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--degrees", nargs="+", type=int, choices=sorted(CYCLES), default=sorted(CYCLES))
    parser.add_argument("--strategies", nargs="+", choices=["uniform", "adaptive"], default=["uniform", "adaptive"])
    parser.add_argument("--cycles", type=int, default=0, help="meshes of each run; 0: by degree")
    parser.add_argument("--timeout", type=float, default=180)
    parser.add_argument("--maximum-unknowns", type=int, default=120000)
    parser.add_argument("--plot", metavar="FILE.png")
    arguments = parser.parse_args()

    print("  degree  strategy   unknowns  modes    computed   corrected    seconds    so far     MiB")
    lines = []
    for degree in arguments.degrees:
        for strategy in arguments.strategies:
            for line in measure(degree, strategy, arguments):
                show(line)
                lines.append(line)
    if arguments.plot and lines:
        plot(lines, arguments.plot)
    calculix()


if __name__ == "__main__":
    main()
