#!/usr/bin/env python3
"""Draw the eigenvalues of a run of squeal in the complex plane.

    scripts/plot.py OUTPUT_DIR [--output FILE.png] [--scale auto|linear|symlog]

Reads OUTPUT_DIR/modes.csv and, for the title, parameters.prm and cycles.csv.
Needs matplotlib (Debian: apt-get install python3-matplotlib).
"""

import argparse
import csv
import math
import os

from plotting import load_pyplot, open_text, refuse_foreign, save_figure, stop

GROWTH, FREQUENCY = "growth_rate_1_per_s", "frequency_hz"
GROWTH_ERROR, FREQUENCY_ERROR = "growth_rate_error_1_per_s", "frequency_error_hz"

# Colours of Okabe and Ito, told apart with any colour vision; the shapes differ, too.
STYLES = {  # verdict: (colour, marker, size)
    "stable": ("#0072B2", "o", 48),
    "flutter": ("#D55E00", "D", 90),
    "divergence": ("#D55E00", "s", 90),
    "marginal": ("#E69F00", "^", 70),
    "undecided": ("#E69F00", "v", 70),
}
UNSTABLE = ("flutter", "divergence")


def fail(message):
    stop("plot.py: " + message)


def read_modes(directory):
    """The lines of modes.csv as dictionaries; empty fields become None."""
    path = os.path.join(directory, "modes.csv")
    if not os.path.isdir(directory):
        fail(f"there is no directory {directory}; give the output directory of a run, e.g. output/brake")
    if not os.path.isfile(path):
        fail(f"{path} is missing; has the run finished a mesh? (A sweep writes sweep.csv instead.)")
    with open_text(path) as file:
        reader = csv.DictReader(file)
        header = reader.fieldnames or []
        missing = [name for name in ("cycle", GROWTH, FREQUENCY, "verdict") if name not in header]
        if missing:
            fail(f"{path} has no column {', '.join(missing)}; its header is: {','.join(header) or '(empty)'}")
        modes = []
        for line in reader:
            mode = {"verdict": line["verdict"] or "undecided"}
            for name in ("cycle", GROWTH, FREQUENCY, GROWTH_ERROR, FREQUENCY_ERROR):
                try:
                    mode[name] = float(line[name]) if line.get(name) else None
                except ValueError:
                    fail(f"{path}, line {reader.line_num}: column {name} holds '{line[name]}', not a number")
            if None not in (mode["cycle"], mode[GROWTH], mode[FREQUENCY]):
                modes.append(mode)
    if not modes:
        fail(f"{path} holds no modes: nothing to draw")
    return modes


def read_parameters(directory):
    """parameters.prm as {"Section/Key": "value"}; empty if there is no such file."""
    parameters, section = {}, []
    try:
        with open_text(os.path.join(directory, "parameters.prm")) as file:
            for line in file:
                words = line.split("#")[0].split()
                if words[:1] == ["subsection"]:
                    section.append(" ".join(words[1:]))
                elif words == ["end"] and section:
                    section.pop()
                elif words[:1] == ["set"] and "=" in words:
                    equal = words.index("=")
                    parameters["/".join(section + [" ".join(words[1:equal])])] = " ".join(words[equal + 1:])
    except OSError:
        pass
    return parameters


def title(directory, modes):
    """What was run (first line) and what came out of it (second line)."""
    parameters = read_parameters(directory)
    scene = parameters.get("Scene", "")
    stage = parameters.get("Stage", "")
    words = [f"Scene {scene}, stage {stage}" if scene else os.path.basename(os.path.abspath(directory))]
    if scene and scene != "matrices":
        speed, mu = parameters.get("Operation/Angular velocity"), parameters.get("Contact/Friction/Coefficient")
        if mu and stage not in ("elastic", "transport"):
            if parameters.get("Contact/Friction/Law") == "falling":
                mu += f" falling to {parameters.get('Contact/Friction/Coefficient at speed', '?')}"
            words.append(f"$\\mu$ = {mu}")
        if speed and stage != "elastic":
            words.append(f"belt speed {speed} m/s" if scene == "strip" else f"$\\Omega$ = {speed} rad/s")

    result = [f"{len(modes)} modes" if len(modes) != 1 else "1 mode"]
    result.append(f"{sum(mode['verdict'] in UNSTABLE for mode in modes)} unstable")
    try:
        with open_text(os.path.join(directory, "cycles.csv")) as file:
            unknowns = int(list(csv.DictReader(file))[-1]["dofs"])
            result.append(f"{unknowns:,} unknowns".replace(",", "\u202f"))
    except (OSError, IndexError, KeyError, TypeError, ValueError):
        pass
    return ", ".join(words), ", ".join(result)


