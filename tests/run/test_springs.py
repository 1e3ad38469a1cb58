"""Springs and dashpots in given axes, and what a dashpot takes from a beam (theory.md, section 11)."""

import json
import math
import pathlib
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402
import test_joints as joints  # noqa: E402
import test_matrix_export as export  # noqa: E402

SETTINGS = joints.OnSprings.SETTINGS
# A beam of 0.4 m, 0.04 m wide and 0.03 m high, held at one end; far from the disc.
LENGTH, WIDTH, HEIGHT, CELLS = 0.4, 0.04, 0.03, (8, 2, 3)
BEAM = {**SETTINGS, "Mesh/Part 1/Volumes": "beam", "Mesh/Part 1/Body": "parts", "Mesh/Curved bodies": "rotor",
        "Mesh/Clamped": "rotor.inner, beam.inner", "Eigenproblem/Maximum frequency": 4000,
        "Joints/Points": "tip : beam.outer",
        # Dashpots belong to the stage full; the material has no loss of its own.
        "Stage": "full", "Mesh/Part 1/Material/Stiffness proportional damping": 0}

# The beam alone from its exported matrices, with what springs and dashpots add to it: the tip moves by b^T u, the mean
# of the displacement over its face, b_a = int N_a dA / A, and K = k e b b^T e^T, C likewise for each axis e. The dense
# solver of numpy takes the linearised problem, with time in units of 1/w.
UPDATE = """
import csv, json, sys
import numpy, scipy.io
directory, springs, dampers, axes, weights = json.loads(sys.stdin.read())
M, Q = (scipy.io.mmread(f"{directory}/{name}.mtx").tocsr() for name in "MQ")
with open(f"{directory}/unknowns.csv") as file:
    rows = [row for row in csv.DictReader(file) if row["body"] == "beam"]
number = [int(row["row"]) for row in rows]
M, Q = (A[number][:, number].toarray() for A in (M, Q))
P = numpy.zeros_like(Q)
b = numpy.zeros((len(rows), 3))
for i, row in enumerate(rows):
    weight = weights.get(",".join(f"{float(row[c]) + 1:.6f}" for c in ("x_m", "y_m", "z_m")), 0)
    b[i, "xyz".index(row["component"])] = weight
assert abs(b.sum() - 3) < 1e-12
for k, c, e in zip(springs, dampers, numpy.array(axes)):
    Q += k * numpy.outer(b @ e, b @ e)
    P += c * numpy.outer(b @ e, b @ e)
w, n = 1e4, len(rows)
inverse = numpy.linalg.inv(M)
A = numpy.block([[numpy.zeros((n, n)), numpy.eye(n)], [-inverse @ Q / w**2, -inverse @ P / w]])
l = w * numpy.linalg.eigvals(A)
print(json.dumps([[x.real, x.imag] for x in l if 0 < x.imag < 2 * numpy.pi * 4000]))
"""


