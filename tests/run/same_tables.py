"""Do two programs give the same tables? The guard of changes that must not change results.

    python3 tests/run/same_tables.py BEFORE AFTER [--ranks 1 2] [--only NAME ...] [--quick] [--cache DIRECTORY]

Both programs run eight parameter files of prm/, each in a temporary directory, with one thread a rank. Files of tables are
compared byte for byte but for columns of seconds and memory. Where bytes differ, cells are compared:

* Rows, text (verdicts, branches, origins) and counts must be equal.
* Eigenvalues l = growth + i 2 pi frequency must agree to --tolerance relative to |l|.
* Other numbers must agree to --other relative to the largest number of their column, but for those that are rounding
  errors themselves (backward errors).
* Counts that log.txt tells must be equal: right-hand sides, full solutions, steps of GMRES, multigrid cycles, active sets.

* What iterative solvers leave ends at their tolerance: `iterative` must agree to a hundred and a thousand times these. There
  another order of sums alone, of another BLAS, changes the multigrid cycles by 2 %; all other counts stay.

Messages of log.txt and fields (VTU files) that differ are named, and are no failure. One line for each file and number of
ranks; exit status 1 if one of them DIFFERS. --verbose shows each difference. Needs Gmsh for `realistic`.
"""

import argparse
import csv
import hashlib
import itertools
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

NO_FIELDS = {"Output/Fields": "none"}
COARSE = {"Discretization/Degree": 2, "Discretization/Rotor cells": "3, 18, 1", "Discretization/Pad cells": "2, 3, 1"}

# name: (parameter file, its changes, further changes for --quick; None leaves it out).
CASES = {
    "brake": ("prm/brake.prm", {}, COARSE),
    "adaptive": ("prm/adaptive_fast.prm", NO_FIELDS,
                 {**COARSE, "Refinement/Cycles": 2, "Eigenproblem/Maximum frequency": 3000}),
    "sweep": ("prm/friction_sweep.prm", NO_FIELDS, {**COARSE, "Sweep/Values": "0 : 0.4 : 3"}),
    "map": ("prm/stability_map.prm", NO_FIELDS,
            {"Sweep/Values": "0.2 : 0.7 : 3", "Sweep/Second values": "5 : 30 : 2"}),
    "strip": ("prm/strip.prm", {}, {}),
    "realistic": ("prm/realistic_brake.prm", NO_FIELDS, None),
    "matrices": ("prm/theory/ziegler_damped.prm", {}, {}),
    "iterative": ("prm/brake.prm",
                  {**COARSE, **NO_FIELDS, "Static equilibrium/Linear solver": "iterative",
                   "Eigenproblem/Solver": "block_davidson", "Eigenproblem/Maximum frequency": 2500},
                  {"Discretization/Rotor cells": "2, 9, 1", "Discretization/Pad cells": "1, 2, 1",
                   "Discretization/Clamp layers": 0, "Eigenproblem/Maximum frequency": 1500}),
}

LOOSER = {"iterative": (100, 1000)}  # tolerances of eigenvalues and of other numbers, times

# Columns that differ from run to run, and those that hold nothing but rounding errors.
MACHINE = re.compile(r"seconds|memory")
ROUNDING = {"backward_error", "left_backward_error", "rayleigh_defect", "accuracy", "accuracy_cells",
            "max_penetration_m"}
COUNTS = {"cycle", "mode", "cells", "dofs", "multipliers", "branch", "other_branch", "iterations", "curve",
          "unstable_modes"}
# Eigenvalues of critical.csv are as good as the critical value is located: other numbers.
WITH_EIGENVALUES = {"modes.csv", "sweep.csv", "map.csv", "ladder.csv", "convergence.csv"}
GROWTH, FREQUENCY = "growth_rate_1_per_s", "frequency_hz"

LOG_COUNTS = {
    "right-hand sides": r"(\d+) right-hand sides",
    "full solutions": r"(\d+) full solutions for",
    "restarts": r"bases were restarted (\d+) times",
    "multigrid cycles": r"(\d+) multigrid cycles",
    # step, active, changes, tension, penetration, pressure change, steps of GMRES
    "active sets and steps of GMRES": r"(?m)^ +(\d+) +(\d+) +(\d+)(?: +\S+e[+-]\d+){3}(?: +(\d+))?$",
    "proven modes": r"(\d+) modes with \|l(?:ambda)?\| <=|(\d+) (?:there|counted independently)\b",
    "border": r"(\d+) crossings of the border|Border curve \d+: (\d+) points",
}
# Lines of log.txt that differ from run to run, or whose numbers tables have.
LOG_MACHINE = re.compile(r"^(?:squeal|Command:|Started:|Completeness:|Damping) |rocessor seconds|[Mm]emory| MiB|^  (\w+ +\d+\.\d\d +\d+\.\d %|total +\d+\.\d\d)$")


