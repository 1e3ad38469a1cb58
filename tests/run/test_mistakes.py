"""What users do wrong, one line each, and what they are told: the exit status and words of the message.

Most of it is a disc along another axis, pads in a wrong place, a name, a number, a unit. The brake has 24 and 4 cells in a
file in mm; what a warning needs no mesh for is in test_plausibility.
"""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

SMALL = {**mesh_files.SCENE, "Mesh/File": "small.msh", "Mesh/Scale": 1e-3, "Discretization/Degree": 1, "Output/Fields": "none",
         "Eigenproblem/Error bars": "false", "Eigenproblem/Maximum frequency": 4000}
PADS = ("upper", "lower")


def tilted(x, y, z, angle=0.05):
    return x * math.cos(angle) - z * math.sin(angle), y, z * math.cos(angle) + x * math.sin(angle)


# name of a file: where its nodes (mm) go, by body
MESHES = {
    "small": lambda body, x, y, z: (x, y, z),
    "gap": lambda body, x, y, z: (x, y, z + {"upper": 0.1, "lower": -0.1}.get(body, 0)),
    "gap5": lambda body, x, y, z: (x, y, z + {"upper": 5, "lower": -5}.get(body, 0)),
    "overlap": lambda body, x, y, z: (x, y, z - {"upper": 2, "lower": -2}.get(body, 0)),
    "flat": lambda body, x, y, z: (x, y, 0),
    "axisx": lambda body, x, y, z: (z, x, y),
    "axisy": lambda body, x, y, z: (y, z, x),
    "shifted": lambda body, x, y, z: (x + 100, y, z),
    "notplane": lambda body, x, y, z: (x, y, z + (x - 100) ** 2 / 2000 * (body in PADS)),
    "ecc": lambda body, x, y, z: (x + 3 * (body == "rotor"), y, z),
    "tilt": lambda body, x, y, z: tilted(x, y, z),
    "meters": lambda body, x, y, z: (x / 1e3, y / 1e3, z / 1e3),
}
# name: (settings, exit status, what the message says, what it must not say)
LINES = {
    "base": ({}, 0, "unstable (marked >)", "Warning"),
    "group": ({"Mesh/Rotor": "disc"}, 2, "there is no volume group 'disc'. Allowed are: lower, rotor, upper", ""),
    "scale": ({"Mesh/Scale": 1, "Eigenproblem/Solver": "none"}, 0, "Warning, size: the bodies extend over 300 m", ""),
    "noclamp": ({"Mesh/Clamped": ""}, 2, "the body 'rotor' can move rigidly in 6 ways", ""),
    "gap": ({"Mesh/File": "gap.msh"}, 2, "Mesh/Contact tolerance = 0.00011", "swap"),
    "gap5": ({"Mesh/File": "gap5.msh"}, 2, "are the bodies where they belong", "tolerance ="),
    "swap": ({"Mesh/Contact pairs": "rotor.high : upper.low, rotor.low : lower.high"}, 2,
             "allowed is pad surface : rotor surface", ""),
    "negp": ({"Pads/Pressure": -1e6}, 2, "not allowed. Allowed: A floating point number v such that 0 <= v", ""),
    "overlap": ({"Mesh/File": "overlap.msh"}, 2, "an overlap of 0.002 m", "tolerance ="),
    "flat": ({"Mesh/File": "flat.msh"}, 2, "it is folded or flat", ""),
    "axisx": ({"Mesh/File": "axisx.msh"}, 2, "It is plane across x of the file: Mesh/Axis = x?", ""),
    "axisx, done": ({"Mesh/File": "axisx.msh", "Mesh/Axis": "x"}, 0, "unstable (marked >)", "Warning"),
    "axisy": ({"Mesh/File": "axisy.msh"}, 2, "It is plane across y of the file: Mesh/Axis = y?", ""),
    "axis y for z": ({"Mesh/Axis": "y"}, 2, "It is plane across z of the file: Mesh/Axis = z?", ""),
    "rotor along x": ({"Mesh/File": "axisx.msh", "Mesh/Pads": "", "Mesh/Contact pairs": "", "Mesh/Guided": "", "Mesh/Pressure on": "",
                       "Mesh/Other volumes": "left_out"}, 2, "as wide in y as in z of the file: Mesh/Axis = x?", ""),
    "shifted": ({"Mesh/File": "shifted.msh"}, 2, "Mesh/Origin = 100, 0, 0, in the file's unit of length", ""),
    "shifted, in m": ({"Mesh/File": "shifted.msh", "Mesh/Origin": "0.1, 0, 0"}, 2, "Mesh/Origin = 100, 0, 0, in the file's", ""),
    "shifted, done": ({"Mesh/File": "shifted.msh", "Mesh/Origin": "100, 0, 0"}, 0, "unstable (marked >)", "Warning"),
    "mu60": ({"Contact/Friction/Coefficient": 60}, 3, "the brake is self-locking", ""),
    "nu6": ({"Pads/Material/Poisson ratio": 0.6}, 2, "it must lie between -1 and 0.5", ""),
    "noguide": ({"Mesh/Guided": ""}, 2, "can move rigidly in 3 ways (along x, along y, about z)", ""),
    "notplane": ({"Mesh/File": "notplane.msh"}, 2, "contact surfaces must be plane, across the axis z.", "Mesh/Axis ="),
    "ecc": ({"Mesh/File": "ecc.msh"}, 2, "Mesh/Origin = 3, 0, 0, in the file's unit of length", ""),
    "tilt": ({"Mesh/File": "tilt.msh"}, 2, "tilted by 2.86 degrees against the axis z", ""),
    "nopad": ({"Mesh/Pads": "upper, lower, third"}, 2, "there is no volume group 'third'", ""),
    "meters": ({"Mesh/File": "meters.msh"}, 0, "Warning, size: the bodies extend over 0.0003 m", "0 unstable"),
    "typo": ({"Contact/Friction/Coeficient": 0.5}, 2, "The nearest known key is 'Contact/Friction/Coefficient'", ""),
    "comma": ({"Contact/Friction/Coefficient": "0,5"}, 2, "Contact/Friction/Coefficient = 0,5: not allowed", ""),
    "path": ({"Friction": 0.5}, 2, "unknown key 'Friction'", ""),
    "step": ({"Mesh/File": "brake.stp"}, 2, "a geometry without a mesh: mesh it first", ""),
    "cdb": ({"Mesh/File": "brake.cdb"}, 2, "Write this mesh as one of these", ""),
    "crosspair": ({"Mesh/Contact pairs": "upper.low : rotor.low, lower.high : rotor.high"}, 2,
                  "'upper.low' lies in the plane of 'rotor.high': swap the pairs?", "tolerance ="),
    "minmax": ({"Eigenproblem/Minimum frequency": 5000}, 2, "it must be below Maximum frequency", ""),
    "friction": ({"Stage": "friction"}, 0, "unstable (marked >)", "Warning"),
    "still": ({"Operation/Angular velocity": 0}, 2, "has no value at rest", ""),
    "fast": ({"Operation/Angular velocity": 6000, "Eigenproblem/Maximum frequency": 9000}, 0,
             "Warning, speed: Operation/Angular velocity = 6000 rad/s", ""),
    "fast, backward": ({"Operation/Angular velocity": -6000, "Eigenproblem/Maximum frequency": 9000}, 0,
                       "Warning, speed: Operation/Angular velocity = -6000 rad/s", ""),
    "one": ({"Mesh/Pads": "upper", "Mesh/Contact pairs": "upper.low : rotor.high"}, 2, "cells have no material", ""),
    "memory": ({"Rotor/Material/Young modulus": 1150, "Eigenproblem/Maximum frequency": 1e5}, 3,
               "See to this first:\nWarning, units: Rotor/Material", ""),
}
# What is told before a mesh is read, or is no parameter: (arguments, exit status, words)
ARGUMENTS = {
    "noroot": (["--set", "Mesh/File=a"], 2, "A parameter file is needed"),
    "dash": (["it.prm", "-o", "out"], 2, "Unknown option -o"),
    "mu40 %": (["it.prm", "--check", "--set", "Contact/Friction/Coefficient=40"], 0, "Warning, friction: "),
    "mu60": (["it.prm", "--check", "--set", "Contact/Friction/Coefficient=60"], 0, "40 % are 0.4"),
    "loss 5 %": (["it.prm", "--check", "--set", "Pads/Material/Loss factor=5"], 0, "Warning, damping: Pads/Material/Loss factor = 5"),
    "ratio 2 %": (["it.prm", "--check", "--set", "Modal damping/Ratios=500 : 2"], 2, "allowed are ratios of critical damping from 0 to below 1"),
    "ratio 60 %": (["it.prm", "--check", "--set", "Modal damping/Ratios=500 : 0.6"], 0, "Warning, damping: Modal damping/Ratios"),
    "beta": (["it.prm", "--check", "--set", "Pads/Material/Stiffness proportional damping=0.01"], 0, "do not vibrate"),
    "viscosity": (["it.prm", "--check", "--set", "Pads/Material/Shear viscosity=1e308"], 0, "1e+308 Pa s: motions of 1000 Hz"),
    "penalty": (["it.prm", "--check", "--set", "Contact/Formulation=penalty", "--set", "Contact/Penalty stiffness=1000"], 0,
                "Warning, penalty: Contact/Penalty stiffness = 1000"),
    "brake in mm": (["it.prm", "--check", "--set", "Scene=brake", "--set", "Rotor/Outer radius=150", "--set",
                     "Rotor/Inner radius=50", "--set", "Pads/Outer radius=140", "--set", "Pads/Inner radius=90"], 0,
                    "Warning, size: Rotor/Outer radius = 150 m"),
    "hexadecimal": (["it.prm", "--check", "--set", "Mesh/Origin=0x1, 0, 0"], 2, "Mesh/Origin = 0x1, 0, 0: not allowed"),
    "hexadecimal tensor": (["it.prm", "--check", "--set", "Pads/Material/Viscosity tensor=0x9:1:1:9:1"], 2, "not allowed"),
}


