"""Stability maps over two parameters: the grid, the traced border against closed forms, resumption after a kill.

prm/theory/ziegler_map.prm: det = 2 l^4 + 7 b l^3 + (7 - 2 p + b^2) l^2 + 2 b l + 1 is zero at l = j w for w^2 = 2/7 (odd
part) and p = 41/28 + b^2/2 (even part): the border for b > 0.

The same pendulum under a load of which a quarter follows the rod diverges at p = (3 - sqrt(11/3))/2 whatever b: the
velocity terms vanish at l = 0.
"""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

ZIEGLER_MAP = st.PROJECT / "prm/theory/ziegler_map.prm"
LOAD, DAMPING, FRICTION, SPEED = ("Matrices/Circulatory factor", "Matrices/Velocity factor", "Contact/Friction/Coefficient",
                                  "Operation/Angular velocity")
STRIP = {**st.COARSE_STRIP, "Contact/Friction/Coefficient": 0.6, "Contact/Steady pressure": "uniform"}
STRIP_MAP = {**STRIP, "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.3 : 0.7 : 3",
             "Sweep/Second parameter": "Operation/Angular velocity", "Sweep/Second values": "1 : 3 : 3"}


class StabilityMaps(st.TestCase):
    def ziegler(self, *overrides):
        results = self.directory / "ziegler"
        settings = [argument for override in overrides for argument in ("--set", override)]
        result = st.run(ZIEGLER_MAP, "--set", f"Output/Directory={results}", *settings, directory=st.PROJECT)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return st.read_table(results / "map.csv"), st.read_table(results / "border.csv")

    def assertPolyline(self, points, cell):
        """Pieces of at most half a cell of the grid."""
        for a, b in zip(points, points[1:]):
            length = math.hypot((a[LOAD] - b[LOAD]) / cell[0],
                                (a[DAMPING] - b[DAMPING]) / cell[1])
            self.assertLess(length, 0.5 + 1e-9)
            self.assertGreater(length, 0)

    def test_closed_form(self):
        grid, border = self.ziegler()
        self.assertEqual(len(grid), 16 * 13)
        for row in grid:
            p, b = row[LOAD], row[DAMPING]
            grows = p > 41 / 28 + b ** 2 / 2
            self.assertEqual((row["unstable_modes"], row["verdict"]), (1, "flutter") if grows else (0, "stable"), (p, b))
            self.assertEqual(row["growth_rate_1_per_s"] > 0, grows)
        self.assertEqual({row["curve"] for row in border}, {0}, "one curve, found once")
        for row in border:
            self.assertLess(abs(row[LOAD] - 41 / 28 - row[DAMPING] ** 2 / 2), 1e-8)
            self.assertLess(abs(2 * math.pi * row["frequency_hz"] - math.sqrt(2 / 7)), 1e-8)
            self.assertEqual(row["kind"], "flutter")
        ends = sorted(row[DAMPING] for row in border)
        self.assertEqual((ends[0], ends[-1]), (0.02, 1.22), "from edge to edge of the map")
        self.assertPolyline(border, (0.1, 0.1))

    def test_grid_point_on_the_border(self):
        """b = 0.5 and p = 41/28 + 1/8 are a point of the grid: the border runs through it, once."""
        on_border = 41 / 28 + 0.125
        grid, border = self.ziegler(f"Sweep/Values=1.2, 1.4, {on_border!r}, 1.8", "Sweep/Second values=0.25, 0.5, 0.75")
        self.assertEqual({row["curve"] for row in border}, {0})
        for row in border:
            self.assertLess(abs(row[LOAD] - 41 / 28 - row[DAMPING] ** 2 / 2), 1e-8)
        self.assertEqual({0.25, 0.75} - {row[DAMPING] for row in border}, set())

    def test_divergence(self):
        load = st.PROJECT / "prm/theory/quarter_follower_load.mtx"
        grid, border = self.ziegler(f"Matrices/Circulatory={load}", "Sweep/Values=0.1 : 1.1 : 6",
                                    "Sweep/Second values=0.1 : 0.4 : 4")
        expected = (3 - math.sqrt(11 / 3)) / 2
        self.assertEqual({(row["curve"], row["kind"]) for row in border}, {(0, "divergence")})
        for row in border:
            self.assertLess(abs(row[LOAD] - expected), 1e-10)
            self.assertEqual(row["frequency_hz"], 0)
        self.assertEqual({row["verdict"] for row in grid if row[LOAD] > expected}, {"divergence"})
        self.assertPolyline(border, (0.2, 0.1))

    def test_undamped_border_is_no_zero_of_the_growth_rate(self):
        """Without damping modes are marginal up to the coalescence: nothing to trace, and no failure."""
        grid, border = self.ziegler("Matrices/Velocity=", "Sweep/Second parameter=Operation/Angular velocity",
                                    "Sweep/Second values=1, 2")
        self.assertEqual(border, [])
        self.assertEqual({row["verdict"] for row in grid if row[LOAD] < 3.5 - math.sqrt(2)}, {"marginal"})

    def test_contact(self):
        """On a strip: growth changes its sign across every point of the border, and nowhere else."""
        directory = self.analyse(STRIP_MAP)
        grid, border = st.read_table(directory / "map.csv"), st.read_table(directory / "border.csv")
        self.assertEqual(len(grid), 9)
        self.assertGreater(len(border), 3)
        self.assertEqual({row["growth_rate_1_per_s"] > 0 for row in grid}, {True, False})
        for row in border[::3]:
            growth = []
            for factor in [1 - 1e-4, 1, 1 + 1e-4]:
                modes = self.eigenvalues({**STRIP, "Contact/Friction/Coefficient": repr(row[FRICTION] * factor),
                                          "Operation/Angular velocity": repr(row[SPEED])})
                own = min(modes, key=lambda l: abs(l.imag - 2 * math.pi * row["frequency_hz"]))
                growth.append(own.real)
            self.assertLess(growth[0] * growth[2], 0)
            self.assertLess(abs(growth[1]), 1e-5 * abs(growth[2] - growth[0]))

    def test_bars(self):
        """The points of the grid have nearly the bars of single runs; a finer mesh changes sign within the band."""
        case = {"Discretization/Degree": 2}
        directory = self.analyse({**STRIP_MAP, **case})
        grid, border = st.read_table(directory / "map.csv"), st.read_table(directory / "border.csv")
        self.assertEqual([(row[SPEED], row[FRICTION]) for row in grid],
                         [(speed, friction) for speed in (1, 2, 3) for friction in (0.3, 0.5, 0.7)], "sorted")
        for row in grid:
            modes = self.modes({**STRIP, **case, FRICTION: row[FRICTION], SPEED: row[SPEED]})
            worst = max(modes, key=lambda mode: mode["growth_rate_1_per_s"])
            longer = row["growth_rate_error_1_per_s"] / worst["growth_rate_error_1_per_s"]
            at_corner = row[FRICTION] != 0.5 and row[SPEED] != 2
            self.assertLess(abs(longer - 1), 0.01 if at_corner else 0.7, row)
            self.assertGreater(longer, 0.8, "not much shorter")
            self.assertEqual(row["verdict"], worst["verdict"])
            self.assertEqual(row["undecided_modes"], sum(mode["verdict"] == "undecided" for mode in modes))
        self.assertGreater(len(border), 3)
        fine = {**STRIP, "Discretization/Degree": 4, "Eigenproblem/Error bars": "false"}
        for row in border[::4]:
            self.assertGreater(row["mesh_error_cells"], 0)
            self.assertAlmostEqual(row["accuracy_cells"], row["search_error_cells"] + row["reduction_error_cells"], delta=1e-15)
            growth = [min(self.eigenvalues({**fine, FRICTION: repr(row[FRICTION] + sign * row["band_" + FRICTION]),
                                            SPEED: repr(row[SPEED] + sign * row["band_" + SPEED])}),
                          key=lambda l: abs(l.imag - 2 * math.pi * row["frequency_hz"])).real for sign in (-1, 1)]
            self.assertLess(growth[0], 0)
            self.assertGreater(growth[1], 0)

    def test_no_bars_across_rest(self):
        """Damping grows like 1/Omega there, and so do the effects of the mesh."""
        directory = self.analyse({**STRIP_MAP, "Sweep/Second values": "-1, 3"})
        self.assertIn("no error bars", (directory / "log.txt").read_text())
        self.assertEqual({row["growth_rate_error_1_per_s"] for row in st.read_table(directory / "map.csv")}, {None})

    def test_killed_and_resumed(self):
        whole = self.analyse(STRIP_MAP)
        n_grid = 1 + 3 * 3
        for n_lines in [4, n_grid]:  # on the grid; while the border is traced
            with self.subTest(killed_after=n_lines):
                results = self.kill(STRIP_MAP, lambda results: (results / "map.csv").exists() and
                                    (results / "map.csv").read_text().count("\n") >= n_lines)
                self.assertTrue((results / "map.state").exists())
                self.resume()
                for name in ["map.csv", "border.csv"]:
                    self.assertEqual((whole / name).read_text(), (results / name).read_text())
                self.assertFalse((results / "map.state").exists())

    def test_bad_maps(self):
        for change, part in [({"Sweep/Second parameter": "Rotor/Thickness"}, "keeps the mesh"),
                             ({"Sweep/Second parameter": "Contact/Friction/Coefficient"}, "another one"),
                             ({"Sweep/Second parameter": "Contact/Friction/Coeficient"}, "Contact/Friction/Coefficient"),
                             ({"Sweep/Second values": "1, x"}, "Sweep/Second values"),
                             ({"Sweep/Second values": "1"}, "at least two"),
                             ({"Sweep/Parameter": "none"}, "Sweep/Parameter is needed"),
                             ({"Sweep/Critical values": "true"}, "border")]:
            with self.subTest(**change):
                self.assertSettingsRefused({**STRIP_MAP, **change}, part)


if __name__ == "__main__":
    unittest.main(verbosity=2)
