#!/usr/bin/env python3
"""Error against unknowns, processor time and memory: the brake's modes of T6 (reference.md).

    work_precision.py [--degrees 1 2 3 4] [--strategies plain graded adaptive] [--cycles N] [--timeout 180]
                      [--maximum-unknowns N] [--maximum-memory GiB] [--target 1e-4] [--save FILE.json] [--load FILE.json]...
                      [--plot FILE.png]

Strategies: "plain" refines a mesh without clamp layers uniformly, "graded" one with the default layers; "adaptive" starts
with layers and refines what limits the modes. The error is the largest |l - l_ref|/|l_ref| of the modes that the mesh has
in the window, paired with the reference by assignment; "corrected" is the same of the eigenvalues with the estimated
error taken off. Processor seconds, estimates included, are those of one mesh, and those since the start of the run, which
is what adaptive refinement costs. Wall time says little on a machine that others use too.

Below the table stands what each strategy needs for the target: the first adaptive mesh that has reached it, and for
uniform refinement either the mesh that has, or an extrapolation by the rate between its last two meshes.

A run that takes longer than the timeout ends there; its finished meshes count. --save keeps the numbers, --load adds
those of earlier runs to the table and the picture. The rotor alone against CalculiX: calculix.py.
"""

import argparse
import json
import math
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import error_statistics as es  # noqa: E402
import squeal_testing as st  # noqa: E402

CYCLES = {1: 3, 2: 3, 3: 2, 4: 2}
# Higher degrees begin on coarser meshes.
COARSE = {4: {"Discretization/Rotor cells": "4, 24, 1", "Discretization/Pad cells": "2, 4, 1"}}
# Where adaptive refinement begins: what the layers at the clamp leave is spread over the ring, and cells that are
# refined in all directions are a dear way to more of them around.
START = {2: {"Discretization/Rotor cells": "5, 48, 1", "Discretization/Pad cells": "3, 8, 1", "Discretization/Clamp layers": 2},
         3: {"Discretization/Rotor cells": "6, 48, 1", "Discretization/Pad cells": "3, 8, 1", "Discretization/Clamp layers": 2},
         4: {"Discretization/Clamp layers": 2}}
STRATEGIES = {
    "plain": {"Refinement/Strategy": "uniform", "Discretization/Clamp layers": 0},
    "graded": {"Refinement/Strategy": "uniform"},
    "adaptive": {"Refinement/Strategy": "adaptive"},
}


def largest_error(rows, reference, value):
    """The largest relative error and the number of modes."""
    values = [value(row) for row in rows]
    partners = es.assign([[abs(l - r) ** 2 for r in reference] for l in values])
    errors = [abs(l - reference[j]) / abs(reference[j]) for l, j in zip(values, partners) if j is not None]
    return max(errors), len(errors)


def measure(degree, strategy, arguments):
    """One line of numbers for each mesh."""
    settings = es.settings("T6", **{
        "Refinement/Cycles": arguments.cycles or CYCLES[degree], "Refinement/Tolerance": arguments.target,
        "Refinement/Maximum unknowns": arguments.maximum_unknowns,
        "Refinement/Maximum memory": arguments.maximum_memory,
        "Discretization/Degree": degree, **COARSE.get(degree, {}), **STRATEGIES[strategy],
        **(START.get(degree, {}) if strategy == "adaptive" else {})})
    with tempfile.TemporaryDirectory() as directory:
        file = pathlib.Path(directory) / "run.prm"
        file.write_text(st.parameter_file(settings))
        try:
            done = st.run(file.name, directory=directory, timeout=arguments.timeout)
            if done.returncode != 0:  # out of memory, for example
                print(f"       {degree}  {strategy:9s} exit status {done.returncode}: later meshes are left out\n"
                      f"{done.stderr[-500:]}")
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
        so_far += cycle["processor_seconds"]
        lines.append({"degree": degree, "strategy": strategy, "unknowns": cycle["dofs"], "modes": n_modes,
                      "computed": computed, "corrected": better, "seconds": cycle["processor_seconds"],
                      "so far": so_far, "MiB": cycle["memory_mib"]})
    return lines


def show(line):
    print(f"  {line['degree']:6d}  {line['strategy']:9s} {line['unknowns']:9.0f}  {line['modes']:5d}   "
          f"{line['computed']:9.2e}   {line['corrected']:9.2e}   {line['seconds']:8.1f}  {line['so far']:8.1f}  "
          f"{line['MiB']:6.0f}", flush=True)


def rate(lines):
    """error ~ unknowns^-rate and seconds ~ unknowns^growth between the last two meshes."""
    before, last = lines[-2:]
    step = math.log(last["unknowns"] / before["unknowns"])
    return (math.log(before["computed"] / last["computed"]) / step,
            math.log(last["seconds"] / before["seconds"]) / step)


