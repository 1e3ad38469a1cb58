"""Decks as the field writes them: spellings, names, supports, surfaces and joints that --from-deck reads or refuses."""

import math
import pathlib
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import cae_deck  # noqa: E402
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

    def test_last_step_counts(self):
        """Loads said again, OP=NEW, friction changed by interaction, motion with its axis from the other end."""
        deck = self.mesh + MODEL.replace("*END STEP\n*STEP\n*COMPLEX", """*END STEP
*STEP
*STATIC
*BOUNDARY, OP=NEW
rotor.inner, 1, 3
upper.high, 1, 3
lower.low, 1, 2
*DSLOAD
upper.high, P, 2e6
lower.low, P, 2e6
*CHANGE FRICTION, INTERACTION=I
*FRICTION
0.5
*MOTION, ROTATION
ALL, 30., 0., 0., 1., 0., 0., 0.
*END STEP
*STEP
*COMPLEX""", 1)
        lines = self.written(deck, "--partial")
        for line in ("set Pressure = 2000000", "set Coefficient = 0.5", "set Angular velocity = -30",
                     "set Guided = LOWER.LOW", "set Clamped = ROTOR.INNER, UPPER.HIGH"):
            self.assertIn(line, lines)

    def test_pressures(self):
        """Several pressures, by surfaces and by faces of elements, have a list of their own, and press with these forces."""
        lines = self.written(self.mesh + MODEL.replace("lower.low, P, 1e6", "lower.low, P, 3e6"))
        self.assertIn("set Pressures = LOWER.LOW : 3000000, UPPER.HIGH : 1000000", lines)
        def forces(*settings):
            result = st.run("brake.prm", "--overwrite", *(part for setting in (
                "Discretization/Degree=1", "Eigenproblem/Solver=none", *settings) for part in ("--set", setting)),
                directory=self.directory)
            self.assertEqual(result.returncode, 0, result.stderr)
            rows = {row["pad"]: row["normal_force_n"] for row in st.read_table(self.directory / "output/brake/static.csv")}
            return rows["LOWER.HIGH"], rows["UPPER.LOW"], result.stdout

        lower, upper, said = forces()
        self.assertIn("Warning, uneven load", said)
        of_lower, of_upper, _ = forces("Mesh/Pressures=", "Mesh/Pressure on=UPPER.HIGH, LOWER.LOW", "Pads/Pressure=1e6")
        self.assertAlmostEqual(lower, 3 * of_lower, delta=1e-9 * lower)
        self.assertAlmostEqual(upper, of_upper, delta=1e-9 * upper)
        lower, upper, _ = forces("Mesh/Pressure on=UPPER.HIGH", "Pads/Pressure=2e6") # beside the surface's own
        self.assertAlmostEqual(lower, 3 * of_lower, delta=1e-9 * lower)
        self.assertAlmostEqual(upper, 3 * of_upper, delta=1e-9 * upper)
        lines = self.written(self.mesh + MODEL.replace("*DSLOAD\n", "*DLOAD\nupper, P2, 1.5e6\n*DSLOAD\n"))
        self.assertIn("set Pressures = DLOAD_UPPER_P2 : 1500000, LOWER.LOW : 1000000, UPPER.HIGH : 1000000", lines)
        self.assertAlmostEqual(forces()[1], 2.5 * of_upper, delta=1e-8 * of_upper)
        lines = self.written(self.mesh + MODEL.replace("*DSLOAD\nupper.high, P, 1e6\n", "*DLOAD\nupper, P2, 1e6\n*DSLOAD\n"))
        self.assertIn("set Pressure on = DLOAD_UPPER_P2, LOWER.LOW", lines)

    def test_units(self):
        """A deck in kg, mm, ms, whose frequencies would be kHz, is warned of by --from-deck; one in t, mm, s is not."""
        for density, young, pressure, warned in (("e-6", "e2", "1e-3", True), ("e-9", "e5", "1", False)):
            deck = (self.mesh + MODEL).replace("1.25e11", f"1.25{young}").replace("1e10", f"0.1{young}").replace(
                "7200.", f"7.2{density}").replace("2500.", f"2.5{density}").replace("P, 1e6", f"P, {pressure}")
            status, said, lines = self.from_deck(deck)
            self.assertEqual(status, 0, said)
            self.assertEqual("Warning, units: the density" in said and "frequencies kHz" in said, warned, said)
            self.assertIn("set Scale = 0.001", lines)

    def force_deck(self, loads, more=""):
        """Of forces instead of the pressure on the upper pad."""
        return self.mesh + more + MODEL.replace("*DSLOAD\nupper.high, P, 1e6\n", loads + "*DSLOAD\n")

    def test_forces(self):
        """Forces on the nodes of a plane surface or on a point that is tied to one are pressures, where they are along its
        normal and at its centre; others are refused with what to do."""
        mesh = mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1))
        faces = mesh.surfaces["upper.high"]
        nodes = sorted({v for face in faces for v in face})
        held = "*NSET, NSET=BACK\n" + "".join(f"{v + 1},\n" for v in nodes)
        area = sum(math.dist(mesh.nodes[a], mesh.nodes[c]) * math.dist(mesh.nodes[b], mesh.nodes[d]) / 2 * abs(math.sin(
            math.atan2(*(mesh.nodes[c][k] - mesh.nodes[a][k] for k in (1, 0))) -
            math.atan2(*(mesh.nodes[d][k] - mesh.nodes[b][k] for k in (1, 0))))) for a, b, c, d in faces)
        middle = [sum(mesh.nodes[v][d] for v in nodes) / len(nodes) for d in range(3)]
        each = -1e6 * area / len(nodes)
        def pressures(deck):
            return {name: float(value) for name, value in (entry.split(" : ") for line in self.written(deck)
                    if "set Pressures" in line for entry in line.split("= ")[1].split(", "))}

        for loads, more in [
                (f"*CLOAD\nBACK, 3, {2 * each!r}\n", held),
                (f"*CLOAD\n900000, 3, {2 * each * len(nodes)!r}\n",
                 "*NODE\n900000, {}, {}, 0.1\n*COUPLING, CONSTRAINT NAME=C, REF NODE=900000, SURFACE=upper.high\n"
                 "*DISTRIBUTING\n1, 6\n".format(*middle))]:
            found = pressures(self.force_deck(loads, more))
            self.assertAlmostEqual(found.pop("LOWER.LOW"), 1e6)
            self.assertAlmostEqual(*found.values(), 2e6, delta=1)
        for loads, word in [("*CLOAD\nBACK, 1, 5.\n", "not along the normal"), ("*CLOAD\n1, 3, 5.\n", "single nodes"),
                            ("*CLOAD\nBACK, 4, 5.\n", "forces 1 to 3"),
                            ("*CLOAD\nrotor.outer, 3, 5.\n", "is not plane")]:
            with self.subTest(word):
                self.refused(self.force_deck(loads, held), "*CLOAD", word)

    def test_deck_as_a_mesh(self):
        """A parameter file that names nothing of what the deck holds, presses and joins is warned of; one that names it is not."""
        deck = self.mesh + MODEL.replace("*STEP", "*MPC\nTIE, 1, 2\n*STEP", 1)
        (self.directory / "brake.inp").write_text(deck)
        self.write("hand.prm", {**mesh_files.SCENE, "Mesh/File": "brake.inp", "Mesh/Guided": ""})
        def warnings(name):
            result = st.run(name, "--set", "Contact/Steady pressure=uniform", "--set", "Discretization/Degree=1", "--set",
                            "Eigenproblem/Solver=none", directory=self.directory)
            self.assertEqual(result.returncode, 0, result.stderr)
            return [line for line in result.stdout.splitlines() if line.startswith("Warning, deck")]

        warning = warnings("hand.prm")[0]
        self.assertIn("*BOUNDARY UPPER.HIGH; *BOUNDARY LOWER.LOW; brake.inp, line", warning)
        self.assertIn("*MPC", warning)
        for word in ("pressure", "CONTACT", "INNER"):
            self.assertNotIn(word, warning)
        self.written(self.mesh + MODEL)
        self.assertFalse(warnings("brake.prm"))

    def test_points_that_are_held(self):
        """A support of a coupling's node, of rotations only, too, is no support of faces."""
        coupling = ("*NODE\n900000, 0., 0., 0.1\n*NSET, NSET=REF\n900000\n*COUPLING, CONSTRAINT NAME=C, REF NODE=REF, "
                    "SURFACE=upper.high\n*DISTRIBUTING\n1, 6\n")
        mesh = mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1))
        inner = sorted({v for face in mesh.surfaces["rotor.inner"] for v in face})
        for support in ("REF, 4, 6", "BOTH, 1, 3"):
            with self.subTest(support):
                both = "".join(["*NSET, NSET=BOTH\nREF\n", *(f"{v + 1}\n" for v in inner)]) if "BOTH" in support else ""
                self.refused(self.mesh + coupling + both + MODEL.replace("*BOUNDARY\n", "*BOUNDARY\n" + support + "\n"),
                             "*BOUNDARY", "*COUPLING")

    def test_friction_and_stiffness(self):
        falling = MODEL.replace("*FRICTION\n0.4", "*FRICTION, EXPONENTIAL DECAY\n0.5, 0.3, 0.4")
        lines = self.written(self.mesh + falling)
        for line in ("set Law = falling", "set Coefficient = 0.5", "set Coefficient at speed = 0.3", "set Decay speed = 2.5"):
            self.assertIn(line, lines)
        lines = self.written(self.mesh + MODEL.replace("*FRICTION\n0.4", "*FRICTION\n0.4, 0.\n0.2, 2."))
        self.assertIn("set Expression = (0.3+(-0.05)*abs(v-0)+(0.05)*abs(v-2))", lines)
        lines = self.written(self.mesh + MODEL.replace(
            "*FRICTION", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1e12\n*FRICTION"))
        self.assertIn("set Penalty stiffness = 1000000000000", lines)
        self.refused(self.mesh + MODEL.replace("lower.high, rotor.low\n", "*CONTACT PAIR, INTERACTION=J\nlower.high, rotor.low\n")
                     .replace("*SURFACE INTERACTION", "*SURFACE INTERACTION, NAME=J\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE="
                              "LINEAR\n1e12\n*FRICTION\n0.4\n*SURFACE INTERACTION"), "give all pairs the same one")

    def test_directions(self):
        """A cylinder's radius and circle together are the plane; one of them alone is no component."""
        turned = MODEL.replace("*BOUNDARY\n", "*TRANSFORM, NSET=upper.high, TYPE=C\n0, 0, 0, 0, 0, 1\n*BOUNDARY\n")
        deck = self.mesh + turned
        nodes = sorted({v for face in mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1)).surfaces["upper.high"]
                        for v in face})
        held = "*NSET, NSET=HELD\n" + "".join(f"{v + 1},\n" for v in nodes)
        deck = deck.replace("*TRANSFORM, NSET=upper.high", held + "*TRANSFORM, NSET=HELD").replace(
            "upper.high, 1, 2", "HELD, 1, 2")
        self.assertIn("set Guided = HELD, LOWER.LOW", self.written(deck))
        status, said, _ = self.from_deck(deck.replace("HELD, 1, 2", "HELD, 1, 1"))
        self.assertEqual(status, 2, said)
        self.assertIn("*TRANSFORM", said)

    def test_refuses_what_carries(self):
        """What carries load, holds, joins, turns or is unknown is refused by its line; --partial says it at its place."""
        for what, added, word in [
                ("general contact", "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n", "ALL EXTERIOR"),
                ("multi-point constraints", "*MPC\nTIE, 1, 2\n", "*MPC"),
                ("equations", "*EQUATION\n2\n1, 1, 1., 2, 1, -1.\n", "*EQUATION"),
                ("rigid bodies", "*RIGID BODY, REF NODE=1, ELSET=UPPER\n", "*RIGID BODY"),
                ("bolts", "*PRE-TENSION SECTION, SURFACE=upper.high, NODE=1\n", "*PRE-TENSION SECTION"),
                ("rigid couplings", "*COUPLING, CONSTRAINT NAME=C, REF NODE=1, SURFACE=upper.high\n*KINEMATIC\n1, 3\n",
                 "*KINEMATIC"),
                ("forces", "*STEP\n*STATIC\n*CLOAD\n1, 3, 5.\n*END STEP\n", "*CLOAD"),
                ("gravity", "*STEP\n*STATIC\n*DLOAD\nUPPER, GRAV, 9.81, 0., 0., -1.\n*END STEP\n", "GRAV"),
                ("removed elements", "*STEP\n*STATIC\n*MODEL CHANGE, REMOVE\nUPPER\n*END STEP\n", "*MODEL CHANGE"),
                ("shells", "*SHELL SECTION, ELSET=UPPER, MATERIAL=IRON\n1.\n", "*SHELL SECTION"),
                ("unknown keywords", "*WONDER\n1.\n", "*WONDER")]:
            with self.subTest(what):
                deck = self.mesh + MODEL.replace("*STEP\n", added + "*STEP\n", 1)
                status, said, _ = self.from_deck(deck)
                self.assertEqual(status, 2, said)
                self.assertIn(word, said)
                self.assertIn("brake.inp, line", said)
                lines = self.written(deck, "--partial")
                self.assertTrue([line for line in lines if line.startswith("# Left out:") and word in line], lines)

    def test_refusals_say_what_to_do(self):
        """A surface of nodes, one on shells alone, the edge of a shell and an empty section are refused with advice."""
        shell = "*ELEMENT, TYPE=S4, ELSET=SKIN\n90001, 1, 2, 4, 3\n"
        for what, before, after, words in [
                ("nodes", "upper.low, rotor.high", "low, rotor.high", "S1 to S6; nodes (TYPE=NODE) have none"),
                ("shells", "upper.low, rotor.high", "skin, rotor.high", "mesh what they stand for with solids"),
                ("edge", "upper.low, rotor.high", "edge, rotor.high", "Name a face of the solid below it"),
                ("section", "ELSET=LOWER, MAT", "ELSET=NONE_OF_THEM, MAT", "take the section out of the deck")]:
            with self.subTest(what):
                surfaces = {"nodes": "*SURFACE, NAME=LOW, TYPE=NODE\n1, 2\n", "edge": "*SURFACE, NAME=EDGE\n90001, S2\n",
                            "shells": "*SURFACE, NAME=SKIN\n90001, SPOS\n"}.get(what, "")
                status, said, _ = self.from_deck(self.mesh + shell + surfaces + MODEL.replace(before, after))
                self.assertEqual(status, 2, said)
                self.assertIn(words, said)

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

    def modes_of(self, *settings):
        result = st.run("brake.prm", "--overwrite", *(part for setting in settings for part in ("--set", setting)),
                        directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return st.read_table(self.directory / "output" / "brake" / "modes.csv")

    def refused(self, deck, *words):
        """Refused with these words, and written with --partial."""
        status, said, _ = self.from_deck(deck)
        self.assertEqual(status, 2, said)
        for word in words:
            self.assertIn(word, said)
        return self.written(deck, "--partial")

    def test_what_turns(self):
        """DISC_PAD is no disc; where both sides of a pair have such names, they are asked for."""
        deck = (self.mesh + MODEL).replace("ELSET=UPPER", "ELSET=DISC_PAD").replace("elset=UPPER", "elset=DISC_PAD")
        lines = self.written(deck)
        self.assertIn("set Rotor = ROTOR", lines)
        self.assertIn("set Pads = DISC_PAD, LOWER", lines)
        status, said, _ = self.from_deck(deck.replace("DISC_PAD", "DISC_TWO"))
        self.assertEqual(status, 2)
        self.assertIn("--rotor NAME", said)

    def test_name_of_the_file(self):
        """A # in the deck's name: the file is read, and the parameters that a run writes are those of the run."""
        self.written(self.mesh + MODEL, name="a#b.inp")
        settings = [part for setting in ("Discretization/Degree=1", "Eigenproblem/Solver=none", "Output/Directory=out")
                    for part in ("--set", setting)]
        result = st.run("a#b.prm", *settings, directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertRegex((self.directory / "out" / "parameters.prm").read_text(), 'set File += "a#b.inp"')

    def test_arguments(self):
        deck = self.mesh + MODEL
        for options in (["other.prm"], ["--set", "Mesh/Scale=1"], ["--check"], ["--rotor", "A", "--rotor", "B"],
                        ["--speed", "fast"]):
            with self.subTest(options):
                status, said, _ = self.from_deck(deck, *options)
                self.assertEqual(status, 2, said)
        self.assertEqual(st.run("--rotor", "A", "brake.prm", directory=self.directory).returncode, 2)

    def test_speed_and_window(self):
        """The speed is asked for, where the deck is silent; a number of modes sets the window."""
        deck = self.mesh + MODEL.replace("*MOTION, ROTATION\nALL, 20., 0., 0., 0., 0., 0., 1.\n", "")
        status, said, _ = self.from_deck(deck)
        self.assertEqual(status, 2)
        self.assertIn("--speed VALUE", said)
        deck = deck.replace("*COMPLEX FREQUENCY\n20, , 9000.", "*FREQUENCY\n6")
        lines = self.written(deck, "--speed", "-12")
        self.assertIn("set Angular velocity = -12", lines)
        window = float(next(line for line in lines if "Maximum frequency" in line).split("=")[1])
        self.assertGreater(window, 100)
        count = len(self.modes_of("Stage=elastic", "Discretization/Degree=2", "Eigenproblem/Error bars=false"))
        self.assertTrue(6 <= count <= 20, count)

    def test_one_surface(self):
        """Both faces of the disc, or a skin with its rims, and both linings in one surface: the pairs are found, and
        the modes are those of the surfaces one by one."""
        deck = self.mesh + MODEL
        self.written(deck)
        settings = ("Discretization/Degree=1", "Eigenproblem/Error bars=false", "Output/Fields=none")
        expected = self.modes_of(*settings)
        pairs = MODEL[MODEL.index("upper.low, rotor"):MODEL.index("*BOUNDARY")]
        surfaces = "*SURFACE, NAME=FACES\n{}\n*SURFACE, NAME=LININGS\nUPPER, S1\nLOWER, S2\n"
        for faces, new, numbers in [("ROTOR, S1\nROTOR, S2", "upper.low, FACES\nlower.high, FACES\n", (2, 1)),
                                    ("ROTOR", "LININGS, FACES\n", (2, 1))]:
            changed = self.mesh + surfaces.format(faces) + MODEL.replace(pairs, new)
            pair = next(line for line in self.written(changed) if "Contact pairs" in line)
            for number in numbers:
                self.assertIn(f": FACES({number})", pair)
            self.assertSameModes(*([st.eigenvalue(row) for row in table]
                                   for table in (self.modes_of(*settings), expected)), 1e-9)

    def test_supports(self):
        """By numbers of nodes, and by sets of elements; edges are refused."""
        deck = self.mesh + MODEL
        mesh = mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1))
        nodes = sorted({v + 1 for face in mesh.surfaces["rotor.inner"] for v in face})
        def model(lines):
            return [line.replace("ROTOR.INNER", "BOUNDARY-1-1-3") for line in lines[:lines.index("# Passed over:")]]

        expected = model(self.written(deck))
        for text in ("".join(f"{node}, 1, 3\n" for node in nodes), "\n*BOUNDARY\n".join(f"{n}, 1, 3" for n in nodes) + "\n"):
            self.assertEqual(model(self.written(deck.replace("rotor.inner, 1, 3\n", text))), expected)
        self.refused(deck.replace("rotor.inner, 1, 3\n", "rotor.inner, 1, 3\n" + f"{max(nodes) + 1}, 1, 3\n"),
                     "1 of 1", "Edges and single nodes hold nothing", "--partial")

    def test_blocks(self):
        """Ties with the larger side as slave, and with a part of it only; a set of the nodes of elements."""
        def block(first, x, y, z):
            """Cells of 1 with corners at these coordinates, as text, and the numbers of the top's or bottom's cells."""
            number = {(i, j, k): first + n for n, (k, j, i) in enumerate(
                (k, j, i) for k in range(len(z)) for j in range(len(y)) for i in range(len(x)))}
            lines = ["*NODE"] + [f"{n}, {x[i]}, {y[j]}, {z[k]}" for (i, j, k), n in number.items()]
            lines += [f"*ELEMENT, TYPE=C3D8, ELSET=B{first}"]
            corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
            for e, (j, i) in enumerate((j, i) for j in range(len(y) - 1) for i in range(len(x) - 1)):
                lines += [f"{first + e}, " + ", ".join(str(number[i + a, j + b, k]) for k in (0, 1) for a, b in corners)]
            return "\n".join(lines + [""])

        beside = ("*SURFACE, NAME=BIG\n2, S2\n3, S2\n4, S2\n6, S2\n7, S2\n8, S2\n*SURFACE, NAME=SMALL\nB101, S1\n"
                  "*MATERIAL, NAME=M\n*ELASTIC\n1e9, 0.3\n*DENSITY\n1000\n*SOLID SECTION, ELSET=B1, MATERIAL=M\n"
                  "*SOLID SECTION, ELSET=B101, MATERIAL=M\n*TIE, NAME=T\nBIG, SMALL\n*ELSET, ELSET=END\n1, 5\n"
                  "*NSET, NSET=HELD, ELSET=END\n*BOUNDARY\nHELD, PINNED\n*STEP\n*FREQUENCY\n1, , 300\n*END STEP\n")
        deck = block(1, range(5), range(3), (0, 1)) + "{}" + beside
        lines = self.written(deck.format(block(101, (1, 2, 3), range(3), (1, 2))), "--rotor", "none")
        self.assertIn("set Ties = SMALL : BIG", lines)
        lines = self.written(deck.format(block(101, (1, 2, 3), range(3), (1, 2))).replace("*TIE", "*TIE, POSITION TOLERANCE=0.02"),
                             "--rotor", "none")
        self.assertIn("set Position tolerance = 0.02", lines)
        self.assertIn("set Clamped = HELD", lines)
        half = deck.format(block(101, (3, 4, 5), range(3), (1, 2)))
        status, said, _ = self.from_deck(half, "--rotor", "none")
        self.assertEqual(status, 2, said)
        self.assertIn(": partly", said)
        self.written(half, "--rotor", "none", "--partial")
        self.assertGreater(len(self.modes_of("Joints/Ties=SMALL : BIG : partly", "Discretization/Degree=1")), 0)


