#!/usr/bin/env python3
"""Draw the root loci of the scenes in prm/theory, after Figs. 5 to 10 of the paper.

    scripts/root_locus.py [--program FILE] [--results DIR] [--images DIR] [--rerun]

Runs each parameter file of prm/theory (a second each, maps longer) unless its results in DIR (output/theory) are newer than
the file and its matrices. Reads sweep.csv and critical.csv, of maps what stability_map.py reads, writes PNG files to
doc/images/theory.
Captions: doc/theory_effects.md. Needs matplotlib (Debian: apt-get install python3-matplotlib).
"""

import argparse
import csv
import io
import math
import os
import pathlib
import subprocess
import sys

import stability_map
from plotting import load_pyplot

PROJECT = pathlib.Path(__file__).resolve().parent.parent
THEORY = PROJECT / "prm/theory"

# Colours of Okabe and Ito, told apart with any colour vision; line styles and markers differ, too.
BLUE, RED, GREEN, GREY, BLACK = "#0072B2", "#D55E00", "#009E73", "#999999", "#000000"
CRITICAL_STYLES = {  # kind: (marker, size, colour, what it is)
    "coalescence": ("D", 8, BLACK, "coalescence"),
    "onset": ("^", 9, RED, "onset of flutter"),
    "end": ("v", 9, GREEN, "end of flutter"),
}


def fail(message):
    sys.exit("root_locus.py: " + message)


class Scene:
    """The results of one parameter file: branches {number: [(p, l)]}, critical values [(kind, p, l, branches)]."""

    def __init__(self, directory):
        self.branches, self.critical = {}, []
        for row in self.read(directory / "sweep.csv", "parameter", "branch"):
            self.branches.setdefault(row["branch"], []).append((float(row["parameter"]), self.eigenvalue(row)))
        for row in self.read(directory / "critical.csv", "kind", "value", "branch", "other_branch"):
            involved = [branch for branch in (row["branch"], row["other_branch"]) if branch]
            self.critical.append((row["kind"], float(row["value"]), self.eigenvalue(row), involved))
        if not self.branches:
            fail(f"{directory / 'sweep.csv'} holds no modes: nothing to draw. Run it anew with --rerun.")
        # A square root is steep at its end: the curve must pass through the critical point itself.
        for _, value, l, involved in self.critical:
            for branch in involved:
                self.branches[branch] = sorted(self.branches[branch] + [(value, l)], key=lambda point: point[0])

    @staticmethod
    def eigenvalue(row):
        return complex(float(row["growth_rate_1_per_s"]), 2 * math.pi * float(row["frequency_hz"]))

    @staticmethod
    def read(path, *columns):
        try:
            with open(path, newline="", encoding="utf-8") as file:
                reader = csv.DictReader(file)
                missing = [name for name in (*columns, "growth_rate_1_per_s", "frequency_hz")
                           if name not in (reader.fieldnames or [])]
                if missing:
                    fail(f"{path} has no column {', '.join(missing)}. Run it anew with --rerun.")
                return list(reader)
        except OSError as error:
            fail(f"{path} cannot be read ({error.strerror}). Run it anew with --rerun.")

    def curves(self, x, y):
        """For each branch the lists of x(p, l) and y(p, l)."""
        return [([x(*point) for point in points], [y(*point) for point in points])
                for points in self.branches.values()]


def p_of(p, _):
    return p


def growth(_, l):
    return l.real


def circular(_, l):
    return l.imag


def is_map(file):
    return "Second parameter" in file.read_text()


