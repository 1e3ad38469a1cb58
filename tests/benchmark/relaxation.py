#!/usr/bin/env python3
"""Moduli that depend on the frequency: accuracy and cost of the exact modes.

    relaxation.py [--program SQUEAL] [--only brakes|sandwich|cost]

brakes: tables T10 (loss factors) and T11 (Prony series) of the independent method, on the mesh of
tests/run/test_brake_reference.py: largest relative error of a frequency, and of a growth rate relative to the largest growth
rate, with T6 (Rayleigh damping) beside them, and the error bars. sandwich: the sandwich beams of NLEVP (../shared/data/nlevp). cost: prm/brake.prm with
Rayleigh damping, with a loss factor, a Prony series or viscosities of the pads, and with measured ratios: processor seconds
beside each other.
"""

import argparse
import math
import pathlib
import sys
import time

import runs

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "run"))

import error_statistics as es  # noqa: E402
import nlevp  # noqa: E402
import squeal_testing as st  # noqa: E402
import test_relaxation as relaxation  # noqa: E402


class Runner(st.TestCase):
    """Makes the temporary directory of a test."""

    def runTest(self):
        pass


def solve(settings, program):
    """Lines of modes.csv and of cycles.csv's only mesh, if there is one, and seconds on the clock."""
    runner = Runner()
    runner.setUp()
    start = time.monotonic()
    results = runner.analyse(settings, executable=program, timeout=3600)
    seconds = time.monotonic() - start
    modes, cycles = st.read_table(results / "modes.csv"), results / "cycles.csv"
    cycle = st.read_table(cycles)[-1] if cycles.exists() else {}
    runner.doCleanups()
    return modes, cycle, seconds


def brakes(program):
    print(f"{'table':5s} {'modes':>5s} {'of':>3s} {'frequency':>10s} {'growth':>8s} {'backward':>9s} {'CPU s':>7s}")
    comparisons = []
    for name in ["T6", "T10", "T11"]:
        table, settings = es.TABLES[name]
        modes, cycle, _ = solve({**st.REFERENCE_BRAKE, **relaxation.MESH, **st.PENALTY, **settings}, program)
        expected = st.reference_eigenvalues(table)
        frequency, growth = relaxation.errors([st.eigenvalue(mode) for mode in modes], expected)
        comparisons += es.compare(name, modes)
        print(f"{name:5s} {len(modes):5d} {len(expected):3d} {frequency:10.1e} {growth:8.1e} "
              f"{max(mode['backward_error'] for mode in modes):9.1e} {cycle['processor_seconds']:7.1f}", flush=True)
    print(es.table(comparisons))


def sandwich(program):
    print(f"{'N':>5s} {'modes':>5s} {'largest error':>14s} {'backward':>9s} {'s':>6s}")
    for n in [168, 840, 3360]:
        modes, _, seconds = solve(nlevp.sandwich_beam(n), program)
        expected = nlevp.SANDWICH_EIGENVALUES[n]
        pairs = Runner().pairs([st.eigenvalue(mode) for mode in modes], [1j * w for w in expected])
        error = max(abs(a - b) / abs(b) for a, b in pairs)
        print(f"{n:5d} {len(modes):5d} {error:14.1e} {max(mode['backward_error'] for mode in modes):9.1e} {seconds:6.1f}")


def cost(program):
    print(f"{'damping':22s} {'modes':>5s} {'backward':>9s} {'CPU s':>7s} {'ratio':>6s}")
    first = None
    off = {f"{body}/Material/Stiffness proportional damping": 0 for body in ["Rotor", "Pads"]}
    for name, settings in {"Rayleigh": {},
                           "loss factor of pads": {**off, "Rotor/Material/Stiffness proportional damping": 1e-7,
                                                   "Pads/Material/Loss factor": 0.06},
                           "Prony series of pads": {**off, "Rotor/Material/Stiffness proportional damping": 1e-7,
                                                    "Pads/Material/Prony series": es.PRONY_T11},
                           "viscosities of pads": {**off, "Rotor/Material/Stiffness proportional damping": 1e-7,
                                                   "Pads/Material/Bulk viscosity": 1.6e4, "Pads/Material/Shear viscosity": 8e3},
                           "measured ratios": {**off, "Modal damping/Ratios": "500 : 0.002, 6000 : 0.01"}}.items():
        brake = {"Discretization/Degree": 3, "Output/Fields": "none", "Eigenproblem/Error bars": "false"}
        modes, cycle, _ = solve({**brake, **settings}, program)
        seconds = cycle["processor_seconds"]
        first = first or seconds
        print(f"{name:22s} {len(modes):5d} {max(mode['backward_error'] for mode in modes):9.1e} {seconds:7.1f} "
              f"{seconds / first:6.2f}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=runs.PROGRAM)
    parser.add_argument("--only", choices=["brakes", "sandwich", "cost"])
    arguments = parser.parse_args()
    for name, measure in {"brakes": brakes, "sandwich": sandwich, "cost": cost}.items():
        if arguments.only in (None, name):
            measure(arguments.program)


if __name__ == "__main__":
    main()
