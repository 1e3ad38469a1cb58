#!/usr/bin/env python3
"""Draw a Gmsh mesh (.msh 4.1, text) of Scene = mesh, to look at before it is computed with. Edges are straight.

    scripts/plot_mesh.py FILE.msh [--lift LENGTH] [--output FILE.png]

Volumes have one colour each (one for "upper lining" and "lower lining"), surface groups a darker tone; all but the first
volume that is cut by z = 0 are lifted off it by LENGTH (units of the file; default: a fifth of the mesh's height). Two
views: from above and from below.
Needs matplotlib and numpy (Debian: apt-get install python3-matplotlib).
"""

import argparse
import pathlib

from plotting import load_pyplot, save_figure, stop

# Faces of the elements of Gmsh, by number of corners: hexahedra, wedges, tetrahedra; outwards
FACES = {8: [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
         6: [(0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)],
         4: [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]}
# Corners of the elements by their type, of order 1 and 2
SOLIDS = {4: 4, 5: 8, 6: 6, 11: 4, 12: 8, 13: 6, 17: 8, 18: 6}
SURFACES = {2: 3, 3: 4, 9: 3, 10: 4, 16: 4}


def fail(message):
    stop("plot_mesh.py: " + message)


def read(path):
    """Nodes {tag: xyz}, solid elements [(volume name, corners)], faces {sorted corners: surface name}."""
    try:
        lines = iter(pathlib.Path(path).read_text().splitlines())
    except OSError as error:
        fail(f"{path}: {error.strerror}")
    if pathlib.Path(path).suffix.lower() == ".inp":
        fail(f"{path}: only Gmsh meshes (.msh) are drawn. Decks are shown by ParaView: after  squeal FILE.prm --set "
             "Eigenproblem/Solver=none  open state-0.pvtu.")
    names, physical, nodes, cells, faces = {}, {}, {}, [], {}
    for line in lines:
        if line == "$MeshFormat" and not (line := next(lines)).startswith("4.1 0"):
            fail(f"{path}: version 4.1 in text is needed (gmsh -format msh41), not {line}")
        elif line == "$PhysicalNames":
            for _ in range(int(next(lines))):
                dim, tag, name = next(lines).split(maxsplit=2)
                names[int(dim), int(tag)] = name.strip('"')
        elif line == "$Entities":
            for dim, count in enumerate(map(int, next(lines).split())):
                for _ in range(count):
                    words = next(lines).split()
                    at = 4 if dim == 0 else 7
                    if int(words[at]) > 0:
                        physical[dim, int(words[0])] = names.get((dim, int(words[at + 1])), words[at + 1])
        elif line == "$Nodes":
            for _ in range(int(next(lines).split()[0])):
                tags = [next(lines) for _ in range(int(next(lines).split()[3]))]
                for tag in tags:
                    nodes[int(tag)] = [float(x) for x in next(lines).split()[:3]]
        elif line == "$Elements":
            for _ in range(int(next(lines).split()[0])):
                dim, entity, kind, count = map(int, next(lines).split())
                for _ in range(count):
                    tags = [int(word) for word in next(lines).split()[1:]]
                    if kind in SOLIDS:
                        cells.append((physical.get((dim, entity), "?"), tags[:SOLIDS[kind]]))
                    elif kind in SURFACES:
                        faces[tuple(sorted(tags[:SURFACES[kind]]))] = physical.get((dim, entity), "?")
    return nodes, cells, faces


def boundary(cells):
    """Faces that one cell has: [(volume name, tags)]."""
    seen = {}
    for name, tags in cells:
        for face in FACES[len(tags)]:
            corners = [tags[v] for v in face]
            key = tuple(sorted(corners))
            seen[key] = None if key in seen else (name, corners)
    return [face for face in seen.values() if face]


def draw(axes, np, polygons, direction):
    """Painter's algorithm: faces towards the eye, the furthest first."""
    from matplotlib.collections import PolyCollection
    elevation, azimuth = np.radians(direction)
    eye = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0])
    up = np.cross(eye, right)
    light = np.array([0.35, 0.25, 0.9])
    items = []
    for corners, colour in polygons:
        normal = np.cross(corners[2] - corners[0], corners[-1] - corners[1])
        normal = normal / (np.linalg.norm(normal) or 1)
        if normal @ eye <= 0:
            continue
        shade = 0.55 + 0.45 * max(0, normal @ light)
        items.append((corners.mean(axis=0) @ eye, np.column_stack([corners @ right, corners @ up]),
                      np.clip(np.array(colour) * shade, 0, 1)))
    items.sort(key=lambda item: item[0])
    axes.add_collection(PolyCollection([item[1] for item in items], facecolors=[item[2] for item in items],
                                       edgecolors=(0.15, 0.15, 0.15), linewidths=0.35))
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.axis("off")


