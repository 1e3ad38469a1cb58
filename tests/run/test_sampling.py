"""Samples of uncertain numbers: probabilities known in closed form, samples beside runs of their own, files of samples,
resumption, ranks, what is refused."""

import math
import pathlib
import random
import statistics
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

THEORY = st.PROJECT / "prm/theory"
FRICTION, SPEED = "Contact/Friction/Coefficient", "Operation/Angular velocity"
# Two masses whose modes flutter above p = 2/3 (1 + d^2), d = 0.4 f, where p is the circulatory factor and f that of the
# velocity terms; without them above p = 2/3 (prm/theory/modal_damping.prm, flutter.prm).
CIRCULATORY, VELOCITY = "Matrices/Circulatory factor", "Matrices/Velocity factor"
UNDAMPED = {"Scene": "matrices", "Matrices/Mass": THEORY / "mass.mtx", "Matrices/Stiffness": THEORY / "stiffness.mtx",
            "Matrices/Circulatory": THEORY / "friction.mtx", "Eigenproblem/Maximum frequency": 1}
DAMPED = {**UNDAMPED, "Matrices/Velocity": THEORY / "damping_modal.mtx"}
TWO = f"{CIRCULATORY} uniform 0.5 1; {VELOCITY} uniform 0 1.5"
BRAKE = {**st.SMALL_BRAKE, "Contact/Steady pressure": "uniform", "Eigenproblem/Maximum frequency": 2500,
         "Sampling/Parameters": f"{FRICTION} uniform 0.3 0.6; {SPEED} normal 20 1; Pads/Pressure lognormal 1e6 0.2; "
                                "Pads/Material/Young modulus uniform 9e9 1.1e10",
         "Sampling/Samples": 16}
PARAMETERS = [FRICTION, SPEED, "Pads/Pressure", "Pads/Material/Young modulus"]


