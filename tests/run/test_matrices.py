"""Eigenproblems given as matrices: small ones with known solutions, in all forms of Matrix Market files."""

import cmath
import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402


def array(*rows):
    """A matrix as a dense Matrix Market file (column by column)."""
    lines = ["%%MatrixMarket matrix array real general", "% written by a test", f"{len(rows)} {len(rows[0])}"]
    return "\n".join(lines + [repr(row[j]) for j in range(len(rows[0])) for row in rows]) + "\n"


class Matrices(st.TestCase):
    def solve(self, names, **settings):
        """Eigenvalues with Im l >= 0 below 1 Hz, found alike by all solvers."""
        case = {"Scene": "matrices", "Eigenproblem/Maximum frequency": 1,
                **{f"Matrices/{key}": name for key, name in names.items()},
                **{f"Matrices/{key}".replace("_", " "): value for key, value in settings.items()}}
        found = {solver: self.eigenvalues({**case, "Eigenproblem/Solver": solver})
                 for solver in ["block_krylov", "krylov", "dense"]}
        self.assertEqual(len(found["krylov"]), len(found["dense"]))
        self.assertEqual(len(found["block_krylov"]), len(found["dense"]))
        return found["block_krylov"]

    def zieglers_pendulum(self, p, b=None):
        """M = [[3,1],[1,1]], D = b [[2,-1],[-1,1]], K + p N = [[2-p, p-1],[-1,1]]: two rods under a follower load p."""
        self.write("mass.mtx", array([3, 1], [1, 1]))
        self.write("stiffness.mtx", array([2, -1], [-1, 1]))
        self.write("load.mtx", array([-1, 1], [0, 0]))
        files = {"Mass": "mass.mtx", "Stiffness": "stiffness.mtx", "Circulatory": "load.mtx"}
        if b is not None:
            self.write("damping.mtx", array([2 * b, -b], [-b, b]))
            files["Velocity"] = "damping.mtx"
        return self.solve(files, Circulatory_factor=p)

    def test_pendulum_undamped(self):
        # det(l^2 M + K + p N) = 2 l^4 + (7 - 2 p) l^2 + 1: flutter above p = 7/2 - sqrt 2, there l^4 = -1/2 ... so
        # w = 2^(-1/4).
        critical = 3.5 - math.sqrt(2)
        for l in self.zieglers_pendulum(critical - 0.01):
            self.assertLess(abs(l.real), 1e-10)
        # The double eigenvalue splits like a square root: a distance of 1e-6 in p is 1e-3 in l.
        for l in self.zieglers_pendulum(critical + 1e-6):
            self.assertLess(abs(l - 2 ** -0.25 * 1j), 1e-3)
        self.assertSameModes(self.zieglers_pendulum(2.2),
                             [0.16897749 + 0.82374352j, -0.16897749 + 0.82374352j], 1e-7)
        l = cmath.sqrt((-(7 - 4.4) + cmath.sqrt((7 - 4.4) ** 2 - 8)) / 4)
        self.assertSameModes(self.zieglers_pendulum(2.2), [l, -l.conjugate()], 1e-10)

    def test_pendulum_damped(self):
        # Little damping destabilises: p_cr(b) = 41/28 + b^2/2 stays far below 7/2 - sqrt 2 as b goes to 0; w^2 = 2/7.
        for b in [0.1, 0.01]:
            critical = 41 / 28 + b ** 2 / 2
            flutter = min(self.zieglers_pendulum(critical, b), key=lambda l: abs(l - math.sqrt(2 / 7) * 1j))
            self.assertLess(abs(flutter - math.sqrt(2 / 7) * 1j), 1e-9)
            self.assertTrue(all(l.real < 0 for l in self.zieglers_pendulum(critical - 1e-4, b)))
            self.assertTrue(any(l.real > 0 for l in self.zieglers_pendulum(critical + 1e-4, b)))
        worst = max(self.zieglers_pendulum(2, 0.1), key=lambda l: l.real)
        self.assertLess(abs(worst - (0.04821683 + 0.67592482j)), 1e-8)

    def friction(self, mu):
        """M = I, K = [[11, -3 + 5 mu], [-3, 9]], in sparse files: symmetric, and general with one entry."""
        self.write("mass.mtx", "%%MatrixMarket matrix coordinate integer symmetric\n2 2 2\n1 1 1\n2 2 1\n")
        self.write("stiffness.mtx", "%%MatrixMarket matrix coordinate real symmetric\n% lower triangle\n\n2 2 3\n"
                                    "1 1 11.0\n2 1 -3e0\n2 2 9\n")
        self.write("friction.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 1\n1 2 5\n")
        return self.solve({"Mass": "mass.mtx", "Stiffness": "stiffness.mtx", "Circulatory": "friction.mtx"},
                          Circulatory_factor=mu)

    def test_spellings(self):
        """Exponents of Fortran, with D or without a letter, behind a byte order mark and with other ends of lines."""
        for name, entries in (("mass", "1 1 1.0D+00\n2 2 .1d1\n"), ("stiffness", "1 1 1.1D+01\n1 2 -1.0+00\n2 1 -3.D0\n2 2 90.0-1\n")):
            text = f"\ufeff%%MatrixMarket matrix coordinate real general\n2 2 {entries.count(chr(10))}\n{entries}"
            (self.directory / f"{name}.mtx").write_bytes(text.replace("\n", "\r\n").encode())
        # Eigenvalues 8 and 12 of [[11, -1], [-3, 9]]
        found = self.eigenvalues({"Scene": "matrices", "Matrices/Mass": "mass.mtx", "Matrices/Stiffness": "stiffness.mtx",
                                  "Eigenproblem/Maximum frequency": 1, "Eigenproblem/Solver": "dense"})
        self.assertSameModes(found, [1j * math.sqrt(8), 1j * math.sqrt(12)], 1e-12)

    def test_friction(self):
        # l^2 = -10 +- sqrt(10 - 15 mu): mu_c = 2/3, w = sqrt 10
        for mu in [0, 0.4, 2 / 3 - 1e-3]:
            root = math.sqrt(10 - 15 * mu)
            self.assertSameModes(self.friction(mu), [1j * math.sqrt(10 - root), 1j * math.sqrt(10 + root)], 1e-10)
        for l in self.friction(2 / 3 + 1e-8):
            self.assertLess(abs(l - math.sqrt(10) * 1j), 1e-3)
        self.assertSameModes(self.friction(1), [0.35139064 + 3.18174094j, -0.35139064 + 3.18174094j], 1e-8)

    def test_divergence(self):
        # A negative stiffness: l = +- 2 real, and a mode with l = i.
        self.write("mass.mtx", array([1, 0], [0, 1]))
        self.write("stiffness.mtx", array([-4, 0], [0, 1]))
        for solver in ["block_krylov", "krylov", "dense"]:
            modes = self.modes({"Scene": "matrices", "Matrices/Mass": "mass.mtx", "Matrices/Stiffness": "stiffness.mtx",
                                "Eigenproblem/Maximum frequency": 1, "Eigenproblem/Solver": solver})
            self.assertSameModes([st.eigenvalue(mode) for mode in modes], [2, 1j], 1e-10)
            self.assertEqual([mode["verdict"] for mode in modes], ["divergence", "marginal"])

    def test_mass_within_rounding(self):
        """A motion (1, -1) whose mass is rounding of either sign has no mode; with a mass that is clearly negative there is
        no problem. A dashpot without mass under a negative spring diverges with l = k/c and has finite numbers."""
        self.write("stiffness.mtx", array([9, -7], [-7, 9]))
        case = {"Scene": "matrices", "Eigenproblem/Maximum frequency": 1, "Matrices/Mass": "mass.mtx",
                "Matrices/Stiffness": "stiffness.mtx", "Matrices/Velocity": "damping.mtx"}
        for solver in "block_krylov", "dense":
            settings = {**case, "Eigenproblem/Solver": solver}
            self.write("damping.mtx", array([0.1, 0.1], [0.1, 0.1]))
            for rounding in (-1e-10, -1e-15, 1e-10):
                self.write("mass.mtx", array([1, 1 - rounding], [1 - rounding, 1]))
                results = self.analyse(settings)
                self.assertSameModes([st.eigenvalue(row) for row in st.read_table(results / "modes.csv")],
                                     [-0.05 + 1j * math.sqrt(1 - 0.05**2)], 1e-9)
                text = (results / "log.txt").read_text()
                self.assertNotIn("nan", text)
                if rounding == -1e-10:
                    self.assertIn("mass is zero within rounding", text)
            self.write("mass.mtx", array([1, 1.001], [1.001, 1]))
            self.assertSettingsRefused(settings, "Matrices/Mass", "indefinite", "1 of its eigenvalues")
        self.write("mass.mtx", array([1, 0], [0, 0]))
        self.write("damping.mtx", array([0, 0], [0, 2]))
        self.write("stiffness.mtx", array([1, 0], [0, -3]))
        results = self.analyse({**case, "Eigenproblem/Solver": "dense"})
        divergence, mode = st.read_table(results / "modes.csv")
        self.assertAlmostEqual(divergence["growth_rate_1_per_s"], 1.5, delta=1e-9)
        self.assertEqual((divergence["verdict"], mode["verdict"]), ("divergence", "marginal"))
        self.assertNotIn("nan", (results / "modes.csv").read_text() + (results / "log.txt").read_text())

    def write_diagonal(self, name, values):
        self.write(name, "\n".join(["%%MatrixMarket matrix coordinate real general", f"{len(values)} {len(values)} {len(values)}",
                                    *(f"{i} {i} {value!r}" for i, value in enumerate(values, 1)), ""]))

    def test_motions_without_mass(self):
        """Dashpots alone carry motions that nothing couples to those with mass: what diverges there, near and far, in
        problems that LAPACK takes and that it does not."""
        n = 310
        springs = [2., 5., *(20. + i for i in range(n - 2))]
        for what, mass, damping, stiffness, expected in [
                ("one", [1., 1., 1., 0.], [0., 0., 0., 2.], [1., 2., 3., -3.], 1.5),
                ("far", [1.] * n + [0.], [0.] * n + [2.], [*springs, -1e3], 500),
                ("among others", [1.] * n + [0.] * 30, [0.] * n + [2.] * 30, [*springs, -3., *(1. + i for i in range(29))], 1.5)]:
            for name, values in (("mass", mass), ("damping", damping), ("stiffness", stiffness)):
                self.write_diagonal(f"{name}.mtx", values)
            case = {"Scene": "matrices", "Eigenproblem/Maximum frequency": 0.5, "Matrices/Mass": "mass.mtx",
                    "Matrices/Stiffness": "stiffness.mtx", "Matrices/Velocity": "damping.mtx"}
            for solver in ("block_krylov", "krylov"):
                with self.subTest(what, solver=solver):
                    modes = self.modes({**case, "Eigenproblem/Solver": solver})
                    growing = [mode for mode in modes if mode["verdict"] == "divergence"]
                    self.assertEqual(len(growing), 1)
                    self.assertAlmostEqual(growing[0]["growth_rate_1_per_s"], expected, delta=1e-8 * expected)
                    # |2 l| / c of a motion of unit length, and not of its rounding
                    self.assertAlmostEqual(growing[0]["condition_number"], expected, delta=1e-6 * expected)
                    n_in_window = sum(0 < k <= math.pi**2 for m, k in zip(mass, stiffness) if m > 0)
                    self.assertEqual(len(modes), 1 + n_in_window)

    def test_stiffnesses(self):
        """A structure's stiffness is symmetric and semidefinite: others are used, and told."""
        self.write("one.mtx", array([1, 0], [0, 1]))
        case = {"Scene": "matrices", "Eigenproblem/Maximum frequency": 1, "Matrices/Mass": "one.mtx",
                "Eigenproblem/Solver": "dense"}

        def warnings(key, *rows):
            self.write("stiffness.mtx", array(*rows))
            own = {"Matrices/Stiffness": "one.mtx", f"Matrices/{key}": "stiffness.mtx"}
            log = (self.analyse({**case, **own}) / "log.txt").read_text()
            # Each stands again behind the table.
            return {line for line in log.splitlines() if line.startswith("Warning, stiffness")}

        self.assertEqual(warnings("Stiffness", [9, -3], [-3, 1]), set())  # a free body
        self.assertEqual(warnings("Stiffness", [9, -3], [-3, 1 - 1e-9]), set())
        for key, rows, words in [("Stiffness", ([9, -3], [-3.0000001, 5]), "rounding; make it symmetric"),
                                 ("Stiffness", ([9, -3], [-1, 5]), "as Matrices/Circulatory has them"),
                                 ("Stiffness", ([9, -3], [-3, 0.5]), "has 1 negative eigenvalue beyond rounding"),
                                 ("Viscoelastic 1/Stiffness", ([9, -3], [-3, 0.5]), "has 1 negative eigenvalue beyond rounding")]:
            with self.subTest(key, words=words):
                found = warnings(key, *rows)
                self.assertEqual(len(found), 1, found)
                self.assertIn(f"Matrices/{key} = stiffness.mtx", *found)
                self.assertIn(words, *found)

    def test_skew_velocity_term(self):
        # A spinning point mass: l^2 + 2 i w l + ... splits w_0 = 1 into sqrt(1 + g^2) -+ g with M = I, P = 2 g J.
        g = 0.3
        self.write("one.mtx", array([1, 0], [0, 1]))
        self.write("gyroscopic.mtx", f"%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n2 1 {2 * g}\n")
        values = self.solve({"Mass": "one.mtx", "Stiffness": "one.mtx", "Velocity": "gyroscopic.mtx"})
        root = math.sqrt(1 + g * g)
        self.assertSameModes(values, [1j * (root - g), 1j * (root + g)], 1e-10)
        for l in values:
            self.assertLess(abs(l.real), 1e-12)


if __name__ == "__main__":
    unittest.main(verbosity=2)
