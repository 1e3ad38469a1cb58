"""Tetrahedra, wedges and quadratic elements, divided into hexahedra, and decks with parts and instances.

test_tetrahedra.py has those at their own nodes."""

import math
import pathlib
import re
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import element_files  # noqa: E402
import error_statistics as es  # noqa: E402
import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

# Pads with straight edges: divided, they are the same bodies.
BRAKE = {**st.SMALL_BRAKE, **mesh_files.SCENE, "Discretization/Degree": 2, "Mesh/Curved bodies": "rotor"}


def pads_of(n_corners):
    """The default brake, whose pads' cells become elements with so many corners."""
    return element_files.Elements(mesh_files.brake(), lambda name: 8 if name == "rotor" else n_corners)


class Elements(st.TestCase):
    def run_mesh(self, mesh, name="brake.inp", writer=element_files.inp, settings=None, ranks=1):
        self.write(name, writer(mesh))
        results = self.analyse({**BRAKE, "Mesh/File": name, **(settings or {})}, ranks=ranks)
        return st.read_table(results / "modes.csv"), (results / "log.txt").read_text()

    def assertWithinBars(self, modes, expected):
        """Of one brake on two meshes: eigenvalues differ by the bars of both at most."""
        self.assertEqual(len(modes), len(expected))
        for a, b in zip(modes, expected):
            for value, error in [("frequency_hz", "frequency_error_hz"),
                                 ("growth_rate_1_per_s", "growth_rate_error_1_per_s")]:
                self.assertLessEqual(abs(a[value] - b[value]), a[error] + b[error], (value, a, b))

    def assertEqualModes(self, modes, expected, tolerance):
        self.assertSameModes(*([complex(m["growth_rate_1_per_s"], 2 * math.pi * m["frequency_hz"]) for m in list]
                               for list in (modes, expected)), tolerance)

    def test_divided_pads(self):
        """Pads of tetrahedra and of wedges on a disc of hexahedra: the brake of hexahedra within the bars; linear and
        quadratic elements with middle nodes half way, both formats and two ranks have the same modes. Bars are in the runs that
        are compared by them."""
        expected, _ = self.run_mesh(pads_of(8))
        settings = {"Mesh/Tetrahedra": "divided"}
        for n_corners, kind in [(4, "tetrahedron"), (6, "wedge")]:
            with self.subTest(kind):
                modes, log = self.run_mesh(pads_of(n_corners), settings=settings)
                self.assertWithinBars(modes, expected)
                n = {4: 2 * 6 * 6, 6: 2 * 6 * 2}[n_corners]  # two pads of six cells
                self.assertIn(f"{n} linear {kind} elements", log)
                self.assertIn(f"Of them {n} are divided and 0 bend their cells: "
                              f"{54 + n * {4: 4, 6: 3}[n_corners]} hexahedra", log)
                quadratic = pads_of(n_corners)
                quadratic.make_quadratic({"rotor": element_files.on_circle})
                for name, writer, ranks in [("quadratic.inp", element_files.inp, 1),
                                            ("quadratic.msh", element_files.msh2, 2)]:
                    others, _ = self.run_mesh(quadratic, name, writer, {**settings, "Eigenproblem/Error bars": "false"}, ranks)
                    self.assertEqualModes(others, modes, 1e-8)

    def test_quadratic_hexahedra(self):
        """Middle nodes on the circles that bodies follow anyway change nothing."""
        settings = {"Mesh/Curved bodies": "all", "Discretization/Degree": 1}
        expected, _ = self.run_mesh(pads_of(8), settings=settings)
        quadratic = pads_of(8)
        quadratic.make_quadratic(dict.fromkeys(quadratic.volumes, element_files.on_circle))
        for name, writer in [("quadratic.inp", element_files.inp), ("quadratic.msh", element_files.msh2)]:
            modes, log = self.run_mesh(quadratic, name, writer, settings)
            self.assertEqualModes(modes, expected, 1e-9)
            self.assertIn("Of them 0 are divided and 0 bend their cells: 66 hexahedra", log)

    def disc(self, n, shape):
        """Frequencies of an annular disc at rest of C3D20, n around, whose edges are straight, through middle nodes on
        circles, or follow circles."""
        elements = element_files.Elements(mesh_files.brake((1, n, 1), pads=()), lambda name: 8)
        elements.make_quadratic(None if shape == "straight" else {"rotor": element_files.on_circle})
        settings = {**dict.fromkeys(["Mesh/Pads", "Mesh/Contact pairs", "Mesh/Guided", "Mesh/Pressure on"], ""),
                    "Stage": "elastic", "Operation/Angular velocity": 0, "Eigenproblem/Error bars": "false",
                    "Eigenproblem/Maximum frequency": 4000, "Mesh/Curved bodies": "rotor" if shape == "circles" else "none"}
        modes, log = self.run_mesh(elements, settings=settings)
        self.assertIn(f"Of them 0 are divided and {n if shape == 'bent' else 0} bend their cells", log)
        return [mode["frequency_hz"] for mode in modes][:10]

    def test_middle_nodes_bend_cells(self):
        """Through two corners and a middle node on a circle go the cells of degree 2 that follow it: the same disc.
        Straight edges miss the circle by the second power of an element's angle."""
        errors = []
        for n in (12, 24):
            expected = self.disc(n, "circles")
            straight, bent = ([abs(a / b - 1) for a, b in zip(self.disc(n, shape), expected)]
                              for shape in ("straight", "bent"))
            self.assertLessEqual(max(bent), 1e-9)
            errors.append(max(straight))
        self.assertGreater(errors[0], 1e-2)
        self.assertLess(abs(math.log2(errors[0] / errors[1]) - 2), 0.5)

    def test_bent_pads(self):
        """Pads of C3D10 with middle nodes on circles, refined with hanging nodes: one rank and two have the same modes."""
        mesh = mesh_files.brake((1, 8, 1), (1, 2, 1))
        bent = element_files.Elements(mesh, lambda name: 8 if name == "rotor" else 4)
        bent.make_quadratic(dict.fromkeys(bent.volumes, element_files.on_circle))
        settings = {"Mesh/Tetrahedra": "divided", "Refinement/Strategy": "adaptive", "Refinement/Cycles": 2, "Refinement/Tolerance": 1e-3,
                    "Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 3000}
        lists = []
        for ranks in (1, 2):
            table, log = self.run_mesh(bent, settings=settings, ranks=ranks)
            self.assertIn("Of them 24 are divided and 24 bend their cells", log)
            lists.append([mode for mode in table if mode["cycle"] == 1])
            self.assertTrue(lists[-1])
        self.assertEqualModes(*lists, 1e-8)

    def test_pads_of_tetrahedra_against_reference(self):
        """C3D10 pads on a disc of hexahedra against the independent eigenvalues of table T6: 1e-3, and the bars hold."""
        self.write("t6.msh", element_files.msh2(element_files.brake_graded_at_the_clamp(4)))
        settings = {**es.settings_of_file("T6", "t6.msh", 3), "Mesh/Tetrahedra": "divided"}
        modes = st.read_table(self.analyse(settings, timeout=900) / "modes.csv")
        comparisons = es.compare("T6", modes)
        self.assertEqual(len(comparisons), 25)
        for c in comparisons:
            self.assertLess(abs(st.eigenvalue(c.row) - c.reference), 1e-3 * abs(c.reference))
            self.assertLess(abs(es.corrected(c.row) - c.reference), 3e-4 * abs(c.reference))
        statistics = es.statistics(comparisons)
        self.assertEqual(statistics.covered, {"frequency": 25, "growth": 25})
        self.assertLess(max(statistics.median.values()), 3)
        self.assertEqual({c.row["verdict"] for c in comparisons}, {"stable"})

    def test_bent_contact_surface(self):
        """Middle nodes off the plane of a contact surface are refused, of divided elements by their corners; in it they
        are not."""
        for n_corners, words in ((4, "'UPPER.LOW' reaches from z = "), (8, "a middle node bends 'UPPER.LOW'")):
            mesh = pads_of(n_corners)
            mesh.make_quadratic({"rotor": element_files.on_circle, "upper": lambda a, b: (
                *((p + q) / 2 for p, q in zip(a[:2], b[:2])), (a[2] + b[2]) / 2 + 1e-4 * (a[2] == b[2] == 0.006))})
            self.write("bent.inp", element_files.inp(mesh))
            self.write("bent.prm", {**BRAKE, "Mesh/File": "bent.inp"})
            result = st.run("bent.prm", directory=self.directory, timeout=60)
            self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
            self.assertIn(words, result.stderr)

    def test_locking_is_told(self):
        _, log = self.run_mesh(pads_of(4), settings={"Discretization/Degree": 1})
        self.assertIn("divided elements of degree 1", log)

    def test_parts_and_instances(self):
        """A deck with parts is its flat file: eigenvalues to 1e-9. Internal sets are no volumes."""
        mesh = pads_of(4)
        settings = {"Discretization/Degree": 1}
        expected, _ = self.run_mesh(mesh, settings=settings)
        deck, nodes = element_files.assembly(mesh, {"Disc": ["rotor"], "Up": ["upper"], "Low": ["lower"]}, True)
        self.write("nodes.txt", nodes)
        parts = {**settings, "Mesh/Rotor": "Disc-1.rotor", "Mesh/Pads": "Up-1, Low-1.lower"}
        modes, log = self.run_mesh(mesh, "parts.inp", lambda mesh: deck, parts)
        self.assertEqualModes(modes, expected, 1e-9)
        self.assertNotIn("_UPPER", log)

    def from_deck(self, deck, *options):
        """Return code and what was said."""
        self.write("brake.inp", deck)
        result = subprocess.run([str(st.SQUEAL), "--from-deck", "brake.inp", *options], cwd=self.directory, text=True,
                                capture_output=True, timeout=60, env=st.ENVIRONMENT)
        return result.returncode, result.stdout + result.stderr

    def test_from_deck(self):
        """A deck as preprocessors write it, in mm, with parts, sets of their own for supports, contact pairs in both
        orders: its parameter file runs and has the eigenvalues of the flat file with the keys written by hand."""
        settings = {"Discretization/Degree": 2, "Contact/Friction/Coefficient": 0.6, "Operation/Angular velocity": 20,
                    "Eigenproblem/Maximum frequency": 6000}
        expected, _ = self.run_mesh(pads_of(4), "flat.inp", settings=settings)
        deck, nodes = element_files.brake_deck(pads_of(4))
        self.write("nodes.txt", nodes)
        status, said = self.from_deck(deck + element_files.MODEL)
        self.assertEqual(status, 0, said)
        self.assertRegex(said, r"# Passed over:\n#   brake.inp, line \d+: \*STATIC\n")
        text = (self.directory / "brake.prm").read_text()
        for line in ("Contact pairs = UPPER.LOW : ROTOR.HIGH, LOWER.HIGH : ROTOR.LOW", "Clamped = _HELD",
                     "Scale = 0.001", "Guided = _GUIDED", "Young modulus = 125000000000", "Density = 7200",
                     "Pressure = 1000000", "Pressure on = LOWER.LOW, UPPER.HIGH", "Coefficient = 0.6", "Angular velocity = 20", "Axis = z"):
            self.assertIn(line + "\n", re.sub(r" +#.*", "", text))
        result = st.run("brake.prm", directory=self.directory, timeout=300)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertEqualModes(st.read_table(self.directory / "output" / "brake" / "modes.csv"), expected, 1e-9)
        # What is there is not replaced unasked.
        self.assertEqual(self.from_deck(deck + element_files.MODEL)[0], 2)
        self.assertEqual((self.directory / "brake.prm").read_text(), text)
        self.assertEqual(self.from_deck(deck + element_files.MODEL, "--overwrite")[0], 0)

    def test_from_deck_refuses(self):
        deck, nodes = element_files.brake_deck(pads_of(4))
        self.write("nodes.txt", nodes)
        for what, changed, *words in [
                ("no density", element_files.MODEL.replace("*Density\n 7.2e-09,\n", ""), "IRON", "*DENSITY"),
                ("two systems of units", element_files.MODEL.replace("7.2e-09", "7200."), "densities", "units"),
                ("no such material", element_files.MODEL.replace("name=Lining", "name=Other"), "LINING"),
                ("no such surface", element_files.MODEL.replace("upper.low,", "upper.lo,"), "UPPER.LO"),
                ("an anisotropic law",
                 element_files.MODEL.replace("*Elastic\n1000", "*Elastic, type=ORTHOTROPIC\n1000"),
                 "ORTHOTROPIC", "ENGINEERING CONSTANTS"),
                ("not about the axis",
                 element_files.MODEL.replace("*Elastic\n10000., 0.3", "*Elastic, type=ENGINEERING CONSTANTS\n"
                                    "1e4, 2e4, 3e3, 0.2, 0.2, 0.2, 4e3, 1e3\n1e3"), "LINING", "alike")]:
            with self.subTest(what):
                status, said = self.from_deck(deck + changed)
                self.assertEqual(status, 2, said)
                for word in words:
                    self.assertIn(word, said)
                self.assertFalse((self.directory / "brake.prm").exists())
        # Which turns, where no name says so
        wheel = (deck + element_files.MODEL).replace("Disc", "Wheel").replace("elset=rotor", "elset=ring")
        status, said = self.from_deck(wheel)
        self.assertEqual(status, 2, said)
        self.assertIn("--rotor NAME, of LOW-1.LOWER, UP-1.UPPER, WHEEL-1.RING", said)
        self.assertEqual(self.from_deck(wheel, "--rotor", "Wheel-1.ring")[0], 0)
        # Parts alone: no rotor, and the modes of what the deck clamps
        self.assertIn("--rotor none", said)
        status, said = self.from_deck(wheel, "--rotor", "none", "--overwrite")
        self.assertEqual(status, 0, said)
        self.assertIn("set Rotor =  # parts are studied alone", (self.directory / "brake.prm").read_text())
        result = st.run("brake.prm", "--set", "Discretization/Degree=1", "--set", "Output/Fields=none",
                        directory=self.directory, timeout=100)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_from_deck_joints(self):
        """Ties, contact between bodies that do not turn, springs, dashpots and masses at points, a lining softer along
        the axis, in SI units."""
        deck = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
11, 0, 0, 1
12, 1, 0, 1
13, 1, 1, 1
14, 0, 1, 1
15, 0, 0, 2
16, 1, 0, 2
17, 1, 1, 2
18, 0, 1, 2
101, 0.5, 0.5, 3
102, 0.5, 0.5, 5
*ELEMENT, TYPE=C3D8, ELSET=ROTOR
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=C3D8, ELSET=BLOCK
2, 11, 12, 13, 14, 15, 16, 17, 18
*ELEMENT, TYPE=SPRINGA, ELSET=LINE
3, 101, 102
*ELEMENT, TYPE=SPRING1, ELSET=GROUND
4, 102
*ELEMENT, TYPE=MASS, ELSET=MASS
5, 102
*ELEMENT, TYPE=SPRING1, ELSET=ON_MESH
6, 17
*SURFACE, NAME=UP
1, S2
*SURFACE, NAME=DOWN
2, S1
*SURFACE, NAME=TOP
2, S2
*COUPLING, CONSTRAINT NAME=C, REF NODE=101, SURFACE=TOP
*DISTRIBUTING
*TIE, NAME=T
DOWN, UP
*ORIENTATION, NAME=O
0, 0, 1, 1, 0, 0
*MATERIAL, NAME=SOFT
*ELASTIC, TYPE=ENGINEERING CONSTANTS
1e9, 8e9, 8e9, 0.05, 0.05, 0.2, 1e9, 1e9
3333333333.333333
*DENSITY
2600
*SOLID SECTION, ELSET=ROTOR, MATERIAL=SOFT, ORIENTATION=O
*SOLID SECTION, ELSET=BLOCK, MATERIAL=SOFT, ORIENTATION=O
*SPRING, ELSET=LINE

1000.
*SPRING, ELSET=GROUND
3
2000.
*SPRING, ELSET=ON_MESH
1
1.
*MASS, ELSET=MASS
0.5
"""
        status, said = self.from_deck(deck, "--partial")
        self.assertEqual(status, 0, said)
        text = (self.directory / "brake.prm").read_text()
        # nu_tn = nu_nt E_t / E_n
        for line in ("Ties = DOWN : UP", "Points = P101 : TOP, P102 : 0 0 5", "Masses = P102 : 0.5",
                     "Springs = P101 : P102 : 1000 0 0 : 0 0 1, P102 : ground : 0 0 2000 0 0 0",
                     "Law = transversely_isotropic", "Young modulus = 8000000000", "Axial Young modulus = 1000000000",
                     "Poisson ratio = 0.2", "Axial Poisson ratio = 0.4", "Axial shear modulus = 1000000000",
                     "Scale = 1"):
            self.assertIn(line + "\n", text)
        self.assertRegex(said, r"\*SPRING, at a node of the mesh")

    def assertRefused(self, deck, *words):
        self.write("bad.inp", deck)
        self.assertSettingsRefused({**BRAKE, "Mesh/File": "bad.inp"}, *words)

    def test_refused(self):
        part = "*PART, NAME=P\n*NODE\n1, 0, 0, 0\n*END PART\n"
        for what, deck, *words in [
                ("no such part", part + "*INSTANCE, NAME=I, PART=Q\n*END INSTANCE\n", "line 5", "no part Q", "P"),
                ("twice", 2 * part, "line 5", "P occurs twice"),
                ("no end", part[:-10], "no *END PART"),
                ("no end of instance", part + "*INSTANCE, NAME=I, PART=P\n", "no *END INSTANCE"),
                ("axis", part + "*INSTANCE, NAME=I, PART=P\n0, 0, 0\n1, 1, 1, 1, 1, 1, 90\n*END INSTANCE\n",
                 "axis of rotation"),
                ("no such instance", "*NSET, NSET=N, INSTANCE=I\n1\n", "line 1", "no instance I"),
                ("no file", "*INCLUDE, INPUT=none.inp\n", "line 1", "none.inp"),
                ("a file in itself", "*INCLUDE, INPUT=bad.inp\n", "20 deep"),
                ("generated nodes", "*NODE\n1, 0, 0, 0\n*NGEN\n1, 5\n", "line 3", "*NGEN"),
                ("face", "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n"
                 "*SURFACE, NAME=S\n1, S5\n", "line 9", "S1 to S4"),
                ("flat", "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 1, 1, 0\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n",
                 "line 7", "element 1", "flat or folded"),
                ("pyramid", "*ELEMENT, TYPE=C3D5\n", "line 1", "C3D5", "C3D10")]:
            with self.subTest(what):
                self.assertRefused(deck, *words)


if __name__ == "__main__":
    unittest.main()
