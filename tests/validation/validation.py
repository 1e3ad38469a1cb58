#!/usr/bin/env python3
"""The gallery: problems that others published or that have closed forms, computed by the program.

    python3 tests/validation/validation.py [--program build/release/squeal] [--write] [--quick] [problem ...]

prints a table (markdown) and ends with 1 if a number differs by more than its formula's order, or from doc/validation.md.
--write makes that page; --quick leaves out what takes long. A problem is a function below; it yields a Row for each number.
Expected values come from formulas or publications, never from the program, but for what a formula needs of the disc (the
doublet's frequency and stiffness), which is measured by elastic runs on the same mesh. Seconds are processor seconds.
"""

import argparse
import math
import os
import pathlib
import re
import shutil
import sys
import tempfile
from collections import namedtuple

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "lib"))

import mesh_files  # noqa: E402
import td1  # noqa: E402
from closed_forms import (doublet_between_pads, mindlin_frequencies, plate_frequencies, plate_shape,  # noqa: E402
                          spinning_stiffness)

DOCUMENT = HERE.parents[1] / "doc/validation.md"
PROBLEMS = {}  # name: (title, source, function)
LONG = set()  # names
Row = namedtuple("Row", "quantity expected computed bar allowed")

INTRODUCTION = """# Validation: published problems and closed forms

Printed by `python3 tests/validation/validation.py --write`; a test runs it again and compares. *Allowed* is the order of what
the formula leaves out. *Bar* is the program's own error bar, where a run has one.

The linearisation has a check of its own: the nonlinear forces of contact and friction are integrated in time from a small
disturbance. Of modes that flutter, of their decaying partners and of modes that falling friction feeds, on a block on a moving
strip and on a disc between pads, the rates of growth and decay are those of the eigenvalues to 1 % (unit tests *time
integration*).

Measured brakes are missing. Searched were the laboratory brakes of Rome and Pittsburgh (Giannini, Akay, Massi 2006; Akay and
others 2009), beams on discs, a passenger car's brake (AbuBakar and Ouyang 2006) and public data of test rigs: none came with
dimensions, materials, supports and measured frequencies in full. Who has such a brake adds a function to
`tests/validation/validation.py`.

![Growth rate of pins over the speed: the doublet's quartic, its limit for slow discs, and the program](images/validation/pins.png)

![Growth rate of pins beyond the critical speed: the formula's band and the program](images/validation/band.png)

![Flutter mode of td-1](images/validation/td1.png)

Pictures: `python3 tests/validation/pictures.py`. The band is moved by rotary inertia, which its formula leaves out.

"""


def problem(title, source, is_long=False):
    """A decorator: the function is a problem."""

    def add(function):
        PROBLEMS[function.__name__] = (title, source, function)
        if is_long:
            LONG.add(function.__name__)
        return function

    return add


class Missing(Exception):
    """Data of others that lie outside of this repository are not there."""


class Runner:
    """Runs a parameter file of this folder with settings; the results of a problem lie in a directory of its own."""

    def __init__(self, st):
        self.st, self.n_runs = st, 0
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="squeal-validation-"))

    def data(self, name):
        """Data of others."""
        if not (self.st.SHARED / name).exists():
            raise Missing(f"{self.st.SHARED / name} does not exist")
        return self.st.SHARED / name

    def __call__(self, name, settings=None, table="modes.csv"):
        self.n_runs += 1
        output = self.directory / str(self.n_runs)
        options = []
        for key, value in {**(settings or {}), "Output/Directory": output}.items():
            options += ["--set", f"{key}={value}"]
        result = self.st.run(HERE / name, *options, directory=self.directory, timeout=600)
        if result.returncode:
            raise RuntimeError(result.stderr.strip())
        return self.st.read_table(output / table)


def largest_growth(rows):
    return max(row["growth_rate_1_per_s"] for row in rows)


@problem("Annular plate, 1 mm thick, clamped inside, free outside",
         "Kirchhoff's plate equation, integrated along the radius (tests/lib/closed_forms.py)")
def plate(run):
    """The lowest frequency of each number n of nodal diameters. Shear and rotary inertia, left out by Kirchhoff, are of the
    order of (h/length of a half wave)^2, 1e-4 here."""
    rows = run("plate.prm")
    for n in range(5):
        expected = plate_frequencies(n, 220)[0]
        nearest = min(rows, key=lambda row: abs(row["frequency_hz"] - expected))
        yield Row(f"f, n = {n}, Hz", expected, nearest["frequency_hz"], nearest["frequency_error_hz"], 1e-3)


