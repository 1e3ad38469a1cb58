#!/usr/bin/env python3
"""How much an adaptive run saves against uniform refinement: all modes of T6 (reference.md) to 1e-4, degree 3.

    adaptive_gain.py [--target 1e-4] [--cells 13,90,3 --pad-cells 8,15,3]

Adaptive: the start mesh with clamp layers, refined until the error bars of all modes are within the target. Uniform: the
plain mesh without layers, as fine as the cells say: by default more than five times as many unknowns. If its error is
still above the target and it took more than three times the processor time, the adaptive run saves more than these
factors; how much more this does not tell. The uniform run goes without error bars, which it does not need.
"""

import argparse
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import error_statistics as es  # noqa: E402
import squeal_testing as st  # noqa: E402
import work_precision as wp  # noqa: E402


def run(settings):
    """(unknowns, modes, largest relative error, processor seconds of all meshes, MiB) of the last mesh."""
    with tempfile.TemporaryDirectory() as directory:
        file = pathlib.Path(directory) / "run.prm"
        file.write_text(st.parameter_file(es.settings("T6", **settings)))
        done = st.run(file.name, directory=directory, timeout=3600)
        if done.returncode != 0:
            sys.exit(done.stderr)
        results = pathlib.Path(directory) / "output/run"
        cycles, modes = st.read_table(results / "cycles.csv"), st.read_table(results / "modes.csv")
    reference = st.reference_eigenvalues(es.TABLES["T6"][0])
    rows = [row for row in modes if row["cycle"] == cycles[-1]["cycle"]]
    error, n_modes = wp.largest_error(rows, reference, st.eigenvalue)
    return (cycles[-1]["dofs"], n_modes, error, sum(cycle["processor_seconds"] for cycle in cycles),
            cycles[-1]["memory_mib"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--target", type=float, default=1e-4)
    parser.add_argument("--cells", default="13, 90, 3")
    parser.add_argument("--pad-cells", default="8, 15, 3")
    arguments = parser.parse_args()
    common = {"Discretization/Degree": 3}
    print("            unknowns  modes       error   processor s     MiB")
    results = []
    for name, settings in [
            ("adaptive", {**wp.STRATEGIES["adaptive"], **wp.START[3], "Refinement/Cycles": 3,
                          "Refinement/Tolerance": arguments.target, "Refinement/Maximum unknowns": 200000}),
            ("uniform", {"Discretization/Clamp layers": 0, "Discretization/Rotor cells": arguments.cells,
                         "Discretization/Pad cells": arguments.pad_cells, "Eigenproblem/Error bars": "false"})]:
        results.append(run({**common, **settings}))
        print("  {:8s} {:9.0f}  {:5d}   {:9.2e}   {:11.1f}  {:6.0f}".format(name, *results[-1]), flush=True)
    adaptive, uniform = results
    print(f"  uniform / adaptive: unknowns {uniform[0] / adaptive[0]:.1f}, error {uniform[2] / adaptive[2]:.1f}, "
          f"processor time {uniform[3] / adaptive[3]:.1f}")


if __name__ == "__main__":
    main()
