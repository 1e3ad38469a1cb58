"""Small runs of the Debug build, in which deal.II checks every index and every call: what it finds, other tests miss.
Needs build/debug, which scripts/test.sh makes."""

import os
import pathlib
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

BUILD = pathlib.Path(os.environ.get("SQUEAL_DEBUG_BUILD", st.PROJECT / "build/debug"))
DEBUG = BUILD / "squeal"
UNIT_TESTS = BUILD / "tests/unit_tests"

if not DEBUG.exists():
    print(f"SKIPPED: there is no Debug build at {BUILD}; scripts/test.sh makes one.")
    sys.exit(st.SKIPPED)
sources = [file for pattern in ["source/**/*.cc", "include/squeal/**/*.h"] for file in st.PROJECT.glob(pattern)]
if DEBUG.stat().st_mtime < max(file.stat().st_mtime for file in sources):
    print(f"SKIPPED: {DEBUG} is older than the sources; scripts/build.sh debug makes it anew.")
    sys.exit(st.SKIPPED)

TINY = {
    "Discretization/Degree": 2,
    "Discretization/Rotor cells": "2, 9, 1",
    "Discretization/Pad cells": "1, 2, 1",
    "Eigenproblem/Maximum frequency": 3000,
}


# Bars take most of the time here. They are made once for each contact formulation, on a refined mesh, and on two ranks.
NO_BARS = {"Eigenproblem/Error bars": "false"}


class DebugBuild(st.TestCase):
    def compare(self, settings, ranks=1):
        """The Debug build ends without an exception, and finds what the Release build finds."""
        settings = {"Output/Fields": "none", "Eigenproblem/Error bars": "true", **settings}
        release = self.eigenvalues(settings)
        self.assertTrue(release)
        self.assertSameModes(self.eigenvalues(settings, executable=DEBUG, ranks=ranks), release, 1e-8)

    def test_unit_tests(self):
        if not UNIT_TESTS.exists():
            self.skipTest("built without doctest")
        result = subprocess.run([UNIT_TESTS, "--test-suite-exclude=*optimised*"], env=st.ENVIRONMENT,
                                capture_output=True, text=True, timeout=1800)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_mortar_with_fields(self):
        self.compare({**TINY, **st.MORTAR, "Output/Fields": "all", "Output/Animation frames": 2})

    def test_modes_without_factors(self):
        davidson = {"Eigenproblem/Solver": "block_davidson", "Discretization/Degree": 2,
                    "Discretization/Rotor cells": "3, 14, 1"}
        self.compare({**davidson, "Scene": "strip", "Operation/Angular velocity": 2, "Contact/Friction/Coefficient": 0.3,
                      "Eigenproblem/Maximum frequency": 30000})
        self.compare({**davidson, **NO_BARS, "Discretization/Pad cells": "2, 3, 1", "Eigenproblem/Maximum frequency": 800}, ranks=2)

    def test_penalty_with_uniform_pressure(self):
        self.compare({**TINY, **st.PENALTY, "Contact/Steady pressure": "uniform"})

    def test_falling_friction(self):
        self.compare({**TINY, **NO_BARS, "Contact/Friction/Law": "falling", "Pads/Arrangement": "upper"})

    def test_refined_and_graded(self):
        self.compare({**TINY, "Discretization/Degree": 1, "Discretization/Clamp layers": 1,
                      "Discretization/Pad edge layers": 1, "Refinement/Strategy": "uniform", "Refinement/Cycles": 2})

    def test_rotor_of_degree_three(self):
        self.compare({**TINY, **NO_BARS, "Pads/Arrangement": "none", "Stage": "transport", "Discretization/Degree": 3})

    def test_two_ranks(self):
        self.compare({**TINY, **st.MORTAR}, ranks=2)

    def test_matrices(self):
        self.write("one.mtx", "%%MatrixMarket matrix array real general\n2 2\n1\n0\n0\n1\n")
        self.write("four.mtx", "%%MatrixMarket matrix array real general\n2 2\n4\n-2\n2\n4\n")
        self.compare({"Scene": "matrices", "Matrices/Mass": "one.mtx", "Matrices/Stiffness": "four.mtx",
                      "Eigenproblem/Maximum frequency": 1})


if __name__ == "__main__":
    unittest.main(verbosity=2)
