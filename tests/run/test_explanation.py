"""Why a mode is unstable: Rayleigh coefficients, their split by origin, left vectors, sensitivities.

Expected: with x^H M x = 1 the coefficients of (30) are those of a scalar equation that l satisfies, so one root of (31)
is l to the accuracy of the solver. Its imaginary part makes the growth rate the sum of -(d w + n)/(2 w + g) over all
terms, or without oscillation its real part that of -(d + k/l). Energy: the internal forces of one body do no work on a conservative term.
"""

import math
import pathlib
import re
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

STAGES = ["elastic", "transport", "friction", "friction_damping", "full"]

# Two dimensions, less than a second; a load off the middle lifts a part of the block off.
STRIP = {
    "Scene": "strip",
    "Operation/Angular velocity": 2,
    "Discretization/Degree": 2,
    "Discretization/Rotor cells": "1, 24, 2",
    "Discretization/Pad cells": "1, 7, 2",
    "Eigenproblem/Maximum frequency": 36000,
    "Eigenproblem/Tolerance": 1e-10,
    "Rotor/Material/Mass proportional damping": 20,
    "Output/Fields": "none",
}
# Of the difference quotients, four whole runs for each parameter.
FEW_CELLS = {**STRIP, "Discretization/Rotor cells": "1, 12, 1", "Discretization/Pad cells": "1, 4, 1"}
FALLING = {"Contact/Friction/Law": "falling", "Contact/Friction/Coefficient": 0.5,
           "Contact/Friction/Coefficient at speed": 0.2, "Contact/Friction/Decay speed": 3}


