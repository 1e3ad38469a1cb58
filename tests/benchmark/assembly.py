#!/usr/bin/env python3
"""An assembly at rest by CalculiX and by squeal: 20 frequencies with a tie, springs and masses.

    assembly.py [--program SQUEAL] [--cells SIZE_IN_MM ...]
    assembly.py [--program SQUEAL] --matching 1

A steel beam, held at one end, carries an aluminium block: they are tied (*TIE; Joints/Ties), and their meshes do not match.
A plate above, held at one side, hangs on the block by a spring, 0.5 kg and springs to the ground act on the beam's free end.
Springs and masses act on the mean motion of a face: Joints/Points there, *EQUATION with the same weights here, which for the
faces of 20-node elements are -1/12 at corners and 1/3 at middles. CalculiX takes these elements (C3D20), squeal degree 2 on
the same cells. Printed are both programs' frequencies, their differences, and those of each from its mesh before.

With --matching the nodes of beam and block match, and each program ties them and merges them: what a tie adds is then apart from
what the elements do. On the coarsest mesh (CalculiX 2.20) the largest difference of 20 frequencies is

    CalculiX, tied to merged                  0
    squeal, tied to merged                    1.2e-11
    squeal to CalculiX, tied or merged        4.5e-3
    CalculiX to squeal's degree 3             1.13e-2
    squeal's degree 2 to its degree 3         8.2e-3

Without any tie the programs differ by as much as on meshes that do not match (14 mm: 4.7e-3; CalculiX 8.6e-3 and squeal 6.4e-3
to degree 3 there): it is the mesh error of 20-node and 27-node
elements, both larger than their difference, not the kind of tie.
"""

import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

N_MODES = 20
# name: corner, size in m, Young's modulus, Poisson's ratio, density, cells of a size relative to that of the beam
BOXES = {"beam": ((0, 0, 0), (0.3, 0.06, 0.02), 2.1e11, 0.3, 7850, 1),
         "block": ((0.12, 0.005, 0.02), (0.1, 0.05, 0.03), 7e10, 0.33, 2700, 0.8),
         "plate": ((0.1, 0, 0.08), (0.14, 0.06, 0.008), 2.1e11, 0.3, 7850, 0.9)}
HELD = [("beam", "inner"), ("plate", "inner")]  # at the least x
SPRING, TO_GROUND, MASS = (2e6, 1e6, 3e6), (1e6, 5e5, 2e5), 0.5
# Points: the mean motion of a face.
POINTS = {"end": ("beam", "outer"), "top": ("block", "high"), "under": ("plate", "low")}
SIDES = {"inner": (0, 0), "outer": (0, 1), "begin": (1, 0), "end": (1, 1), "low": (2, 0), "high": (2, 1)}


# Of beam and block, by which their nodes match: beam cells of 20 mm by 5 mm, so that a block from 120 mm and 5 mm on fits.
MATCHING = {"beam": (15, 12, 2), "block": (5, 10, 3), "plate": (10, 5, 2)}


def cells_of(name, size):
    """Numbers of cells along x, y, z; two at least across a thickness. A whole number instead of a size divides MATCHING."""
    if isinstance(size, int):
        return [size * n for n in MATCHING[name]]
    _, lengths, *_, factor = BOXES[name]
    return [max(2, round(length / (factor * size))) for length in lengths]


def coordinates(name, numbers, divisor=1):
    corner, lengths, *_ = BOXES[name]
    return [[corner[d] + lengths[d] * i / (divisor * numbers[d]) for i in range(divisor * numbers[d] + 1)]
            for d in range(3)]


def squeal_frequencies(program, size, directory, degree=2, merged=False):
    mesh = mesh_files.Mesh()
    for name in BOXES:
        first, (x, y, z) = len(mesh.nodes), coordinates(name, cells_of(name, size))
        mesh.sector(name, x, y, z)
        mesh.nodes[first:] = [(a, b, c) for c in z for b in y for a in x]
    if merged:  # blocks of one name's first word share nodes
        volumes, mesh.volumes = mesh.volumes, {f"solid.{name}": cells for name, cells in mesh.volumes.items()}
        mesh.weld()
        mesh.volumes = volumes
    pathlib.Path(directory, "assembly.msh").write_text(mesh_files.msh2(mesh))
    settings = {
        "Scene": "mesh", "Stage": "elastic", "Mesh/File": "assembly.msh", "Mesh/Curved bodies": "none",
        "Mesh/Origin": "0.17, 0.03, 0",  # the plate's middle: it counts as a rotor about that
        "Mesh/Rotor": "plate", "Mesh/Clamped": ", ".join(".".join(held) for held in HELD),
        "Joints/Ties": "" if merged else "block.low : beam.high", "Joints/Masses": f"end : {MASS}",
        "Joints/Points": ", ".join(f"{point} : {'.'.join(face)}" for point, face in POINTS.items()),
        "Joints/Springs": f"top : under : {' '.join(map(str, SPRING))}, end : ground : {' '.join(map(str, TO_GROUND))}",
        "Discretization/Degree": degree, "Eigenproblem/Maximum frequency": 11000, "Eigenproblem/Error bars": "false",
        "Output/Fields": "none"}
    sections = {"plate": "Rotor/Material", "beam": "Mesh/Part 1/Material", "block": "Mesh/Part 2/Material"}
    for k, name in enumerate(("beam", "block")):
        settings.update({f"Mesh/Part {k + 1}/Volumes": name, f"Mesh/Part {k + 1}/Body": "parts"})
    for name, section in sections.items():
        _, _, young, poisson, density, _ = BOXES[name]
        settings.update({f"{section}/Young modulus": young, f"{section}/Poisson ratio": poisson,
                         f"{section}/Density": density})
    pathlib.Path(directory, "assembly.prm").write_text(st.parameter_file(settings))
    done = st.run("assembly.prm", "--overwrite", directory=directory, executable=program, timeout=1800)
    if done.returncode != 0:
        sys.exit(done.stdout[-2000:] + done.stderr)
    results = pathlib.Path(directory, "output/assembly")
    unknowns = int(st.read_table(results / "cycles.csv")[-1]["dofs"])
    return unknowns, sorted(row["frequency_hz"] for row in st.read_table(results / "modes.csv"))[:N_MODES]