def results(file, arguments):
    """The directory of results of a parameter file; runs the program where they are missing or old."""
    directory = arguments.results / file.stem
    tables = [directory / name for name in (("map.csv", "border.csv") if is_map(file) else ("sweep.csv", "critical.csv"))]
    inputs = [file, *THEORY.glob("*.mtx")]
    if (not arguments.rerun and all(table.is_file() for table in tables)
            and min(os.path.getmtime(table) for table in tables) >= max(os.path.getmtime(name) for name in inputs)):
        return directory
    if not (arguments.program.is_file() and os.access(arguments.program, os.X_OK)):
        fail(f"there are no recent results in {directory}, and the program {arguments.program} is missing.\n"
             "Build it (./scripts/build.sh), or name it: --program FILE.")
    print(f"running {file.name}")
    run = subprocess.run([arguments.program, file, "--set", f"Output/Directory={directory}", "--overwrite"],
                         cwd=PROJECT,
                         env={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **os.environ},
                         stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if run.returncode != 0:
        fail(f"{file.name} failed with exit status {run.returncode}:\n{run.stdout[-2000:]}")
    return directory


def draw(axes, scene, x, y, label=None, **style):
    style = {"linewidth": 1.8, **style}
    for k, (xs, ys) in enumerate(scene.curves(x, y)):
        axes.plot(xs, ys, label=label if k == 0 else None, **style)


def mark(axes, scene, x, y, labelled=True):
    """Marks the critical values; each kind comes into the legend once."""
    known = axes.get_legend_handles_labels()[1]
    for kind, p, l, _ in scene.critical:
        marker, size, colour, what = CRITICAL_STYLES[kind]
        axes.plot([x(p, l)], [y(p, l)], linestyle="none", marker=marker, markersize=size, color=colour,
                  markeredgecolor="white", zorder=5, label=what if labelled and what not in known else None)
        known = [*known, what]


def plane(axes, title, unit="1/s"):
    """Axes of the complex plane."""
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(f"growth rate Re λ, {unit}")
    axes.set_ylabel(f"circular frequency Im λ, {unit}")
    axes.axvline(0, color=BLACK, linewidth=0.8, zorder=1)
    axes.grid(True, linewidth=0.4, alpha=0.6)


def over_p(axes, title, ylabel, xlabel="load parameter p, –"):
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    axes.grid(True, linewidth=0.4, alpha=0.6)


def vertical(axes, p, name=None, height=0.9, side="left"):
    """A dotted line at a critical value. Name and number stand at this height, their `side` end at the line."""
    axes.axvline(p, color=BLACK, linewidth=0.9, linestyle=":", zorder=1)
    if name:
        axes.text(p, height, f" {name} = {p:.4f} ", transform=axes.get_xaxis_transform(), fontsize=8, ha=side,
                  va="center", bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8})


def coloured(figure, axes, scene, unit="1/s"):
    """The loci with their points coloured by p: where the roots are when."""
    for points in scene.branches.values():
        axes.plot([l.real for _, l in points], [l.imag for _, l in points], color=BLUE, linewidth=0.8, zorder=2)
    points = [point for branch in scene.branches.values() for point in branch]
    dots = axes.scatter([l.real for _, l in points], [l.imag for _, l in points], c=[p for p, _ in points],
                        cmap="viridis", s=14, zorder=3)
    figure.colorbar(dots, ax=axes, label="load parameter p, –", pad=0.02)


def path_figure(plt, scene, undamped, names, title):
    """The path of the roots: complex plane, frequency and growth rate over p. `undamped` is drawn in grey."""
    figure = plt.figure(figsize=(9.2, 4.6), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=[1.15, 1])
    left, top, bottom = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
    if undamped:
        for axes, x, y in [(left, growth, circular), (top, p_of, circular), (bottom, p_of, growth)]:
            draw(axes, undamped, x, y, "without velocity terms", color=GREY, linestyle="--", linewidth=1.2)
    coloured(figure, left, scene)
    draw(top, scene, p_of, circular, names, color=BLUE)
    draw(bottom, scene, p_of, growth, names, color=BLUE)
    bottom.axhline(0, color=BLACK, linewidth=0.8)
    for axes, x, y in [(left, growth, circular), (top, p_of, circular), (bottom, p_of, growth)]:
        mark(axes, scene, x, y)
    plane(left, title)
    over_p(top, "", "Im λ, 1/s", "")
    over_p(bottom, "", "Re λ, 1/s")
    top.tick_params(labelbottom=False)
    figure.align_ylabels([top, bottom])
    return figure, left, top, bottom


