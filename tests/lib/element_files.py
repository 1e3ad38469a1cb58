"""Meshes of tetrahedra and wedges out of those of mesh_files.py, and decks as preprocessors write them.

Elements are tuples of nodes: corners, then middles of edges in the order of Abaqus.
"""

import math

import mesh_files

# Six tetrahedra of a hexahedron about the diagonal 0 6, two wedges with axes upwards. Cells that are numbered alike
# cut their common faces alike.
TETRAHEDRA = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
WEDGES = [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)]
EDGES = {
    4: [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    6: [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    8: [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
}
FACES = {
    4: [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)],
    6: [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)],
    8: mesh_files.FACES,
}
KINDS = {4: "C3D4", 6: "C3D6", 8: "C3D8", 10: "C3D10", 15: "C3D15", 20: "C3D20R"}
N_CORNERS = {4: 4, 6: 6, 8: 8, 10: 4, 15: 6, 20: 8}
# Gmsh's types, and where each of its nodes is in Abaqus' order (checked with Gmsh 4.8 on elements with straight edges)
GMSH = {
    4: (4, range(4)),
    6: (6, range(6)),
    8: (5, range(8)),
    10: (11, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]),
    15: (18, [0, 1, 2, 3, 4, 5, 6, 8, 12, 7, 13, 14, 9, 11, 10]),
    20: (17, [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14]),
}


class Elements:
    """Nodes, elements, volumes by name (numbers of elements), surfaces by name (element, face)."""

    def __init__(self, mesh, into):
        """The cells of a mesh; into(volume name) is 4, 6 or 8: the corners of the elements that its cells become."""
        self.nodes, self.elements, self.volumes, self.surfaces = list(mesh.nodes), [], {}, {}
        for name, cells in mesh.volumes.items():
            parts = {4: TETRAHEDRA, 6: WEDGES, 8: [range(8)]}[into(name)]
            for c in cells:
                for part in parts:
                    self.volumes.setdefault(name, []).append(len(self.elements))
                    self.elements.append(tuple(mesh.cells[c][v] for v in part))
        wanted = {name: {tuple(sorted(face)) for face in faces} for name, faces in mesh.surfaces.items()}
        for e, element in enumerate(self.elements):
            for f, face in enumerate(FACES[len(element)]):
                corners = {element[v] for v in face}
                for name, faces in wanted.items():
                    if any(corners <= set(quad) for quad in self._candidates(faces, corners)):
                        self.surfaces.setdefault(name, []).append((e, f))

    def _candidates(self, faces, corners):
        key = id(faces)
        if not hasattr(self, "_by_node"):
            self._by_node = {}
        if key not in self._by_node:
            by_node = {}
            for quad in faces:
                for v in quad:
                    by_node.setdefault(v, []).append(quad)
            self._by_node[key] = by_node
        return self._by_node[key].get(min(corners), [])

    def make_quadratic(self, place=None):
        """Middle nodes, at place(a, b) in some volumes, {name: place}, and half way in the others."""
        middles = {}
        volume_of = {e: name for name, elements in self.volumes.items() for e in elements}
        for e, element in enumerate(self.elements):
            in_volume = (place or {}).get(volume_of[e], lambda a, b: tuple((x + y) / 2 for x, y in zip(a, b)))
            for a, b in EDGES[len(element)]:
                key = tuple(sorted((element[a], element[b])))
                if key not in middles:
                    middles[key] = len(self.nodes)
                    self.nodes.append(in_volume(self.nodes[key[0]], self.nodes[key[1]]))
                self.elements[e] += (middles[key],)


def on_circle(a, b):
    """Half way along the circle about z between two places, as the program's curved bodies have it."""
    x, y, z = ((p + q) / 2 for p, q in zip(a, b))
    r, straight = (math.hypot(*a[:2]) + math.hypot(*b[:2])) / 2, math.hypot(x, y)
    return x * r / straight, y * r / straight, z


def brake_graded_at_the_clamp(n_corners, heights=(-0.006, -0.0042, 0.0042, 0.006)):
    """The default brake, whose disc has short cells at the clamp's edges, where stress is singular, and lines of cells under
    the pads' edges; heights are those of the disc's layers. The pads' cells become elements with so many corners, quadratic
    if they are divided."""
    radii, half = [0.05, 0.052, 0.06, 0.09, 0.115, 0.14, 0.15], math.radians(25)
    on_pad = mesh_files.equal(-half, half, 4)
    mesh = mesh_files.Mesh()
    mesh.sector("rotor", radii, on_pad + mesh_files.equal(half, 2 * math.pi - half, 31)[1:],
                list(heights), ring=True)
    for name, low in (("upper", 0.006), ("lower", -0.018)):
        mesh.sector(name, radii[3:6], on_pad, [low, low + 0.012])
    elements = Elements(mesh, lambda name: 8 if name == "rotor" else n_corners)
    if n_corners < 8:
        elements.make_quadratic({name: on_circle for name in mesh.volumes})
    return elements


