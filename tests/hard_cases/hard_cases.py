"""Hard cases: each a parameter file of tests/hard_cases with what is expected and why; all of them by one command:

    python3 tests/hard_cases/hard_cases.py [--program build/release/squeal] [case ...]

prints a table for doc/hard_cases.md (markdown) and ends with 1 if an expectation fails. A case is a function below of
the name of its parameter file; it yields one line of the table for each expectation: what is expected, what was found,
whether that is so. Expected values come from closed forms, other formulations or other solvers, never from earlier
output of the program. A run that does not end in time, or with another exit status than expected, fails the case.
Seconds are processor seconds of all runs of the case.
"""

import argparse
import math
import os
import pathlib
import re
import shutil
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

from closed_forms import plate_frequencies  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
CASES = {}  # name: (what is hard, function)
PAD_AREA = math.radians(50) / 2 * (0.14 ** 2 - 0.09 ** 2)


def hard(what):
    """A decorator: the function is a case."""

    def add(function):
        CASES[function.__name__] = (what, function)
        return function

    return add


class Result:
    """What a run left: exit status, messages, tables."""

    def __init__(self, st, process, directory):
        self.status, self.log, self.message = process.returncode, process.stdout, process.stderr.strip()

        def table(name):
            return st.read_table(directory / name) if (directory / name).exists() else []

        self.modes, self.static, self.critical = table("modes.csv"), table("static.csv"), table("critical.csv")
        self.l = [st.eigenvalue(row) for row in self.modes]
        self.f = [row["frequency_hz"] for row in self.modes]


class Runner:
    """Runs the parameter file of a case in a directory of its own."""

    def __init__(self, st, name):
        self.st, self.case, self.n_runs = st, name, 0
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="squeal-hard-"))

    def __call__(self, settings=None, file=None, status=0, timeout=60):
        """status: the exit status that the run must have; None: any, the case looks at it."""
        self.n_runs += 1
        results = self.directory / f"run{self.n_runs}"
        arguments = [HERE / f"{file or self.case}.prm", "--set", f"Output/Directory={results}"]
        for key, value in (settings or {}).items():
            arguments += ["--set", f"{key}={value}"]
        result = Result(self.st, self.st.run(*arguments, directory=self.directory, timeout=timeout,
                                             executable=self.st.SQUEAL), results)
        if status is not None and result.status != status:
            last = result.message.splitlines()[-1] if result.message else "no message"
            raise AssertionError(f"run {self.n_runs}: exit status {result.status}: {last.removeprefix('squeal: ')}")
        return result

    def matrix(self, name, entries, n):
        """Writes a Matrix Market file from {(row, column): value}, counted from 0."""
        lines = ["%%MatrixMarket matrix coordinate real general", f"{n} {n} {len(entries)}"]
        lines += [f"{i + 1} {j + 1} {value!r}" for (i, j), value in sorted(entries.items())]
        (self.directory / name).write_text("\n".join(lines) + "\n")


def largest(values):
    return max(values, default=math.inf)


def nearest(values, x):
    return min(values, key=lambda v: abs(v - x)) if values else math.inf


def distance(a, b):
    """Largest relative distance of two sets of numbers, each paired with the nearest one left; inf if sizes differ."""
    rest, worst = list(a), 0.
    if len(a) != len(b):
        return math.inf
    for x in b:
        partner = nearest(rest, x)
        rest.remove(partner)
        worst = max(worst, abs(partner - x) / abs(x))
    return worst


def processor_seconds():
    """Of all runs so far: a busy machine does not change them."""
    import squeal_testing as st  # reads SQUEAL
    return st.processor_seconds()


def far_from_force(rows, force, mu):
    """The largest relative error of a table static.csv: normal force of every pad, friction force mu times that."""
    return largest([abs(row["normal_force_n"] / force - 1) for row in rows] +
                   [abs((row["friction_force_n"] or 0) / force - mu) for row in rows])


