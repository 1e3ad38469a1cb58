"""Loss factors, Prony series, fractional Zener elements, viscosities and measured ratios: small problems with known solutions,
the published sandwich beam, brakes, and what is refused."""

import cmath
import math
import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import error_statistics as es  # noqa: E402
import mesh_files  # noqa: E402
import nlevp  # noqa: E402
import squeal_testing as st  # noqa: E402
import test_matrix_export as matrix_export  # noqa: E402
from test_brake_reference import MESH  # noqa: E402


LOSSY_PADS = {"Pads/Material/Loss factor": 0.166428, "Pads/Material/Young modulus": 43875900000.0, "Pads/Pressure": 950890.0,
              "Pads/Material/Density": 2216.74, "Pads/Material/Poisson ratio": 0.275, "Rotor/Material/Young modulus": 1.16858e11,
              "Operation/Angular velocity": 4.51675, "Contact/Steady pressure": "uniform", "Contact/Friction/Law": "falling",
              "Contact/Friction/Coefficient": 0.0561, "Contact/Friction/Coefficient at speed": 0.02805,
              "Contact/Friction/Decay speed": 3.49324}


def diagonal(*values):
    entries = [f"{i} {i} {value!r}\n" for i, value in enumerate(values, 1)]
    return f"%%MatrixMarket matrix coordinate real general\n{len(values)} {len(values)} {len(values)}\n" + "".join(entries)


def newton(function, slope, l):
    """The root near l."""
    for _ in range(50):
        l -= function(l) / slope(l)
    return l


class Oscillators(st.TestCase):
    """Masses on springs: m l^2 + k + c f(l) = 0 each by itself."""

    MASSES, STIFF, SOFT = (1.0, 2.0, 0.5), (3.0, 1.0, 2.0), (5.0, 6.0, 1.5)

    def case(self, **law):
        for name, values in [("mass", self.MASSES), ("stiffness", self.STIFF), ("soft", self.SOFT)]:
            self.write(name + ".mtx", diagonal(*values))
        return {"Scene": "matrices", "Matrices/Mass": "mass.mtx", "Matrices/Stiffness": "stiffness.mtx",
                "Matrices/Viscoelastic 1/Stiffness": "soft.mtx", "Eigenproblem/Maximum frequency": 1,
                **{f"Matrices/Viscoelastic 1/{key}".replace("_", " "): value for key, value in law.items()}}

    def check(self, f, slope, **law):
        expected = [newton(lambda l: m * l * l + k + c * f(l), lambda l: 2 * m * l + c * slope(l),
                           1j * cmath.sqrt((k + c * f(1j * math.sqrt((k + c) / m))) / m))
                    for m, k, c in zip(self.MASSES, self.STIFF, self.SOFT)]
        case = self.case(**law)
        for solver in ["block_krylov", "dense"]:
            self.assertSameModes(self.eigenvalues({**case, "Eigenproblem/Solver": solver}), expected, 1e-11)
        self.assertSameModes(self.eigenvalues(case, ranks=2), expected, 1e-11)
        for l in expected:
            self.assertLess(l.real, -1e-3)

    def test_loss_factor(self):
        self.check(lambda l: 1 + 0.3j, lambda l: 0, Loss_factor=0.3)

    def test_prony(self):
        # m l^2 (1 + l tau) + (k + c)(1 + l tau) + c g l tau = 0: a cubic.
        g, tau = 0.7, 0.4
        self.check(lambda l: 1 + g * l * tau / (1 + l * tau), lambda l: g * tau / (1 + l * tau) ** 2,
                   Prony_series=f"{g} : {tau}")

    def test_zener(self):
        c, tau, a = 12, 0.05, 0.6

        def slope(l):
            z = (l * tau) ** a
            return (c - 1) * a * z / (l * (1 + z) ** 2)

        self.check(lambda l: (1 + c * (l * tau) ** a) / (1 + (l * tau) ** a), slope,
                   Fractional_Zener=f"{c} : {tau} : {a}")

    def test_all_together(self):
        self.check(lambda l: 1 + 0.1j + 0.5 * l / (1 + l) + 0.2 * 0.3 * l / (1 + 0.3 * l),
                   lambda l: 0.5 / (1 + l) ** 2 + 0.2 * 0.3 / (1 + 0.3 * l) ** 2,
                   Loss_factor=0.1, Prony_series="0.5 : 1, 0.2 : 0.3")

    def test_causes(self):
        """The growth rate is the sum of its causes, and the Rayleigh equation holds with f(l)."""
        results = self.analyse(self.case(Loss_factor=0.3, Prony_series="0.7 : 0.4"))
        modes = st.read_table(results / "modes.csv")
        contributions = st.read_table(results / "contributions.csv")
        for mode in modes:
            causes = [row for row in contributions if row["mode"] == mode["mode"]]
            self.assertAlmostEqual(sum(row["growth_rate_1_per_s"] for row in causes), mode["growth_rate_1_per_s"],
                                   delta=1e-9)
            damping = sum(row["growth_rate_1_per_s"] for row in causes if row["origin"] == "material damping")
            self.assertAlmostEqual(damping, mode["growth_rate_1_per_s"], delta=1e-9)


