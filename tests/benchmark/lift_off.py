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
                partners = es.assign([[abs(es.corrected(row) - value) ** 2 for value in values] for row in modes])
                pairs = [(row, values[j]) for row, j in zip(modes, partners) if j is not None]
                frequency = [(row["frequency_error_hz"], abs(st.eigenvalue(row).imag - value.imag) / 6.283185307179586)
                             for row, value in pairs]
                growth = [(row["growth_rate_error_1_per_s"], abs(st.eigenvalue(row).real - value.real))
                          for row, value in pairs]
                median = lambda ratios: sorted(ratios)[len(ratios) // 2]
                print(f"{degree:6d} {mesh['cycle']:5.0f} {mesh['dofs']:9.0f} {len(pairs):6d} "
                      f"{sum(bar >= error for bar, error in frequency):20d} "
                      f"{median([bar / error for bar, error in frequency]):7.1f} "
                      f"{sum(bar + ACCURACY >= error for bar, error in growth):22d} "
                      f"{median([bar / max(error, ACCURACY) for bar, error in growth]):7.1f} "
                      f"{max(error for _, error in growth):14.2f} "
                      f"{sum(row['verdict'] == 'undecided' for row, _ in pairs):10d}", flush=True)


if __name__ == "__main__":
    main()
