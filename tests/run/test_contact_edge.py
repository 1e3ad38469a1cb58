#!/usr/bin/env python3
"""Refinement/Contact edge levels: cells in which the contact ends are divided before the first modes are sought."""

import math
import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

LIFTING_BRAKE = {**st.SMALL_BRAKE, **st.MORTAR, "Discretization/Degree": 1, "Discretization/Pad cells": "3, 6, 1",
                 "Contact/Friction/Coefficient": 0.6, "Eigenproblem/Maximum frequency": 2000}
LEVELS = {"Refinement/Contact edge levels": 2}


class ContactEdge(st.TestCase):
    def found(self, settings, **options):
        """The log and the eigenvalues, without error bars."""
        results = self.analyse({**settings, "Eigenproblem/Error bars": "false"}, **options)
        return (results / "log.txt").read_text(), [st.eigenvalue(row) for row in st.read_table(results / "modes.csv")]

    def test_halves_and_ranks(self):
        """The same cells are divided by halves and as a whole, with one and two ranks."""
        log, expected = self.found({**LIFTING_BRAKE, **LEVELS})
        divided = re.findall(r"Edge of the contact, level (\d): (\d+) of the pads' cells divided\.", log)
        self.assertEqual([level for level, _ in divided], ["1", "2"])
        self.assertTrue(all(0 < int(n_cells) < 2 * 18 for _, n_cells in divided), divided)
        for settings, ranks in (({"Eigenproblem/Mirror symmetry": "false"}, 1), ({}, 2)):
            other_log, found = self.found({**LIFTING_BRAKE, **LEVELS, **settings}, ranks=ranks)
            self.assertSameModes(found, expected, 1e-8)
            self.assertEqual(re.findall(r"Edge of the contact, .*", other_log),
                             re.findall(r"Edge of the contact, .*", log))

    def test_bars(self):
        """With the edge known to a quarter its part of the growth rates' bars is shorter, and both bars hold the other's value."""
        settings = {**LIFTING_BRAKE, "Discretization/Degree": 3, "Discretization/Rotor cells": "3, 24, 1",
                    "Eigenproblem/Maximum frequency": 1600}
        coarse, fine, of_edges = None, None, []
        for levels in ({}, LEVELS):
            results = self.analyse({**settings, **levels})
            coarse, fine = fine, st.read_table(results / "modes.csv")
            of_edges.append([sum(part["growth_rate_1_per_s"] for part in st.read_table(results / "bars.csv")
                                 if part["mode"] == row["mode"] and part["cause"].startswith("edge of contact") and not part["at"])
                             for row in fine])
        self.assertEqual(len(coarse), len(fine))
        shorter = sorted(f / c for c, f in zip(*of_edges))
        self.assertLess(shorter[len(shorter) // 2], 0.5, shorter)
        for c, f in zip(coarse, fine):
            self.assertLess(abs(c["growth_rate_1_per_s"] - f["growth_rate_1_per_s"]),
                            c["growth_rate_error_1_per_s"] + f["growth_rate_error_1_per_s"])

    def test_everything_touches(self):
        """The mesh stays, and with it its static state: it is solved for once, which the iterative solver's line counts."""
        settings = {**LIFTING_BRAKE, "Contact/Friction/Coefficient": 0.02}
        for solver, lines in (("direct", 0), ("iterative", 1)):
            chosen = {**settings, "Static equilibrium/Linear solver": solver}
            log, found = self.found({**chosen, **LEVELS})
            self.assertIn("The pads touch everywhere: no edge of the contact to refine.", log)
            self.assertEqual(log.count("Static equilibrium by GMRES"), lines)
            expected = self.modes(chosen)
            self.assertSameModes(found, [st.eigenvalue(row) for row in expected], 1e-8)
            for mode, other in zip(self.modes({**chosen, **LEVELS}), expected):
                self.assertLess(abs(mode["growth_rate_error_1_per_s"] / other["growth_rate_error_1_per_s"] - 1), 1e-6)

    def test_starts_where_the_mesh_before_touched(self):
        """The second mesh of a refinement is that of a run with twice as many cells, which begins with pads that touch
        everywhere: the same state to rounding of a solve, in fewer steps of the active set (recorded: 3 for 5)."""
        coarse = {**LIFTING_BRAKE, "Discretization/Clamp layers": 0, "Discretization/Align rotor": "false",
                  "Discretization/Degree": 2, "Discretization/Rotor cells": "3, 18, 1",
                  "Discretization/Pad cells": "6, 12, 1", "Contact/Friction/Coefficient": 0.9,
                  "Eigenproblem/Maximum frequency": 400, "Eigenproblem/Error bars": "false"}
        fine = {**coarse, "Discretization/Rotor cells": "6, 36, 2", "Discretization/Pad cells": "12, 24, 2"}
        results = self.analyse({**fine, "Eigenproblem/Solver": "none"})
        cold, expected = self.steps((results / "log.txt").read_text()), st.read_table(results / "static.csv")
        results = self.analyse({**coarse, "Refinement/Strategy": "uniform", "Refinement/Cycles": 2})
        steps = self.steps((results / "log.txt").read_text())
        found = [row for row in st.read_table(results / "static.csv") if row["cycle"] == 1]
        self.assertEqual((len(steps), len(cold), len(found)), (2, 1, len(expected)))
        self.assertLess(steps[1], cold[0])
        for row, other in zip(found, expected):
            for name in ("normal_force_n", "friction_force_n", "contact_area_m2", "max_pressure_pa"):
                self.assertLess(abs(row[name] / other[name] - 1), 1e-9, name)

    @staticmethod
    def steps(log):
        """Steps of the active set of each mesh."""
        tables = log.split("Static equilibrium, active set:")[1:]
        return [len(re.match(r"\n +step .*\n((?: +\d+ +.*\n)+)", table)[1].splitlines()) for table in tables]

    def test_compliant_contact(self):
        """The active set settles where pressures have a compliance, too: those of closed contacts reach open ones."""
        settings = {**LIFTING_BRAKE, "Discretization/Degree": 2, "Contact/Formulation": "mortar_penalty",
                    "Contact/Penalty stiffness": 1e12, "Eigenproblem/Solver": "none", **LEVELS}
        results = self.analyse(settings)
        area = math.radians(50) * (0.14**2 - 0.09**2) / 2
        force = 1e6 * area
        for row in st.read_table(results / "static.csv"):
            self.assertLess(row["contact_area_m2"], 0.999 * area)
            self.assertLess(abs(row["normal_force_n"] - force), 1e-4 * force)

    def test_resumed(self):
        """A refinement that is killed goes on with the cells divided at the edge, and writes what the other writes."""
        settings = {**LIFTING_BRAKE, **LEVELS, "Refinement/Strategy": "adaptive", "Refinement/Cycles": 3,
                    "Refinement/Tolerance": 1e-4}
        expected = (self.analyse(settings) / "modes.csv").read_bytes()
        results = self.kill(settings, lambda directory: (directory / "refinement.state").exists())
        self.resume()
        self.assertEqual((results / "modes.csv").read_bytes(), expected)

    def test_refused(self):
        for settings, part in (
                ({"Contact/Steady pressure": "uniform"}, "no static equilibrium says where the pads touch"),
                (st.PENALTY, "without contact pressures as unknowns"),
                ({"Pads/Arrangement": "none"}, "there are no pads"),
                ({"Sweep/Parameter": "Operation/Angular velocity", "Sweep/Values": "1, 2"}, "the edge moves in a sweep")):
            file = self.write("refused.prm", {**LIFTING_BRAKE, **LEVELS, **settings})
            result = st.run("--check", file.name, directory=self.directory)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn("Refinement/Contact edge levels = 2: " + part, result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