class Overdamped(st.TestCase):
    """Two masses, one of them on a strong dashpot: its eigenvalues are real, and no modes. Modes that come near the real axis,
    and eigenvalues that are real and grow."""

    STIFFNESS, RELAXED = ((100, -20), (-20, 400)), ((0, 0), (0, 0))

    def matrices(self, damping, stiffness=STIFFNESS, relaxed=RELAXED):
        for name, ((a, b), (c, d)) in {"m": ((1, 0), (0, 1)), "c": damping, "k": stiffness, "z": relaxed}.items():
            self.write(name + ".mtx", "%%MatrixMarket matrix coordinate real general\n2 2 4\n"
                       f"1 1 {a}\n1 2 {b}\n2 1 {c}\n2 2 {d}\n")
        self.terms = damping, stiffness, relaxed
        return {"Scene": "matrices", "Matrices/Mass": "m.mtx", "Matrices/Velocity": "c.mtx", "Matrices/Stiffness": "z.mtx",
                "Matrices/Viscoelastic 1/Stiffness": "k.mtx", "Eigenproblem/Maximum frequency": 20}

    def root(self, f, near):
        """A root of det(l^2 + l C + Z + f(l) K) by the secant method."""
        def determinant(l):
            a = [[(i == j) * l * l + l * c + z + f(l) * k for j, (c, z, k) in enumerate(zip(*rows))]
                 for i, rows in enumerate(zip(self.terms[0], self.terms[2], self.terms[1]))]
            return a[0][0] * a[1][1] - a[0][1] * a[1][0]

        before, l = near, near * (1 + 1e-4)
        for _ in range(50):
            rise = determinant(l) - determinant(before)
            if rise == 0:
                break
            before, l = l, l - determinant(l) * (l - before) / rise
        return l

    def test_dashpot(self):
        case = self.matrices(((1, 0), (0, 100)))
        section = "Matrices/Viscoelastic 1/"
        z = (lambda l: (l * 0.02) ** 0.6)
        for law, f in [({"Loss factor": 0.05}, lambda l: 1 + 0.05j), ({"Loss factor": 1e-9}, lambda l: 1 + 1e-9j),
                       ({"Prony series": "0.3 : 0.05"}, lambda l: 1 + 0.3 * l * 0.05 / (1 + l * 0.05)),
                       ({"Fractional Zener": "1.5 : 0.02 : 0.6"}, lambda l: (1 + 1.5 * z(l)) / (1 + z(l)))]:
            settings = {**case, **{section + key: value for key, value in law.items()}}
            with self.subTest(law):
                self.assertSameModes(self.eigenvalues(settings), [self.root(f, -0.5 + 10j)], 1e-10)
        self.assertAlmostEqual(self.root(lambda l: 1 + 0.05j, -0.5 + 10j), -0.768922963184 + 2j * math.pi * 1.58915824335,
                               delta=1e-10)

    def test_becomes_overdamped(self):
        """Critical damping is 2 sqrt(k): the frozen stiffness is the glassy one, the exact one of slow motions half of that."""
        case = self.matrices(((1, 0), (0, 48)), stiffness=((100, 0), (0, 400)))
        results = self.analyse({**case, "Matrices/Viscoelastic 1/Prony series": "1 : 0.01"})
        self.assertSameModes([st.eigenvalue(row) for row in st.read_table(results / "modes.csv")],
                             [self.root(lambda l: 1 + l * 0.01 / (1 + l * 0.01), -1 + 10j)], 1e-10)
        self.assertIn("1 of them could be followed until nearly overdamped only", (results / "log.txt").read_text())

    def test_divergence(self):
        """There is no hysteresis on the real axis; relaxation is there."""
        case = self.matrices(((1, 0), (0, 1)), relaxed=((-500, 0), (0, 0)))
        for law, f in [({"Loss factor": 0.05}, (lambda l: 1, lambda l: 1 + 0.05j)),
                       ({"Prony series": "0.3 : 0.05"}, 2 * (lambda l: 1 + 0.3 * l * 0.05 / (1 + l * 0.05),))]:
            for solver in "block_krylov", "dense":
                results = self.analyse({**case, "Eigenproblem/Solver": solver,
                                        **{"Matrices/Viscoelastic 1/" + key: value for key, value in law.items()}})
                table = st.read_table(results / "modes.csv")
                self.assertSameModes([st.eigenvalue(row) for row in table],
                                     [self.root(f[0], 19.5), self.root(f[1], -0.6 + 20j)], 1e-10)
                self.assertEqual([row["verdict"] for row in table], ["divergence", "stable"])


@unittest.skipUnless((st.SHARED / "data/nlevp").exists(), "the matrices are not there")
class Sandwich(st.TestCase):
    def compare(self, n, **options):
        modes = self.modes(nlevp.sandwich_beam(n), **options)
        self.assertSameModes([st.eigenvalue(mode) for mode in modes], [1j * w for w in nlevp.SANDWICH_EIGENVALUES[n]], 1e-9)
        for mode in modes:
            self.assertLessEqual(mode["backward_error"], 1e-12)

    def test_168(self):
        """The search spaces become nearly all there is: what is new in them is up to rounding, that is, to the kernels."""
        for kernels in ["Prescott", "Haswell", "SkylakeX"]:
            with self.subTest(kernels):
                self.compare(168, environment={**st.ENVIRONMENT, "OPENBLAS_CORETYPE": kernels})

    def test_840(self):
        self.compare(840)

    def test_840_on_ranks(self):
        expected = [1j * w for w in nlevp.SANDWICH_EIGENVALUES[840]]
        self.assertSameModes(self.eigenvalues(nlevp.sandwich_beam(840), ranks=3), expected, 1e-9)


def errors(computed, expected):
    """The largest relative error of a frequency, and of a growth rate relative to the largest one."""
    pairs = st.TestCase().pairs(computed, expected)
    return (max(abs(a.imag - b.imag) / b.imag for a, b in pairs),
            max(abs(a.real - b.real) for a, b in pairs) / max(abs(b.real) for b in expected))


class Tables(st.TestCase):
    """Loss factors (T10) and Prony series of the pads (T11) against the independent method, with error bars."""

    def compare(self, name):
        table, settings = es.TABLES[name]
        modes = self.modes({**st.REFERENCE_BRAKE, **MESH, **st.PENALTY, **settings}, timeout=900)
        frequency, growth = errors([st.eigenvalue(mode) for mode in modes], st.reference_eigenvalues(table))
        self.assertLess(frequency, 3e-4)
        self.assertLess(growth, 0.02)
        self.assertTrue(all(mode["backward_error"] <= 1e-9 for mode in modes))
        # As for the quadratic problems of test_error_bars.py.
        comparisons = es.compare(name, modes)
        print(es.table(comparisons), flush=True)
        statistics = es.statistics(comparisons)
        for quantity in ["frequency", "growth"]:
            self.assertGreaterEqual(statistics.covered[quantity], 0.95 * statistics.modes, quantity)
        self.assertGreaterEqual(statistics.improved, 0.9 * statistics.modes)
        self.assertEqual(statistics.contradicted, 0)

    def test_loss_factors(self):
        self.compare("T10")

    def test_prony(self):
        self.compare("T11")


