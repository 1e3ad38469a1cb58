"""Tetrahedra, wedges and quadratic elements, divided into hexahedra, and decks with parts and instances."""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import element_files  # noqa: E402
import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

# Pads with straight edges: divided, they are the same bodies.
BRAKE = {**st.SMALL_BRAKE, **mesh_files.SCENE, "Discretization/Degree": 2, "Mesh/Curved bodies": "rotor"}


def pads_of(n_corners):
    """The default brake, whose pads' cells become elements with so many corners."""
    return element_files.Elements(mesh_files.brake(), lambda name: 8 if name == "rotor" else n_corners)


def on_circle(a, b):
    """Half way along the circle about z between two places, as the program's curved bodies have it."""
    x, y, z = ((p + q) / 2 for p, q in zip(a, b))
    r, straight = (math.hypot(*a[:2]) + math.hypot(*b[:2])) / 2, math.hypot(x, y)
    return x * r / straight, y * r / straight, z


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
        quadratic elements with middle nodes half way, both formats and two ranks have the same modes."""
        expected, _ = self.run_mesh(pads_of(8))
        for n_corners, kind in [(4, "tetrahedron"), (6, "wedge")]:
            with self.subTest(kind):
                modes, log = self.run_mesh(pads_of(n_corners))
                self.assertWithinBars(modes, expected)
                n = {4: 2 * 6 * 6, 6: 2 * 6 * 2}[n_corners]  # two pads of six cells
                self.assertIn(f"{n} linear {kind} elements", log)
                self.assertIn(f"Of them {n} are divided: {54 + n * {4: 4, 6: 3}[n_corners]} hexahedra", log)
                quadratic = pads_of(n_corners)
                quadratic.make_quadratic({"rotor": on_circle})
                for name, writer, ranks in [("quadratic.inp", element_files.inp, 1),
                                            ("quadratic.msh", element_files.msh2, 2)]:
                    self.assertEqualModes(self.run_mesh(quadratic, name, writer, ranks=ranks)[0], modes, 1e-8)

    def test_quadratic_hexahedra(self):
        """Middle nodes on the circles that bodies follow anyway change nothing."""
        settings = {"Mesh/Curved bodies": "all", "Discretization/Degree": 1}
        expected, _ = self.run_mesh(pads_of(8), settings=settings)
        quadratic = pads_of(8)
        quadratic.make_quadratic(dict.fromkeys(quadratic.volumes, on_circle))
        for name, writer in [("quadratic.inp", element_files.inp), ("quadratic.msh", element_files.msh2)]:
            modes, log = self.run_mesh(quadratic, name, writer, settings)
            self.assertEqualModes(modes, expected, 1e-9)
            self.assertIn("Of them 0 are divided", log)

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

    def assertRefused(self, deck, *words):
        self.write("bad.inp", deck)
        self.write("bad.prm", {**BRAKE, "Mesh/File": "bad.inp"})
        result = st.run("bad.prm", directory=self.directory, timeout=60)
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)

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
