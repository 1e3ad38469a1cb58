#!/usr/bin/env python3
"""Error bars on brakes on which nothing was tuned, against a solution of higher degree on the same mesh.

    untuned.py [--brakes disc_4 ...] [--degrees 2 3] [--reference-degree 4] [--modes]

Thin discs, built in and from files, of hexahedra and of tetrahedra; few cells along the radius; pads that lift off; friction
that falls with the speed at slow rotation; linings that hardly change their volume; a brake near self-locking; chamfers, a slot;
hanging nodes. For each: how many bars hold, how long they are beside the error, how many corrected values are nearer, how many
verdicts the reference contradicts. The reference is the corrected solution of the highest degree. Its own bars are added where it
is asked whether a bar holds, and bound errors from below where they are compared with bars. Files of tetrahedra have degree 3 at
most: their reference is the built-in brake's. All of them take half an hour.
"""

import argparse
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import element_files  # noqa: E402
import error_statistics as es  # noqa: E402
import layered_brakes as lp  # noqa: E402
import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

UNIFORM = {"Scene": "brake", "Stage": "full", "Operation/Angular velocity": 5, "Contact/Steady pressure": "uniform",
           "Contact/Friction/Coefficient": 0.4, "Output/Fields": "none", "Eigenproblem/Maximum frequency": 3000}
COMPUTED = {**UNIFORM, "Contact/Steady pressure": "computed", "Eigenproblem/Maximum frequency": 4000}
FALLING = {"Contact/Friction/Law": "falling", "Contact/Friction/Coefficient": 0.6, "Contact/Friction/Coefficient at speed": 0.3,
           "Contact/Friction/Decay speed": 0.2, "Eigenproblem/Maximum frequency": 4000}


def thin(millimetres, cells):
    return {**UNIFORM, "Rotor/Thickness": millimetres / 1000, "Discretization/Rotor cells": cells}


def from_file(millimetres, n_corners):
    """The brake with a disc of that thickness as a file, of 4 by 24 cells, of elements with so many corners."""
    def make(directory):
        mesh, half = mesh_files.brake((4, 24, 1)), millimetres / 2000
        mesh.nodes = [(x, y, z * half / 0.006 if abs(z) < 0.0061 else (abs(z) - 0.006 + half) * (1 if z > 0 else -1))
                      for x, y, z in mesh.nodes]
        elements = element_files.Elements(mesh, lambda name: n_corners if name == "rotor" else 8)
        elements.make_quadratic({"rotor": element_files.on_circle})
        (directory / "brake.msh").write_text(element_files.msh2(elements))
        return {**UNIFORM, **mesh_files.SCENE, "Mesh/File": "brake.msh", "Mesh/Curved bodies": "rotor"}
    return make


def layered(name):
    return lambda directory: lp.files(lp.BRAKES[name], directory, 1)


BRAKES = {
    "disc_2": thin(2, "5, 36, 1"),
    "disc_4": thin(4, "4, 24, 1"),
    "disc_6": thin(6, "4, 30, 1"),
    "file_4": from_file(4, 8),
    "file_4_tetrahedra": from_file(4, 4),
    "three_radial_cells": {**UNIFORM, "Discretization/Rotor cells": "3, 24, 1", "Eigenproblem/Maximum frequency": 6000},
    "lift_off_65": {**COMPUTED, "Pads/Sector angle": 65},
    "lift_off_80": {**COMPUTED, "Pads/Sector angle": 80, "Contact/Friction/Coefficient": 0.5},
    "falling_1": {**UNIFORM, **FALLING, "Operation/Angular velocity": 1},
    "falling_3": {**UNIFORM, **FALLING, "Operation/Angular velocity": 3, "Rotor/Thickness": 0.02},
    "lining_0.495": {**UNIFORM, "Pads/Material/Poisson ratio": 0.495},
    "lining_0.499": {**UNIFORM, "Pads/Material/Poisson ratio": 0.499, "Pads/Material/Young modulus": 1e9},
    "near_locking": {**UNIFORM, "Contact/Friction/Coefficient": 1.0, "Pads/Thickness": 0.025},
    "chamfers": layered("chamfers"),
    "slot": layered("slot"),
    "hanging_nodes": {**UNIFORM, "Refinement/Strategy": "adaptive", "Refinement/Cycles": 2, "Refinement/Tolerance": 1e-9,
                      "Discretization/Rotor cells": "4, 24, 1", "Eigenproblem/Maximum frequency": 4000},
}
# What a reference has in place of the brake's own settings.
REFERENCE = {
    "file_4_tetrahedra": from_file(4, 8),
    "hanging_nodes": {**UNIFORM, "Discretization/Rotor cells": "8, 48, 2", "Discretization/Pad cells": "6, 12, 2",
                      "Discretization/Clamp layers": 2, "Eigenproblem/Maximum frequency": 4000, "Degree": 3},
}