@hard("exactly at coalescence: a defective matrix")
def coalescence(run):
    """Rounding of the entries, 1e-15 of 110 (the largest eigenvalue), moves the double eigenvalue l^2 = -10 by
    sqrt(1e-13): l by 5e-8."""
    n = 12
    exact = [[0.] * n for _ in range(n)]
    exact[0][:2], exact[1][:2] = [11., 1.], [-1., 9.]
    for i in range(2, n):
        exact[i][i] = 10. * i
    # H K H with H = I - 2 v v^T, v = (1, ..., 1)/sqrt(n)
    rows = [[x - 2 / n * sum(row) for x in row] for row in exact]
    columns = [2 / n * sum(row[j] for row in rows) for j in range(n)]
    run.matrix("stiffness.mtx", {(i, j): rows[i][j] - columns[j] for i in range(n) for j in range(n)}, n)
    run.matrix("mass.mtx", {(i, i): 1. for i in range(n)}, n)
    double = 1j * math.sqrt(10)
    for solver in ["block_krylov", "krylov", "dense"]:
        result = run({"Eigenproblem/Solver": solver})
        pair = [row for row, l in zip(result.modes, result.l) if abs(l - double) < 1e-3]
        errors = [abs(run.st.eigenvalue(row) - double) for row in pair]
        # The table's own claim: a rounding error of the matrix moves l by condition * |dK| / |2 l| at most.
        claims = [row["condition_number"] * 1e-15 * 110 / abs(2 * double) for row in pair]
        yield (f"{solver}: l = j sqrt(10) twice, to 2e-7", f"{len(pair)} modes, {largest(errors):.0e} off",
               len(pair) == 2 and largest(errors) < 2e-7)
        yield (f"{solver}: condition number times rounding is more than that",
               f"{min(claims, default=0):.0e}", all(e <= 10 * c for e, c in zip(errors, claims)) and len(pair) == 2)
        yield (f"{solver}: no verdict", ", ".join(row["verdict"] for row in pair),
               all(row["verdict"] in ("marginal", "undecided") for row in pair))


@hard("a brake at the friction of coalescence")
def coalescence_brake(run):
    """|l - l_c| = c sqrt(mu - mu_c): the square-root law needs no other solution. Near mu_c it holds to the order
    sqrt(mu - mu_c) in l, to the order mu - mu_c in the growth rate."""
    key = "Contact/Friction/Coefficient"
    sweep = run({"Sweep/Parameter": key, "Sweep/Values": "0 : 0.4 : 5", "Sweep/Critical values": "true"})
    found = [row for row in sweep.critical if row["kind"] == "coalescence"]
    yield "the sweep finds one", f"{len(found)}", len(found) >= 1
    if not found:
        return
    mu_c, l_c = found[0]["value"], run.st.eigenvalue(found[0])

    def modes_at(mu, solver="block_krylov"):
        result = run({key: repr(mu), "Eigenproblem/Solver": solver})
        rows = sorted(result.modes, key=lambda row: abs(run.st.eigenvalue(row) - l_c))
        return rows[:2]

    slope = [(run.st.eigenvalue(modes_at(mu_c + d)[0]) - l_c) for d in (1e-3, 4e-3)]
    growth = [abs(l.real) for l in slope]
    # At mu_c: the program knows mu_c to `accuracy`; the square root of that is what l may be off.
    tolerance = 10 * growth[0] * math.sqrt(max(found[0]["accuracy"], 1e-14 * mu_c) / 1e-3)
    for solver in ["block_krylov", "krylov"]:
        pair = modes_at(mu_c, solver)
        off = largest([abs(run.st.eigenvalue(row) - l_c) for row in pair])
        yield (f"{solver} at mu_c = {mu_c:.6f}: both modes within {tolerance:.0e} 1/s", f"{off:.0e}", off < tolerance)
        condition = min(row["condition_number"] for row in pair)
        yield f"{solver} at mu_c: condition number > 1e3", f"{condition:.0e}", condition > 1e3
    yield ("growth rate twice as large at four times the distance, to 2 %", f"{growth[1] / growth[0]:.4f}",
           abs(growth[1] / growth[0] - 2) < 0.04)


