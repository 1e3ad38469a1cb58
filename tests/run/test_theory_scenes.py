"""The parameter files of prm/theory against closed forms: one effect of the paper's section 4 each.

The derivations stand in the first lines of each parameter file. Here p is the swept factor, l an eigenvalue with
Im l >= 0. All systems but Ziegler's pendulum and commuting.prm have M = I and K = [[11, -3], [-3, 9]].
"""

import cmath
import math
import pathlib
import re
import subprocess
import sys
import unittest

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "lib"), str(TESTS.parent / "scripts")]

import squeal_testing as st  # noqa: E402
from plotting import has_matplotlib  # noqa: E402

THEORY = st.PROJECT / "prm/theory"
ZIEGLER_BRAKE = THEORY / "ziegler_brake.prm"
GYROSCOPIC = 20 + 0.5 ** 2  # the factor of l^2 with g = 0.5

# Every critical value of every file: kind, p, eigenvalue there.
CRITICAL = {
    # l^2 = -10 +- sqrt(10 - 15 p)
    "flutter": [("coalescence", 2 / 3, 1j * math.sqrt(10))],
    # l^2 + d l + 10 +- j n = 0, n^2 = 15 p - 10, d = 0.4. Double root at n = 0; Re l = 0 at 10 d^2 = n^2.
    "modal_damping": [("coalescence", 2 / 3, -0.2 + 1j * math.sqrt(10 - 0.04)),
                      ("onset", 2 / 3 * (1 + 0.4 ** 2), 1j * math.sqrt(10))],
    # Routh-Hurwitz with D = diag(0.76, 0.04): w^2 = 9.1, 15 p = 9 + 0.0304 w^2 - (11 - w^2) (9 - w^2)
    "non_modal_damping": [("onset", (9 + 0.0304 * 9.1 - 1.9 * -0.1) / 15, 1j * math.sqrt(9.1))],
    # 2 l^4 + (7 - 2 p) l^2 + 1
    "ziegler_undamped": [("coalescence", 3.5 - math.sqrt(2), 1j * 2 ** -0.25)],
    # 2 l^4 + 7 b l^3 + (7 - 2 p + b^2) l^2 + 2 b l + 1, b = 0.1
    "ziegler_damped": [("onset", 41 / 28 + 0.1 ** 2 / 2, 1j * math.sqrt(2 / 7))],
    # w^4 - (20 + g^2) w^2 + 90 = 0. dl/dp = -(5 g l + 15)/(4 l^3 + 2 (20 + g^2) l) has a negative real part for the
    # lower w, a positive one for the upper.
    "gyroscopic_circulatory": [
        ("end", 0, 1j * math.sqrt((GYROSCOPIC - math.sqrt(GYROSCOPIC ** 2 - 360)) / 2)),
        ("onset", 0, 1j * math.sqrt((GYROSCOPIC + math.sqrt(GYROSCOPIC ** 2 - 360)) / 2))],
    # det(K + p N) = 1 - 9/4 p + 3/4 p^2
    "divergence": [("divergence", (3 - math.sqrt(11 / 3)) / 2, 0),
                   ("divergence", (3 + math.sqrt(11 / 3)) / 2, 0)],
    "thomson_tait_conservative": [],
    "thomson_tait_gyroscopic": [],
    "thomson_tait_damped": [],
    "thomson_tait_damped_gyroscopic": [],
    "commuting": [],
}


def upper_root(d, k):
    """The root of l^2 + d l + k with Im l > 0; k may be complex."""
    root = cmath.sqrt(d * d / 4 - k)
    return -d / 2 + (root if root.imag > 0 else -root)


