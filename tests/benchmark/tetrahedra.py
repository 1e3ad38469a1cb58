"""Quadratic tetrahedra (C3D10) against hexahedra: error of 20 frequencies against unknowns and seconds, and the error bars.

A ring (radii 0.1 and 0.14 m, 20 mm thick) and a block (120, 60 and 30 mm) of steel, free, alone. Each hexahedron becomes six
tetrahedra with middle nodes, on circles about the axis for the ring; the program divides each into four hexahedra. The same
hexahedra, linear and with degree 2, stand beside. The reference is degree 5 on hexahedra. Printed for degree 2: elements of
the file, unknowns, the largest relative error of the first 20 elastic frequencies, how many of them the bars cover, the median of
bar / error, processor seconds.

    python3 tests/benchmark/tetrahedra.py             # about five processor minutes
"""

import math
import pathlib
import statistics
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import element_files  # noqa: E402
import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

WANTED = 20
SETTINGS = {"Scene": "mesh", "Stage": "elastic", "Mesh/File": "part.msh", "Mesh/Rotor": "", "Mesh/Part 1/Volumes": "part",
            "Mesh/Part 1/Body": "parts", "Output/Fields": "none"}


def ring(n):
    mesh = mesh_files.Mesh()
    mesh.sector("part", mesh_files.equal(0.1, 0.14, n), mesh_files.equal(0, 2 * math.pi, 12 * n),
                mesh_files.equal(-0.01, 0.01, max(1, n // 2)), ring=True)
    return mesh


def block(n):
    mesh = mesh_files.Mesh()
    mesh.sector("part", mesh_files.equal(1, 1.12, 4 * n), mesh_files.equal(-0.03, 0.03, 2 * n), mesh_files.equal(0, 0.03, n))
    mesh.nodes = [(math.hypot(x, y) - 1, math.atan2(y, x), z) for x, y, z in mesh.nodes]
    return mesh


def run(directory, mesh, tetrahedra, degree, curved, below, bars):
    """Rows of the elastic modes, unknowns, processor seconds, number of elements."""
    elements = element_files.Elements(mesh, lambda name: 4 if tetrahedra else 8)
    if tetrahedra:
        elements.make_quadratic({"part": element_files.on_circle} if curved else None)
    (directory / "part.msh").write_text(element_files.msh2(elements))
    settings = {**SETTINGS, "Discretization/Degree": degree, "Eigenproblem/Maximum frequency": below,
                "Eigenproblem/Error bars": str(bars).lower(),
                "Mesh/Curved bodies": "all" if curved and not tetrahedra else "none"}
    (directory / "part.prm").write_text(st.parameter_file(settings))
    result = st.run("part.prm", directory=directory, timeout=3000)
    if result.returncode != 0:
        sys.exit(result.stdout + result.stderr)
    rows = [row for row in st.read_table(directory / "output/part/modes.csv") if row["frequency_hz"] > 100][:WANTED]
    cycle = st.read_table(directory / "output/part/cycles.csv")[0]
    return rows, int(cycle["dofs"]), cycle["processor_seconds"], len(elements.elements)


def main():
    with tempfile.TemporaryDirectory(prefix="squeal-tetrahedra-") as scratch:
        directory = pathlib.Path(scratch)
        for name, make, curved, below, fine, meshes in [("ring", ring, True, 16000, 2, (1, 2, 3)),
                                                        ("block", block, False, 60000, 2, (1, 2, 3))]:
            reference, n_unknowns, *_ = run(directory, make(fine), False, 5, curved, below, False)
            print(f"\n{name}: {len(reference)} frequencies, {reference[0]['frequency_hz']:.1f} to "
                  f"{reference[-1]['frequency_hz']:.1f} Hz; reference of {n_unknowns} unknowns\n")
            print("elements        number   unknowns   largest error   covered   bar/error   seconds")
            for kind in ("hexahedra", "tetrahedra"):
                for n in meshes:
                    rows, n_unknowns, seconds, n_elements = run(directory, make(n), kind == "tetrahedra", 2, curved, below, True)
                    errors = [abs(row["frequency_hz"] - other["frequency_hz"]) for row, other in zip(rows, reference)]
                    bars = [row["frequency_error_hz"] for row in rows]
                    largest = max(error / other["frequency_hz"] for error, other in zip(errors, reference))
                    covered = sum(error <= bar for error, bar in zip(errors, bars))
                    ratio = statistics.median(bar / error for bar, error in zip(bars, errors))
                    print(f"{kind:12}{n_elements:10}{n_unknowns:11}{largest:16.2e}{covered:7} of {len(rows)}{ratio:9.2f}"
                          f"{seconds:11.1f}", flush=True)


if __name__ == "__main__":
    main()
