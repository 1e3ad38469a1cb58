#!/usr/bin/env python3
"""How much the flutter mode of td-1 looks like the published one:

    python3 tests/validation/td1_shape.py rotor_linear_step22_unorm.vtk [--program build/release/squeal]

The file, of Ansys' public example data, has the norm of the mode's displacement at points of the surface. Printed are the
correlation of this norm with that of the nearest nodes here, at the phase of the complex mode where it is largest, and how far
these nodes are. Needs numpy, which matplotlib brings.
"""

import argparse
import os
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "lib")]


def published(file):
    """Points, m, and the norm at each: binary VTK of version 5.1, numbers with their high bytes first."""
    import numpy
    data = file.read_bytes()

    def after(words, kind, count):
        begin = data.index(words)
        begin = data.index(b"\n", begin) + 1
        return numpy.frombuffer(data, kind, count, begin).astype(float)

    n = int(data[data.index(b"POINTS"):].split(maxsplit=2)[1])
    return after(b"POINTS", ">f4", 3 * n).reshape(n, 3), after(b"LOOKUP_TABLE default", ">f8", n)


def computed(run):
    """Nodes, m, and the complex displacement of the flutter mode at each."""
    import mesh_files
    import numpy
    import td1
    import vtu_files
    (run.directory / "td1.msh").write_text(mesh_files.msh2(td1.mesh()))
    rows = run("td1.prm", {"Output/Fields": "unstable"})
    flutter = max(rows, key=lambda row: row["growth_rate_1_per_s"])
    print(f"{flutter['frequency_hz']:.2f} Hz, {flutter['growth_rate_1_per_s']:.2f} 1/s")
    points, vectors = [], []
    for _, arrays, places in vtu_files.pieces(run.directory / str(run.n_runs) / f"mode-0-{int(flutter['mode']):03d}.pvtu"):
        points += places
        re, im = (vtu_files.numbers(arrays[f"displacement_{part}_m"]) for part in ("re", "im"))
        vectors += [complex(*z) for z in zip(re, im)]
    return numpy.array(points).reshape(-1, 3), numpy.array(vectors).reshape(-1, 3)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=pathlib.Path)
    parser.add_argument("--program", type=pathlib.Path, help="default: $SQUEAL, else build/release/squeal")
    arguments = parser.parse_args()
    if arguments.program:
        os.environ["SQUEAL"] = str(arguments.program.resolve())
    import numpy
    import squeal_testing as st  # reads SQUEAL
    import validation
    places, norms = published(arguments.file)
    points, vectors = computed(validation.Runner(st))
    nearest = numpy.array([((points - place)**2).sum(1).argmin() for place in places])
    distances = numpy.linalg.norm(points[nearest] - places, axis=1)
    phases = numpy.linspace(0, numpy.pi, 181)
    print("correlation %.4f; nodes are %.1f mm away on average, %.1f at most" % (
        max(numpy.corrcoef(numpy.linalg.norm((vectors[nearest] * numpy.exp(1j * phase)).real, axis=1), norms)[0, 1]
            for phase in phases), 1e3 * distances.mean(), 1e3 * distances.max()))


if __name__ == "__main__":
    main()
