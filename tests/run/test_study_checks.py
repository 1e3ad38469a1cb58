"""What a sweep, a map or samples make of a parameter passes the checks of a run of its own, and gives its modes.

Every key that may vary is moved in a sample of a brake of 156 unknowns and in a run of its own by LAPACK: a key that the
model does not follow, or follows in part, shows as another mode. What a run of its own refuses is refused before anything
is computed.
"""

import json
import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

BRAKE = st.DENSE_BRAKE
# Values away from which every number has an effect
VARIED = {
    "Operation/Angular velocity": 20,
    "Contact/Formulation": "penalty",
    "Contact/Penalty stiffness": 1e12,
    "Contact/Normal dashpot": 1e4,
    "Contact/Tangential dashpot": 1e4,
    "Contact/Initial gap": 1e-7,
    "Contact/Friction/Law": "falling",
    "Contact/Friction/Coefficient": 0.5,
    "Contact/Friction/Coefficient at speed": 0.4,
    "Contact/Friction/Decay speed": 1.5,
    "Contact/Friction/Smoothing speed": 0.3,
    "Pads/Pressure": 1e6,
    "Rotor/Material/Young modulus": 1.2e11,
    "Rotor/Material/Poisson ratio": 0.25,
    "Rotor/Material/Density": 7200,
    "Rotor/Material/Mass proportional damping": 2,
    "Rotor/Material/Stiffness proportional damping": 1e-7,
    "Pads/Material/Law": "transversely_isotropic",
    "Pads/Material/Young modulus": 1e10,
    "Pads/Material/Poisson ratio": 0.2,
    "Pads/Material/Axial Young modulus": 3e9,
    "Pads/Material/Axial Poisson ratio": 0.2,
    "Pads/Material/Axial shear modulus": 2e9,
    "Pads/Material/Density": 2500,
    "Pads/Material/Mass proportional damping": 5,
    "Pads/Material/Stiffness proportional damping": 1e-6,
    "Pads/Material/Bulk viscosity": 3e3,
    "Pads/Material/Shear viscosity": 3e3,
}
# With a function of the frequency: every value has its full solution.
RELAXED = {
    "Contact/Friction/Coefficient": 0.5,
    "Modal damping/Ratios": "500 : 0.01, 3000 : 0.02",
    "Modal damping/Factor": 1,
    "Pads/Material/Loss factor": 0.05,
    "Pads/Pressure": 1e6,
}
# Pads that are worn out, and on the way there
WORN = {"Contact/Steady pressure": "worn", "Contact/Friction/Coefficient": 0.5, "Contact/Wear/Pressure exponent": 1.5,
        "Contact/Wear/Speed exponent": 0.8, "Pads/Pressure": 1e6}
AGED = {"Contact/Steady pressure": "worn", "Contact/Wear/Coefficient": 1e-14, "Contact/Wear/Sliding distance": 100,
        "Contact/Wear/Speed exponent": 0.8, "Contact/Wear/Pressure": 2e6}
# Not in those: of the scene matrices, without effect here, or other ways to say the same
NOT_THERE = ("Matrices/", "Mesh/Part ", "Operation/Temperature", "Viscosity", "viscosity", "Zener", "Loss factor", "Axial ")


def numbers_of_studies():
    """The keys with numbers that samples may vary, as the program lists them."""
    keys = []

    def collect(node, path):
        for name, child in node.items():
            if not isinstance(child, dict):
                continue
            words = [*path, name.replace("_20", " ")]
            if "pattern_description" in child:
                if child["pattern_description"].startswith(("[Double", "[Integer")):
                    keys.append("/".join(words))
            else:
                collect(child, words)

    collect(json.loads(st.run("--print-parameters=json").stdout), [])
    starts = ("Operation/", "Contact/", "Rotor/Material/", "Pads/Material/", "Mesh/Part ", "Matrices/", "Modal damping/")
    return [key for key in keys if key.startswith(starts) or key == "Pads/Pressure"]