def mindlin_rows(run, thickness, clamped, degree, allowed):
    """The lowest frequencies of n = 0 to 3, three of them."""
    expected = sorted((f, n) for n in range(4) for f in mindlin_frequencies(n, 1.1e5 * thickness, thickness, clamped))[:3]
    rows = run("plate.prm", {"Rotor/Thickness": thickness, "Rotor/Clamped boundary": "inner" if clamped else "none",
                             "Discretization/Degree": degree, "Discretization/Rotor cells": "4, 20, 1",
                             "Eigenproblem/Maximum frequency": 1.1 * expected[-1][0]})
    # Modes with nodal diameters are doublets, those without are not.
    is_double = [any(other is not row and abs(other["frequency_hz"] / row["frequency_hz"] - 1) < 1e-6 for other in rows)
                 for row in rows]
    for frequency, n in expected:
        row = min((row for row, double in zip(rows, is_double) if double == (n > 0)),
                  key=lambda row: abs(row["frequency_hz"] - frequency))
        bar = row["frequency_error_hz"]
        yield Row(f"f, n = {n}, h/R = {thickness / 0.15:.2g}, degree {degree}, Hz", frequency, row["frequency_hz"], bar,
                  allowed(thickness / 0.15) + bar / frequency)


@problem("Thick annular plates, free", "Mindlin's plate equations, integrated along the radius (tests/lib/closed_forms.py)")
def free_plates(run):
    """h/R from 0.05 to 0.3. What Mindlin's plate leaves out of the solid is of the order (h/R)^2: 0.06 (h/R)^2, and the
    program's own bar, are allowed."""
    for thickness in (0.0075, 0.015, 0.03, 0.045):
        yield from mindlin_rows(run, thickness, False, 3, lambda ratio: 0.06 * ratio**2)
    for degree in (2, 4):
        yield from mindlin_rows(run, 0.015, False, degree, lambda ratio: 0.06 * ratio**2)


@problem("Thick annular plates, clamped inside", "Mindlin's plate equations, as above", is_long=True)
def clamped_plates(run):
    """A solid's clamp also keeps its faces from moving along, over a length of the order of h: the difference is linear in
    h, 0.04 h/R."""
    for thickness in (0.0075, 0.015, 0.03, 0.045):
        yield from mindlin_rows(run, thickness, True, 3, lambda ratio: 0.04 * ratio)


class Pins:
    """The doublet n = 3 between pads on the radius 0.115 m, with what the formulas need, by two elastic runs."""

    n, radius, friction = 3, 0.115, 0.4

    def __init__(self, run, thickness, stiffness, **settings):
        self.run, self.thickness = run, thickness
        # The doublet is near 1450 Hz at 12 mm; frequencies go with the thickness.
        self.highest = 1500 * thickness / 0.012
        self.settings = {"Rotor/Thickness": thickness, "Contact/Penalty stiffness": stiffness,
                         "Eigenproblem/Maximum frequency": self.highest, **settings}

    def modes(self, **settings):
        return self.run("pins.prm", {**self.settings, **{key.replace("__", "/").replace("_", " "): value
                                                         for key, value in settings.items()}})

    def measure(self):
        """w of the doublet, and w^2 + k (1 +- s) of its two modes between pads."""
        free = [row["frequency_hz"] for row in self.modes(Stage="elastic", Pads__Arrangement="none")]
        held = [row["frequency_hz"] for row in self.modes(Stage="elastic")]
        self.omega = 2 * math.pi * free[-1]
        low, high = ((2 * math.pi * f)**2 for f in held[-2:])
        self.stiffness, self.s = (low + high) / 2 - self.omega**2, (high - low) / (low + high - 2 * self.omega**2)
        return self

    def coupling(self, friction=friction):
        """nu of doublet_between_pads()."""
        return self.stiffness * friction * self.thickness * self.n / (2 * self.radius)

    def roots(self, speed, friction=friction):
        """Eigenvalues by the doublet's equations."""
        return doublet_between_pads(self.n, self.omega, speed, self.stiffness, self.s, self.coupling(friction))