class SevenParts(st.TestCase):
    def test_from_deck(self):
        """A deck as CAE writes it, in mm, t, s: written, run, a page of it, and the modes of a flat deck in SI."""
        deck, nodes = cae_deck.parts(cae_deck.elements())
        self.write("nodes.txt", nodes)
        tables = []
        for name, text in (("job-1", deck), ("flat", cae_deck.flat(cae_deck.elements()))):
            self.write(f"{name}.inp", text)
            for arguments in (["--from-deck", f"{name}.inp"],
                              [f"{name}.prm", "--set", "Eigenproblem/Error bars=false", "--set", "Output/Fields=none"]):
                result = st.run(*arguments, directory=self.directory)
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            tables.append(st.read_table(self.directory / "output" / name / "modes.csv"))
        self.assertGreater(len(tables[0]), 5)
        self.assertSameModes(*([st.eigenvalue(row) for row in table] for table in tables), 1e-9)
        self.assertGreater(max(abs(row["growth_rate_1_per_s"]) for row in tables[0]), 1)
        page = subprocess.run([sys.executable, st.PROJECT / "scripts/report.py", "output/job-1"], cwd=self.directory, text=True,
                              capture_output=True, timeout=60)
        self.assertEqual(page.returncode, 0, page.stderr)
        self.assertIn("PISTON_LOW.LOW : 5000000", (self.directory / "output/job-1/report.html").read_text())


if __name__ == "__main__":
    unittest.main()
