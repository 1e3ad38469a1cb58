#!/usr/bin/env python3
"""Error bars of the default brake, whose pads lift off at one end, against a mesh with fine pads.

    lift_off.py [--reference FILE.csv]

Meshes of degree 2 and 3, refined adaptively, below 4 kHz; the reference has degree 3 and pads of 12 x 24 cells and takes
some minutes. Its modes.csv can be kept and given the next time. The edge of the contact zone moves its growth rates by
some 0.05 1/s, too: that is the accuracy with which errors of growth rates are known.
"""

import argparse
import pathlib
import shutil
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import error_statistics as es  # noqa: E402
import squeal_testing as st  # noqa: E402

ACCURACY = 0.05  # 1/s


def run(directory, name, **settings):
    arguments = [part for key, value in settings.items() for part in ("--set", f"{key}={value}")]
    done = st.run(st.PROJECT / "prm/brake.prm", *arguments, "--set", "Output/Fields=none",
                  "--set", "Eigenproblem/Maximum frequency=4000", "--set", f"Output/Directory={name}",
                  directory=directory, timeout=3600)
    if done.returncode != 0:
        sys.exit(f"exit status {done.returncode}\n{done.stdout[-2000:]}{done.stderr}")
    results = pathlib.Path(directory) / name
    return st.read_table(results / "modes.csv"), st.read_table(results / "cycles.csv"), results


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--reference", type=pathlib.Path)
    file = parser.parse_args().reference
    with tempfile.TemporaryDirectory() as directory:
        if file and file.exists():
            reference = st.read_table(file)
        else:
            reference, cycles, results = run(directory, "reference", **{"Discretization/Pad cells": "12, 24, 1"})
            print(f"reference: {cycles[-1]['dofs']:.0f} unknowns, {cycles[-1]['seconds_total']:.0f} s", flush=True)
            if file:
                shutil.copy(results / "modes.csv", file)
        values = [st.eigenvalue(row) for row in reference]
        print("degree  mesh  unknowns  modes   frequency: covered  median   growth rate: covered  median  largest error"
              "  undecided")
        for degree, cycles in ((2, 4), (3, 2)):
            rows, meshes, _ = run(directory, f"degree{degree}", **{
                "Discretization/Degree": degree, "Refinement/Strategy": "adaptive", "Refinement/Cycles": cycles,
                "Refinement/Tolerance": 1e-9, "Refinement/Maximum unknowns": 120000})
            for mesh in meshes:
                modes = [row for row in rows if row["cycle"] == mesh["cycle"]]
                found = [es.KnownTo("lift-off", int(mesh["cycle"]), row, values[j], complex(ACCURACY, 0))
                         for row, j in es.pair(modes, values)]
                s = es.statistics(found)
                print(f"{degree:6d} {mesh['cycle']:5.0f} {mesh['dofs']:9.0f} {s.modes:6d} "
                      f"{s.covered['frequency']:20d} {s.median['frequency']:7.1f} "
                      f"{s.covered['growth']:22d} {s.median['growth']:7.1f} "
                      f"{max(c.growth_error for c in found):14.2f} {s.undecided:10d}", flush=True)


if __name__ == "__main__":
    main()
