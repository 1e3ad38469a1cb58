#!/usr/bin/env python3
"""Draw contact pressure and status on the faces of a brake's pads.

    scripts/plot_contact.py OUTPUT_DIR [--cycle N] [--output FILE.png]

Reads OUTPUT_DIR/contact-N.pvtu and its pieces (N: the last mesh), written by runs with Steady pressure = computed.
Needs matplotlib and numpy (Debian: apt-get install python3-matplotlib).
"""

import argparse
import base64
import glob
import os
import re
import struct
import sys
import xml.etree.ElementTree as ElementTree
import zlib

from plotting import load_pyplot

OPEN, CLOSED = "#F0E442", "#0072B2"  # of Okabe and Ito


def fail(message):
    sys.exit("plot_contact.py: " + message)


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
            for key in ("contact_pressure_pa", "status"):
                fields.setdefault(key, []).append(decode(numpy, arrays[key]))
            offset += len(xyz)
    if not points:
        fail(f"{path} holds no contact faces")
    return numpy.concatenate(points), numpy.concatenate(cells), {k: numpy.concatenate(v) for k, v in fields.items()}


def read_static(directory, cycle):
    """The lines of static.csv of a mesh, by pad."""
    try:
        with open(os.path.join(directory, "static.csv"), encoding="utf-8") as file:
            header, *lines = [line.strip().split(",") for line in file]
    except OSError:
        return {}
    return {row["pad"]: row for row in (dict(zip(header, line)) for line in lines) if row["cycle"] == cycle}


def draw(numpy, plt, directory, path, cycle):
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.tri import Triangulation

    points, cells, fields = read_contact(numpy, path)
    statics = read_static(directory, cycle)
    height = points[cells].mean(axis=1)[:, 2]
    pads = [(name, cells[side]) for name, side in (("upper", height > 0), ("lower", height < 0)) if side.any()]
    pressure = fields["contact_pressure_pa"] / 1e6
    highest = max(pressure.max(), 1e-30)

    plt.rcParams.update({"font.size": 10})
    figure, axes = plt.subplots(len(pads), 2, figsize=(9, 1.35 + 2.2 * len(pads)), sharex=True, sharey=True, squeeze=False,
                                layout="constrained")
    for row, (name, quadrilaterals) in zip(axes, pads):
        # The sliding direction, +y at the middle of the pad, points to the right.
        x, y = 1e3 * points[:, 1], 1e3 * points[:, 0]
        triangles = numpy.concatenate([quadrilaterals[:, [0, 1, 2]], quadrilaterals[:, [0, 2, 3]]])
        surface = Triangulation(x, y, triangles)
        image = row[0].tripcolor(surface, pressure, shading="gouraud", cmap="viridis", vmin=min(0, pressure.min()),
                                 vmax=highest)
        row[1].tricontourf(surface, fields["status"], levels=[-0.5, 0.5, 1.5],
                           colors=[OPEN, CLOSED])
        row[0].set_title(f"{name} pad: contact pressure", fontsize=10)
        title = f"{name} pad: status"
        if name in statics:
            area = 1e4 * float(statics[name]["contact_area_m2"])
            corners = points[quadrilaterals][:, :, :2].astype(float)
            a, b = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
            face = 1e4 * abs((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2).sum()
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
    figure.suptitle("Contact in the steady state; the disc slides to the " +
                    ("left" if speed_of(directory) < 0 else "right"), fontweight="bold")
    return figure


def speed_of(directory):
    """Operation/Angular velocity of the run; 1 if it cannot be read."""
    try:
        with open(os.path.join(directory, "parameters.prm"), encoding="utf-8") as file:
            found = re.search(r"set\s+Angular velocity\s*=\s*(\S+)", file.read())
            return float(found.group(1)) if found else 1
    except OSError:
        return 1


def main():
    parser = argparse.ArgumentParser(description="Draw contact pressure and status on the faces of a brake's pads.")
    parser.add_argument("directory", metavar="OUTPUT_DIR", help="output directory of a run, e.g. output/off_centre")
    parser.add_argument("--cycle", help="mesh to draw; default: the last one")
    parser.add_argument("--output", metavar="FILE.png", help="default: OUTPUT_DIR/contact.png")
    arguments = parser.parse_args()
    found = {re.search(r"contact-(\d+)\.pvtu$", name).group(1): name
             for name in glob.glob(os.path.join(arguments.directory, "contact-*.pvtu"))}
    cycle = arguments.cycle or max(found, key=int, default=None)
    if cycle not in found:
        fail(f"{arguments.directory} has no contact-{cycle or 0}.pvtu; runs with Contact/Steady pressure = computed and "
             "Output/Fields other than none write it")
    plt = load_pyplot(fail)
    import numpy  # matplotlib needs it, so it is there
    output = arguments.output or os.path.join(arguments.directory, "contact.png")
    try:
        draw(numpy, plt, arguments.directory, found[cycle], cycle).savefig(output, dpi=110)
    except (OSError, ValueError) as error:
        fail(f"{output} cannot be written: {error}")
    print(output)


if __name__ == "__main__":
    main()
