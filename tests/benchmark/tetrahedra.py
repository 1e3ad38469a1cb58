"""Quadratic tetrahedra (C3D10) against hexahedra: error of 20 frequencies against unknowns and seconds, and the error bars.

A ring (radii 0.1 and 0.14 m, 20 mm thick) and a block (120, 60 and 30 mm) of steel, free, alone. Each hexahedron becomes six
tetrahedra with middle nodes, on circles about the axis for the ring; the program divides each into four hexahedra. The same
hexahedra, linear and with degree 2, stand beside. The reference is degree 5 on hexahedra. Printed for degree 2: elements of
the file, unknowns, the largest relative error of the first 20 elastic frequencies, how many of them the bars cover, the median of
bar / error, processor seconds.

Then the default brake with pads of either kind on one disc of hexahedra, against the independent eigenvalues of table T6.

    python3 tests/benchmark/tetrahedra.py             # about seven processor minutes
"""

import argparse
import math
import pathlib
import statistics
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import element_files  # noqa: E402
import error_statistics as es  # noqa: E402
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


def solve(directory, settings):
    """Rows of modes.csv, the line of cycles.csv."""
    (directory / "part.prm").write_text(st.parameter_file(settings))
    result = st.run("part.prm", directory=directory, timeout=3000)
    if result.returncode != 0:
        sys.exit(result.stdout + result.stderr)
    results = directory / "output/part"
    return st.read_table(results / "modes.csv"), st.read_table(results / "cycles.csv")[0]


def run(directory, mesh, tetrahedra, degree, curved, below, bars):
    """Rows of the elastic modes, unknowns, processor seconds, number of elements."""
    elements = element_files.Elements(mesh, lambda name: 4 if tetrahedra else 8)
    if tetrahedra:
        elements.make_quadratic({"part": element_files.on_circle} if curved else None)
    (directory / "part.msh").write_text(element_files.msh2(elements))
    settings = {**SETTINGS, "Discretization/Degree": degree, "Eigenproblem/Maximum frequency": below,
                "Eigenproblem/Error bars": str(bars).lower(),
                "Mesh/Curved bodies": "all" if curved and not tetrahedra else "none"}
    rows, cycle = solve(directory, settings)
    return ([row for row in rows if row["frequency_hz"] > 100][:WANTED], int(cycle["dofs"]), cycle["processor_seconds"],
            len(elements.elements))


def brake(directory):
    """Pads of either kind on the same disc of hexahedra, against the independent eigenvalues of T6."""
    print("\nbrake T6: relative error of l, 25 modes\n")
    print("pads        degree   unknowns   largest error   of corrected   covered   bar/error: frequency, growth   seconds")
    for kind, n_corners in (("hexahedra", 8), ("tetrahedra", 4)):
        (directory / "part.msh").write_text(element_files.msh2(element_files.brake_graded_at_the_clamp(n_corners)))
        for degree in (2, 3):
            rows, cycle = solve(directory, {**es.settings_of_file("T6", "part.msh", degree),
                                            "Mesh/Curved bodies": "all" if n_corners == 8 else "rotor"})
            modes = es.compare("T6", rows)
            largest, corrected = (max(abs(value(c.row) - c.reference) / abs(c.reference) for c in modes)
                                  for value in (st.eigenvalue, es.corrected))
            s = es.statistics(modes)
            print(f"{kind:12}{degree:6}{int(cycle['dofs']):11}{largest:16.2e}{corrected:15.2e}"
                  f"{s.covered['frequency'] + s.covered['growth']:7} of {2 * s.modes}{s.median['frequency']:13.2f}"
                  f"{s.median['growth']:8.2f}{cycle['processor_seconds']:17.1f}", flush=True)


def main():
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
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
        brake(directory)


if __name__ == "__main__":
    main()