@hard("lining of nu = 0.499")
def incompressible_lining(run):
    truth = run({"Discretization/Degree": 5}).f
    for degree in (2, 3, 4):
        result = run({"Discretization/Degree": degree})
        rows = result.modes
        errors = [abs(row["frequency_hz"] - f) for row, f in zip(rows, truth)]
        relative = largest([e / f for e, f in zip(errors, truth)])
        ratio = largest([e / row["frequency_error_hz"] for e, row in zip(errors, rows)])
        if degree == 3:
            yield "degree 3 right to 1e-3", f"{relative:.1e}", relative < 1e-3 and len(rows) == len(truth)
        if degree < 4:
            warns = "Warning, nearly incompressible" in result.log
            yield f"degree {degree}: a warning of locking", f"{warns}", warns
        yield f"degree {degree}: error / bar < 1", f"{ratio:.2f}", ratio < 1 and len(rows) == len(truth)


@hard("rotor 1 mm thin")
def thin_rotor(run):
    result = run()
    modes = result.modes
    plate = sorted(f for n in range(6) for f in plate_frequencies(n, 210) for _ in range(2 if n else 1))
    errors = [abs(row["frequency_hz"] - f) for row, f in zip(modes, plate)]
    relative = largest([e / f for e, f in zip(errors, plate)])
    yield ("the frequencies of Kirchhoff's plate, to 1e-2", f"{len(modes)} of {len(plate)} modes, {relative:.1e}",
           len(modes) == len(plate) and relative < 1e-2)

    def ratio(modes):
        return largest([abs(row["frequency_hz"] - f) / (row["frequency_error_hz"] + 3e-4 * f)
                        for row, f in zip(modes, plate)])

    warns = "Warning, thin rotor" in result.log
    bars = ratio(modes)
    yield ("cells 33 times as long as thick: a warning of locking, error / (bar + 3e-4 of the plate's theory) < 1",
           f"{warns}, {bars:.2f}", warns and bars < 1)
    # Degree 2 locks by half: up to twice the plate's frequencies, which the window must hold.
    truth = run({"Discretization/Degree": 5, "Eigenproblem/Error bars": "false"}).modes
    coarse = run({"Discretization/Degree": 2, "Eigenproblem/Maximum frequency": 420}).modes
    bars = largest([abs(a["frequency_hz"] - b["frequency_hz"]) / a["frequency_error_hz"] for a, b in zip(coarse, truth)])
    yield ("degree 2 against degree 5: error / bar < 1", f"{bars:.2f}", bars < 1 and len(coarse) >= len(truth))
    fine = run({"Discretization/Rotor cells": "6, 24, 1", "Discretization/Degree": 4, "Discretization/Clamp layers": 2})
    bars = ratio(fine.modes)
    yield ("with finer cells: error / (bar + 3e-4 of the plate's theory) < 1", f"{bars:.2f}",
           bars < 1 and len(fine.modes) == len(plate) and "Warning" not in fine.log)


@hard("beyond the critical speed")
def beyond_critical(run):
    """In the disc's own frame Coriolis' and the centrifugal force act along the disc, bending waves do not feel them:
    w (d_t + Omega d_phi)^2: l = j (w_n +- n Omega), of which those with Im l >= 0 are listed."""
    result = run()
    n_omega = [n * 400 / (2 * math.pi) for n in range(11)]
    waves = [(abs(f + s * n_omega[n]), f) for n in range(11)
             for f in plate_frequencies(n, n_omega[n] + 140) for s in ((-1, 1) if n else (0,))]
    waves = sorted(w for w in waves if w[0] < 135)
    critical = min(2 * math.pi * plate_frequencies(n, 320)[0] / n for n in (2, 3, 4))
    off = largest([abs(a - b) / f for a, (b, f) in zip(result.f, waves)])
    yield "Omega = 400 rad/s is beyond the critical speed", f"{critical:.0f} rad/s", critical < 400
    told = re.search(r"Warning, critical speed: .* whose critical speed is (\S+) rad/s", result.log)
    told = float(told[1]) if told else 0
    yield "the log warns of it, and tells it to 2 %", f"{told:.0f} rad/s", abs(told / critical - 1) < 0.02
    yield ("all |f_n +- n Omega/2 pi|, to 2 % of f_n", f"{len(result.f)} of {len(waves)} modes, {off:.1e}",
           len(result.f) == len(waves) and off < 0.02)
    growth = largest([abs(l.real) for l in result.l])
    yield ("no growth: |Re l| < 1e-9 of the disc's 2 pi 420 Hz", f"{growth:.0e} 1/s",
           growth < 1e-9 * 2 * math.pi * 420 and
           all(row["verdict"] in ("marginal", "undecided") for row in result.modes))