def draw_modes(axes, modes, strong):
    """Points of one mesh, one set per verdict for the legend."""
    for verdict, (colour, marker, size) in STYLES.items():
        chosen = [mode for mode in modes if mode["verdict"] == verdict]
        if not chosen:
            continue
        axes.scatter([mode[GROWTH] for mode in chosen],
                     [mode[FREQUENCY] for mode in chosen],
                     s=size if strong else 0.4 * size,
                     marker=marker,
                     facecolors=colour if strong else "none",
                     edgecolors="white" if strong else colour,
                     linewidths=0.8,
                     alpha=1 if strong else 0.4,
                     zorder=4 if strong else 3,
                     label=f"{verdict} ({len(chosen)})" if strong else None)


def draw_bars(axes, modes):
    """Error bars, once the axes have their limits; above the points, since those of a fine mesh are shorter than its points
    are wide. What leaves the picture on one side ends there with an arrow. What leaves it on both sides would only draw a
    grid: returns the number of these modes."""
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    n_beyond = 0
    for mode in modes:
        if None in (mode[GROWTH_ERROR], mode[FREQUENCY_ERROR]):
            continue
        growth, frequency = mode[GROWTH], mode[FREQUENCY]
        first, last = growth - abs(mode[GROWTH_ERROR]), growth + abs(mode[GROWTH_ERROR])
        low, high = frequency - abs(mode[FREQUENCY_ERROR]), frequency + abs(mode[FREQUENCY_ERROR])
        if first < left and last > right:
            n_beyond += 1
            continue
        look = {"color": "0.2", "linewidth": 0.9, "zorder": 4.5, "markersize": 5, "clip_on": False}
        axes.plot([max(first, left), min(last, right)], [frequency] * 2, **look)
        for end, inside, edge, arrow in ((first, first >= left, left, "<"), (last, last <= right, right, ">")):
            axes.plot([end if inside else edge], [frequency], marker="|" if inside else arrow, **look)
        axes.plot([growth] * 2, [max(low, bottom), min(high, top)], **look)
    return n_beyond


def label_unstable(axes, modes):
    """Frequency and growth rate right of the axes, moved apart where the labels would overlap."""
    unstable = sorted((mode for mode in modes if mode["verdict"] in UNSTABLE), key=lambda mode: mode[FREQUENCY])
    bottom, top = axes.get_ylim()
    distance = min(0.06, 1 / max(1, len(unstable))) * (top - bottom)
    heights = [mode[FREQUENCY] for mode in unstable]
    for _ in range(200):
        for i in range(1, len(heights)):
            overlap = distance - (heights[i] - heights[i - 1])
            if overlap > 0:
                heights[i - 1] -= overlap / 2
                heights[i] += overlap / 2
        heights = [min(max(height, bottom + distance / 2), top) for height in heights]
    for mode, height in zip(unstable, heights):
        growth = f"{mode[GROWTH]:+#.3g}".rstrip(".")
        axes.annotate(f"{mode[FREQUENCY]:.0f} Hz, {growth} 1/s",
                      xy=(mode[GROWTH], mode[FREQUENCY]),
                      xytext=(1.03, height),
                      textcoords=axes.get_yaxis_transform(),
                      va="center",
                      color="#A34700",
                      fontweight="bold",
                      annotation_clip=False,
                      zorder=3.2,
                      arrowprops={"arrowstyle": "-", "color": "#D55E00", "linewidth": 0.8,
                                  "shrinkA": 1, "shrinkB": 6, "relpos": (0, 0.5)})


def rounded_up(value):
    """The next of ..., 10, 20, 50, 100, ... that is not smaller."""
    power = 10 ** math.floor(math.log10(value))
    return next(power * digit for digit in (1, 2, 5, 10) if power * digit >= 0.999 * value)