class Mistakes(st.TestCase):
    def make_meshes(self):
        for name, move in MESHES.items():
            mesh = mesh_files.brake(rotor_cells=(2, 12, 1), pad_cells=(1, 4, 1))
            body = {v: group for group, cells in mesh.volumes.items() for c in cells for v in mesh.cells[c]}
            mesh.nodes = [move(body[v], *(1e3 * x for x in node)) for v, node in enumerate(mesh.nodes)]
            self.write(f"{name}.msh", mesh_files.msh2(mesh))

    def test_lines(self):
        self.make_meshes()
        for name, (settings, status, words, not_words) in LINES.items():
            with self.subTest(name):
                self.write("it.prm", {**SMALL, **settings})
                result = st.run("it.prm", "--overwrite", directory=self.directory)
                said = result.stdout + result.stderr
                self.assertEqual(result.returncode, status, said)
                self.assertIn(words, said)
                if not_words:
                    self.assertNotIn(not_words, said)

    def test_arguments(self):
        self.write("it.prm", SMALL)
        for name, (arguments, status, words) in ARGUMENTS.items():
            with self.subTest(name):
                result = st.run(*arguments, directory=self.directory)
                said = result.stdout + result.stderr
                self.assertEqual(result.returncode, status, said)
                self.assertIn(words, said)

    def test_shells(self):
        self.write("plate.inp", "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n*ELEMENT, TYPE=S4, ELSET=PLATE\n1, 1, 2, 3, 4\n")
        said = self.refusal({"Mesh/File": "plate.inp"})
        self.assertIn("Shells, membranes and beams are no bodies here", said)
        self.assertNotIn("Gmsh", said)

    def refusal(self, settings):
        self.write("it.prm", {**SMALL, **settings})
        result = st.run("it.prm", directory=self.directory)
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        return result.stderr

    def test_springs_of_a_deck(self):
        """Elements that the section Joints has in their place are not passed over."""
        mesh = mesh_files.brake(rotor_cells=(2, 12, 1), pad_cells=(1, 4, 1))
        lines = mesh_files.inp(mesh).split("\n")
        at = lines.index("*MATERIAL, NAME=STEEL")
        lines[at:at] = ["*ELEMENT, TYPE=SPRING1, ELSET=SOFT", f"{len(mesh.cells) + 1}, 1"]
        self.write("brake.inp", "\n".join(lines))
        settings = {**SMALL, "Mesh/File": "brake.inp", "Mesh/Scale": 1, "Eigenproblem/Solver": "none"}
        joints = {"Joints/Points": "p : upper.begin", "Joints/Springs": "p : ground : 1e3 1e3 1e3"}
        for more, words in (({}, "Warning, passed over: 1 elements of type SPRING1; Joints/Springs is empty"),
                            (joints, "1 elements of type SPRING1 are no volumes: Joints/Springs has 1 in their place")):
            self.write("it.prm", {**settings, **more})
            result = st.run("it.prm", "--overwrite", directory=self.directory)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(words, result.stdout)
            self.assertNotIn("Passed over", result.stdout)


