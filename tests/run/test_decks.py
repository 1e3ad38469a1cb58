"""Decks as the field writes them: spellings, names, supports, surfaces and joints that --from-deck reads or refuses."""

import pathlib
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

# What a deck says beside the mesh of a small brake, in m, kg, s.
MODEL = """*MATERIAL, NAME=IRON
*ELASTIC
1.25e11, 0.25
*DENSITY
7200.
*MATERIAL, NAME=LINING
*ELASTIC
1e10, 0.3
*DENSITY
2500.
*SOLID SECTION, ELSET=ROTOR, MATERIAL=IRON
*SOLID SECTION, ELSET=UPPER, MATERIAL=LINING
*SOLID SECTION, ELSET=LOWER, MATERIAL=LINING
*SURFACE INTERACTION, NAME=I
*FRICTION
0.4
*CONTACT PAIR, INTERACTION=I
upper.low, rotor.high
lower.high, rotor.low
*BOUNDARY
rotor.inner, 1, 3
upper.high, 1, 2
lower.low, 1, 2
*STEP
*STATIC
*DSLOAD
upper.high, P, 1e6
lower.low, P, 1e6
*MOTION, ROTATION
ALL, 20., 0., 0., 0., 0., 0., 1.
*END STEP
*STEP
*COMPLEX FREQUENCY
20, , 9000.
*END STEP
"""


def small_deck():
    """The mesh without what a deck says beside it: four cells around the disc would be no ring, eight are."""
    text = mesh_files.inp(mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1)), ("C3D8",))
    return text[:text.index("*MATERIAL")]


class Decks(st.TestCase):
    mesh = small_deck()

    def from_deck(self, deck, *options, name="brake.inp"):
        """Return code, what was said, and the lines of the parameter file."""
        (self.directory / name).write_bytes(deck if isinstance(deck, bytes) else deck.encode())
        result = subprocess.run([str(st.SQUEAL), "--from-deck", name, "--overwrite", *options], cwd=self.directory,
                                text=True, capture_output=True, timeout=60, env=st.ENVIRONMENT)
        written = self.directory / name.replace(".inp", ".prm")
        text = written.read_text() if result.returncode == 0 else ""
        return result.returncode, result.stdout + result.stderr, [line.strip() for line in text.splitlines()]

    def written(self, deck, *options, **named):
        status, said, lines = self.from_deck(deck, *options, **named)
        self.assertEqual(status, 0, said)
        return lines

    def test_spellings(self):
        """What the field writes in other ways is the same parameter file."""
        deck = self.mesh + MODEL
        expected = self.written(deck)
        for what, changed in [
                ("byte order mark", b"\xef\xbb\xbf" + deck.encode()),
                ("ends of lines", deck.replace("\n", "\r\n")),
                ("no blanks", deck.replace("*SOLID SECTION", "*SOLIDSECTION").replace("*END STEP", "*ENDSTEP")
                 .replace("*SURFACE INTERACTION", "*SURFACEINTERACTION").replace("*CONTACT PAIR", "*Contactpair")),
                ("more blanks", deck.replace("*SOLID SECTION,", "* SOLID  SECTION ,").replace("ELSET=", " ELSET = ")),
                ("exponents of Fortran", deck.replace("1.25e11", "1.25D+11").replace("7200.", "7.2d3")
                 .replace("2500.", "2.5+3")),
                ("temperatures", deck.replace("type=C3D8,", "type=C3D8RT,")),
                ("a law that nobody uses", deck + "*MATERIAL, NAME=CFRP\n*ELASTIC, TYPE=ORTHO\n1, 1\n*DENSITY\n1600\n")]:
            with self.subTest(what):
                self.assertEqual(self.written(changed), expected)

    def test_names(self):
        """Names that hold what parameter files separate by, and those in quotes."""
        deck = self.mesh + MODEL
        expected = self.written(deck)
        for name, plain in [("UP#1", "UP%231"), ("A:B", "A%3AB"), ('"A,B"', "A%2CB"), ('"A B"', "A B")]:
            with self.subTest(name):
                changed = self.written(deck.replace("upper.low", name))
                self.assertEqual(changed, [line.replace("UPPER.LOW", plain) for line in expected])
                result = st.run("--check", "brake.prm", directory=self.directory)
                self.assertEqual(result.returncode, 0, result.stderr)

    def test_structural_damping(self):
        deck = self.mesh + MODEL.replace("*DENSITY\n2500.", "*DENSITY\n2500.\n*DAMPING, STRUCTURAL=0.02")
        self.assertIn("set Loss factor = 0.02", self.written(deck))


if __name__ == "__main__":
    unittest.main()
