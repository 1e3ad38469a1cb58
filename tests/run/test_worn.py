"""Contact/Steady pressure = worn: bedded-in pads, whose pressure has a closed form (theory.md, section 3).

The digits are those of a program of its own on the exact sectors; cells of degree 3 that are curved leave the last ones.
"""

import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

WORN = {"Contact/Steady pressure": "worn"}
FRICTION, SPEED_EXPONENT = "Contact/Friction/Coefficient", "Contact/Wear/Speed exponent"
STATIC = {**st.SMALL_BRAKE, **WORN, "Discretization/Degree": 3, "Discretization/Pad cells": "2, 6, 1",
          "Eigenproblem/Solver": "none"}
SMALL = {**st.DENSE_BRAKE, **WORN}


class Pressure(st.TestCase):
    def numbers(self, directory, pad="upper"):
        """A, B, C of the log."""
        line = re.search(rf"Worn pad {pad}: p = .*", (directory / "log.txt").read_text()).group()
        return [float(number) for number in re.findall(r"[ABC] = (\S+?)[, ]", line + " ")]

    def assertNear(self, value, expected, tolerance):
        self.assertLessEqual(abs(value - expected), tolerance * abs(expected), (value, expected))

    def test_digits(self):
        for exponent, numbers, largest, radius in [
                (1, (3.262672e4, 7.3953317e5, -9.7785671e5), 1.446024e6, 0.11629763),
                (0, (1.2357194e6, -2.083428e6, -8.2407361e6), 1.458944e6, 0.11639781)]:
            with self.subTest(exponent=exponent):
                directory = self.analyse({**STATIC, SPEED_EXPONENT: exponent})
                for number, expected in zip(self.numbers(directory), numbers):
                    self.assertNear(number, expected, 1e-5)
                for pad in st.read_table(directory / "static.csv"):
                    self.assertNear(pad["max_pressure_pa"], largest, 1e-5)
                    self.assertNear(pad["friction_torque_nm"], pad["friction_force_n"] * radius, 1e-6)
                    self.assertIsNone(pad["max_penetration_m"])
                    if exponent == 0:
                        self.assertNear(pad["friction_torque_nm"], 350.437745, 1e-6)

    def test_mesh_pads(self):
        """Pads of a file, of one material or layered, have the pressure of sectors as thick as they are together."""
        cells = {"Discretization/Pad cells": "2, 3, 1", "Discretization/Align rotor": "false", "Discretization/Clamp layers": 0}
        expected = self.numbers(self.analyse({**STATIC, **cells}))
        self.write("brake.msh", mesh_files.msh2(mesh_files.brake()))
        self.write("layered.msh", mesh_files.msh2(mesh_files.brake(pad_cells=(2, 3, 2), plate_layers=1)))
        plates = {"Mesh/Part 1/Volumes": "upper.plate, lower.plate", "Mesh/Part 1/Body": "pads"}
        for file, parts in (("brake.msh", {}), ("layered.msh", plates)):
            directory = self.analyse({**STATIC, **cells, **mesh_files.SCENE, **parts, "Mesh/File": file})
            for pad in ("upper.low", "lower.high"):
                for number, of_sectors in zip(self.numbers(directory, pad), expected):
                    self.assertNear(number, of_sectors, 1e-8)

    def test_one_free_motion(self):
        """A pad that springs hold but for the axial motion: uniform wear, p = A/r, A = p_back (r_i + r_o)/2."""
        self.write("brake.msh", mesh_files.msh2(mesh_files.brake()))
        directory = self.analyse({**STATIC, **mesh_files.SCENE, "Mesh/File": "brake.msh", "Mesh/Guided": "upper.high",
                                  "Joints/Points": "back : lower.low",
                                  "Joints/Springs": "back : ground : 1e8 1e8 0 1e5 1e5 1e5"})
        A, B, C = self.numbers(directory, "lower.high")
        self.assertNear(A, 1e6 * 0.115, 1e-5)
        self.assertLess(max(abs(B), abs(C)), 1e-6 * A / 0.1)
        forces = [pad["normal_force_n"] for pad in st.read_table(directory / "static.csv")]
        self.assertNear(*forces, 1e-9)

    def test_new(self):
        """A pad that has not slid is a new one, to the last bit."""
        new = {**SMALL, "Contact/Wear/Sliding distance": 0}
        computed = {**SMALL, "Contact/Steady pressure": "computed"}
        runs = [self.analyse(settings) for settings in (new, computed)]
        for name in ("modes.csv", "static.csv"):
            self.assertEqual(*[(run / name).read_text() for run in runs])

    def test_ranks(self):
        runs = [self.analyse(SMALL, ranks=ranks) for ranks in (1, 3)]
        for name in ("modes.csv", "static.csv"):
            rows, others = (st.read_table(run / name) for run in runs)
            self.assertEqual(len(rows), len(others))
            for row, other in zip(rows, others):
                for key in ("growth_rate_1_per_s", "frequency_hz", "normal_force_n", "friction_torque_nm", "max_pressure_pa"):
                    if row.get(key) is not None:
                        self.assertLessEqual(abs(row[key] - other[key]), 1e-8 * abs(other[key]) + 1e-6)

    def test_studies(self):
        """The worn pressure follows friction: each value of a sweep has the modes of a run of its own. It is no uniform one."""
        rows = st.read_table(self.analyse({**SMALL, "Sweep/Parameter": FRICTION, "Sweep/Values": "0.2, 0.5"}) / "sweep.csv")
        for value in (0.2, 0.5):
            own = self.eigenvalues({**SMALL, FRICTION: value, "Eigenproblem/Solver": "dense"})
            self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == value], own, 1e-7)
        uniform = self.eigenvalues({**SMALL, "Contact/Steady pressure": "uniform", "Eigenproblem/Solver": "dense"})
        worn = self.eigenvalues({**SMALL, "Eigenproblem/Solver": "dense"})
        self.assertGreater(max(abs(a - b) for a, b in self.pairs(worn, uniform)), 1e-3)

    def test_sensitivities(self):
        settings = {**SMALL, "Contact/Friction/Coefficient": 0.4}
        directory = self.analyse({**settings, "Output/Sensitivities": "true"})
        base, table = st.read_table(directory / "modes.csv"), st.read_table(directory / "sensitivities.csv")
        for name in (FRICTION, SPEED_EXPONENT):
            rows = [row for row in table if row["parameter"] == name]
            self.assertEqual(len(rows), len(base), name)
            h = 1e-3 * rows[0]["value"]
            low, high = ([l for l, _ in self.pairs(self.eigenvalues({**settings, name: repr(rows[0]["value"] + step)}),
                                                   list(map(st.eigenvalue, base)))] for step in (-h, h))
            for a, b, row, mode in zip(low, high, rows, base):
                quotient = (b - a) / (2 * h)
                computed = complex(row["d_growth_rate_1_per_s"], 2 * 3.141592653589793 * row["d_frequency_hz"])
                self.assertLessEqual(abs(computed - quotient), 1e-4 * abs(quotient) + 1e-7 * abs(st.eigenvalue(mode)), name)

    def test_worn_free(self):
        """A load on one end: the other is worn free, its contact is open, the log says so; the profile acts."""
        directory = self.analyse({**STATIC, "Discretization/Degree": 2, "Pads/Pressure profile": "1 - 20*y"})
        self.assertIn("Warning, worn free", (directory / "log.txt").read_text())
        upper, _ = st.read_table(directory / "static.csv")
        closed, _ = st.read_table(self.analyse({**STATIC, "Discretization/Degree": 2}) / "static.csv")
        self.assertLess(upper["contact_area_m2"], 0.95 * closed["contact_area_m2"])
        self.assertNear(upper["normal_force_n"], closed["normal_force_n"], 1e-9)

    def test_ages(self):
        """From new to worn: pressures tend to those of the closed form, monotonically."""
        settings = {**st.TINY_BRAKE, **WORN, "Contact/Wear/Speed exponent": 0, "Contact/Wear/Coefficient": 1e-14,
                    "Eigenproblem/Solver": "none", "Discretization/Pad cells": "2, 4, 1"}
        limit = st.read_table(self.analyse(settings) / "static.csv")
        new = st.read_table(self.analyse({**settings, "Contact/Steady pressure": "computed"}) / "static.csv")
        distances = []
        for distance in (1e2, 1e4, 1e8):
            rows = st.read_table(self.analyse({**settings, "Contact/Wear/Sliding distance": distance}) / "static.csv")
            distances.append(abs(rows[0]["friction_torque_nm"] / limit[0]["friction_torque_nm"] - 1))
            largest = rows[0]["max_pressure_pa"]
        self.assertEqual(distances, sorted(distances, reverse=True))
        self.assertLess(distances[-1], 1e-6)
        self.assertNear(largest, limit[0]["max_pressure_pa"], 1e-5)
        self.assertGreater(new[0]["max_pressure_pa"], 1.2 * largest)

    def test_wear_of_an_age(self):
        """wear.csv: what is lost is k times force times distance, as long as all speeds count alike; another load for it."""
        settings = {**st.TINY_BRAKE, **WORN, "Contact/Wear/Speed exponent": 0, "Eigenproblem/Solver": "none",
                    "Contact/Wear/Sliding distance": 1e6, "Contact/Wear/Pressure": 2e6, "Operation/Angular velocity": 1}
        directory = self.analyse(settings)
        last = st.read_table(directory / "wear.csv")[-1]
        force = 2 * st.read_table(directory / "static.csv")[-1]["normal_force_n"]
        self.assertEqual(last["sliding_distance_m"], 1e6)
        mean_radius = 1e-14 * force * 1e6 / last["worn_volume_m3"]  # dt = ds/(Omega r_m)
        self.assertNear(mean_radius, 2 / 3 * (0.14**3 - 0.09**3) / (0.14**2 - 0.09**2), 1e-3)

    def test_fields(self):
        directory = self.analyse({**STATIC, "Discretization/Degree": 2, "Eigenproblem/Solver": "krylov",
                                  "Eigenproblem/Maximum frequency": 1500, "Eigenproblem/Error bars": "false",
                                  "Output/Fields": "unstable"})
        self.assertTrue((directory / "contact-0.pvtu").exists(), list(directory.iterdir()))

    def test_refused(self):
        for settings, words in [
                ({"Pads/Back face": "fixed"}, ["Pads/Back face = fixed", "guided"]),
                ({"Pads/Back face": "free"}, ["Pads/Back face = free", "guided"]),
                ({"Contact/Wear/Sliding distance": "long"}, ["Contact/Wear/Sliding distance", "infinite"]),
                ({"Contact/Wear/Pressure exponent": 2, "Contact/Wear/Sliding distance": 10}, ["Pressure exponent", "infinite"]),
                ({"Contact/Wear/Sliding distance": 10, "Output/Sensitivities": "true"}, ["Sensitivities", "infinite"]),
                ({"Contact/Wear/Pressure": 3e5}, ["Contact/Wear/Pressure", "finite"]),
                ({"Prestress/Stress stiffness": "true"}, ["Steady pressure = worn", "computed"])]:
            with self.subTest(**settings):
                self.assertSettingsRefused({**SMALL, **settings}, *words)

    def test_held_by_springs(self):
        """A pad that a spring presses back has nowhere to go: it wears until it carries nothing."""
        self.write("brake.msh", mesh_files.msh2(mesh_files.brake(rotor_cells=(2, 12, 1), pads=("upper",))))
        self.assertSettingsRefused(
            {**SMALL, **mesh_files.SCENE, "Mesh/File": "brake.msh", "Mesh/Pads": "upper", "Mesh/Guided": "upper.high",
             "Mesh/Contact pairs": "upper.low : rotor.high", "Mesh/Pressure on": "upper.high",
             "Joints/Points": "back : upper.high", "Joints/Springs": "back : ground : 0 0 1e6 1e3 1e3 0"},
            "upper.low", "carries nothing")


if __name__ == "__main__":
    unittest.main(verbosity=2)