class Springs(st.TestCase):
    def assertContains(self, computed, expected, tolerance):
        for value in expected:
            nearest = min(computed, key=lambda l: abs(l - value))
            self.assertLessEqual(abs(nearest - value), tolerance * abs(value), (value, computed))

    def test_mass_on_oblique_springs(self):
        """Six oscillators along and about three axes: with one mass and a spherical inertia k/m and k_r/I stay what they
        are in any axes; with y' and z' alike one axis is enough."""
        self.write("brake.msh", mesh_files.msh2(mesh_files.brake(rotor_cells=(2, 12, 1), pads=())))
        m, inertia = 2.5, 0.02
        for k, axes in [((1e6, 2e6, 3e6, 2e4, 5e4, 7e4), "1 2 2 0 1 0"), ((1e6, 2e6, 2e6, 2e4, 5e4, 5e4), "0.1 -0.3 7")]:
            settings = {**SETTINGS, "Joints/Points": "weight : 0.3 0.1 0.2",
                        "Joints/Masses": f"weight : {m} {inertia} {inertia} {inertia}",
                        "Joints/Springs": f"weight : ground : {' '.join(map(str, k))} : {axes}"}
            expected = [complex(0, math.sqrt(k[i] / (m if i < 3 else inertia))) for i in range(6)]
            self.assertContains(self.eigenvalues(settings), expected, 1e-9)

    def test_loss_through_a_point_on_a_beam(self):
        """Springs and dashpots in oblique axes at the end of a beam: frequencies, and the growth rates, which are the
        loss, of the beam's exported matrices with the tip's three functionals added by hand."""
        python = export.python_with_scipy()
        if not python:
            self.skipTest("the independent solution needs scipy (Debian: python3-scipy)")
        mesh = mesh_files.brake(rotor_cells=(2, 12, 1), pads=())
        mesh.sector("beam", mesh_files.equal(1, 1 + LENGTH, CELLS[0]), mesh_files.equal(-0.02, 0.02, CELLS[1]),
                    mesh_files.equal(0, HEIGHT, CELLS[2]))
        mesh.nodes = [x if math.hypot(x[0], x[1]) < 0.5 else
                      (math.hypot(*x[:2]) - 0.8, WIDTH * math.atan2(x[1], x[0]) / 0.04, x[2]) for x in mesh.nodes]
        self.write("brake.msh", mesh_files.msh2(mesh))
        alone = self.analyse({**BEAM, "Joints/Points": "tip : beam.outer", "Output/Matrices": "true"})
        # The mean of bilinear functions on equal faces: a corner of a face has a quarter of it.
        weights = {}
        for j in range(CELLS[1] + 1):
            for k in range(CELLS[2] + 1):
                y, z = WIDTH * (j / CELLS[1] - 0.5), HEIGHT * k / CELLS[2]
                parts = (1 if 0 < j < CELLS[1] else 0.5) * (1 if 0 < k < CELLS[2] else 0.5)
                place = ",".join(f"{x + 1:.6f}" for x in (0.2 + LENGTH, y, z))
                weights[place] = parts / (CELLS[1] * CELLS[2])
        axes = [[1 / 3, 2 / 3, 2 / 3], [-2 / 45**0.5, 5 / 45**0.5, -4 / 45**0.5], [-2 / 5**0.5, 0, 1 / 5**0.5]]
        springs, dampers = (1e6, 5e6, 2e6), (300, 120, 40)
        out = subprocess.run([python, "-c", UPDATE], input=json.dumps([str(alone), springs, dampers, axes, weights]),
                             env=st.ENVIRONMENT, capture_output=True, text=True, timeout=120)
        self.assertEqual(out.returncode, 0, out.stderr)
        expected = [complex(*value) for value in json.loads(out.stdout)]
        self.assertGreater(len(expected), 4)
        text = {name: "tip : ground : " + " ".join(map(str, values)) + " : 1 2 2 0 1 0"
                for name, values in [("Joints/Springs", springs), ("Joints/Dashpots", dampers)]}
        computed = self.eigenvalues({**BEAM, **text})
        n_damped = 0
        for value in expected:
            nearest = min(computed, key=lambda l: abs(l - value))
            self.assertLessEqual(abs(nearest - value), 1e-8 * abs(value))
            # The mean of the face does not move in torsion, which has no loss.
            if value.real < -0.1:
                n_damped += 1
                self.assertLessEqual(abs(nearest.real - value.real), 1e-6 * abs(value.real))
        self.assertGreater(n_damped, 3)
        # The axes matter.
        turned = self.eigenvalues({**BEAM, **{key: value.replace("1 2 2 0", "2 1 2 0") for key, value in text.items()}})
        self.assertGreater(max(min(abs(l - value) / abs(value) for l in turned) for value in expected), 1e-3)

    def test_refused(self):
        self.write("brake.msh", mesh_files.msh2(mesh_files.brake(rotor_cells=(2, 12, 1), pads=())))
        point = {"Joints/Points": "weight : 0.3 0.1 0.2", "Joints/Masses": "weight : 1 1 1 1"}
        good = "weight : ground : 1e6 1e6 2e6 1 1 2"
        for changed, words in [(": 0 0 0", "x' and a vector"), (": 1 0 0 2 0 0", "x' and a vector"), (": 1 0", "x' and a vector"),
                               (": 1 0 nan", "x' and a vector"), (": 1 0 0", "must be equal"), (": 1 0 0 : 1", "is not point")]:
            with self.subTest(changed):
                self.assertSettingsRefused({**SETTINGS, **point, "Joints/Springs": good + changed}, words)


if __name__ == "__main__":
    unittest.main(verbosity=2)
