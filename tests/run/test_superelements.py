"""Superelements: matrices of a part in place of its mesh (theory.md, section 11).

A pad is held by a bracket at its trailing end. The bracket is written as a superelement and read again in place of its
mesh: with all of its modes that is the same problem, with few of them one that comes closer with their number.
"""

import collections
import math
import pathlib
import re
import shutil
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402
import test_matrix_export as export  # noqa: E402

HALF, END = math.radians(25), math.radians(40)
BRAKE = {**mesh_files.SCENE, "Mesh/Pads": "upper", "Mesh/Contact pairs": "upper.low : rotor.high",
         "Mesh/Guided": "", "Mesh/Pressure on": "upper.high", "Mesh/File": "brake.msh",
         "Discretization/Degree": 1, "Output/Fields": "none", "Eigenproblem/Maximum frequency": 5000}
# Steel, with damping of its own.
BRACKET = {"Mesh/Part 1/Volumes": "upper.bracket", "Mesh/Part 1/Material/Young modulus": 2.1e11,
           "Mesh/Part 1/Material/Density": 7850, "Mesh/Part 1/Material/Stiffness proportional damping": 3e-7,
           "Mesh/Part 1/Material/Mass proportional damping": 20}
TIED = {**BRAKE, **BRACKET, "Mesh/Part 1/Body": "parts", "Mesh/Clamped": "rotor.inner, upper.bracket.end",
        "Joints/Ties": "upper.end : upper.bracket.begin"}
OUT = {**TIED, "Output/Superelement": "upper.bracket : upper.bracket.begin"}
IN = {**BRAKE, "Joints/Superelements": "bracket : superelement : upper.end"}
NO_BARS = {"Eigenproblem/Error bars": "false"}
DEGREE_2 = {"Discretization/Degree": 2}
# A bracket that is soft enough to have modes of its own in the window.
SOFT = {**DEGREE_2, "Mesh/Part 1/Material/Young modulus": 1e10}
FILES = ["superelement-K.mtx", "superelement-M.mtx", "superelement-D.mtx", "superelement-nodes.csv"]


def eigenvalues(modes):
    return [st.eigenvalue(row) for row in modes]