def lines_of(numbers):
    return [", ".join(map(str, numbers[k:k + 16])) for k in range(0, len(numbers), 16)]


def _element_lines(mesh, elements, number):
    by_kind = {}
    for e in elements:
        by_kind.setdefault(KINDS[len(mesh.elements[e])], []).append(e)
    lines = []
    for kind, members in by_kind.items():
        lines += [f"*Element, type={kind}"]
        for e in members:
            nodes = [str(number(v)) for v in mesh.elements[e]]
            lines += [f"{e + 1}, " + ", ".join(nodes[:12]) + ("," if nodes[12:] else "")]
            lines += [", ".join(nodes[12:])] if nodes[12:] else []
    return lines


def inp(mesh):
    """A flat deck."""
    lines = ["*NODE"] + [f"{i + 1}, " + ", ".join(f"{x:.17g}" for x in node) for i, node in enumerate(mesh.nodes)]
    lines += _element_lines(mesh, range(len(mesh.elements)), lambda v: v + 1)
    for name, elements in mesh.volumes.items():
        lines += [f"*ELSET, ELSET={name}"] + lines_of([e + 1 for e in elements])
    for name, faces in mesh.surfaces.items():
        lines += [f"*SURFACE, NAME={name}"] + [f"{e + 1}, S{f + 1}" for e, f in faces]
    return "\n".join(lines + [""])


def assembly(mesh, bodies, include=False):
    """(deck, included file): bodies {name: its volumes} as parts with one instance each, at another place and turned
    by 90 degrees before they are placed; surfaces by internal sets of the assembly. The surfaces keep their names;
    volumes are <name>-1.<volume>."""
    lines, instances, nodes_file = ["*Heading", "** Generated", "*Preprint, echo=NO"], [], None
    of_body = {e: body for body, volumes in bodies.items() for volume in volumes for e in mesh.volumes[volume]}
    for body, volumes in bodies.items():
        elements = [e for volume in volumes for e in mesh.volumes[volume]]
        own = {v: i + 1 for i, v in enumerate(sorted({v for e in elements for v in mesh.elements[e]}))}
        lines += [f"*Part, name={body}", "*Node"]
        # The instance moves by (1, 2, 3), then turns by 90 degrees about a line along z through (1, 2): x' = 1 - y,
        # y' = 2 + x, z' = 3 + z of the part's coordinates.
        rows = [f"{i}, {mesh.nodes[v][1] - 2:.17g}, {1 - mesh.nodes[v][0]:.17g}, {mesh.nodes[v][2] - 3:.17g}"
                for v, i in own.items()]
        if include and nodes_file is None:
            nodes_file = "\n".join(rows + [""])
            lines += ["*Include, input=nodes.txt"]
        else:
            lines += rows
        lines += _element_lines(mesh, elements, own.get)
        for volume in volumes:
            lines += [f"*Elset, elset={volume}"] + lines_of([e + 1 for e in mesh.volumes[volume]])
        lines += ["*End Part", "**"]
        instances += [f"*Instance, name={body}-1, part={body}", "1., 2., 3.", "1., 2., 0., 1., 2., 1., 90.",
                      "*End Instance", "**"]
    lines += ["*Assembly, name=Assembly", "**", *instances]
    for name, faces in mesh.surfaces.items():
        by_side = {}
        for e, f in faces:
            by_side.setdefault((f + 1, of_body[e]), []).append(e + 1)
        for (side, body), elements in by_side.items():
            lines += [f"*Elset, elset=_{name}_S{side}, internal, instance={body}-1"] + lines_of(elements)
        lines += [f"*Surface, type=ELEMENT, name={name}"] + [f"_{name}_S{side}, S{side}" for side, _ in by_side]
    return "\n".join(lines + ["*End Assembly", "*Material, name=steel", "*Elastic", "2.1e11, 0.3", ""]), nodes_file


