"""What a frequency response costs beside direct solutions, and how good it is: processor seconds, factorisations, the
difference from direct solutions at some of the frequencies beside the printed error.

    python3 tests/benchmark/response.py [parameter file] [degree ...]

The default is prm/brake.prm with degrees 2 and 3; 300 frequencies from 100 Hz to 98 % of its highest. Seconds of direct
solutions are those of six frequencies times 50: neighbours that share factors are among them only if they are as near."""

import argparse
import csv
import re
import tempfile
from pathlib import Path

from sweep import PROJECT, run

FORCES = "Response/Forces=rotor 0.14 0 0 : 0 0 1, upper_pad.back : 0 0 1"


def response(file, degree, directory, *settings):
    seconds, memory, log = run(file, f"Discretization/Degree={degree}", FORCES, "Eigenproblem/Error bars=false", *settings,
                               directory=directory)
    with open(Path(directory) / "response.csv", newline="", encoding="utf-8") as table:
        rows = {(row["frequency_hz"], row["force"], row["observation"]):
                (complex(float(row["real_m"]), float(row["imaginary_m"])), float(row["interpolation_error_m"]))
                for row in csv.DictReader(table)}
    counts = re.search(r"(\d+) direct solutions with (\d+) fact", log)
    return seconds, memory, rows, counts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", default=PROJECT / "prm/brake.prm")
    parser.add_argument("degrees", nargs="*", type=int)
    arguments = parser.parse_args()
    file = arguments.file
    highest = float(re.search(r"Maximum frequency\s*=\s*(\S+)", Path(file).read_text())[1])
    print("degree   unknowns   modes alone s   modal s   direct (estimated) s   solutions   factors   MiB   "
          "largest difference/mean   largest difference/error")
    for degree in arguments.degrees or (2, 3):
        with tempfile.TemporaryDirectory() as directory:
            alone, _, log = run(file, f"Discretization/Degree={degree}", "Eigenproblem/Error bars=false")
            unknowns = sum(map(int, re.search(r"(\d+) displacements, (\d+) contact", log).groups()))
            modal, memory, values, counts = response(file, degree, directory, f"Response/Frequencies=100 : {0.98 * highest} : 300")
            some = sorted({key[0] for key in values}, key=float)[20::50]
            direct, _, exact, _ = response(file, degree, directory, "Response/Frequencies=" + ", ".join(some),
                                           "Response/Method=direct")
        relative = ratio = 0
        for key, (value, _) in exact.items():
            difference, error = abs(value - values[key][0]), values[key][1]
            mean = sum(abs(other) for (_, *pair), (other, _) in exact.items() if tuple(pair) == key[1:]) / len(some)
            relative, ratio = max(relative, difference / mean), max(ratio, difference / error)
        print(f"{degree:6}   {unknowns:8}   {alone:13.1f}   {modal:7.1f}   {(direct - alone) / len(some) * 300:20.0f}   "
              f"{counts[1]:>9}   {counts[2]:>7}   {memory:5}   {relative:23.1e}   {ratio:24.2g}", flush=True)


if __name__ == "__main__":
    main()
