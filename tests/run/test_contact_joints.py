"""Contact between bodies that do not slide: stick and frictionless (theory.md, section 11).

Where stick contact is closed everywhere it is a tie; where it opens, a row of its own says so, in the statics and in the
modes.
"""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import element_files  # noqa: E402
import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402
import test_joints as joints  # noqa: E402

SURFACES = ["upper.high : upper.plate.low", "lower.low : lower.plate.high"]


class PlatesInContact(st.TestCase):
    """The plates of test_joints.Parts, which touch the linings instead of being tied to them."""

    brake = joints.Parts.brake
    write_brake = joints.Parts.write_brake

    def settings(self, kind, **others):
        # With so little friction the plates touch everywhere; half of the pressure's profile lets them lift off.
        return joints.Parts.settings(self, **{
            "Joints/Ties": "", "Joints/Contacts": ", ".join(f"{pair} : {kind}" for pair in SURFACES),
            "Contact/Friction/Coefficient": 0.05, **others})

    def static(self, results):
        return {row["pad"]: row for row in st.read_table(results / "static.csv")}

    def test_stick_is_a_tie(self):
        """Closed everywhere, on the meshes of the lining and on others."""
        for n_around in [(3, 3), (4, 3)]:
            self.write_brake(n_around=n_around)
            tie = {"Joints/Ties": ", ".join(SURFACES), "Joints/Contacts": ""}
            expected = self.modes(self.settings("stick", **tie))
            results = self.analyse(self.settings("stick"))
            # Two multipliers a node more than its pressure
            modes = st.read_table(results / "modes.csv")
            self.assertSameModes(joints.eigenvalues(modes), joints.eigenvalues(expected), 1e-8)
            for mode, other in zip(modes, expected):
                self.assertAlmostEqual(mode["frequency_error_hz"], other["frequency_error_hz"],
                                       delta=0.1 * other["frequency_error_hz"])
            static = self.static(results)
            self.assertEqual(set(static), {"upper.low", "lower.high", *SURFACES})
            # The plates are pressed onto the linings, these onto the disc: the loads, and nothing else.
            load = 1e6 * 0.5 * (0.14**2 - 0.09**2) * math.radians(50)
            for pair in SURFACES:
                pad = static["upper.low" if pair.startswith("upper") else "lower.high"]
                self.assertAlmostEqual(static[pair]["contact_area_m2"], load / 1e6, delta=1e-4 * load / 1e6)
                self.assertAlmostEqual(static[pair]["normal_force_n"], load, delta=1e-4 * load)
                self.assertAlmostEqual(static[pair]["normal_force_n"], pad["normal_force_n"], delta=1e-10 * load)
                self.assertGreater(static[pair]["needed_friction"], 0)
                # The guided plates hold the linings, which the disc drags.
                self.assertAlmostEqual(static[pair]["friction_torque_nm"], -pad["friction_torque_nm"],
                                       delta=1e-9 * abs(pad["friction_torque_nm"]))

    def test_lift_off(self):
        """Partly open: ranks, other solvers, a sweep and a refined mesh agree with a single run; a tie would not."""
        self.write_brake(n_around=(4, 3))
        lifted = {"Pads/Pressure profile": "1 + 25*y", "Contact/Friction/Coefficient": 0.4,
                  "Discretization/Degree": 1, "Eigenproblem/Maximum frequency": 5000}
        for kind in ["stick", "stick 0.1", "frictionless"]:
            with self.subTest(kind):
                held = {} if kind != "frictionless" else {
                    "Mesh/Guided": "upper.plate.high, lower.plate.low, upper.end, lower.begin"}
                settings = self.settings(kind, **lifted, **held)
                results = self.analyse(settings)
                static, log = self.static(results), (results / "log.txt").read_text()
                areas = [static[pair]["contact_area_m2"] for pair in SURFACES]
                self.assertLess(min(areas), 0.99 * 0.5 * (0.14**2 - 0.09**2) * math.radians(50))
                expected = joints.eigenvalues(st.read_table(results / "modes.csv"))
                self.assertGreater(len(expected), 3)
                self.assertEqual("where it needs more it slips" in log, kind == "stick 0.1")
                if kind == "stick 0.1":
                    self.assertGreater(max(static[pair]["needed_friction"] for pair in SURFACES), 0.1)
                    continue
                self.assertSameModes(self.eigenvalues(settings, ranks=2), expected, 1e-7)
                for other in [{"Eigenproblem/Solver": "dense"}, {"Eigenproblem/Mirror symmetry": "false"}]:
                    self.assertSameModes(self.eigenvalues({**settings, **other}), expected, 1e-7)
                sweep = {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.3, 0.4"}
                rows = st.read_table(self.analyse({**settings, **sweep}) / "sweep.csv")
                self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == 0.4], expected, 1e-6)
                tied = self.modes(self.settings(kind, **lifted, **{
                    "Joints/Ties": ", ".join(SURFACES), "Joints/Contacts": ""}))
                self.assertGreater(max(min(abs(l - m) for m in joints.eigenvalues(tied)) for l in expected), 5)

    def test_parts_alone(self):
        """Two parts without a disc and without a load touch: with stick contact they have the modes of a tie."""
        mesh = mesh_files.Mesh()
        for name, heights, n in [("base", (0, 0.01), 3), ("block", (0.01, 0.02), 2)]:
            mesh.sector(name, mesh_files.equal(0.09, 0.14, n), mesh_files.equal(0, 0.4, n), heights)
        self.write("parts.msh", mesh_files.msh2(mesh))
        settings = {"Scene": "mesh", "Stage": "elastic", "Mesh/File": "parts.msh", "Mesh/Rotor": "", "Mesh/Clamped": "base.low",
                    "Mesh/Part 1/Volumes": "base, block", "Mesh/Part 1/Body": "parts", "Output/Fields": "none",
                    "Discretization/Degree": 2, "Eigenproblem/Maximum frequency": 70000, "Eigenproblem/Error bars": "false"}
        tied, stuck = (self.eigenvalues({**settings, **joint}) for joint in (
            {"Joints/Ties": "block.low : base.high"}, {"Joints/Contacts": "block.low : base.high : stick"}))
        self.assertGreater(len(tied), 3)
        self.assertSameModes(stuck, tied, 1e-8)
        loose = st.run(self.write("loose.prm", {**settings, "Joints/Contacts": "block.low : base.high : frictionless"}).name,
                       directory=self.directory)
        self.assertEqual(loose.returncode, 2, loose.stdout)
        self.assertIn("the body 'block' can move rigidly in 3 ways", loose.stderr)

    def test_neither_stuck_nor_open(self):
        """Sets of contacts that repeat: a node that stuck would be pulled apart, and open would overlap, slips."""
        self.write_brake(n_around=(2, 5))
        settings = self.settings("stick", **{
            "Joints/Contacts": "upper.plate.low : upper.high : stick, lower.plate.high : lower.low : stick",
            "Pads/Pressure profile": "1 + 25*y", "Contact/Friction/Coefficient": 0.5,
            "Eigenproblem/Maximum frequency": 3000, "Eigenproblem/Error bars": "false"})
        results = self.analyse(settings)
        log = (results / "log.txt").read_text()
        self.assertIn("No contact changes any more", log)
        self.assertIn("of its closed nodes slip: stuck they would be pulled apart", log)
        expected = joints.eigenvalues(st.read_table(results / "modes.csv"))
        self.assertGreater(len(expected), 3)
        self.assertSameModes(self.eigenvalues(settings, ranks=2), expected, 1e-7)
        sweep = {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": "0.4, 0.5"}
        rows = st.read_table(self.analyse({**settings, **sweep}) / "sweep.csv")
        self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == 0.5], expected, 1e-6)

    def test_bars_hold(self):
        """Bars of a partly open stick contact against a mesh of half the size."""
        self.write_brake(n_around=(4, 3))
        settings = self.settings("stick", **{"Pads/Pressure profile": "1 + 25*y", "Contact/Friction/Coefficient": 0.4,
                                             "Eigenproblem/Maximum frequency": 3000})
        modes = self.modes(settings)
        self.assertGreater(len(modes), 3)
        fine = [row for row in self.modes({**settings, "Refinement/Strategy": "uniform", "Refinement/Cycles": 2})
                if row["cycle"] == 1]
        self.assertEqual(len(fine), len(modes))
        for mode, other in zip(modes, fine):
            for value, bar in [("frequency_hz", "frequency_error_hz"),
                               ("growth_rate_1_per_s", "growth_rate_error_1_per_s")]:
                self.assertLessEqual(abs(mode[value] - other[value]), mode[bar] + other[bar], (mode["mode"], value))

    def test_refusals(self):
        self.write_brake()
        good = self.settings("stick")
        pairs = good["Joints/Contacts"]
        for changed, words in [
                ({"Joints/Contacts": "upper.high : upper.plate.low : glue"}, "is not surface : surface : frictionless"),
                ({"Joints/Contacts": "upper.high : upper.plate.low : stick -1"}, "friction coefficient above zero"),
                ({"Joints/Contacts": "upper.high : upper.plate.low : frictionless 0.2"}, "is not surface : surface"),
                ({"Joints/Contacts": pairs.replace("lower.low", "nothing")}, "there is no surface group 'nothing'"),
                ({"Joints/Contacts": pairs.replace("upper.plate.low", "rotor.outer")}, "is on the rotor, which turns"),
                ({"Joints/Contacts": pairs.replace("upper.plate.low", "upper.begin")}, "are on the same body"),
                ({"Joints/Contacts": pairs.replace("upper.plate.low", "upper.plate.end")}, "only 0 % of"),
                ({"Joints/Contacts": pairs + ", upper.end : upper.plate.end : stick"}, "share nodes"),
                ({"Joints/Ties": "upper.high : upper.plate.low"}, "is in a contact and in Joints/Ties too"),
                ({"Contact/Formulation": "penalty"}, "does not go with Joints/Contacts"),
                ({"Joints/Contacts": pairs.replace("stick", "frictionless")},
                 "can move rigidly in 3 ways (along x, along y, about z)"),
                ({"Static equilibrium/Linear solver": "iterative"}, "has no joints")]:
            with self.subTest(words):
                self.write("refused.prm", st.parameter_file({**good, **changed}))
                result = st.run("refused.prm", directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertIn(words, result.stderr)


class Pads(st.TestCase):
    """Friction of single pads, and gaps of the mesh that are closed."""

    def test_friction_of_pads(self):
        low, high = 0.3, 0.5
        both = {**st.TINY_BRAKE, "Contact/Friction/Coefficient": low, "Stage": "full"}
        expected = self.eigenvalues(both)
        same = {**both, "Contact/Friction/Coefficient": high,
                "Contact/Friction/Of pads": f"upper : Coefficient {low}, lower : Law constant; Coefficient {low}"}
        self.assertSameModes(self.eigenvalues(same), expected, 1e-9)
        one = {**both, "Contact/Friction/Of pads": f"lower : Coefficient {high}"}
        results = self.analyse(one)
        for row in st.read_table(results / "static.csv"):
            mu = {"upper": low, "lower": high}[row["pad"]]
            self.assertAlmostEqual(row["friction_force_n"], mu * row["normal_force_n"], delta=1e-9 * row["normal_force_n"])
        modes = joints.eigenvalues(st.read_table(results / "modes.csv"))
        self.assertGreater(max(min(abs(l - m) for m in expected) for l in modes), 1)
        # The other way round it is the mirror image; other paths agree.
        other = {**both, "Contact/Friction/Coefficient": high, "Contact/Friction/Of pads": f"lower : Coefficient {low}"}
        for settings, ranks in [(other, 1), (one, 2), ({**one, "Eigenproblem/Solver": "dense"}, 1)]:
            self.assertSameModes(self.eigenvalues(settings, ranks=ranks), modes, 1e-7)
        sweep = {"Sweep/Parameter": "Contact/Friction/Coefficient", "Sweep/Values": f"0.1, {low}"}
        rows = st.read_table(self.analyse({**one, **sweep}) / "sweep.csv")
        self.assertSameModes([st.eigenvalue(row) for row in rows if row["parameter"] == low], modes, 1e-6)

    def test_falling_friction_of_one_pad(self):
        """What falling friction of the lower pad feeds in is felt by its modes; halves on two laws are no halves."""
        falling = "Law falling; Coefficient 0.4; Coefficient at speed 0.1; Decay speed 1"
        settings = {**st.TINY_BRAKE, "Stage": "full", "Contact/Friction/Coefficient": 0.4}
        one = {**settings, "Contact/Friction/Of pads": f"lower : {falling}"}
        results = self.analyse(one)
        modes = joints.eigenvalues(st.read_table(results / "modes.csv"))
        self.assertIn("falling friction", {row["origin"] for row in st.read_table(results / "contributions.csv")})
        self.assertSameModes(self.eigenvalues({**one, "Eigenproblem/Solver": "dense"}), modes, 1e-7)

    def test_refused_friction(self):
        for value, words in [("left : Coefficient 0.3", "there is no pad 'left'; allowed are upper, lower"),
                             ("upper : Coefficient 0.3, upper : Coefficient 0.4", "'upper' is named twice"),
                             ("upper : Colour 0.3", "'Colour 0.3'"), ("upper : Coefficient -1", "'Coefficient -1'"),
                             ("upper", "has no colon")]:
            with self.subTest(value):
                self.write("refused.prm", st.parameter_file({**st.TINY_BRAKE, "Contact/Friction/Of pads": value}))
                result = st.run("refused.prm", directory=self.directory)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertIn(words, result.stderr)

    def test_gap(self):
        """A gap of 0.1 mm between the upper pad and the disc is closed on demand: what it was without, but for the lever
        arms."""
        mesh = mesh_files.brake()
        self.write("brake.msh", mesh_files.msh2(mesh))
        expected = self.modes(joints.BRAKE)
        mesh.move(lambda x, y, z: (x, y, z + 1e-4 * (z > 0.0065)))
        mesh.nodes = [(x, y, z) for x, y, z in mesh.nodes]
        first = min(v for face in mesh.surfaces["upper.low"] for v in face)
        mesh.nodes = [(x, y, z + 1e-4 * (v >= first and abs(z - 0.006) < 1e-9)) for v, (x, y, z) in enumerate(mesh.nodes)]
        self.write("brake.msh", mesh_files.msh2(mesh))
        self.write("refused.prm", st.parameter_file(joints.BRAKE))
        result = st.run("refused.prm", directory=self.directory)
        self.assertEqual(result.returncode, 2)
        self.assertIn("a gap of 0.0001 m", result.stderr)
        self.assertIn("Mesh/Contact tolerance = 0.00011 takes them as touching", result.stderr)
        closed = {**joints.BRAKE, "Mesh/Contact tolerance": 1.5e-4}
        modes = self.modes(closed)
        for mode, other in zip(modes, expected):
            self.assertAlmostEqual(mode["frequency_hz"], other["frequency_hz"], delta=2e-3 * other["frequency_hz"])
        self.assertSameModes(self.eigenvalues(closed, ranks=2), joints.eigenvalues(modes), 1e-7)


class OnACylinder(st.TestCase):
    """A ring around another one, r = 0.1 m, cells that do not match; the rotor is a small stiff one beside."""

    SETTINGS = {**mesh_files.SCENE, "Mesh/File": "rings.msh", "Mesh/Pads": "", "Mesh/Contact pairs": "", "Mesh/Guided": "",
                "Mesh/Pressure on": "", "Mesh/Curved bodies": "all", "Mesh/Clamped": "rotor.inner, core.inner",
                "Mesh/Part 1/Volumes": "core, ring", "Mesh/Part 1/Body": "parts", "Output/Fields": "none",
                "Stage": "elastic", "Eigenproblem/Maximum frequency": 3000, "Contact/Steady pressure": "uniform",
                "Eigenproblem/Error bars": "false"}

    def write_rings(self, n):
        """n cells around the inner one, 5/4 n around the outer one."""
        mesh = mesh_files.Mesh()
        for name, low, high, around, cells in [("rotor", 0.01, 0.02, 8, 1), ("core", 0.05, 0.1, n, 2),
                                               ("ring", 0.1, 0.15, n * 5 // 4, 2)]:
            mesh.sector(name, mesh_files.equal(low, high, cells), mesh_files.equal(0, 2 * math.pi, around),
                        mesh_files.equal(-0.006, 0.006, 1), ring=True)
        self.write("rings.msh", mesh_files.msh2(mesh))

    def test_stick_and_frictionless(self):
        """Stick contact: its tractions turn with the surface, those of a tie do not, so that both differ by the error of
        the geometry, which falls with the mesh. Frictionless contact: turning about the axis costs the ring nothing but
        that error."""
        settings = {**self.SETTINGS, "Discretization/Degree": 2}
        stick = {**settings, "Joints/Contacts": "ring.inner : core.outer : stick"}
        slides = {**settings, "Joints/Contacts": "ring.inner : core.outer : frictionless"}
        differences, turning = [], []
        for n in (12, 24):
            self.write_rings(n)
            tie = self.eigenvalues({**settings, "Joints/Ties": "ring.inner : core.outer"})
            found = self.eigenvalues(stick)
            self.assertGreater(len(tie), 5)
            differences.append(max(abs(a - b) / abs(b) for a, b in self.pairs(found, tie)))
            if n == 12:
                self.assertSameModes(self.eigenvalues(stick, ranks=3), found, 1e-7)
            results = self.analyse(slides)
            # Along the axis it moves freely.
            self.assertIn("Not listed: 1 rigid-body modes at zero frequency", (results / "log.txt").read_text())
            frequencies = sorted(abs(st.eigenvalue(row)) for row in st.read_table(results / "modes.csv"))
            turning.append(frequencies[0] / frequencies[1])
        self.assertLess(differences[0], 2e-4)
        self.assertLess(differences[1], differences[0] / 8)
        self.assertLess(turning[0], 0.1)
        self.assertLess(turning[1], turning[0] / 4)


class DividedCylinders(st.TestCase):
    """A quarter of a sleeve that is pressed onto a core, held in plane strain: Lamé's pressure where they touch. Cells of
    hexahedra and quadratic tetrahedra, meshes that match and do not."""

    RADII, LENGTH, PRESSURE = (0.05, 0.07, 0.09), 0.02, 2e6
    MESHES = {"hexahedra": (8, 8, 4), "core of hexahedra": (8, 4, 4), "other cells": (8, 4, 5), "tetrahedra": (4, 4, 5)}

    def settings(self, core, sleeve, n_core, joint, on_tetrahedra="divided"):
        inner, middle, outer = self.RADII
        mesh = mesh_files.Mesh()
        for body, radii, n in (("core", (inner, middle), n_core), ("sleeve", (middle, outer), 4)):
            mesh.sector(body, mesh_files.equal(*radii, 2), mesh_files.equal(0, math.pi / 2, n), [0, self.LENGTH])
        elements = element_files.Elements(mesh, lambda body: core if body == "core" else sleeve)
        if min(core, sleeve) == 4:
            elements.make_quadratic({body: element_files.on_circle for body in mesh.volumes})
        self.write("sleeve.msh", element_files.msh2(elements))
        held = {key: ", ".join(f"{body}.{side}" for body in mesh.volumes for side in sides)
                for key, sides in (("x", ["end"]), ("y", ["begin"]), ("z", ["low", "high"]))}
        pair = "core.outer : sleeve.inner"
        return {"Scene": "mesh", "Stage": "elastic", "Mesh/File": "sleeve.msh", "Mesh/Rotor": "",
                **{f"Mesh/Part {i}/{key}": value for i, body in enumerate(mesh.volumes, start=1)
                   for key, value in (("Volumes", body), ("Body", "parts"))},
                **{f"Mesh/Fixed in {key}": value for key, value in held.items()},
                "Mesh/Pressure on": "sleeve.outer", "Pads/Pressure": self.PRESSURE, "Mesh/Tetrahedra": on_tetrahedra,
                "Mesh/Curved bodies": "none" if min(core, sleeve) == 4 else "all", "Discretization/Degree": 2,
                "Eigenproblem/Maximum frequency": 26000, "Output/Fields": "none",
                **({"Joints/Ties": pair} if joint == "tie" else {"Joints/Contacts": f"{pair} : {joint}"})}

    def of_lame(self):
        """Pressure where they touch, and the area."""
        inner, middle, outer = self.RADII
        return (self.PRESSURE * outer**2 / (outer**2 - inner**2) * (1 - (inner / middle)**2),
                middle * math.pi / 2 * self.LENGTH)

    def test_own_polynomials(self):
        """Tetrahedra at their own nodes, with pressures that are linear on triangles: of all kinds of meshes."""
        pressure, area = self.of_lame()
        for joint, name in (("stick", "tetrahedra"), ("frictionless", "tetrahedra"), ("frictionless", "core of hexahedra")):
            with self.subTest(f"{joint}, {name}"):
                results = self.analyse({**self.settings(*self.MESHES[name], joint, "own"), "Eigenproblem/Error bars": "false"})
                [static] = st.read_table(results / "static.csv")
                self.assertAlmostEqual(static["contact_area_m2"] / area, 1, delta=1e-4)
                self.assertAlmostEqual(static["normal_force_n"] / (pressure * area), 1, delta=2e-4)
                # At nodes of hexahedra beside curved triangles that do not match
                self.assertAlmostEqual(static["max_pressure_pa"] / pressure, 1, delta=0.02 if name == "tetrahedra" else 0.1)

    def test_pressure_and_modes(self):
        pressure, area = self.of_lame()
        for joint in ("stick", "frictionless"):
            limits = self.modes(self.settings(4, 4, 4, joint))
            for name, (core, sleeve, n_core) in self.MESHES.items():
                with self.subTest(f"{joint}, {name}"):
                    results = self.analyse(self.settings(core, sleeve, n_core, joint))
                    [static] = st.read_table(results / "static.csv")
                    self.assertAlmostEqual(static["contact_area_m2"] / area, 1, delta=1e-4)
                    self.assertAlmostEqual(static["normal_force_n"] / (pressure * area), 1, delta=1e-4)
                    self.assertAlmostEqual(static["max_pressure_pa"] / pressure, 1, delta=0.02)
                    modes = st.read_table(results / "modes.csv")
                    if joint == "stick":
                        # Tractions by the axes instead of by the normal: the same if the meshes match.
                        tie = self.eigenvalues(self.settings(core, sleeve, n_core, "tie"))
                        self.assertSameModes(joints.eigenvalues(modes), tie,
                                             1e-8 if n_core == 4 and core == sleeve else 2e-4)
                    self.assertEqual(len(modes), len(limits))
                    for mode, limit in zip(modes, limits):
                        self.assertLessEqual(abs(mode["frequency_hz"] - limit["frequency_hz"]),
                                             mode["frequency_error_hz"] + limit["frequency_error_hz"])


class FewNodes(st.TestCase):
    """A clamped bar is pressed onto a block under its free end, where it touches in a few nodes: with one node less or
    more it is another system."""

    def bar(self, degree, n):
        mesh = mesh_files.Mesh()
        mesh.sector("base", mesh_files.equal(0.09, 0.1, n), mesh_files.equal(0.4, 0.5, 2 * n), [0, 0.01])
        mesh.sector("bar", mesh_files.equal(0.09, 0.1, n), mesh_files.equal(0, 0.5, 5 * n),
                    mesh_files.equal(0.01, 0.015, n))
        self.write("bar.msh", mesh_files.msh2(mesh))
        results = self.analyse({
            "Scene": "mesh", "Stage": "full", "Mesh/File": "bar.msh", "Mesh/Rotor": "", "Mesh/Pressure on": "bar.high",
            "Mesh/Clamped": "base.low, bar.begin", "Mesh/Part 1/Volumes": "base, bar", "Mesh/Part 1/Body": "parts",
            "Mesh/Part 1/Material/Stiffness proportional damping": 1e-6, "Pads/Pressure": 1e6, "Output/Fields": "none",
            "Joints/Contacts": "base.high : bar.low : frictionless", "Discretization/Degree": degree,
            "Eigenproblem/Maximum frequency": 29500})
        return st.read_table(results / "modes.csv"), st.read_table(results / "bars.csv")

    def test_bars(self):
        """They hold, and are less than half of the frequency (largest recorded: 0.37; to first order 5.8)."""
        modes, parts = self.bar(2, 1)
        fine, _ = self.bar(3, 2)
        self.assertEqual((len(modes), len(fine)), (6, 6))
        for mode, other in zip(modes, fine):
            for value, bar in (("frequency_hz", "frequency_error_hz"),
                               ("growth_rate_1_per_s", "growth_rate_error_1_per_s")):
                error = abs(mode[value] - other[value])
                self.assertLessEqual(error, mode[bar] + other[bar], (mode["mode"], value))
            self.assertLess(mode["frequency_error_hz"], 0.5 * mode["frequency_hz"])
        causes = {row["cause"] for row in parts if not row["at"]}
        self.assertIn("edge of base.high : bar.low", causes)


if __name__ == "__main__":
    unittest.main(verbosity=2)
