#!/usr/bin/env python3
"""A window far from zero against all modes below its upper end: processor seconds, accuracy, the same modes.

    high_window.py SQUEAL [--file FILE.prm] [--windows 10000:12000,...] [--set "Section/Key=value"]...

Each window is a pair of runs, one after the other on one machine, without fields: all modes up to the upper end, and the
window alone. "solver" is the sum of what the log lists for the eigen-solver: counting, factorisation, right and left
vectors; "phase" is the phase of the eigenproblem in cycles.csv (wall time: also the sums of the matrices, the mirror
halves and the causes of growth rates); "run" are the processor seconds of the whole run. "differ" is the largest relative difference of an
eigenvalue. --windows a:b,b:c splits: the sum of their seconds is listed at the end.
"""

import argparse
import os
import re
import subprocess
import tempfile
from pathlib import Path

from accuracy import read_csv

PROJECT = Path(__file__).resolve().parents[2]
PARTS = r"counting ([\d.]+), factorisation ([\d.]+), right vectors ([\d.]+), left vectors ([\d.]+)"


def run(arguments, lower, upper):
    with tempfile.TemporaryDirectory() as directory:
        settings = [f"Output/Directory={directory}", "Output/Fields=none", f"Eigenproblem/Maximum frequency={upper}",
                    f"Eigenproblem/Minimum frequency={lower}"]
        command = [arguments.squeal, arguments.file, *(a for s in arguments.set + settings for a in ("--set", s))]
        subprocess.run(command, check=True, capture_output=True,
                       env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
        parts = [float(value) for value in re.findall(PARTS, Path(directory, "log.txt").read_text())[-1]]
        modes, cycle = read_csv(f"{directory}/modes.csv"), read_csv(f"{directory}/cycles.csv")[-1]
    seconds = {"counting": parts[0], "factors": parts[1], "vectors": parts[2] + parts[3], "solver": sum(parts),
               "phase": float(cycle["seconds_eigenproblem"]), "run": float(cycle["processor_seconds"])}
    errors = max((float(m[key]) for m in modes for key in ("backward_error", "left_backward_error")), default=0)
    return cycle["dofs"], seconds, errors, eigenvalues(modes)


def eigenvalues(modes):
    return [complex(float(m["growth_rate_1_per_s"]), 6.283185307179586 * float(m["frequency_hz"])) for m in modes]


def line(name, n_modes, seconds, error, more=""):
    print(f"{name:24s} {n_modes:5d} " + " ".join(f"{value:8.2f}" for value in seconds.values()) + f" {error:9.1e} {more}",
          flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("--file", default=PROJECT / "prm/brake.prm")
    parser.add_argument("--windows", default="10000:12000")
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    windows = [tuple(float(end) for end in window.split(":")) for window in arguments.windows.split(",")]
    everything, total = {}, {}
    for lower, upper in windows:
        if upper not in everything:
            everything[upper] = run(arguments, 0, upper)
            dofs, seconds, error, all_modes = everything[upper]
            print(f"{dofs} unknowns{'':13s} modes " + " ".join(f"{name:>8s}" for name in seconds) + "     error   differ")
            line(f"all below {upper:g} Hz", len(all_modes), seconds, error)
        _, of_all, _, all_modes = everything[upper]
        _, seconds, error, modes = run(arguments, lower, upper)
        expected = [l for l in all_modes if lower * 6.283185307179586 <= l.imag]
        same = len(modes) == len(expected)
        differ = max((min(abs(l - m) for m in modes) / abs(l) for l in expected), default=0) if modes else 0
        line(f"{lower:g} to {upper:g} Hz", len(modes), seconds, error, f"{differ:8.1e}{'' if same else ', NOT THE SAME MODES'}")
        print(f"{'times faster':30s} " + " ".join(f"{of_all[name] / value if value else 0:8.2f}" for name, value in seconds.items()))
        total = {name: total.get(name, 0) + value for name, value in seconds.items()}
    if len(windows) > 1:
        print(f"{'all windows together':30s} " + " ".join(f"{value:8.2f}" for value in total.values()))


if __name__ == "__main__":
    main()