def sections(text):
    """The counts of log.txt by name."""
    return {name: re.findall(pattern, text) for name, pattern in LOG_COUNTS.items()}


def messages(text):
    """Lines of log.txt without numbers that have decimals, which differ by rounding."""
    return [re.sub(r"[-+]?\d+\.\d+(e[-+]?\d+)?|[-+]?\d+e[-+]\d+|[-+]0\b", "#", line)
            for line in text.splitlines() if not LOG_MACHINE.search(line)]


class Difference:
    """What two results have different: `wrong` fails, `notes` do not."""

    def __init__(self):
        self.wrong, self.notes, self.details = [], [], []
        self.bytes_differ = False
        self.eigenvalues = self.others = 0.0
        self.others_at = ""

    def other(self, difference, place):
        if not difference <= self.others:
            self.others, self.others_at = difference, place

    def verdict(self, tolerance, other_tolerance):
        wrong = list(self.wrong)
        if not self.eigenvalues <= tolerance:  # a nan is wrong, too
            wrong.append(f"eigenvalues by {self.eigenvalues:.1e}")
        if not self.others <= other_tolerance:
            wrong.append(f"{self.others_at} by {self.others:.1e}")
        if wrong:
            return "DIFFERS  " + "; ".join(wrong + self.notes), False
        if self.bytes_differ:
            text = f"differs {self.eigenvalues:.0e}"
            if self.others > 0:
                text += f" ({self.others_at} {self.others:.0e})"
        else:
            text = "equal"
        return text + "".join("; " + note for note in self.notes), True


def number(cell):
    try:
        return float(cell)
    except ValueError:
        return None


def compare_tables(name, before, after, difference):
    """Two texts of one CSV file, cell by cell."""
    before, after = ([row for row in csv.reader(text.splitlines())] for text in (before, after))
    header = before[0]
    if after[0] != header:
        difference.wrong.append(f"{name}: columns")
        return
    if len(before) != len(after):
        difference.wrong.append(f"{name}: {len(before) - 1} and {len(after) - 1} rows")
        return
    compared = [i for i, column in enumerate(header) if not MACHINE.search(column)]
    eigenvalues = name in WITH_EIGENVALUES and FREQUENCY in header
    # A column of numbers far below all others holds rounding errors, too: g of a system without gyroscopic terms.
    magnitudes = [max((abs(number(row[i]) or 0) for row in before[1:]), default=0) for i in range(len(header))]
    worst = {}
    for i in compared:
        column = header[i]
        cells = [(a[i], b[i]) for a, b in zip(before[1:], after[1:])]
        if all(a == b for a, b in cells) or column in ROUNDING or magnitudes[i] < 1e-15 * max(magnitudes):
            difference.bytes_differ |= any(a != b for a, b in cells)
            continue
        difference.bytes_differ = True
        numbers = [(number(a), number(b)) for a, b in cells]
        differs = [k for k, (a, b) in enumerate(cells) if a != b]
        if column in COUNTS or any(None in numbers[k] for k in differs):
            k = next((k for k in differs if None in numbers[k]), differs[0])
            difference.wrong.append(f"{name}: {column} in {len(differs)} rows")
            difference.details.append(f"{name}, row {k + 1}, {column}: {cells[k][0]!r} and {cells[k][1]!r}")
        elif not (eigenvalues and column in (GROWTH, FREQUENCY)):
            largest = max(abs(numbers[k][0] - numbers[k][1]) for k in differs) / (magnitudes[i] or 1)
            difference.other(largest, f"{name}: {column}")
            worst[column] = largest
    difference.details += [f"{name}: {column} {value:.1e}" for column, value in worst.items() if value > 0]
    if eigenvalues:
        growth, frequency = header.index(GROWTH), header.index(FREQUENCY)
        largest = 0.0
        for a, b in zip(before[1:], after[1:]):
            if a[growth] and b[growth]:
                l, m = (complex(float(row[growth]), 2 * math.pi * float(row[frequency])) for row in (a, b))
                relative = abs(l - m) / abs(l) if l != m else 0.0
                largest = relative if not relative <= largest else largest  # a nan stays
        if not largest <= difference.eigenvalues:
            difference.eigenvalues = largest
        if largest != 0:
            difference.details.append(f"{name}: eigenvalues {largest:.1e}")


def compare(before, after):
    """Two results: {file name: text of a table or log, or checksum of anything else}."""
    difference = Difference()
    if set(before) != set(after):
        difference.wrong.append("files: " + ", ".join(sorted(set(before) ^ set(after))[:4]))
    for name in sorted(set(before) & set(after)):
        a, b = before[name], after[name]
        if a == b:
            continue
        if name.endswith(".csv"):
            compare_tables(name, a, b, difference)
        elif name == "log.txt":
            of_a, of_b = sections(a), sections(b)
            for count in of_a:
                if of_a[count] != of_b[count]:
                    difference.wrong.append(count)
                    difference.details.append(f"{count}: {of_a[count]} and {of_b[count]}")
            lines = [pair for pair in itertools.zip_longest(messages(a), messages(b), fillvalue="")
                     if pair[0] != pair[1]]
            if lines:
                difference.notes.append(f"{len(lines)} messages")
                difference.details += [f"log.txt: < {x}\n         > {y}" for x, y in lines[:5]]
    fields = [name for name in before if name.endswith("vtu") and before[name] != after.get(name)]
    if fields:
        difference.notes.append(f"{len(fields)} files of fields")
    return difference