@problem("Pins on a thin disc, slow",
         "one doublet of Kirchhoff's plate: growth rates +- n^2 Omega mu h/(2 r), whatever stiffness, shape and modulus")
def slow_pins(run):
    """n = 3, mu = 0.4, r = 0.115 m. The formula is the limit of thin discs and of 2 n Omega w far below the pads' stiffness per
    modal mass: the difference falls with the thickness."""
    for thickness, stiffness, allowed in ((0.012, 4e11, 2e-2), (0.006, 5e10, 3e-3), (0.003, 6e9, 1e-3)):
        pins = Pins(run, thickness, stiffness)
        speed = 0.05 * thickness / 0.012
        expected = pins.n**2 * speed * pins.friction * thickness / (2 * pins.radius)
        yield Row(f"growth rate, h = {1000 * thickness:.0f} mm, Omega = {speed:g} rad/s, 1/s", expected,
                  largest_growth(pins.modes(Operation__Angular_velocity=speed)), None, allowed)


@problem("Pins on a thin disc at any speed", "the quartic of the same doublet's two equations")
def fast_pins(run):
    """h = 6 mm. At 20 rad/s the limit of slow discs would be nine times too large. Frequencies differ by Coriolis' force on
    motion in the plane of the disc, which the plate leaves out: of the order of 1e-4 at 100 rad/s."""
    pins = Pins(run, 0.006, 5e10).measure()
    for speed in (0.5, 5, 20):
        roots = [l for l in pins.roots(speed) if l.imag > 0]
        rows = pins.modes(Operation__Angular_velocity=speed)
        for expected in sorted(roots, key=lambda l: l.imag):
            row = min(rows, key=lambda row: abs(2 * math.pi * row["frequency_hz"] - expected.imag))
            yield Row(f"growth rate, Omega = {speed:g} rad/s, 1/s", expected.real, row["growth_rate_1_per_s"], None, 3e-3)
            yield Row(f"frequency, Omega = {speed:g} rad/s, Hz", expected.imag / (2 * math.pi), row["frequency_hz"], None,
                      1e-6 * max(1, speed))


@problem("Sector pads on a disc at rest", "the doublet: coalescence at mu = (2 r/(n h)) |s|/sqrt(1 - s^2)")
def sector(run):
    """Pads of 59 degrees, h = 6 mm; s of the elastic split, which other modes shift from sin(n theta)/(n theta)."""
    pins = Pins(run, 0.006, 5e10 / 59, **{"Pads/Sector angle": 59, "Discretization/Pad cells": "1, 12, 1",
                                          "Operation/Angular velocity": 0}).measure()
    expected = 2 * pins.radius / (pins.n * pins.thickness) * abs(pins.s) / math.sqrt(1 - pins.s**2)
    rows = run("pins.prm", {**pins.settings, "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Critical values": "true",
                            "Sweep/Values": f"{0.9 * expected:.6g}, {1.1 * expected:.6g}"}, "critical.csv")
    found = [row["value"] for row in rows if row["kind"] == "coalescence"]
    yield Row("friction coefficient at coalescence", expected, found[0] if len(found) == 1 else math.nan, None, 3e-3)


@problem("Pins beyond the critical speed", "the doublet: divergence for w/n < Omega < sqrt(w^2 + k (1 + s))/n, no damping",
         is_long=True)
def divergence_band(run):
    """Stage transport, n = 3; both frequencies of the doublet between pads are measured at rest. Rotary inertia, left out, is of
    the order (n h/r)^2/12, 2e-3 and 5e-4."""
    for thickness, stiffness, allowed in ((0.006, 5e10, 2e-3), (0.003, 6e9, 5e-4)):
        pins = Pins(run, thickness, stiffness).measure()
        for kind, sign in (("divergence", -1), ("divergence_end", 1)):
            expected = math.sqrt(pins.omega**2 + pins.stiffness * (1 + sign * pins.s)) / pins.n
            first, last = (1 + part * (thickness / 0.006)**2 for part in (3e-4, 1.4e-3))
            rows = pins.run("pins.prm", {**pins.settings, "Stage": "transport", "Sweep/Parameter": "Operation/Angular velocity",
                                         "Sweep/Critical values": "true",
                                         "Sweep/Values": f"{first * expected:.9g}, {last * expected:.9g}"}, "critical.csv")
            found = [row["value"] for row in rows if row["kind"] == kind]
            yield Row(f"{kind.replace('_', ' ')}, h = {1000 * thickness:.0f} mm, Omega, rad/s", expected,
                      found[0] if len(found) == 1 else math.nan, None, allowed)


