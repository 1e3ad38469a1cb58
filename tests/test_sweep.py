"""Sweeps: the same modes as separate runs, branches, critical values, resumption after a kill.

Critical values of small matrices against closed forms: test_theory_scenes.py. Here on meshes: at rest without damping the
modes are marginal until two of them coalesce, so just below the critical friction no mode grows and just above one does;
near it the growth rate follows the square root, Re l = c sqrt(mu - mu_c).
"""

import math
import signal
import subprocess
import time
import unittest

import squeal_testing as st

AT_REST = {
    **st.SMALL_BRAKE,
    "Stage": "friction",
    "Operation/Angular velocity": 0,
    "Contact/Steady pressure": "uniform",
    "Eigenproblem/Maximum frequency": 2000,
}
FRICTION = "Contact/Friction/Coefficient"


class Sweeps(st.TestCase):
    def test_coalescence(self):
        directory = self.analyse({**AT_REST, **st.PENALTY, "Sweep/Parameter": FRICTION, "Sweep/Values": "0 : 0.4 : 5",
                                  "Sweep/Critical values": "true"})
        critical = [row for row in st.read_table(directory / "critical.csv") if row["kind"] == "coalescence"]
        self.assertGreater(len(critical), 0)
        mu_c = critical[0]["value"]
        self.assertLess(critical[0]["accuracy"], 1e-6 * mu_c)
        growth = {}
        for factor in [1 - 1e-4, 1 + 1e-4, 1 + 4e-4]:
            modes = self.eigenvalues({**AT_REST, **st.PENALTY, FRICTION: repr(mu_c * factor)})
            mode = max(modes, key=lambda l: l.real)
            growth[factor] = mode.real
            if factor > 1:
                self.assertLess(abs(mode.imag / (2 * math.pi) - critical[0]["frequency_hz"]), 1e-3 * mode.imag)
        self.assertLess(growth[1 - 1e-4], 1e-5)
        self.assertGreater(growth[1 + 1e-4], 1e-2)
        self.assertLess(abs(growth[1 + 4e-4] / growth[1 + 1e-4] - 2), 1e-2)

    def test_points_and_branches(self):
        settings = {**st.SMALL_BRAKE, **st.MORTAR, "Eigenproblem/Maximum frequency": 4000}
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
                settings = {**st.SMALL_BRAKE, **st.MORTAR, "Eigenproblem/Maximum frequency": 2000}
                directory = self.analyse({**settings, "Sweep/Parameter": name, "Sweep/Values": values})
                last = float(values.split(",")[1])
                own = [st.eigenvalue(r) for r in st.read_table(directory / "sweep.csv") if r["parameter"] == last]
                self.assertSameModes(own, self.eigenvalues({**settings, name: last}), 1e-8)

    def test_ranks(self):
        """One and two ranks: the same branches and eigenvalues."""
        settings = {"Scene": "strip", "Operation/Angular velocity": 2, "Discretization/Rotor cells": "1, 24, 2",
                    "Discretization/Pad cells": "1, 7, 2", "Eigenproblem/Maximum frequency": 36000,
                    "Output/Fields": "none", "Sweep/Parameter": FRICTION, "Sweep/Values": "0.2, 0.4, 0.6"}
        one, two = (st.read_table(self.analyse(settings, ranks=ranks) / "sweep.csv") for ranks in (1, 2))
        self.assertEqual([(row["parameter"], row["branch"]) for row in one],
                         [(row["parameter"], row["branch"]) for row in two])
        for a, b in zip(one, two):
            self.assertLess(abs(st.eigenvalue(a) - st.eigenvalue(b)), 1e-8 * abs(st.eigenvalue(a)))

    def test_killed_and_resumed(self):
        settings = {**st.SMALL_BRAKE, **st.MORTAR, "Eigenproblem/Maximum frequency": 2000, "Sweep/Parameter": FRICTION,
                    "Sweep/Values": "0.1 : 0.4 : 7", "Sweep/Critical values": "true"}
        whole = self.analyse(settings)
        file = self.write("killed.prm", settings)
        process = subprocess.Popen([str(st.SQUEAL), file.name], cwd=self.directory, env=st.ENVIRONMENT,
                                   stdout=subprocess.DEVNULL)
        table = self.directory / "output/killed/sweep.csv"
        state = self.directory / "output/killed/sweep-0.state"
        deadline = time.monotonic() + 120
        while not state.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        process.wait()
        self.assertTrue(state.exists())
        with open(table, "a") as half:  # a line that was cut
            half.write("0.3,2,0,1")
        result = st.run(file.name, directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("Resumed after", result.stdout)
        for name in ["sweep.csv", "critical.csv"]:
            self.assertEqual((whole / name).read_text(), (table.parent / name).read_text())
        self.assertFalse(state.exists())

    def test_bad_sweeps(self):
        for settings, part in [({"Sweep/Parameter": "Rotor/Thicknes", "Sweep/Values": "1, 2"}, "Rotor/Thickness"),
                               ({"Sweep/Parameter": "Rotor/Thickness", "Sweep/Values": "1, 2"}, "keeps the mesh"),
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
