#!/usr/bin/env python3
"""Draw a stability map over two parameters: the largest growth rate as colour, the border of stability as curves.

    scripts/stability_map.py OUTPUT_DIR [--output FILE.png]

Reads OUTPUT_DIR/map.csv, border.csv and parameters.prm of a run with Sweep/Second parameter.
Needs matplotlib and numpy (Debian: apt-get install python3-matplotlib).
"""

import argparse
import csv
import os
import re

from plotting import load_pyplot, stop


def fail(message):
    stop("stability_map.py: " + message)


def read_table(directory, name):
    path = os.path.join(directory, name)
    try:
        with open(path, newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    except OSError as error:
        fail(f"{path} cannot be read ({error.strerror}); runs with Sweep/Second parameter write it")


def names_of(directory):
    """Sweep/Parameter and Sweep/Second parameter of the run."""
    try:
        with open(os.path.join(directory, "parameters.prm"), encoding="utf-8") as file:
            text = file.read()
    except OSError:
        return "first parameter", "second parameter"
    section = text[text.find("subsection Sweep"):]
    found = {key: value.strip() for key, value in re.findall(r"set\s+(Parameter|Second parameter)\s*=(.*)", section)}
    return found.get("Parameter", "first parameter"), found.get("Second parameter", "second parameter")


def draw(numpy, plt, directory):
    rows, border = read_table(directory, "map.csv"), read_table(directory, "border.csv")
    first = sorted({float(row["first_value"]) for row in rows})
    second = sorted({float(row["second_value"]) for row in rows})
    growth = numpy.full((len(second), len(first)), numpy.nan)
    for row in rows:
        if row["growth_rate_1_per_s"]:
            growth[second.index(float(row["second_value"])), first.index(float(row["first_value"]))] = \
                float(row["growth_rate_1_per_s"])
    largest = numpy.nanmax(abs(growth))

    plt.rcParams.update({"font.size": 10})
    figure, axis = plt.subplots(figsize=(8, 5.5), layout="constrained")
    image = axis.pcolormesh(first, second, growth, shading="nearest", cmap="RdBu_r", vmin=-largest, vmax=largest)
    figure.colorbar(image, label="largest growth rate, 1/s (red: some mode grows)")
    curves = {}
    for row in border:
        curves.setdefault(row["curve"], []).append(row)
    for number, points in curves.items():
        x, y = ([float(row[key]) for row in points] for key in ("first_value", "second_value"))
        middle = points[len(points) // 2]
        what = "divergence" if middle["kind"] == "divergence" else f"{float(middle['frequency_hz']):.5g} Hz"
        line, = axis.plot(x, y, "k." if len(points) == 1 else "k-", linewidth=1.6)
        axis.annotate(what, (float(middle["first_value"]), float(middle["second_value"])), xytext=(5, 5),
                      textcoords="offset points", fontsize=9, color=line.get_color(), annotation_clip=True,
                      bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1})
    axis.set_xlim(first[0], first[-1])
    axis.set_ylim(second[0], second[-1])
    axis.set_xlabel(names_of(directory)[0])
    axis.set_ylabel(names_of(directory)[1])
    axis.set_title("Stability map: where a mode begins to grow (black)", fontweight="bold", fontsize=11)
    return figure


def main():
    parser = argparse.ArgumentParser(description="Draw a stability map over two parameters.")
    parser.add_argument("directory", metavar="OUTPUT_DIR", help="output directory of a run, e.g. output/stability_map")
    parser.add_argument("--output", metavar="FILE.png", help="default: OUTPUT_DIR/stability_map.png")
    arguments = parser.parse_args()
    plt = load_pyplot(fail)
    import numpy  # matplotlib needs it, so it is there
    output = arguments.output or os.path.join(arguments.directory, "stability_map.png")
    try:
        draw(numpy, plt, arguments.directory).savefig(output, dpi=110)
    except (OSError, ValueError, KeyError) as error:
        fail(f"{output} cannot be made: {error!r}")
    print(output)


if __name__ == "__main__":
    main()