@hard("lining 1000 times softer than the plate")
def soft_lining(run):
    import mesh_files as mf
    mesh = mf.brake(pad_cells=(2, 3, 2), pads=("upper",), plate_layers=1)
    (run.directory / "soft_lining.msh").write_text(mf.msh2(mesh))
    result = run()
    t, (z1, c1), (z2, c2) = 0.006, (math.sqrt(2e8 * 2500), math.sqrt(2e8 / 2500)), (math.sqrt(2e11 * 7850),
                                                                                  math.sqrt(2e11 / 7850))

    def rod(f):
        w = 2 * math.pi * f
        return z1 / math.tan(w * t / c1) - z2 * math.tan(w * t / c2)

    low, high = 100., 10000.  # decreasing, one root
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if rod(middle) > 0 else (low, middle)
    off = abs(nearest(result.f, low) / low - 1)
    yield f"the layered rod's {low:.3f} Hz, to 1e-4", f"{off:.0e}", off < 1e-4
    force = abs(result.static[0]["normal_force_n"] / 1e6 / PAD_AREA - 1)
    yield "normal force = pressure times the sector's area, to 1e-4", f"{force:.0e}", force < 1e-4


@hard("friction close to self-locking")
def self_locking(run):
    key = "Contact/Friction/Coefficient"
    gain = run({key: 0.6}).static[0]["self_energising_gain"]
    critical_mu = 0.6 / gain
    sweep = run({"Sweep/Parameter": key, "Sweep/Values": f"{0.9 * critical_mu} : {1.08 * critical_mu} : 4",
                 "Sweep/Critical values": "true", "Contact/Self-locking check": "false"})
    found = [row["value"] for row in sweep.critical if row["kind"].startswith("divergence")]
    off = abs(nearest(found, critical_mu) / critical_mu - 1)
    yield f"det Q = 0 where the gain is 1: mu = {critical_mu:.4f}, to 1e-4", f"{off:.0e}", off < 1e-4
    if not found:
        return
    close = run({key: repr(0.9999 * nearest(found, critical_mu))})
    gain = close.static[0]["self_energising_gain"]
    yield "gain 0.9999 at 0.9999 of that, to 1e-4", f"{gain:.5f}", abs(gain - 0.9999) < 1e-4
    beyond = run({key: repr(1.01 * nearest(found, critical_mu))})
    yield ("at 1.01 of that, a warning", "Warning, self-locking" if "Warning, self-locking" in beyond.log else "none",
           "Warning, self-locking" in beyond.log)


@hard("friction beyond self-locking, pads lift off")
def brake_locks(run):
    closed = run({"Contact/Friction/Coefficient": 0.3, "Contact/Steady pressure": "uniform", "Stage": "friction"})
    gain = 10 * closed.static[0]["self_energising_gain"]
    yield "gain at mu = 3, contacts closed: above 1", f"{gain:.2f}", gain > 1
    result = run(status=None)
    yield ("exit status 3, a message that says self-locking", f"{result.status}: {result.message[8:60]} ...",
           result.status == 3 and "self-locking (gain" in result.message)


@hard("friction that all but tips the block, and more")
def tipping(run):
    off = far_from_force(run().static, 50000, 1.2499)
    yield "mu = 1.2499: forces to 1e-6", f"{off:.0e}", off < 1e-6
    for mu in (1.26, 1.5, 2, 3, 5):
        result = run({"Contact/Friction/Coefficient": mu}, status=None)
        if result.status == 0:
            found = f"exit status 0, normal force {result.static[0]['normal_force_n']:.0f} N"
        else:
            found = f"{result.status}: {result.message[8:60]}"
        yield (f"mu = {mu}: exit status 3, no word of Eigenproblem/Shift", found,
               result.status == 3 and "Eigenproblem/Shift" not in result.message)


