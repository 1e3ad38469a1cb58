"""Output/Matrices: what other programs read is the problem that was solved.

Sums of terms, residuals of modes, tables of rows and their expansion are checked with Python alone; that scipy finds the
same eigenvalues by the lines that doc/matrices.md prints needs scipy.
"""

import collections
import csv
import pathlib
import re
import resource
import signal
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

BRAKE = {
    "Discretization/Degree": 1,
    "Discretization/Rotor cells": "2, 12, 1",
    "Discretization/Pad cells": "2, 2, 1",
    "Discretization/Clamp layers": 0,
    "Eigenproblem/Maximum frequency": 4000,
    "Eigenproblem/Error bars": "false",
    "Output/Fields": "none",
    "Output/Matrices": "true",
}
# The rotor's upper side only, with a gap that leaves a part of the pad off the rotor.
OPEN = {**BRAKE, "Pads/Arrangement": "upper", "Contact/Initial gap": "2e-5*(1+y/0.05)"}


def sparse(path):
    """(shape, {(i, j): value}) of a sparse Matrix Market file."""
    lines = [line.split() for line in path.read_text().splitlines() if not line.startswith("%")]
    entries = {(int(i) - 1, int(j) - 1): float(value) for i, j, value in lines[1:]}
    assert len(entries) == len(lines) - 1 == int(lines[0][2]), path
    return (int(lines[0][0]), int(lines[0][1])), entries


def dense(path):
    """Columns of a dense complex Matrix Market file."""
    lines = [line.split() for line in path.read_text().splitlines() if not line.startswith("%")]
    n_rows, n_columns = map(int, lines[0])
    values = [complex(float(re), float(im)) for re, im in lines[1:]]
    return [values[j * n_rows:(j + 1) * n_rows] for j in range(n_columns)]


def table(path):
    """Lines of a CSV file as text."""
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def times(entries, x, n_rows):
    result = [0] * n_rows
    for (i, j), value in entries.items():
        result[i] += value * x[j]
    return result


def size(x):
    return max(map(abs, x))


def python_with_scipy():
    for python in (sys.executable, "/usr/bin/python3", "python3"):
        try:
            if subprocess.run([python, "-c", "import scipy.sparse.linalg"], capture_output=True).returncode == 0:
                return python
        except OSError:
            pass
    return None