def read_results(directory):
    """What a run has written. Where and when it ran does not belong to it."""
    results = {}
    for path in sorted(directory.rglob("*")):
        if path.is_file() and path.name not in ("original.prm", "parameters.prm", "report.html"):
            if path.suffix in (".csv", ".txt"):
                results[path.name] = path.read_text()
            else:
                dated = re.compile(rb"file was generated by the deal.II library on.*")
                results[path.name] = hashlib.sha256(dated.sub(b"", path.read_bytes())).hexdigest()
    return results


def execute(program, file, settings, ranks, where, cache):
    """Runs in `where`; the results, and the processor seconds of all ranks."""
    options = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
    key = None
    if cache:
        content = program.read_bytes() + (where / file).read_bytes() + repr((file, options, ranks)).encode()
        key = cache / (hashlib.sha256(content).hexdigest() + ".json")
        if key.exists():
            return json.loads(key.read_text())
    directory = where / "output" / pathlib.Path(file).stem
    shutil.rmtree(directory, ignore_errors=True)
    start = os.times()
    result = st.run(file, *options, ranks=ranks, directory=where, executable=program, timeout=7200)
    end = os.times()
    if result.returncode != 0:
        return None, f"{program} ends with {result.returncode}: {result.stderr.strip()}"
    seconds = end.children_user + end.children_system - start.children_user - start.children_system
    found = read_results(directory), seconds
    if key:
        cache.mkdir(parents=True, exist_ok=True)
        key.write_text(json.dumps(found))
    return found


def make_mesh(where):
    """prm/realistic_brake.msh in `where`: that of the project if there is one, so that Gmsh runs once."""
    target = where / "prm/realistic_brake.msh"
    if not target.exists():
        kept = st.PROJECT / "prm/realistic_brake.msh"
        if not kept.exists():
            if not shutil.which("gmsh"):
                return False
            subprocess.run(["gmsh", "-3", st.PROJECT / "prm/realistic_brake.geo", "-o", kept], check=True,
                           stdout=subprocess.DEVNULL)
        shutil.copy(kept, target)
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=pathlib.Path)
    parser.add_argument("after", type=pathlib.Path)
    parser.add_argument("--ranks", type=int, nargs="+", default=[1])
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES), metavar="NAME",
                        help=", ".join(CASES))
    parser.add_argument("--quick", action="store_true", help="coarse meshes, a minute in all; not `realistic`")
    parser.add_argument("--tolerance", type=float, default=1e-11, help="of eigenvalues, relative")
    parser.add_argument("--other", type=float, default=1e-6, help="of other numbers, relative to their column")
    parser.add_argument("--cache", type=pathlib.Path, help="keep results here, by program and parameters, and reuse them")
    parser.add_argument("--verbose", action="store_true", help="show each difference")
    arguments = parser.parse_args()
    programs = [program.resolve() for program in (arguments.before, arguments.after)]
    fine = True
    with tempfile.TemporaryDirectory(prefix="squeal-same-") as temporary:
        where = pathlib.Path(temporary)
        shutil.copytree(st.PROJECT / "prm", where / "prm", ignore=shutil.ignore_patterns("*.msh"))
        for name in arguments.only:
            file, settings, coarser = CASES[name]
            if arguments.quick:
                if coarser is None:
                    continue
                settings = {**settings, **coarser}
            for ranks in arguments.ranks:
                title = f"{name:10s} {ranks} rank{'s' if ranks > 1 else ' '}  "
                if name == "realistic" and not make_mesh(where):
                    print(title + "skipped: needs gmsh (scripts/install-dependencies.sh --mesh)", flush=True)
                    continue
                found = [execute(program, file, settings, ranks, where, arguments.cache) for program in programs]
                failed = [seconds for results, seconds in found if results is None]
                if failed:
                    fine = False
                    print(title + "DIFFERS  " + "; ".join(failed), flush=True)
                    continue
                difference = compare(found[0][0], found[1][0])
                looser = LOOSER.get(name, (1, 1))
                text, equal = difference.verdict(arguments.tolerance * looser[0], arguments.other * looser[1])
                fine = fine and equal
                print(f"{title}{found[0][1]:6.1f} {found[1][1]:6.1f} s  {text}", flush=True)
                if arguments.verbose:
                    for line in difference.details:
                        print("    " + line, flush=True)
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
