"""Cylindrical ties: how fast frequencies of a disc that is cut around and tied again converge, beside the uncut disc.

The disc of Scene = brake without pads, clamped inside, is cut at r = 0.1 m; inside n cells around, outside 5/4 n, so that no
edges match but four. Both follow circles, so that the surfaces differ by the error of the geometry. Printed is the largest
relative error of the frequencies up to 3 kHz against the uncut disc of degree 5, for n = 12, 24, 48 and the degrees 1 to 3,
and the rate between meshes.

    python3 tests/benchmark/ties.py                # about two processor minutes
"""

import math
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

SETTINGS = {**mesh_files.SCENE, "Mesh/File": "disc.msh", "Mesh/Pads": "", "Mesh/Contact pairs": "", "Mesh/Guided": "",
            "Mesh/Pressure on": "", "Output/Fields": "none", "Stage": "elastic",
            "Eigenproblem/Maximum frequency": 3000, "Eigenproblem/Error bars": "false"}


def disc(n, tied):
    mesh = mesh_files.Mesh()
    parts = n // 6
    for name, low, high, around in [("rotor", 0.05, 0.1, n), ("ring", 0.1, 0.15, n * 5 // 4 if tied else n)]:
        mesh.sector(name, mesh_files.equal(low, high, parts // 2), mesh_files.equal(0, 2 * math.pi, around),
                    mesh_files.equal(-0.006, 0.006, 1), ring=True)
    if not tied:
        mesh.volumes = {"rotor": mesh.volumes["rotor"] + mesh.volumes["ring"]}
        mesh.weld()
    return mesh


def frequencies(directory, n, degree, tied):
    (directory / "disc.msh").write_text(mesh_files.msh2(disc(n, tied)))
    settings = {**SETTINGS, "Discretization/Degree": degree}
    if tied:
        settings.update({"Mesh/Rotor": "rotor, ring", "Joints/Ties": "ring.inner : rotor.outer"})
    (directory / "disc.prm").write_text(st.parameter_file(settings))
    result = st.run("disc.prm", "--overwrite", directory=directory, timeout=900)
    assert result.returncode == 0, result.stdout + result.stderr
    return [row["frequency_hz"] for row in st.read_table(directory / "output/disc/modes.csv")]


def main():
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        exact = frequencies(directory, 24, 5, False)
        print(f"{len(exact)} frequencies up to 3 kHz; largest relative error (rate)\n")
        print("degree   disc     " + "".join(f"{f'n = {n}':>20}" for n in (12, 24, 48)))
        for degree in (1, 2, 3):
            for tied in (False, True):
                line, last = "", None
                for n in (12, 24, 48):
                    found = frequencies(directory, n, degree, tied)
                    m = min(len(found), len(exact))
                    error = max(abs(a / b - 1) for a, b in zip(found[:m], exact[:m]))
                    rate = "" if last is None else f" ({math.log2(last / error):.1f})"
                    line, last = line + f"{error:>13.1e}{rate:>7}", error
                print(f"{degree:>6}   {'tied' if tied else 'uncut':<8}{line}", flush=True)


if __name__ == "__main__":
    main()
