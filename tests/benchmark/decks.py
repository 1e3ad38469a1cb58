"""Decks of quadratic tetrahedra as engineers have them: seconds and memory by the number of nodes.

A disc (radii 50 and 140 mm, 20 mm thick) and two pads of 60 degrees, meshed by Gmsh with elements of some size, all modes below
3 kHz, stage full, with error bars, one core. Beside it CalculiX (ccx), where it is installed: the first twelve elastic modes of the
same elements with the pads tied. Processor seconds are of the process and all that it started.

    python3 tests/benchmark/decks.py                 # sizes 14 and 9 mm: some two minutes
    python3 tests/benchmark/decks.py 14 9 5.2 4.5    # up to 110 000 nodes: half an hour and 16 GiB
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402
from runs import processor_seconds  # noqa: E402

# The faces in one plane: the disc's is the larger one.
FACES_AT = """s() = Surface In BoundingBox{{-141,-141,{z}-e,141,141,{z}+e}};
For i In {{0:#s()-1}}
  bb() = BoundingBox Surface{{s(i)}};
  If (bb(0) < -100)
    Physical Surface("disc {side}") = {{s(i)}};
  Else
    Physical Surface("{pad} contact") = {{s(i)}};
  EndIf
EndFor
"""

GEOMETRY = """
SetFactory("OpenCASCADE");
Cylinder(1) = {0,0,-10, 0,0,20, 140};
Cylinder(2) = {0,0,-10, 0,0,20, 50};
BooleanDifference(10) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Cylinder(21) = {0,0,10, 0,0,15, 135, Pi/3};
Cylinder(22) = {0,0,10, 0,0,15, 80, Pi/3};
BooleanDifference(20) = { Volume{21}; Delete; }{ Volume{22}; Delete; };
Rotate {{0,0,1},{0,0,0},-Pi/6} { Volume{20}; }
Cylinder(31) = {0,0,-25, 0,0,15, 135, Pi/3};
Cylinder(32) = {0,0,-25, 0,0,15, 80, Pi/3};
BooleanDifference(30) = { Volume{31}; Delete; }{ Volume{32}; Delete; };
Rotate {{0,0,1},{0,0,0},-Pi/6} { Volume{30}; }
Physical Volume("disc") = {10};
Physical Volume("upper") = {20};
Physical Volume("lower") = {30};
e = 0.01;
@FACES@
Physical Surface("upper back") = Surface In BoundingBox{-141,-141,25-e,141,141,25+e};
Physical Surface("lower back") = Surface In BoundingBox{-141,-141,-25-e,141,141,-25+e};
s() = Surface In BoundingBox{-51,-51,-11,51,51,11};
Physical Surface("bore") = {s()};
Mesh.MeshSizeMin = h; Mesh.MeshSizeMax = h;
Mesh.ElementOrder = 2;
Mesh.MshFileVersion = 2.2;
""".replace("@FACES@\n", FACES_AT.format(z=10, side="top", pad="upper") + FACES_AT.format(z=-10, side="bottom", pad="lower"))

SETTINGS = {"Scene": "mesh", "Stage": "full", "Mesh/File": "brake.msh", "Mesh/Scale": 1e-3, "Mesh/Rotor": "disc",
            "Mesh/Pads": "upper, lower", "Mesh/Contact pairs": "upper contact : disc top, lower contact : disc bottom",
            "Mesh/Pressure on": "upper back, lower back", "Mesh/Guided": "upper back, lower back", "Mesh/Clamped": "bore",
            "Pads/Pressure": 1e6, "Contact/Friction/Coefficient": 0.5, "Operation/Angular velocity": 10, "Discretization/Degree": 2,
            "Eigenproblem/Maximum frequency": 3000, "Output/Fields": "none"}
FACES = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]  # S1 to S4
MATERIALS = {"disc": (115000, 0.26, 7.2e-9), "upper": (10000, 0.3, 2.5e-9), "lower": (10000, 0.3, 2.5e-9)}


def read_mesh(path):
    """Nodes, elements by volume, triangles' nodes by surface."""
    lines = path.read_text().split("\n")

    def section(name):
        first = lines.index("$" + name)
        return lines[first + 2:first + 2 + int(lines[first + 1])]
    names = {tuple(map(int, line.split()[:2])): line.split('"')[1] for line in section("PhysicalNames")}
    nodes = {int(line.split()[0]): line.split()[1:] for line in section("Nodes")}
    volumes, surfaces = {}, {}
    for line in section("Elements"):
        numbers = list(map(int, line.split()))
        kind, tag, own = numbers[1], numbers[3], numbers[3 + numbers[2]:]
        if kind == 11:
            volumes.setdefault(names[3, tag], []).append((numbers[0], own[:8] + [own[9], own[8]]))
        elif kind == 9:
            surfaces.setdefault(names[2, tag], []).append(own)
    return nodes, volumes, surfaces


def write_deck(path, nodes, volumes, surfaces):
    """The elastic problem of CalculiX: pads tied, twelve modes."""
    with path.open("w") as deck:
        deck.write("*NODE\n" + "".join(f"{n}, {', '.join(f'{float(x):.9g}' for x in xyz)}\n" for n, xyz in nodes.items()))
        faces = {}
        for name, elements in volumes.items():
            deck.write(f"*ELEMENT, TYPE=C3D10, ELSET={name}\n")
            for number, own in elements:
                deck.write(f"{number}, {', '.join(map(str, own))}\n")
                for f, corners in enumerate(FACES):
                    faces[tuple(sorted(own[c] for c in corners))] = (number, f + 1)
            modulus, ratio, density = MATERIALS[name]
            deck.write(f"*MATERIAL, NAME=M{name}\n*ELASTIC\n{modulus}, {ratio}\n*DENSITY\n{density}\n"
                       f"*SOLID SECTION, ELSET={name}, MATERIAL=M{name}\n")
        for name in ("bore", "upper back", "lower back"):
            members = sorted({n for triangle in surfaces[name] for n in triangle})
            deck.write(f"*NSET, NSET={name.replace(' ', '')}\n" + "".join(f"{n},\n" for n in members))
        for name in ("upper contact", "lower contact", "disc top", "disc bottom"):
            deck.write(f"*SURFACE, NAME={name.replace(' ', '')}, TYPE=ELEMENT\n")
            for triangle in surfaces[name]:
                element, face = faces[tuple(sorted(triangle[:3]))]
                deck.write(f"{element}, S{face}\n")
        for name, pad, disc in (("T1", "uppercontact", "disctop"), ("T2", "lowercontact", "discbottom")):
            deck.write(f"*TIE, NAME={name}, POSITION TOLERANCE=0.5\n{pad}, {disc}\n")
        deck.write("*BOUNDARY\nbore, 1, 3\nupperback, 1, 2\nlowerback, 1, 2\n*STEP\n*FREQUENCY\n12\n*END STEP\n")


def used_by(run):
    """Processor seconds of what run() starts, and its result."""
    before = processor_seconds()
    result = run()
    return processor_seconds() - before, result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", nargs="*", type=float, default=[14, 9], help="of elements, mm")
    arguments = parser.parse_args()
    if not shutil.which("gmsh"):
        sys.exit("Gmsh is needed: scripts/install-dependencies.sh --mesh")
    with_ccx = shutil.which("ccx") is not None
    print("size   nodes   unknowns   modes   largest bar   seconds    MiB" + ("   CalculiX: seconds    MiB" if with_ccx else ""))
    with tempfile.TemporaryDirectory(prefix="squeal-decks-") as scratch:
        directory = pathlib.Path(scratch)
        (directory / "brake.geo").write_text(GEOMETRY)
        for size in arguments.sizes:
            subprocess.run(["gmsh", "-3", "-v", "1", "-setnumber", "h", str(size), "brake.geo", "-o", "brake.msh"],
                           cwd=directory, check=True, capture_output=True)
            nodes, volumes, surfaces = read_mesh(directory / "brake.msh")
            used = {n for elements in volumes.values() for _, own in elements for n in own}
            (directory / "brake.prm").write_text(st.parameter_file(SETTINGS))
            seconds, result = used_by(lambda: st.run("brake.prm", "--overwrite", directory=directory, timeout=7200))
            if result.returncode != 0:
                sys.exit(result.stdout + result.stderr)
            modes = st.read_table(directory / "output/brake/modes.csv")
            cycle = st.read_table(directory / "output/brake/cycles.csv")[0]
            bar = max(row["frequency_error_hz"] / row["frequency_hz"] for row in modes)
            line = f"{size:4g}{len(used):8}{int(cycle['dofs']):11}{len(modes):8}{bar:13.1e}{seconds:11.0f}{cycle['memory_mib']:7.0f}"
            if with_ccx:
                write_deck(directory / "elastic.inp", {n: nodes[n] for n in used}, volumes, surfaces)
                seconds, result = used_by(lambda: subprocess.run(
                    ["/usr/bin/env", "python3", "-c",
                     "import resource, subprocess, sys\n"
                     "code = subprocess.run(['ccx', '-i', 'elastic'], capture_output=True).returncode\n"
                     "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024)\nsys.exit(code)"],
                    cwd=directory, capture_output=True, text=True, env={**os.environ, "OMP_NUM_THREADS": "1"}))
                line += f"{seconds:20.0f}{int(result.stdout or 0):7}" + ("" if result.returncode == 0 else " failed")
            print(line, flush=True)


if __name__ == "__main__":
    main()