class Superelements(st.TestCase):
    def mesh(self, bracket=True, n=(2, 1)):
        """Cells of the bracket along the radius and upwards; the pad has two and one."""
        mesh = mesh_files.brake(rotor_cells=(2, 12, 1), pads=("upper",))
        if bracket:
            mesh.sector("upper.bracket", mesh_files.equal(0.09, 0.14, n[0]), mesh_files.equal(HALF, END, 2),
                        mesh_files.equal(0.006, 0.018, n[1]))
        return mesh

    def write_mesh(self, mesh, name="brake.msh"):
        self.write(name, mesh_files.msh2(mesh))

    def superelement(self, ranks=1, **settings):
        """Writes a superelement and copies its files to where IN looks for them; returns the log."""
        self.write_mesh(self.mesh())
        results = self.analyse({**OUT, **NO_BARS, **settings}, ranks=ranks)
        for name in FILES:
            shutil.copy(results / name, self.directory)
        self.write_mesh(self.mesh(bracket=False))
        return (results / "log.txt").read_text()

    def glued(self, **settings):
        mesh = self.mesh()
        mesh.weld()
        self.write_mesh(mesh, "glued.msh")
        return self.eigenvalues({**BRAKE, **BRACKET, "Mesh/Part 1/Body": "pads", "Mesh/File": "glued.msh",
                           "Mesh/Clamped": "rotor.inner, upper.bracket.end", **settings})

    def test_out_and_in_again(self):
        """With all modes of the bracket every eigenvalue is that of the brake in which pad and bracket share nodes."""
        for degree, n_nodes in [(1, 6), (2, 15)]:
            with self.subTest(degree=degree):
                settings = {"Discretization/Degree": degree}
                whole = self.glued(**settings)
                self.assertGreater(len(whole), 5)
                log = self.superelement(**settings, **{"Output/Superelement modes": 100000})
                self.assertRegex(log, rf"Superelement of 'upper.bracket': {n_nodes} nodes of the interface, (\d+) of \1 modes")
                self.assertSameModes(self.eigenvalues({**IN, **settings}), whole, 1e-8)

    def test_convergence(self):
        """The table of doc/joints.md: the largest error of an eigenvalue falls with the number of modes, in the mean by
        the fourth power of the highest one's frequency."""
        whole = self.glued(**SOFT)
        text = (st.PROJECT / "doc/joints.md").read_text()
        table = [(int(n), float(hertz), float(error)) for n, hertz, error in
                 re.findall(r"^\| (\d+) \| ([\d.]+) \| ([\d.e-]+) \|$", text, re.M)]
        self.assertGreater(len(table), 3)
        found = []
        for n, hertz, error in table:
            log = self.superelement(**SOFT, **{"Output/Superelement modes": n})
            frequency = re.search(r"held, up to ([\d.e+]+) Hz", log)
            worst = max(abs(a - b) / abs(b) for a, b in self.pairs(self.eigenvalues({**IN, **DEGREE_2}), whole))
            found.append((float(frequency[1]) if frequency else 0, worst))
            with self.subTest(n):
                self.assertAlmostEqual(found[-1][0], hertz, delta=1e-3 * hertz)
                self.assertAlmostEqual(worst, error, delta=0.02 * error)
        (first, coarse), (last, fine) = found[1], found[-1]
        order = math.log(fine / coarse) / math.log(first / last)
        self.assertLess(abs(order - 4), 0.3)

    def test_frequency_and_number(self):
        """The modes of a larger part by the iterative solver are those of the dense one; a frequency cuts them off."""
        self.write_mesh(self.mesh(n=(4, 3)))
        squares = {}
        for n, frequency in [(20, 0), (400, 0), (400, 15000), (3, 15000)]:
            settings = {**OUT, **SOFT, **NO_BARS, "Output/Superelement modes": n, "Output/Superelement frequency": frequency}
            results = self.analyse(settings)
            n_nodes = len(export.table(results / "superelement-nodes.csv"))
            (size, _), K = export.sparse(results / "superelement-K.mtx")
            squares[n, frequency] = [K[i, i] for i in range(3 * n_nodes, size)]
            self.assertFalse([1 for i, j in K if i != j and max(i, j) >= 3 * n_nodes])
        self.assertEqual([len(squares[key]) for key in ((20, 0), (400, 0), (3, 15000))], [20, 400, 3])
        dense = squares[400, 0]
        for other in squares.values():
            for a, b in zip(other, dense):
                self.assertLessEqual(abs(a - b), 1e-8 * b)
        limit = (2 * math.pi * 15000)**2
        self.assertEqual(len(squares[400, 15000]), sum(value <= limit for value in dense))
        self.assertGreater(len(squares[400, 15000]), 3)

    def test_ranks_and_other_paths(self):
        """Written and read on several ranks, solved by other solvers, in a sweep, between other meshes."""
        self.superelement()
        expected = self.eigenvalues(IN)
        self.assertGreater(len(expected), 5)
        for ranks in (2, 3):
            self.assertSameModes(self.eigenvalues(IN, ranks=ranks), expected, 1e-7)
        for solver in ("krylov", "dense"):
            self.assertSameModes(self.eigenvalues({**IN, "Eigenproblem/Solver": solver}), expected, 1e-7)
        sweep = {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.4, 0.6"}
        rows = st.read_table(self.analyse({**IN, **sweep}) / "sweep.csv")
        expected_there = self.eigenvalues({**IN, "Contact/Friction/Coefficient": 0.6})
        self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == 0.6], expected_there, 1e-6)
        self.superelement(ranks=3)
        self.assertSameModes(self.eigenvalues(IN), expected, 1e-7)

    def test_causes_bars_and_matrices(self):
        """The superelement's damping and stiffness are causes by its name; sums hold; so do exported matrices."""
        self.superelement(**{"Output/Superelement modes": 100000})
        results = self.analyse({**IN, "Output/Matrices": "true"})
        log = (results / "log.txt").read_text()
        self.assertRegex(log, r"Superelement 'bracket': 6 nodes, 6 held by 'upper.end', at most \S+ m away, 0 free, "
                              r"18 internal coordinates, \S+ kg")
        modes = st.read_table(results / "modes.csv")
        causes = st.read_table(results / "contributions.csv")
        self.assertIn(("joint", "bracket"), {(row["origin"], row["body"]) for row in causes})
        for mode in modes:
            self.assertGreater(mode["frequency_error_hz"], 0)
        unknowns = export.table(results / "unknowns.csv")
        self.assertEqual([int(row["row"]) for row in unknowns], list(range(len(unknowns))))
        of_bracket = [row for row in unknowns if row["body"] == "bracket"]
        self.assertEqual(collections.Counter(row["component"] for row in of_bracket), {"x": 6, "y": 6, "z": 6, "internal": 18})
        (n, _), Q = export.sparse(results / "Q.mtx")
        M, P = (export.sparse(results / f"{name}.mtx")[1] for name in "MP")
        for l, x in zip(eigenvalues(modes), export.dense(results / "right_vectors.mtx")):
            parts = [export.times(A, [c * value for value in x], n) for A, c in [(M, l * l), (P, l), (Q, 1)]]
            residual = math.sqrt(sum(abs(sum(values))**2 for values in zip(*parts)))
            self.assertLessEqual(residual, 1e-9 * math.sqrt(sum(abs(value)**2 for value in parts[2])) + 1e-6)

    def test_causes_are_those_of_the_mesh(self):
        """With all modes the bracket's damping and stiffness do in each mode what they do in the mesh."""
        causes = []
        for settings, body in [(TIED, "upper.bracket"), (IN, "bracket")]:
            if body == "bracket":
                self.superelement(**{"Output/Superelement modes": 100000})
            else:
                self.write_mesh(self.mesh())
            rows = st.read_table(self.analyse(settings) / "contributions.csv")
            causes.append({(row["mode"], row["origin"]): row for row in rows
                           if row["body"] == body and row["origin"] in ("elasticity", "material damping")})
        self.assertEqual(causes[0].keys(), causes[1].keys())
        self.assertGreater(len(causes[0]), 10)
        for key, row in causes[0].items():
            for column in ("d_1_per_s", "k_1_per_s2"):
                self.assertLessEqual(abs(row[column] - causes[1][key][column]), 1e-6 * abs(row[column]) + 1e-12, key)

    def test_refused(self):
        self.superelement()
        good = {name: (self.directory / name).read_text() for name in FILES}
        K, nodes = good["superelement-K.mtx"], good["superelement-nodes.csv"]
        entries = K.splitlines()
        first = next(i for i, line in enumerate(entries) if line.startswith("1 2 "))
        size = next(i for i, line in enumerate(entries) if not line.startswith("%"))

        def with_line(number, text):
            return "\n".join(entries[:number] + [text] + entries[number + 1:]) + "\n"

        n_rows, _, n_entries = entries[size].split()
        moved = nodes.splitlines()
        far = "\n".join([moved[0]] + [line.rsplit(",", 1)[0] + ",0.5" for line in moved[1:]]) + "\n"
        negative = re.sub(r"^1 1 ", "1 1 -", good["superelement-M.mtx"], flags=re.M)
        values = {tuple(map(int, line.split()[:2])): line.split()[2] for line in entries[size + 1:]}

        def coupled(i, j, factor):
            """K with the entries (i, j) and (j, i) that are factor times the geometric mean of both diagonals."""
            value = repr(factor * math.sqrt(float(values[i, i]) * float(values[j, j])))
            changed = {**values, (i, j): value, (j, i): value}
            return "\n".join([*entries[:size], f"{n_rows} {n_rows} {len(changed)}",
                              *(f"{a} {b} {x}" for (a, b), x in changed.items())]) + "\n"

        inner = 3 * (len(moved) - 1) + 1
        small = "%%MatrixMarket matrix coordinate real general\n3 3 3\n1 1 1\n2 2 1\n3 3 1\n"
        by_place = "\n".join([moved[0], *sorted(moved[1:], key=lambda line: float(line.split(",")[2]))]) + "\n"
        cut = "\n".join(moved[:4]) + "\n"
        plain = "\n".join([entries[0], *entries[size:]]) + "\n"
        for files, changed, words in [
                ({"superelement-K.mtx": with_line(first, "1 2 1e6")}, {}, "is not symmetric"),
                ({"superelement-K.mtx": small}, {}, "has 6 nodes with three displacements each"),
                ({"superelement-K.mtx": with_line(first, "1 2 nan")}, {}, "not a finite number"),
                ({"superelement-K.mtx": "\n".join(entries[:size] + [f"{n_rows} {n_rows} {int(n_entries) + 1}"] +
                                                  entries[size + 1:] + [entries[first]]) + "\n"}, {}, "is there twice"),
                ({"superelement-M.mtx": small}, {}, "all matrices must have one size"),
                ({"superelement-M.mtx": negative}, {}, "-M.mtx is indefinite"),
                ({"superelement-K.mtx": coupled(1, 2, 2)}, {}, "-K.mtx is indefinite"),
                ({"superelement-K.mtx": coupled(inner, inner + 1, 1)}, {}, "eigenvalues that are zero to rounding"),
                ({"superelement-K.mtx": None}, {}, "the file cannot be read"),
                ({"superelement-nodes.csv": None}, {}, "the file cannot be read"),
                ({"superelement-nodes.csv": far}, {}, "no node is within"),
                ({"superelement-nodes.csv": nodes.replace("node,", "number,")}, {}, "expected 'node,x_m,y_m,z_m'"),
                ({"superelement-nodes.csv": nodes + moved[1] + "\n"}, {}, "is there twice"),
                ({"superelement-nodes.csv": by_place}, {}, "do not stand in this order"),
                ({"superelement-nodes.csv": cut}, {}, "has 3 nodes, the matrix was written for 6"),
                ({"superelement-nodes.csv": cut, "superelement-K.mtx": plain}, {}, "couples its first 18 rows"),
                ({"superelement-nodes.csv": nodes.replace(moved[1], moved[1] + "x")}, {}, "superelement-nodes.csv"),
                ({}, {"Joints/Superelements": "bracket : superelement"}, "is not name : files : surface"),
                ({}, {"Joints/Superelements": "bracket : superelement : nothing"}, "there is no surface group 'nothing'"),
                ({}, {"Joints/Superelements": IN["Joints/Superelements"] + ", " + IN["Joints/Superelements"]},
                 "two superelements 'bracket'"),
                ({}, {"Joints/Superelements": "bracket : superelement : rotor.outer", "Joints/Position tolerance": 1},
                 "is on the rotor, which turns"),
                ({}, {"Joints/Superelements": "bracket : superelement : upper.low"}, "is in contact or tied too"),
                ({}, {"Joints/Superelements": "upper.low : superelement : upper.end"}, "there is a body 'upper.low' already"),
                ({}, {"Output/Superelement": "upper.low : upper.end"}, "there is no body 'upper.low'"),
                ({}, {"Output/Superelement": "upper"}, "it is not body : surface"),
                ({}, {"Output/Superelement": "upper : upper.end", "Stage": "ladder"}, "with Stage = ladder")]:
            with self.subTest(words):
                for name, text in {**good, **files}.items():
                    if text is None:
                        (self.directory / name).unlink()
                    else:
                        self.write(name, text)
                self.write("refused.prm", st.parameter_file({**IN, **changed}))
                result = st.run("refused.prm", directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertIn(words, result.stderr)
        self.write_mesh(self.mesh())
        for changed, words in [
                ({"Output/Superelement": "upper.bracket : upper.bracket.begin : upper.bracket.end"}, "supported too"),
                ({"Output/Superelement": "upper.bracket : upper.bracket.begin : upper.high"}, "not on 'upper.bracket'")]:
            with self.subTest(words):
                self.write("refused.prm", st.parameter_file({**OUT, **changed}))
                result = st.run("refused.prm", directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertIn(words, result.stderr)

    def test_stages_without_damping(self):
        """Neither a superelement's D nor a dashpot damps the stage elastic."""
        self.superelement()
        damped = {**IN, "Joints/Points": "p : upper.high", "Joints/Dashpots": "p : ground : 1e3 1e3 1e3"}
        for stage, most in [("elastic", -1e-6), ("full", -1)]:
            modes = self.eigenvalues({**damped, "Stage": stage, "Contact/Friction/Coefficient": 0})
            least = min(l.real for l in modes)
            self.assertTrue(least > most if stage == "elastic" else least < most, least)

    def test_free_and_mechanism(self):
        """Nodes off the surface are free and held by K; a superelement that does not hold its pad is named."""
        self.write_mesh(self.mesh())
        settings = {"Contact/Steady pressure": "uniform"}
        results = self.analyse({**OUT, **settings, "Mesh/Clamped": "rotor.inner", "Output/Superelement modes": 100000,
                                "Output/Superelement": "upper.bracket : upper.bracket.begin : upper.bracket.end"})
        for name in FILES:
            shutil.copy(results / name, self.directory)
        self.write_mesh(self.mesh(bracket=False))
        # Two nodes that change their names and places: a free part would resist turning.
        nodes = (self.directory / FILES[-1]).read_text()
        lines = [line.split(",", 1) for line in nodes.splitlines()]
        lines[1], lines[-1] = ["a", lines[-1][1]], ["b", lines[1][1]]
        self.write(FILES[-1], "\n".join(map(",".join, lines)) + "\n")
        self.assertSettingsRefused(IN, "holds it against turning")
        self.write(FILES[-1], nodes)
        self.write("free.prm", st.parameter_file(IN))
        result = st.run("free.prm", directory=self.directory)
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        self.assertRegex(result.stderr, r"the body 'upper.low' can move rigidly in \d ways .* no static equilibrium")
        # With a given pressure it may: its end is free, as that of the mesh is.
        found = self.analyse({**IN, **settings})
        self.assertRegex((found / "log.txt").read_text(), r"12 nodes, 6 held by 'upper.end', at most \S+ m away, 6 free, ")
        # Two cells of 7.5 degrees with straight edges: 2 (r_2^2 - r_1^2)/2 sin(7.5 deg) 0.012 m 7850 kg/m^3. All of it moves
        # with the nodes where nothing is clamped.
        mass = (0.14**2 - 0.09**2) * math.sin(math.radians(7.5)) * 0.012 * 7850
        found_mass = float(re.search(r"internal coordinates, (\S+) kg", (found / "log.txt").read_text())[1])
        self.assertLessEqual(abs(found_mass - mass), 1e-5 * mass)
        whole = self.glued(**settings, **{"Mesh/Clamped": "rotor.inner"})
        found = eigenvalues(st.read_table(found / "modes.csv"))
        self.assertSameModes(found, whole, 1e-7)

    def test_refinement_and_map(self):
        """The pad's mesh is refined while the nodes that hold it stay: its first cycle is the single run, its second one
        the same on two ranks. Each point of a map is a run of its own."""
        self.superelement()
        expected = self.eigenvalues(IN)
        refined = {**IN, "Refinement/Strategy": "adaptive", "Refinement/Cycles": 2, "Refinement/Maximum unknowns": 20000}
        by_ranks = []
        for ranks in (1, 2):
            rows = st.read_table(self.analyse(refined, ranks=ranks) / "modes.csv")
            first, second = ([row for row in rows if row["cycle"] == cycle] for cycle in (0, 1))
            self.assertSameModes(eigenvalues(first), expected, 1e-7)
            by_ranks.append(second)
        self.assertSameModes(eigenvalues(by_ranks[1]), eigenvalues(by_ranks[0]), 1e-6)
        moved = max(abs(a - b) / abs(b) for a, b in zip(eigenvalues(by_ranks[0]), expected))
        self.assertGreater(moved, 1e-4, "the second mesh is another one")
        results = self.analyse({**IN, "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.3, 0.6",
                                "Sweep/Second parameter": "Operation/Angular velocity", "Sweep/Second values": "2, 5"})
        rows = st.read_table(results / "map.csv")
        self.assertEqual(len(rows), 4)
        for row in rows:
            single = self.eigenvalues({**IN, "Contact/Friction/Coefficient": row["Contact/Friction/Coefficient"],
                                             "Operation/Angular velocity": row["Operation/Angular velocity"]})
            growth = max(value.real for value in single)
            self.assertLessEqual(abs(row["growth_rate_1_per_s"] - growth), 1e-6 * abs(growth) + 1e-4, row)

    def test_changed_file(self):
        """An interrupted sweep begins anew when a matrix of its superelement has changed, and says which."""
        self.superelement()
        sweep = {**IN, **NO_BARS, "Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.1 : 0.5 : 60"}
        results = self.kill(sweep, lambda results: (results / "sweep.state").exists() and
                            (results / "sweep.csv").read_text().count("\n") > 5)
        self.assertTrue((results / "sweep.state").exists(), "the sweep ended too early for this test")
        damping = self.directory / "superelement-D.mtx"
        lines = damping.read_text().splitlines()
        at = next(i for i, line in enumerate(lines) if not line.startswith("%")) + 1
        damping.write_text("\n".join([*lines[:at], *(f"{line.rsplit(None, 1)[0]} {0.5 * float(line.split()[2])!r}"
                                                     for line in lines[at:])]) + "\n")
        result = st.run("killed.prm", directory=self.directory)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertNotIn("Resumed after", result.stdout)
        self.assertRegex(result.stdout, "not resumed.*begins? anew.*superelement-D.mtx")
        rows = [st.eigenvalue(row) for row in st.read_table(results / "sweep.csv") if row["parameter"] == 0.1]
        self.assertSameModes(rows, self.eigenvalues({**IN, "Contact/Friction/Coefficient": 0.1}), 1e-6)

    def test_input_files_belong_to_the_run(self):
        """A run whose superelement has changed begins anew."""
        self.superelement()
        results = self.analyse({**IN, "Eigenproblem/Maximum frequency": 2000})
        inputs = [line for line in (results / "run.manifest").read_text().splitlines() if line.startswith("input ")]
        for name in FILES:
            self.assertTrue([line for line in inputs if line.endswith("Joints/Superelements = " + name)], inputs)


if __name__ == "__main__":
    unittest.main(verbosity=2)
