#!/usr/bin/env python3
"""Draw a stability map over two parameters: the largest growth rate as colour, the border of stability as curves with the
band that the mesh leaves.

    scripts/stability_map.py OUTPUT_DIR [--output FILE.png]

Reads OUTPUT_DIR/map.csv, border.csv and parameters.prm of a run with Sweep/Second parameter.
Needs matplotlib (Debian: apt-get install python3-matplotlib).
"""

import argparse
import csv
import os
import re

from plotting import axis_of, load_pyplot, open_text, save_figure, stop


def fail(message):
    stop("stability_map.py: " + message)


def read_table(directory, name):
    path = os.path.join(directory, name)
    try:
        with open_text(path) as file:
            return list(csv.DictReader(file))
    except OSError as error:
        fail(f"{path} cannot be read ({error.strerror}); runs with Sweep/Second parameter write it")


def scene_of(directory):
    try:
        with open_text(os.path.join(directory, "parameters.prm")) as file:
            return re.search(r"^set\s+Scene\s*=\s*(\S+)", file.read(), re.MULTILINE).group(1)
    except (OSError, AttributeError):
        return "brake"


def column(rows, name, factor=1):
    return [factor * float(row[name]) for row in rows]


class Axis:
    """A parameter: its column, label and scale."""

    def __init__(self, name, rows, scene):
        self.name = name
        self.label, self.factor = axis_of(name, scene)
        self.values = sorted(set(column(rows, name, self.factor)))
        self.width = self.values[-1] - self.values[0] or 1

    def of(self, rows, prefix=""):
        return column(rows, prefix + self.name, self.factor)


def field_of_growth(first, second, rows, border):
    """Points and growth rates to be coloured: those of the grid, and zero on the border of stability, where no other mode
    grows, so that colours change there and not half a cell beside."""
    rows = [row for row in rows if row["growth_rate_1_per_s"]]
    outer = [row for row in border if row.get("other_growing_modes") == "0"]
    points = dict(zip(zip(first.of(rows), second.of(rows)), column(rows, "growth_rate_1_per_s")))
    points.update(((x, y), 0.0) for x, y in zip(first.of(outer), second.of(outer)))
    x, y = zip(*points)
    return x, y, list(points.values())


def draw_band(axis, first, second, points):
    """What the mesh may move a curve by."""
    known = [row for row in points if row.get("mesh_error_cells")]
    if not known:
        return
    x, y = first.of(known), second.of(known)
    u, v = first.of(known, "band_"), second.of(known, "band_")
    edges = [list(zip((a + sign * da for a, da in zip(x, u)), (b + sign * db for b, db in zip(y, v)))) for sign in (1, -1)]
    axis.fill(*zip(*(edges[0] + edges[1][::-1])), facecolor="0.35", alpha=0.25, edgecolor="0.35", linewidth=0.6,
              label="what the mesh leaves open")
    axis.plot(first.of(known, "corrected_"), second.of(known, "corrected_"), color="black", linewidth=1, linestyle=":",
              label="the same, corrected")


def draw(plt, directory):
    rows, border = read_table(directory, "map.csv"), read_table(directory, "border.csv")
    if not any(row["growth_rate_1_per_s"] for row in rows):
        fail(f"{directory}/map.csv has no growth rates yet")
    first, second = (Axis(name, rows, scene_of(directory)) for name in list(rows[0])[:2])
    x, y, growth = field_of_growth(first, second, rows, border)
    largest = max(map(abs, growth)) or 1

    plt.rcParams.update({"font.size": 10})
    figure, axis = plt.subplots(figsize=(8, 5.5), layout="constrained")
    # Triangles in units of the map: those of points that lie on a line are none.
    from matplotlib.tri import Triangulation
    triangles = Triangulation([a / first.width for a in x], [b / second.width for b in y]).triangles
    image = axis.tripcolor(x, y, triangles, growth, shading="gouraud", cmap="RdBu_r", vmin=-largest, vmax=largest)
    figure.colorbar(image, label="largest growth rate, 1/s (red: some mode grows)")
    curves = {}
    for row in border:
        curves.setdefault(row["curve"], []).append(row)
    for points in curves.values():
        x, y = first.of(points), second.of(points)
        middle = len(points) // 2
        what = "divergence" if points[0]["kind"] == "divergence" else f"{float(points[middle]['frequency_hz']):.5g} Hz"
        axis.plot(x, y, "k." if len(points) == 1 else "k-", linewidth=1.6, label="a mode begins to grow")
        draw_band(axis, first, second, points)
        axis.annotate(what, (x[middle], y[middle]), xytext=(5, 5), textcoords="offset points", fontsize=9,
                      annotation_clip=True, bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1})
    for marks, look in (([row for row in rows if float(row.get("undecided_modes") or 0) > 0],
                         {"marker": "o", "facecolors": "none", "edgecolors": "0.2", "s": 26, "label": "some mode undecided"}),
                        ([row for row in rows if float(row["unstable_modes"] or 0) > 0],
                         {"marker": "x", "color": "0.2", "s": 14, "label": "some mode grows"})):
        if marks:
            axis.scatter(first.of(marks), second.of(marks), linewidths=0.9, zorder=3, clip_on=False, **look)
    handles, labels = axis.get_legend_handles_labels()
    named = dict(zip(labels, handles))  # one of each kind
    if named:
        axis.legend(named.values(), named.keys(), loc="upper right", bbox_to_anchor=(1, -0.1), ncol=3, frameon=False, fontsize=9)
    axis.set_xlim(first.values[0], first.values[-1])
    axis.set_ylim(second.values[0], second.values[-1])
    axis.set_xlabel(first.label)
    axis.set_ylabel(second.label)
    axis.set_title("Stability map", fontweight="bold", fontsize=10)
    return figure


def main():
    parser = argparse.ArgumentParser(description="Draw a stability map over two parameters.")
    parser.add_argument("directory", metavar="OUTPUT_DIR", help="output directory of a run, e.g. output/stability_map")
    parser.add_argument("--output", metavar="FILE.png", help="default: OUTPUT_DIR/stability_map.png")
    arguments = parser.parse_args()
    plt = load_pyplot(fail)
    output = arguments.output or os.path.join(arguments.directory, "stability_map.png")
    try:
        figure = draw(plt, arguments.directory)
    except (OSError, ValueError, KeyError) as error:
        fail(f"{output} cannot be made: {error!r}")
    save_figure(figure, output, arguments.output, fail)
    print(output)


if __name__ == "__main__":
    main()