class Rings(Pins):
    """Closed rings of lining in place of the pins, on both faces: the doublet does not split, s = 0."""

    def __init__(self, run, thickness, stiffness, **settings):
        super().__init__(run, thickness, stiffness / 360, **{
            "Scene": "mesh", "Mesh/Curved bodies": "all", "Mesh/Rotor": "rotor", **settings})
        for name, pads in (("disc", ()), ("rings", ("upper", "lower"))):
            mesh = mesh_files.Mesh()
            for body in ("rotor", *pads):
                low, high = {"rotor": (-0.5, 0.5), "upper": (0.5, 0.5 + 1e-3 / thickness),
                             "lower": (-0.5 - 1e-3 / thickness, -0.5)}[body]
                radii = mesh_files.equal(0.05, 0.15, 3) if body == "rotor" else [self.radius - 5e-4, self.radius + 5e-4]
                mesh.sector(body, radii, mesh_files.equal(0, 2 * math.pi, 24), [low * thickness, high * thickness], ring=True)
            (run.directory / f"{name}.msh").write_text(mesh_files.msh2(mesh))

    def modes(self, **settings):
        alone = settings.pop("Pads__Arrangement", "") == "none"
        file = {"Mesh/File": "rings.msh", "Mesh/Pads": "upper, lower", "Mesh/Clamped": "rotor.inner, upper.high, lower.low",
                "Mesh/Contact pairs": "upper.low : rotor.high, lower.high : rotor.low",
                "Mesh/Pressure on": "upper.high, lower.low"}
        if alone:
            file = {"Mesh/File": "disc.msh", "Mesh/Pads": "", "Mesh/Clamped": "rotor.inner", "Mesh/Contact pairs": "",
                    "Mesh/Pressure on": ""}
        return super().modes(**settings, **{key.replace("/", "__").replace(" ", "_"): value for key, value in file.items()})


@problem("Full rings of lining on a thin disc",
         "the doublet with s = 0: l = +- j n Omega +- j sqrt(w^2 + k -+ j nu), a wave grows at any friction", is_long=True)
def full_rings(run):
    """n = 3, mu = 0.4, r = 0.115 m, the rings 1 mm wide. What the plate leaves out falls with the thickness; stiffness and speed
    are as they may."""
    for thickness, stiffness, speed, allowed in ((0.012, 4e11, 0.5, 2e-2), (0.006, 5e10, 0.5, 3e-3), (0.003, 6e9, 0.5, 1e-3),
                                                 (0.006, 2e11, 0.5, 3e-3), (0.006, 5e10, 0, 3e-3), (0.006, 5e10, 20, 3e-3)):
        rings = Rings(run, thickness, stiffness).measure()
        rings.s = 0  # but for rounding
        roots = [l for l in rings.roots(speed) if l.imag > 0]
        expected = max(roots, key=lambda l: l.real)
        row = min((row for row in rings.modes(Operation__Angular_velocity=speed) if row["growth_rate_1_per_s"] > 0),
                  key=lambda row: abs(2 * math.pi * row["frequency_hz"] - expected.imag))
        case = f"h = {1000 * thickness:.0f} mm, k/w^2 = {rings.stiffness / rings.omega**2:.1e}, Omega = {speed:g} rad/s"
        yield Row(f"growth rate, {case}, 1/s", expected.real, row["growth_rate_1_per_s"], None, allowed)
        yield Row(f"its frequency, {case}, Hz", expected.imag / (2 * math.pi), row["frequency_hz"], None,
                  1e-6 * max(1, speed))


@problem("Pins pressed onto a disc: exact contact kinematics (Turning contact)",
         "the doublet; a force N on each face follows the pin's place on the deformed disc: stiffness 2 N h R'^2 of the wave "
         "with its crest at the pins, 2 N h (n R/r)^2 of the other, and 2 mu N n R^2/r, by which its slope acts on the first",
         is_long=True)
