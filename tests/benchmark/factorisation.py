#!/usr/bin/env python3
"""What the choices for the factorisation cost: ordering, block low-rank compression, threads against ranks.

    factorisation.py [PARAMETER_FILE] [--program SQUEAL] [--set "Section/Key=value"]...

One line is one run of the file (default: prm/brake.prm, solved as a whole), with MUMPS told by PETSc's
options database: processor seconds of LDL^T count, LU, right and left vectors, their sum, the wall time of the
eigenvalue phase, memory of the factors and the largest backward error. All in one go on one machine.
"""

import argparse
import re
import subprocess

import runs

# Name, PETSc options, threads, ranks
CHOICES = [("as it comes", "", 1, 1),
           ("AMD", "-mat_mumps_icntl_7 0", 1, 1),
           ("AMF", "-mat_mumps_icntl_7 2", 1, 1),
           ("SCOTCH", "-mat_mumps_icntl_7 3", 1, 1),
           ("PORD", "-mat_mumps_icntl_7 4", 1, 1),
           ("METIS", "-mat_mumps_icntl_7 5", 1, 1),
           ("low-rank, 1e-12", "-mat_mumps_icntl_35 2 -mat_mumps_cntl_7 1e-12", 1, 1),
           ("low-rank, 1e-8", "-mat_mumps_icntl_35 2 -mat_mumps_cntl_7 1e-8", 1, 1),
           ("two threads", "", 2, 1),
           ("two ranks", "", 1, 2)]


def run(arguments, options, threads, ranks):
    settings = ["Eigenproblem/Mirror symmetry=false", "Eigenproblem/Error bars=false", *arguments.set]
    environment = {"OMP_NUM_THREADS": str(threads), "OPENBLAS_NUM_THREADS": str(threads), "PETSC_OPTIONS": options}
    try:
        log, modes, cycle = runs.run(arguments.program, arguments.file, settings, ranks, environment)
    except subprocess.CalledProcessError as error:
        return (error.stderr.strip().splitlines() or ["failed"])[0]
    parts = [float(value) for value in re.findall(runs.PARTS, log)[-1]]
    wall = float(re.findall(r"eigenproblem +([\d.]+)", log)[-1])
    memory = float(re.findall(r"shift-invert (\d+) MiB", log)[-1])
    error = max(float(mode["backward_error"]) for mode in modes)
    return (f"{parts[0]:6.2f} {parts[1]:6.2f} {parts[2]:6.2f} {parts[3]:6.2f} {sum(parts):6.2f} {wall:6.2f} {memory:6.0f} "
            f"{len(modes):5d} {error:9.1e}   {cycle['dofs']}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", default=runs.DEFAULT_BRAKE)
    parser.add_argument("--program", default=runs.PROGRAM)
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    print(f"{'':18s}  count     LU  right   left    sum   wall    MiB modes  b. error   unknowns")
    for name, options, threads, ranks in CHOICES:
        print(f"{name:18s} {run(arguments, options, threads, ranks)}", flush=True)


if __name__ == "__main__":
    main()