def scale_growth_rates(axes, growth, scale):
    """A growth rate of a few 1/s matters, yet is invisible beside damping of hundreds: logarithmic beyond 10."""
    lowest, highest = min(0, *growth), max(0, *growth)
    if scale == "symlog" or (scale == "auto" and max(-lowest, highest) > 100):
        axes.set_xscale("symlog", linthresh=10, linscale=0.8)
        axes.set_xlim(-rounded_up(max(20, -1.3 * lowest)), rounded_up(max(20, 1.5 * highest)))
        left, right = axes.get_xlim()
        powers = [10 ** n for n in range(1, 16)]
        ticks = [-x for x in powers if -x >= left] + [0] + [x for x in powers if x <= right]
        axes.set_xticks(ticks, [f"{x:.0f}".replace("-", "\N{MINUS SIGN}") for x in ticks])
        axes.set_xlabel(r"growth rate Re $\lambda$, 1/s  (linear within $\pm$10, logarithmic beyond)")
    else:
        margin = 0.08 * (highest - lowest or 1)
        axes.set_xlim(lowest - margin, highest + 2 * margin)
        axes.set_xlabel(r"growth rate Re $\lambda$, 1/s")


def draw(plt, directory, modes, scale):
    for mode in modes:
        if mode["verdict"] not in STYLES:
            mode["verdict"] = "undecided"
    cycles = sorted({mode["cycle"] for mode in modes})
    final = [mode for mode in modes if mode["cycle"] == cycles[-1]]

    plt.rcParams.update({"font.size": 11, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(figsize=(8, 4.8))
    labelled = any(mode["verdict"] in UNSTABLE for mode in final)
    figure.subplots_adjust(left=0.1, right=0.755 if labelled else 0.97, bottom=0.12, top=0.82)
    for cycle in cycles[:-1]:
        draw_modes(axes, [mode for mode in modes if mode["cycle"] == cycle], strong=False)
    draw_modes(axes, final, strong=True)
    if len(cycles) > 1:
        axes.scatter([], [], s=20, marker="o", facecolors="none", edgecolors="0.6", label="coarser meshes")

    scale_growth_rates(axes, [mode[GROWTH] for mode in modes], scale)
    axes.set_ylim(-0.03 * max(mode[FREQUENCY] for mode in modes) if min(mode[FREQUENCY] for mode in modes) <= 0 else 0,
                  1.12 * max([1] + [mode[FREQUENCY] for mode in modes]))
    n_beyond = draw_bars(axes, final)
    axes.set_ylabel(r"frequency |Im $\lambda$| / 2$\pi$, Hz")
    axes.axvline(0, color="black", linewidth=1.2, zorder=2)
    axes.axvspan(0, axes.get_xlim()[1], color="#D55E00", alpha=0.09, linewidth=0, zorder=0)
    axes.text(0.99, 0.98, "unstable", transform=axes.transAxes, ha="right", va="top", color="#A34700", style="italic")
    axes.grid(color="0.9", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.005), ncol=6, frameon=False, borderaxespad=0,
                handletextpad=0, columnspacing=1)
    label_unstable(axes, final)

    first, second = title(directory, final)
    figure.text(0.1, 0.95, first, fontsize=13 if len(first) < 65 else 11, fontweight="bold")
    if n_beyond:
        second += f"; bars of {n_beyond} are longer than the picture"
    figure.text(0.1, 0.9, second, color="0.3")
    return figure


def main():
    parser = argparse.ArgumentParser(description="Draw the eigenvalues of a run in the complex plane.")
    parser.add_argument("directory", metavar="OUTPUT_DIR", help="output directory of a run, e.g. output/brake")
    parser.add_argument("--output", metavar="FILE.png", help="default: OUTPUT_DIR/eigenvalues.png")
    parser.add_argument("--scale", choices=("auto", "linear", "symlog"), default="auto",
                        help="axis of growth rates; auto: symlog if one exceeds 100 1/s")
    arguments = parser.parse_args()
    modes = read_modes(arguments.directory)
    output = arguments.output or os.path.join(arguments.directory, "eigenvalues.png")
    refuse_foreign(output, arguments.output, fail)
    plt = load_pyplot(fail)
    save_figure(draw(plt, arguments.directory, modes, arguments.scale), output, arguments.output, fail, dpi=200)
    print(output)


if __name__ == "__main__":
    main()