def calculix_input(size, merged=False):
    numbers, nodes, text, at_place = {}, [], [], {}
    n_elements, surfaces, held = 0, {}, []
    weights = {point: {} for point in POINTS}
    for name in BOXES:
        n = cells_of(name, size)
        x, y, z = coordinates(name, n, 2)

        def node(i, j, k, name=name, x=x, y=y, z=z):
            if (name, i, j, k) not in numbers:
                place = f"{x[i]:.10e}, {y[j]:.10e}, {z[k]:.10e}"
                if place not in at_place or not merged:
                    at_place[place] = len(nodes) + 1
                    nodes.append(f"{len(nodes) + 1}, {place}")
                numbers[name, i, j, k] = at_place[place]
            return numbers[name, i, j, k]

        text.append(f"*ELEMENT, TYPE=C3D20, ELSET={name}")
        corners, middles = [(0, 0), (2, 0), (2, 2), (0, 2)], [(1, 0), (2, 1), (1, 2), (0, 1)]
        for a in range(n[0]):
            for b in range(n[1]):
                for c in range(n[2]):
                    at = lambda i, j, k: node(2 * a + i, 2 * b + j, 2 * c + k)
                    element = ([at(i, j, 0) for i, j in corners] + [at(i, j, 2) for i, j in corners]
                               + [at(i, j, 0) for i, j in middles] + [at(i, j, 2) for i, j in middles]
                               + [at(i, j, 1) for i, j in corners])
                    n_elements += 1
                    text += [", ".join(map(str, [n_elements, *element[:14]])) + ",", ", ".join(map(str, element[14:]))]
                    if c == 0:
                        surfaces.setdefault((name, "low"), []).append(f"{n_elements}, S1")
                    if c == n[2] - 1:
                        surfaces.setdefault((name, "high"), []).append(f"{n_elements}, S2")
        for side, (d, high) in SIDES.items():
            if (name, side) in HELD:
                held += [number for key, number in numbers.items() if key[0] == name and key[1 + d] == 0]
            for point, face in POINTS.items():
                if face != (name, side):
                    continue
                # The mean of 8-node faces: -1/12 of a face at corners, 1/3 at middles.
                others, fixed = [e for e in range(3) if e != d], 2 * n[d] * high
                part = 1 / (n[others[0]] * n[others[1]])
                for u in range(n[others[0]]):
                    for v in range(n[others[1]]):
                        for p, q, w in [(0, 0, -1 / 12), (2, 0, -1 / 12), (2, 2, -1 / 12), (0, 2, -1 / 12),
                                        (1, 0, 1 / 3), (2, 1, 1 / 3), (1, 2, 1 / 3), (0, 1, 1 / 3)]:
                            at = [0, 0, 0]
                            at[d], at[others[0]], at[others[1]] = fixed, 2 * u + p, 2 * v + q
                            number = node(*at)
                            weights[point][number] = weights[point].get(number, 0) + w * part
    n_solid = len(nodes)
    points = {}
    for point in POINTS:
        points[point] = len(nodes) + 1
        nodes.append(f"{len(nodes) + 1}, 0, 0, {len(points)}")  # where it is does not matter
    text = ["*NODE, NSET=ALL", *nodes, *text]
    text += ["*NSET, NSET=HELD", *(f"{number}," for number in held)]
    for (name, side), faces in surfaces.items():
        text += [f"*SURFACE, NAME={name}_{side}, TYPE=ELEMENT", *faces]
    if not merged:
        text += ["*TIE, NAME=TIED, POSITION TOLERANCE=1e-4", "block_low, beam_high"]
    # r - sum w u = 0, r being the one that is eliminated
    for point, number in points.items():
        for c in (1, 2, 3):
            text += ["*EQUATION", str(len(weights[point]) + 1)]
            terms = [f"{number}, {c}, 1."] + [f"{a}, {c}, {-w:.12e}" for a, w in weights[point].items()]
            text += [", ".join(terms[k:k + 4]) for k in range(0, len(terms), 4)]
    for c in (0, 1, 2):
        text += [f"*ELEMENT, TYPE=SPRING2, ELSET=S{c}", f"{n_elements + 1}, {points['top']}, {points['under']}",
                 f"*SPRING, ELSET=S{c}", f"{c + 1}, {c + 1}", str(SPRING[c]),
                 f"*ELEMENT, TYPE=SPRING1, ELSET=G{c}", f"{n_elements + 2}, {points['end']}",
                 f"*SPRING, ELSET=G{c}", f"{c + 1}", str(TO_GROUND[c])]
        n_elements += 2
    text += ["*ELEMENT, TYPE=MASS, ELSET=M", f"{n_elements + 1}, {points['end']}", "*MASS, ELSET=M", str(MASS)]
    for name, (_, _, young, poisson, density, _) in BOXES.items():
        text += [f"*MATERIAL, NAME=M{name}", "*ELASTIC", f"{young}, {poisson}", "*DENSITY", str(density),
                 f"*SOLID SECTION, ELSET={name}, MATERIAL=M{name}"]
    text += ["*BOUNDARY", "HELD, 1, 3", "*STEP", "*FREQUENCY", str(N_MODES), "*END STEP"]
    return "\n".join(text) + "\n", 3 * (n_solid - len(held))