def needs(lines, target):
    """(unknowns, seconds, how they are known) for an error of the target; None if it cannot be said."""
    reached = [line for line in lines if line["computed"] <= target]
    if reached:
        first = reached[0]
        return first["unknowns"], first["so far" if first["strategy"] == "adaptive" else "seconds"], "measured"
    if len(lines) < 2 or lines[0]["strategy"] == "adaptive":
        return None
    slope, growth = rate(lines)
    if slope <= 0:
        return None
    factor, last = (lines[-1]["computed"] / target) ** (1 / slope), lines[-1]
    return (last["unknowns"] * factor, last["seconds"] * factor ** growth,
            f"EXTRAPOLATED from {last['computed']:.1e} at {last['unknowns']:.0f} unknowns by error ~ unknowns^-{slope:.2f}, "
            f"time ~ unknowns^{growth:.2f}")


def show_needs(lines, target):
    print(f"\nFor {target:.0e} in all modes:")
    for degree in sorted({line["degree"] for line in lines}):
        found = {}
        for strategy in STRATEGIES:
            own = [line for line in lines if (line["degree"], line["strategy"]) == (degree, strategy)]
            found[strategy] = needs(own, target) if own else None
            if own and not found[strategy]:
                print(f"  degree {degree}, {strategy}: not reached, {min(line['computed'] for line in own):.1e} at best")
            elif own:
                unknowns, seconds, how = found[strategy]
                print(f"  degree {degree}, {strategy}: {unknowns:.3g} unknowns, {seconds:.3g} processor s ({how})")
        for strategy in ["plain", "graded"]:
            if found.get("adaptive") and found.get(strategy):
                print(f"  degree {degree}, {strategy} / adaptive: {found[strategy][0] / found['adaptive'][0]:.1f} times the "
                      f"unknowns, {found[strategy][1] / found['adaptive'][1]:.1f} times the time")


def plot(lines, target, filename):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.8), sharey=True, layout="constrained")
    styles = {"plain": ":o", "graded": "--s", "adaptive": "-^"}
    for axis, key, label in zip(axes, ["unknowns", "time"], ["unknowns", "processor time so far, s, error bars included"]):
        for degree in sorted({line["degree"] for line in lines}):
            for strategy, style in styles.items():
                own = [line for line in lines if (line["degree"], line["strategy"]) == (degree, strategy)]
                if not own:
                    continue
                # Adaptive meshes need those before; a uniform one could be had at once.
                x = [line["so far" if strategy == "adaptive" else "seconds"] if key == "time" else line[key]
                     for line in own]
                axis.loglog(x, [line["computed"] for line in own], style, color=f"C{degree - 1}",
                            label=f"degree {degree}, {strategy}")
        axis.axhline(target, color="grey", linewidth=0.8)
        axis.set_xlabel(label)
        axis.grid(True, which="both", alpha=0.3)
    axes[0].set_ylabel("largest relative error of the eigenvalues of T6")
    axes[1].legend(fontsize=8, bbox_to_anchor=(1.02, 1), loc="upper left")
    figure.savefig(filename, dpi=130)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--degrees", nargs="+", type=int, choices=sorted(CYCLES), default=sorted(CYCLES))
    parser.add_argument("--strategies", nargs="*", choices=list(STRATEGIES), default=list(STRATEGIES))
    parser.add_argument("--cycles", type=int, default=0, help="meshes of each run; 0: by degree")
    parser.add_argument("--timeout", type=float, default=180)
    parser.add_argument("--maximum-unknowns", type=int, default=120000)
    parser.add_argument("--maximum-memory", type=float, default=0, metavar="GiB", help="0: no limit")
    parser.add_argument("--target", type=float, default=1e-4)
    parser.add_argument("--save", metavar="FILE.json")
    parser.add_argument("--load", metavar="FILE.json", nargs="+", default=[])
    parser.add_argument("--plot", metavar="FILE.png")
    arguments = parser.parse_args()

    print("  degree  strategy   unknowns  modes    computed   corrected    seconds    so far     MiB")
    lines = [line for file in arguments.load for line in json.loads(pathlib.Path(file).read_text())]
    for line in lines:
        show(line)
    for degree in arguments.degrees:
        for strategy in arguments.strategies:
            for line in measure(degree, strategy, arguments):
                show(line)
                lines.append(line)
    if arguments.save:
        pathlib.Path(arguments.save).write_text(json.dumps(lines, indent=1))
    if lines:
        show_needs(lines, arguments.target)
    if arguments.plot and lines:
        plot(lines, arguments.target, arguments.plot)


if __name__ == "__main__":
    main()