class Export(st.TestCase):
    def check(self, results, n_pressures_left_out=0):
        """All of the promises that doc/matrices.md makes of one directory; returns the lines of unknowns.csv."""
        matrices = {name: sparse(results / f"{name}.mtx") for name in "MPQ"}
        n = matrices["M"][0][0]
        sums = {name: collections.defaultdict(float) for name in "MPQ"}
        for term in table(results / "terms.csv"):
            self.assertEqual("QPM"[int(term["power_of_lambda"])], term["belongs_to"])
            for place, value in sparse(results / term["file"])[1].items():
                sums[term["belongs_to"]][place] += float(term["factor"]) * value
        for name, (shape, entries) in matrices.items():
            self.assertEqual(shape, (n, n))
            largest = size(entries.values())
            for place, value in sums[name].items():
                self.assertLessEqual(abs(value - entries.get(place, 0)), 1e-15 * largest, (name, place))
            self.assertLessEqual(entries.keys(), sums[name].keys())

        rows = st.read_table(results / "modes.csv")
        rows = [row for row in rows if row["cycle"] == rows[-1]["cycle"]]
        eigenvalues, = dense(results / "eigenvalues.mtx")
        self.assertEqual(len(rows), len(eigenvalues))
        self.assertGreater(len(rows), 3)
        M, P, Q = (matrices[name][1] for name in "MPQ")
        adjoint = [{(j, i): value for (i, j), value in entries.items()} for entries in (M, P, Q)]
        for row, l, x, z in zip(rows, eigenvalues, dense(results / "right_vectors.mtx"),
                                dense(results / "left_vectors.mtx")):
            self.assertLessEqual(abs(st.eigenvalue(row) - l), 1e-9 * abs(l))
            # x^H M x = 1. The backward error of 1e-9 is measured by norms of the matrices, some ten times what cancels here.
            self.assertLessEqual(abs(sum(a.conjugate() * b for a, b in zip(x, times(M, x, n))) - 1), 1e-10)
            for (m, p, q), value, vector in (((M, P, Q), l, x), (adjoint, l.conjugate(), z)):
                parts = [[value ** 2 * a for a in times(m, vector, n)], [value * a for a in times(p, vector, n)],
                         times(q, vector, n)]
                self.assertLessEqual(size(map(sum, zip(*parts))), 1e-7 * max(map(size, parts)), l)

        unknowns = table(results / "unknowns.csv")
        self.assertEqual([int(unknown["row"]) for unknown in unknowns], list(range(n)))
        self.assertEqual(n, st.read_table(results / "cycles.csv")[-1]["dofs"] - n_pressures_left_out)
        coupled = {i for i, j in Q if i != j}
        self.assertEqual(len(coupled), n)
        for unknown in unknowns:
            is_displacement = unknown["kind"] == "displacement"
            self.assertEqual((int(unknown["row"]), int(unknown["row"])) in M, is_displacement)
            self.assertEqual(unknown["component"] in "xyz", is_displacement)
        self.check_expansion(results, unknowns)
        return unknowns

    def check_expansion(self, results, unknowns):
        """Positions are finite element functions: as displacements they come out as the nodes' positions, but where a
        component, or that of a node that they hang on, is fixed."""
        nodes = table(results / "nodes.csv")
        self.assertEqual([int(node["node"]) for node in nodes], list(range(len(nodes))))
        shape, expansion = sparse(results / "expansion.mtx")
        self.assertEqual(shape, (4 * len(nodes), len(unknowns)))
        for unknown in unknowns:
            node = nodes[int(unknown["node"])]
            self.assertEqual([node[key] for key in ("x_m", "y_m", "z_m")],
                             [unknown[key] for key in ("x_m", "y_m", "z_m")])
            component = {"x": 0, "y": 1, "z": 2, "normal": 3}[unknown["component"]]
            self.assertEqual(expansion[4 * int(unknown["node"]) + component, int(unknown["row"])], float(unknown["scale"]))
        position = [1 if unknown["kind"] == "multiplier" else 1 + float(unknown[unknown["component"] + "_m"])
                    for unknown in unknowns]
        moved, weights = times(expansion, position, shape[0]), times(expansion, [1] * len(unknowns), shape[0])
        n_free = 0
        for k, node in enumerate(nodes):
            for c, key in enumerate(("x_m", "y_m", "z_m")):
                if abs(weights[4 * k + c] - 1) < 1e-12:
                    n_free += 1
                    self.assertLessEqual(abs(moved[4 * k + c] - 1 - float(node[key])), 1e-12)
        self.assertGreaterEqual(n_free, sum(unknown["kind"] == "displacement" for unknown in unknowns))

    def test_brake_and_scipy(self):
        results = self.analyse(BRAKE)
        unknowns = self.check(results)
        self.assertEqual({unknown["body"] for unknown in unknowns}, {"rotor", "upper", "lower", "contact"})
        origins = {term["origin"] for term in table(results / "terms.csv")}
        self.assertEqual(origins, {"inertia", "elasticity", "material damping", "transport", "contact", "friction",
                                   "friction damping"})
        # The three matrices as input of the program itself, whose unknowns then have no names.
        names = {f"Matrices/{key}": results / f"{name}.mtx"
                 for key, name in {"Mass": "M", "Velocity": "P", "Stiffness": "Q"}.items()}
        again = self.analyse({"Scene": "matrices", **names, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Solver":
                              "dense", "Output/Matrices": "true"})
        eigenvalues, = dense(results / "eigenvalues.mtx")
        self.assertSameModes(dense(again / "eigenvalues.mtx")[0], eigenvalues, 1e-9)
        self.assertEqual(sparse(again / "Q.mtx"), sparse(results / "Q.mtx"))
        self.assertFalse((again / "unknowns.csv").exists())

        python = python_with_scipy()
        if not python:
            self.skipTest("the lines of doc/matrices.md need scipy (Debian: python3-scipy)")
        text = (st.PROJECT / "doc/matrices.md").read_text()
        snippets = re.findall("```python\n(.*?)```", text, re.S)
        self.assertEqual(snippets[0].count("\n"), 5)
        script = "".join(snippets).replace("output/brake", str(results))
        out = subprocess.run([python, "-c", script + "print(*l)\nprint(*first_mode.shape)\nprint(abs(first_mode).max())"],
                             env=st.ENVIRONMENT, capture_output=True, text=True, timeout=120)
        self.assertEqual(out.returncode, 0, out.stderr)
        values, shape, _ = out.stdout.splitlines()
        values = [complex(value) for value in values.split()]
        for l in eigenvalues:
            self.assertLessEqual(min(abs(value - l) for value in values), 1e-9 * abs(l))
        self.assertEqual(shape, f"{len(table(results / 'nodes.csv'))} 4")

    def test_ranks_write_the_same(self):
        """Rows by what they are: M, P, Q of three ranks are those of one."""
        of_ranks = []
        for ranks in (1, 3):
            results = self.analyse(OPEN, ranks=ranks)
            names = [(u["body"], u["kind"], u["component"], *(f"{float(u[c]) + 1:.9f}" for c in ("x_m", "y_m", "z_m")))
                     for u in table(results / "unknowns.csv")]
            self.assertEqual(len(set(names)), len(names))
            of_ranks.append({name: {(names[i], names[j]): value
                                    for (i, j), value in sparse(results / f"{name}.mtx")[1].items()} for name in "MPQ"})
        for name in "MPQ":
            one, three = (matrices[name] for matrices in of_ranks)
            largest = size(one.values())
            for place in one.keys() | three.keys():
                self.assertLessEqual(abs(one.get(place, 0) - three.get(place, 0)), 1e-10 * largest, (name, place))

    def test_lifted_pressures_have_no_rows(self):
        results = self.analyse(OPEN)
        n_dofs = st.read_table(results / "cycles.csv")[-1]["dofs"]
        n_pressures = st.read_table(results / "cycles.csv")[-1]["multipliers"]
        kinds = [row["kind"] for row in table(results / "unknowns.csv")]
        n_open = int(n_pressures - kinds.count("multiplier"))
        self.assertGreater(n_open, 0)
        self.assertGreater(kinds.count("multiplier"), 0)
        self.assertEqual(len(kinds), n_dofs - n_open)
        self.check(results, n_open)

    def test_last_mesh_with_hanging_nodes(self):
        results = self.analyse({**BRAKE, "Refinement/Strategy": "adaptive", "Refinement/Cycles": 2,
                                "Refinement/Tolerance": 1e-4, "Eigenproblem/Error bars": "true",
                                "Contact/Formulation": "penalty"})
        self.assertEqual(len(st.read_table(results / "cycles.csv")), 2)
        unknowns = self.check(results)
        self.assertEqual({unknown["kind"] for unknown in unknowns}, {"displacement"})
        shape, expansion = sparse(results / "expansion.mtx")
        self.assertTrue(any(0 < value < 1 for value in expansion.values()), "no node hangs")

    def test_refused(self):
        for key, value in {"Sweep/Parameter": "Contact/Friction/Coefficient", "Stage": "ladder",
                           "Eigenproblem/Solver": "none"}.items():
            settings = {**BRAKE, key: value, "Sweep/Values": "0.1, 0.2"}
            result = st.run(self.write("b.prm", settings).name, directory=self.directory)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(f"Output/Matrices = true: with {key} = {value}", result.stderr)
        settings = {**BRAKE, "Eigenproblem/Solver": "block_davidson", "Discretization/Degree": 2}
        result = st.run(self.write("b.prm", settings).name, directory=self.directory)
        self.assertEqual(result.returncode, 2, result.stderr)

    def test_files_belong_to_the_run(self):
        file = self.write("b.prm", {**BRAKE, "Eigenproblem/Maximum frequency": 1500}).name
        results = self.directory / "output/b"
        results.mkdir(parents=True)
        (results / "M.mtx").write_text("of the user\n")
        result = st.run(file, directory=self.directory)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("there is a file M.mtx", result.stderr)
        self.assertEqual((results / "M.mtx").read_text(), "of the user\n")
        # Who does not ask for matrices may keep some there.
        without = ("--set", "Output/Matrices=false", "--overwrite")
        self.assertEqual(st.run(file, *without, directory=self.directory).returncode, 0)
        (results / "M.mtx").unlink()
        self.assertEqual(st.run(file, "--overwrite", directory=self.directory).returncode, 0)
        written = {path.name for path in results.iterdir()}
        named = {line[5:] for line in (results / "run.manifest").read_text().splitlines() if line.startswith("file ")}
        self.assertLessEqual({"M.mtx", "P.mtx", "Q.mtx", "terms.csv", "unknowns.csv", "nodes.csv", "expansion.mtx",
                              "eigenvalues.mtx", "right_vectors.mtx", "left_vectors.mtx"}, written)
        self.assertLessEqual({name for name in written if name.endswith((".mtx", ".csv"))}, named)
        self.assertEqual(st.run(file, *without, directory=self.directory).returncode, 0)
        self.assertEqual([path.name for path in results.glob("*.mtx")], [])
        self.assertFalse((results / "unknowns.csv").exists())

    def test_full_disk(self):
        """A limit on the length of files stands for the full disk: no file is half there."""
        file = self.write("b.prm", {**BRAKE, "Eigenproblem/Maximum frequency": 1500}).name

        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (100000, 100000))

        process = subprocess.run([str(st.SQUEAL), file], cwd=self.directory, env=st.ENVIRONMENT, capture_output=True,
                                 text=True, preexec_fn=limit, timeout=120)
        self.assertEqual(process.returncode, 1, process.stderr)
        self.assertRegex(process.stderr, r"The file .*[MPQ]\.mtx cannot be written: .*Results so far are kept")
        results = self.directory / "output/b"
        self.assertTrue((results / "modes.csv").exists())
        self.assertEqual(list(results.glob("*.mtx")) + list(results.glob("*.part")), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
