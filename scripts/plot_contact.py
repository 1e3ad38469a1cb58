#!/usr/bin/env python3
"""Draw what happens on the faces of a brake's pads: contact pressure and status, or where friction feeds a mode.

    scripts/plot_contact.py OUTPUT_DIR [--cycle N] [--output FILE.png]
    scripts/plot_contact.py OUTPUT_DIR --mode M [--cycle N] [--output FILE.png]

The first reads OUTPUT_DIR/contact-N.pvtu and its pieces (N: the last mesh), written by runs with Steady pressure =
computed; the second OUTPUT_DIR/mode-N-M-contact.pvtu, the work of friction per cycle and area.
Needs matplotlib and numpy (Debian: apt-get install python3-matplotlib).
"""

import argparse
import base64
import csv
import glob
import os
import re
import struct
import xml.etree.ElementTree as ElementTree
import zlib

from plotting import load_pyplot, open_text, save_figure, stop

OPEN, CLOSED = "#F0E442", "#0072B2"  # of Okabe and Ito


def fail(message):
    stop("plot_contact.py: " + message)


def decode(numpy, element):
    """The numbers of a DataArray: ascii, or base64 of blocks compressed by zlib."""
    text = element.text.strip()
    dtype = {"Float32": "<f4", "Float64": "<f8", "Int32": "<i4", "UInt8": "u1"}[element.get("type")]
    if element.get("format") == "ascii":
        return numpy.array(text.split(), dtype=float).astype(dtype)
    n_blocks, = struct.unpack("<I", base64.b64decode(text[:8])[:4])
    header_bytes = 4 * (3 + n_blocks)
    header_text = 4 * ((header_bytes + 2) // 3)
    sizes = struct.unpack(f"<{3 + n_blocks}I", base64.b64decode(text[:header_text])[:header_bytes])[3:]
    packed, data, at = base64.b64decode(text[header_text:]), b"", 0
    for size in sizes:
        data += zlib.decompress(packed[at:at + size])
        at += size
    return numpy.frombuffer(data, dtype=dtype)


def read_contact(numpy, path):
    """Points, quadrilaterals (corners counter-clockwise) and fields of all pieces of a .pvtu file."""
    points, cells, fields, offset = [], [], {}, 0
    for piece in ElementTree.parse(path).iter("Piece"):
        name = os.path.join(os.path.dirname(path), piece.get("Source"))
        try:
            root = ElementTree.parse(name).getroot()
        except (OSError, ElementTree.ParseError) as error:
            fail(f"{name} cannot be read: {error}")
        for part in root.iter("Piece"):
            if int(part.get("NumberOfCells")) == 0:
                continue
            arrays = {array.get("Name"): array for array in part.iter("DataArray")}
            if set(decode(numpy, arrays["types"])) != {9}:
                fail(f"{name} holds no quadrilaterals: two-dimensional scenes are not drawn")
            xyz = decode(numpy, next(part.find("Points").iter("DataArray"))).reshape(-1, 3)
            points.append(xyz)
            cells.append(decode(numpy, arrays["connectivity"]).reshape(-1, 4) + offset)
            for array in part.find("PointData").iter("DataArray"):
                if array.get("NumberOfComponents", "1") == "1":
                    fields.setdefault(array.get("Name"), []).append(decode(numpy, array))
            offset += len(xyz)
    if not points:
        fail(f"{path} holds no contact faces")
    return numpy.concatenate(points), numpy.concatenate(cells), {k: numpy.concatenate(v) for k, v in fields.items()}


def read_static(directory, cycle):
    """The lines of static.csv of a mesh, by pad."""
    try:
        with open_text(os.path.join(directory, "static.csv")) as file:
            header, *lines = [line.strip().split(",") for line in file]
    except OSError:
        return {}
    return {row["pad"]: row for row in (dict(zip(header, line)) for line in lines) if row["cycle"] == cycle}


def split_by_pad(points, cells):
    """[(name, quadrilaterals)] of the pads there are."""
    height = points[cells].mean(axis=1)[:, 2]
    return [(name, cells[side]) for name, side in (("upper", height > 0), ("lower", height < 0)) if side.any()]


def surface_of(numpy, points, quadrilaterals):
    """The faces as triangles; the sliding direction, +y at the middle of the pad, points to the right."""
    from matplotlib.tri import Triangulation
    triangles = numpy.concatenate([quadrilaterals[:, [0, 1, 2]], quadrilaterals[:, [0, 2, 3]]])
    return Triangulation(1e3 * points[:, 1], 1e3 * points[:, 0], triangles)


def cell_areas(points, quadrilaterals):
    corners = points[quadrilaterals][:, :, :2].astype(float)
    a, b = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    return abs((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2)


def direction_of(directory):
    return "the disc slides to the " + ("left" if speed_of(directory) < 0 else "right")


def draw_pressure(numpy, plt, directory, path, cycle):
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm, ListedColormap

    points, cells, fields = read_contact(numpy, path)
    statics = read_static(directory, cycle)
    pads = split_by_pad(points, cells)
    pressure = fields["contact_pressure_pa"] / 1e6
    highest = max(pressure.max(), 1e-30)

    plt.rcParams.update({"font.size": 10})
    figure, axes = plt.subplots(len(pads), 2, figsize=(9, 1.35 + 2.2 * len(pads)), sharex=True, sharey=True, squeeze=False,
                                layout="constrained")
    for row, (name, quadrilaterals) in zip(axes, pads):
        surface = surface_of(numpy, points, quadrilaterals)
        image = row[0].tripcolor(surface, pressure, shading="gouraud", cmap="viridis", vmin=min(0, pressure.min()),
                                 vmax=highest)
        row[1].tricontourf(surface, fields["status"], levels=[-0.5, 0.5, 1.5],
                           colors=[OPEN, CLOSED])
        row[0].set_title(f"{name} pad: contact pressure", fontsize=10)
        title = f"{name} pad: status"
        if name in statics:
            area = 1e4 * float(statics[name]["contact_area_m2"])
            face = 1e4 * cell_areas(points, quadrilaterals).sum()
            title += f" ({area:.1f} of {face:.1f} cm$^2$ closed)"
        row[1].set_title(title, fontsize=10)
        row[0].set_ylabel("x, mm")
        for axis in row:
            axis.set_aspect("equal")
            axis.set_facecolor("0.95")
    for axis in axes[-1]:
        axis.set_xlabel("y, mm")
    figure.colorbar(image, ax=axes[:, 0], label="contact pressure, MPa", location="bottom",
                    shrink=0.8, pad=0.02, aspect=30)
    bar = figure.colorbar(ScalarMappable(BoundaryNorm([-0.5, 0.5, 1.5], 2), ListedColormap([OPEN, CLOSED])),
                          ax=axes[:, 1], location="bottom", shrink=0.8, pad=0.02, aspect=30, ticks=[0, 1], label="status")
    bar.ax.set_xticklabels(["open (lifted off)", "closed (sliding)"])
    bar.ax.tick_params(length=0)
    figure.suptitle("Contact in the steady state; " + direction_of(directory), fontweight="bold")
    return figure


def read_work(directory, cycle, mode, *origins):
    """The work per cycle of all pads together, J, out of contributions.csv."""
    with open_text(os.path.join(directory, "contributions.csv")) as file:
        return sum(float(row["energy_per_cycle_j"]) for row in csv.DictReader(file)
                   if row["cycle"] == cycle and row["mode"] == str(mode) and row["origin"] in origins)


def draw_work(numpy, plt, directory, path, cycle, mode):
    """The work of friction per cycle and area: in all, of the changing pressure, of the changing sliding velocity."""
    points, cells, fields = read_contact(numpy, path)
    causes = [(r"$\mu$ times the change of pressure", ("friction",), fields["pressure_work_j_per_m2"]),
              (r"turning direction, slope of $\mu$(v)", ("friction damping", "falling friction"),
               fields["direction_work_j_per_m2"] + fields["speed_work_j_per_m2"])]
    parts = [("sum", ("friction", "friction damping", "falling friction"), fields["friction_work_j_per_m2"]), *causes]
    pads = split_by_pad(points, cells)
    # The pressure is singular at the edges: colours end where two per cent of the nodes lie beyond.
    largest = max([numpy.percentile(abs(work), 98) for _, _, work in parts] + [1e-300])

    plt.rcParams.update({"font.size": 10})
    figure, axes = plt.subplots(len(pads), 3, figsize=(13, 2 + 2.3 * len(pads)), sharex=True, sharey=True,
                                squeeze=False, layout="constrained")
    for row, (name, quadrilaterals) in zip(axes, pads):
        surface = surface_of(numpy, points, quadrilaterals)
        for axis, (_, _, work) in zip(row, parts):
            image = axis.tripcolor(surface, work, shading="gouraud", cmap="RdBu_r", vmin=-largest, vmax=largest)
            axis.set_aspect("equal")
            axis.set_facecolor("0.95")
        row[0].set_ylabel(f"{name} pad: x, mm")
    # Joules of a mode of unit modal mass say nothing by themselves: parts of the sum do, and what the growth rate gains.
    work = [read_work(directory, cycle, mode, *origins) for _, origins, _ in parts]
    for axis, (cause, _, _), joules in zip(axes[0], parts, work):
        share = f"{100 * joules / abs(work[0]):+.0f} % of the sum" if axis is not axes[0][0] and work[0] else \
            "feeds the mode" if joules > 0 else "brakes the mode"
        axis.set_title(f"{cause}: {share}", fontsize=10)
    for axis in axes[-1]:
        axis.set_xlabel("y, mm")
    figure.colorbar(image, ax=axes, location="bottom", shrink=0.6, pad=0.02, aspect=50, extend="both",
                    label="work per cycle and area, J/m$^2$, for unit modal mass (red feeds the mode, blue brakes it)")
    figure.suptitle(f"Mode {mode}: where friction feeds energy in; " + direction_of(directory), fontweight="bold")
    return figure


def speed_of(directory):
    """Operation/Angular velocity of the run; 1 if it cannot be read."""
    try:
        with open_text(os.path.join(directory, "parameters.prm")) as file:
            found = re.search(r"set\s+Angular velocity\s*=\s*(\S+)", file.read())
            return float(found.group(1)) if found else 1
    except OSError:
        return 1


def main():
    parser = argparse.ArgumentParser(description="Draw contact pressure and status on the faces of a brake's pads, or "
                                     "where friction feeds a mode.")
    parser.add_argument("directory", metavar="OUTPUT_DIR", help="output directory of a run, e.g. output/off_centre")
    parser.add_argument("--cycle", help="mesh to draw; default: the last one")
    parser.add_argument("--mode", type=int, help="draw the work of friction on this mode")
    parser.add_argument("--output", metavar="FILE.png", help="default: OUTPUT_DIR/contact.png or friction-work-M.png")
    arguments = parser.parse_args()
    if arguments.mode is None:
        pattern, default = r"contact-(\d+)\.pvtu$", "contact.png"
        cause = ("runs with Contact/Steady pressure = computed and Output/Fields other than none write it")
    else:
        pattern, default = rf"mode-(\d+)-{arguments.mode:03}-contact\.pvtu$", f"friction-work-{arguments.mode}.png"
        cause = "runs with friction write it for the modes that Output/Fields asks for"
    names = glob.glob(os.path.join(glob.escape(arguments.directory), "*contact*.pvtu"))
    found = {match.group(1): name for name in names if (match := re.match(pattern, os.path.basename(name)))}
    cycle = arguments.cycle or max(found, key=int, default=None)
    if cycle not in found:
        fail(f"{arguments.directory} has no " + pattern[:-1].replace(r"(\d+)", cycle or "0").replace("\\", "") +
             "; " + cause)
    plt = load_pyplot(fail)
    import numpy  # matplotlib needs it, so it is there
    output = arguments.output or os.path.join(arguments.directory, default)
    try:
        if arguments.mode is None:
            figure = draw_pressure(numpy, plt, arguments.directory, found[cycle], cycle)
        else:
            figure = draw_work(numpy, plt, arguments.directory, found[cycle], cycle, arguments.mode)
    except (OSError, ValueError) as error:
        fail(f"{output} cannot be made: {error}")
    save_figure(figure, output, arguments.output, fail)
    print(output)


if __name__ == "__main__":
    main()
