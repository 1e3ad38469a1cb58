"""cmake --install: what is installed runs from anywhere, with the examples and scripts that came with it."""

import os
import pathlib
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

BUILD = st.SQUEAL.parent


class Install(st.TestCase):
    def setUp(self):
        super().setUp()
        self.prefix = self.directory / "prefix"
        self.shared = self.prefix / "share/squeal"
        self.elsewhere = self.directory / "elsewhere"
        self.elsewhere.mkdir()
        result = subprocess.run(["cmake", "--install", BUILD, "--prefix", self.prefix], capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def execute(self, *command):
        """Runs in a directory that has nothing to do with the project, with no more than a user's environment."""
        environment = {"PATH": os.environ["PATH"], "OMP_NUM_THREADS": "1", "HOME": str(self.elsewhere)}
        result = subprocess.run([str(word) for word in command], cwd=self.elsewhere, env=environment,
                                capture_output=True, text=True, timeout=300)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return result.stdout

    def test_runs_from_anywhere(self):
        """An example writes its results where the user stands; the report is made of them."""
        program = self.prefix / "bin/squeal"
        self.assertIn("squeal ", self.execute(program, "--version"))
        self.execute(program, self.shared / "prm/strip.prm")
        self.assertEqual(len(st.read_table(self.elsewhere / "output/strip/modes.csv")), 10)
        self.execute(sys.executable, self.shared / "scripts/report.py", "output/strip")
        self.assertTrue((self.elsewhere / "output/strip/report.html").exists())

    def test_scripts_find_the_program(self):
        help_text = self.execute(sys.executable, self.shared / "scripts/root_locus.py", "--help")
        self.assertIn("--program", help_text)
        source = (self.shared / "scripts/root_locus.py").read_text()
        self.assertIn("bin/squeal", source)

    def test_debian_package(self):
        """What cpack packs unpacks to a program that runs; it depends on the libraries that the program loads."""
        if not (shutil.which("dpkg-shlibdeps") and shutil.which("file")):
            self.assertNotEqual(os.environ.get("CI"), "true", "scripts/install-dependencies.sh --package")
            self.skipTest("needs dpkg-dev and file: scripts/install-dependencies.sh --package")
        self.execute("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", self.directory / "package")
        package, = (self.directory / "package").glob("squeal_*.deb")
        depends = self.execute("dpkg-deb", "--field", package, "Depends")
        for library in ("libdeal.ii", "libopenmpi3", "libc6", "libopenblas0-pthread"):
            self.assertIn(library, depends)
        self.execute("dpkg-deb", "--extract", package, self.directory / "root")
        self.execute(self.directory / "root/usr/bin/squeal", self.directory / "root/usr/share/squeal/prm/strip.prm")
        self.assertEqual(len(st.read_table(self.elsewhere / "output/strip/modes.csv")), 10)

    def test_one_version(self):
        """CITATION.cff, the Python package and the program."""
        version = self.execute(self.prefix / "bin/squeal", "--version").split()[1]
        self.assertIn(f"\nversion: {version}\n", (st.PROJECT / "CITATION.cff").read_text())
        self.assertIn(f'\nversion = "{version}"\n', (st.PROJECT / "python/pyproject.toml").read_text())

    def test_what_is_installed(self):
        for name in ["README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE", "doc/python.md", "python/squeal/__init__.py", "doc/tutorial.md", "doc/results.md", "doc/theory.md",
                     "doc/images",
                     "prm/brake.prm", "prm/theory/mass.mtx", "scripts/report.py", "scripts/plot.py"]:
            self.assertTrue((self.shared / name).exists(), name)


if __name__ == "__main__":
    unittest.main(verbosity=2)