def modes(brake, degree):
    """The lines of modes.csv of the last mesh, and that of cycles.csv."""
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        settings = dict(brake(directory) if callable(brake) else brake)
        settings["Discretization/Degree"] = settings.pop("Degree", degree)
        (directory / "run.prm").write_text(st.parameter_file(settings))
        done = st.run("run.prm", directory=directory, timeout=3600)
        if done.returncode != 0:
            sys.exit(f"exit status {done.returncode}\n{done.stdout[-2000:]}{done.stderr}")
        rows, cycle = st.read_table(directory / "output/run/modes.csv"), st.read_table(directory / "output/run/cycles.csv")[-1]
        return [row for row in rows if row["cycle"] == rows[-1]["cycle"]], cycle


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--brakes", nargs="+", choices=BRAKES, default=list(BRAKES))
    parser.add_argument("--degrees", nargs="+", type=int, default=[2, 3])
    parser.add_argument("--reference-degree", type=int, default=4)
    parser.add_argument("--modes", action="store_true")
    arguments = parser.parse_args()

    comparisons = []
    print(f"{'brake':18s} mesh  unknowns  " + es.HEADER[6:], flush=True)
    for name in arguments.brakes:
        reference, cycle = modes(REFERENCE.get(name, BRAKES[name]), arguments.reference_degree)
        values = [es.corrected(row) for row in reference]
        own = sorted((row["growth_rate_error_1_per_s"], row["frequency_error_hz"]) for row in reference)[len(reference) // 2]
        print(f"{name:18s}  ref {cycle['dofs']:9.0f}  {len(reference)} modes, median of its own bars {own[1]:.2g} Hz, {own[0]:.2g} 1/s",
              flush=True)
        for degree in arguments.degrees:
            rows, cycle = modes(BRAKES[name], degree)
            found = [es.KnownTo(name, degree, row, values[j], complex(reference[j]["growth_rate_error_1_per_s"],
                                                                     reference[j]["frequency_error_hz"]))
                     for row, j in es.pair(rows, values)]
            print(f"{name:18s}      {cycle['dofs']:9.0f}  " + es.line("", degree, found)[6:], flush=True)
            if arguments.modes:
                print(es.mode_table(found))
            comparisons += found
    for degree in arguments.degrees:
        of_degree = [c for c in comparisons if c.cycle == degree]
        print(f"{'all':18s}                 " + es.line("", degree, of_degree)[6:])
        decided = [c for c in of_degree if abs(c.reference.real) > c.growth_accuracy]
        undecided = sum(c.row["verdict"] == "undecided" for c in decided)
        print(f"degree {degree}: beyond 10 times the error {100 * es.share_beyond(10, of_degree, 'frequency'):.1f} % of frequencies, "
              f"{100 * es.share_beyond(10, of_degree, 'growth'):.1f} % of growth rates; undecided where the reference decides: "
              f"{undecided} of {len(decided)}")


if __name__ == "__main__":
    main()