def preload(run):
    """n = 3, at rest; R, R' and the modal mass m are those of Kirchhoff's plate. Half of both stiffnesses is the turning of the
    force with the surface, half the way of the point of contact along it. Soft pins, k/w^2 = 3e-4, so that the modes stay the
    plate's; what the plate leaves out falls with the thickness. Given is what N adds to the square of the frequency, over
    N/m."""
    n, radius = Pins.n, Pins.radius
    thin_plate = plate_frequencies(n, 220)[0]  # 1 mm
    area = (0.1155**2 - 0.1145**2) / 2 * math.radians(1)
    for thickness, stiffness, force, allowed in ((0.012, 4e10, 100, 2e-2), (0.006, 5e9, 10, 5e-3), (0.003, 6e8, 1, 1.5e-3)):
        pins = Pins(run, thickness, stiffness, **{"Operation/Angular velocity": 0}).measure()
        ratio, slope = plate_shape(n, thin_plate * thickness / 1e-3, radius, thickness)
        along, across = 2 * force * thickness * slope**2 * ratio, 2 * force * thickness * (n / radius)**2 * ratio
        high, low = (pins.omega**2 + pins.stiffness * (1 + sign * pins.s) for sign in (1, -1))

        def lower_square(mu, along=0., across=0., coupling=0.):
            nu = pins.coupling(mu)
            a, b = high + along, low + across
            product = (nu * (1 - pins.s) + coupling) * -nu * (1 + pins.s)
            return (a + b) / 2 - math.sqrt((a - b)**2 / 4 + product)

        def computed(mu):
            pressed = {"Pads__Pressure": force / area, "Prestress__Turning_contact": "true"}
            squares = [(2 * math.pi * pins.modes(Contact__Friction__Coefficient=mu, **settings)[-2]["frequency_hz"])**2
                       for settings in (pressed, {})]
            return squares[0] - squares[1]

        for mu in (0, pins.friction):
            expected = lower_square(mu, along, across, 2 * mu * force * n / radius * ratio) - lower_square(mu)
            yield Row(f"h = {1000 * thickness:.0f} mm, mu = {mu:g}, 1/m", expected / (force * ratio),
                      computed(mu) / (force * ratio), None, allowed)


@problem("Spinning disc, 1 mm thick: stress of its own centrifugal load (Stress stiffness)",
         "Rayleigh's quotient of the plane stress over Kirchhoff's modes")
def spinning(run):
    """What the stress adds to the square of the frequency, over Omega^2, of a doublet the mean of both waves; Omega = 2 rad/s,
    where its own square does not matter yet."""
    speed = 2.
    settings = {"Eigenproblem/Tolerance": 1e-12, "Eigenproblem/Error bars": "false", "Stage": "transport",
                "Operation/Angular velocity": speed, "Discretization/Degree": 3}
    plates = [plate_frequencies(n, 220)[0] for n in range(5)]
    squares = []
    for on in ("false", "true"):
        rows = run("plate.prm", {**settings, "Prestress/Centrifugal load": on, "Prestress/Stress stiffness": on})
        squares.append([])
        for n, plate in enumerate(plates):
            distance = lambda f: min(abs(f - plate - sign * n * speed / (2 * math.pi)) for sign in (-1, 1))
            waves = sorted((row["frequency_hz"] for row in rows), key=distance)[:2 if n else 1]
            squares[-1].append((2 * math.pi * sum(waves) / len(waves))**2)
    for n, (without, stressed) in enumerate(zip(*squares)):
        yield Row(f"n = {n}", spinning_stiffness(n, plates[n]), (stressed - without) / speed**2, None, 3e-3)


@problem("Ansys' technology demonstration td-1", "the mode table of Ansys' public example documentation (tests/lib/td1.py)",
         is_long=True)