@hard("Omega = 1e-3 rad/s, rotor")
def slow_rotor(run):
    rest, turning = run({"Stage": "elastic"}), run()
    reference = sorted((row["frequency_hz"], int(row["nodal_diameters"]))
                       for row in run.st.read_table(run.st.REFERENCE / "rotor_T1.csv") if row["frequency_hz"] < 1600)
    k, splits = 0, []
    for _, n in reference:  # the order of the modes on this mesh, too: it is right to 4 %
        if n:
            splits.append((turning.f[k + 1] - turning.f[k]) / (n * 1e-3 / math.pi) - 1)
        k += 2 if n else 1
    off = largest([abs(s) for s in splits])
    yield "pairs are split by n Omega/pi, to 1 %", f"{len(splits)} pairs, {off:.1e}", len(splits) == 3 and off < 0.01
    off = distance(rest.f, turning.f)
    yield "otherwise the frequencies at rest, to 1e-6", f"{off:.0e}", off < 1e-6


@hard("Omega = 1e-3 rad/s, brake with friction damping")
def slow_brake(run):
    one, two, four = (run({"Operation/Angular velocity": omega}) for omega in ("1e-3", "2e-3", "4e-3"))
    oscillating, held = [], []
    for a, b, c in zip(one.l, two.l, four.l):
        (oscillating if abs(a.imag) > abs(a.real) else held).append((a, b, c))
    same = len(one.l) == len(two.l) == len(four.l) and len(oscillating) == 5
    move = largest([abs(b - a) / abs(a) for a, b, _ in oscillating])
    yield "five oscillating modes are near a limit, to 1e-3", f"{len(oscillating)}, {move:.0e}", same and move < 1e-3
    bend = largest([abs((c - b) / (b - a) - 2) for a, b, c in oscillating])
    yield "they move in proportion to Omega, to 5 %", f"{bend / 2:.0e}", same and bend < 0.1
    bend = max([abs(b / a - 2) for a, b, _ in held], default=0)
    yield "overdamped ones are proportional to Omega, to 1 %", f"{len(held)}, {bend / 2:.0e}", bend < 0.02
    other = distance(run({"Eigenproblem/Solver": "krylov"}).l, one.l)
    yield "SLEPc's solver: the same to 1e-7", f"{other:.0e}", other < 1e-7


@hard("k_C from 1e6 to 1e18 N/m^3")
def contact_stiffness(run):
    mortar = run({"Contact/Formulation": "mortar"})
    rotor = run({"Pads/Arrangement": "none"})
    for k_c in ("1e6", "1e12", "1e18"):
        point, weak = (run({"Contact/Formulation": formulation, "Contact/Penalty stiffness": k_c})
                       for formulation in ("penalty", "mortar_penalty"))
        off = distance(point.l, weak.l)
        yield f"k_C = {k_c}: penalty = mortar_penalty, to 1e-6", f"{off:.0e}", off < 1e-6
        if k_c == "1e6":
            bounce = math.sqrt(1e6 / (2500 * 0.012)) / (2 * math.pi)
            off = abs(nearest(weak.f, bounce) / bounce - 1)
            yield f"1e6: the pad bounces with {bounce:.3f} Hz, to 1e-4", f"{off:.0e}", off < 1e-4
            raised = [a / b - 1 for a, b in zip([f for f in weak.f if f > 100], rotor.f)]
            yield ("1e6: the rotor's frequencies, raised by 0 to 1e-3",
                   f"{len(weak.f) - len(rotor.f)} more modes, {min(raised):.0e} to {max(raised):.0e}",
                   len(weak.f) == len(rotor.f) + 6 and min(raised) > -1e-9 and max(raised) < 1e-3)
        if k_c == "1e18":
            off = largest([distance(point.l, mortar.l), distance(weak.l, mortar.l)])
            yield "1e18: mortar, to 1e-6", f"{off:.0e}", off < 1e-6


