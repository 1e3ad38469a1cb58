#!/usr/bin/env python3
"""The pictures of doc/validation.md, into doc/images/validation:

    python3 tests/validation/pictures.py [--program build/release/squeal] [pins | band | td1 ...]

Growth rates of pins over the speed, and at both ends of the divergence band, beside the formulas; td-1's flutter mode by
ParaView. Needs matplotlib and ParaView (scripts/install-dependencies.sh --pictures).
"""

import argparse
import math
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
PROJECT = HERE.parents[1]
IMAGES = PROJECT / "doc/images/validation"
sys.path[:0] = [str(HERE), str(PROJECT / "tests/lib"), str(PROJECT / "scripts")]

import report  # noqa: E402
import validation  # noqa: E402
from validation import Pins  # noqa: E402


def draw(name, x_label, series, title):
    """Series: label, line style, x, y."""
    import plotting
    plt = plotting.load_pyplot(sys.exit)
    figure, axes = plt.subplots(figsize=(7, 4.2), constrained_layout=True)
    for label, style, x, y in series:
        axes.plot(x, y, style, label=label, markersize=6, fillstyle="none")
    axes.set(xlabel=x_label, ylabel="growth rate, 1/s", title=title)
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(IMAGES / f"{name}.png", dpi=110)


def pins(run):
    """n = 3, h = 6 mm: the quartic of the doublet, the limit of slow discs, and the program."""
    case = Pins(run, 0.006, 5e10).measure()
    fine = [0.05 * k for k in range(1, 521)]
    quartic = [max(l.real for l in case.roots(speed)) for speed in fine]
    slow = [case.n**2 * speed * case.friction * case.thickness / (2 * case.radius) for speed in fine]
    speeds = [0.5, 1, 1.5, 2, 3, 4, 6, 8, 11, 15, 20, 25]
    computed = []
    for speed in speeds:
        wave = max(case.roots(speed), key=lambda l: l.real)
        row = min(case.modes(Operation__Angular_velocity=speed),
                  key=lambda row: abs(2 * math.pi * row["frequency_hz"] - abs(wave.imag)))
        computed.append(row["growth_rate_1_per_s"])
    n_slow = sum(value <= 1.3 * max(quartic) for value in slow)
    draw("pins", "angular velocity, rad/s", [("the doublet's quartic", "-", fine, quartic),
                                             ("limit of slow discs", "--", fine[:n_slow], slow[:n_slow]),
                                             ("squeal", "o", speeds, computed)],
         "Pins on a disc of 6 mm, three nodal diameters, $\\mu$ = 0.4")


def band(run):
    """n = 3, h = 3 mm, stage transport: between its two critical speeds the doublet diverges. Rotary inertia, which the formula
    leaves out, moves both by some 2e-4."""
    case = Pins(run, 0.003, 6e9).measure()
    low, high = (math.sqrt(case.omega**2 + case.stiffness * (1 + sign * case.s)) / case.n for sign in (-1, 1))
    at = lambda part: low + part * (high - low)
    fine = [at(-0.2 + 1.4 * k / 700) for k in range(701)]
    formula = [max(l.real for l in case.roots(speed, 0)) for speed in fine]
    speeds = [at(part) for part in (-0.15, -0.05, 0.03, 0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 0.95, 1.08, 1.15)]
    computed = [max(0, validation.largest_growth(case.modes(Stage="transport", Operation__Angular_velocity=repr(speed))))
                for speed in speeds]
    draw("band", "angular velocity, rad/s",
         [("two equations of the doublet", "-", fine, formula), ("squeal", "o", speeds, computed)],
         "Pins on a disc of 3 mm beyond the critical speed: divergence")


def td1(run):
    import mesh_files
    import td1 as brake
    (run.directory / "td1.msh").write_text(mesh_files.msh2(brake.mesh()))
    rows = run("td1.prm", {"Output/Fields": "unstable"})
    flutter = max(rows, key=lambda row: row["growth_rate_1_per_s"])
    subprocess.run([*report.PARAVIEW, PROJECT / "scripts/render_mode.py", run.directory / str(run.n_runs), "--mode",
                    str(int(flutter["mode"])), "--output", IMAGES / "td1.png"], check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, help="default: $SQUEAL, else build/release/squeal")
    pictures = {"pins": pins, "band": band, "td1": td1}
    parser.add_argument("picture", nargs="*", choices=[[], *pictures], help="default: all")
    arguments = parser.parse_args()
    if arguments.program:
        os.environ["SQUEAL"] = str(arguments.program.resolve())
    import squeal_testing as st  # reads SQUEAL
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name in arguments.picture or pictures:
        pictures[name](validation.Runner(st))
        print(IMAGES / f"{name}.png")


if __name__ == "__main__":
    main()