class TheoryScenes(st.TestCase):
    sweeps = {}  # each file is run once

    def setUp(self):
        super().setUp()
        if not self.sweeps:
            for file in sorted(set(THEORY.glob("*.prm")) - {THEORY / "ziegler_map.prm", ZIEGLER_BRAKE}):  # test_stability_map.py, below
                results = self.directory / file.stem
                result = st.run(file, "--set", f"Output/Directory={results}", directory=st.PROJECT)
                self.assertEqual(result.returncode, 0, f"{file.name}: {result.stderr}")
                self.sweeps[file.stem] = (st.read_table(results / "sweep.csv"),
                                          st.read_table(results / "critical.csv"))

    def by_value(self, name):
        """The two lines of the sweep for each p: {p: [line, line]}."""
        values = {}
        for row in self.sweeps[name][0]:
            values.setdefault(row["parameter"], []).append(row)
        for p, rows in values.items():
            self.assertEqual(len(rows), 2, f"{name}: two modes are expected at p = {p}")
        self.assertGreater(len(values), 20)
        return values

    def assertEigenvalues(self, name, closed_form, tolerance=1e-9):
        for p, rows in self.by_value(name).items():
            with self.subTest(scene=name, p=p):
                self.assertSameModes([st.eigenvalue(row) for row in rows], closed_form(p), tolerance)

    def assertVerdicts(self, name, expected):
        for p, rows in self.by_value(name).items():
            with self.subTest(scene=name, p=p):
                self.assertEqual(sorted(row["verdict"] for row in rows), sorted(expected(p)))

    def test_every_file_has_its_closed_form(self):
        self.assertEqual(set(self.sweeps), set(CRITICAL))

    def test_critical_values(self):
        for name, expected in CRITICAL.items():
            with self.subTest(name):
                # Order of the table: along p, then by branch.
                found = self.sweeps[name][1]
                self.assertEqual([row["kind"] for row in found], [kind for kind, _, _ in expected])
                for row, (_, value, l) in zip(found, expected):
                    self.assertLess(abs(row["value"] - value), 1e-8)
                    self.assertLess(abs(st.eigenvalue(row) - l), 1e-8)
                    # The program claims no more than it has. The table holds 15 digits.
                    self.assertLess(abs(row["value"] - value), max(10 * row["accuracy"], 1e-12))

    def test_flutter(self):
        # (37): l^2 = -k +- j n beyond p_crit, k = 10 in both modes, n = +-sqrt(15 p - 10).
        self.assertEigenvalues("flutter", lambda p: [
            upper_root(0, 10 + s * cmath.sqrt(10 - 15 * p)) for s in [-1, 1]])
        self.assertVerdicts("flutter", lambda p: ["marginal"] * 2 if p < 2 / 3 else ["flutter", "stable"])
        for p, rows in self.by_value("flutter").items():
            n = math.sqrt(max(0, 15 * p - 10))
            # Closeness to the coalescence costs digits: vectors are known to about 1e-16/|l_1^2 - l_2^2|.
            tolerance = 1e-11 / math.sqrt(abs(10 - 15 * p))
            for row, n_expected in zip(sorted(rows, key=lambda row: row["n_1_per_s2"]), [-n, n]):
                self.assertLess(abs(row["n_1_per_s2"] - n_expected), tolerance, f"p = {p}")
                if n > 0:
                    self.assertLess(abs(row["k_1_per_s2"] - 10), tolerance, f"p = {p}")

    def test_modal_damping(self):
        # d = 0.4 in every mode, the vectors of flutter.prm: (38).
        self.assertEigenvalues("modal_damping", lambda p: [
            upper_root(0.4, 10 + s * cmath.sqrt(10 - 15 * p)) for s in [-1, 1]])
        self.assertVerdicts("modal_damping", lambda p: ["stable", "flutter" if p > 58 / 75 else "stable"])
        for row in self.sweeps["modal_damping"][0]:
            self.assertAlmostEqual(row["d_1_per_s"], 0.4, delta=1e-10)
            # Criterion (34) decides each mode: of n and -n, one grows.
            if row["verdict"] == "flutter":
                self.assertLess(row["criterion_1_per_s4"], 0)

    def test_non_modal_damping_opens_the_crossing(self):
        """Without a double root no two eigenvalues come close: their distance has a floor, near p_crit
        sqrt|d_1 - d_2| large, where it is zero with modal damping."""
        border = CRITICAL["non_modal_damping"][0][1]
        self.assertLess(border, 2 / 3)
        self.assertVerdicts("non_modal_damping", lambda p: ["stable", "flutter" if p > border else "stable"])

        def distance(name):
            return min(abs(st.eigenvalue(a) - st.eigenvalue(b)) for a, b in self.by_value(name).values())

        # Lower bound: (l_1 - l_2) (l_1 + l_2) = difference of the l^2. Near p_crit the discriminant of the quadratic
        # in l^2 is 10 - 15 p + j w (d_1 - d_2) to first order in D, so |l_1^2 - l_2^2| >= 2 sqrt(w 0.72) = 3 with
        # w = sqrt 10, and |l_1 + l_2| is about 2 w: a distance of about 0.5. Ten per cent are left to second order.
        self.assertGreater(distance("non_modal_damping"), 0.4)
        self.assertLess(distance("modal_damping"), 0.15)

    def test_ziegler(self):
        self.assertVerdicts("ziegler_undamped", lambda p: ["marginal"] * 2 if p < 3.5 - math.sqrt(2)
                            else ["flutter", "stable"])
        self.assertVerdicts("ziegler_damped", lambda p: ["stable", "flutter" if p > 41 / 28 + 0.005 else "stable"])
        # critical.csv holds 15 digits.
        self.assertLess(abs(self.sweeps["ziegler_damped"][1][0]["value"] - 41 / 28 - 0.005), 1e-14)
        # The paradox: the damper has made loads unstable that were not.
        destabilised = [p for p, rows in self.by_value("ziegler_damped").items()
                        if p < 3.5 - math.sqrt(2) and any(row["verdict"] == "flutter" for row in rows)]
        self.assertGreater(max(destabilised) - min(destabilised), 0.5)

    def test_undamped_gyroscopic_circulatory(self):
        # l^4 has no l^3 beside it: the four roots sum up to zero, so the two upper ones have opposite growth rates.
        for p, rows in self.by_value("gyroscopic_circulatory").items():
            with self.subTest(p=p):
                self.assertNotEqual(p, 0)
                self.assertEqual(sorted(row["verdict"] for row in rows), ["flutter", "stable"])
                growth = [row["growth_rate_1_per_s"] for row in rows]
                self.assertGreater(max(growth), 1e-3)
                self.assertLess(abs(sum(growth)), 1e-12)
                for l in map(st.eigenvalue, rows):
                    residual = l ** 4 + GYROSCOPIC * l ** 2 + 2.5 * p * l + 90 + 15 * p
                    self.assertLess(abs(residual), 1e-9)
                for row in rows:  # (35): rho (2 w + g) + n = 0 with d = 0
                    l = st.eigenvalue(row)
                    self.assertLess(abs(row["d_1_per_s"]), 1e-12)
                    self.assertLess(abs(l.real * (2 * l.imag + row["g_1_per_s"]) + row["n_1_per_s2"]), 1e-9)

    def test_thomson_tait_chetayev(self):
        self.assertEigenvalues("thomson_tait_conservative", lambda p: [
            1j * math.sqrt(10 + s * math.sqrt(1 + (5 * p - 3) ** 2)) for s in [-1, 1]])
        # w^4 - (20 + g^2) w^2 + 99 - (5 p - 3)^2 = 0
        self.assertEigenvalues("thomson_tait_gyroscopic", lambda p: [
            1j * math.sqrt((GYROSCOPIC + s * math.sqrt(GYROSCOPIC ** 2 - 4 * (99 - (5 * p - 3) ** 2))) / 2)
            for s in [-1, 1]])
        for kind, verdict in [("conservative", "marginal"), ("gyroscopic", "marginal"),
                              ("damped", "stable"), ("damped_gyroscopic", "stable")]:
            self.assertVerdicts(f"thomson_tait_{kind}", lambda p, verdict=verdict: [verdict] * 2)
            for row in self.sweeps[f"thomson_tait_{kind}"][0]:
                self.assertLess(abs(row["n_1_per_s2"]), 1e-10, "nothing circulates")
                self.assertGreater(row["k_1_per_s2"], 0)
        # The roots sum up to -trace D = -0.8, G or no G.
        for kind in ["damped", "damped_gyroscopic"]:
            for rows in self.by_value(f"thomson_tait_{kind}").values():
                self.assertAlmostEqual(2 * sum(row["growth_rate_1_per_s"] for row in rows), -0.8, delta=1e-10)

    def test_commuting_matrices_have_real_vectors(self):
        # A real vector has x^T G x = x^T N x = 0 though neither G nor N is zero; its d and k are then real factors
        # of l^2 + d l + k = 0 and those of the common eigenvectors: (0.3, 9) and (0.6, 12 - 3 p).
        self.assertEigenvalues("commuting", lambda p: [upper_root(0.3, 9), upper_root(0.6, 12 - 3 * p)])
        self.assertVerdicts("commuting", lambda p: ["stable"] * 2)
        for p, rows in self.by_value("commuting").items():
            rows = sorted(rows, key=lambda row: row["d_1_per_s"])
            for row, (d, k) in zip(rows, [(0.3, 9), (0.6, 12 - 3 * p)]):
                with self.subTest(p=p, d=d):
                    for key, expected in [("g_1_per_s", 0), ("n_1_per_s2", 0), ("d_1_per_s", d), ("k_1_per_s2", k)]:
                        self.assertLess(abs(row[key] - expected), 1e-9, key)
        # The control: in non_modal_damping.prm nothing commutes, and vectors are complex before p_crit already.
        for p, rows in self.by_value("non_modal_damping").items():
            if 0.1 < p < 2 / 3:
                self.assertGreater(max(abs(row["n_1_per_s2"]) for row in rows), 1e-2, f"p = {p}")