class EveryKey(st.TestCase):
    def worst(self, settings):
        return max(self.eigenvalues({**settings, "Eigenproblem/Solver": "dense"}), key=lambda l: l.real)

    def compare(self, settings, keys, size):
        """Each sample moves some of the keys by a tenth. A key that is not followed is one that its group shows."""
        groups = [keys[i:i + size] for i in range(0, len(keys), size)]
        moved = [{key: settings[key] * 1.1 for key in group} for group in groups]
        self.write("samples.csv", "\n".join([",".join(keys), *(
            ",".join(repr({**settings, **change}[key]) for key in keys) for change in moved)]) + "\n")
        rows = st.read_table(self.analyse({**settings, "Sampling/File": "samples.csv"}) / "samples.csv")
        for change, row in zip(moved, rows):
            with self.subTest(keys=list(change)):
                own = self.worst({**settings, **change})
                self.assertLess(abs(st.eigenvalue(row) - own), 1e-7 * abs(own))

    def test_samples(self):
        keys = [key for key, value in VARIED.items() if isinstance(value, (int, float))]
        self.compare({**BRAKE, **VARIED}, keys, 5)

    def test_samples_of_relaxation(self):
        self.compare({**BRAKE, **RELAXED}, ["Modal damping/Factor", "Pads/Material/Loss factor",
                                            "Contact/Friction/Coefficient", "Pads/Pressure"], 2)

    def test_samples_of_worn_pads(self):
        for settings in (WORN, AGED):
            self.compare({**BRAKE, **settings}, [key for key, value in settings.items() if not isinstance(value, str)], 1)

    def test_all_are_there(self):
        """A new key that may vary must come into the lists above."""
        for key in numbers_of_studies():
            self.assertTrue(any(key in keys for keys in (VARIED, RELAXED, WORN, AGED)) or any(word in key for word in NOT_THERE), key)

    def test_load(self):
        """A load that is zero in the file, and the profile of a load, in sweeps."""
        for settings, parameter, values in [({"Pads/Pressure": 0}, "Pads/Pressure", [1e6]),
                                            ({"Contact/Friction/Law": "falling"}, "Pads/Pressure profile", [8])]:
            settings = {**BRAKE, "Contact/Friction/Coefficient": 0.5, **settings}
            rows = st.read_table(self.analyse({**settings, "Sweep/Parameter": parameter,
                                               "Sweep/Values": str(values)[1:-1]}) / "sweep.csv")
            for value in values:
                with self.subTest(parameter=parameter, value=value):
                    self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == value],
                                         self.eigenvalues({**settings, parameter: value, "Eigenproblem/Solver": "dense"}),
                                         1e-7)

    def test_pressures_of_surfaces(self):
        """Mesh/Pressures/surface, in a sweep, in samples and by its derivative, against runs of their own."""
        self.write("small.msh", mesh_files.msh2(mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1))))
        base = {**mesh_files.SCENE, "Mesh/File": "small.msh", "Mesh/Pressure on": "", "Discretization/Degree": 1,
                "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Error bars": "false", "Output/Fields": "none",
                "Contact/Friction/Law": "expression", "Contact/Friction/Expression": "0.6-1e-7*p"}
        low, high = "Mesh/Pressures/lower.low", "Mesh/Pressures/upper.high"
        def own(lower, upper):
            return {**base, "Mesh/Pressures": f"upper.high : {upper!r}, lower.low : {lower!r}"}

        settings = own(1e6, 2e6)
        rows = st.read_table(self.analyse({**settings, "Sweep/Parameter": low, "Sweep/Values": "1e6, 3e6"}) / "sweep.csv")
        expected = self.eigenvalues({**own(3e6, 2e6), "Eigenproblem/Solver": "dense"})
        self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == 3e6], expected, 1e-7)
        self.write("samples.csv", f"\ufeff{low},{high}\n3e6,2e6\n1e6,2.5e6\n")
        rows = st.read_table(self.analyse({**settings, "Sampling/File": "samples.csv"}) / "samples.csv")
        for row, pressures in zip(rows, [(3e6, 2e6), (1e6, 2.5e6)]):
            worst = self.worst(own(*pressures))
            self.assertLess(abs(st.eigenvalue(row) - worst), 1e-7 * abs(worst))
        directory = self.analyse({**settings, "Output/Sensitivities": "true"})
        h, modes = 1e4, [st.eigenvalue(row) for row in st.read_table(directory / "modes.csv")]
        shifted = [[a for a, _ in self.pairs(self.eigenvalues(own(1e6 + k * h, 2e6)), modes)] for k in (1, -1)]
        table = [row for row in st.read_table(directory / "sensitivities.csv") if row["parameter"] == low]
        self.assertEqual(len(table), len(modes))
        for row, plus, minus, mode in zip(table, *shifted, modes):
            computed = complex(row["d_growth_rate_1_per_s"], 2 * math.pi * row["d_frequency_hz"])
            self.assertLess(abs(computed - (plus - minus) / (2 * h)) * 1e6, 1e-3 * abs(computed) * 1e6 + 1e-8 * abs(mode))
        for wrong, words in [("upper.high", "not a pair"), ("upper.high : many", "not a number"), ("nowhere : 1e6", "nowhere"),
                             ("upper.high : 1, upper.high : 2", "twice"), ("upper.low : 1e6", "contact")]:
            with self.subTest(wrong):
                self.assertSettingsRefused({**settings, "Mesh/Pressures": wrong}, words)
        self.assertSettingsRefused({**settings, "Contact/Steady pressure": "uniform"}, "Mesh/Pressures", "computed")
        self.assertSettingsRefused({**settings, "Sweep/Parameter": "Mesh/Pressures/back", "Sweep/Values": "1, 2"}, "upper.high, lower.low")

    def refused(self, settings, *words):
        """A study ends with status 2 before it has written a table."""
        self.assertSettingsRefused(settings, *words)
        self.assertFalse([*self.directory.glob("**/samples.csv"), *self.directory.glob("**/sweep.csv")])

    def test_refused(self):
        """What a run of its own refuses, at one value of a study."""
        self.write("edge.csv", "Contact/Friction/Coefficient\n0.3\n0.4\n")
        self.write("twice.csv", "Operation/Angular velocity,Operation/Angular velocity\n20,30\n")
        for settings, words in [
                ({"Sampling/File": "edge.csv", "Refinement/Contact edge levels": 1}, ["Contact edge levels"]),
                ({"Sampling/File": "edge.csv", "Eigenproblem/Solver": "block_davidson", "Discretization/Degree": 2},
                 ["block_davidson"]),
                ({"Sampling/File": "twice.csv"}, ["Operation/Angular velocity", "twice"]),
                ({"Pads/Pressure profile": "1 + 20*y", "Contact/Steady pressure": "uniform"}, ["Pressure profile"]),
                ({"Sweep/Parameter": "Operation/Angular velocity", "Sweep/Values": "20, 0"}, ["Value 2", "at rest"]),
                ({"Sweep/Parameter": "Operation/Angular velocity", "Sweep/Values": "20, 10, 0",
                  "Sweep/Second parameter": "Contact/Friction/Coefficient", "Sweep/Second values": "0.1, 0.2"}, ["Point 3"]),
                ({"Sweep/Parameter": "Output/Superelement", "Sweep/Values": "1, 2"}, ["do not depend on it"]),
                ({"Sweep/Parameter": "Mesh/Rotor", "Sweep/Values": "1, 2"}, ["not a number"])]:
            with self.subTest(**settings):
                self.refused({**BRAKE, **settings}, *words)
        for number, words in (("0x1p-2", "not a number"), ("0.4\0", "NUL")):
            self.write("number.csv", f"Contact/Friction/Coefficient\n{number}\n0.4\n")
            with self.subTest(number=number):
                self.refused({**BRAKE, "Sampling/File": "number.csv"}, words)
        self.refused({**BRAKE, "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0x1p-2, 0.5"}, "Values")

    def test_disc_with_a_notch(self):
        """Samples, sweeps and maps of the speed of a disc that is no body of revolution and rests in the file."""
        mesh = mesh_files.brake(rotor_cells=(2, 12, 1), pads=("upper",))
        self.write("brake.msh", mesh_files.msh2(mesh))
        self.write("speeds.csv", "Operation/Angular velocity\n20\n100\n")
        speed = {"Sweep/Parameter": "Operation/Angular velocity", "Sweep/Values": "20, 100"}
        disc = {**mesh_files.SCENE, "Mesh/File": "brake.msh", "Mesh/Pads": "upper", "Mesh/Contact pairs": "upper.low : rotor.high",
                "Mesh/Guided": "upper.high", "Mesh/Pressure on": "upper.high", "Stage": "friction", "Discretization/Degree": 1,
                "Mesh/Curved bodies": "none", "Operation/Angular velocity": 0, "Output/Fields": "none",
                "Eigenproblem/Error bars": "false", "Eigenproblem/Maximum frequency": 3000}
        for study in [{"Sampling/File": "speeds.csv"}, speed,
                      {**speed, "Sweep/Second parameter": "Contact/Friction/Coefficient", "Sweep/Second values": "0.1, 0.2"}]:
            self.refused({**disc, **study}, "body of revolution")

    def test_part_alone(self):
        """Its material is checked and used without pads and joints."""
        mesh = mesh_files.Mesh()
        mesh.sector("bar", mesh_files.equal(0.09, 0.14, 1), mesh_files.equal(0.4, 0.7, 2), mesh_files.equal(0.006, 0.018, 1))
        self.write("bar.msh", mesh_files.msh2(mesh))
        self.write("table.csv", """frequency_hz,storage_modulus_pa,loss_factor
100,1.0070516706981646e10,0.0436
300,1.05015486564845e10,0.1030
600,1.1189162834100029e10,0.1282
1200,1.192313440085555e10,0.1316
2500,1.2762947256649277e10,0.1377
5000,1.3814554930340763e10,0.1210
12000,1.4698946164226444e10,0.0670
""")
        material = "Mesh/Part 1/Material/"
        bar = {"Scene": "mesh", "Mesh/File": "bar.msh", "Mesh/Rotor": "", "Mesh/Clamped": "bar.begin", "Mesh/Part 1/Volumes": "bar",
               "Mesh/Part 1/Body": "parts", material + "Young modulus": 1e10, material + "Density": 2000,
               material + "Stiffness proportional damping": 0, "Discretization/Degree": 2, "Eigenproblem/Maximum frequency": 7000,
               "Eigenproblem/Error bars": "false", "Output/Fields": "none"}
        for settings, word in [({material + "Loss factor": -0.1}, "Loss factor"),
                               ({material + "Poisson ratio": 0.6}, "Poisson ratio"),
                               ({material + "Loss factor": 0.05, "Output/Superelement": "bar : bar.end"}, "Superelement"),
                               ({material + "Bulk viscosity": 1e5, "Eigenproblem/Solver": "block_davidson"}, "viscosity")]:
            with self.subTest(**settings):
                self.refused({**bar, **settings}, word)
        # A point on a surface changes nothing; with it joints were known to use the material.
        table = {**bar, material + "Modulus table": "table.csv"}
        alone = self.eigenvalues(table)
        self.assertLess(max(l.real for l in alone), -1)
        self.assertSameModes(alone, self.eigenvalues({**table, "Joints/Points": "p : bar.end"}), 1e-8)


if __name__ == "__main__":
    unittest.main(verbosity=2)
