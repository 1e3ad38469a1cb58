"""Hexahedral meshes of a brake like that of Scene = brake, and writers for the formats of Scene = mesh.

The mesh has no binary or generated file in git; the tests write what they need.
"""

import itertools
import math

# Faces of a hexahedron with four nodes around the bottom, four around the top; Abaqus' S1 to S6.
FACES = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]


class Mesh:
    """Nodes, cells of eight nodes, and groups: cells by volume name, faces by surface name."""

    def __init__(self):
        self.nodes, self.cells, self.volumes, self.surfaces = [], [], {}, {}

    def sector(self, name, radii, angles, heights, ring=False, volume_of=None):
        """A block in cylindrical coordinates; surfaces name.inner, .outer, .begin, .end, .low, .high. The volume is
        `name`, or volume_of(layer number)."""
        first, n_phi = len(self.nodes), len(angles) - 1 if ring else len(angles)
        for z in heights:
            for phi in angles[:n_phi]:
                for r in radii:
                    self.nodes.append((r * math.cos(phi), r * math.sin(phi), z))

        def node(i, j, k):
            return first + i + len(radii) * (j % n_phi + n_phi * k)

        n_r, n_a, n_z = len(radii) - 1, len(angles) - 1, len(heights) - 1
        for k in range(n_z):
            for j in range(n_a):
                for i in range(n_r):
                    cell = [node(i + a, j + b, k + c) for c in (0, 1)
                            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                    self.volumes.setdefault(volume_of(k) if volume_of else name, []).append(len(self.cells))
                    self.cells.append(cell)
                    sides = [(k == 0, 0, "low"), (k == n_z - 1, 1, "high"), (j == 0 and not ring, 2, "begin"),
                             (i == n_r - 1, 3, "outer"), (j == n_a - 1 and not ring, 4, "end"), (i == 0, 5, "inner")]
                    for on_side, face, side in sides:
                        if on_side:
                            self.surfaces.setdefault(f"{name}.{side}", []).append([cell[v] for v in FACES[face]])

    def drop(self, cells):
        """Removes cells. Their named faces go too; the faces that they leave behind have no name."""
        cells = set(cells)
        gone = {tuple(sorted(self.cells[c][v] for v in face)) for c in cells for face in FACES}
        kept = [c for c in range(len(self.cells)) if c not in cells]
        number = {c: i for i, c in enumerate(kept)}
        self.cells = [self.cells[c] for c in kept]
        self.volumes = {name: [number[c] for c in group if c in number] for name, group in self.volumes.items()}
        self.surfaces = {name: [face for face in faces if tuple(sorted(face)) not in gone]
                         for name, faces in self.surfaces.items()}
        self.weld()

    def weld(self):
        """Makes one node of those at the same place that belong to blocks of one name's first word; unused ones go."""
        owner = {}
        for name, group in self.volumes.items():
            for c in group:
                for v in self.cells[c]:
                    owner[v] = name.split(".")[0]
        places, new = {}, {}
        nodes = []
        for v in sorted(owner):
            key = (owner[v], *(round(x, 9) for x in self.nodes[v]))
            if key not in places:
                places[key] = len(nodes)
                nodes.append(self.nodes[v])
            new[v] = places[key]
        self.nodes = nodes
        self.cells = [[new[v] for v in cell] for cell in self.cells]
        self.surfaces = {name: [[new[v] for v in face] for face in faces] for name, faces in self.surfaces.items()}

    def move(self, function):
        self.nodes = [function(*x) for x in self.nodes]


def rotations_of_corners():
    """The 24 ways to number the corners of a hexahedron that do not turn it inside out."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    result = []
    for axes in itertools.permutations(range(3)):
        exchanges = sum(axes[j] > axes[i] for i in range(3) for j in range(i))
        for flips in itertools.product((0, 1), repeat=3):
            if (exchanges + sum(flips)) % 2 == 0:
                result.append([corners.index(tuple(c[axes[d]] ^ flips[d] for d in range(3))) for c in corners])
    return result


def equal(a, b, n):
    return [a + (b - a) * i / n for i in range(n + 1)]


def brake(rotor_cells=(3, 18, 1), pad_cells=(2, 3, 1), pads=("upper", "lower"), plate_layers=0):
    """The default brake of interface.md: the same cells as Scene = brake with equal cells. The outermost plate_layers
    of each pad's cells are the volume <pad>.plate."""
    mesh = Mesh()
    mesh.sector("rotor", equal(0.05, 0.15, rotor_cells[0]), equal(0, 2 * math.pi, rotor_cells[1]),
                equal(-0.006, 0.006, rotor_cells[2]), ring=True)
    half = math.radians(25)
    for pad in pads:
        low, high = (0.006, 0.018) if pad == "upper" else (-0.018, -0.006)
        n = pad_cells[2]

        def volume_of(layer, pad=pad, n=n):
            depth = layer if pad == "upper" else n - 1 - layer
            return f"{pad}.plate" if depth >= n - plate_layers else pad

        mesh.sector(pad, equal(0.09, 0.14, pad_cells[0]), equal(-half, half, pad_cells[1]), equal(low, high, n),
                    volume_of=volume_of)
    return mesh


# The keys that give the mesh above the supports and loads of Scene = brake.
SCENE = {
    "Scene": "mesh",
    "Mesh/Curved bodies": "all",
    "Mesh/Rotor": "rotor",
    "Mesh/Pads": "upper, lower",
    "Mesh/Contact pairs": "upper.low : rotor.high, lower.high : rotor.low",
    "Mesh/Clamped": "rotor.inner",
    "Mesh/Guided": "upper.high, lower.low",
    "Mesh/Pressure on": "upper.high, lower.low",
}


def layered_brake(layers, rotor_cells=(3, 30, 1), pad_cells=(2, 4), chamfer=0, slot=False, hat=False):
    """The default brake's disc between two pads of layers, (name, thickness in mm, cells), from the contact face outwards:
    volumes <pad>.<name>. With a chamfer the lining's ends begin that many mm further inside on the contact face; with
    a slot the middle of the lining is missing; with a hat the disc is held by a ring that rises at its inner edge."""
    mesh = Mesh()
    low, high = -0.006, 0.006
    if hat:
        rotor_cells = (rotor_cells[0] + 1, *rotor_cells[1:])
        radii = [0.05, 0.058, *equal(0.058, 0.15, rotor_cells[0] - 1)[1:]]
    else:
        radii = equal(0.05, 0.15, rotor_cells[0])
    angles = equal(0, 2 * math.pi, rotor_cells[1])
    mesh.sector("rotor", radii, angles, equal(low, high, rotor_cells[2]), ring=True)
    if hat:
        mesh.sector("rotor.hat", radii[:2], angles, equal(high, 0.036, 2), ring=True)
    half = math.radians(25)
    names, depths = [], [0.0]
    for name, t, n in layers:
        names += [name] * n
        depths += [depths[-1] + t * 1e-3 * (i + 1) / n for i in range(n)]
    # A slot is the middle one of an odd number of cells, 4 degrees wide.
    around = equal(-half, half, pad_cells[1])
    if slot:
        wide = math.radians(2)
        around = equal(-half, -wide, pad_cells[1] // 2) + equal(wide, half, pad_cells[1] // 2)
    for pad in ("upper", "lower"):
        heights = [high + d for d in depths] if pad == "upper" else [low - d for d in reversed(depths)]
        of_layer = names if pad == "upper" else names[::-1]
        mesh.sector(pad, equal(0.09, 0.14, pad_cells[0]), around, heights,
                    volume_of=lambda k, pad=pad, of_layer=of_layer: f"{pad}.{of_layer[k]}")
    if slot:
        angle = lambda c: math.atan2(sum(mesh.nodes[v][1] for v in mesh.cells[c]),
                                     sum(mesh.nodes[v][0] for v in mesh.cells[c]))
        mesh.drop([c for pad in ("upper", "lower") for c in mesh.volumes[f"{pad}.lining"] if abs(angle(c)) < wide])
    else:
        mesh.weld()
    if chamfer:
        lining = layers[0][1] * 1e-3

        def move(x, y, z):
            depth = abs(z) - high
            if depth < -1e-9 or depth > lining or math.hypot(x, y) < 0.0899:
                return x, y, z
            phi, r = math.atan2(y, x), math.hypot(x, y)
            if abs(phi) > half + 1e-6:
                return x, y, z
            phi *= 1 - (1 - depth / lining) * chamfer * 1e-3 / (half * 0.115)
            return r * math.cos(phi), r * math.sin(phi), z

        rotor = {v for name in ("rotor", "rotor.hat") for c in mesh.volumes.get(name, []) for v in mesh.cells[c]}
        mesh.nodes = [x if v in rotor else move(*x) for v, x in enumerate(mesh.nodes)]
    if hat:
        mesh.surfaces["rotor.inner"] = mesh.surfaces.pop("rotor.hat.high")
        mesh.volumes["rotor"] += mesh.volumes.pop("rotor.hat")
        inside = {tuple(sorted(face)) for face in mesh.surfaces["rotor.hat.low"]}
        mesh.surfaces["rotor.high"] = [f for f in mesh.surfaces["rotor.high"] if tuple(sorted(f)) not in inside]
        mesh.surfaces = {name: faces for name, faces in mesh.surfaces.items() if "hat" not in name}
    return mesh


LAYERED_SCENE = {
    **SCENE,
    "Mesh/Pads": "upper.lining, lower.lining",
}


def _numbered(groups):
    return {name: number for number, name in enumerate(groups, start=1)}


def _physical_names(mesh):
    volumes, surfaces = _numbered(mesh.volumes), _numbered(mesh.surfaces)
    lines = ["$PhysicalNames", str(len(volumes) + len(surfaces))]
    lines += [f'2 {tag} "{name}"' for name, tag in surfaces.items()]
    lines += [f'3 {tag} "{name}"' for name, tag in volumes.items()]
    return lines + ["$EndPhysicalNames"], volumes, surfaces


def msh2(mesh):
    """Gmsh 2.2, text. Nodes have gaps in their numbers and there are elements of lower dimension, as Gmsh has them."""
    names, volumes, surfaces = _physical_names(mesh)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", *names, "$Nodes", str(len(mesh.nodes))]
    lines += [f"{10 + 2 * i} " + " ".join(f"{x:.17g}" for x in node) for i, node in enumerate(mesh.nodes)]
    lines += ["$EndNodes", "$Elements"]
    elements = ["15 2 0 1 10", "1 2 0 1 10 12"]
    for name, faces in mesh.surfaces.items():
        elements += [f"3 2 {surfaces[name]} 1 " + " ".join(str(10 + 2 * v) for v in face) for face in faces]
    for name, cells in mesh.volumes.items():
        elements += [f"5 2 {volumes[name]} 1 " + " ".join(str(10 + 2 * v) for v in mesh.cells[c]) for c in cells]
    lines += [str(len(elements))] + [f"{i} {element}" for i, element in enumerate(elements, start=1)]
    return "\n".join(lines + ["$EndElements", ""])


def msh4(mesh):
    """Gmsh 4.1, text: one entity for each group."""
    names, volumes, surfaces = _physical_names(mesh)
    box = "0 0 0 1 1 1"
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", *names, "$Entities", f"1 0 {len(surfaces)} {len(volumes)}",
             "1 0 0 0 0"]
    lines += [f"{tag + 100} {box} 1 {tag} 0" for tag in surfaces.values()]
    lines += [f"{tag + 200} {box} 1 {tag} 1 101" for tag in volumes.values()]
    n = len(mesh.nodes)
    lines += ["$EndEntities", "$Nodes", f"1 {n} 1 {n}", f"3 201 0 {n}", *(str(i + 1) for i in range(n))]
    lines += [" ".join(f"{x:.17g}" for x in node) for node in mesh.nodes] + ["$EndNodes", "$Elements"]
    n_elements = sum(map(len, mesh.surfaces.values())) + len(mesh.cells)
    lines += [f"{len(surfaces) + len(volumes)} {n_elements} 1 {n_elements}"]
    number = 1
    blocks = [(2, surfaces[name] + 100, 3, faces) for name, faces in mesh.surfaces.items()]
    blocks += [(3, volumes[name] + 200, 5, [mesh.cells[c] for c in cells]) for name, cells in mesh.volumes.items()]
    for dim, entity, kind, elements in blocks:
        lines += [f"{dim} {entity} {kind} {len(elements)}"]
        for element in elements:
            lines += [f"{number} " + " ".join(str(v + 1) for v in element)]
            number += 1
    return "\n".join(lines + ["$EndElements", ""])


def inp(mesh, kinds=("C3D8", "C3D8I")):
    """Abaqus: elements over two lines, volumes as ELSET on the elements and generated sets, surfaces as *SURFACE by
    element faces or as node sets, in turn. Labels in capitals, parts of an input deck that are no mesh."""
    lines = ["*HEADING", " a brake", "** a comment", "*NODE, NSET=ALL"]
    lines += [f"{i + 1}, " + ", ".join(f"{x:.17g}" for x in node) for i, node in enumerate(mesh.nodes)]
    for i, (name, cells) in enumerate(mesh.volumes.items()):
        lines += [f"*Element, type={kinds[i % len(kinds)]}, elset={name.upper()}"]
        for c in cells:
            nodes = [str(v + 1) for v in mesh.cells[c]]
            lines += [f"{c + 1}, " + ", ".join(nodes[:5]) + ",", ", ".join(nodes[5:])]
    lines += ["*ELSET, ELSET=EVERYTHING, GENERATE", f"1, {len(mesh.cells)}, 1"]
    owner = {tuple(sorted(cell[v] for v in face)): (c + 1, f + 1)
             for c, cell in enumerate(mesh.cells) for f, face in enumerate(FACES)}
    for i, (name, faces) in enumerate(mesh.surfaces.items()):
        # A face that is no cell's, as meshes for tests have it, can be named by its nodes only.
        if i % 2 or any(tuple(sorted(face)) not in owner for face in faces):
            nodes = sorted({v + 1 for face in faces for v in face})
            lines += [f"*NSET, NSET={name}"]
            lines += [", ".join(map(str, nodes[k:k + 16])) for k in range(0, len(nodes), 16)]
            continue
        by_side = {}
        for face in faces:
            element, side = owner[tuple(sorted(face))]
            by_side.setdefault(side, []).append(element)
        for side, elements in by_side.items():
            lines += [f"*ELSET, ELSET={name}_S{side}", ", ".join(map(str, elements[:16]))]
            lines += [", ".join(map(str, elements[k:k + 16])) for k in range(16, len(elements), 16)]
        lines += [f"*SURFACE, NAME={name}, TYPE=ELEMENT"] + [f"{name}_S{side}, S{side}" for side in by_side]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1e11, 0.3", "*SOLID SECTION, ELSET=EVERYTHING, MATERIAL=STEEL",
              "", "*STEP", "*NODE PRINT, NSET=ALL", "U", "*END STEP", ""]
    return "\n".join(lines)
