"""Words: docstrings that can be read by themselves, and long files that begin with a paragraph that orients."""

import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

FILES = sorted([*st.PROJECT.glob("source/*/*.cc"), *st.PROJECT.glob("include/squeal/*/*.h")])
UPWARD = re.compile(r"(The same|Of|Those|That|They)\b")
MOST_UPWARD = 10   # the number that the design asks for
LONG = 300         # lines of a file from which on it must orient its reader
SENTENCES = 3      # lines of its paragraph, at least


def docstrings(text):
    """First lines of comments that begin with ///, with their line numbers."""
    inside = False
    for number, line in enumerate(text.splitlines(), 1):
        found = re.match(r"\s*/// ?(.*)", line)
        if found and not inside:
            yield number, found[1]
        inside = bool(found)


def orients(text):
    """Whether a paragraph of at least SENTENCES lines stands above the first function: of its own, or the comment of a class."""
    lines = text.splitlines()
    number = 0
    while number < len(lines):
        line = lines[number]
        if re.match(r"\s*//", line):
            first = number
            while number < len(lines) and re.match(r"\s*//", lines[number]):
                number += 1
            of_class = number < len(lines) and re.match(r"\s*(template|class|struct)\b", lines[number])
            if number - first >= SENTENCES and (of_class or not line.lstrip().startswith("///")):
                return True
        elif re.match(r"\s*(#|namespace\b|using\b|$|\{|\}|extern\b|(template <[^>]*>|(class|struct) \w+;)$)", line):
            number += 1
        else:
            return False
    return False


class Words(unittest.TestCase):
    def test_docstrings_do_not_refer_upward(self):
        # "The same of the given sums" makes a reader search for what is meant.
        found = [f"{file.relative_to(st.PROJECT)}:{number}: {text}" for file in FILES
                 for number, text in docstrings(file.read_text()) if UPWARD.match(text)]
        self.assertLessEqual(len(found), MOST_UPWARD, "\n".join(["", *found]))

    def test_long_files_orient(self):
        silent = []
        for file in FILES:
            text = file.read_text()
            if len(text.splitlines()) <= LONG:
                continue
            if not orients(text):
                silent.append(str(file.relative_to(st.PROJECT)))
        self.assertFalse(silent, "\n".join(["", *silent]))

    def test_judges(self):
        self.assertEqual([text for _, text in docstrings("/// A.\n/// The same.\nint f();\n  /// Of B.\n")], ["A.", "Of B."])
        three = "// One.\n// Two.\n// Three.\n"
        self.assertTrue(orients("#include <a>\n\n" + three + "\nnamespace a\n{\n"))
        self.assertFalse(orients("#include <a>\n\n// One.\n\n// Two.\n// Three.\nnamespace a\n{\nint f();\n"))
        self.assertFalse(orients("#include <a>\n\nint f();\n" + three))
        docstring = "namespace a\n{\n" + three.replace("//", "  ///")
        self.assertTrue(orients(docstring + "  class A\n"))
        self.assertFalse(orients(docstring + "  int f();\n"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
