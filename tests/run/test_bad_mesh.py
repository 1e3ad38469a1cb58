"""Mesh files and assignments of Scene = mesh that cannot work: exit status 2, with what, where and what is allowed."""

import math
import pathlib
import resource
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

SCENE = {**st.SMALL_BRAKE, **mesh_files.SCENE, "Mesh/File": "brake.msh"}


class BadMesh(st.TestCase):
    def assertRefused(self, settings, *words, mesh=None, text=None, name="brake.msh", arguments=()):
        """The mesh (by default the good one, or a text) with changed settings."""
        if text is None:
            text = mesh_files.msh2(mesh or mesh_files.brake())
        self.write(name, text)
        self.write("bad.prm", {**SCENE, "Mesh/File": name, **settings})
        result = st.run("bad.prm", *arguments, directory=self.directory, timeout=60)
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertEqual(result.stderr.count("squeal: "), 1, result.stderr)
        self.assertFalse(list(self.directory.rglob("modes.csv")))

    # Files

    def test_no_file(self):
        self.assertRefused({"Mesh/File": ""}, "Mesh/File")
        self.assertRefused({"Mesh/File": "none.msh"}, "Mesh/File", "none.msh", "cannot be read")

    def test_script_instead_of_mesh(self):
        """Who has forgotten Gmsh is told the command."""
        self.write("disc.geo", "")
        self.assertRefused({"Mesh/File": "disc.msh"}, "gmsh -3 disc.geo -o disc.msh")

    def test_unknown_format(self):
        self.assertRefused({}, "brake.vtk", ".msh", ".inp", name="brake.vtk")

    def test_malformed_gmsh(self):
        good = mesh_files.msh2(mesh_files.brake())
        header = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
        for what, text, *words in [
                ("empty", "", "$MeshFormat"),
                ("another version", good.replace("2.2 0 8", "4.0 0 8"), "line 2", "4.0", "2.2", "4.1"),
                ("binary", good.replace("2.2 0 8", "2.2 1 8"), "line 2", "binary"),
                ("ends early", good[:len(good) // 2], "line"),
                ("no number", header + "$Nodes\n1\n1 0 0 zero\n$EndNodes\n", "line 6", "zero"),
                ("not finite", header + "$Nodes\n1\n1 0 0 nan\n$EndNodes\n", "line 6", "nan"),
                ("twice", header + "$Nodes\n2\n1 0 0 0\n1 0 0 1\n$EndNodes\n", "line 7", "node 1"),
                ("negative count", header + "$Nodes\n-2\n$EndNodes\n", "line 5", "-2"),
                ("unknown node", header + "$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n"
                 "7 5 2 1 1 1 1 1 1 1 1 1 2\n$EndElements\n", "line 10", "element 7", "node 2"),
                ("too few nodes", header + "$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n7 5 2 1 1 1\n$EndElements\n",
                 "line 10", "element 7"),
                ("no cells", header, "no solid elements")]:
            with self.subTest(what):
                self.assertRefused({}, "Mesh/File", "brake.msh", *words, text=text)

    def test_malformed_abaqus(self):
        nodes = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n"
        for what, text, *words in [
                ("data first", "1, 2, 3\n", "line 1"),
                ("no number", "*NODE\n1, 0, 0, x\n", "line 2", "'x'"),
                ("no type", nodes + "*ELEMENT\n1, 1, 2\n", "line 4", "TYPE="),
                ("unknown node", nodes + "*ELEMENT, TYPE=C3D8\n5, 1, 2, 1, 2, 1, 2, 1, 9\n", "element 5", "node 9"),
                ("too few nodes", nodes + "*ELEMENT, TYPE=C3D8\n5, 1, 2,\n", "element 5", "8 nodes"),
                ("unknown set", nodes + "*ELSET, ELSET=A\nB\n", "line 5", "B"),
                ("instance", "*INSTANCE, NAME=A, PART=B\n", "no part B", "no parts"),
                ("surface", nodes + "*SURFACE, NAME=A\n1, S7\n", "line 5", "S6"),
                ("surface of no solid", nodes + "*SURFACE, NAME=A\n1,\n", "line 5", "no solid element"),
                ("surface of no shell", nodes + "*SURFACE, NAME=A\n1, SPOS\n", "line 5", "no shell")]:
            with self.subTest(what):
                self.assertRefused({}, "Mesh/File", "brake.inp", *words, text=text, name="brake.inp")

    def test_generated_set(self):
        """A range of ten million numbers for a few nodes: what exists of it is taken, and memory for no more."""
        lines = "".join(f"{first}, {first + 10_000_000 - 1}, 1\n" for first in range(1, 40))
        deck = mesh_files.inp(mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1)))
        self.write("brake.inp", deck + "*NSET, NSET=MANY, GENERATE\n" + lines + "*ELSET, ELSET=MORE, GENERATE\n" + lines)
        file = self.write("brake.prm", {**st.SMALL_BRAKE, **mesh_files.SCENE, "Discretization/Degree": 1,
                                        "Eigenproblem/Solver": "none", "Mesh/File": "brake.inp"})
        limit = 1100 * 2 ** 20  # of the address space: the libraries take 900
        process = subprocess.run([st.SQUEAL, file.name], cwd=self.directory, env=st.ENVIRONMENT, capture_output=True,
                                 text=True, timeout=100,
                                 preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
        self.assertEqual(process.returncode, 0, process.stderr)

    def test_other_elements(self):
        good = mesh_files.msh2(mesh_files.brake())
        first = next(line for line in good.split("\n") if len(line.split()) == 13)
        words = first.split()
        for kind, n, name in [("7", 5, "pyramid"), ("29", 8, "type 29"), ("17", 8, "too few nodes")]:
            with self.subTest(name):
                other = " ".join([words[0], kind, *words[2:5 + n]])
                self.assertRefused({}, name, f"element {words[0]}", text=good.replace(first, other))
        self.assertRefused({}, "C3D5", "C3D8", name="brake.inp",
                           text=mesh_files.inp(mesh_files.brake(), kinds=["C3D8", "C3D5"]))
        self.assertRefused({}, "10 nodes", name="brake.inp",
                           text=mesh_files.inp(mesh_files.brake(), kinds=["C3D8", "C3D10"]))

    # Groups

    def test_unknown_groups(self):
        for key, kind in [("Rotor", "volume"), ("Pads", "volume"), ("Clamped", "surface"), ("Guided", "surface"),
                          ("Pressure on", "surface"), ("Fixed in z", "surface")]:
            with self.subTest(key):
                known = "rotor" if kind == "volume" else "rotor.inner"
                self.assertRefused({f"Mesh/{key}": "rotr"}, f"Mesh/{key}", f"{kind} group 'rotr'", known)
        self.assertRefused({"Mesh/Contact pairs": "upper.low : disc"}, "Mesh/Contact pairs", "'disc'", "rotor.high")
        self.assertRefused({"Mesh/Part 2/Volumes": "plate"}, "Mesh/Part 2/Volumes", "'plate'")

    def test_cells_without_material(self):
        self.assertRefused({"Mesh/Pads": "upper"}, "6 cells have no material", "'lower'")

    def test_two_materials(self):
        self.assertRefused({"Mesh/Part 1/Volumes": "lower"}, "Mesh/Part 1/Volumes", "'lower'", "two materials")

    def test_malformed_pairs(self):
        for pairs in ["upper.low", "upper.low : rotor.high : rotor.low", ": rotor.high"]:
            with self.subTest(pairs):
                self.assertRefused({"Mesh/Contact pairs": pairs}, "Mesh/Contact pairs", "pad surface : rotor surface")
        self.assertRefused({"Mesh/Contact pairs": ""}, "Mesh/Contact pairs", "pads need them")

    def test_pairs_on_wrong_bodies(self):
        self.assertRefused({"Mesh/Contact pairs": "rotor.high : upper.low, lower.high : rotor.low"},
                           "'upper.low' is not on the rotor")
        self.assertRefused({"Mesh/Contact pairs": "upper.low : rotor.high"}, "no nodes with a pad")

    def test_surface_of_two_uses(self):
        self.assertRefused({"Mesh/Clamped": "rotor.inner, rotor.high"}, "'rotor.high'", "supported")

    def test_face_inside_of_a_body(self):
        mesh = mesh_files.brake(rotor_cells=(3, 18, 2))
        mesh.surfaces["middle"] = [mesh.cells[0][4:]]
        self.assertRefused({"Mesh/Clamped": "middle"}, "'middle'", "inside of a body", mesh=mesh)

    # Geometry

    def test_folded_cell(self):
        mesh = mesh_files.brake()
        cell = mesh.cells[0]
        mesh.nodes[cell[0]], mesh.nodes[cell[1]] = mesh.nodes[cell[1]], mesh.nodes[cell[0]]
        self.assertRefused({}, "scaled Jacobian", "element ", mesh=mesh)

    def test_cell_through_its_neighbour(self):
        """A cell pulled through itself has negative Jacobians everywhere, like one of mirrored numbering; its
        neighbours tell the two apart."""
        mesh = mesh_files.brake(pad_cells=(2, 3, 2))
        n = len(mesh.nodes)
        # The top nodes of the lower pad, pushed below its middle ones
        mesh.nodes = [(x, y, z - 0.009 if i >= n - 12 else z) for i, (x, y, z) in enumerate(mesh.nodes)]
        self.assertRefused({}, "inside out", mesh=mesh)

    def test_common_nodes(self):
        """Rotor and pad glued together: as Gmsh makes it where volumes share a surface."""
        mesh = mesh_files.Mesh()
        radii, angles = mesh_files.equal(0.05, 0.15, 3), mesh_files.equal(0, 2 * math.pi, 12)
        mesh.sector("rotor", radii, angles, [-0.006, 0.006, 0.018], ring=True,
                    volume_of=lambda layer: ["rotor", "upper"][layer])
        mesh.surfaces["face"] = [mesh.cells[0][4:]]
        self.assertRefused({"Mesh/Pads": "upper", "Mesh/Contact pairs": "face : face", "Mesh/Guided": "",
                            "Mesh/Pressure on": ""}, "common nodes", mesh=mesh)

    def test_rotor_in_pieces(self):
        """Volumes whose common nodes exist twice."""
        mesh = mesh_files.brake()
        mesh.sector("rotor", [0.15, 0.16], mesh_files.equal(0, 2 * math.pi, 18), [-0.006, 0.006], ring=True)
        self.assertRefused({}, "2 pieces", "Coherence", mesh=mesh)

    def test_gap(self):
        mesh = mesh_files.brake()
        first = len(mesh.nodes) - 2 * 24  # of the upper pad
        mesh.nodes = [(x, y, z + 1e-4 if first <= i < first + 24 else z) for i, (x, y, z) in enumerate(mesh.nodes)]
        # The message has the tolerance that closes the gap: a tenth more than it.
        self.assertRefused({}, "common plane", "a gap of 0.0001", "'upper.low'", "'rotor.high'",
                           "Mesh/Contact tolerance = 0.00011 takes them as touching", mesh=mesh)
        mesh.nodes = [(x, y, z - 2e-4 if first <= i < first + 24 else z) for i, (x, y, z) in enumerate(mesh.nodes)]
        self.assertRefused({}, "common plane", "an overlap of 0.0001", mesh=mesh)

    def test_no_overlap(self):
        """The pads moved outwards, half off the rotor."""
        mesh = mesh_files.brake()
        first = len(mesh.nodes) - 2 * 24
        mesh.nodes = [(x + 0.03 if i >= first else x, y, z) for i, (x, y, z) in enumerate(mesh.nodes)]
        self.assertRefused({}, "do not overlap", "'upper.low'", mesh=mesh)

    def test_same_direction(self):
        self.assertRefused({"Mesh/Contact pairs": "upper.high : rotor.high, lower.high : rotor.low",
                            "Mesh/Guided": "upper.low, lower.low", "Mesh/Pressure on": "lower.low"}, "common plane")
        mesh = mesh_files.brake()
        first = len(mesh.nodes) - 2 * 24
        # The upper pad lies inside of the rotor, with its back on the rotor's face
        mesh.nodes = [(x, y, z - 0.012 if first <= i < first + 24 else z) for i, (x, y, z) in enumerate(mesh.nodes)]
        self.assertRefused({"Mesh/Contact pairs": "upper.high : rotor.high, lower.high : rotor.low",
                            "Mesh/Guided": "upper.low, lower.low", "Mesh/Pressure on": "lower.low"},
                           "same direction", mesh=mesh)

    def test_oblique_contact(self):
        mesh = mesh_files.brake()
        mesh.move(lambda x, y, z: (x, y, z + 0.01 * x))
        self.assertRefused({"Stage": "elastic"}, "contact surfaces must be plane", "z = ", mesh=mesh)

    def test_rotor_not_of_revolution(self):
        """An elliptic rotor: transport refuses it, Stage = elastic takes it."""
        mesh = mesh_files.brake()
        mesh.move(lambda x, y, z: (1.1 * x, y, z))
        self.assertRefused({}, "Mesh/Rotor", "revolution", "Stage = elastic", mesh=mesh)
        self.assertRefused({"Mesh/Axis": "y", "Mesh/Contact pairs": "", "Mesh/Pads": "", "Mesh/Guided": "",
                            "Mesh/Pressure on": ""}, "revolution", mesh=mesh_files.brake(pads=()))
        self.assertRefused({"Mesh/Curved bodies": "none"}, "Mesh/Curved bodies", "revolution")
        self.write("elliptic.msh", mesh_files.msh2(mesh))
        modes = self.modes({**SCENE, "Mesh/File": "elliptic.msh", "Stage": "elastic", "Mesh/Curved bodies": "none",
                            "Eigenproblem/Maximum frequency": 2000, "Eigenproblem/Error bars": "false"})
        self.assertTrue(modes)

    def test_no_support(self):
        self.assertRefused({"Mesh/Guided": "upper.high"}, "Mesh/Clamped",
                           "'lower.high' can move rigidly in 3 ways (along x, along y, about z)")
        self.assertRefused({"Mesh/Clamped": ""},
                           "'rotor' can move rigidly in 6 ways (along x, along y, along z, about x, about y, about z)")

    def test_uniform_pressure(self):
        """Half the pads are loaded: the contact pressure is not the applied one."""
        self.assertRefused({"Contact/Steady pressure": "uniform", "Mesh/Pressure on": "upper.high"},
                           "Contact/Steady pressure", "uniform", "computed")

    # Materials

    def test_transversely_isotropic(self):
        law = {"Pads/Material/Law": "transversely_isotropic"}
        self.assertRefused(law, "Pads/Material/Axial Young modulus", "positive")
        law["Pads/Material/Axial Young modulus"] = 1e10
        self.assertRefused(law, "Pads/Material/Axial shear modulus", "positive")
        law["Pads/Material/Axial shear modulus"] = 1e9
        # 1 - 0.3 - 2 x 0.36 < 0
        self.assertRefused({**law, "Pads/Material/Axial Poisson ratio": 0.6}, "Pads/Material/Law", "no or negative",
                           "-0.02")
        self.assertRefused({**law, "Pads/Material/Poisson ratio": -1}, "Pads/Material/Law", "Poisson ratio > -1")

    def test_check(self):
        """--check does not need the mesh, so that parameter files are checked before meshes are made."""
        self.write("good.prm", SCENE)
        result = st.run("--check", "good.prm", directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("brake.msh", result.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
