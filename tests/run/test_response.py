"""The frequency response: closed forms of a bar and a beam, modal against direct, ranks, what is refused."""

import cmath
import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402
import test_joints as joints  # noqa: E402

# A square bar along x, held at one end, beside a disc without pads. nu = 0: a bar is one-dimensional then.
LENGTH, SIDE, CELLS = 0.4, 0.01, (16, 1, 1)
YOUNG, DENSITY, ALPHA, BETA = 2.1e11, 7850., 20., 2e-7
BAR = {**joints.OnSprings.SETTINGS, "Stage": "full", "Operation/Angular velocity": 0, "Discretization/Degree": 3,
       "Mesh/Part 1/Volumes": "bar", "Mesh/Part 1/Body": "parts", "Mesh/Curved bodies": "rotor",
       "Mesh/Clamped": "rotor.inner, bar.inner", "Mesh/Part 1/Material/Young modulus": YOUNG,
       "Mesh/Part 1/Material/Poisson ratio": 0, "Mesh/Part 1/Material/Density": DENSITY,
       "Mesh/Part 1/Material/Mass proportional damping": ALPHA,
       "Mesh/Part 1/Material/Stiffness proportional damping": BETA, "Joints/Points": "end : bar.outer", "Eigenproblem/Maximum frequency": 4000,
       "Eigenproblem/Error bars": "false"}
BRAKE = {"Discretization/Rotor cells": "2, 18, 1", "Discretization/Pad cells": "2, 3, 1", "Discretization/Degree": 2,
         "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Error bars": "false", "Output/Fields": "none",
         "Pads/Material/Stiffness proportional damping": 1e-6, "Contact/Friction/Coefficient": 0.4,
         "Pads/Pressure": 1e6, "Response/Forces": "rotor 0.14 0.01 0.002 : 0.3 0 1, upper_pad.back : 0 0 2",
         "Response/Observations": "upper_pad.back : 0 0 1, rotor -0.12 0.03 0 : 0 3 0, lower_pad.side : 1 1 0"}


def bar(frequency, axial):
    """The motion of the end under a force of 1 N there, along the bar or across (Euler and Bernoulli)."""
    w, area, inertia = 2 * math.pi * frequency, SIDE**2, SIDE**4 / 12
    young, square = YOUNG * (1 + 1j * w * BETA), w * w - 1j * w * ALPHA
    if axial:
        k = cmath.sqrt(DENSITY * square / young)
        return cmath.tan(k * LENGTH) / (young * area * k)
    x = (DENSITY * area * square / (young * inertia))**0.25 * LENGTH
    return (LENGTH**3 / (young * inertia) * (cmath.sin(x) * cmath.cosh(x) - cmath.cos(x) * cmath.sinh(x)) /
            (x**3 * (1 + cmath.cos(x) * cmath.cosh(x))))