class Sampling(st.TestCase):
    def table(self, results, name):
        return st.read_table(results / name)

    def of_all(self, results):
        return next(row for row in self.table(results, "probability.csv") if row["branch"] == "any")

    def test_known_probabilities(self):
        """Uniform numbers: the part of the rectangle above the border p = 2/3 (1 + 0.16 f^2) is 0.506667."""
        for settings, parameters, exact in [
                (UNDAMPED, f"{CIRCULATORY} uniform 0.3 1", (1 - 2 / 3) / 0.7),
                (UNDAMPED, f"{CIRCULATORY} normal 0.6 0.1", 0.5 * math.erfc((2 / 3 - 0.6) / 0.1 / math.sqrt(2))),
                (UNDAMPED, f"{CIRCULATORY} lognormal 0.5 0.3",
                 0.5 * math.erfc(math.log(2 / 3 / 0.5) / 0.3 / math.sqrt(2))),
                (UNDAMPED, f"{CIRCULATORY} table 0:0 0.5:0.8 1:1", 0.2 * (1 - 2 / 3) / 0.5),
                (DAMPED, TWO, (1 / 3 - 2 / 3 * 0.16 * 0.75) / 0.5)]:
            for samples in [32, 256]:
                with self.subTest(parameters=parameters, samples=samples):
                    results = self.analyse({**settings, "Sampling/Parameters": parameters, "Sampling/Samples": samples})
                    found = self.of_all(results)
                    self.assertEqual(found["samples"], samples)
                    self.assertLess(abs(found["probability"] - exact), found["sampling_error"])
                    # Quasi-random samples are better than the bar, which is that of random ones.
                    self.assertLess(abs(found["probability"] - exact), 2 / samples)
                    self.assertLess(found["sampling_error"], 1.1 / math.sqrt(samples))
                    self.assertLess(found["reduction_error"], 1.5 / samples)  # one sample may lie on the border
                    rows = self.table(results, "samples.csv")
                    self.assertEqual(len(rows), samples)
                    self.assertEqual(sum(row["growth_rate_1_per_s"] > 1e-12 for row in rows),
                                     round(found["probability"] * samples))

    def test_growth_rates(self):
        """Beyond the coalescence l^2 + d l + 10 -+ j n = 0, n = sqrt(15 p - 10): the growth rate of each sample, and
        what is told of all of them."""
        results = self.analyse({**DAMPED, "Sampling/Parameters": TWO, "Sampling/Samples": 128})
        rows = self.table(results, "samples.csv")
        for row in rows:
            p, d = row[CIRCULATORY], 0.4 * row[VELOCITY]
            root = complex(15 * p - 10) ** 0.5
            exact = max(((-d + sign * (d * d - 4 * (10 + 1j * s * root)) ** 0.5) / 2).real
                        for s in (1, -1) for sign in (1, -1))
            self.assertLess(abs(row["growth_rate_1_per_s"] - exact), 1e-9)
            self.assertLess(row["reduction_error_1_per_s"], 1e-9)
        rates = sorted(row["growth_rate_1_per_s"] for row in rows)
        found = self.of_all(results)
        self.assertAlmostEqual(found["growth_rate_mean_1_per_s"], statistics.fmean(rates), 9)
        self.assertAlmostEqual(found["growth_rate_deviation_1_per_s"], statistics.pstdev(rates), 9)
        self.assertAlmostEqual(found["growth_rate_50_percent_1_per_s"], statistics.median(rates), 9)
        self.assertLess(abs(found["growth_rate_5_percent_1_per_s"] - rates[6]), rates[7] - rates[5])

    def test_loose_tolerance(self):
        """It makes no small growth rate zero."""
        tight, loose = (self.table(self.analyse({**DAMPED, "Sampling/Parameters": TWO, "Sampling/Samples": 32,
                                                 "Eigenproblem/Tolerance": tolerance}), "samples.csv") for tolerance in (1e-9, 1e-3))
        self.assertTrue(any(0 < row["growth_rate_1_per_s"] < 10 * 1e-3 * 10 ** 0.5 for row in tight))
        for a, b in zip(tight, loose):
            self.assertAlmostEqual(a["growth_rate_1_per_s"], b["growth_rate_1_per_s"], 6)

    def test_correlation(self):
        """Normal numbers with the coefficient 0.6; a uniform one has the correlation of its normal score."""
        results = self.analyse({**DAMPED, "Sampling/Parameters": f"{CIRCULATORY} normal 0.7 0.1; {VELOCITY} normal 1 0.2",
                                "Sampling/Samples": 512, "Sampling/Correlation": "1, 0.6; 0.6, 1"})
        rows = self.table(results, "samples.csv")
        x, y = ([row[name] for row in rows] for name in (CIRCULATORY, VELOCITY))
        mean_x, mean_y = statistics.fmean(x), statistics.fmean(y)
        covariance = statistics.fmean((a - mean_x) * (b - mean_y) for a, b in zip(x, y))
        self.assertLess(abs(mean_x - 0.7), 1e-3)
        self.assertLess(abs(statistics.pstdev(y) - 0.2), 4e-3)
        self.assertLess(abs(covariance / (statistics.pstdev(x) * statistics.pstdev(y)) - 0.6), 0.02)

    def test_indices(self):
        """Below the coalescence all growth rates are -d/2: the factor of damping makes the whole variance."""
        results = self.analyse({**DAMPED, "Sampling/Parameters": f"{CIRCULATORY} uniform 0 0.6; {VELOCITY} uniform 0.5 1.5",
                                "Sampling/Samples": 128, "Sampling/Sensitivity indices": "true"})
        self.assertEqual(self.of_all(results)["probability"], 0)
        self.assertEqual(self.of_all(results)["samples"], 256)
        self.assertEqual(len(self.table(results, "samples.csv")), 4 * 128)
        rows = self.table(results, "indices.csv")
        self.assertEqual({row["branch"] for row in rows}, {"any", 1, 2} if 1 in {r["branch"] for r in rows}
                         else {"any", "1", "2"})
        for row in rows:
            expected = 1 if row["parameter"] == VELOCITY else 0
            self.assertLess(abs(row["total"] - expected), max(1e-9, 2 * row["total_error"]))
            self.assertLess(abs(row["first_order"] - expected), max(1e-9, 2 * row["first_order_error"]))
            self.assertLess(row["total_error"], 0.3)

    def test_brake_beside_runs_of_its_own(self):
        """A sample is the run with its numbers: growth rate to the accuracy that is told, and its bar nearly."""
        results = self.analyse(BRAKE)
        rows = self.table(results, "samples.csv")
        self.assertEqual(len(rows), 16)
        self.assertTrue(any(row["solved_fully"] == 0 for row in rows))
        single = {key: value for key, value in BRAKE.items() if not key.startswith("Sampling/")}
        for row in random.Random(1).sample(rows, 4):
            modes = self.modes({**single, **{name: repr(row[name]) for name in PARAMETERS}, "Eigenproblem/Tolerance": 1e-11})
            self.assertEqual(len(modes), row["modes"])
            worst = max(modes, key=lambda mode: mode["growth_rate_1_per_s"])
            self.assertLess(abs(row["growth_rate_1_per_s"] - worst["growth_rate_1_per_s"]),
                            row["reduction_error_1_per_s"] + 1e-11 * 2 * math.pi * worst["frequency_hz"])
            self.assertLess(row["mesh_error_1_per_s"], 2 * worst["growth_rate_error_1_per_s"])
            self.assertGreater(row["mesh_error_1_per_s"], 0.5 * worst["growth_rate_error_1_per_s"])
        found = self.of_all(results)
        unstable = sum(row["growth_rate_1_per_s"] > 0 for row in rows)
        self.assertEqual(found["probability"], unstable / 16)
        # What meshes let grow or not is at least the part of samples without a verdict.
        undecided = sum(abs(row["growth_rate_1_per_s"]) < row["mesh_error_1_per_s"] for row in rows)
        self.assertGreaterEqual(found["mesh_error"] * 16 + 1e-9, undecided / 2)

    def test_without_bars(self):
        results = self.analyse({**BRAKE, "Eigenproblem/Error bars": "false", "Sampling/Samples": 4})
        self.assertIsNone(self.of_all(results)["mesh_error"])
        self.assertTrue(all(row["mesh_error_1_per_s"] is None for row in self.table(results, "samples.csv")))

    def test_file(self):
        """Samples from elsewhere: the same as those that are drawn."""
        settings = {**DAMPED, "Sampling/Parameters": TWO, "Sampling/Samples": 16}
        drawn = self.table(self.analyse(settings), "samples.csv")
        lines = [f"{VELOCITY}, {CIRCULATORY}"] + [f"{row[VELOCITY]!r},{row[CIRCULATORY]!r}" for row in drawn]
        self.write("samples.csv", "\n".join(lines) + "\n\n")
        results = self.analyse({**DAMPED, "Sampling/File": "samples.csv"})
        for a, b in zip(self.table(results, "samples.csv"), drawn):
            for column in [VELOCITY, CIRCULATORY, "growth_rate_1_per_s"]:
                self.assertAlmostEqual(a[column], b[column], 9)
        self.assertEqual(self.of_all(results)["samples"], 16)

    def test_contacts_that_open_and_close(self):
        """Friction to and fro: contacts are closed that are open at the centre, and the other way round. Samples are projected
        nevertheless (all but one, from which it is learnt which terms vary), as good as runs of their own."""
        settings = {**st.SMALL_BRAKE, **st.MORTAR, "Eigenproblem/Maximum frequency": 5000, "Eigenproblem/Error bars": "false"}
        values = [0.05, 0.6, 0.3, 0.1, 0.55, 0.15, 0.45, 0.2, 0.5, 0.25, 0.4, 0.35]
        self.write("samples.csv", "\n".join([FRICTION, *map(str, values)]) + "\n")
        samples = self.table(self.analyse({**settings, "Sampling/File": "samples.csv"}), "samples.csv")
        self.assertLessEqual(sum(sample["solved_fully"] for sample in samples), 1)
        for sample in (samples[0], samples[5]):
            modes = st.read_table(self.analyse({**settings, FRICTION: sample[FRICTION]}) / "modes.csv")
            rates = sorted(sample[f"growth_rate_of_branch_{b + 1}_1_per_s"] for b in range(len(modes)))
            for rate, of_run in zip(rates, sorted(mode["growth_rate_1_per_s"] for mode in modes)):
                self.assertLess(abs(rate - of_run), 5e-8 * 2 * math.pi * 5000)

    def test_ranks(self):
        one, two = (self.analyse({**BRAKE, "Sampling/Samples": 4}, ranks=ranks) for ranks in (1, 2))
        for a, b in zip(self.table(one, "samples.csv"), self.table(two, "samples.csv")):
            self.assertEqual([a[name] for name in PARAMETERS], [b[name] for name in PARAMETERS])
            self.assertLess(abs(a["growth_rate_1_per_s"] - b["growth_rate_1_per_s"]),
                            a["reduction_error_1_per_s"] + b["reduction_error_1_per_s"] + 1e-12 * a["frequency_hz"])
            self.assertLess(abs(a["mesh_error_1_per_s"] - b["mesh_error_1_per_s"]), 1e-3 * a["mesh_error_1_per_s"])
        for a, b in zip(self.table(one, "probability.csv"), self.table(two, "probability.csv")):
            self.assertEqual(a["probability"], b["probability"])

    def test_killed_and_resumed(self):
        """On the way: what was found stays, what follows is within the accuracy of the uninterrupted run."""
        settings = {**BRAKE, "Eigenproblem/Error bars": "false"}
        whole = self.analyse(settings)
        results = self.kill(settings, lambda results: (results / "samples.state").exists())
        self.assertTrue((results / "samples.state").exists(), "the run ended too early for this test")
        self.resume()
        self.assertFalse((results / "samples.state").exists())
        self.assertIn("begins anew: the last digits of the samples that follow differ", (results / "log.txt").read_text())
        mine, expected = (self.table(place, "samples.csv") for place in (results, whole))
        self.assertEqual([row["sample"] for row in mine], list(range(1, 17)))
        for a, b in zip(mine, expected):
            self.assertEqual([a[name] for name in PARAMETERS], [b[name] for name in PARAMETERS])
            self.assertLess(abs(a["growth_rate_1_per_s"] - b["growth_rate_1_per_s"]),
                            a["reduction_error_1_per_s"] + b["reduction_error_1_per_s"])
        self.assertEqual(self.of_all(results)["probability"], self.of_all(whole)["probability"])
        # Small systems are solved in full: every digit is the same.
        settings = {**DAMPED, "Sampling/Parameters": TWO, "Sampling/Samples": 500}
        whole = self.analyse(settings)
        results = self.kill(settings, lambda results: (results / "samples.state").exists() and
                            (results / "samples.csv").read_text().count("\n") > 100)
        self.resume()
        for name in ["samples.csv", "probability.csv"]:
            self.assertEqual((results / name).read_text(), (whole / name).read_text())
        self.assertNotIn("last digits", (results / "log.txt").read_text())

    def test_refused(self):
        self.write("short.csv", f"{CIRCULATORY}, {VELOCITY}\n0.5\n")
        self.write("word.csv", f"{CIRCULATORY}\n0.5\nhigh\n")
        self.write("empty.csv", f"{CIRCULATORY}\n")
        self.write("key.csv", "Matrices/Factor\n1\n")
        self.write("mesh.csv", "Rotor/Thickness\n0.01\n")
        for settings, parts in [
                ({"Sampling/File": "none.csv"}, ["Sampling/File = none.csv", "cannot be read"]),
                ({"Sampling/File": "short.csv"}, ["short.csv, line 2: 1 fields; the first line has 2"]),
                ({"Sampling/File": "word.csv"}, ["word.csv, line 3: 'high' is not a number"]),
                ({"Sampling/File": "empty.csv"}, ["no samples"]),
                ({"Sampling/File": "key.csv"}, ["Matrices/Factor"]),
                ({"Sampling/File": "mesh.csv"}, ["Rotor/Thickness: samples keep the mesh"]),
                ({"Sampling/Parameters": f"{CIRCULATORY} uniform 1"}, ["Sampling/Parameters", "allowed are two"]),
                ({"Sampling/Parameters": "Matrices/Factor uniform 1 2"}, ["Matrices/Factor"]),
                ({"Sampling/Parameters": f"{CIRCULATORY} uniform 0 1", "Sweep/Parameter": VELOCITY,
                  "Sweep/Values": "1, 2"}, ["without a sweep only"]),
                ({"Sampling/Parameters": f"{CIRCULATORY} uniform 0 1", "Stage": "ladder"}, ["Stage = ladder"])]:
            with self.subTest(**settings):
                self.write("bad.prm", {**DAMPED, **settings})
                result = st.run("bad.prm", directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                for part in parts:
                    self.assertIn(part, result.stderr)
        # A sample outside of what its key allows, before anything is computed
        self.write("bad.prm", {**BRAKE, "Sampling/Parameters": f"{FRICTION} normal 0.1 0.1"})
        result = st.run("bad.prm", directory=self.directory)
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        self.assertRegex(result.stderr, rf"Sample \d+ is not allowed: .*{FRICTION}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
