#!/usr/bin/env python3
"""Error bars of brakes whose pads lift off at one end, against meshes with fine pads.

    lift_off.py [--brakes default thick_disc long_pads] [--cache DIRECTORY]

The default brake, one with a disc of 20 mm and pads of 40 degrees, one with pads of 65 degrees and a friction of 0.4, below
4 kHz. Meshes of degree 2 and 3, those of the default brake refined adaptively; the references have degree 3 and 10 or 12 by
24 cells a pad and take a minute or two. Their modes.csv are kept in the cache. The edge of the contact zone moves their
growth rates by some 0.05 1/s, too: that is the accuracy with which errors of growth rates are known. `corrected`: the
largest error of corrected growth rates; `nearer`: how many of them are nearer than computed ones.
"""

import argparse
import pathlib
import shutil
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import error_statistics as es  # noqa: E402
import squeal_testing as st  # noqa: E402

ACCURACY = 0.05  # 1/s

ADAPTIVE = [{"Discretization/Degree": degree, "Refinement/Strategy": "adaptive", "Refinement/Cycles": cycles,
             "Refinement/Tolerance": 1e-9, "Refinement/Maximum unknowns": 120000} for degree, cycles in ((2, 4), (3, 2))]
UNIFORM = [{"Discretization/Degree": degree, "Discretization/Pad cells": cells}
           for degree, cells in ((2, "3, 6, 1"), (2, "4, 10, 1"), (3, "3, 6, 1"), (3, "4, 8, 1"))]
# Settings, cells of a pad in the reference, meshes
BRAKES = {
    "default": ({}, "12, 24, 1", ADAPTIVE),
    "thick_disc": ({"Rotor/Thickness": 0.02, "Pads/Sector angle": 40}, "10, 24, 1", UNIFORM),
    "long_pads": ({"Pads/Sector angle": 65, "Contact/Friction/Coefficient": 0.4}, "10, 24, 1", UNIFORM),
}


def run(directory, name, settings):
    """Rows of modes.csv and cycles.csv, and where they are."""
    arguments = [part for key, value in settings.items() for part in ("--set", f"{key}={value}")]
    done = st.run(st.PROJECT / "prm/brake.prm", *arguments, "--set", "Output/Fields=none",
                  "--set", "Eigenproblem/Maximum frequency=4000", "--set", f"Output/Directory={name}",
                  directory=directory, timeout=3600)
    if done.returncode != 0:
        sys.exit(f"exit status {done.returncode}\n{done.stdout[-2000:]}{done.stderr}")
    results = pathlib.Path(directory) / name
    return st.read_table(results / "modes.csv"), st.read_table(results / "cycles.csv"), results


def modes_of_reference(directory, name, cache):
    """Rows of modes.csv of the brake's finest mesh, from the cache if they are there."""
    settings, cells, _ = BRAKES[name]
    kept = cache and cache / f"{name}.csv"
    if kept and kept.exists():
        return st.read_table(kept)
    rows, cycles, results = run(directory, f"{name}-reference", {**settings, "Discretization/Pad cells": cells})
    print(f"reference: {cycles[-1]['dofs']:.0f} unknowns, {cycles[-1]['seconds_total']:.0f} s", flush=True)
    if kept:
        cache.mkdir(parents=True, exist_ok=True)
        shutil.copy(results / "modes.csv", kept)
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--brakes", nargs="+", choices=BRAKES, default=list(BRAKES))
    parser.add_argument("--cache", type=pathlib.Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        for name in arguments.brakes:
            values = [st.eigenvalue(row) for row in modes_of_reference(directory, name, arguments.cache)]
            print(f"\n{name}\ndegree  mesh  unknowns  modes   frequency: covered  median   growth rate: covered  median"
                  "  largest error  corrected  nearer  undecided")
            for number, mesh_settings in enumerate(BRAKES[name][2]):
                rows, meshes, _ = run(directory, f"{name}-{number}", {**BRAKES[name][0], **mesh_settings})
                for mesh in meshes:
                    modes = [row for row in rows if row["cycle"] == mesh["cycle"]]
                    found = [es.KnownTo(name, int(mesh["cycle"]), row, values[j], complex(ACCURACY, 0))
                             for row, j in es.pair(modes, values)]
                    s = es.statistics(found)
                    corrected = [abs((es.corrected(c.row) - c.reference).real) for c in found]
                    print(f"{mesh_settings['Discretization/Degree']:6d} {mesh['cycle']:5.0f} {mesh['dofs']:9.0f} "
                          f"{s.modes:6d} {s.covered['frequency']:20d} {s.median['frequency']:7.1f} "
                          f"{s.covered['growth']:22d} {s.median['growth']:7.1f} "
                          f"{max(c.growth_error for c in found):14.2f} {max(corrected):10.2f} "
                          f"{sum(a < c.growth_error for a, c in zip(corrected, found)):7d} {s.undecided:10d}", flush=True)


if __name__ == "__main__":
    main()