@hard("one cell against a thousand at the interface")
def one_against_thousand(run):
    truth = run({"Discretization/Degree": 6, "Discretization/Rotor cells": "1, 32, 2",
                 "Discretization/Pad cells": "1, 8, 2", "Eigenproblem/Error bars": "false"})
    for name, settings in (("block", {}), ("layer", {"Discretization/Rotor cells": "1, 4, 1",
                                                     "Discretization/Pad cells": "1, 1000, 1"})):
        result = run(settings, status=None)
        if result.status != 0:
            yield f"one cell of the {name}: exit status 0", f"{result.status}: {result.message[8:120]}", False
            continue
        off = far_from_force(result.static, 50000, 0.6)
        yield f"one cell of the {name}: forces to 1e-8", f"{off:.0e}", off < 1e-8
        ratio = largest([abs(row["frequency_hz"] - f) / row["frequency_error_hz"]
                         for row, f in zip(result.modes, truth.f)])
        # doc/error_bars.md: very coarse meshes see a third of the error at least.
        yield (f"one cell of the {name}: error / bar < 3", f"{len(result.f)} modes of {len(truth.f)}, {ratio:.2f}",
               len(result.f) == len(truth.f) and ratio < 3)


@hard("the pad is a single cell")
def one_cell_pad(run):
    a = math.radians(25)
    area = (0.14 ** 2 - 0.09 ** 2) * math.sin(a) * (1 + (1 - math.cos(a)) / 3)
    off = far_from_force(run().static, 1e6 * area, 0.6)
    yield "forces of the cell's own area, to 1e-8", f"{off:.0e}", off < 1e-8


@hard("the pad touches with one edge only")
def one_edge(run):
    n = 200  # Simpson's rule in r and phi
    weight = [(1 if i in (0, n) else 4 if i % 2 else 2) / 3 / n for i in range(n + 1)]
    angle = math.radians(50)
    force = sum(weight[i] * weight[j] * r * 1e6 * math.exp(300 * (r * math.sin(phi) - 0.045)) * 0.05 * angle
                for i in range(n + 1) for r in [0.09 + 0.05 * i / n]
                for j in range(n + 1) for phi in [angle * (j / n - 0.5)])
    result = run()
    off = far_from_force(result.static, force, 0.6)
    yield f"forces to 1e-3: N = {force:.2f} N", f"{off:.0e}", off < 1e-3  # quadrature of exp(300 y)
    part = result.static[0]["contact_area_m2"] / PAD_AREA
    yield "less than half of the face touches", f"{part:.2f}", part < 0.5
    tilted = run({"Contact/Initial gap": "1e-5*(0.06 + y)"})
    off = max(distance(tilted.l, result.l), far_from_force(tilted.static, result.static[0]["normal_force_n"], 0.6))
    yield "a gap linear in y changes nothing, to 1e-6", f"{off:.0e}", off < 1e-6
    bent = run({"Contact/Initial gap": "0.01*y^2"})
    change = abs(bent.static[0]["max_pressure_pa"] / result.static[0]["max_pressure_pa"] - 1)
    yield "(a gap of y^2 / 100 m does: the largest pressure, by more than 1 %)", f"{change:.1e}", change > 0.01
    other = run({"Pads/Pressure profile": "exp(300*(-y - 0.045))"}, status=None)
    found = (f"exit status 0, normal force {other.static[0]['normal_force_n']:.0f} N" if other.status == 0
             else f"{other.status}: {other.message[8:60]}")
    yield ("load on the other edge: exit status 3, the static equilibrium is named", found,
           other.status == 3 and "static" in other.message)


@hard("free pads")
def free_pad(run):
    result = run()
    off = far_from_force(result.static, 1e6 * PAD_AREA, 0)
    yield "without friction: normal force = pressure times area, to 1e-4", f"{off:.0e}", off < 1e-4
    line = next((line for line in result.log.splitlines() if "rigid-body" in line), "not said")
    yield "six rigid-body modes, not listed", line, "Not listed: 6 rigid" in line and min(result.f) > 100
    full = run({"Stage": "full"}, status=None)
    found = (f"exit status 0, normal forces {', '.join('%.0f' % row['normal_force_n'] for row in full.static)} N"
             if full.status == 0 else f"{full.status}: {full.message[8:60]}")
    yield "with friction: exit status 2 or 3", found, full.status in (2, 3)


@hard("a free rotor")
def free_rotor(run):
    rest = run()
    line = next((line for line in rest.log.splitlines() if "rigid-body" in line), "not said")
    yield "at rest six rigid-body modes, not listed", line, "Not listed: 6 rigid" in line and min(rest.f) > 100
    turning = run({"Stage": "transport"}, status=None)
    growing = [f"{row['growth_rate_1_per_s']:.3f} 1/s, {row['verdict']}" for row in turning.modes
               if row["verdict"] in ("divergence", "flutter")]
    yield ("turning: no mode is said to grow, or exit status 2", "; ".join(growing) or f"status {turning.status}",
           turning.status == 2 or (turning.status == 0 and not growing))


