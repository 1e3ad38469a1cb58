"""Rotor/Transport = none: a rotor of any shape turns under sliding contact; what transport would do to its modes is left out.

A plain disc tells what that is (the table of doc/mesh.md), and takes both choices.
"""

import math
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

OMEGA = "Operation/Angular velocity"
NONE = {"Rotor/Transport": "none", "Output/Fields": "none", "Eigenproblem/Error bars": "false"}
# A pad that is pressed more at one end, so that forward is not backward.
BRAKE = {**NONE, "Discretization/Degree": 1, "Discretization/Rotor cells": "2, 12, 1",
         "Discretization/Pad cells": "1, 3, 1", "Discretization/Clamp layers": 0,
         "Pads/Pressure profile": "1 + 15*y", "Eigenproblem/Maximum frequency": 4500}
FALLING = {"Contact/Friction/Law": "falling", "Contact/Friction/Coefficient at speed": 0.4,
           "Contact/Friction/Decay speed": 1}


def holed_rotor():
    """The default brake with three holes through the rotor outside of the pads."""
    mesh = mesh_files.brake(rotor_cells=(3, 18, 1))
    rotor = mesh.volumes["rotor"]
    mesh.drop([rotor[k] for k in (3 * 6 + 1, 3 * 8 + 1, 3 * 12 + 1)])
    return mesh_files.msh2(mesh)


