"""Runs squeal and reads its results.

    import squeal
    brake = squeal.run("prm/brake.prm", **{"Contact/Friction/Coefficient": 0.4})
    brake.modes["frequency_hz"]                 # a column of modes.csv, last mesh
    squeal.read("output/brake").modes           # of a run that has been
    squeal.mac(brake.shapes(), brake.shapes())  # modal assurance criterion

Needs numpy; matrices need scipy. The program is the one named by the environment variable SQUEAL, else `squeal` of the
PATH, else build/release/squeal of the directory or of one above it. doc/python.md has the manual.
"""

from .program import InputError, ProgramError, SolverError, find_program, run, sample
from .results import DamagedError, Results, read
from .shapes import MeasuredShape, Shape, mac, pair, read_measured

__all__ = ["DamagedError", "InputError", "MeasuredShape", "ProgramError", "Results", "Shape", "SolverError", "find_program", "mac", "pair",
           "read", "read_measured", "run", "sample"]
