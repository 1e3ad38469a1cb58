#!/usr/bin/env python3
"""Do non-matching contact meshes lose order against matching ones? Rates under uniform refinement.

    contact_convergence.py SQUEAL [--scene strip|brake] [--degrees 1 2 3 4] [--cycles N] [--reference DEGREE CYCLES]
                                  [--maximum-unknowns N] [--set "Section/Key=value"]...

Three quantities, on meshes of one scene that match or not, for each degree:
* eigenvalues: the largest relative error of the first ten, with uniform steady pressure;
* a contact resultant in full contact: friction torque (strip: friction force), steady pressure computed;
* the same resultant and the area in contact where the load lifts off one end.
On the strip mu grows with the pressure, else its friction force would be mu times the (exact) normal force. The largest
pressure is left out: it is singular at the edges of the pad.

The reference is a matching mesh of high degree (default: the highest degree given, one refinement more), so an error of
its own size means nothing. Corners and clamped edges are singular, so the rates end at those of the singularities whatever
the degree; the question here is whether matching and non-matching meshes differ. (Rates of a smooth solution:
tests/unit/statics/contact_convergence.cc.)

The brake as measured: --scene brake --degrees 1 2 3 --cycles 3 --reference 4 2 --maximum-unknowns 120000; its reference
has 163 000 unknowns of degree 4 and takes 11.4 GiB.
"""

import argparse
import math
import os
import tempfile

import accuracy
from accuracy import match

# 20 cells of 0.01 along the layer; a block of 0.05: 5 cells match.
# Pads of 40 degrees, 0.09 < r < 0.13: 2, 2 cells match.
SCENES = {
    "strip": {
        "settings": ["Scene=strip", "Stage=full", "Operation/Angular velocity=2",
                     "Eigenproblem/Maximum frequency=40000", "Discretization/Rotor cells=1,20,2"],
        "friction": ["Contact/Friction/Law=expression", "Contact/Friction/Expression=0.2*(1 + p/1e7)"],
        "lift-off": ["Pads/Pressure profile=1 + 60*x"],
        "resultant": "friction_force_n",
        "meshes": {"matching": "1,5,2", "rotor finer": "1,4,2", "pad finer": "1,7,2"},
    },
    "brake": {
        "settings": ["Stage=full", "Pads/Sector angle=40", "Pads/Outer radius=0.13", "Pads/Arrangement=upper",
                     "Eigenproblem/Maximum frequency=4500", "Discretization/Rotor cells=5,18,1"],
        "friction": ["Contact/Friction/Coefficient=0.4"],
        "lift-off": ["Pads/Pressure profile=1 + 30*y"],
        "resultant": "friction_torque_nm",
        "meshes": {"matching": "2,2,1", "rotor finer": "1,1,1", "non-matching": "3,3,1"},
    },
}


def run(squeal, settings, cycles):
    """Per cycle: unknowns, eigenvalues and the static resultants."""
    with tempfile.TemporaryDirectory() as directory:
        prm = os.path.join(directory, "run.prm")
        open(prm, "w").close()
        settings = settings + ["Refinement/Strategy=uniform", f"Refinement/Cycles={cycles}",
                               f"Output/Directory={directory}/out", "Output/Fields=none"]
        command = [squeal, prm] + [argument for s in settings for argument in ("--set", s)]
        done = accuracy.subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"{' '.join(command)}\nfailed with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr}")
        modes, statics, meshes = (accuracy.read_csv(f"{directory}/out/{name}.csv")
                                  for name in ("modes", "static", "cycles"))
    return [{"dofs": int(mesh["dofs"]),
             "eigenvalues": [(float(m["growth_rate_1_per_s"]), float(m["frequency_hz"])) for m in modes
                             if m["cycle"] == mesh["cycle"]],
             **{key: float(value) for row in statics if row["cycle"] == mesh["cycle"] for key, value in row.items()
                if value and key not in ("cycle", "pad")}} for mesh in meshes]


def eigenvalue_error(reference, found):
    reference = reference["eigenvalues"][:10]
    return max(math.hypot(a[0] - b[0], 2 * math.pi * (a[1] - b[1])) / math.hypot(a[0], 2 * math.pi * a[1])
               for a, b in zip(reference, match(reference, found["eigenvalues"])) if b is not None)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("--scene", choices=SCENES, default="strip")
    parser.add_argument("--degrees", type=int, nargs="+", default=[1, 2, 3, 4])
    parser.add_argument("--cycles", type=int, default=4)
    parser.add_argument("--reference", type=int, nargs=2, metavar=("DEGREE", "CYCLES"))
    parser.add_argument("--maximum-unknowns", type=int, default=100000)
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()

    scene = SCENES[arguments.scene]
    resultant = scene["resultant"]
    # Where only the statics count, a low window is enough.
    settings = scene["settings"] + scene["friction"] + arguments.set
    statics_only = ["Eigenproblem/Maximum frequency=2000"]
    variants = [("eigenvalues", settings + ["Contact/Steady pressure=uniform"], [("eigenvalue", eigenvalue_error)])]

    def relative(key):
        return lambda reference, found: abs(found[key] - reference[key]) / abs(reference[key])

    variants += [("closed", settings + statics_only, [(resultant, relative(resultant))]),
                 ("lift-off", settings + statics_only + scene["lift-off"],
                  [(resultant, relative(resultant)), ("contact_area_m2", relative("contact_area_m2"))])]

    degree, cycles = arguments.reference or (max(arguments.degrees), arguments.cycles + 1)
    reference_mesh = [f"Discretization/Pad cells={scene['meshes']['matching']}", f"Discretization/Degree={degree}"]
    for name, given, quantities in variants:
        reference = run(arguments.squeal, given + reference_mesh, cycles)[-1]
        print(f"\n{arguments.scene}, {name}; reference: degree {degree}, {reference['dofs']} unknowns" +
              "".join(f", {q} {reference[q]:.8g}" for q, _ in quantities if q in reference))
        print("degree  mesh           cycle   unknowns" +
              "".join(f"   error of {quantity:>16s}   rate" for quantity, _ in quantities), flush=True)
        for degree_ in arguments.degrees:
            for mesh, cells in scene["meshes"].items():
                before = {}
                results = run(arguments.squeal, given + [f"Discretization/Pad cells={cells}",
                                                         f"Discretization/Degree={degree_}",
                                                         f"Refinement/Maximum unknowns={arguments.maximum_unknowns}"],
                              arguments.cycles)
                for cycle, found in enumerate(results):
                    line = f"{degree_:6d}  {mesh:13s} {cycle:>6d} {found['dofs']:>10d}"
                    for quantity, error_of in quantities:
                        error = error_of(reference, found)
                        rate = f"{math.log2(before[quantity] / error):5.2f}" if before.get(quantity) and error else "    -"
                        line += f"   {error:25.3e}  {rate}"
                        before[quantity] = error
                    print(line, flush=True)


if __name__ == "__main__":
    main()