class WithoutTransport(st.TestCase):
    def test_table_of_the_plain_disc(self):
        """doc/mesh.md: the pairs of modes of n nodal diameters, which transport splits by 2 n Omega."""
        text = (st.PROJECT / "doc/mesh.md").read_text()
        lines = re.findall(r"^\| (\d) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$", text, re.M)
        self.assertEqual([int(line[0]) for line in lines], [1, 2, 3, 4, 5])
        speed = 100
        disc = {**NONE, "Stage": "transport", "Pads/Arrangement": "none", "Discretization/Degree": 2,
                "Discretization/Rotor cells": "3, 24, 1", OMEGA: speed, "Eigenproblem/Maximum frequency": 4000}
        without = [mode["frequency_hz"] for mode in self.modes(disc)]
        full = [mode["frequency_hz"] for mode in self.modes({**disc, "Rotor/Transport": "full"})]
        for n, frequency, low, high, expected in lines:
            n, frequency, low, high, expected = int(n), *map(float, (frequency, low, high, expected))
            with self.subTest(n=n):
                # Two at once, not split.
                self.assertEqual(sum(abs(f - frequency) <= 6e-3 for f in without), 2)
                for printed in (low, high):
                    self.assertEqual(sum(abs(f - printed) <= 6e-3 for f in full), 1)
                self.assertLessEqual(abs(expected - n * speed / math.pi), 6e-3)
                # In bending the Coriolis force on the small motion in the plane takes less than 1 % of the split; the
                # mean moves by terms of second order in n Omega/omega times that.
                self.assertLessEqual(abs(high - low - expected), 0.01 * expected)
                self.assertLessEqual(abs((high + low) / 2 - frequency), 0.2 * (n * speed / (2 * math.pi)) ** 2 / frequency)

    def test_rotor_with_holes(self):
        self.write("holes.msh", holed_rotor())
        case = {**NONE, **mesh_files.SCENE, "Mesh/File": "holes.msh", "Discretization/Degree": 1, "Stage": "full",
                "Eigenproblem/Maximum frequency": 4000}
        file = self.write("refused.prm", {**case, "Rotor/Transport": "full"})
        refused = st.run(file.name, directory=self.directory)
        self.assertEqual(refused.returncode, 2, refused.stderr)
        self.assertIn("body of revolution", refused.stderr)
        self.assertIn("Rotor/Transport = none", refused.stderr)

        prestressed = {**case, "Prestress/Centrifugal load": "true", "Prestress/Stress stiffness": "true",
                       "Prestress/Turning contact": "true", "Eigenproblem/Error bars": "true",
                       "Refinement/Strategy": "adaptive", "Refinement/Cycles": 2, "Refinement/Tolerance": 1e-4}
        results = self.analyse(prestressed)
        self.assertEqual(len(st.read_table(results / "cycles.csv")), 2)
        rows = st.read_table(results / "modes.csv")
        self.assertGreater(len(rows), 3)
        self.assertTrue(all(row["frequency_error_hz"] > 0 for row in rows))
        log = (results / "log.txt").read_text()
        self.assertIn("Rotor/Transport = none: friction slides with Omega", log)
        self.assertIn("n 3.183 Hz", log)
        shares = st.read_table(results / "contributions.csv")
        self.assertNotIn("transport", {row["origin"] for row in shares})
        damping = [row for row in shares if row["origin"] == "friction damping"]
        self.assertTrue(damping)
        # Without Q_R friction damping is P_R alone: it only damps.
        self.assertTrue(all(row["n_1_per_s2"] == 0 and row["d_1_per_s"] >= 0 for row in damping))
        page = subprocess.run([sys.executable, st.PROJECT / "scripts/report.py", results, "--modes", "0"],
                              capture_output=True, text=True, timeout=300)
        self.assertEqual(page.returncode, 0, page.stderr)
        self.assertIn("Neglected (Rotor/Transport = none)", (results / "report.html").read_text())

    def test_direction_is_a_sign_also_at_rest(self):
        """Turning backward is turning forward in the mirror y -> -y: at speed, slowly and at rest."""
        mirrored = {"Pads/Pressure profile": "1 - 15*y"}
        forward = self.eigenvalues({**BRAKE, OMEGA: 20})
        self.assertGreater(len(forward), 3)
        self.assertSameModes(self.eigenvalues({**BRAKE, **mirrored, OMEGA: -20}), forward, 1e-8)
        other = self.eigenvalues({**BRAKE, **mirrored, OMEGA: 20})
        self.assertGreater(max(abs(a - b) / abs(b) for a, b in self.pairs(other, forward)), 1e-5)

        # Friction alone knows the direction but not the speed.
        friction = {**BRAKE, "Stage": "friction"}
        backward = {"Operation/Direction at rest": "backward", OMEGA: 0}
        at_rest = self.eigenvalues({**friction, OMEGA: 0})
        self.assertSameModes(self.eigenvalues({**friction, OMEGA: 20}), at_rest, 1e-8)
        self.assertSameModes(self.eigenvalues({**friction, **mirrored, **backward}), at_rest, 1e-8)
        self.assertSameModes(self.eigenvalues({**friction, **mirrored, OMEGA: -1e-3}), at_rest, 1e-8)
        other = self.eigenvalues({**friction, **mirrored, OMEGA: 0})
        self.assertGreater(max(abs(a - b) / abs(b) for a, b in self.pairs(other, at_rest)), 1e-5)

    def test_sweep_through_zero(self):
        """Each value of a sweep is the run at that value; the direction turns round at zero."""
        friction = {**BRAKE, "Stage": "friction", "Operation/Direction at rest": "backward"}
        swept = self.analyse({**friction, "Sweep/Parameter": OMEGA, "Sweep/Values": "-20, 0, 20"})
        rows = st.read_table(swept / "sweep.csv")
        for value in (-20, 0, 20):
            at = [st.eigenvalue(row) for row in rows if row["parameter"] == value]
            self.assertSameModes(at, self.eigenvalues({**friction, OMEGA: value}), 1e-7)

    def test_derivative_by_speed(self):
        """d l/d Omega of falling friction and friction damping against a central difference."""
        case = {**BRAKE, **FALLING, "Prestress/Centrifugal load": "true", OMEGA: 10}
        results = self.analyse({**case, "Output/Sensitivities": "true"})
        rows = [row for row in st.read_table(results / "sensitivities.csv") if row["parameter"] == OMEGA]
        modes = st.read_table(results / "modes.csv")
        self.assertEqual(len(rows), len(modes))
        self.assertGreater(len(modes), 3)
        low, high = (self.modes({**case, OMEGA: 10 + h}) for h in (-0.01, 0.01))
        for row, a, b in zip(rows, low, high):
            difference = (b["growth_rate_1_per_s"] - a["growth_rate_1_per_s"]) / 0.02
            self.assertLessEqual(abs(row["d_growth_rate_1_per_s"] - difference), 1e-3 * abs(difference) + 1e-5)

    def test_vented_disc(self):
        """prm/vented_disc.prm, of degree 1, for the time."""
        if not shutil.which("gmsh"):
            self.skipTest("this test needs gmsh: scripts/install-dependencies.sh --mesh")
        mesh = self.directory / "vented_disc.msh"
        subprocess.run(["gmsh", "-3", st.PROJECT / "prm/vented_disc.geo", "-o", mesh], check=True,
                       stdout=subprocess.DEVNULL, timeout=120)
        result = st.run(st.PROJECT / "prm/vented_disc.prm", "--set", f"Mesh/File={mesh}", "--set", "Output/Fields=none",
                        "--set", "Discretization/Degree=1", "--set", "Eigenproblem/Error bars=false",
                        "--set", "Output/Directory=disc", directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("Neglected are", result.stdout)
        volume = float(re.search(r"body +rotor +1134 +([\d.]+)", result.stdout)[1])
        # Rings (mm): hub, hat, neck, two plates; vanes are 30 % of a ring. Cells of degree 1 are straight: their share of
        # the circle is sin(angle)/angle, with 0.3 of a pitch as one cell and 0.7 as two. In cm^3.
        pitch = 2 * math.pi / 21
        vane, channel = 0.3 * pitch, 0.35 * pitch
        ring = 21 * (math.sin(vane) + 2 * math.sin(channel)) / 2
        rings = [(35, 66, 6 * ring), (66, 72, 40 * ring), (72, 88, 8 * ring), (88, 140, 16 * ring),
                 (94, 134, 8 * 21 * math.sin(vane) / 2)]
        self.assertLessEqual(abs(volume / sum((b * b - a * a) * h / 1e3 for a, b, h in rings) - 1), 1e-5)
        self.assertGreater(len(st.read_table(self.directory / "disc/modes.csv")), 5)


if __name__ == "__main__":
    unittest.main(verbosity=2)
