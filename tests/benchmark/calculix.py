#!/usr/bin/env python3
"""The rotor alone (T1, twenty modes) by CalculiX and by squeal: processor seconds for equal error.

    calculix.py [--program SQUEAL] [--cells 8,60,1 15,112,2 ...]

CalculiX computes with 20-node hexahedra of reduced integration (C3D20R) and its own eigen-solver; squeal with its defaults
for a rotor (degree 4, a thin layer of cells at the clamp's edges), without error bars and fields, on meshes from coarse to
fine. The error is the largest relative one of the twenty lowest frequencies against the reference. Below: for each mesh of
CalculiX the fastest run of squeal whose error is not larger, and how many times faster it is. All in one go on one core.
"""

import argparse
import math
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402
from accuracy import read_csv  # noqa: E402

N_MODES = 20
MESHES = [(3, "2,16,1", 0), (3, "3,20,1", 0), (3, "4,20,1", 0), (3, "4,24,1", 0), (3, "3,24,1", 1), (4, "2,16,1", 1),
          (4, "3,18,1", 1), (4, "4,24,1", 1)]


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


def timed(command, directory):
    """Processor seconds and what was printed."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True,
                          env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout + done.stderr


def largest_error(frequencies, reference):
    return max(abs(f - r) / r for f, r in zip(sorted(frequencies), reference))


def rotor_frequencies(cells):
    """By CalculiX: unknowns, the frequencies, processor seconds."""
    with tempfile.TemporaryDirectory() as directory:
        text, n_unknowns = calculix_input(*cells, N_MODES)
        (pathlib.Path(directory) / "rotor.inp").write_text(text)
        seconds, printed = timed(["ccx", "rotor"], directory)
        data = pathlib.Path(directory) / "rotor.dat"
        table = data.read_text() if data.exists() else ""
    # Mode, eigenvalue, omega, frequency in Hz, and a part that vanishes.
    found = [float(m[1]) for m in re.finditer(r"^\s+\d+\s+\S+E\S+\s+\S+E\S+\s+(\S+E\S+)\s+\S+E\S+\s*$", table,
                                              re.MULTILINE)][:N_MODES]
    if len(found) < N_MODES:
        sys.exit(f"CalculiX, {cells}: {len(found)} of {N_MODES} modes\n{printed[-1000:]}")
    return n_unknowns, found, seconds


def by_calculix(cells, reference):
    """Unknowns, error, processor seconds."""
    n_unknowns, found, seconds = rotor_frequencies(cells)
    return n_unknowns, largest_error(found, reference), seconds


def by_squeal(program, degree, cells, layers, reference):
    with tempfile.TemporaryDirectory() as directory:
        settings = [f"Discretization/Degree={degree}", f"Discretization/Rotor cells={cells}",
                    f"Discretization/Clamp layers={layers}", "Eigenproblem/Error bars=false", "Output/Fields=none",
                    "Eigenproblem/Maximum frequency=5600", f"Output/Directory={directory}"]
        seconds, printed = timed([program, st.PROJECT / "prm/rotor.prm", *(a for s in settings for a in ("--set", s))],
                                 directory)
        if not pathlib.Path(directory, "modes.csv").exists():
            sys.exit(printed[-1000:])
        modes, cycle = read_csv(f"{directory}/modes.csv"), read_csv(f"{directory}/cycles.csv")[-1]
    frequencies = sorted(float(mode["frequency_hz"]) for mode in modes)[:N_MODES]
    return int(cycle["dofs"]), largest_error(frequencies, reference), seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=st.PROJECT / "build/release/squeal")
    parser.add_argument("--cells", nargs="+", default=["10,72,2", "20,144,4"])
    arguments = parser.parse_args()
    if not shutil.which("ccx"):
        sys.exit("The program ccx is not installed (Debian: calculix-ccx).")
    reference = []
    for row in st.read_table(st.REFERENCE / "rotor_T1.csv"):
        reference += [row["frequency_hz"]] * int(row["multiplicity"])
    reference = sorted(reference)[:N_MODES]
    line = "{:24s} {:>9} {:>10.1e} {:>10.2f}"
    print(f"{'program and mesh':24s} {'unknowns':>9s} {'error':>10s} {'seconds':>10s}")
    others, own = {}, []
    for cells in arguments.cells:
        others[cells] = by_calculix(tuple(map(int, cells.split(","))), reference)
        print(line.format(f"CalculiX {cells}", *others[cells]), flush=True)
    for degree, cells, layers in MESHES:
        own.append((f"{cells}, degree {degree}, {layers} layers", *by_squeal(arguments.program, degree, cells, layers, reference)))
        print(line.format(*own[-1]), flush=True)
    for cells, (_, error, seconds) in others.items():
        good = [run for run in own if run[2] <= error]
        if good:
            best = min(good, key=lambda run: run[3])
            print(f"CalculiX {cells}: {error:.1e} in {seconds:.1f} s; squeal {best[0]}: {best[2]:.1e} in {best[3]:.2f} s, "
                  f"{seconds / best[3]:.1f} times faster")
        else:
            print(f"CalculiX {cells}: {error:.1e} in {seconds:.1f} s; squeal did not reach that error")


if __name__ == "__main__":
    main()