class ZieglerBrake(st.TestCase):
    """Damping of the pads lowers the critical friction coefficient of a brake: what doc/theory_effects.md says."""

    BETA, FRICTION = "Pads/Material/Stiffness proportional damping", "Contact/Friction/Coefficient"

    def results(self, **settings):
        settings = {"Sweep/Parameter": "none", "Sweep/Second parameter": "none", **settings}
        directory = self.directory / "results"
        options = [argument for key, value in settings.items() for argument in ("--set", f"{key}={value}")]
        result = st.run(ZIEGLER_BRAKE, "--overwrite", "--set", f"Output/Directory={directory}", *options, directory=st.PROJECT)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return directory

    def test_verdicts(self):
        """With the friction coefficient between both borders the bars decide: stable, and unstable by more damping."""
        text = (st.PROJECT / "doc/theory_effects.md").read_text()
        for beta, verdict in [(0, "stable"), (1e-5, "flutter")]:
            rows = st.read_table(self.results(**{self.FRICTION: 0.52, self.BETA: beta}) / "modes.csv")
            mode = max(rows, key=lambda row: row["growth_rate_1_per_s"] if 5000 < row["frequency_hz"] < 5200 else -1e9)
            self.assertEqual(mode["verdict"], verdict)
            self.assertTrue(all(row["verdict"] == "stable" for row in rows if row is not mode))
            growth, bar = mode["growth_rate_1_per_s"], mode["growth_rate_error_1_per_s"]
            self.assertIn(f"{growth:+.2f} ± {bar:.1g}", text)

    def test_borders(self):
        """Critical values with the mesh's bars, and a fall by more than both."""
        text = (st.PROJECT / "doc/theory_effects.md").read_text()
        onsets, bars = [], []
        for beta, values in [(0, "0.565, 0.58"), (1e-5, "0.47, 0.485")]:
            row, = st.read_table(self.results(**{"Sweep/Parameter": self.FRICTION, "Sweep/Values": values,
                                                 "Sweep/Critical values": "true", self.BETA: beta}) / "critical.csv")
            self.assertEqual(row["kind"], "onset")
            self.assertIn(f"{row['value']:.3f} ± {row['mesh_error']:.1g}", text)
            onsets.append(row["value"])
            bars.append(row["mesh_error"])
        self.assertGreater(onsets[0] - onsets[1], 2 * sum(bars))


class Pictures(st.TestCase):
    @unittest.skipUnless(has_matplotlib(), "needs matplotlib: scripts/install-dependencies.sh --pictures")
    def test_all_are_made_anew(self):
        """scripts/root_locus.py makes every picture of doc/theory_effects.md, maps included."""
        images = self.directory / "images"
        done = subprocess.run([sys.executable, st.PROJECT / "scripts/root_locus.py", "--program", st.SQUEAL, "--results",
                               self.directory / "results", "--images", images], capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        text = (st.PROJECT / "doc/theory_effects.md").read_text()
        named = set(re.findall(r"images/theory/(\w+\.png)", text))
        self.assertGreater(len(named), 7)
        self.assertEqual(named, {path.name for path in images.iterdir() if path.stat().st_size > 5000})


if __name__ == "__main__":
    unittest.main(verbosity=2)