def main():
    parser = argparse.ArgumentParser(description="Draw a Gmsh mesh of Scene = mesh.")
    parser.add_argument("file", metavar="FILE.msh")
    parser.add_argument("--lift", type=float, metavar="LENGTH")
    parser.add_argument("--output", metavar="FILE.png", help="default: beside FILE.msh")
    arguments = parser.parse_args()
    plt = load_pyplot(fail)
    import numpy as np
    nodes, cells, faces = read(arguments.file)
    if not cells:
        fail(f"{arguments.file} has no hexahedra, wedges or tetrahedra.")
    place = {tag: np.array(x) for tag, x in nodes.items()}
    volumes = sorted({name for name, _ in cells})
    palette = [(0.72, 0.74, 0.78), (0.85, 0.60, 0.35), (0.45, 0.60, 0.80), (0.60, 0.75, 0.50), (0.80, 0.55, 0.70),
               (0.85, 0.80, 0.45), (0.50, 0.75, 0.75)]
    z_of = {name: [place[tag][2] for other, tags in cells if other == name for tag in tags] for name in volumes}
    base = next((name for name in volumes if min(z_of[name]) < 0 < max(z_of[name])), volumes[0])
    # One colour for what comes in pairs: names that differ in their first word only.
    kinds = sorted({name.split()[-1] for name in volumes if name != base})
    colours = {name: palette[0] if name == base else palette[1 + kinds.index(name.split()[-1]) % (len(palette) - 1)] for name in volumes}
    every_z = [x[2] for x in place.values()]
    # What reaches across z = 0 stays where it is.
    across = {name for name in volumes if min(z_of[name]) < 0 < max(z_of[name])}
    lift = arguments.lift if arguments.lift is not None else (max(every_z) - min(every_z)) / 5
    polygons = []
    for name, corners in boundary(cells):
        offset = 0 if name in across else lift * np.sign(np.mean(z_of[name]))
        group = faces.get(tuple(sorted(corners)))
        colour = tuple(0.6 * c for c in colours[name]) if group else colours[name]
        polygons.append((np.array([place[tag] for tag in corners]) + [0, 0, offset], colour))
    figure, (left, right) = plt.subplots(1, 2, figsize=(14, 5.5), gridspec_kw={"width_ratios": [1, 1]})
    draw(left, np, polygons, (38, 20))
    draw(right, np, polygons, (-35, 20))
    for name in [base] + [next(n for n in volumes if n != base and n.split()[-1] == kind) for kind in kinds]:
        label = name if name == base else name.split()[-1]
        left.plot([], [], "s", color=colours[name], markersize=11, label=label)
    left.legend(loc="upper left", bbox_to_anchor=(-0.16, 1.02), frameon=False, fontsize=12)
    left.set_title("from above: dark are named surfaces", fontsize=12)
    right.set_title("from below", fontsize=12)
    figure.tight_layout()
    output = arguments.output or str(pathlib.Path(arguments.file).with_suffix(".png"))
    save_figure(figure, output, arguments.output, fail)
    print(output)


main()