class Explanation(st.TestCase):
    def test_rayleigh_coefficients(self):
        """Which of d, g, k, n are zero shows what the stage contains."""
        for stage in STAGES:
            for formulation in [st.MORTAR, st.PENALTY]:
                with self.subTest(stage=stage, **formulation):
                    directory = self.analyse({**st.SMALL_BRAKE, **formulation, "Stage": stage,
                                              "Eigenproblem/Error bars": "false"})
                    modes = st.read_table(directory / "modes.csv")
                    parts = st.read_table(directory / "contributions.csv")
                    self.assertGreater(len(modes), 10)
                    for mode in modes:
                        l = st.eigenvalue(mode)
                        size = abs(l)
                        d, g, k, n = (mode[key] for key in ["d_1_per_s", "g_1_per_s", "k_1_per_s2", "n_1_per_s2"])
                        self.assertLess(abs(l * l + complex(d, g) * l + complex(k, n)), 1e-8 * size**2)
                        if stage in ["elastic", "transport", "friction"]:
                            self.assertLess(abs(d), 1e-8 * size, "nothing is damped")
                        if stage in ["elastic", "transport"]:
                            self.assertLess(abs(n), 1e-8 * size**2, "nothing circulates")
                        if stage == "elastic":
                            self.assertLess(abs(g), 1e-8 * size, "nothing turns")
                            self.assertGreater(k, 0)
                        self.assertLess(mode["rayleigh_defect"], 1e-8)
                        self.assertLess(mode["left_backward_error"], 1e-9)
                        self.assertGreater(mode["condition_number"], 0.9)
                        own = [part for part in parts if part["mode"] == mode["mode"]]
                        growth = sum(part["growth_rate_1_per_s"] for part in own)
                        self.assertLess(abs(growth - mode["growth_rate_1_per_s"]), 1e-8 * size)
                        for key in ["d_1_per_s", "g_1_per_s"]:
                            self.assertLess(abs(sum(part[key] for part in own) - mode[key]), 1e-8 * size)
                        for key in ["k_1_per_s2", "n_1_per_s2"]:
                            self.assertLess(abs(sum(part[key] for part in own) - mode[key]), 1e-8 * size**2)
                        # What is conservative feeds nothing in, body by body where it is internal to a body.
                        for part in own:
                            if part["origin"] in ["elasticity", "transport"]:
                                self.assertLess(abs(part["growth_rate_1_per_s"]), 1e-8 * size)
                        contact = sum(part["growth_rate_1_per_s"] for part in own if part["origin"] == "contact")
                        self.assertLess(abs(contact), 1e-8 * size)
                        if stage in ["elastic", "transport"]:
                            # z = x, so that z^H Q'(l) x = j (2 w + g)
                            w = 2 * math.pi * mode["frequency_hz"]
                            self.assertLess(abs(mode["condition_number"] - 2 * w / (2 * w + mode["g_1_per_s"])),
                                            1e-6)

    def test_modes_that_do_not_oscillate(self):
        """l^2 + 0.3 s l + (4 - 5) s^2 grows without oscillating: l is the sum of -(d + k/l), a number of which there are
        digits in the log and on the page, however small the scale s. A damped oscillator stands beside it."""
        for scale in (1., 1e-7):
            stiffness, circulatory = 4 * scale ** 2, -5 * scale ** 2
            damping = 0.3 * scale
            diagonals = {"Mass": [1, 1], "Velocity": [damping, 0.01 * scale], "Stiffness": [stiffness, 9 * scale ** 2],
                         "Circulatory": [circulatory, 0]}
            for key, (first, second) in diagonals.items():
                self.write(f"{key}.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 2\n"
                           f"1 1 {first!r}\n2 2 {second!r}\n")
            directory = self.analyse({"Scene": "matrices", "Eigenproblem/Maximum frequency": scale,
                                      **{f"Matrices/{key}": f"{key}.mtx" for key in diagonals}})
            growth = scale * (-0.15 + math.sqrt(0.15 ** 2 + 1))
            parts = {row["origin"]: row["growth_rate_1_per_s"]
                     for row in st.read_table(directory / "contributions.csv") if row["mode"] == 1}
            expected = {"velocity matrix": -damping, "elasticity": -stiffness / growth, "friction": -circulatory / growth}
            self.assertEqual(parts.keys(), expected.keys())
            for origin, value in expected.items():
                self.assertLess(abs(parts[origin] - value), 1e-12 * abs(value), origin)
            log = (directory / "log.txt").read_text()
            why = re.search(r"Mode 1, growth rate (\S+) 1/s =(.*)", log)
            self.assertLess(abs(float(why.group(1)) - growth), 1e-4 * growth)
            shown = {origin: float(value) for value, origin in re.findall(r"([+-][\d.e-]+) ([a-z ]+?)(?= [+-]|$)", why.group(2))}
            self.assertEqual(shown.keys(), expected.keys())
            for origin, value in expected.items():
                self.assertLess(abs(shown[origin] - value), 1e-4 * abs(value), origin)
            listed = re.search(r"^>    1 +\S+ +(\S+) .*divergence$", log, re.MULTILINE)
            self.assertLess(abs(float(listed.group(1)) - growth), 1e-4 * growth)
            subprocess.run([sys.executable, st.PROJECT / "scripts/report.py", directory], check=True, capture_output=True)
            page = (directory / "report.html").read_text().replace("\N{MINUS SIGN}", "-")
            of_page = re.search(r"with (\S+) 1/s", page)
            self.assertLess(abs(float(of_page.group(1)) - growth), 1e-2 * growth)
            self.assertRegex(page, r"(?s)Why modes grow.*<th>elasticity</th><th>friction</th>")

    def test_bars(self):
        """Bars are made of their parts, and the part of a body is that of its mesh: smaller cells in the pads make theirs
        shorter, and leave that of the rotor."""
        parts = {}
        for name, cells in (("coarse", "2, 3, 1"), ("fine", "4, 6, 2")):
            directory = self.analyse({**st.SMALL_BRAKE, **st.MORTAR, "Stage": "full", "Output/Sensitivities": "true",
                                      "Operation/Angular velocity": 50, "Discretization/Degree": 2,
                                      "Discretization/Pad cells": cells})
            rows = st.read_table(directory / "bars.csv")
            for mode in st.read_table(directory / "modes.csv"):
                own = [row for row in rows if row["mode"] == mode["mode"]]
                whole = [(row["cause"], row["growth_rate_1_per_s"]) for row in own if not row["at"]]
                self.assertEqual([cause for cause, _ in whole[:2]], ["one degree more", "unlike parts of the mesh"])
                squares = sum(x ** 2 for cause, x in whole if cause.startswith(("one", "unlike", "edge")))
                others = sum(x for cause, x in whole if not cause.startswith(("one", "unlike", "edge")))
                # The solver's own error comes to it.
                self.assertLess(abs(math.sqrt(squares) + others - mode["growth_rate_error_1_per_s"]),
                                1e-3 * mode["growth_rate_error_1_per_s"] + 1e-4)
            self.assertEqual({row["at"] for row in rows if row["cause"] == "one degree more" and row["at"]},
                             {"rotor", "upper", "lower"})
            parts[name] = {at: sorted(row["frequency_hz"] for row in rows if row["at"] == at and row["cause"] == "one degree more")
                           for at in ("rotor", "upper")}
        middle = len(parts["fine"]["rotor"]) // 2
        self.assertLess(parts["fine"]["upper"][middle], 0.5 * parts["coarse"]["upper"][middle])
        self.assertLess(abs(parts["fine"]["rotor"][middle] / parts["coarse"]["rotor"][middle] - 1), 0.3)
        log = (directory / "log.txt").read_text()
        modes = st.read_table(directory / "modes.csv")
        told = [row for row in modes if row["verdict"] in ("flutter", "undecided")]
        self.assertTrue(told)
        bars, margins = (log.split(head)[1].split("\n\n")[0] for head in ("What the bars are made of", "The growth rate is zero"))
        sensitivities = st.read_table(directory / "sensitivities.csv")
        for mode in told:
            self.assertRegex(bars, rf"(?m)^  Mode {mode['mode']:g}, {mode['verdict']}, .* one degree more")
            changes = {row["parameter"]: -mode["growth_rate_1_per_s"] / row["relative_d_growth_rate_1_per_s"]
                       for row in sensitivities if row["mode"] == mode["mode"] and row["relative_d_growth_rate_1_per_s"]}
            nearest = sorted((abs(change), parameter) for parameter, change in changes.items() if abs(change) < 1)[:3]
            line = re.search(rf"(?m)^  Mode {mode['mode']:g}, {mode['verdict']}: (.*)$", margins).group(1)
            if not nearest:
                self.assertEqual(line, "no parameter within its double")
                continue
            shown = re.findall(r"(\S+(?: \S+)*?) ([+-][\d.e+-]+) %", line)
            self.assertEqual([parameter.lstrip(", ") for parameter, _ in shown], [parameter for _, parameter in nearest])
            for parameter, percent in shown:
                self.assertLess(abs(float(percent) - 100 * changes[parameter.lstrip(", ")]), 0.06 * abs(float(percent)) + 1e-9)
        subprocess.run([sys.executable, st.PROJECT / "scripts/report.py", directory], check=True, capture_output=True)
        self.assertIn("What the bars are made of", (directory / "report.html").read_text())

    def test_ladder(self):
        """All stages side by side: those of separate runs; undamped friction with a turning rotor is unstable."""
        directory = self.analyse({**st.SMALL_BRAKE, **st.MORTAR, "Stage": "ladder"})
        rows = st.read_table(directory / "ladder.csv")
        for stage in STAGES:
            own = [row for row in rows if row["stage"] == stage]
            self.assertSameModes([st.eigenvalue(row) for row in own],
                                 self.eigenvalues({**st.SMALL_BRAKE, **st.MORTAR, "Stage": stage}), 1e-8)
            if stage in ["elastic", "transport"]:
                self.assertEqual({row["verdict"] for row in own}, {"marginal"})
            if stage == "friction":
                self.assertIn("flutter", {row["verdict"] for row in own})

    def check_sensitivities(self, settings):
        directory = self.analyse({**settings, "Output/Sensitivities": "true"})
        base = st.read_table(directory / "modes.csv")
        table = st.read_table(directory / "sensitivities.csv")
        parameters = sorted({row["parameter"] for row in table})
        self.assertGreater(len(parameters), 6)
        for name in parameters:
            rows = [row for row in table if row["parameter"] == name]
            value = rows[0]["value"]
            if value == 0:
                continue
            # Five-point differences of the eigenvalues of whole runs.
            h = 2e-3 * value
            shifted = {}
            for k in [-2, -1, 1, 2]:
                run = self.eigenvalues({**settings, "Eigenproblem/Error bars": "false", name: repr(value + k * h)})
                shifted[k] = [a for a, _ in self.pairs(run, [st.eigenvalue(mode) for mode in base])]
            for j, row in enumerate(rows):
                quotient = (8 * (shifted[1][j] - shifted[-1][j]) - (shifted[2][j] - shifted[-2][j])) / (12 * h)
                computed = complex(row["d_growth_rate_1_per_s"], 2 * math.pi * row["d_frequency_hz"])
                size = abs(st.eigenvalue(base[j]))
                self.assertLessEqual(abs(computed - quotient) * value, 1e-5 * abs(quotient) * value + 1e-8 * size,
                                     f"{name}, mode {j + 1}: {computed}, by differences {quotient}")

    def test_sensitivities_mortar(self):
        self.check_sensitivities({**FEW_CELLS, **st.MORTAR})

    def test_sensitivities_penalty_falling(self):
        self.check_sensitivities({**STRIP, **FALLING, "Contact/Formulation": "penalty",
                                  "Contact/Penalty stiffness": 1e12})

    def test_sensitivities_uniform(self):
        self.check_sensitivities({**st.TINY_BRAKE, **st.MORTAR, "Contact/Steady pressure": "uniform",
                                  "Contact/Friction/Coefficient": 0.3, "Eigenproblem/Maximum frequency": 2000})

    def test_sensitivities_prestress(self):
        self.check_sensitivities({**FEW_CELLS, **st.MORTAR, "Prestress/Stress stiffness": "true",
                                  "Prestress/Turning contact": "true"})


if __name__ == "__main__":
    unittest.main(verbosity=2)
