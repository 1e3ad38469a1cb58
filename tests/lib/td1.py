"""The disc brake of Ansys' technology demonstration td-1, "disc brake squeal analysis" (public documentation of PyMAPDL,
extended examples): dimensions, published modes, and a mesh like the published one.

Each part has a mesh of its own; the parts are tied where they meet (tests/validation/td1.prm). Lengths in mm.
"""

import math

import mesh_files

# Of the published mode table: frequencies, Hz, the two of the unstable pair, and its growth rate, 1/s.
FREQUENCIES = [775.91, 863.54, 1097.18, 1311.54, 1328.73, 1600.95, 1616.15, 1910.50, 2070.73, 2081.26, 2676.71, 2724.05,
               3373.96, 4141.64, 4145.16, 4433.91, 4486.50, 4668.51, 4767.54, 5241.61, 6474.25, 6474.25, 6763.36, 6765.62,
               6920.64, 6929.25, 7069.69, 7243.80, 8498.41, 8623.76]
FLUTTER, GROWTH_RATE = 6474.25, 135.8


def _hub(mesh, n_side, n_out):
    """The hub plate with its five holes: around each hole, from its edge to the edge of a fifth of the plate, cells along
    rays."""
    inner, outer, middle, hole, heights = 40, 105, 75, 10, [65, 75]
    for k in range(5):
        phi = math.pi / 2 + 2 * math.pi * k / 5
        half = math.pi / 5
        # The edge of the fifth, n_side cells a side, around the hole
        rim = [(outer, phi + half * (2 * i / n_side - 1)) for i in range(n_side)]
        rim += [(outer + (inner - outer) * i / n_side, phi + half) for i in range(n_side)]
        rim += [(inner, phi - half * (2 * i / n_side - 1)) for i in range(n_side)]
        rim += [(inner + (outer - inner) * i / n_side, phi - half) for i in range(n_side)]
        rim = [(r * math.cos(a), r * math.sin(a)) for r, a in rim]
        x, y = middle * math.cos(phi), middle * math.sin(phi)
        first, n = len(mesh.nodes), len(rim)
        mesh.sector("fifth", range(n_out + 1), range(n + 1), heights, ring=True, volume_of=lambda _: "hub")
        places = []
        for z in heights:
            for a, b in rim:
                length = math.hypot(a - x, b - y)
                for i in range(n_out + 1):
                    t = (hole + (length - hole) * i / n_out) / length
                    places.append((x + t * (a - x), y + t * (b - y), z))
        mesh.nodes[first:] = places
        faces = {side: mesh.surfaces.pop(f"fifth.{side}") for side in ("inner", "outer", "low", "high")}
        for side, of_side in (("hole", faces["inner"]), ("outer", faces["outer"][:n_side]),
                              ("inner", faces["outer"][2 * n_side:3 * n_side])):
            mesh.surfaces.setdefault(f"hub.{side}", []).extend(of_side)


def _vanes(mesh, n_along, n_across, n_high):
    """21 vanes with sides parallel to a ray."""
    for k in range(21):
        phi = math.radians(4.286 + 360 / 21 * k)
        first = len(mesh.nodes)
        radii = mesh_files.equal(125, 175, n_along)
        across, heights = mesh_files.equal(-14.96, 13.74, n_across), mesh_files.equal(10, 25, n_high)
        mesh.sector("vane", radii, across, heights)
        # Along the ray and across
        places = [(math.sqrt(r * r - y * y), y, z) for z in heights for y in across for r in radii]
        mesh.nodes[first:] = [(x * math.cos(phi) - y * math.sin(phi), x * math.sin(phi) + y * math.cos(phi), z)
                              for x, y, z in places]


def mesh(n_around=42, n_plate=(4, 1), n_vane=(3, 2, 2), n_hat=2, n_hub=(3, 1), n_pad=(4, 8, 2)):
    """Cells around; of the plates along the radius and the thickness, of a vane along, across and high, of the hat above the
    disc, of the hub along a side and out of a hole, of a pad. The hat and the hub are as coarse as their published
    frequencies say."""
    result = mesh_files.Mesh()
    around = mesh_files.equal(0, 2 * math.pi, n_around)
    for name, low, high in (("low", 0, 10), ("high", 25, 35)):
        result.sector(name, mesh_files.equal(125, 175, n_plate[0]), around, mesh_files.equal(low, high, n_plate[1]), ring=True)
    result.sector("ring", [112.5, 125], around, mesh_files.equal(0, 10, n_plate[1]), ring=True)
    result.sector("hat", [105, 112.5], around, [0, 10, *mesh_files.equal(10, 65, n_hat)[1:], 75], ring=True)
    _vanes(result, *n_vane)
    _hub(result, *n_hub)
    for name, low, high in (("upper", 35, 50), ("lower", -15, 0)):
        result.sector(name, mesh_files.equal(130, 167.5, n_pad[0]),
                      mesh_files.equal(math.pi / 3, 2 * math.pi / 3, n_pad[1]), mesh_files.equal(low, high, n_pad[2]))
    result.weld()
    return result
