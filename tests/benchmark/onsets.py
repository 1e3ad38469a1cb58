#!/usr/bin/env python3
"""Error bars of critical values, against a finer mesh.

    onsets.py [--scenes penalty lift_off falling rest rest_mortar divergence] [--details]

Onsets and ends of growth of three brakes (penalty, mortar with lift-off, falling friction), coalescences of two without damping,
a divergence, each on four meshes: degree 2 and 3, degree 2 refined adaptively, degree 3 on smaller cells. For each
scene: how many bars hold, how long they are beside the error, how many corrected values are nearer. The reference is the
corrected value of degree 4 on the smaller cells; its own bar is added where it is asked whether a bar holds, and bounds
the error from below where they are compared. Critical values of a scene that not all meshes have are counted apart.
"""

import argparse
import pathlib
import statistics
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

COARSE = {"Discretization/Rotor cells": "3, 18, 1", "Discretization/Pad cells": "2, 3, 1", "Output/Fields": "none"}
FINE = {"Discretization/Rotor cells": "4, 24, 1", "Discretization/Pad cells": "3, 4, 1"}
MESHES = {"degree 2": {"Discretization/Degree": 2}, "degree 3": {"Discretization/Degree": 3},
          "adaptive": {"Discretization/Degree": 2, "Refinement/Strategy": "adaptive", "Refinement/Tolerance": 1e-4,
                       "Refinement/Cycles": 3},
          "fine": {**FINE, "Discretization/Degree": 3}}
REFERENCE = {**FINE, "Discretization/Degree": 4}
FRICTION = {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Critical values": "true"}
SPEED = {"Sweep/Parameter": "Operation/Angular velocity", "Sweep/Critical values": "true"}
LIGHT = {"Pads/Material/Stiffness proportional damping": 2e-7, "Eigenproblem/Maximum frequency": 5000}
SCENES = {
    "penalty": {**st.PENALTY, **LIGHT, **FRICTION, "Sweep/Values": "0.1 : 0.9 : 5"},
    "lift_off": {**st.MORTAR, **LIGHT, **FRICTION, "Sweep/Values": "0.3 : 0.7 : 5"},
    "falling": {**st.PENALTY, **LIGHT, **SPEED, "Contact/Steady pressure": "uniform", "Contact/Friction/Law": "falling",
                "Contact/Friction/Coefficient at speed": 0.2, "Contact/Friction/Decay speed": 1, "Sweep/Values": "5 : 45 : 5"},
    "rest": {**st.PENALTY, **FRICTION, "Stage": "friction", "Operation/Angular velocity": 0, "Contact/Steady pressure": "uniform",
             "Eigenproblem/Maximum frequency": 5000, "Sweep/Values": "0.05 : 0.85 : 5"},
    "rest_mortar": {**st.MORTAR, **FRICTION, "Stage": "friction", "Operation/Angular velocity": 0, "Contact/Steady pressure": "uniform",
                "Pads/Material/Young modulus": 5e9, "Eigenproblem/Maximum frequency": 5000, "Sweep/Values": "0.05 : 0.85 : 5"},
    "divergence": {**st.PENALTY, **SPEED, "Stage": "transport", "Contact/Friction/Coefficient": 0,
                   "Contact/Steady pressure": "uniform", "Eigenproblem/Maximum frequency": 400, "Sweep/Values": "2500 : 2900 : 5"},
}


def critical_values(scene, mesh):
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        (directory / "run.prm").write_text(st.parameter_file({**COARSE, **SCENES[scene], **mesh}))
        done = st.run("run.prm", directory=directory, timeout=7200)
        if done.returncode != 0:
            print(f"{scene}, {mesh}: exit status {done.returncode}\n{done.stderr}", flush=True)
            return []
        rows = st.read_table(directory / "output/run/critical.csv")
        seconds = [line for line in done.stdout.splitlines() if line.split()[:1] == ["total"]][-1].split()[1]
        print(f"{scene:10s} {len(rows):3d} critical values, {seconds:>7s} s", flush=True)
        return rows


def partners(rows, reference):
    """Pairs of the same kind, by frequency and value; each one once, the nearest first."""
    def distance(a, b):
        return (abs(a["frequency_hz"] - b["frequency_hz"]) / (0.02 * max(b["frequency_hz"], 50))
                + abs(a["value"] - b["value"]) / (0.5 * abs(b["value"]) + 1e-300))
    candidates = sorted((distance(a, b), i, j) for i, a in enumerate(rows) for j, b in enumerate(reference)
                        if a["kind"] == b["kind"] and distance(a, b) < 2)
    used_rows, used_reference, found = set(), set(), []
    for _, i, j in candidates:
        if i not in used_rows and j not in used_reference:
            used_rows.add(i)
            used_reference.add(j)
            found.append((rows[i], reference[j]))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--meshes", nargs="+", choices=MESHES, default=list(MESHES))
    parser.add_argument("--details", action="store_true")
    arguments = parser.parse_args()
    lines, by_kind = [], {}
    for scene in arguments.scenes:
        reference = [row for row in critical_values(scene, REFERENCE) if row["mesh_error"] is not None]
        for name in arguments.meshes:
            rows = critical_values(scene, MESHES[name])
            pairs = [(a, b) for a, b in partners(rows, reference)]
            known = []
            for a, b in pairs:
                if a["mesh_error"] is None:
                    continue
                error, own = abs(a["value"] - b["corrected_value"]), b["mesh_error"] + b["accuracy"]
                bar = a["mesh_error"] + a["accuracy"]
                known.append((error <= bar + own, bar / max(error, own), abs(a["corrected_value"] - b["corrected_value"]) < error))
                kind = "onset" if a["kind"] in ("onset", "end") else a["kind"].removesuffix("_end")
                by_kind.setdefault(kind, []).append(known[-1])
                if arguments.details:
                    print(f"   {a['kind']:12s} {a['frequency_hz']:9.2f} Hz: {a['value']:.6g} +- {bar:.2g}, corrected "
                          f"{a['corrected_value']:.6g}; reference {b['corrected_value']:.6g} +- {own:.2g}", flush=True)
            lines.append((scene, name, len(rows), len(pairs), known))
    print("scene      mesh         found  paired  with bar  covered  bar/error: median  largest  corrected nearer")
    for scene, name, n_found, n_paired, known in [*lines, *(("all", kind, 0, 0, of_kind) for kind, of_kind in by_kind.items())]:
        if known:
            print(f"{scene:10s} {name:11s} {n_found or '':>6} {n_paired or '':>7} {len(known):9d} "
                  f"{100 * statistics.mean(k[0] for k in known):7.1f}% {statistics.median(k[1] for k in known):18.2f} "
                  f"{max(k[1] for k in known):8.1f} {100 * statistics.mean(k[2] for k in known):16.0f}%")
        else:
            print(f"{scene:10s} {name:11s} {n_found:6d} {n_paired:7d} {0:9d}")


if __name__ == "__main__":
    main()