def td_1(run):
    """A vented disc with hat and hub between two pads, at rest, no prestress; frequencies in Hz, growth rates in 1/s. The mesh
    is as coarse as the published one, part by part, and tied like it; degree 2. The published frequencies and growth rate are
    those of such a mesh: the last lines are the same brake on finer cells of hat and hub with degree 3, by which the published
    values are up to a tenth too high. Allowed: 2 %, and 15 % of the growth rate; of degree 3 what the bars of degree 2 say."""
    (run.directory / "td1.msh").write_text(mesh_files.msh2(td1.mesh()))
    rows = run("td1.prm")
    for k, (expected, row) in enumerate(zip(td1.FREQUENCIES, rows), start=1):
        yield Row(f"mode {k}", expected, row["frequency_hz"], row["frequency_error_hz"], 2e-2)
    flutter = max(rows, key=lambda row: row["growth_rate_1_per_s"])
    yield Row("growth rate of the flutter mode", td1.GROWTH_RATE, flutter["growth_rate_1_per_s"],
              flutter["growth_rate_error_1_per_s"], 0.15)
    yield Row("frequency of the flutter mode", td1.FLUTTER, flutter["frequency_hz"], flutter["frequency_error_hz"], 2e-2)
    (run.directory / "td1.msh").write_text(mesh_files.msh2(td1.mesh(n_hat=4, n_hub=(6, 2))))
    rows = run("td1.prm", {"Discretization/Degree": 3})
    for k in (1, 2, 13):
        yield Row(f"mode {k}, degree 3", td1.FREQUENCIES[k - 1], rows[k - 1]["frequency_hz"], rows[k - 1]["frequency_error_hz"],
                  0.11)
    flutter = max(rows, key=lambda row: row["growth_rate_1_per_s"])
    yield Row("growth rate of the flutter mode, degree 3", td1.GROWTH_RATE, flutter["growth_rate_1_per_s"],
              flutter["growth_rate_error_1_per_s"], 0.25)
    yield Row("its frequency, degree 3", td1.FLUTTER, flutter["frequency_hz"], flutter["frequency_error_hz"], 0.05)


@problem("A brake model of industrial origin, 4669 unknowns, given by its matrices",
         "Graebner, Mehrmann, Quraishi, Schroeder, von Wagner, ZAMM 96 (2016) 1388, whose matrices are public; eigenvalues by "
         "Newton's method in extended precision")
def devx6(run):
    """The modes that grow, at 4 pi rad/s: the matrices at hand are those of one speed."""
    import devx6 as brake
    rows = run("matrices.prm", {key: value for key, value in brake.settings(run.data("data/devx6")).items() if key != "Scene"})
    for expected in brake.GROWING:
        row = min(rows, key=lambda row: abs(2 * math.pi * row["frequency_hz"] - expected.imag))
        yield Row(f"growth rate at {expected.imag / 2 / math.pi:.0f} Hz, 1/s", expected.real, row["growth_rate_1_per_s"], None,
                  1e-9)
        yield Row("its frequency, Hz", expected.imag / (2 * math.pi), row["frequency_hz"], None, 1e-12)


@problem("Sandwich beam with a viscoelastic core, 840 unknowns, fractional derivatives",
         "the collection NLEVP (Betcke and others, 2013); eigenvalues by inverse iteration in numbers of 113 bits")
def sandwich(run):
    """The first, the middle and the last of ten modes."""
    run.data("data/nlevp")
    import nlevp
    settings = {key: value for key, value in nlevp.sandwich_beam(840).items() if key != "Scene"}
    rows = run("matrices.prm", settings)
    for k in (0, 4, 9):
        expected = 1j * nlevp.SANDWICH_EIGENVALUES[840][k]
        yield Row(f"mode {k + 1}, growth rate, 1/s", expected.real, rows[k]["growth_rate_1_per_s"], None, 1e-9)
        yield Row(f"mode {k + 1}, frequency, Hz", expected.imag / (2 * math.pi), rows[k]["frequency_hz"], None, 1e-9)


@problem("CalculiX: the default brake's rotor, and an assembly", "CalculiX, 20-node hexahedra, computed beside this",
         is_long=True)
def calculix(run):
    """The rotor alone (prm/rotor.prm beside 20 x 144 x 4 cells of reduced integration), and beam, block and plate that are tied,
    hang on springs and carry a mass (tests/benchmark/assembly.py, cells of 10 mm, degree 2 here), modes in Hz at rest. Allowed
    is the mesh error of CalculiX's elements; where nodes match, ties of both programs change nothing."""
    if not shutil.which("ccx"):
        raise Missing("the program ccx is not installed (Debian: calculix-ccx)")
    sys.path.insert(0, str(HERE.parent / "benchmark"))
    import assembly
    from calculix import rotor_frequencies
    expected = sorted(rotor_frequencies((20, 144, 4))[1])
    rows = run("../../prm/rotor.prm", {"Eigenproblem/Maximum frequency": 5600, "Output/Fields": "none"})
    rows.sort(key=lambda row: row["frequency_hz"])
    for k in (0, 4, 9, 14, 19):
        yield Row(f"rotor, mode {k + 1}", expected[k], rows[k]["frequency_hz"], rows[k]["frequency_error_hz"], 1e-3)
    _, expected = assembly.calculix_frequencies(0.01, run.directory)
    _, found = assembly.squeal_frequencies(run.st.SQUEAL, 0.01, run.directory)
    for k in (0, 4, 9, 14, 19):
        yield Row(f"assembly, mode {k + 1}", expected[k], found[k], None, 3e-3)