class Matrices(st.TestCase):
    def write_matrix(self, name, diagonal):
        entries = "".join(f"{i} {i} {value}\n" for i, value in enumerate(diagonal, 1))
        self.write(name, f"%%MatrixMarket matrix coordinate real general\n{len(diagonal)} {len(diagonal)} {len(diagonal)}\n{entries}")

    def test_indefinite_stiffness(self):
        """What diverges is no rigid-body mode at zero frequency."""
        self.write_matrix("M.mtx", [1] * 40)
        self.write_matrix("K.mtx", [-1e4, -2e4, *(1e6 * i for i in range(3, 41))])
        self.write("it.prm", {"Scene": "matrices", "Matrices/Mass": "M.mtx", "Matrices/Stiffness": "K.mtx",
                              "Eigenproblem/Maximum frequency": 500})
        result = st.run("it.prm", directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("rigid-body modes at zero frequency", result.stdout)
        self.assertIn("2 modes of the reference problem have a stiffness of zero or less", result.stdout)

    def test_negative_masses(self):
        """A count that falls with the frequency is no number of modes."""
        self.write_matrix("M.mtx", [-1 if i % 3 == 0 else 1 for i in range(40)])
        self.write_matrix("K.mtx", [-1e6 * i for i in range(1, 41)])
        self.write("it.prm", {"Scene": "matrices", "Matrices/Mass": "M.mtx", "Matrices/Stiffness": "K.mtx",
                              "Eigenproblem/Maximum frequency": 500})
        result = st.run("it.prm", directory=self.directory)
        self.assertIn(result.returncode, (2, 3), result.stdout)
        self.assertNotIn("42949", result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