@hard("units: numbers of size 1e-12")
def units(run):
    def scaled(length, mass):
        """The default brake in units of 1/length m and 1/mass kg, and seconds."""
        settings = {f"{body}/{key}": value * length for body, key, value in [
            ("Rotor", "Inner radius", 0.05), ("Rotor", "Outer radius", 0.15), ("Rotor", "Thickness", 0.012),
            ("Pads", "Inner radius", 0.09), ("Pads", "Outer radius", 0.14), ("Pads", "Thickness", 0.012)]}
        for body, young, rho in (("Rotor", 1.25e11, 7200), ("Pads", 1e10, 2500)):
            settings[f"{body}/Material/Young modulus"] = young * mass / length
            settings[f"{body}/Material/Density"] = rho * mass / length ** 3
        settings["Pads/Pressure"] = 1e6 * mass / length
        return {key: repr(value) for key, value in settings.items()}

    normal = run()
    for name, length, mass in (("masses of 1e12 kg", 1, 1e-12), ("mm, tonne", 1e3, 1e-3),
                               ("lengths of 1e-12 m", 1e12, 1), ("lengths of 1e12 m", 1e-12, 1e-12)):
        other = run(scaled(length, mass), status=None)
        if other.status != 0:
            yield f"{name}: as in SI", f"{other.status}: {other.message[8:60]}", False
            continue
        off = distance(other.l, normal.l)
        yield f"{name}: eigenvalues to 1e-8", f"{off:.0e}", off < 1e-8
        for key, unit in (("normal_force_n", mass * length), ("max_pressure_pa", mass / length)):
            off = largest([abs(a[key] / unit / b[key] - 1) for a, b in zip(other.static, normal.static)])
            yield f"{name}: {key} to 1e-6", f"{off:.0e}", off < 1e-6


@hard("an eigenvalue of multiplicity 6, and 40")
def repeated_matrices(run):
    n = 200
    for multiplicity in (6, 40):
        frequencies = [100.] * multiplicity + [101. + i for i in range(n - multiplicity)]
        run.matrix("mass.mtx", {(i, i): 1. for i in range(n)}, n)
        run.matrix("stiffness.mtx", {(i, i): (2 * math.pi * f) ** 2 for i, f in enumerate(frequencies)}, n)
        expected = [f for f in frequencies if f < 150.5]
        result = run(status=None)
        off = distance(result.f, expected)
        what = f"multiplicity {multiplicity}: all modes to 1e-9"
        if multiplicity > 6:
            what += ", or exit status 3 and 'missing'"
        yield (what, f"{len(result.f)} of {len(expected)}, {off:.0e}" if result.status == 0
               else f"{result.status}: {result.message[8:]}",
               (result.status == 0 and off < 1e-9) or
               (multiplicity > 6 and result.status == 3 and "missing" in result.message))


@hard("repeated eigenvalues of a symmetric rotor")
def repeated_rotor(run):
    result = run()
    reference = sorted((row["frequency_hz"], int(row["multiplicity"]))
                       for row in run.st.read_table(run.st.REFERENCE / "rotor_T1.csv") if row["frequency_hz"] < 1600)
    expected = [f for f, multiplicity in reference for _ in range(multiplicity)]
    off = distance(result.f, expected)
    yield "the reference's modes, to 2 %", f"{len(result.f)} of {len(expected)}, {off:.1e}", off < 0.02
    k, splits = 0, []
    for _, multiplicity in reference:
        if multiplicity == 2 and k + 1 < len(result.f):
            splits.append(result.f[k + 1] / result.f[k] - 1)
        k += multiplicity
    yield ("pairs agree to 1e-9", f"{len(splits)} pairs, {largest(splits):.0e}",
           len(splits) == 3 and largest(splits) < 1e-9)
    condition = largest([row["condition_number"] - 1 for row in result.modes])
    yield "condition numbers are 1, to 1e-3", f"1 + {condition:.0e}", abs(condition) < 1e-3


