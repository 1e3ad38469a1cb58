"""Cylindrical joints: how fast frequencies of a disc that is cut around and joined again converge, beside the uncut disc.

The disc of Scene = brake without pads, clamped inside, is cut at r = 0.1 m; inside n cells around, outside 5/4 n, so that no
edges match but four. Both follow circles, so that the surfaces differ by the error of the geometry. Printed is the largest
relative error of the frequencies up to 3 kHz against the uncut disc of degree 5, for n = 12, 24, 48 and the degrees 1 to 3,
and the rate between meshes. Then the same for two rings that do not turn, held by stick contact in place of a tie (the
rotor is a small stiff one beside them), which may differ from the tie by the error of the geometry.

    python3 tests/benchmark/ties.py                # about two processor minutes
"""

import argparse
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


def frequencies(directory, n, degree, kind):
    (directory / "disc.msh").write_text(mesh_files.msh2(disc(n, kind == "tied")))
    settings = {**SETTINGS, "Discretization/Degree": degree}
    if kind == "tied":
        settings.update({"Mesh/Rotor": "rotor, ring", "Joints/Ties": "ring.inner : rotor.outer"})
    return modes(directory, settings)


RINGS = {**SETTINGS, "Mesh/Clamped": "rotor.inner, core.inner", "Mesh/Part 1/Volumes": "core, ring",
         "Mesh/Part 1/Body": "parts", "Contact/Steady pressure": "uniform"}
# The uncut rings hang on nothing else: a point without a mass makes them a part.
KINDS = {"uncut": {"Joints/Points": "none : ring.outer"}, "tied": {"Joints/Ties": "ring.inner : core.outer"},
         "stick": {"Joints/Contacts": "ring.inner : core.outer : stick"}}


def ring_frequencies(directory, n, degree, kind):
    mesh = mesh_files.Mesh()
    for name, low, high, around, cells in [("rotor", 0.01, 0.02, 8, 1), ("core", 0.05, 0.1, n, n // 12),
                                           ("ring", 0.1, 0.15, n if kind == "uncut" else n * 5 // 4, n // 12)]:
        mesh.sector(name, mesh_files.equal(low, high, cells), mesh_files.equal(0, 2 * math.pi, around),
                    mesh_files.equal(-0.006, 0.006, 1), ring=True)
    if kind == "uncut":
        volumes = mesh.volumes
        mesh.volumes = {"rotor": volumes["rotor"], "solid.core": volumes["core"], "solid.ring": volumes["ring"]}
        mesh.weld()
        mesh.volumes = volumes
    (directory / "disc.msh").write_text(mesh_files.msh2(mesh))
    return modes(directory, {**RINGS, **KINDS[kind], "Discretization/Degree": degree})


def modes(directory, settings):
    (directory / "disc.prm").write_text(st.parameter_file(settings))
    result = st.run("disc.prm", "--overwrite", directory=directory, timeout=900)
    assert result.returncode == 0, result.stdout + result.stderr
    return [row["frequency_hz"] for row in st.read_table(directory / "output/disc/modes.csv")]


def table(exact, kinds, compute):
    """Errors and rates by degree and kind of joint, for n = 12, 24, 48."""
    print(f"{len(exact)} frequencies up to 3 kHz; largest relative error (rate)\n")
    print("degree   disc     " + "".join(f"{f'n = {n}':>20}" for n in (12, 24, 48)))
    for degree in (1, 2, 3):
        for kind in kinds:
            line, last = "", None
            for n in (12, 24, 48):
                found = compute(n, degree, kind)
                m = min(len(found), len(exact))
                error = max(abs(a / b - 1) for a, b in zip(found[:m], exact[:m]))
                rate = "" if last is None else f" ({math.log2(last / error):.1f})"
                line, last = line + f"{error:>13.1e}{rate:>7}", error
            print(f"{degree:>6}   {kind:<8}{line}", flush=True)
    print()


def main():
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        exact = frequencies(directory, 24, 5, "uncut")
        table(exact, ("uncut", "tied"), lambda *which: frequencies(directory, *which))
        exact = ring_frequencies(directory, 24, 4, "uncut")
        table(exact, KINDS, lambda *which: ring_frequencies(directory, *which))


if __name__ == "__main__":
    main()
