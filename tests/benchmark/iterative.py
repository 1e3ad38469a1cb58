#!/usr/bin/env python3
"""The static equilibrium without factors: does the number of iterations stay, and what do time and memory grow to?

    iterative.py SQUEAL [--prm prm/brake.prm] [--degrees 3] [--levels 1,2,4,5] [--multigrid gamg] [--direct 2]
                        [--ranks 1] [--set "Section/Key=value"]...

The meshes of a level have so many times the cells of prm/brake.prm in each direction. Printed for each: displacement
unknowns; unknowns of degree 1, where algebraic multigrid works; steps of GMRES of the first linear problem (all
contacts closed, from zero to 1e-5), of the last one (to 1e-12), and of all problems of the active set together; seconds
of the static equilibrium with its set-up, and processor seconds of the whole run, ranks together; peak resident memory
of all ranks. With --direct N the levels up to N are also solved by LU of MUMPS; the last column then is the largest
relative difference of static.csv.
"""

import argparse
import os
import re
import resource
import subprocess
import tempfile

from accuracy import read_csv

ROTOR, PAD = (5, 36, 1), (3, 6, 1)
COMPARED = ["normal_force_n", "friction_force_n", "friction_torque_nm", "contact_area_m2", "max_pressure_pa"]


def run(arguments, degree, level, solver, multigrid):
    """Figures of a run: from cycles.csv, static.csv and the log."""
    def cells(counts):
        return ",".join(str(round(level * count)) for count in counts)

    with tempfile.TemporaryDirectory() as directory:
        settings = [f"Discretization/Degree={degree}", f"Discretization/Rotor cells={cells(ROTOR)}",
                    f"Discretization/Pad cells={cells(PAD)}", "Eigenproblem/Solver=none", "Output/Fields=none",
                    f"Output/Directory={directory}/out", f"Static equilibrium/Linear solver={solver}",
                    f"Static equilibrium/Multigrid={multigrid}"] + arguments.set
        command = ["mpirun", "-np", str(arguments.ranks)] if arguments.ranks > 1 else []
        command += [arguments.squeal, arguments.prm] + [a for s in settings for a in ("--set", s)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        result = subprocess.run(command, capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if result.returncode != 0:
            return result.stderr.strip()
        cycle = read_csv(f"{directory}/out/cycles.csv")[0]
        static = read_csv(f"{directory}/out/static.csv")
        with open(f"{directory}/out/log.txt") as file:
            log = file.read()
    table = log.split("Static equilibrium, active set:")[1].split("Pad ")[0].splitlines()
    steps = [int(line.split()[-1]) for line in table[2:] if line.strip()] if solver == "iterative" else []
    coarse = re.search(r"(\d+) unknowns of degree 1", log)
    return {"dofs": int(cycle["dofs"]) - int(cycle["multipliers"]), "coarse": int(coarse.group(1)) if coarse else None,
            "steps": steps, "static": float(cycle["seconds_static"]) + float(cycle["seconds_assembly"]),
            "processor": after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime,
            "gib": float(cycle["memory_mib"]) / 1024, "table": static}


def difference(one, other):
    return max(abs(float(a[key]) - float(b[key])) / abs(float(b[key]))
               for a, b in zip(one, other) for key in COMPARED)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("squeal")
    parser.add_argument("--prm", default=os.path.join(os.path.dirname(__file__), "../../prm/brake.prm"))
    parser.add_argument("--degrees", default="3")
    parser.add_argument("--levels", default="1,2,4,4.4")
    parser.add_argument("--multigrid", default="gamg")
    parser.add_argument("--direct", type=float, default=0)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    print("degree   unknowns  solver      of degree 1   first   last   all   static, s   processor, s   GiB   difference")
    for degree in arguments.degrees.split(","):
        for level in map(float, arguments.levels.split(",")):
            direct = run(arguments, degree, level, "direct", "gamg") if level <= arguments.direct else None
            if isinstance(direct, dict):
                print(f"{degree:>6s} {direct['dofs']:10d}  direct      {'':38s}{direct['static']:9.1f} "
                      f"{direct['processor']:14.1f} {direct['gib']:5.2f}", flush=True)
            elif direct:
                print(f"       direct, level {level}: {direct}", flush=True)
            for multigrid in arguments.multigrid.split(","):
                found = run(arguments, degree, level, "iterative", multigrid)
                if isinstance(found, str):
                    print(f"       {multigrid}, level {level}: {found}", flush=True)
                    continue
                error = f"{difference(found['table'], direct['table']):12.1e}" if isinstance(direct, dict) else ""
                print(f"{degree:>6s} {found['dofs']:10d}  {multigrid:10s} {found['coarse']:12d} "
                      f"{found['steps'][0]:7d} {found['steps'][-1]:6d} {sum(found['steps']):5d} {found['static']:11.1f} "
                      f"{found['processor']:14.1f} {found['gib']:5.2f} {error}", flush=True)


if __name__ == "__main__":
    main()
