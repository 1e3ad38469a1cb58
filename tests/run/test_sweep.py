"""Sweeps: the same modes as separate runs, branches, critical values, resumption after a kill.

Critical values of small matrices against closed forms: test_theory_scenes.py. Here on meshes: at rest without damping the
modes are marginal until two of them coalesce, so just below the critical friction no mode grows and just above one does;
near it the growth rate follows the square root, Re l = c sqrt(mu - mu_c).
"""

import math
import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

AT_REST = {
    **st.SMALL_BRAKE,
    "Stage": "friction",
    "Operation/Angular velocity": 0,
    "Contact/Steady pressure": "uniform",
    "Eigenproblem/Maximum frequency": 2000,
}
FRICTION = "Contact/Friction/Coefficient"
# For tests of something else: bars take most of the time of a short sweep.
NO_BARS = {"Eigenproblem/Error bars": "false"}


class Sweeps(st.TestCase):
    def test_pressure(self):
        """The pressure of a sweep reaches the static equilibrium: each point is the run with that pressure."""
        settings = {**st.SMALL_BRAKE, "Eigenproblem/Maximum frequency": 2000, "Eigenproblem/Error bars": "false"}
        results = self.analyse({**settings, "Sweep/Parameter": "Pads/Pressure", "Sweep/Values": "1e6, 3e6"})
        at_end = [st.eigenvalue(row) for row in st.read_table(results / "sweep.csv") if row["parameter"] == 3e6]
        self.assertSameModes(at_end, self.eigenvalues({**settings, "Pads/Pressure": 3e6}), 1e-7)

    def test_coalescence(self):
        directory = self.analyse({**AT_REST, **NO_BARS, **st.PENALTY, "Sweep/Parameter": FRICTION, "Sweep/Values": "0 : 0.4 : 5",
                                  "Sweep/Critical values": "true", "Eigenproblem/Tolerance": 1e-10})
        critical = [row for row in st.read_table(directory / "critical.csv") if row["kind"] == "coalescence"]
        self.assertGreater(len(critical), 0)
        mu_c = critical[0]["value"]
        self.assertLess(critical[0]["accuracy"], 1e-6 * mu_c)
        growth = {}
        for factor in [1 - 1e-4, 1 + 1e-4, 1 + 4e-4]:
            modes = self.eigenvalues({**AT_REST, **NO_BARS, **st.PENALTY, FRICTION: repr(mu_c * factor)})
            mode = max(modes, key=lambda l: l.real)
            growth[factor] = mode.real
            if factor > 1:
                self.assertLess(abs(mode.imag / (2 * math.pi) - critical[0]["frequency_hz"]), 1e-3 * mode.imag)
        self.assertLess(growth[1 - 1e-4], 1e-5)
        self.assertGreater(growth[1 + 1e-4], 1e-2)
        self.assertLess(abs(growth[1 + 4e-4] / growth[1 + 1e-4] - 2), 1e-2)

    BARS = ["growth_rate_error_1_per_s", "frequency_error_hz", "corrected_growth_rate_1_per_s", "corrected_frequency_hz"]

    def bars_beside_single_runs(self, settings, parameter, values, estimated, least, most):
        """Bars of a sweep: at the values in `estimated` those of a run of its own, else `least` to `most` of them."""
        directory = self.analyse({**settings, "Sweep/Parameter": parameter, "Sweep/Values": ", ".join(map(repr, values))})
        rows = st.read_table(directory / "sweep.csv")
        for value in values:
            own = sorted((row for row in rows if row["parameter"] == value), key=lambda row: row["frequency_hz"])
            alone = sorted(self.modes({**settings, parameter: value}), key=lambda row: row["frequency_hz"])
            self.assertEqual(len(own), len(alone))
            for a, b in zip(own, alone):
                with self.subTest(value=value, frequency=b["frequency_hz"]):
                    for column in self.BARS:
                        if value in estimated:
                            self.assertLess(abs(a[column] - b[column]), 1e-4 * abs(b[column]) + 1e-6, column)
                        elif column in self.BARS[:2]:
                            self.assertLess(a[column], most * b[column])
                            self.assertGreater(a[column], least * b[column])
                    if value in estimated:
                        self.assertEqual(a["verdict"], b["verdict"])
        return directory, rows

    def test_bars(self):
        """Pads that touch everywhere: the operators are nearly linear in friction and speed, and so are the bars between
        the first and the last value, both estimated."""
        settings = {**st.SMALL_BRAKE, **st.MORTAR, "Contact/Steady pressure": "uniform", "Eigenproblem/Maximum frequency": 3000}
        values = [0.2, 0.3, 0.4, 0.5]
        directory, rows = self.bars_beside_single_runs(settings, FRICTION, values, {0.2, 0.5}, 0.95, 1.05)
        log = (directory / "log.txt").read_text()
        for value in values:  # the log tells as many as the table
            unstable, undecided = (sum(row["verdict"] in kinds for row in rows if row["parameter"] == value)
                                   for kinds in (("flutter", "divergence"), ("undecided",)))
            self.assertRegex(log, rf"(?m)^ +{value:g} +{len(rows) // 4} +{unstable} +{undecided} ")
        self.assertIn("error bars", log)

    def test_bars_with_lift_off(self):
        """Where contacts open on the way, bars between two estimates mix those of both contact zones."""
        settings = {**st.SMALL_BRAKE, **st.MORTAR, "Eigenproblem/Maximum frequency": 2000}
        self.bars_beside_single_runs(settings, FRICTION, [0.15, 0.3, 0.45, 0.6], {0.15, 0.6}, 0.4, 4)

    def test_bars_of_critical_values(self):
        """An onset and a coalescence: bars cover those of one degree more and shrink with it; how the way was divided does
        not matter."""
        strip = {"Scene": "strip", "Operation/Angular velocity": 2, "Discretization/Rotor cells": "1, 24, 2",
                 "Discretization/Pad cells": "1, 7, 2", "Eigenproblem/Maximum frequency": 36000, "Output/Fields": "none"}
        for kind, settings, values in [
                ("onset", strip, ["0.6, 0.77", "0.65, 0.7, 0.77"]),
                ("coalescence", {**AT_REST, **st.PENALTY}, ["0 : 0.4 : 5", "0, 0.4"])]:
            with self.subTest(kind=kind):
                found = []
                for degree, steps in [(2, values[0]), (3, values[0]), (2, values[1])]:
                    directory = self.analyse({**settings, "Discretization/Degree": degree, "Sweep/Parameter": FRICTION,
                                              "Sweep/Values": steps, "Sweep/Critical values": "true"})
                    found.append(next(row for row in st.read_table(directory / "critical.csv") if row["kind"] == kind))
                    row = found[-1]
                    self.assertAlmostEqual(row["accuracy"], row["search_error"] + row["reduction_error"],
                                           delta=1e-6 * row["accuracy"])
                    self.assertLess(row["accuracy"], 1e-3 * row["mesh_error"])
                coarse, fine, other = found
                self.assertLess(abs(coarse["value"] - fine["value"]), coarse["mesh_error"] + fine["mesh_error"])
                self.assertLess(abs(coarse["corrected_value"] - fine["value"]), coarse["mesh_error"] + fine["mesh_error"])
                self.assertLess(fine["mesh_error"], coarse["mesh_error"])
                self.assertLess(abs(coarse["mesh_error"] - other["mesh_error"]), 0.2 * coarse["mesh_error"])
                self.assertLess(abs(coarse["corrected_value"] - other["corrected_value"]), 0.1 * coarse["mesh_error"])

    def test_bars_of_onsets_and_of_rates(self):
        """The bar of an onset ends where the rates' own bars are stable on its one side and flutter on the other."""
        directory = self.analyse({**st.SMALL_BRAKE, "Operation/Angular velocity": 20, "Eigenproblem/Maximum frequency": 1600,
                                  "Sweep/Parameter": FRICTION, "Sweep/Values": "0.1, 0.35, 0.6", "Sweep/Critical values": "true"})
        [onset] = [row for row in st.read_table(directory / "critical.csv") if row["kind"] == "onset"]
        rates = {row["parameter"]: row for row in st.read_table(directory / "sweep.csv") if row["branch"] == onset["branch"]}
        self.assertEqual([rates[value]["verdict"] for value in (0.1, 0.35, 0.6)], ["stable", "stable", "undecided"])
        self.assertEqual(onset["lowest_value"], 0.35)
        self.assertGreater(onset["highest_value"], 0.6)
        self.assertLess(abs(onset["value"] + onset["mesh_error"] - onset["highest_value"]), 1e-5)
        self.assertGreaterEqual(onset["corrected_value"], 0.35)

    def test_bars_of_divergences(self):
        """A fast disc between pads at rest: the bar is that of the value, wherever the steps of the sweep are. 2852.08 +- 0.29
        is the corrected value of degree 4 on smaller cells (tests/benchmark/onsets.py, scene divergence)."""
        rotor = {**st.SMALL_BRAKE, **st.PENALTY, "Stage": "transport", "Discretization/Degree": 3, "Contact/Friction/Coefficient": 0,
                 "Contact/Steady pressure": "uniform", "Eigenproblem/Maximum frequency": 400,
                 "Sweep/Parameter": "Operation/Angular velocity", "Sweep/Critical values": "true"}
        bars = []
        for values, kind in [("2845, 2900", "divergence_end"), ("2900, 2845", "divergence")]:
            [row] = st.read_table(self.analyse({**rotor, "Sweep/Values": values}) / "critical.csv")
            self.assertEqual(row["kind"], kind)
            self.assertLess(abs(row["corrected_value"] - 2852.08), row["mesh_error"] + 0.29)
            self.assertLess(abs(row["corrected_value"] - 2852.08), abs(row["value"] - 2852.08))
            bars.append(row["mesh_error"])
        self.assertLess(max(bars), 3 * abs(row["value"] - 2852.08))
        self.assertLess(max(bars), 1.2 * min(bars))

    def test_without_bars(self):
        """Nothing is estimated: rows appear as values are reached, with the verdicts of the numbers alone."""
        settings = {**AT_REST, **st.PENALTY, "Eigenproblem/Error bars": "false", "Sweep/Parameter": FRICTION,
                    "Sweep/Values": "0 : 0.4 : 5", "Sweep/Critical values": "true"}
        directory = self.analyse(settings)
        log = (directory / "log.txt").read_text()
        self.assertNotIn("undecided", log)
        self.assertNotIn("error bars", log)
        for row in st.read_table(directory / "sweep.csv"):
            self.assertEqual([row[column] for column in self.BARS], [None] * 4)
        for row in st.read_table(directory / "critical.csv"):
            self.assertIsNone(row["mesh_error"])
            self.assertIsNone(row["corrected_value"])

    def test_points_and_branches(self):
        settings = {**st.SMALL_BRAKE, **st.MORTAR, **NO_BARS, "Eigenproblem/Maximum frequency": 4000}
        values = [0.1, 0.25, 0.4]
        directory = self.analyse({**settings, "Sweep/Parameter": FRICTION, "Sweep/Values": ", ".join(map(str, values))})
        rows = st.read_table(directory / "sweep.csv")
        before = None
        for value in values:
            own = [row for row in rows if row["parameter"] == value]
            alone = self.eigenvalues({**settings, FRICTION: value})
            self.assertSameModes([st.eigenvalue(row) for row in own], alone, 1e-8)
            branches = {row["branch"]: st.eigenvalue(row) for row in own}
            self.assertEqual(len(branches), len(own), "a branch number twice")
            if before is not None:
                self.assertEqual(set(branches), set(before))
                for row in own:
                    self.assertGreater(row["overlap"], 0.8)
            before = branches

    def test_speed_and_stiffness(self):
        for name, values in [("Operation/Angular velocity", "5, 10"), ("Pads/Material/Young modulus", "8e9, 1e10"),
                             ("Rotor/Material/Density", "7000, 7200")]:
            with self.subTest(parameter=name):
                settings = {**st.SMALL_BRAKE, **st.MORTAR, **NO_BARS, "Eigenproblem/Maximum frequency": 2000}
                directory = self.analyse({**settings, "Sweep/Parameter": name, "Sweep/Values": values})
                last = float(values.split(",")[1])
                own = [st.eigenvalue(r) for r in st.read_table(directory / "sweep.csv") if r["parameter"] == last]
                self.assertSameModes(own, self.eigenvalues({**settings, name: last}), 1e-8)

    def test_speed_through_zero(self):
        """The friction turns round with the rotor: each value has the modes of a run of its own."""
        for pressure in ["uniform", "computed"]:
            settings = {**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Rotor cells": "2, 8, 1",
                        "Discretization/Pad cells": "1, 2, 1", "Discretization/Clamp layers": 0,
                        "Contact/Steady pressure": pressure, "Eigenproblem/Maximum frequency": 3000,
                        "Eigenproblem/Error bars": "false", "Eigenproblem/Tolerance": 1e-10}
            name, values = "Operation/Angular velocity", [-20, -5, 5, 20]
            directory = self.analyse({**settings, "Sweep/Parameter": name, "Sweep/Values": str(values)[1:-1]})
            rows = st.read_table(directory / "sweep.csv")
            for value in values:
                own = [st.eigenvalue(row) for row in rows if row["parameter"] == value]
                self.assertSameModes(own, self.eigenvalues({**settings, name: value}), 1e-8)

    def test_long(self):
        """Pads that lift off on the way: bases are restarted, and what follows is as good as a run of its own.

        A projected eigenvalue is of the first order in its residual: its relative error was up to 190 times the
        backward error here, of which a fifth of the tolerance is allowed. So the tolerance of 1e-10 must give 4e-9.
        (With 1e-9 errors were 6e-9 or 1.2e-8, depending on the kernels of the BLAS.)"""
        settings = {**st.SMALL_BRAKE, **st.MORTAR, "Eigenproblem/Maximum frequency": 5000,
                    "Eigenproblem/Error bars": "false", "Eigenproblem/Tolerance": 1e-10}
        for steps, end in [("0.1 : 0.6 : 101", 0.6), ("0.6 : 0.1 : 51", 0.1)]:  # contacts open, and close again
            with self.subTest(steps=steps):
                directory = self.analyse({**settings, "Sweep/Parameter": FRICTION, "Sweep/Values": steps})
                log = (directory / "log.txt").read_text()
                full, restarts = map(int, re.search(
                    r"(\d+) full solutions for \d+ values; bases were restarted (\d+) times", log).groups())
                self.assertLess(full, 4)
                self.assertGreater(restarts, 1)
                rows = st.read_table(directory / "sweep.csv")
                for value in [0.35, end]:
                    own = [st.eigenvalue(row) for row in rows if abs(row["parameter"] - value) < 1e-12]
                    self.assertSameModes(own, self.eigenvalues({**settings, FRICTION: value}), 4e-9)
                self.assertLess(max(row["backward_error"] for row in rows), 1e-9)

    def test_ranks(self):
        """One and two ranks: the same branches, eigenvalues, bars and verdicts."""
        settings = {"Scene": "strip", "Operation/Angular velocity": 2, "Discretization/Rotor cells": "1, 24, 2",
                    "Discretization/Pad cells": "1, 7, 2", "Eigenproblem/Maximum frequency": 36000,
                    "Output/Fields": "none", "Sweep/Parameter": FRICTION, "Sweep/Values": "0.2, 0.4, 0.6"}
        one, two = (st.read_table(self.analyse(settings, ranks=ranks) / "sweep.csv") for ranks in (1, 2))
        self.assertEqual([(row["parameter"], row["branch"]) for row in one],
                         [(row["parameter"], row["branch"]) for row in two])
        for a, b in zip(one, two):
            self.assertLess(abs(st.eigenvalue(a) - st.eigenvalue(b)), 1e-8 * abs(st.eigenvalue(a)))
            for column in self.BARS[:2]:
                self.assertLess(abs(a[column] - b[column]), 1e-4 * a[column] + 1e-6, column)
            self.assertEqual(a["verdict"], b["verdict"])

    def test_killed_and_resumed(self):
        settings = {**st.SMALL_BRAKE, **st.MORTAR, "Eigenproblem/Maximum frequency": 2000, "Sweep/Parameter": FRICTION,
                    "Sweep/Values": "0.1 : 0.4 : 7", "Sweep/Critical values": "true"}
        whole = self.analyse(settings)
        results = self.kill(settings, lambda results: (results / "sweep.state").exists())
        table, state = results / "sweep.csv", results / "sweep.state"
        self.assertTrue(state.exists())
        with open(table, "a") as half:  # a line that was cut
            half.write("0.3,2,0,1")
        self.resume()
        for name in ["sweep.csv", "critical.csv"]:
            self.assertEqual((whole / name).read_text(), (table.parent / name).read_text())
        self.assertFalse(state.exists())

    def theory(self, name, *overrides):
        """The critical values of a file of prm/theory with other settings."""
        results = self.directory / "theory"
        settings = [argument for override in overrides for argument in ("--set", override)]
        result = st.run(st.PROJECT / f"prm/theory/{name}.prm", "--set", f"Output/Directory={results}", *settings,
                        "--overwrite", directory=st.PROJECT)
        self.assertEqual(result.returncode, 0, result.stderr)
        return st.read_table(results / "critical.csv")

    def test_onset_on_a_value(self):
        """An onset that lies on a value of the sweep is found once, whatever stands beside it.

        ziegler_damped.prm: onset at p = 41/28 + b^2/2, b = 0.1. gyroscopic_circulatory.prm: at p = 0 one mode begins to
        grow and the other ends to; at the first value it is not known what was before. flutter.prm: marginal everywhere
        below p = 2/3, where only the coalescence counts."""
        exact = 41 / 28 + 0.1 ** 2 / 2
        for values in [[1.3, exact, 1.6], [exact, 1.6], [1.6, exact]]:
            found = self.theory("ziegler_damped", "Sweep/Values=" + ", ".join(map(repr, values)))
            self.assertEqual([row["kind"] for row in found], ["end" if values[0] > values[-1] else "onset"], values)
            self.assertLess(abs(found[0]["value"] - exact), 1e-12)
            self.assertLess(abs(2 * math.pi * found[0]["frequency_hz"] - math.sqrt(2 / 7)), 1e-12)
        for values in ["-0.02, 0, 0.02", "0, 0.02, 0.04"]:
            found = self.theory("gyroscopic_circulatory", "Sweep/Values=" + values)
            self.assertEqual(sorted(row["kind"] for row in found), ["end", "onset"], values)
            for row in found:
                self.assertLess(abs(row["value"]), 1e-12)
        self.assertEqual([row["kind"] for row in self.theory("flutter", "Sweep/Values=0, 0.3, 0.6, 0.9")], ["coalescence"])

    def test_divergence(self):
        """The pendulum of prm/theory/divergence.prm without damping: a pair +-j w meets at 0 and leaves as +-rho. The
        value may also be one of the sweep's, where the stiffness is exactly or nearly singular."""
        exact = (3 - math.sqrt(11 / 3)) / 2
        for values in [[0.3, 0.5, 0.6], [0.3, exact, 0.6], [0.6, 0.3]]:
            found = self.theory("divergence", "Matrices/Velocity=", "Sweep/Values=" + ", ".join(map(repr, values)))
            found = [row for row in found if row["kind"].startswith("divergence")]
            self.assertEqual([row["kind"] for row in found],
                             ["divergence_end" if values[0] > values[-1] else "divergence"], values)
            self.assertLess(abs(found[0]["value"] - exact), 1e-12)
            self.assertEqual((found[0]["frequency_hz"], found[0]["growth_rate_1_per_s"]), (0, 0))

    def test_divergence_is_self_locking(self):
        """Two ways to one number. The gain of friction on contact pressure is proportional to mu, by Arnoldi's method on
        the frictionless tangent, so that the static tangent is singular at mu/gain. The sweep finds det Q = 0."""
        strip = {"Scene": "strip", "Stage": "friction", "Operation/Angular velocity": 0, "Discretization/Degree": 1,
                 "Discretization/Rotor cells": "1, 16, 2", "Discretization/Pad cells": "1, 5, 2",
                 "Contact/Steady pressure": "uniform", "Eigenproblem/Maximum frequency": 10000, "Output/Fields": "none", **NO_BARS}
        for formulation in [st.MORTAR, st.PENALTY]:
            gain = {}
            for mu in [0.5, 1]:
                directory = self.analyse({**strip, **formulation, FRICTION: mu, "Contact/Self-locking check": "true"})
                gain[mu] = st.read_table(directory / "static.csv")[0]["self_energising_gain"]
            self.assertGreater(gain[1], 0)
            self.assertLess(abs(gain[1] - 2 * gain[0.5]), 1e-4 * gain[1])
            mu = 1 / gain[1]
            directory = self.analyse({**strip, **formulation, "Sweep/Parameter": FRICTION,
                                      "Sweep/Values": f"{0.998 * mu!r}, {1.003 * mu!r}", "Sweep/Critical values": "true"})
            found = [row["value"] for row in st.read_table(directory / "critical.csv") if "divergence" in row["kind"]]
            self.assertEqual(len(found), 1)
            self.assertLess(abs(found[0] - mu), 1e-4 * mu)
            beyond = self.analyse({**strip, **formulation, FRICTION: repr(1.003 * mu), "Contact/Self-locking check": "true"})
            self.assertIn("Warning, self-locking", (beyond / "log.txt").read_text())

    def test_self_locking_equilibrium(self):
        """A static equilibrium that fails because friction locks the pad says so."""
        result = st.run(st.PROJECT / "prm/strip.prm", "--set", f"{FRICTION}=10", "--set",
                        f"Output/Directory={self.directory / 'locked'}", directory=st.PROJECT)
        self.assertEqual(result.returncode, 3, result.stdout + result.stderr)
        self.assertIn("the brake is self-locking", result.stderr)

    def test_geometry(self):
        """Parameters that change the mesh: the modes of separate runs; branches go on; no critical values."""
        brake = {**st.SMALL_BRAKE, **NO_BARS, "Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 3000}
        strip = {"Scene": "strip", "Operation/Angular velocity": 2, "Discretization/Degree": 2, "Discretization/Rotor cells": "1, 12, 1",
                 "Discretization/Pad cells": "1, 4, 1", "Eigenproblem/Maximum frequency": 36000, "Output/Fields": "none", **NO_BARS}
        for settings, name, values, same_size in [(brake, "Rotor/Thickness", [0.012, 0.0125], True),
                                                  (strip, "Strip/Block thickness", [0.02, 0.021], True),
                                                  (strip, "Discretization/Degree", [2, 3], False)]:
            with self.subTest(parameter=name):
                directory = self.analyse({**settings, "Sweep/Parameter": name, "Sweep/Critical values": "true",
                                          "Sweep/Values": ", ".join(map(str, values))})
                rows = st.read_table(directory / "sweep.csv")
                log = (directory / "log.txt").read_text()
                self.assertIn("Critical values are not located", log)
                self.assertFalse((directory / "critical.csv").exists())
                self.assertEqual("by the nearest eigenvalues" in log, not same_size)
                branches = []
                for value in values:
                    own = [row for row in rows if row["parameter"] == value]
                    alone = self.eigenvalues({**settings, name: value})
                    self.assertSameModes([st.eigenvalue(row) for row in own], alone, 1e-8)
                    branches.append({row["branch"]: st.eigenvalue(row) for row in own})
                common = set(branches[0]) & set(branches[1])
                self.assertGreater(len(common), 2)
                for branch in common:
                    self.assertLess(abs(branches[0][branch] - branches[1][branch]), 0.1 * abs(branches[0][branch]))
                overlaps = [row["overlap"] for row in rows if row["parameter"] == values[1] and row["branch"] in common]
                self.assertEqual(any(overlaps), same_size)

    def test_geometry_resumed(self):
        settings = {**st.SMALL_BRAKE, "Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 2500,
                    "Sweep/Parameter": "Pads/Sector angle", "Sweep/Values": "40 : 50 : 6"}
        whole = self.analyse(settings)
        results = self.kill(settings, lambda results: (results / "sweep.state").exists())
        self.resume()
        self.assertEqual((whole / "sweep.csv").read_text(), (results / "sweep.csv").read_text())

    def test_bad_sweeps(self):
        for settings, part in [({"Sweep/Parameter": "Rotor/Thicknes", "Sweep/Values": "1, 2"}, "Rotor/Thickness"),
                               ({"Sweep/Parameter": "Refinement/Cycles", "Sweep/Values": "1, 2"}, "do not depend on it"),
                               ({"Sweep/Parameter": "Discretization/Degree", "Sweep/Values": "1, 1.5"}, "Degree = 1.5"),
                               ({"Sweep/Parameter": "Contact/Formulation", "Sweep/Values": "1, 2"}, "not a number"),
                               ({"Sweep/Parameter": FRICTION, "Sweep/Values": "1, x"}, "Sweep/Values"),
                               ({"Sweep/Parameter": FRICTION, "Sweep/Values": "0 : 1 : 0"}, "Sweep/Values"),
                               ({"Sweep/Parameter": FRICTION, "Sweep/Values": "0, 1, 0.5"}, "rise or fall"),
                               ({"Sweep/Parameter": FRICTION, "Sweep/Values": "-1, 1"}, FRICTION),
                               ({"Sweep/Critical values": "true"}, "Sweep/Parameter")]:
            with self.subTest(**settings):
                file = self.write("bad.prm", {**st.SMALL_BRAKE, **settings})
                result = st.run(file.name, directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertIn(part, result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