def calculix_frequencies(size, directory, merged=False):
    text, unknowns = calculix_input(size, merged)
    pathlib.Path(directory, "assembly.inp").write_text(text)
    done = subprocess.run(["ccx", "assembly"], cwd=directory, capture_output=True, text=True, env=st.ENVIRONMENT)
    data = pathlib.Path(directory, "assembly.dat")
    table = data.read_text() if data.exists() else ""
    found = [float(m[1]) for m in re.finditer(r"^\s+\d+\s+\S+E\S+\s+\S+E\S+\s+(\S+E\S+)\s+\S+E\S+\s*$", table,
                                              re.MULTILINE)][:N_MODES]
    if len(found) < N_MODES:
        sys.exit(f"CalculiX: {len(found)} of {N_MODES} modes\n{done.stdout[-2000:]}")
    return unknowns, found


def compare_matching(program, n):
    """Ties beside merged nodes in both programs, and both beside degree 3."""
    with tempfile.TemporaryDirectory() as directory:
        _, other = calculix_frequencies(n, directory, merged=True)
        _, other_tied = calculix_frequencies(n, directory)
        _, own = squeal_frequencies(program, n, directory, merged=True)
        _, own_tied = squeal_frequencies(program, n, directory)
        _, fine = squeal_frequencies(program, n, directory, degree=3, merged=True)
    for what, a, b in [("CalculiX, tied to merged", other_tied, other), ("squeal, tied to merged", own_tied, own),
                       ("squeal to CalculiX, merged", own, other), ("squeal to CalculiX, tied", own_tied, other_tied),
                       ("CalculiX to squeal's degree 3", other, fine), ("squeal's degree 2 to its degree 3", own, fine)]:
        print(f"{what:<36}{max(abs(x / y - 1) for x, y in zip(a, b)):10.2e}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=st.PROJECT / "build/release/squeal")
    parser.add_argument("--cells", type=float, nargs="+", default=[14, 10, 7], help="sizes of the cells, mm")
    parser.add_argument("--matching", type=int, metavar="N", help="matching nodes, cells divided by N")
    arguments = parser.parse_args()
    if not shutil.which("ccx"):
        sys.exit("The program ccx is not installed (Debian: calculix-ccx).")
    if arguments.matching:
        compare_matching(arguments.program, arguments.matching)
        return
    last = None
    for millimetres in arguments.cells:
        size = millimetres * 1e-3
        with tempfile.TemporaryDirectory() as directory:
            n_other, other = calculix_frequencies(size, directory)
            n_own, own = squeal_frequencies(arguments.program, size, directory)
        print(f"cells of {millimetres:g} mm: CalculiX {n_other} unknowns, squeal {n_own}")
        print(f"{'mode':>4} {'CalculiX, Hz':>14} {'squeal, Hz':>14} {'difference':>11}", end="")
        print(f" {'to the last: CalculiX':>22} {'squeal':>10}" if last else "")
        for k, (a, b) in enumerate(zip(other, own)):
            print(f"{k + 1:4d} {a:14.4f} {b:14.4f} {(b - a) / a:11.2e}", end="")
            print(f" {(a - last[0][k]) / a:22.2e} {(b - last[1][k]) / b:10.2e}" if last else "")
        last = (other, own)
        print(f"largest difference {max(abs(b - a) / a for a, b in zip(other, own)):.2e}", flush=True)


if __name__ == "__main__":
    main()
