"""Scene = mesh: bodies from Gmsh and Abaqus files.

The strict comparison is with Scene = brake: the same cells, read from a file, have the same eigenvalues. Clamp layers
and aligned cells are what only Scene = brake makes, so they are off.
"""

import math
import pathlib
import random
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

BRAKE = {**st.SMALL_BRAKE, "Discretization/Align rotor": "false", "Discretization/Clamp layers": 0}
MESH = {**BRAKE, **mesh_files.SCENE}
# A lining that is the default one, spelt as transversely isotropic: E_n = E, nu_tn = nu, G_tn = E/(2 (1 + nu)).
TRANSVERSE = {"Pads/Material/Law": "transversely_isotropic", "Pads/Material/Axial Young modulus": 1e10,
              "Pads/Material/Axial Poisson ratio": 0.3, "Pads/Material/Axial shear modulus": 1e10 / 2.6}
WRITERS = {"brake.msh": mesh_files.msh2, "brake4.msh": mesh_files.msh4, "brake.inp": mesh_files.inp}


class SameAsBrake(st.TestCase):
    def write_mesh(self, name="brake.msh", **options):
        self.write(name, WRITERS[name](mesh_files.brake(**options)))
        return {"Mesh/File": name}

    def assertSameErrorBars(self, modes, expected):
        for a, b in zip(modes, expected):
            for key in ["growth_rate_error_1_per_s", "frequency_error_hz"]:
                self.assertLessEqual(abs(a[key] - b[key]), 1e-5 * abs(b[key]) + 1e-6, key)

    def test_formats(self):
        expected = self.modes(BRAKE)
        self.assertGreater(len(expected), 10)
        for name in WRITERS:
            with self.subTest(name):
                modes = self.modes({**MESH, **self.write_mesh(name)})
                self.assertSameModes(map_eigenvalues(modes), map_eigenvalues(expected), 1e-8)
                self.assertSameErrorBars(modes, expected)

    def test_units_axis_and_origin(self):
        """Millimetres, the axis along x, off the file's origin: x y z of the scene are y z x of the file."""
        mesh = mesh_files.brake()
        mesh.move(lambda x, y, z: (1e3 * z + 70, 1e3 * x - 20, 1e3 * y + 5))
        self.write("moved.msh", mesh_files.msh2(mesh))
        moved = {"Mesh/File": "moved.msh", "Mesh/Scale": 1e-3, "Mesh/Axis": "x", "Mesh/Origin": "70, -20, 5"}
        self.assertSameModes(self.eigenvalues({**MESH, **moved}), self.eigenvalues(BRAKE), 1e-8)

    def test_forgotten_scale(self):
        """A file in millimetres that is read as metres, and one that is scaled twice: the log asks for Mesh/Scale."""
        mesh = mesh_files.brake()
        mesh.move(lambda x, y, z: (1e3 * x, 1e3 * y, 1e3 * z))
        self.write("large.msh", mesh_files.msh2(mesh))
        for scale, size in ((1, 300), (1e-3, None), (1e-6, 0.0003)):
            self.write("it.prm", {**MESH, "Mesh/File": "large.msh", "Mesh/Scale": scale, "Eigenproblem/Solver": "none",
                                  "Discretization/Degree": 1})
            text = st.run("it.prm", "--overwrite", directory=self.directory).stdout
            self.assertEqual("Warning, size" in text, size is not None, scale)
            if size:
                self.assertIn(f"the bodies extend over {size} m. Mesh/Scale gives", text)

    def test_cells_numbered_inside_out(self):
        """Mirrored numbering is put right, and said."""
        mesh = mesh_files.brake()
        mesh.cells = [cell[4:] + cell[:4] if c % 3 == 0 else cell for c, cell in enumerate(mesh.cells)]
        self.write("mirrored.msh", mesh_files.msh2(mesh))
        results = self.analyse({**MESH, "Mesh/File": "mirrored.msh"})
        self.assertSameModes(map_eigenvalues(st.read_table(results / "modes.csv")), self.eigenvalues(BRAKE), 1e-8)
        n_turned = (len(mesh.cells) + 2) // 3
        self.assertIn(f"{n_turned} cells numbered inside out", (results / "log.txt").read_text())

    def test_refinement(self):
        """New nodes lie on the cylinders, and adaptive refinement marks the same cells."""
        for strategy in ["uniform", "adaptive"]:
            refined = {"Refinement/Strategy": strategy, "Refinement/Cycles": 2, "Discretization/Degree": 1,
                       "Refinement/Tolerance": 1e-4}
            with self.subTest(strategy):
                self.assertSameModes(self.eigenvalues({**MESH, **self.write_mesh(), **refined}),
                                     self.eigenvalues({**BRAKE, **refined}), 1e-8)

    def test_parallel(self):
        expected = self.eigenvalues(BRAKE)
        self.assertSameModes(self.eigenvalues({**MESH, **self.write_mesh("brake.inp")}, ranks=2), expected, 1e-8)

    def test_parts(self):
        """A pad of two volumes of one material is the pad of one; so is one whose material is written as
        transversely isotropic. Sensitivities to the parts add up."""
        layers = {"Discretization/Pad cells": "2, 3, 2", "Output/Sensitivities": "true",
                  "Prestress/Stress stiffness": "true"}
        whole = self.analyse({**BRAKE, **layers})
        expected = st.read_table(whole / "modes.csv")
        parts = {**MESH, **layers, **self.write_mesh(pad_cells=(2, 3, 2), plate_layers=1),
                 "Mesh/Part 1/Volumes": "upper.plate, lower.plate"}
        same = {"Young modulus": 1e10, "Poisson ratio": 0.3, "Density": 2500, "Stiffness proportional damping": 2e-6}
        parts.update({f"Mesh/Part 1/Material/{key}": value for key, value in same.items()})
        for what, settings in {"isotropic": parts, "transversely isotropic": {**parts, **TRANSVERSE}}.items():
            with self.subTest(what):
                results = self.analyse(settings)
                modes = st.read_table(results / "modes.csv")
                self.assertSameModes(map_eigenvalues(modes), map_eigenvalues(expected), 1e-8)
                self.assertSameErrorBars(modes, expected)
                self.assertPartsAddUp(whole, results, ["Density", "Stiffness proportional damping"])
                if what == "isotropic":
                    self.assertPartsAddUp(whole, results, ["Young modulus"])
                else:
                    # E_t, E_n and G_tn grow together: C is homogeneous of degree one in them.
                    self.assertModuliAddUp(whole, results)

    def sensitivities(self, results):
        return {(row["mode"], row["parameter"]): row for row in st.read_table(results / "sensitivities.csv")}

    def assertPartsAddUp(self, whole, parts, keys):
        one, two = self.sensitivities(whole), self.sensitivities(parts)
        for (mode, path), row in one.items():
            section, key = path.rsplit("/", 1)
            if section == "Pads/Material" and key in keys:
                for column in ["d_growth_rate_1_per_s", "d_frequency_hz"]:
                    total = two[mode, path][column] + two[mode, f"Mesh/Part 1/Material/{key}"][column]
                    self.assertLessEqual(abs(total - row[column]), 2e-5 * abs(row[column]) + 1e-9, (mode, path))

    def assertModuliAddUp(self, whole, parts):
        one, two = self.sensitivities(whole), self.sensitivities(parts)
        values = {"Young modulus": 1e10, "Axial Young modulus": 1e10, "Axial shear modulus": 1e10 / 2.6}
        for (mode, path), row in one.items():
            if path == "Pads/Material/Young modulus":
                total = two[mode, "Mesh/Part 1/Material/Young modulus"]["d_frequency_hz"] * 1e10
                total += sum(two[mode, f"Pads/Material/{key}"]["d_frequency_hz"] * value
                             for key, value in values.items())
                expected = row["d_frequency_hz"] * 1e10
                self.assertLessEqual(abs(total - expected), 1e-4 * abs(expected), mode)

    def test_many_parts(self):
        """Sections of parts are as many as a file needs: Part 12 is what Part 1 is, also in a sweep."""
        mesh = self.write_mesh(pad_cells=(2, 3, 2), plate_layers=1)
        expected = None
        for part in ("Part 1", "Part 12"):
            settings = {**MESH, **mesh, f"Mesh/{part}/Volumes": "upper.plate, lower.plate", "Discretization/Degree": 1}
            results = self.analyse({**settings, "Output/Sensitivities": "true"})
            self.assertIn(f"Mesh/{part}/Material/Density", {path for _, path in self.sensitivities(results)})
            sweep = self.analyse({**settings, "Sweep/Parameter": f"Mesh/{part}/Material/Young modulus",
                                  "Sweep/Values": "2e11, 2.2e11"})
            found = [map_eigenvalues(st.read_table(results / "modes.csv")), (sweep / "sweep.csv").read_text()]
            expected = expected or found
            self.assertEqual(found, expected)
        file = self.write("refused.prm", {**MESH, **mesh, "Mesh/Part 201/Volumes": "upper.plate, lower.plate"})
        result = st.run(file.name, directory=self.directory)
        self.assertEqual(result.returncode, 2)
        self.assertIn("Mesh/Part 201/Volumes", result.stderr)

    def test_straight_pads(self):
        """Curved bodies = rotor gives pads of straight cells: their area is that of trapezoids."""
        results = self.analyse({**MESH, **self.write_mesh(), "Mesh/Curved bodies": "rotor"})
        area = {row["name"]: row["area_m2"] for row in st.read_table(results / "mesh.csv")}
        # 3 x 2 cells of 50/3 degrees: each annulus of (a, b) has (b^2 - a^2)/2 sin(angle)
        trapezoids = 3 * (0.14**2 - 0.09**2) / 2 * math.sin(math.radians(50 / 3))
        self.assertLessEqual(abs(area["upper.low"] - trapezoids), 1e-12)

    def test_report(self):
        """Volumes, masses and areas of sectors, all bodies curved; degree 4 follows 20 degrees of arc to 1e-7."""
        results = self.analyse({**MESH, **self.write_mesh(), "Discretization/Degree": 4, "Stage": "elastic",
                                "Eigenproblem/Maximum frequency": 1000, "Eigenproblem/Error bars": "false"})
        rows = {(row["kind"], row["name"]): row for row in st.read_table(results / "mesh.csv")}
        sector = math.radians(25) * (0.14**2 - 0.09**2)
        ring = math.pi * (0.15**2 - 0.05**2)

        def close(value, expected):
            self.assertLessEqual(abs(value - expected), 1e-7 * abs(expected))

        close(rows["body", "rotor"]["volume_m3"], ring * 0.012)
        close(rows["volume", "rotor"]["mass_kg"], 7200 * ring * 0.012)
        close(rows["volume", "upper"]["mass_kg"], 2500 * sector * 0.012)
        close(rows["surface", "rotor.inner"]["area_m2"], 2 * math.pi * 0.05 * 0.012)
        close(rows["surface", "rotor.high"]["area_m2"], ring)
        close(rows["surface", "lower.high"]["area_m2"], sector)
        close(rows["mesh", "brake.msh"]["volume_m3"], (ring + 2 * sector) * 0.012)
        self.assertEqual(rows["mesh", "brake.msh"]["count"], 3 * 18 + 2 * 6)
        self.assertEqual(rows["surface", "rotor.high"]["count"], 3 * 18)
        close(rows["body", "rotor"]["x_max_m"], 0.15)
        close(rows["volume", "upper"]["z_max_m"], 0.018)
        pair = rows["pair", "upper.low : rotor.high"]
        self.assertLessEqual(abs(pair["gap_m"]), 1e-15)
        # Between straight edges; the pad lies inside of the rotor's polygons.
        close(pair["overlap_m2"], 3 * (0.14**2 - 0.09**2) / 2 * math.sin(math.radians(50 / 3)))
        self.assertEqual(rows["surface", "rotor.inner"]["use"], "Clamped")
        # At an arc's end the circle leaves the cell's edge by half the arc, so that a corner keeps its right
        # angles; no Jacobian is below that of a cell with straight edges, cos 10 degrees.
        self.assertGreater(rows["body", "rotor"]["smallest_jacobian"], 0.98)

    def test_sweep(self):
        """Material of a part, on one mesh; scale of the mesh, on several: frequencies of a rotor go with 1/size."""
        rotor = {**MESH, **self.write_mesh(pads=()), "Stage": "elastic", "Mesh/Pads": "", "Mesh/Contact pairs": "",
                 "Mesh/Guided": "", "Mesh/Pressure on": "", "Eigenproblem/Maximum frequency": 3000}
        sweep = {"Sweep/Parameter": "Mesh/Scale", "Sweep/Values": "1, 1.25"}
        rows = st.read_table(self.analyse({**rotor, **sweep}) / "sweep.csv")
        one, large = ({row["branch"]: row["frequency_hz"] for row in rows if row["parameter"] == value}
                      for value in [1, 1.25])
        both = [branch for branch in one if branch in large]
        self.assertGreater(len(both), 3)
        for branch in both:
            self.assertLessEqual(abs(large[branch] * 1.25 - one[branch]), 1e-6 * one[branch])


