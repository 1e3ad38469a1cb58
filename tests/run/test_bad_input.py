"""Wrong input ends with exit status 2, a message that names the place and the key, and no results."""

import pathlib
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

ZERO_MATRIX_FILES = {"Scene": "matrices", "Matrices/Mass": "mass.mtx", "Matrices/Stiffness": "stiffness.mtx"}
UNIT_2 = "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n2 2 1\n"
UNIT_3 = "%%MatrixMarket matrix coordinate real general\n3 3 3\n1 1 1\n2 2 1\n3 3 1\n"


class BadInput(st.TestCase):
    def assertRefused(self, arguments, *words, ranks=1):
        """Exit status 2, every word in the message, and no mode written."""
        result = st.run(*arguments, ranks=ranks, directory=self.directory, timeout=60)
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertEqual(result.stderr.count("squeal: "), 1, f"one message is wanted, not\n{result.stderr}")
        for table in self.directory.rglob("modes.csv"):
            self.assertEqual(st.read_table(table), [])

    def assertFileRefused(self, content, *words, name="bad.prm"):
        self.write(name, content)
        self.assertRefused([name], *words)

    # Keys and values of a parameter file

    def test_unknown_key(self):
        self.assertFileRefused("set Stage = full\nsubsection Rotor\n  set Thicknes = 0.01\nend\n",
                               "bad.prm:3", "Rotor/Thicknes", "Rotor/Thickness'")

    def test_key_in_the_wrong_section(self):
        self.assertFileRefused("subsection Contact\n  set Coefficient = 0.3\nend\n",
                               "bad.prm:2", "Contact/Coefficient", "Contact/Friction/Coefficient'")

    def test_misspelt_value(self):
        self.assertFileRefused({"Contact/Formulation": "morter"},
                               "bad.prm:2", "Contact/Formulation", "morter", "mortar", "penalty")

    def test_text_instead_of_number(self):
        self.assertFileRefused({"Rotor/Thickness": "12 mm"}, "bad.prm:2", "Rotor/Thickness", "12 mm")

    def test_decimal_comma(self):
        self.assertFileRefused({"Contact/Friction/Coefficient": "0,6"}, "bad.prm:3", "Contact/Friction/Coefficient")

    def test_not_a_number(self):
        for value in ["nan", "inf", "-inf", "1e400"]:
            with self.subTest(value):
                self.assertFileRefused({"Operation/Angular velocity": value},
                                       "bad.prm:2", "Operation/Angular velocity", value)

    def test_negative_thickness(self):
        self.assertFileRefused({"Rotor/Thickness": -0.01}, "bad.prm:2", "Rotor/Thickness", "-0.01")

    def test_pad_outside_of_the_rotor(self):
        self.assertFileRefused({"Pads/Outer radius": 0.2}, "bad.prm", "Pads/Outer radius", "0.2", "0.15")

    def test_inner_radius_above_outer_radius(self):
        self.assertFileRefused({"Rotor/Inner radius": 0.2}, "bad.prm", "Rotor/Inner radius", "Rotor/Outer radius")

    def test_incompressible_material(self):
        for body in ["Rotor", "Pads"]:
            with self.subTest(body):
                self.assertFileRefused({f"{body}/Material/Poisson ratio": 0.5},
                                       "bad.prm", f"{body}/Material/Poisson ratio", "0.5")

    def test_no_cells(self):
        self.assertFileRefused({"Discretization/Rotor cells": "0, 18, 1"}, "bad.prm:2", "Discretization/Rotor cells")

    def test_too_few_numbers_of_cells(self):
        self.assertFileRefused({"Discretization/Pad cells": "3, 6"}, "bad.prm:2", "Discretization/Pad cells")

    def test_friction_damping_at_rest(self):
        # P_R and Q_R of the turning sliding direction grow like 1/Omega.
        self.assertFileRefused({"Operation/Angular velocity": 0, "Stage": "full"},
                               "bad.prm", "Operation/Angular velocity", "friction_damping")

    # Form of a parameter file

    def test_very_long_values(self):
        """Of a megabyte: refused at once. Lists of numbers once took 14 s, a directory ended the stack."""
        numbers = "1," * 500_000 + "1"
        for key, words in (("Discretization/Rotor cells", "1000001 characters"), ("Sweep/Values", "1000001 characters"),
                           ("Pads/Pressure profile", "1000001 characters")):
            start = time.monotonic()
            self.assertFileRefused({key: numbers}, key, words)
            self.assertLess(time.monotonic() - start, 5, key)
        self.assertFileRefused({"Output/Directory": "d" * 100_000}, "Output/Directory", "100000 characters")
        self.assertFileRefused({"Output/Directory": "d" * 60_000}, "Output/Directory", "File name too long")
        self.assertFileRefused({"Refinement/Reference": "d" * 300}, "Refinement/Reference", "cannot be read")
        self.assertFileRefused({"K" * 1_000_000: 1}, "1000000 characters")

    def test_set_without_equals_sign(self):
        self.assertFileRefused("subsection Rotor\n  set Thickness 0.01\nend\n", "bad.prm:2", "set Thickness 0.01")

    def test_open_subsection(self):
        self.assertFileRefused("subsection Rotor\n  set Thickness = 0.01\n", "bad.prm", "Rotor", "end")

    def test_end_of_nothing(self):
        self.assertFileRefused("set Stage = full\nend\n", "bad.prm:2", "end")

    def test_unknown_statement(self):
        self.assertFileRefused("\nSubsection Rotor\nend\n", "bad.prm:2", "Subsection Rotor")

    def test_unknown_empty_subsection(self):
        self.assertFileRefused("subsection Rottor\nend\n", "bad.prm", "Rottor")

    def test_byte_order_marks(self):
        """In front of parameter files, those that they include, and tables of numbers they say nothing."""
        mark = "\ufeff"
        (self.directory / "more.prm").write_text(mark + "set Stage = full\n", encoding="utf-8")
        (self.directory / "moduli.csv").write_text(
            mark + "frequency_hz,storage_modulus_pa,loss_factor\n50,1e10,0.01\n10000,1.1e10,0.02\n", encoding="utf-8")
        (self.directory / "mark.prm").write_text(mark + "include more.prm\nsubsection Pads\n  subsection Material\n"
                                                 "    set Modulus table = moduli.csv\n  end\nend\n", encoding="utf-8")
        result = st.run("--check", "mark.prm", directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    # Matrix files

    def test_missing_matrix_file(self):
        self.assertFileRefused(ZERO_MATRIX_FILES, "Matrices/Mass", "mass.mtx")

    def test_required_matrix_not_given(self):
        self.write("mass.mtx", UNIT_2)
        self.assertFileRefused({"Scene": "matrices", "Matrices/Mass": "mass.mtx"}, "Matrices/Stiffness")

    def test_malformed_matrix_file(self):
        self.write("mass.mtx", UNIT_2)
        header = "%%MatrixMarket matrix coordinate real general\n"
        for what, text, line in [
                ("no header", "2 2 1\n1 1 1\n", 1),
                ("complex", "%%MatrixMarket matrix coordinate complex general\n2 2 1\n1 1 1 0\n", 1),
                ("no size", header + "two by two\n", 2),
                ("too few entries", header + "2 2 2\n1 1 1\n", 3),
                ("too many entries", header + "2 2 1\n1 1 1\n2 2 1\n", 4),
                ("outside", header + "2 2 1\n3 1 1\n", 3),
                ("not a number", header + "% a comment\n2 2 1\n1 1 one\n", 4),
                ("nan", header + "2 2 1\n1 1 nan\n", 3)]:
            with self.subTest(what):
                self.write("stiffness.mtx", text)
                self.assertFileRefused(ZERO_MATRIX_FILES, "Matrices/Stiffness", "stiffness.mtx", f"line {line}")

    def assertGivesUp(self, settings, *words):
        """Exit status 3 and one message in which no word is a library's."""
        self.write("bad.prm", settings)
        result = st.run("bad.prm", directory=self.directory, timeout=100)
        self.assertEqual(result.returncode, 3, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertNotRegex(result.stderr, "INFOG|LAPACK|MUMPS|std::")

    def test_zero_matrices(self):
        self.write("mass.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 0\n")
        self.write("stiffness.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 0\n")
        self.assertGivesUp(ZERO_MATRIX_FILES, "all its entries are zero")

    def test_cells_without_thickness(self):
        """20 clamp layers: the thinnest cell is below rounding for the error bars."""
        self.assertGivesUp({"Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1",
                            "Discretization/Pad cells": "1, 2, 1", "Discretization/Clamp layers": 20,
                            "Eigenproblem/Maximum frequency": 3000, "Output/Fields": "none"},
                           "error bars", "Clamp layers")

    def test_matrices_of_different_size(self):
        self.write("mass.mtx", UNIT_2)
        self.write("stiffness.mtx", UNIT_3)
        self.assertFileRefused(ZERO_MATRIX_FILES, "Matrices/Stiffness", "3 x 3", "2 x 2")

    # Files and command line

    def test_missing_file(self):
        self.assertRefused(["missing.prm"], "missing.prm")

    def test_directory_instead_of_file(self):
        (self.directory / "case.prm").mkdir()
        self.assertRefused(["case.prm"], "case.prm")

    def test_unwritable_directory(self):
        # Root may write anywhere, but nobody makes a directory below a regular file.
        self.write("file", "")
        self.assertFileRefused({"Output/Directory": "file/results"}, "Output/Directory", "file/results")

    def test_unknown_option(self):
        self.write("good.prm", st.SMALL_BRAKE)
        self.assertRefused(["good.prm", "--chek"], "--chek")

    def test_no_file(self):
        self.assertRefused([], "parameter file")

    def test_two_files(self):
        self.write("good.prm", st.SMALL_BRAKE)
        self.assertRefused(["good.prm", "better.prm"], "good.prm", "better.prm")

    def test_unknown_format_of_the_manual(self):
        self.assertRefused(["--print-parameters=xml"], "xml", "json")

    def test_malformed_set(self):
        self.write("good.prm", st.SMALL_BRAKE)
        for argument, *words in [("Contact/Friction/Coefficient", "Contact/Friction/Coefficient"),
                                 ("Contact/Friction/Coeficient=0.1", "'Contact/Friction/Coefficient'"),
                                 ("Discretization/Degree=2.5", "Discretization/Degree", "2.5"),
                                 ("=1", "=1")]:
            with self.subTest(argument):
                self.assertRefused(["good.prm", "--set", argument], "--set", *words)
        self.assertRefused(["good.prm", "--set"], "--set")

    # In parallel one rank speaks, and no rank hangs.

    def test_parallel(self):
        self.write("bad.prm", {"Rotor/Thickness": -1})
        self.assertRefused(["bad.prm"], "bad.prm:2", "Rotor/Thickness", ranks=2)

    def test_parallel_unwritable_directory(self):
        # Only the first rank writes: the others must learn that it failed.
        self.write("file", "")
        self.write("bad.prm", {"Output/Directory": "file/results"})
        self.assertRefused(["bad.prm"], "Output/Directory", ranks=2)


if __name__ == "__main__":
    unittest.main(verbosity=2)
