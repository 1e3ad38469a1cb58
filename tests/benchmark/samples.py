"""What samples cost beside single runs: processor seconds, full solutions, peak memory, and what took the time.

    python3 tests/benchmark/samples.py [--numbers 1 | 8] [--samples N] [--tolerance T] [--check M] [parameter file]

One number: N friction coefficients from 0 to 0.6 in an order that jumps to and fro (default 200). Eight: friction, pressure,
Young's modulus, Poisson's ratio, damping and density of the pads, damping of the rotor and speed, N of Sobol's points (default
256, and a tolerance of 1e-7). Without error bars. With --check M of the samples, drawn at random, are run by themselves with a
tolerance of 1e-9: all modes there, growth rates within the samples' reduction errors? The default file is prm/brake.prm."""

import argparse
import random
import re
import tempfile
from pathlib import Path

from sweep import FRICTION, PROJECT, run, st

EIGHT = ("Contact/Friction/Coefficient uniform 0.3 0.6", "Pads/Pressure uniform 0.5e6 1.5e6",
         "Pads/Material/Young modulus uniform 8e9 12e9", "Pads/Material/Poisson ratio uniform 0.25 0.35",
         "Pads/Material/Stiffness proportional damping uniform 1e-6 3e-6",
         "Rotor/Material/Stiffness proportional damping uniform 0.5e-7 2e-7",
         "Operation/Angular velocity uniform 15 25", "Pads/Material/Density uniform 2000 3000")


def halving_order(n):
    """0, n - 1, then the middles of what lies between."""
    order, gaps = [0, n - 1], [(0, n - 1)]
    while gaps:
        inner = [(a, (a + b) // 2, b) for a, b in gaps if b - a > 1]
        order += [middle for _, middle, _ in inner]
        gaps = [gap for a, middle, b in inner for gap in ((a, middle), (middle, b))]
    return order


def check(file, samples, n, common):
    """Some of the samples by runs of their own. Branches have no frequencies in samples.csv: a sample's growth rates and those
    of its run are paired in their order, which no other pairing betters."""
    keys = [key for key in samples[0] if "/" in key]
    drawn = sorted(random.Random(1).sample(samples, min(n, len(samples))), key=lambda row: row["sample"])
    worst_of_bar, largest, others, beyond = 0, 0, 0, []
    for n_done, row in enumerate(drawn, 1):
        with tempfile.TemporaryDirectory() as directory:
            run(file, *(f"{key}={row[key]!r}" for key in keys), *common, directory=directory)
            alone = st.read_table(Path(directory, "modes.csv"))
        if len(alone) != row["modes"]:
            others += 1
            print(f"  sample {row['sample']:.0f}: {row['modes']:.0f} modes, {len(alone)} by itself", flush=True)
        same = min(alone, key=lambda mode: abs(mode["frequency_hz"] - row["frequency_hz"]))
        ratio = abs(same["growth_rate_1_per_s"] - row["growth_rate_1_per_s"]) / row["reduction_error_1_per_s"]
        worst_of_bar = max(worst_of_bar, ratio)
        if ratio > 1:
            beyond.append(row["sample"])
        branches = sorted(row[key] for key in row if key.startswith("growth_rate_of_branch") and row[key] is not None)
        if len(branches) == len(alone):
            rates = sorted(mode["growth_rate_1_per_s"] for mode in alone)
            largest = max(largest, max(abs(a - b) / max(1, abs(b)) for a, b in zip(branches, rates)))
        if n_done % 20 == 0:
            print(f"  {n_done} of {len(drawn)}: at most {worst_of_bar:.2g} of the reduction error", flush=True)
    print(f"{len(drawn)} samples by themselves: {others} with another number of modes; {len(beyond)} beyond the reduction error "
          f"{beyond}, at most {worst_of_bar:.2g} of it; largest change of any growth rate {largest:.2g} (in 1/s, above 1/s relative)")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--numbers", type=int, choices=(1, 8), default=1)
    parser.add_argument("--samples", type=int)
    parser.add_argument("--tolerance", type=float)
    parser.add_argument("--check", type=int, default=0)
    parser.add_argument("file", nargs="?", default=PROJECT / "prm/brake.prm")
    arguments = parser.parse_args()
    n = arguments.samples or (200 if arguments.numbers == 1 else 256)
    tolerance = arguments.tolerance or (1e-9 if arguments.numbers == 1 else 1e-7)
    common = ["Eigenproblem/Error bars=false", f"Eigenproblem/Tolerance={tolerance}"]
    single, memory, _ = run(arguments.file, f"{FRICTION}=0.6", *common)
    print(f"one run: {single:.1f} processor seconds, {memory} MiB")
    with tempfile.TemporaryDirectory() as directory:
        if arguments.numbers == 1:
            samples = Path(directory, "samples.csv")
            samples.write_text("\n".join([FRICTION, *(repr(0.6 * k / (n - 1)) for k in halving_order(n))]) + "\n")
            sampling = [f"Sampling/File={samples}"]
        else:
            sampling = [f"Sampling/Parameters={'; '.join(EIGHT)}", f"Sampling/Samples={n}"]
        results = Path(directory, "results")
        seconds, memory, log = run(arguments.file, *sampling, *common, directory=results)
        samples = st.read_table(results / "samples.csv")
    full = re.search(r"(\d+) full solutions", log)[1]
    phases = re.search(r"Processor seconds: (.*)\.", log)[1]
    print(f"{n} samples of {arguments.numbers}: {seconds:.1f} processor seconds, {seconds / single:.1f} single runs, "
          f"{full} full solutions, {memory} MiB: {phases}", flush=True)
    if arguments.check:
        check(arguments.file, samples, arguments.check, ["Eigenproblem/Error bars=false", "Eigenproblem/Tolerance=1e-9"])


if __name__ == "__main__":
    main()