def figure_5(plt, scenes):
    figure, ((a, b), (c, d)) = plt.subplots(2, 2, figsize=(9.2, 7.4), layout="constrained")
    plain, gyroscopic = scenes["thomson_tait_conservative"], scenes["thomson_tait_gyroscopic"]
    damped, both = scenes["thomson_tait_damped"], scenes["thomson_tait_damped_gyroscopic"]
    draw(a, plain, growth, circular, "M, K", color=BLUE, linewidth=6, alpha=0.5)
    draw(a, gyroscopic, growth, circular, "M, G, K", color=RED)
    a.set_xlim(-0.45, 0.15)
    plane(a, "a) undamped: on the imaginary axis for every p")
    draw(b, damped, growth, circular, "M, D, K", color=BLUE)
    draw(b, both, growth, circular, "M, D + G, K", color=RED, linestyle="--")
    for scene, colour in [(damped, BLUE), (both, RED)]:
        for points in scene.branches.values():
            b.plot([points[0][1].real], [points[0][1].imag], marker="o", color=colour, markersize=5)
    b.plot([], [], "o", color=GREY, markersize=5, label="p = 0")
    b.set_xlim(-0.45, 0.15)
    plane(b, "b) damped: left of the imaginary axis for every p")
    draw(c, plain, p_of, circular, "M, K", color=BLUE)
    draw(c, gyroscopic, p_of, circular, "M, G, K", color=RED, linestyle="--")
    draw(c, scenes["flutter"], p_of, circular, "for comparison: M, K, N (flutter.prm)", color=GREY, linestyle=":")
    mark(c, scenes["flutter"], p_of, circular)
    over_p(c, "symmetric coupling: the modes turn away", "circular frequency Im λ, 1/s", "coupling p, –")
    draw(d, damped, p_of, growth, "M, D, K", color=BLUE)
    draw(d, both, p_of, growth, "M, D + G, K", color=RED, linestyle="--")
    draw(d, scenes["non_modal_damping"], p_of, growth, "for comparison: M, D, K, N\n(non_modal_damping.prm)",
         color=GREY, linestyle=":")
    mark(d, scenes["non_modal_damping"], p_of, growth)
    d.axhline(0, color=BLACK, linewidth=0.8)
    over_p(d, "the same damping with and without friction", "growth rate Re λ, 1/s", "coupling p, –")
    c.set_ylim(2.5, 4.15)
    for axes, where in [(a, "center left"), (b, "lower left"), (c, "upper center"), (d, "lower left")]:
        axes.legend(fontsize=8, loc=where)
    return figure