class Response(st.TestCase):
    def response(self, settings, **options):
        """By frequency, force, observation: the value and the printed error."""
        directory = self.analyse(settings, **options)
        rows = st.read_table(directory / "response.csv")
        for row in rows:
            value = complex(row["real_m"], row["imaginary_m"])
            self.assertAlmostEqual(abs(value) / row["amplitude_m"], 1, 9)
            self.assertAlmostEqual(cmath.phase(value), math.radians(row["phase_deg"]), 9)
        return {(row["frequency_hz"], int(row["force"]), int(row["observation"])):
                (complex(row["real_m"], row["imaginary_m"]), row["interpolation_error_m"]) for row in rows}

    def write_bar(self, alone=False):
        mesh = mesh_files.Mesh() if alone else mesh_files.brake(rotor_cells=(2, 12, 1), pads=())
        mesh.sector("bar", mesh_files.equal(1, 1 + LENGTH, CELLS[0]), mesh_files.equal(-0.02, 0.02, CELLS[1]),
                    mesh_files.equal(0, SIDE, CELLS[2]))
        mesh.nodes = [x if math.hypot(x[0], x[1]) < 0.5 else
                      (math.hypot(*x[:2]) - 0.8, SIDE * math.atan2(x[1], x[0]) / 0.04, x[2]) for x in mesh.nodes]
        self.write("brake.msh", mesh_files.msh2(mesh))

    def test_bar_and_beam(self):
        """Along the bar exact but for the elements, across as good as the theory of slender beams; a surface, and a point
        on it, where nothing varies over the surface. Modal and direct."""
        self.write_bar()
        place = f"{0.2 + LENGTH} 0 {SIDE / 2}"
        for method, frequencies in [("direct", "40, 900, 3000"), ("modal", "40 : 3400 : 120")]:
            with self.subTest(method):
                values = self.response({**BAR, "Response/Forces": f"bar.outer : 2 0 0, end : 0 0 1, {place} : 0 1 0",
                                        "Response/Observations": f"{place} : 5 0 0, bar.outer : 0 0 1, bar {place} : 0 1 0",
                                        "Response/Frequencies": frequencies, "Response/Method": method})
                self.assertEqual(len(values), (3 if method == "direct" else 120) * 9)
                for (frequency, force, observation), (value, error) in values.items():
                    axial, across = 2 * bar(frequency, True), bar(frequency, False)
                    if force == observation == 1:
                        self.assertLessEqual(abs(value - axial), 2e-6 * abs(axial) + error)
                    elif force == observation:
                        # Shear and the inertia of rotation, and what a force at a point does around it
                        self.assertLessEqual(abs(value - across) if frequency == 40 or 80 < frequency < 150 else 0,
                                             4e-3 * abs(across) + error)
                    else:
                        self.assertLessEqual(abs(value), 1e-7 * max(abs(axial), abs(across)) + error)

    def test_part_alone(self):
        """The bar without a disc: the same modes and response as beside one; free, with six rigid-body motions, those of
        its mass at low frequencies and the bar's free frequencies."""
        self.write_bar()
        response = {"Response/Forces": "bar.outer : 1 0 0", "Response/Frequencies": "40, 900, 3000", "Response/Method": "direct"}
        window = {**BAR, **response, "Output/Fields": "all", "Output/Animation frames": 0}
        beside = self.response(window)
        everything = self.eigenvalues(window)
        self.write_bar(alone=True)
        alone = {**window, "Mesh/Rotor": "", "Joints/Points": "", "Mesh/Clamped": "bar.inner"}
        for key, (value, _) in self.response(alone).items():
            self.assertLessEqual(abs(value - beside[key][0]), 1e-9 * abs(value))
        modes = self.modes(alone)
        self.assertEqual({row["shape"] for row in modes}, {None})
        # Left over from the file with the disc
        self.write_bar()
        left_over = self.modes({**alone, "Mesh/Other volumes": "left_out"})
        self.assertSameModes([st.eigenvalue(row) for row in left_over], [st.eigenvalue(row) for row in modes], 1e-12)
        self.assertSettingsRefused(alone, "Mesh/Other volumes = left_out")
        self.write_bar(alone=True)
        for row in modes:
            value = st.eigenvalue(row)
            self.assertLessEqual(min(abs(value - other) for other in everything), 1e-8 * abs(value))
        free = {**alone, "Mesh/Clamped": "", "Response/Frequencies": "20 : 3900 : 100", "Response/Method": "modal"}
        directory = self.analyse(free)
        self.assertIn("6 rigid-body modes", (directory / "log.txt").read_text())
        rows = st.read_table(directory / "response.csv")
        mass = DENSITY * LENGTH * SIDE**2
        w = 2 * math.pi * 20
        rigid = 1 / (mass * (-w * w + 1j * w * ALPHA))
        self.assertLessEqual(abs(complex(rows[0]["real_m"], rows[0]["imaginary_m"]) - rigid), 1e-4 * abs(rigid))
        for row in rows:  # cot(kL) with the same k as that of the held bar
            w = 2 * math.pi * row["frequency_hz"]
            young = YOUNG * (1 + 1j * w * BETA)
            k = cmath.sqrt(DENSITY * (w * w - 1j * w * ALPHA) / young)
            exact = -1 / (young * SIDE**2 * k * cmath.tan(k * LENGTH))
            self.assertLessEqual(abs(complex(row["real_m"], row["imaginary_m"]) - exact),
                                 2e-6 * abs(exact) + 1e-12 + row["interpolation_error_m"])

    def test_axis_of_a_material(self):
        """A bar that is stiff along its axis only, the x axis: motions along it are those of that modulus."""
        self.write_bar(alone=True)
        material = "Mesh/Part 1/Material/"
        case = {**BAR, "Mesh/Rotor": "", "Joints/Points": "", "Mesh/Clamped": "bar.inner", "Response/Forces": "bar.outer : 2 0 0",
                "Response/Observations": "bar.outer : 1 0 0", "Response/Frequencies": "40, 900, 3000", "Response/Method": "direct",
                material + "Law": "transversely_isotropic", material + "Axis": "x", material + "Young modulus": 0.1 * YOUNG,
                material + "Axial Young modulus": YOUNG, material + "Axial shear modulus": 0.05 * YOUNG}
        for (frequency, _, _), (value, _) in self.response(case).items():
            exact = 2 * bar(frequency, True)
            self.assertLessEqual(abs(value - exact), 1e-5 * abs(exact))
        for (frequency, _, _), (value, _) in self.response({**case, material + "Axis": "z"}).items():
            self.assertGreater(abs(value - 2 * bar(frequency, True)), abs(value) / 3)
        self.assertSettingsRefused({"Rotor/Material/Axis": "x"}, "Rotor/Material/Axis", "allowed is z")

    def test_modal_and_direct(self):
        """Every difference is within the printed error, in halves, with hysteresis, on two ranks; and reciprocity where
        nothing turns."""
        for name, changes in [("steady", {}), ("hysteresis", {"Pads/Material/Loss factor": 0.02}),
                              ("free", {"Rotor/Clamped boundary": "none", "Stage": "elastic"})]:
            settings = {**BRAKE, **changes}
            with self.subTest(name):
                modal = self.response({**settings, "Response/Frequencies": "150 : 3800 : 100"})
                some = sorted({key[0] for key in modal})[3::24]
                direct = self.response({**settings, "Response/Frequencies": ", ".join(map(repr, some)),
                                        "Response/Method": "direct"})
                self.assertEqual(len(direct), 6 * len(some))
                for key, (value, error) in direct.items():
                    self.assertEqual(error, 0)
                    size = max(abs(other) for (f, k, j), (other, _) in direct.items() if (k, j) == key[1:])
                    self.assertLessEqual(abs(value - modal[key][0]), modal[key][1] + 1e-9 * size)
                    if name != "free" or key[0] > 1000:  # it falls like 1/w^2
                        self.assertLess(modal[key][1], 1e-3 * size)
        ranks = self.response({**BRAKE, "Response/Frequencies": "150 : 3800 : 100"}, ranks=2)
        alone = self.response({**BRAKE, "Response/Frequencies": "150 : 3800 : 100"})
        for key, (value, error) in alone.items():
            self.assertLessEqual(abs(value - ranks[key][0]), 2 * error)
        still = self.response({**BRAKE, "Stage": "elastic", "Response/Frequencies": "500, 2500", "Response/Method": "direct",
                               "Eigenproblem/Solver": "none", "Response/Observations": "", "Response/Forces":
                               "rotor  0.14  0.01 0.002 : 0 0 1, upper_pad.back : 0 0 1"})
        for frequency in (500, 2500):
            there, back = still[frequency, 1, 2][0], still[frequency, 2, 1][0]
            self.assertLessEqual(abs(there - back), 1e-7 * abs(there))

    def test_growth_is_told(self):
        directory = self.analyse({**BRAKE, "Response/Frequencies": "1000, 1100", "Response/Method": "direct",
                                  "Contact/Friction/Coefficient": 0.9})
        grows = any(row["growth_rate_1_per_s"] > 0 for row in st.read_table(directory / "modes.csv"))
        self.assertEqual(grows, "the steady state does not last" in (directory / "log.txt").read_text())
        self.assertTrue(grows)

    def test_refused(self):
        for changes, words in [({"Response/Forces": "rotor 0.14 0 0 : 0 0 0"}, "not all zero"),
                               ({"Response/Forces": "rotor 0.14 0 : 0 0 1"}, "there is no surface"),
                               ({"Response/Forces": "0.12 0 0.006 : 0 0 1"}, "rotor and upper have this point"),
                               ({"Response/Forces": "upper 0.12 0 0 : 0 0 1"}, "'upper' does not have this point"),
                               ({"Response/Forces": "disc 0.12 0 0 : 0 0 1"}, "allowed are rotor, upper, lower"),
                               ({"Response/Forces": "pad : 0 0 1"}, "allowed are lower_pad.back"),
                               ({"Response/Forces": ""}, "allowed with Response/Forces only"),
                               ({"Response/Frequencies": "100 : 4100 : 5"}, "Method = direct"),
                               ({"Response/Frequencies": "0, 100"}, "above 0 Hz"),
                               ({"Response/Frequencies": "1 : x"}, "a range first : last : number"),
                               ({"Eigenproblem/Solver": "none"}, "allowed is direct"),
                               ({"Eigenproblem/Solver": "block_davidson"}, "there are no matrices"),
                               ({"Stage": "ladder"}, "a response for each stage"),
                               ({"Sweep/Parameter": "Pads/Pressure", "Sweep/Values": "1e6, 2e6"}, "a response for each value")]:
            with self.subTest(str(changes)):
                self.assertSettingsRefused({**BRAKE, **changes}, words)


if __name__ == "__main__":
    unittest.main(verbosity=2)