class Invariance(st.TestCase):
    """The same brake however its cells are numbered and wherever its pads stand."""

    SETTINGS = {**mesh_files.LAYERED_SCENE, "Discretization/Degree": 2, "Output/Fields": "none", "Pads/Pressure": 1e5,
                "Operation/Angular velocity": 10, "Contact/Friction/Coefficient": 0.5,
                "Eigenproblem/Maximum frequency": 2500, "Eigenproblem/Error bars": "false",
                "Mesh/Part 1/Volumes": "upper.plate, lower.plate", "Mesh/Part 1/Body": "pads"}

    @staticmethod
    def brake():
        """Pads with chamfers, whose contact faces are no parallelograms, on faces of the disc that do not match."""
        mesh = mesh_files.layered_brake([("lining", 8, 1), ("plate", 5, 1)], (3, 18, 1), (2, 4), chamfer=6)
        shift = lambda x, y, z: ((x, y, z) if abs(z) < 0.0061 and not 0.1 < math.hypot(x, y) < 0.13 else
                                 (x + 2e-3 * math.sin(300 * x + 200 * y), y + 2e-3 * math.cos(250 * y - 150 * x), z))
        lining = {v for pad in ("upper", "lower") for part in ("lining", "plate")
                  for c in mesh.volumes[f"{pad}.{part}"] for v in mesh.cells[c]}
        mesh.nodes = [shift(*x) if v in lining else x for v, x in enumerate(mesh.nodes)]
        return mesh

    def analyse_mesh(self, mesh):
        self.write("brake.msh", mesh_files.msh2(mesh))
        results = self.analyse({**self.SETTINGS, "Mesh/File": "brake.msh"})
        overlap = min(row["overlap_m2"] for row in st.read_table(results / "mesh.csv") if row["kind"] == "pair")
        return (map_eigenvalues(st.read_table(results / "modes.csv")), st.read_table(results / "static.csv"), overlap)

    def test_numbering_and_angle(self):
        expected, static, overlap = self.analyse_mesh(self.brake())
        self.assertGreater(len(expected), 5)
        # Part of the pads lifts off: the edge of the contact zone is in it.
        self.assertTrue(all(row["contact_area_m2"] < 0.99 * overlap for row in static))
        numbers = random.Random(1)
        rotations = mesh_files.rotations_of_corners()

        corners, cells, turned = self.brake(), self.brake(), self.brake()
        corners.cells = [[cell[v] for v in numbers.choice(rotations)] for cell in corners.cells]
        order = list(range(len(cells.cells)))
        numbers.shuffle(order)
        place = {c: i for i, c in enumerate(order)}
        cells.cells = [cells.cells[c] for c in order]
        cells.volumes = {name: sorted(place[c] for c in group) for name, group in cells.volumes.items()}
        angle = 1.234
        turned.move(lambda x, y, z: (x * math.cos(angle) - y * math.sin(angle),
                                     x * math.sin(angle) + y * math.cos(angle), z))
        for what, mesh in {"corners": corners, "cells": cells, "turned": turned}.items():
            with self.subTest(what):
                modes, other, _ = self.analyse_mesh(mesh)
                self.assertSameModes(modes, expected, 1e-9)
                for a, b in zip(other, static):
                    for key in ["max_pressure_pa", "normal_force_n", "contact_area_m2"]:
                        self.assertLessEqual(abs(a[key] - b[key]), 1e-6 * abs(b[key]), key)


def map_eigenvalues(modes):
    return [st.eigenvalue(row) for row in modes]


if __name__ == "__main__":
    unittest.main(verbosity=2)