class BrakeCase(st.TestCase):
    BRAKE = {**st.REFERENCE_BRAKE, **st.PENALTY, **st.TINY_BRAKE, "Rotor/Material/Stiffness proportional damping": 0,
             "Pads/Material/Stiffness proportional damping": 0}
    PADS, ROTOR = "Pads/Material/", "Rotor/Material/"

    def check_sensitivities(self, case, steps, tolerance):
        """Against central differences of two runs: steps has for each name in sensitivities.csv what to set for a relative
        change of it."""
        results = self.analyse({**case, "Output/Sensitivities": "true"})
        plain = [st.eigenvalue(mode) for mode in st.read_table(results / "modes.csv")]
        rows = st.read_table(results / "sensitivities.csv")
        h = 1e-3
        for name, settings in steps.items():
            derivatives = [complex(row["relative_d_growth_rate_1_per_s"], 2 * math.pi * row["relative_d_frequency_hz"])
                           for row in rows if row["parameter"] == name]
            self.assertEqual(len(derivatives), len(plain), name)
            plus, minus = ([l for l, _ in self.pairs(self.eigenvalues({**case, **settings(1 + sign * h)}), plain)]
                           for sign in (1, -1))
            for l, derivative, a, b in zip(plain, derivatives, plus, minus):
                self.assertLess(abs((a - b) / (2 * h) - derivative), tolerance * abs(derivative) + 1e-6 * abs(l),
                                f"{name}, eigenvalue {l}")


    def check_sweep(self, case, parameter, values):
        """Each value of a sweep is a single run's; returns critical values."""
        results = self.analyse({**case, "Sweep/Parameter": parameter, "Sweep/Values": ", ".join(map(str, values)),
                                "Sweep/Critical values": "true"})
        rows = st.read_table(results / "sweep.csv")
        for value in values:
            self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == value],
                                 self.eigenvalues({**case, parameter: value}), 1e-9)
        return st.read_table(results / "critical.csv")