@hard("a window without any mode")
def no_modes(run):
    result = run()
    yield "exit status 0, no line in modes.csv", f"{len(result.modes)} lines", not result.modes
    said = "0 modes up to 100 Hz" in result.log and "0 counted independently" in result.log
    yield "the log says so, and that it is proven", "said" if said else "not said", said
    sweep = run({"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.1, 0.2",
                 "Sweep/Critical values": "true"}, status=None)
    yield ("a sweep with critical values: exit status 0", f"{sweep.status} {sweep.message[8:60]}", sweep.status == 0)
    lowest = run({"Eigenproblem/Maximum frequency": 800}).f
    yield "the lowest mode is above 600 Hz", f"{min(lowest, default=0):.0f} Hz", bool(lowest) and min(lowest) > 600


@hard("300 modes")
def many_modes(run):
    n, k = 1000, (2 * math.pi * 1000) ** 2
    run.matrix("mass.mtx", {(i, i): 1. for i in range(n)}, n)
    chain = {(i, i): 2 * k for i in range(n)}
    chain.update({(i, i + s): -k for i in range(n) for s in (-1, 1) if 0 <= i + s < n})
    run.matrix("stiffness.mtx", chain, n)
    expected = [f for j in range(1, n + 1) for f in [2000 * math.sin(j * math.pi / 2 / (n + 1))] if f < 908]
    result = run()
    off = distance(result.f, expected)
    yield ("every one of the chain's, to 1e-9", f"{len(result.f)} of {len(expected)}, {off:.0e}",
           len(expected) == 300 and off < 1e-9)


@hard("most modes that a mesh has")
def most_modes(run):
    dense = run({"Eigenproblem/Solver": "dense"})
    off = distance(run(timeout=30).l, dense.l)
    yield f"the {len(dense.l)} modes of LAPACK, to 1e-7, in 30 s", f"{off:.0e}", off < 1e-7


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, help="default: $SQUEAL, else build/release/squeal")
    parser.add_argument("case", nargs="*", help="default: all: " + ", ".join(CASES))
    arguments = parser.parse_args()
    unknown = [name for name in arguments.case if name not in CASES]
    if unknown:
        parser.error(f"unknown: {', '.join(unknown)}. There are {', '.join(CASES)}.")
    if arguments.program:
        os.environ["SQUEAL"] = str(arguments.program.resolve())
    import squeal_testing as st  # reads SQUEAL
    if not st.SQUEAL.exists():
        parser.error(f"there is no program {st.SQUEAL}")
    without_file = {path.stem for path in HERE.glob("*.prm")} ^ set(CASES)
    if without_file:
        parser.error(f"cases and parameter files do not fit: {', '.join(sorted(without_file))}")

    def line(*cells):
        print("| " + " | ".join(str(cell).replace("|", "\\|").replace("\n", " ") for cell in cells) + " |", flush=True)

    line("case", "what is hard", "expected", "found", "seconds", "verdict")
    line(*["---"] * 6)
    n_checks, failed = 0, []
    for name in arguments.case or CASES:
        what, function = CASES[name]
        run, start, first = Runner(st, name), processor_seconds(), True
        try:
            checks = list_of(function(run))
        finally:
            shutil.rmtree(run.directory, ignore_errors=True)
        for expected, found, good in checks:
            line(name if first else "", what if first else "", expected, found,
                 f"{processor_seconds() - start:.0f}" if first else "", "ok" if good else "**fails**")
            first = False
            n_checks += 1
            if not good and name not in failed:
                failed.append(name)
    print(f"\n{n_checks} expectations; cases that fail: {', '.join(failed) or 'none'}.")
    return 1 if failed else 0


def list_of(checks):
    """All checks of a case; an exception is one more that fails."""
    result = []
    try:
        for check in checks:
            result.append(check)
    except Exception as error:  # pylint: disable=broad-except
        text = str(error).split("\n")[0] if isinstance(error, AssertionError) else repr(error)
        result.append(("the runs of this case end", text.replace(str(HERE.parents[1]) + "/", "")[:200], False))
    if not result:
        result.append(("at least one expectation", "none", False))
    return result


if __name__ == "__main__":
    sys.exit(main())