def processor_seconds():
    import squeal_testing as st  # reads SQUEAL
    return st.processor_seconds()


def line(*cells):
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |\n"


def tables(names, run_of, tell):
    """The table of each problem as markdown, and the names of what fails."""
    text, failed = "", []
    for name in names:
        title, source, function = PROBLEMS[name]
        run, start = run_of(), processor_seconds()
        try:
            rows = list(function(run))
        except RuntimeError as error:
            failed.append(f"{name}: {error}")
            continue
        except Missing as error:
            tell(f"{name}: skipped, {error}\n\n")
            continue
        finally:
            shutil.rmtree(run.directory, ignore_errors=True)
        part = f"## {title}\n\nSource: {source}. {' '.join(function.__doc__.split())}\n\n"
        part += line("quantity", "expected", "computed", "bar", "difference", "allowed") + line(*["---"] * 6)
        for row in rows:
            difference = row.computed / row.expected - 1
            bad = not abs(difference) <= row.allowed
            failed += [f"{name}: {row.quantity}"] if bad else []
            part += line(row.quantity, f"{row.expected:.7g}", f"{row.computed:.7g}", f"{row.bar:.1e}" if row.bar else "",
                         f"{difference:+.1e}" + (" **fails**" if bad else ""), f"{row.allowed:g}")
        tell(part + f"\n{processor_seconds() - start:.0f} processor seconds\n\n")
        text += part + "\n"
    return text, failed


def numbers(text):
    """Of each line of the tables: quantity, expected and computed."""
    cells = re.findall(r"^\| (.*?) \| (-?\d[-\d.e+]*) \| (-?\d[-\d.e+]*) \|", text, re.M)
    return [(quantity, float(expected), float(computed)) for quantity, expected, computed in cells]


def differs_from_document(text, names):
    """What doc/validation.md has otherwise of these problems: other lines, or numbers beyond what another machine's rounding
    does."""
    sections = dict(part.split("\n", 1) for part in DOCUMENT.read_text().split("\n## ")[1:])
    here = numbers(text)
    there = [row for name in names if f"## {PROBLEMS[name][0]}\n" in text
             for row in numbers(sections.get(PROBLEMS[name][0], ""))]
    if [row[0] for row in here] != [row[0] for row in there]:
        return ["doc/validation.md has other quantities: validation.py --write"]
    return [f"doc/validation.md, {a[0]}: {b[k]:g} instead of {a[k]:g}" for a, b in zip(here, there) for k in (1, 2)
            if abs(a[k] - b[k]) > 3e-4 * abs(a[k])]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, help="default: $SQUEAL, else build/release/squeal")
    parser.add_argument("--write", action="store_true", help="make doc/validation.md")
    parser.add_argument("--quick", action="store_true", help="not " + ", ".join(sorted(LONG)))
    parser.add_argument("problem", nargs="*", help="default: all: " + ", ".join(PROBLEMS))
    arguments = parser.parse_args()
    unknown = [name for name in arguments.problem if name not in PROBLEMS]
    if unknown or (arguments.write and (arguments.problem or arguments.quick)):
        parser.error(f"--write is of all problems; there are {', '.join(PROBLEMS)}")
    if arguments.program:
        os.environ["SQUEAL"] = str(arguments.program.resolve())
    import squeal_testing as st  # reads SQUEAL
    if not st.SQUEAL.exists():
        parser.error(f"there is no program {st.SQUEAL}")
    names = arguments.problem or [name for name in PROBLEMS if not (arguments.quick and name in LONG)]
    text, failed = tables(names, lambda: Runner(st), lambda part: print(part, end="", flush=True))
    if arguments.write:
        DOCUMENT.write_text(INTRODUCTION + text.rstrip() + "\n")
    else:
        failed += differs_from_document(text, names)
    print("\n".join(["fails:", *failed]) if failed else "All numbers are as expected.")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