def figure_6(plt, scenes):
    scene = scenes["flutter"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.2, 4.6), layout="constrained")
    square, last = lambda _, l: (l * l).real, max(p for p, _ in next(iter(scene.branches.values())))
    square_imag = lambda _, l: (l * l).imag
    for points, colour, style, name in zip(scene.branches.values(), [BLUE, RED], ["-", "--"], "rs"):
        left.plot([square(*x) for x in points], [square_imag(*x) for x in points], style, color=colour,
                  linewidth=1.8, label=f"mode {name}")
        for sign in (1, -1):  # l and its conjugate
            right.plot([l.real for _, l in points], [sign * l.imag for _, l in points], style, color=colour,
                       linewidth=1.8, label=f"mode {name}" if sign == 1 else None)
        first, end = points[0][1], points[-1][1]
        left.plot([square(0, first)], [0], "o", color=colour)
        left.annotate("", (square(0, end), square_imag(0, end)), (0, 0), arrowprops={"arrowstyle": "->", "color": GREY})
        for sign in (1, -1):
            root = complex(end.real, sign * end.imag)
            right.plot([0], [sign * first.imag], "o", color=colour)
            right.annotate("", (root.real, root.imag), (0, 0), arrowprops={"arrowstyle": "->", "color": GREY})
    left.plot([], [], "o", color=GREY, label="p = 0")
    right.plot([], [], "o", color=GREY, label="p = 0")
    mark(left, scene, square, square_imag)
    mark(right, scene, growth, circular)
    mark(right, scene, growth, lambda _, l: -l.imag, labelled=False)
    left.set_title("squares λ² = –k ± jn", fontsize=10)
    left.set_xlabel("Re λ² = –k, 1/s²")
    left.set_ylabel("Im λ² = ±n, 1/s²")
    left.axhline(0, color=BLACK, linewidth=0.8, zorder=1)
    left.axvline(0, color=BLACK, linewidth=0.8)
    left.grid(True, linewidth=0.4, alpha=0.6)
    left.set_xlim(-14.5, 1.5)
    left.set_ylim(-4, 4)
    plane(right, "roots λ = ±√(–k ± jn)")
    right.axhline(0, color=BLACK, linewidth=0.8, zorder=1)
    right.set_xlim(-0.6, 0.6)
    left.text(-9.6, 2.6, f"p = {last:g}", fontsize=8)
    right.text(0.37, 3.15, f"p = {last:g}", fontsize=8)
    left.legend(fontsize=8, loc="upper right")
    right.legend(fontsize=8, loc="center right")
    return figure


def figure_7(plt, scenes):
    scene = scenes["flutter"]
    figure, left, top, bottom = path_figure(plt, scene, None, "two modes", "M λ² + K + p N: path of the roots")
    vertical(top, scene.critical[0][1], r"$p_\mathrm{crit}$")
    vertical(bottom, scene.critical[0][1])
    left.legend(fontsize=8, loc="upper right")
    return figure


def figure_8(plt, scenes):
    scene = scenes["modal_damping"]
    figure, left, top, bottom = path_figure(plt, scene, scenes["flutter"], "with D = d M",
                                            "modal velocity terms: the cross moves left by d/2")
    critical, border = scene.critical[0][1], scene.critical[1][1]
    vertical(top, critical, r"$p_\mathrm{crit}$", 0.12)
    vertical(top, border, r"$p_\mathrm{stab}$")
    vertical(bottom, critical)
    vertical(bottom, border)
    for axes in (top, bottom):
        axes.set_xlim(-0.05, 1.12)  # room for the number
    left.legend(fontsize=8, loc="upper right")
    bottom.legend(fontsize=8, loc="upper left")
    return figure


def figure_9(plt, scenes):
    scene = scenes["non_modal_damping"]
    figure, left, top, bottom = path_figure(plt, scene, scenes["flutter"], "with D = diag(0.76, 0.04)",
                                            "non-modal velocity terms: the crossing opens")
    vertical(top, scene.critical[0][1], r"$p_\mathrm{stab}$")
    vertical(bottom, scene.critical[0][1])
    left.legend(fontsize=8, loc="upper right")
    bottom.legend(fontsize=8, loc="upper left")
    return figure


def figure_10(plt, scenes):
    figure, ((a, b), (c, d)) = plt.subplots(2, 2, figsize=(9.2, 7.4), layout="constrained")
    undamped, damped = scenes["ziegler_undamped"], scenes["ziegler_damped"]
    gyroscopic, flutter = scenes["gyroscopic_circulatory"], scenes["flutter"]
    for axes, x, y in [(a, growth, circular), (c, p_of, growth)]:
        draw(axes, undamped, x, y, "b = 0", color=GREY, linestyle="--")
        draw(axes, damped, x, y, "b = 0.1", color=BLUE)
        mark(axes, undamped, x, y)
        mark(axes, damped, x, y)
    for axes, x, y in [(b, growth, circular), (d, p_of, growth)]:
        draw(axes, flutter, x, y, "g = 0", color=GREY, linestyle="--")
        draw(axes, gyroscopic, x, y, "g = 0.5", color=BLUE)
        mark(axes, flutter, x, y)
        mark(axes, gyroscopic, x, y)
    plane(a, "a) Ziegler's pendulum, p = 1 to 2.6", "–")
    plane(b, "b) undamped gyroscopic circulatory system, p = 0 to 1")
    over_p(c, "", "growth rate Re λ, –", "follower load p, –")
    over_p(d, "", "growth rate Re λ, 1/s")
    vertical(c, damped.critical[0][1], r"b = 0.1: $p_\mathrm{stab}$", 0.06)
    vertical(c, undamped.critical[0][1], r"b = 0: $p_\mathrm{crit}$", 0.7, "right")
    vertical(d, flutter.critical[0][1], r"g = 0: $p_\mathrm{crit}$", 0.06, "right")
    for axes in (c, d):
        axes.axhline(0, color=BLACK, linewidth=0.8)
    for axes in (a, b, c, d):
        axes.legend(fontsize=8, loc="upper left" if axes in (c, d) else "best")
    return figure