# What a deck of the default brake has beside its mesh, in mm, t, s.
MODEL = """*Material, name=Iron
*Density
 7.2e-09,
*Damping, beta=1e-07
*Elastic
125000., 0.25
*Material, name=Lining
*Elastic
10000., 0.3
*Density
 2.5e-09,
*Damping, beta=2e-06
*Surface Interaction, name=IntProp-1
1.,
*Friction, slip tolerance=0.005
 0.6,
*Surface Behavior, pressure-overclosure=HARD
*Contact Pair, interaction=IntProp-1, small sliding
upper.low, rotor.high
** The rotor's side first
*Contact Pair, interaction=IntProp-1
rotor.low, lower.high
*Boundary
_held, ENCASTRE
_guided, 1, 2
*Step, name=Modes, nlgeom=NO
*Static
*Motion, rotation, type=VELOCITY
_held, 20., 0., 0., 0., 0., 0., 1.
*Dsload
upper.high, P, 1.
lower.low, P, 1.
*Complex Frequency
20, , 6000.
*Node Output
U
*End Step
"""


# Parts of the default brake and their materials, and node sets of its supports.
BODIES = {"rotor": ("Disc", "Iron"), "upper": ("Up", "Lining"), "lower": ("Low", "Lining")}
SUPPORTS = {"_held": ["rotor.inner"], "_guided": ["upper.high", "lower.low"]}


def _nodes_of(mesh, surface, number):
    return sorted({number(mesh.elements[e][v]) for e, f in mesh.surfaces[surface]
                   for v in FACES[N_CORNERS[len(mesh.elements[e])]][f]})


def brake_deck(mesh, bodies=BODIES, supports=SUPPORTS):
    """(deck, included file) of a brake with parts, in mm, up to MODEL: sections, sets of its supports."""
    mesh.nodes = [tuple(1000 * x for x in node) for node in mesh.nodes]
    deck, nodes = assembly(mesh, {part: [body] for body, (part, _) in bodies.items()}, True)
    deck = deck[:deck.index("*Material")]
    for body, (_, material) in bodies.items():
        end = deck.index("*End Part", deck.index(f"*Elset, elset={body}\n"))
        deck = deck[:end] + f"*Solid Section, elset={body}, material={material}\n,\n" + deck[end:]
    lines = []
    for name, surfaces in supports.items():
        for surface in surfaces:
            body = surface.split(".")[0]
            own = {v: i + 1 for i, v in enumerate(sorted({v for e in mesh.volumes[body] for v in mesh.elements[e]}))}
            lines += [f"*Nset, nset={name}, internal, instance={bodies[body][0]}-1",
                      *lines_of(_nodes_of(mesh, surface, own.get))]
    return deck.replace("*End Assembly", "\n".join([*lines, "*End Assembly"])), nodes


def flat_deck(mesh, bodies=BODIES, supports=SUPPORTS):
    """Makes the deck of brake_deck() without parts, in the mesh's own unit."""
    lines = [inp(mesh).rstrip("\n")]
    lines += [f"*Solid Section, elset={body}, material={material}" for body, (_, material) in bodies.items()]
    for name, surfaces in supports.items():
        lines += [f"*Nset, nset={name}", *lines_of(sorted({v for s in surfaces for v in _nodes_of(mesh, s, lambda v: v + 1)}))]
    return "\n".join([*lines, ""])


def msh2(mesh):
    """Gmsh 2.2."""
    surfaces = {name: i for i, name in enumerate(mesh.surfaces, start=1)}
    volumes = {name: i for i, name in enumerate(mesh.volumes, start=1)}
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(surfaces) + len(volumes))]
    lines += [f'2 {i} "{name}"' for name, i in surfaces.items()] + [f'3 {i} "{name}"' for name, i in volumes.items()]
    lines += ["$EndPhysicalNames", "$Nodes", str(len(mesh.nodes))]
    lines += [f"{i + 1} " + " ".join(f"{x:.17g}" for x in node) for i, node in enumerate(mesh.nodes)]
    elements = []
    for name, faces in mesh.surfaces.items():
        for e, f in faces:
            element = mesh.elements[e]
            corners = [element[v] for v in FACES[N_CORNERS[len(element)]][f]]
            elements.append((2 if len(corners) == 3 else 3, surfaces[name], corners))
    for name, members in mesh.volumes.items():
        for e in members:
            kind, order = GMSH[len(mesh.elements[e])]
            elements.append((kind, volumes[name], [mesh.elements[e][v] for v in order]))
    lines += ["$EndNodes", "$Elements", str(len(elements))]
    lines += [f"{i} {kind} 2 {tag} 1 " + " ".join(str(v + 1) for v in nodes)
              for i, (kind, tag, nodes) in enumerate(elements, start=1)]
    return "\n".join(lines + ["$EndElements", ""])