class Brake(BrakeCase):
    def test_small_loss_factor(self):
        """To first order the loss factor eta of the pads moves l by -i eta z^H K x / z^H Q'(l) x, as beta = eta / w does by
        -beta l z^H K x / ..., with w = |Im l| of each mode and little growth; the remainder falls like eta^2."""
        without = {l: l for l in self.eigenvalues(self.BRAKE)}
        plain = list(without)

        def changes(settings):
            return [l - before for l, before in self.pairs(self.eigenvalues({**self.BRAKE, **settings}), plain)]

        beta = 1e-9
        first_order = [(change / beta) / before * 1j for change, before in
                       zip(changes({self.PADS + "Stiffness proportional damping": beta}), plain)]
        remainders = []
        for eta in [4e-4, 2e-4]:
            remainders.append([abs(change / eta - one) for change, one in
                               zip(changes({self.PADS + "Loss factor": eta}), first_order)])
        for before, one, larger, smaller in zip(plain, first_order, *remainders):
            # change / eta is right to the first order in eta, and beta's own second order.
            self.assertLess(larger, 2e-2 * abs(before))
            self.assertLess(smaller, 0.6 * larger + 1e-4 * abs(before), f"mode {before}")

    def test_ways_to_solve(self):
        """Halves, the whole, solvers and ranks agree, and causes sum up to the growth rate."""
        case = {**self.BRAKE, self.ROTOR + "Loss factor": 0.004, self.PADS + "Loss factor": 0.06,
                self.PADS + "Prony series": "0.2 : 3e-4, 0.3 : 4e-5", self.PADS + "Fractional Zener": "1.5 : 1e-5 : 0.7"}
        results = self.analyse(case)
        modes = st.read_table(results / "modes.csv")
        eigenvalues = [st.eigenvalue(mode) for mode in modes]
        self.assertGreaterEqual(len(modes), 15)
        self.assertTrue(all(mode["backward_error"] <= 1e-9 for mode in modes))
        for settings, ranks in [({"Eigenproblem/Mirror symmetry": "false"}, 1), ({"Eigenproblem/Solver": "dense"}, 1),
                                ({}, 2), ({"Contact/Steady pressure": "uniform"}, 4)]:
            self.assertSameModes(self.eigenvalues({**case, **settings}, ranks=ranks), eigenvalues, 1e-8)
        contributions = st.read_table(results / "contributions.csv")
        for mode in modes:
            total = sum(row["growth_rate_1_per_s"] for row in contributions if row["mode"] == mode["mode"])
            self.assertAlmostEqual(total, mode["growth_rate_1_per_s"], delta=1e-6 * 2 * math.pi * mode["frequency_hz"])
            self.assertGreater(mode["growth_rate_error_1_per_s"], 0)

    def test_small_tolerances(self):
        """Spaces of right and of left vectors that have nothing to do with each other are begun anew."""
        lining = {"Pads/Material/Fractional Zener": "1.6 : 5e-05 : 0.6", "Eigenproblem/Error bars": "false"}
        for settings in ({**st.TINY_BRAKE, **lining, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Tolerance": 1e-11},
                         {**st.DENSE_BRAKE, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Solver": "dense",
                          **LOSSY_PADS},
                         # In these, pairs are also lost in a space that has begun anew.
                         {**st.DENSE_BRAKE, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Solver": "dense",
                          "Eigenproblem/Mirror symmetry": "false", "Eigenproblem/Tolerance": 1e-10,
                          "Contact/Friction/Coefficient": 0.2932, "Operation/Angular velocity": 17.9316,
                          "Pads/Pressure": 1000690, "Pads/Material/Young modulus": 9416070000, "Pads/Material/Density": 1658.21,
                          "Pads/Material/Poisson ratio": 0.382, "Rotor/Material/Young modulus": 125037000000,
                          "Pads/Material/Prony series": "0.8405:6.12087e-05, 0.0570:1.03379e-05"},
                         {**st.DENSE_BRAKE, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Tolerance": 1e-10,
                          "Contact/Friction/Coefficient": 0.5961, "Operation/Angular velocity": 15.0038,
                          "Pads/Pressure": 418619, "Contact/Steady pressure": "uniform",
                          "Pads/Material/Young modulus": 11900300000, "Pads/Material/Density": 11404.7,
                          "Pads/Material/Poisson ratio": 0.099, "Rotor/Material/Young modulus": 35710500000,
                          "Rotor/Material/Mass proportional damping": 5.16105,
                          "Rotor/Material/Stiffness proportional damping": 2.90285e-06,
                          "Rotor/Material/Prony series": "0.6636:0.000170628, 0.1732:7.82378e-05",
                          "Pads/Material/Mass proportional damping": 9.99708,
                          "Pads/Material/Stiffness proportional damping": 3.98964e-07}):
            table = st.read_table(self.analyse(settings) / "modes.csv")
            self.assertTrue(table)
            for row in table:
                self.assertLessEqual(row["backward_error"], settings["Eigenproblem/Tolerance"])

    def test_sensitivities(self):
        pads = self.PADS
        case = {**self.BRAKE, pads + "Loss factor": 0.06, pads + "Prony series": "0.2 : 3e-4, 0.3 : 4e-5",
                pads + "Fractional Zener": "1.5 : 1e-5 : 0.7", "Eigenproblem/Maximum frequency": 4000,
                "Eigenproblem/Error bars": "false"}
        self.check_sensitivities(case, {
            pads + "Loss factor": lambda f: {pads + "Loss factor": 0.06 * f},
            pads + "Prony series/g 1": lambda f: {pads + "Prony series": f"{0.2 * f!r} : 3e-4, 0.3 : 4e-5"},
            pads + "Prony series/tau 2": lambda f: {pads + "Prony series": f"0.2 : 3e-4, 0.3 : {4e-5 * f!r}"},
            pads + "Fractional Zener/c": lambda f: {pads + "Fractional Zener": f"{1.5 * f!r} : 1e-5 : 0.7"},
            pads + "Fractional Zener/tau": lambda f: {pads + "Fractional Zener": f"1.5 : {1e-5 * f!r} : 0.7"},
            pads + "Fractional Zener/a": lambda f: {pads + "Fractional Zener": f"1.5 : 1e-5 : {0.7 * f!r}"},
            pads + "Young modulus": lambda f: {pads + "Young modulus": 1e10 * f},
            "Contact/Friction/Coefficient": lambda f: {"Contact/Friction/Coefficient": 0.4 * f}}, 1e-4)

    def test_mortar(self):
        """Multipliers are no part of the spaces in which modes are found."""
        case = {**self.BRAKE, **st.MORTAR, self.PADS + "Loss factor": 0.06}
        self.assertSameModes(self.eigenvalues({**case, "Eigenproblem/Solver": "dense"}), self.eigenvalues(case), 1e-8)

    def test_sweep(self):
        """Over friction: a growth rate changes its sign at the onset. Over the loss factor, from none: without it values are
        projected, with it they are not."""
        case = {**st.TINY_BRAKE, "Stage": "full", "Discretization/Rotor cells": "2, 12, 1",
                "Discretization/Clamp layers": 1, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Error bars": "false",
                "Rotor/Material/Stiffness proportional damping": 0, "Pads/Material/Stiffness proportional damping": 0,
                self.PADS + "Loss factor": 0.0005, self.PADS + "Prony series": "0.001 : 3e-5"}
        friction = "Contact/Friction/Coefficient"
        onsets = [row for row in self.check_sweep(case, friction, [0.1, 0.5, 0.9]) if row["kind"] in ("onset", "end")]
        self.assertTrue(onsets)
        for row in onsets:
            at = min(self.eigenvalues({**case, friction: row["value"]}),
                     key=lambda l: abs(l - complex(0, 2 * math.pi * row["frequency_hz"])))
            self.assertLess(abs(at.real), 1e-8 * abs(at))
        self.check_sweep({**case, self.PADS + "Prony series": ""}, self.PADS + "Loss factor", [0.0, 1e-4, 0.01])

    def test_map(self):
        case = {**self.BRAKE, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Error bars": "false"}
        first, second = "Contact/Friction/Coefficient", self.PADS + "Loss factor"
        results = self.analyse({**case, "Sweep/Parameter": first, "Sweep/Values": "0.2, 0.6",
                                "Sweep/Second parameter": second, "Sweep/Second values": "0, 0.01"})
        rows = st.read_table(results / "map.csv")
        self.assertEqual(len(rows), 4)
        for row in rows:
            growth = max(l.real for l in self.eigenvalues({**case, first: row[first], second: row[second]}))
            self.assertAlmostEqual(growth, row["growth_rate_1_per_s"], delta=1e-4)

    def test_how_far_from_modal(self):
        """Rayleigh damping of one material is modal, that of one of two is not."""
        def share(settings):
            log = (self.analyse({**self.BRAKE, "Eigenproblem/Error bars": "false", **settings}) / "log.txt").read_text()
            found = re.search(r"Damping couples modes: (\S+) % of it is not modal", log)
            return float(found[1]) if found else None

        alone = {"Pads/Arrangement": "none", "Operation/Angular velocity": 0}
        self.assertIsNone(share(alone))
        self.assertLess(share({**alone, self.ROTOR + "Stiffness proportional damping": 1e-7,
                               self.ROTOR + "Mass proportional damping": 3}), 1e-3)
        self.assertLess(share({**alone, self.ROTOR + "Loss factor": 0.01}), 1e-3)
        self.assertGreater(share({self.PADS + "Stiffness proportional damping": 1e-6}), 1)

    def test_other_stages(self):
        """Damping is of the stage full."""
        case = {**self.BRAKE, "Stage": "friction_damping"}
        self.assertSameModes(self.eigenvalues({**case, self.PADS + "Loss factor": 0.06}), self.eigenvalues(case), 1e-12)


def modulus(frequency, relaxed, g, tau, eta):
    """Storage modulus and loss factor of a Prony element and hysteresis."""
    value = relaxed * (1 + 1j * eta + g * (2j * math.pi * frequency * tau) / (1 + 2j * math.pi * frequency * tau))
    return value.real, value.imag / value.real


class ModulusTable(st.TestCase):
    """A table of moduli over frequency and temperature gives the modes of the law that it was made of."""

    LAW = {"relaxed": 1e10, "tau": 4e-5}
    CASE = {**BrakeCase.BRAKE, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Error bars": "false",
            "Pads/Material/Young modulus": 1e10}
    TABLE = "Pads/Material/Modulus table"

    def write_table(self, temperatures, frequencies=tuple(10 * 1.5**k for k in range(16)), name="table.csv"):
        """temperatures: of each one g and eta."""
        lines = ["frequency_hz,temperature_c,storage_modulus_pa,loss_factor"]
        for temperature, (g, eta) in temperatures.items():
            lines += [f"{f!r},{temperature},{storage!r},{loss!r}" for f in frequencies
                      for storage, loss in [modulus(f, g=g, eta=eta, **self.LAW)]]
        self.write(name, "\n".join(lines) + "\n")
        return {self.TABLE: name}

    def of_law(self, g, eta):
        return self.eigenvalues({**self.CASE, "Pads/Material/Loss factor": eta, "Pads/Material/Prony series": f"{g} : 4e-5"})

    def test_same_modes(self):
        table = self.write_table({20: (0.3, 0.02)})
        results = self.analyse({**self.CASE, **table})
        found = re.search(r"Prony elements .* fit it within (\S+) %, at 20 degrees", (results / "log.txt").read_text())
        error = float(found[1]) / 100
        self.assertLess(error, 0.02)
        expected = self.of_law(0.3, 0.02)
        elastic = self.eigenvalues(self.CASE)
        computed = [st.eigenvalue(row) for row in st.read_table(results / "modes.csv")]
        self.assertEqual(len(computed), len(expected))
        moved = 0
        for a, b, c in zip(computed, expected, elastic):
            # A modulus that is off by the fit's error moves l by at most half of that.
            self.assertLess(abs(a - b), error / 2 * abs(b))
            moved = max(moved, abs(b - c) / abs(b))
        self.assertGreater(moved, 5 * error)
        self.assertTrue(all(row["backward_error"] <= 1e-9 for row in st.read_table(results / "modes.csv")))

    def test_temperature(self):
        """Between two temperatures, and a sweep over it."""
        table = self.write_table({20: (0.3, 0.02), 100: (0.0, 0.06)})
        at = {t: self.eigenvalues({**self.CASE, **table, "Operation/Temperature": t}) for t in (20, 60, 100)}
        self.assertGreater(max(abs(cold - hot) / abs(hot) for cold, hot in zip(at[20], at[100])), 0.005)
        for between, cold, hot in zip(at[60], at[20], at[100]):
            self.assertLess(abs(between - (cold + hot) / 2), 0.2 * abs(cold - hot) + 1e-4 * abs(hot))
        results = self.analyse({**self.CASE, **table, "Sweep/Parameter": "Operation/Temperature", "Sweep/Values": "20, 60, 100"})
        for t in at:
            rows = [st.eigenvalue(row) for row in st.read_table(results / "sweep.csv") if row["parameter"] == t]
            self.assertSameModes(rows, at[t], 1e-9)

    def test_refused(self):
        def refused(settings, *words):
            self.assertSettingsRefused({**self.CASE, **settings}, *words)

        table = self.write_table({20: (0.3, 0.02), 100: (0.0, 0.06)})
        refused({**table, "Operation/Temperature": 101}, "Modulus table", "20 to 100")
        refused({**table, "Eigenproblem/Maximum frequency": 5000}, "does not cover the window", "4378.9")
        refused(self.write_table({20: (0.3, 0.02)}, frequencies=(500, 1000, 5000)), "does not cover the window")
        refused({**table, "Pads/Material/Young modulus": 1.2e10}, "line 2", "relaxed modulus")
        refused({**table, "Pads/Material/Prony series": "0.1 : 1e-3"}, "in place of")
        refused({self.TABLE: "no.csv"}, "no.csv", "cannot be read")
        head = "frequency_hz,storage_modulus_pa,loss_factor\n"
        for text, *words in [("frequency_hz,storage_modulus_pa\n1,1e10\n", "no column loss_factor"),
                             (head, "no line"), (head + "10,1e10,-0.1\n", "line 2", "feed energy"),
                             (head + "10,1e10,0.1\n10,1e10,0.1\n", "line 3", "twice"),
                             (head + "0,1e10,0.1\n", "positive"), (head + "10,x,0.1\n", "not a number"),
                             # A stiffness that rises tenfold without any loss is not passive.
                             (head + "10,1e10,0\n1000,1e10,0\n1001,1e11,0\n5000,1e11,0\n", "no passive material")]:
            self.write("bad.csv", text)
            refused({self.TABLE: "bad.csv"}, *words)


class ContactDashpots(BrakeCase):
    """Dashpots of the contact surfaces. Their matrix gives a moved pad c times its area; causes sum up; derivatives."""

    NORMAL, TANGENTIAL = "Contact/Normal dashpot", "Contact/Tangential dashpot"
    DASHPOTS = {NORMAL: 2e5, TANGENTIAL: 3e4}

    def on_pad(self, settings):
        """u^T P u of the dashpots for u = 1 in a component of all of the upper pad, by pairs of components."""
        results = self.analyse({**self.BRAKE, "Output/Matrices": "true", "Eigenproblem/Error bars": "false", **settings})
        term, = [term for term in matrix_export.table(results / "terms.csv") if term["origin"] == "contact damping"]
        _, entries = matrix_export.sparse(results / term["file"])
        component = {int(row["row"]): row["component"] for row in matrix_export.table(results / "unknowns.csv")
                     if "upper" in row["body"] and row["kind"] == "displacement"}
        sums = {}
        for (i, j), value in entries.items():
            if i in component and j in component:
                key = component[i] + component[j]
                sums[key] = sums.get(key, 0) + float(term["factor"]) * value
        return sums

    def check_on_pad(self, settings, normal, tangential):
        sums = self.on_pad(settings)
        area = math.radians(50) / 2 * (0.14**2 - 0.09**2)
        for key, expected in [("xx", tangential), ("yy", tangential), ("zz", normal), ("xy", 0), ("xz", 0), ("yz", 0)]:
            self.assertAlmostEqual(sums.get(key, 0) / area, expected, delta=1e-4 * max(normal, tangential), msg=key)
        return sums

    def test_matrix(self):
        whole = self.check_on_pad({**st.PENALTY, **self.DASHPOTS}, 2e5, 3e4)
        self.check_on_pad({**st.MORTAR, self.TANGENTIAL: 3e4}, 0, 3e4)
        self.check_on_pad({"Contact/Formulation": "mortar_penalty", **self.DASHPOTS}, 2e5, 3e4)
        for formulation in (st.PENALTY, st.MORTAR):
            part = self.on_pad({**formulation, self.TANGENTIAL: 3e4, "Contact/Steady pressure": "computed",
                                "Pads/Arrangement": "upper", "Contact/Initial gap": "2e-5*(1+y/0.05)"})
            self.assertGreater(part["xx"], 0.05 * whole["xx"])
            self.assertLess(part["xx"], 0.98 * whole["xx"])

    def test_causes_and_ways(self):
        case = {**self.BRAKE, **self.DASHPOTS}
        results = self.analyse(case)
        modes = st.read_table(results / "modes.csv")
        eigenvalues = [st.eigenvalue(mode) for mode in modes]
        contributions = st.read_table(results / "contributions.csv")
        for mode in modes:
            parts = [row for row in contributions if row["mode"] == mode["mode"]]
            self.assertAlmostEqual(sum(row["growth_rate_1_per_s"] for row in parts), mode["growth_rate_1_per_s"],
                                   delta=1e-6 * 2 * math.pi * mode["frequency_hz"])
            # A dashpot only takes energy.
            self.assertLessEqual(sum(row["growth_rate_1_per_s"] for row in parts if row["origin"] == "contact damping"), 0)
        self.assertLess(min(row["growth_rate_1_per_s"] for row in contributions if row["origin"] == "contact damping"), -1)
        for settings, ranks in [({"Eigenproblem/Mirror symmetry": "false"}, 1), ({"Eigenproblem/Solver": "dense"}, 1), ({}, 2)]:
            self.assertSameModes(self.eigenvalues({**case, **settings}, ranks=ranks), eigenvalues, 1e-8)
        rows = st.read_table(self.analyse({**case, "Sweep/Parameter": self.TANGENTIAL, "Sweep/Values": "0, 1e4, 3e4"})
                             / "sweep.csv")
        self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == 3e4], eigenvalues, 1e-8)

    def test_bars(self):
        """Against one degree more on the same mesh."""
        case = {**self.BRAKE, **st.SMALL_BRAKE, **self.DASHPOTS, "Discretization/Degree": 3, "Eigenproblem/Maximum frequency": 2000}
        for mode, better in zip(self.modes(case), self.modes({**case, "Discretization/Degree": 4}), strict=True):
            error = st.eigenvalue(mode) - es.corrected(better)
            self.assertLessEqual(abs(error.real), mode["growth_rate_error_1_per_s"] + better["growth_rate_error_1_per_s"])
            self.assertLessEqual(abs(error.imag) / (2 * math.pi), mode["frequency_error_hz"] + better["frequency_error_hz"])

    def test_sensitivities(self):
        case = {**self.BRAKE, **self.DASHPOTS, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Error bars": "false"}
        self.check_sensitivities(case, {key: lambda f, key=key, value=value: {key: value * f}
                                        for key, value in self.DASHPOTS.items()}, 1e-4)

    def test_refused(self):
        self.assertSettingsRefused({**st.TINY_BRAKE, **st.MORTAR, self.NORMAL: 1}, "Contact/Normal dashpot")


class ModalDamping(BrakeCase):
    """Damping of real modes by measured ratios."""

    RATIOS = "Modal damping/Ratios"
    QUICK = {"Eigenproblem/Error bars": "false"}
    BETA = 1e-7
    # beta w / 2 = pi beta f: linear in the frequency, as ratios are between those given
    AS_BETA = f"0 : 0, 10000 : {math.pi * BETA * 10000!r}"

    def test_oscillators(self):
        """m l^2 + 2 zeta w m l + k = 0, with ratios between those given, and beyond them."""
        masses, stiffness = (1.0, 2.0, 0.5, 1.0), (1.0, 8.0, 8.0, 36.0)
        self.write("m.mtx", diagonal(*masses))
        self.write("k.mtx", diagonal(*stiffness))
        case = {"Scene": "matrices", "Matrices/Mass": "m.mtx", "Matrices/Stiffness": "k.mtx",
                "Eigenproblem/Maximum frequency": 1, self.RATIOS: f"{1.5 / math.pi / 2} : 0.02, {3 / math.pi / 2} : 0.08",
                "Modal damping/Factor": 0.5}
        expected = []
        for m, k in zip(masses, stiffness):
            w = math.sqrt(k / m)
            zeta = 0.5 * (0.02 + 0.06 * min(max((w - 1.5) / 1.5, 0), 1))
            expected.append(w * complex(-zeta, math.sqrt(1 - zeta**2)))
        for solver in ["block_krylov", "dense"]:
            self.assertSameModes(self.eigenvalues({**case, "Eigenproblem/Solver": solver}), expected, 1e-10)
        self.assertSameModes(self.eigenvalues(case, ranks=2), expected, 1e-10)
        self.check_sweep({**case, "Modal damping/Factor": 1}, "Modal damping/Factor", [0.0, 0.25, 1.0])

    def test_as_proportional(self):
        """Without friction and turning modes keep their ratios, and Rayleigh's beta of all bodies is such a damping."""
        for contact in (st.PENALTY, st.MORTAR):
            case = {**self.BRAKE, **contact, **self.QUICK, "Contact/Friction/Coefficient": 0,
                    "Operation/Angular velocity": 1e-3}
            modal = self.eigenvalues({**case, self.RATIOS: self.AS_BETA})
            for l in modal:
                self.assertAlmostEqual(-l.real / abs(l), self.BETA * abs(l) / 2, delta=1e-9)
        # A penalty's stiffness is not a body's.
        self.assertSameModes(modal, self.eigenvalues({**case, self.PADS + "Stiffness proportional damping": self.BETA,
                                                      self.ROTOR + "Stiffness proportional damping": self.BETA}), 1e-8)

    def test_ways_to_solve(self):
        """With friction: halves, whole, solvers and ranks agree; causes sum up; it is nearly as beta of all bodies."""
        case = {**self.BRAKE, **st.MORTAR, "Contact/Friction/Coefficient": 0.4}
        damped = {**case, self.RATIOS: self.AS_BETA}
        results = self.analyse(damped)
        modes = st.read_table(results / "modes.csv")
        eigenvalues = [st.eigenvalue(mode) for mode in modes]
        for settings, ranks in [({"Eigenproblem/Mirror symmetry": "false"}, 1), ({"Eigenproblem/Solver": "dense"}, 1), ({}, 2),
                                ({}, 4)]:
            others = self.modes({**damped, **settings}, ranks=ranks)
            self.assertSameModes([st.eigenvalue(mode) for mode in others], eigenvalues, 1e-8)
            for one, other in zip(modes, others):
                self.assertAlmostEqual(one["growth_rate_error_1_per_s"] / other["growth_rate_error_1_per_s"], 1, delta=1e-3)
        contributions = st.read_table(results / "contributions.csv")
        for mode in modes:
            total = sum(row["growth_rate_1_per_s"] for row in contributions if row["mode"] == mode["mode"])
            self.assertAlmostEqual(total, mode["growth_rate_1_per_s"], delta=1e-6 * 2 * math.pi * mode["frequency_hz"])
        beta = self.eigenvalues({**case, **self.QUICK, self.PADS + "Stiffness proportional damping": self.BETA,
                                 self.ROTOR + "Stiffness proportional damping": self.BETA})
        undamped = self.eigenvalues({**case, **self.QUICK})
        for l, b, u in zip(eigenvalues, beta, undamped, strict=True):
            self.assertLess(abs(l - b), 0.05 * abs(b - u))

    def test_bars(self):
        """Against one degree more on the same mesh, where modes are damped by ratios of their own."""
        case = {**self.BRAKE, **st.SMALL_BRAKE, self.RATIOS: "500 : 0.01, 2000 : 0.03", "Discretization/Degree": 3,
                "Eigenproblem/Maximum frequency": 2000}
        for mode, better in zip(self.modes(case), self.modes({**case, "Discretization/Degree": 4}), strict=True):
            error = st.eigenvalue(mode) - es.corrected(better)
            self.assertLessEqual(abs(error.real), mode["growth_rate_error_1_per_s"] + better["growth_rate_error_1_per_s"])
            self.assertLessEqual(abs(error.imag) / (2 * math.pi), mode["frequency_error_hz"] + better["frequency_error_hz"])
            self.assertLess(mode["growth_rate_error_1_per_s"], 0.2 * abs(mode["growth_rate_1_per_s"]))

    def test_sensitivities_and_sweep(self):
        case = {**self.BRAKE, **self.QUICK, self.RATIOS: self.AS_BETA, "Eigenproblem/Maximum frequency": 4000}
        self.check_sensitivities(case, {"Modal damping/Factor": lambda f: {"Modal damping/Factor": f}}, 1e-4)
        self.check_sweep(case, "Contact/Friction/Coefficient", [0.1, 0.5])

    def test_response(self):
        """Near resonances as beta of the body has it; modal and direct."""
        self.write("part.msh", mesh_files.msh2(mesh_files.brake(rotor_cells=(2, 12, 1), pads=())))
        case = {"Scene": "mesh", "Mesh/File": "part.msh", "Mesh/Clamped": "rotor.inner", "Operation/Angular velocity": 0,
                "Discretization/Degree": 2, "Eigenproblem/Maximum frequency": 3000, **self.QUICK,
                "Rotor/Material/Stiffness proportional damping": 0,
                "Response/Forces": "rotor 0.14 0.01 0.002 : 0.3 0 1", "Response/Observations": "rotor -0.12 0.03 0 : 0 3 1"}
        resonances = sorted({round(abs(l) / (2 * math.pi), 1) for l in self.eigenvalues(
            {key: value for key, value in case.items() if not key.startswith("Response")})})
        case["Response/Frequencies"] = ", ".join(map(str, resonances[:4]))

        def values(settings):
            rows = st.read_table(self.analyse({**case, **settings}) / "response.csv")
            return [complex(row["real_m"], row["imaginary_m"]) for row in rows]

        modal = values({self.RATIOS: self.AS_BETA})
        for value, direct, beta in zip(modal, values({self.RATIOS: self.AS_BETA, "Response/Method": "direct"}),
                                       values({self.ROTOR + "Stiffness proportional damping": self.BETA}), strict=True):
            self.assertLess(abs(value - direct), 1e-4 * abs(value))
            self.assertLess(abs(value - beta), 1e-2 * abs(value))

    def test_refused(self):
        for text, word in [("500 : -0.1", "0 to below 1"), ("500 : 1", "0 to below 1"), ("-5 : 0.1", "ascend"),
                           ("900 : 0.1, 500 : 0.1", "ascend"), ("500", "Ratios"), ("500 : a", "Ratios")]:
            self.assertSettingsRefused({**st.TINY_BRAKE, self.RATIOS: text}, "Modal damping", word)
        for settings, word in [({"Eigenproblem/Solver": "krylov"}, "krylov"),
                               ({"Eigenproblem/Solver": "block_davidson"}, "block_davidson"),
                               ({"Modal damping/Factor": -1}, "Factor")]:
            self.assertSettingsRefused({**st.TINY_BRAKE, self.RATIOS: "500 : 0.1", **settings}, word)


class ViscosityTensors(BrakeCase):
    """A material's own viscous moduli."""

    QUICK = {"Eigenproblem/Error bars": "false"}

    def isotropic(self, young, poisson):
        """Keys of bulk and shear moduli."""
        return {"Bulk viscosity": young / (3 * (1 - 2 * poisson)), "Shear viscosity": young / (2 * (1 + poisson))}

    def tensor(self, young, poisson):
        """The same as C11, C12, C13, C33, C44."""
        c11 = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
        c12 = c11 * poisson / (1 - poisson)
        return {"Viscosity tensor": " : ".join(map(repr, [c11, c12, c12, c11, (c11 - c12) / 2]))}

    def test_as_proportional(self):
        """Viscosities of beta times the moduli are beta: same eigenvalues, bars and causes, halves, whole and ranks."""
        beta = 1e-6
        pads = {"Pads/Material/Young modulus": 1e10, "Pads/Material/Poisson ratio": 0.3}
        expected = self.modes({**self.BRAKE, **pads, self.PADS + "Stiffness proportional damping": beta})
        half = {key: value / 2 for key, value in self.isotropic(1e10 * beta, 0.3).items()}
        whole = {"Eigenproblem/Mirror symmetry": "false"}
        for moduli, settings, ranks in [(self.isotropic(1e10 * beta, 0.3), {}, 1), (self.tensor(1e10 * beta, 0.3), {}, 2),
                                        ({**half, **self.tensor(0.5e10 * beta, 0.3)}, whole, 1)]:
            modes = self.modes({**self.BRAKE, **pads, **settings, **{self.PADS + key: value for key, value in moduli.items()}},
                               ranks=ranks)
            self.assertSameModes([st.eigenvalue(mode) for mode in modes], [st.eigenvalue(mode) for mode in expected], 1e-9)
            for one, other in zip(modes, expected, strict=True):
                self.assertAlmostEqual(one["growth_rate_error_1_per_s"] / other["growth_rate_error_1_per_s"], 1, delta=0.02)
        layered = {**pads, "Pads/Material/Law": "transversely_isotropic", "Pads/Material/Axial Young modulus": 2e9,
                   "Pads/Material/Axial Poisson ratio": 0.25, "Pads/Material/Axial shear modulus": 3e9}
        # Of theory.md, section 2, in Voigt's notation
        d = 1 - 0.3 - 2 * 0.25**2 * 2e9 / 1e10
        c12 = (1e10 * 0.3 + 0.25**2 * 2e9) / (1.3 * d)
        numbers = [c12 + 1e10 / 1.3, c12, 0.25 * 2e9 / d, 2e9 * 0.7 / d, 3e9]
        self.assertSameModes(
            self.eigenvalues({**self.BRAKE, **layered, **self.QUICK,
                              self.PADS + "Viscosity tensor": " : ".join(repr(beta * c) for c in numbers)}),
            self.eigenvalues({**self.BRAKE, **layered, **self.QUICK, self.PADS + "Stiffness proportional damping": beta}), 1e-9)

    def test_strip(self):
        """Plane strain."""
        case = {"Scene": "strip", "Discretization/Degree": 2, "Eigenproblem/Maximum frequency": 20000, **self.QUICK,
                "Rotor/Material/Stiffness proportional damping": 0}
        viscous = {self.ROTOR + key: value for key, value in self.isotropic(1.25e11 * 1e-7, 0.25).items()}
        self.assertSameModes(self.eigenvalues({**case, **viscous}),
                             self.eigenvalues({**case, self.ROTOR + "Stiffness proportional damping": 1e-7}), 1e-9)

    def test_sensitivities_and_sweep(self):
        pads = self.PADS
        case = {**self.BRAKE, **self.QUICK, pads + "Bulk viscosity": 2e4, pads + "Shear viscosity": 1e4,
                pads + "Viscosity tensor": "3e4 : 1e4 : 5e3 : 2e4 : 8e3", "Eigenproblem/Maximum frequency": 4000}
        self.check_sensitivities(case, {
            pads + "Bulk viscosity": lambda f: {pads + "Bulk viscosity": 2e4 * f},
            pads + "Shear viscosity": lambda f: {pads + "Shear viscosity": 1e4 * f},
            pads + "Viscosity tensor/33": lambda f: {pads + "Viscosity tensor": f"3e4 : 1e4 : 5e3 : {2e4 * f!r} : 8e3"},
            pads + "Viscosity tensor/13": lambda f: {pads + "Viscosity tensor": f"3e4 : 1e4 : {5e3 * f!r} : 2e4 : 8e3"}}, 1e-4)
        self.check_sweep(case, pads + "Shear viscosity", [0.0, 1e4, 5e4])

    def test_refused(self):
        for key, value, word in [("Bulk viscosity", -1, "Bulk viscosity"), ("Shear viscosity", -1, "Shear viscosity"),
                                 ("Viscosity tensor", "1 : 2", "five numbers"),
                                 ("Viscosity tensor", "1 : 2 : 0 : 1 : 1", "feed energy"),
                                 ("Viscosity tensor", "1 : 0 : 1 : 1 : 1", "feed energy"),
                                 ("Viscosity tensor", "1 : 0 : 0 : 1 : -1", "feed energy")]:
            self.assertSettingsRefused({**st.TINY_BRAKE, self.PADS + key: value}, word)
        self.assertSettingsRefused({**st.TINY_BRAKE, self.PADS + "Shear viscosity": 1,
                                    "Eigenproblem/Solver": "block_davidson"}, "viscosity")


class Export(BrakeCase):
    def test_functions(self):
        """Output/Matrices: sums, functions.csv and its files are the problem that was solved."""
        pads = self.PADS
        results = self.analyse({
            **self.BRAKE, "Eigenproblem/Error bars": "false", "Eigenproblem/Maximum frequency": 4000, "Output/Matrices": "true",
            "Eigenproblem/Tolerance": 1e-12, pads + "Loss factor": 0.05, pads + "Prony series": "0.2 : 3e-4, 0.3 : 4e-5",
            self.ROTOR + "Fractional Zener": "1.2 : 1e-5 : 0.7", "Modal damping/Ratios": "500 : 0.01"})
        M, P, Q = (matrix_export.sparse(results / f"{name}.mtx") for name in "MPQ")
        n = M[0][0]
        functions = matrix_export.table(results / "functions.csv")
        self.assertEqual([row["form"] for row in functions], ["A", "A", "B B^T"])

        def law(row, l):
            f = complex(0, float(row["loss_factor"])) + l * float(row["viscosity_s"])
            for pair in row["prony_series"].split():
                g, tau = map(float, pair.split(":"))
                f += g * l * tau / (1 + l * tau)
            if row["fractional_zener"]:
                c, tau, a = map(float, row["fractional_zener"].split(":"))
                f += (c - 1) * (l * tau)**a / (1 + (l * tau)**a)
            return float(row["factor"]) * f

        def product(row, x):
            (n_rows, n_columns), entries = matrix_export.sparse(results / row["file"])
            if row["form"] == "A":
                return matrix_export.times(entries, x, n_rows)
            transposed = {(j, i): value for (i, j), value in entries.items()}
            return matrix_export.times(entries, matrix_export.times(transposed, x, n_columns), n_rows)

        eigenvalues, = matrix_export.dense(results / "eigenvalues.mtx")
        self.assertGreater(len(eigenvalues), 5)
        for l, x in zip(eigenvalues, matrix_export.dense(results / "right_vectors.mtx"), strict=True):
            parts = [[l**2 * a for a in matrix_export.times(M[1], x, n)], [l * a for a in matrix_export.times(P[1], x, n)],
                     matrix_export.times(Q[1], x, n)]
            parts += [[law(row, l) * a for a in product(row, x)] for row in functions]
            # Beside what the largest of the matrices is made of: its products with smooth vectors cancel.
            size = max(matrix_export.times({place: abs(value) for place, value in Q[1].items()}, [abs(a) for a in x], n))
            self.assertLessEqual(max(abs(sum(of_row)) for of_row in zip(*parts)), 1e-11 * size)


class Refused(st.TestCase):
    def assertRefused(self, settings, *words):
        self.assertSettingsRefused({**st.TINY_BRAKE, **settings}, *words)

    def test_values(self):
        for section in ["Pads/Material", "Rotor/Material"]:
            for key, value, word in [("Loss factor", -0.01, "feed energy"), ("Prony series", "-0.2 : 1e-3", "positive"),
                                     ("Prony series", "0.2 : -1e-3", "positive"), ("Prony series", "0.2 : 0", "positive"),
                                     ("Fractional Zener", "0.5 : 1e-3 : 0.5", "at least 1"),
                                     ("Fractional Zener", "5 : -1 : 0.5", "positive"),
                                     ("Fractional Zener", "5 : 1", "0 < a <= 1"),
                                     ("Fractional Zener", "5 : 1 : 1.1", "0 < a <= 1")]:
                self.assertRefused({f"{section}/{key}": value}, f"{section}/{key}", word)
        for text in ["0.2", "0.2 : 1 : 2", "a : b", "0.2 : 1e-3 0.3 : 1e-4"]:
            self.assertRefused({"Pads/Material/Prony series": text}, "Prony series")

    def test_combinations(self):
        damped = {"Pads/Material/Loss factor": 0.06}
        for settings, word in [
                ({"Eigenproblem/Solver": "krylov"}, "krylov"), ({"Eigenproblem/Solver": "block_davidson"}, "block_davidson"),
                ({"Eigenproblem/Minimum frequency": 5900}, "Minimum frequency")]:
            self.assertRefused({**damped, **settings}, word)

    def test_damping_without_a_matrix(self):
        self.write("m.mtx", diagonal(1.0))
        self.assertRefused({"Scene": "matrices", "Matrices/Mass": "m.mtx", "Matrices/Stiffness": "m.mtx",
                            "Matrices/Viscoelastic 2/Loss factor": 0.1}, "Matrices/Viscoelastic 2/Stiffness")


if __name__ == "__main__":
    unittest.main(verbosity=2)