def commuting(plt, scenes):
    scene = scenes["commuting"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.2, 3.6), layout="constrained")
    for points, colour, style in zip(scene.branches.values(), [BLUE, RED], ["-", "--"]):
        d = -2 * points[0][1].real
        for axes, y in [(left, circular), (right, growth)]:
            axes.plot([p for p, _ in points], [y(p, l) for p, l in points], style, color=colour, linewidth=1.8,
                      label=f"mode with d = {d:.1f} 1/s")
    over_p(left, "frequencies cross", "circular frequency Im λ, 1/s")
    over_p(right, "growth rates stay at –d/2", "growth rate Re λ, 1/s")
    right.set_ylim(-0.35, 0.05)
    right.axhline(0, color=BLACK, linewidth=0.8, zorder=1)
    for axes in (left, right):
        axes.legend(fontsize=8)
    return figure


PICTURES = {
    "fig05_thomson_tait": figure_5,
    "fig06_square_root": figure_6,
    "fig07_flutter_path": figure_7,
    "fig08_modal": figure_8,
    "fig09_non_modal": figure_9,
    "fig10_paradox": figure_10,
    "commuting": commuting,
}


def save(figure, path):
    """As a PNG file with a palette, a third as large as with full colours. matplotlib brings Pillow with it."""
    from PIL import Image
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=100)
    picture = Image.open(buffer).convert("RGB")
    picture.quantize(255, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(path, optimize=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    # Where this is installed, the program is in PREFIX/bin, and what PREFIX/share/squeal holds stays as it is.
    is_installed = not (PROJECT / "CMakeLists.txt").exists()
    program, here = (PROJECT.parents[1] / "bin/squeal", pathlib.Path()) if is_installed else (
        PROJECT / "build/release/squeal", PROJECT)
    parser.add_argument("--program", type=pathlib.Path, default=program)
    parser.add_argument("--results", type=pathlib.Path, default=here / "output/theory")
    parser.add_argument("--images", type=pathlib.Path,
                        default=here / ("theory" if is_installed else "doc/images/theory"))
    parser.add_argument("--rerun", action="store_true", help="run the program even where results exist")
    arguments = parser.parse_args()
    for name in ("program", "results", "images"):  # the program runs in the project's directory
        setattr(arguments, name, getattr(arguments, name).resolve())
    plt = load_pyplot(fail)
    files = sorted(THEORY.glob("*.prm"))
    if not files:
        fail(f"there are no parameter files in {THEORY}")
    directories = {file: results(file, arguments) for file in files}
    scenes = {file.stem: Scene(directory) for file, directory in directories.items() if not is_map(file)}
    pictures = {**{name: lambda picture=picture: picture(plt, scenes) for name, picture in PICTURES.items()},
                **{file.stem: lambda file=file: stability_map.draw(plt, directories[file]) for file in files if is_map(file)}}
    arguments.images.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures.items():
        figure = picture()
        path = arguments.images / f"{name}.png"
        save(figure, path)
        plt.close(figure)
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
