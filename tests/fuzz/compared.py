"""New models by the hundred whose results are known in another way.

draw(rng, number) makes a model: small brakes with damping laws, joints, superelements, decks, modulus tables, samples,
sweeps, and matrices with closed forms, from mild values to wild ones. The first run may be refused (2) or give up (3). Where it
ends well, its table is compared: with runs by LAPACK (solver dense), with a run of its own for each sample or value, with
the same brake written by hand, or with a closed form. What differs is a wrong answer.

Eigenvalues are compared to what the backward error lets them be: condition number times tolerance, with room of a factor.
At the upper end of the window, and where an eigenvalue is about to lose its frequency, one list may have a mode more.
"""

import cmath
import math
import re

import element_files
import mesh_files
import squeal_testing as st

FRICTION, SPEED = "Contact/Friction/Coefficient", "Operation/Angular velocity"
TOLERANCE = 1e-10
BRAKE = {**st.DENSE_BRAKE, "Eigenproblem/Maximum frequency": 4000, "Eigenproblem/Tolerance": TOLERANCE}
MESH = {**BRAKE, **mesh_files.SCENE, "Mesh/File": "mesh.msh"}
ROOM = 1e4  # times condition number and tolerance: static states and projections are not exact either


class Model:
    """Files by name, the arguments of the runs in their order, and what compares their results: a function of the directory
    that returns what is wrong, or nothing. If one of `others` is not accepted, nothing can be compared, except `of_a_study`:
    then each of them is what one value of the first run is alone, and the function is also told how the runs of some ended
    that found no modes, {number from 0: category}."""

    def __init__(self, name, files, first, others, compare, of_a_study=False):
        self.name, self.first, self.others, self.compare, self.of_a_study = name, first, others, compare, of_a_study
        self.files = {file: text.encode() for file, text in files.items()}
        self.ways = []  # as a mutated case's


def wild(rng, middle, decades=1.5, wilder=0.1):
    """A positive number about the middle; now and then far from it."""
    return float(f"{middle * 10 ** rng.uniform(-1, 1) ** 3 * (1 if rng.random() > wilder else 10 ** rng.uniform(-decades, decades) ** 3):.6g}")


# ---- Comparing

def modes_of(directory):
    rows = st.read_table(directory / "modes.csv")
    last = max((row["cycle"] for row in rows), default=0)
    return [row for row in rows if row["cycle"] == last]


def settings_of(directory):
    """Keys of parameters.prm."""
    return {path: value for _, path, value in st.settings_in((directory / "parameters.prm").read_text())}


def different(found, expected, room, window):
    """What is wrong with eigenvalues, a list of (value, accuracy) each; empty: nothing."""
    left = list(expected)
    for value, bar in found:
        nearest = min(left, key=lambda other: abs(other[0] - value), default=None)
        if nearest is not None and abs(nearest[0] - value) <= bar + nearest[1] + room * abs(value):
            left.remove(nearest)
        elif not at_the_end(value, window):
            return f"the eigenvalue {value:.12g} is not among those expected; the nearest is " + \
                   (f"{nearest[0]:.12g}" if nearest else "none")
    for value, _ in left:
        if not at_the_end(value, window):
            return f"the eigenvalue {value:.12g} is missing, of {len(expected)}"
    return ""


def at_the_end(value, window):
    """Whether an eigenvalue may be listed or not."""
    return abs(value.imag) > (1 - 1e-5) * 2 * math.pi * window or abs(value.imag) < 1e-4 * abs(value)


def values(rows):
    # sqrt: where two eigenvalues are about to meet the condition number is not that of a small perturbation.
    return [(st.eigenvalue(row), abs(st.eigenvalue(row)) * min(ROOM * TOLERANCE * (row["condition_number"] or 1), 1e-3))
            for row in rows if row["frequency_hz"] > 0]


def same_modes(one, two, room=1e-7):
    """Compares two runs' modes.csv."""
    def compare(directory):
        window = float(settings_of(directory / "output" / one)["Eigenproblem/Maximum frequency"])
        return different(values(modes_of(directory / "output" / one)), values(modes_of(directory / "output" / two)), room, window)
    return compare


def by_lapack(name, files, settings):
    """A model that is solved by the default solver, without and with bars and halves, and by LAPACK."""
    files = {**files, "first.prm": st.parameter_file(settings),
             "dense.prm": st.parameter_file({**settings, "Eigenproblem/Solver": "dense", "Eigenproblem/Mirror symmetry": "false",
                                             "Eigenproblem/Error bars": "false"})}
    return Model(name, files, ["first.prm"], [["dense.prm"]], same_modes("first", "dense"))


# ---- Brakes

def brake(rng):
    """Numbers of a brake's friction, load, speed and contact."""
    settings = {FRICTION: round(rng.uniform(0, 1) ** 2, 4), SPEED: wild(rng, 15, 1), "Pads/Pressure": wild(rng, 1e6),
                "Pads/Material/Young modulus": wild(rng, 1e10), "Pads/Material/Density": wild(rng, 2500, 0.5),
                "Rotor/Material/Young modulus": wild(rng, 1.2e11, 0.5), "Pads/Material/Poisson ratio": round(rng.uniform(0, 0.45), 3)}
    if rng.random() < 0.4:
        settings["Contact/Steady pressure"] = "uniform"
    if rng.random() < 0.3:
        settings.update({"Contact/Formulation": "penalty", "Contact/Penalty stiffness": wild(rng, 1e12)})
    if rng.random() < 0.3:
        settings.update({"Contact/Friction/Law": "falling", "Contact/Friction/Coefficient at speed": settings[FRICTION] / 2,
                         "Contact/Friction/Decay speed": wild(rng, 2)})
    if rng.random() < 0.2:
        settings["Stage"] = rng.choice(["elastic", "friction", "transport", "full"])
    if rng.random() < 0.1:
        settings["Eigenproblem/Error bars"] = "true"
    return settings


def material(rng, body, kinds=("rayleigh", "loss", "prony", "zener", "shear")):
    """Damping of a body by one law or two."""
    settings = {}
    for kind in rng.sample(kinds, rng.choice([1, 1, 2])):
        settings.update({
            "rayleigh": {"Mass proportional damping": wild(rng, 10), "Stiffness proportional damping": wild(rng, 1e-6)},
            "loss": {"Loss factor": round(rng.choice([0.001, 0.02, 0.2, 1]) * rng.uniform(0.5, 2), 5)},
            "prony": {"Prony series": f"{rng.uniform(0, 1):.4f}:{wild(rng, 1e-4)}, {rng.uniform(0, 1):.4f}:{wild(rng, 1e-5)}"},
            "zener": {"Fractional Zener": f"{1 + rng.uniform(0, 3):.4f}:{wild(rng, 1e-5)}:{rng.uniform(0.3, 1):.3f}"},
            "shear": {"Shear viscosity": wild(rng, 1e3)}}[kind])
    return {f"{body}/Material/{key}": value for key, value in settings.items()}


def damping(rng):
    return by_lapack("damping", {}, {**BRAKE, **brake(rng), **material(rng, rng.choice(["Pads", "Rotor"])),
                                     **(material(rng, "Pads") if rng.random() < 0.3 else {})})


def joints(rng):
    """Points on the pads' ends and backs with springs, dashpots, masses, links."""
    mesh = mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1))
    points, entries = {"a": "upper.begin", "b": "lower.end"}, {}
    if rng.random() < 0.5:
        points["c"] = f"{rng.uniform(0, 0.2):.4f} 0.02 0.03"

    def several(count, make):
        return ", ".join(make() for _ in range(count))

    def pair():
        one, other = rng.sample([*points, "ground"], 2)
        return (other, one) if one == "ground" else (one, other)

    def of(middle):
        six = [wild(rng, middle) if rng.random() < 0.8 else 0 for _ in range(3)]
        if rng.random() < 0.4:
            six += [wild(rng, middle * 1e-3) for _ in range(3)]
        axes = f" : {rng.uniform(-1, 1):.3f} {rng.uniform(-1, 1):.3f} 1 0 1 0" if rng.random() < 0.2 else ""
        return " : ".join(pair()) + " : " + " ".join(map(str, six)) + axes
    entries["Springs"] = several(rng.choice([1, 2, 3]), lambda: of(rng.choice([1e-3, 1e3, 1e7, 1e7, 1e10])))
    if rng.random() < 0.6:
        entries["Dashpots"] = several(rng.choice([1, 2]), lambda: of(rng.choice([1e-3, 10, 100, 1e5])))
    entries["Masses"] = ", ".join(f"{name} : {wild(rng, 0.3)}" + (" 1e-3 2e-3 1e-3" if rng.random() < 0.5 else "")
                                  for name in points if name == "c" or rng.random() < 0.4)
    if "c" in points and rng.random() < 0.9:  # held, or it moves freely
        entries["Springs"] += f", c : {rng.choice(['a', 'ground'])} : {wild(rng, 1e6)} {wild(rng, 1e6)} {wild(rng, 1e6)} 1e3 1e3 1e3"
    elif "c" in points:
        entries["Rigid links"] = "a : c"
    settings = {**MESH, **brake(rng), **{f"Joints/{key}": value for key, value in entries.items()},
                "Joints/Points": ", ".join(f"{name} : {place}" for name, place in points.items())}
    if rng.random() < 0.3:  # springs alone hold the other one
        settings["Mesh/Guided"] = "lower.low"
        settings["Joints/Springs"] += f", a : ground : {wild(rng, 1e6)} {wild(rng, 1e6)} 0 0 0 {wild(rng, 1e4)}"
    return by_lapack("joints", {"mesh.msh": mesh_files.msh2(mesh)}, settings)


def superelement(rng):
    """A holder at the pad's end: symmetric matrices with internal coordinates, positive definite, or now and then one that is
    not, which must be refused."""
    mesh = mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1), pads=("upper",))
    nodes = sorted({mesh.nodes[node] for face in mesh.surfaces["upper.end"] for node in face})
    n_internal = rng.choice([0, 1, 2])
    n_own = 3 * len(nodes)
    size = n_own + n_internal
    indefinite = rng.choice("KM") if rng.random() < 0.1 else ""

    def matrix(diagonal, coupling, name=""):
        entries = [(i, i, diagonal * (1 + rng.random()) + size * coupling) for i in range(1, size + 1)]
        if name and name == indefinite:
            entries[0] = (1, 1, -entries[0][2])
        for _ in range(size):
            i, j = sorted(rng.sample(range(1, size + 1), 2), reverse=True)
            entries += [(i, j, coupling * rng.uniform(-1, 1))]
        both = {(i, j): x for i, j, x in entries} | {(j, i): x for i, j, x in entries}
        return "\n".join(["%%MatrixMarket matrix coordinate real general", f"{size} {size} {len(both)}",
                          *(f"{i} {j} {x!r}" for (i, j), x in sorted(both.items())), ""])

    table = "\n".join(["node,x_m,y_m,z_m", *(f"{k},{x!r},{y!r},{z!r}" for k, (x, y, z) in enumerate(nodes)), ""])
    stiffness, mass = wild(rng, 1e7), wild(rng, 0.01)
    files = {"mesh.msh": mesh_files.msh2(mesh), "holder-nodes.csv": table, "holder-K.mtx": matrix(stiffness, stiffness / 50, "K"),
             "holder-M.mtx": matrix(mass, mass / 50, "M")}
    if rng.random() < 0.6:
        files["holder-D.mtx"] = matrix(stiffness * 1e-6, stiffness * 1e-8)
    settings = {**MESH, **brake(rng), "Mesh/Pads": "upper", "Mesh/Contact pairs": "upper.low : rotor.high",
                "Mesh/Pressure on": "upper.high", "Mesh/Guided": rng.choice(["", "upper.high"]),
                "Joints/Superelements": "holder : holder : upper.end"}
    if indefinite:
        return Model("superelement", {**files, "first.prm": st.parameter_file(settings)}, ["first.prm"], [],
                     lambda directory: f"holder-{indefinite}.mtx is indefinite, and accepted")
    return by_lapack("superelement", files, settings)


# ---- Runs of their own

def points_of(rng, n):
    """(keys, points) of a study."""
    ranges = {FRICTION: (0, 1), SPEED: (1, 40), "Pads/Pressure": (1e5, 5e6), "Pads/Material/Young modulus": (1e9, 3e10),
              "Rotor/Material/Young modulus": (0.8e11, 2e11), "Pads/Material/Density": (1500, 4000),
              "Pads/Material/Stiffness proportional damping": (0, 1e-5), "Pads/Material/Loss factor": (0, 0.3)}
    keys = rng.sample(sorted(ranges), n)
    return keys, [[float(f"{rng.uniform(*ranges[key]):.6g}") for key in keys] for _ in range(3)]


def numbers_of_study(rng, n):
    keys, points = points_of(rng, n)
    settings = {**BRAKE, **brake(rng)}
    settings.pop("Eigenproblem/Error bars")
    settings = {**settings, "Eigenproblem/Error bars": "false"}
    return keys, points, settings


def single_runs(settings, keys, points):
    files = {f"single{k}.prm": st.parameter_file({**settings, **dict(zip(keys, point)), "Eigenproblem/Solver": "dense"})
             for k, point in enumerate(points)}
    return files, [[name] for name in files]


def samples(rng):
    keys, points, settings = numbers_of_study(rng, rng.choice([1, 2]))
    singles, runs = single_runs(settings, keys, points)
    lines = [",".join(keys), *(",".join(map(repr, point)) for point in points), ""]
    files = {**singles, "samples.csv": "\n".join(lines),
             "first.prm": st.parameter_file({**settings, "Sampling/File": "samples.csv"})}

    def compare(directory, ended):
        rows = st.read_table(directory / "output/first/samples.csv")
        if len(rows) != len(points):
            return f"{len(rows)} samples of {len(points)}"
        for k, row in enumerate(rows):
            if k in ended:
                if ended[k] == "exit 2" and row["growth_rate_1_per_s"] is not None:
                    return f"sample {k + 1} is accepted, alone it is refused"
                continue
            modes = modes_of(directory / f"output/single{k}")
            growth = max((mode["growth_rate_1_per_s"] for mode in modes), default=None)
            if (growth is None) != (row["growth_rate_1_per_s"] is None):
                return f"sample {k + 1}: the largest growth rate is {row['growth_rate_1_per_s']}, alone {growth}"
            if growth is None:
                continue
            worst = max(modes, key=lambda mode: mode["growth_rate_1_per_s"])
            room = 1e-7 * 2 * math.pi * worst["frequency_hz"] * (worst["condition_number"] or 1) + \
                (row["reduction_error_1_per_s"] or 0) + 1e-9 * abs(growth)
            if abs(growth - row["growth_rate_1_per_s"]) > room:
                return f"sample {k + 1}: the largest growth rate is {row['growth_rate_1_per_s']!r}, alone {growth!r}"
            if row["modes"] != len(modes) and not any(at_the_end(st.eigenvalue(mode), 4000) for mode in modes):
                return f"sample {k + 1}: {row['modes']:.0f} modes, alone {len(modes)}"
        return ""
    return Model("samples", files, ["first.prm"], runs, compare, of_a_study=True)


def sweep(rng):
    keys, points, settings = numbers_of_study(rng, 1)
    points.sort()
    singles, runs = single_runs(settings, keys, points)
    files = {**singles, "first.prm": st.parameter_file({
        **settings, "Sweep/Parameter": keys[0], "Sweep/Values": ", ".join(repr(point[0]) for point in points)})}

    def compare(directory, ended):
        rows = st.read_table(directory / "output/first/sweep.csv")
        for k, (value,) in enumerate(points):
            here = [row for row in rows if abs(row["parameter"] - value) <= 1e-9 * abs(value)]
            if k in ended:
                if ended[k] == "exit 2" and here:
                    return f"{keys[0]} = {value!r} is accepted, alone it is refused"
                continue
            found = [(st.eigenvalue(row), 10 * (row.get("reduction_error_1_per_s") or 0)) for row in here if row["frequency_hz"] > 0]
            if wrong := different(found, values(modes_of(directory / f"output/single{k}")), 1e-6, 4000):
                return f"{keys[0]} = {value!r}: {wrong}"
        return ""
    return Model("sweep", files, ["first.prm"], runs, compare, of_a_study=True)


# ---- Decks

def deck(rng):
    """A deck in mm, with parts, beside the same brake written by hand in m."""
    shape = {body: rng.choice([4, 6, 8]) for body in ("rotor", "upper", "lower")}

    def elements():
        return element_files.Elements(mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1)), shape.get)
    text, nodes = element_files.brake_deck(elements())
    friction, speed, load = round(rng.uniform(0, 1), 3), round(rng.uniform(1, 50), 2), round(rng.uniform(0.2, 4), 3)
    young, lining, density = wild(rng, 125000, 0.3, 0), wild(rng, 10000, 0.3, 0), wild(rng, 2.5e-9, 0.2, 0)
    beta = wild(rng, 2e-6, 1, 0)
    model = element_files.MODEL
    for old, new in (("\n 0.6,", f"\n {friction},"), ("_held, 20.,", f"_held, {speed},"), ("P, 1.\n", f"P, {load}\n"),
                     ("125000.,", f"{young},"), ("10000.,", f"{lining},"), (" 2.5e-09,", f" {density},"), ("2e-06", repr(beta))):
        model = model.replace(old, new)
    model = model.replace("20, , 6000.", f"20, , {rng.choice([3000, 4500, 6000])}.")
    if rng.random() < 0.3:  # how the keywords are written does not matter
        model = rng.choice([str.upper, str.lower])(model)
    if rng.random() < 0.3:
        model = model.replace("\n", "\r\n")
    mesh = elements()
    settings = {**{key: value for key, value in MESH.items() if key != "Mesh/Curved bodies"}, FRICTION: friction, SPEED: speed,
                "Mesh/Curved bodies": "rotor", "Pads/Pressure": load * 1e6, "Rotor/Material/Young modulus": young * 1e6,
                "Pads/Material/Young modulus": lining * 1e6, "Pads/Material/Density": density * 1e12,
                "Pads/Material/Stiffness proportional damping": beta}
    small = [word for key in BRAKE if key != "Eigenproblem/Maximum frequency" and key.split("/")[0] in ("Discretization", "Eigenproblem", "Output")
             for word in ("--set", f"{key}={BRAKE[key]}")]
    curved = ["--set", "Mesh/Curved bodies=rotor", "--set", "Eigenproblem/Maximum frequency=4000"]
    files = {"first.inp": text + model, "nodes.txt": nodes, "mesh.msh": element_files.msh2(mesh),
             "second.prm": st.parameter_file(settings)}
    return Model("deck", files, ["--from-deck", "first.inp"], [["first.prm", *small, *curved], ["second.prm"]],
                 same_modes("first", "second"))


# ---- Tables

def modulus_table(rng):
    """A table of moduli with numbers in any form. Either they do not depend on the frequency: that is another modulus. Or
    they are those of a Prony element with hysteresis: the modes are its modes to what the log says of the fit."""
    young, eta = wild(rng, 1e10, 0.5, 0), 0.
    settings = {**BRAKE, **brake(rng), "Pads/Material/Young modulus": young, "Eigenproblem/Error bars": "false"}
    law, g, tau = {}, 0., 1.
    if rng.random() < 0.5:
        frequencies = sorted({round(10 ** rng.uniform(0.5, 4.5), 2) for _ in range(rng.choice([3, 6, 12]))} | {5., 40000.})
    else:
        frequencies = [10 * 1.5 ** k for k in range(16)]
        g, tau, eta = round(rng.uniform(0.05, 1), 3), wild(rng, 4e-5, 0.3, 0), round(rng.choice([0, 0.02]) * rng.random(), 5)
        law = {"Pads/Material/Prony series": f"{g!r} : {tau!r}", "Pads/Material/Loss factor": eta}
        settings.pop("Stage", None)  # full: others have no damping
    styles = [lambda x: repr(x), lambda x: f"{x:.15e}", lambda x: f" {x!r} "]
    lines = []
    for f in frequencies:
        turned = 2j * math.pi * f * tau
        modulus = young * (1 + 1j * eta + g * turned / (1 + turned))
        lines.append(",".join(rng.choice(styles)(x) for x in (f, modulus.real, modulus.imag / modulus.real)))
    text = "\n".join(["frequency_hz,storage_modulus_pa,loss_factor", *lines, ""])
    if rng.random() < 0.3:
        text = text.replace("\n", "\r\n")
    files = {"table.csv": text, "first.prm": st.parameter_file({**settings, "Pads/Material/Modulus table": "table.csv"}),
             "second.prm": st.parameter_file({**settings, **law, "Eigenproblem/Solver": "dense"})}

    def compare(directory):
        fit = re.search(r"fit it within (\S+) %", (directory / "output/first/log.txt").read_text())
        # A modulus that is off by the fit's error moves an eigenvalue by half of that at most.
        return same_modes("first", "second", 1e-7 + (float(fit[1]) / 200 if fit else 0))(directory) if fit or not law else \
            "the log does not tell how well the table is fitted"
    return Model("modulus table", files, ["first.prm"], [["second.prm"]], compare)


# ---- Closed forms

def market(matrix):
    n = len(matrix)
    entries = [(i + 1, j + 1, matrix[i][j]) for i in range(n) for j in range(n) if matrix[i][j] != 0]
    return "\n".join(["%%MatrixMarket matrix coordinate real general", f"{n} {n} {len(entries)}",
                      *(f"{i} {j} {x!r}" for i, j, x in entries), ""])


def pairs_of_oscillators(rng):
    """l^2 + d l + [[a, n], [-n, b]] of each pair, seen in turned coordinates: l^2 + d l + s = 0 for both eigenvalues s of the
    two by two matrix, which are complex where n exceeds half of the difference of a and b."""
    n_pairs = rng.choice([1, 2, 5])
    size = 2 * n_pairs
    M, P, K, N = ([[0.] * size for _ in range(size)] for _ in range(4))
    expected = []
    for k in range(n_pairs):
        a = (2 * math.pi * rng.uniform(0.2, 3)) ** 2
        b, n = a * (1 + rng.choice([1e-6, 0.01, 0.3]) * rng.random()), a * rng.choice([0, 1e-4, 0.05, 0.4]) * rng.random()
        d, m = rng.choice([0, 1e-6, 0.05, 1]) * rng.random(), wild(rng, 1, 1, 0)
        i, j = 2 * k, 2 * k + 1
        M[i][i] = M[j][j] = m
        P[i][i] = P[j][j] = m * d
        K[i][i], K[j][j], N[i][j], N[j][i] = m * a, m * b, m * n, -m * n
        root = cmath.sqrt(((a - b) / 2) ** 2 - n * n)
        for s in ((a + b) / 2 + root, (a + b) / 2 - root):
            for sign in (1, -1):
                value = (-d + sign * cmath.sqrt(d * d - 4 * s)) / 2
                if value.imag > 0:
                    # Near a coalescence a perturbation moves by its root.
                    spread = max(abs(root) / abs(s), 1e-16)
                    expected.append((value, abs(value) * min(1e-9 / spread, 1e-4)))
    # Two turns mix everything: T^T A T.
    for _ in range(2 * size):
        i, j = rng.sample(range(size), 2)
        angle = rng.uniform(0, 6)
        c, s = math.cos(angle), math.sin(angle)
        for A in (M, P, K, N):
            for row in A:
                row[i], row[j] = c * row[i] + s * row[j], c * row[j] - s * row[i]
            A[i], A[j] = ([c * x + s * y for x, y in zip(A[i], A[j])], [c * y - s * x for x, y in zip(A[i], A[j])])
    for A in (M, P, K):  # symmetric to the last bit
        for i in range(size):
            for j in range(i):
                A[i][j] = A[j][i]
    files = {"M.mtx": market(M), "P.mtx": market(P), "K.mtx": market(K), "N.mtx": market(N)}
    window = rng.choice([1.5, 5])
    settings = {"Scene": "matrices", "Matrices/Mass": "M.mtx", "Matrices/Velocity": "P.mtx", "Matrices/Stiffness": "K.mtx",
                "Matrices/Circulatory": "N.mtx", "Eigenproblem/Maximum frequency": window,
                "Eigenproblem/Solver": rng.choice(["block_krylov", "krylov", "dense"])}
    files["first.prm"] = st.parameter_file(settings)

    def compare(directory):
        inside = [(value, bar) for value, bar in expected if value.imag <= 2 * math.pi * window * (1 + 1e-5)]
        found = [(st.eigenvalue(row), 0) for row in modes_of(directory / "output/first") if row["frequency_hz"] > 0]
        return different(found, inside, 1e-8, window)
    return Model("oscillators", files, ["first.prm"], [], compare)


def lossy_oscillators(rng):
    """Independent oscillators m l^2 + c l + k (1 + i eta), and of a Prony element k (1 + g l tau / (1 + l tau)): roots of
    polynomials, the ones with a positive imaginary part."""
    size, eta = rng.choice([1, 2, 3]), rng.choice([0, 0.01, 0.3, 1]) * rng.random()
    g, tau = rng.choice([(0, 1), (rng.uniform(0.1, 2), wild(rng, 0.1))])
    if eta:
        g = 0
    M, P, K, expected = ([[0.] * size for _ in range(size)], [[0.] * size for _ in range(size)],
                         [[0.] * size for _ in range(size)], [])
    for i in range(size):
        m, k = wild(rng, 1, 1, 0), (2 * math.pi * rng.uniform(0.2, 3)) ** 2
        c = rng.choice([0, 0.1, 2]) * rng.random()
        M[i][i], P[i][i], K[i][i] = m, m * c, m * k
        roots = [(-c + sign * cmath.sqrt(c * c - 4 * k * (1 + 1j * eta))) / 2 for sign in (1, -1)] if not g else \
            cubic([tau, 1 + c * tau, c + k * tau * (1 + g), k])
        expected += [(root, 1e-7 * abs(root)) for root in roots if root.imag > 1e-9 * abs(root)]
    zero = [[0.] * size for _ in range(size)]
    for i in range(size):
        zero[i][i] = 1e-12 * K[i][i]
    files = {"M.mtx": market(M), "P.mtx": market(P), "K.mtx": market(zero), "A.mtx": market(K)}
    settings = {"Scene": "matrices", "Matrices/Mass": "M.mtx", "Matrices/Stiffness": "K.mtx",
                "Matrices/Viscoelastic 1/Stiffness": "A.mtx", "Eigenproblem/Maximum frequency": 5}
    if any(P[i][i] for i in range(size)):
        settings["Matrices/Velocity"] = "P.mtx"
    if eta:
        settings["Matrices/Viscoelastic 1/Loss factor"] = repr(eta)
    if g:
        settings["Matrices/Viscoelastic 1/Prony series"] = f"{g!r}:{tau!r}"
    files["first.prm"] = st.parameter_file(settings)

    def compare(directory):
        found = [(st.eigenvalue(row), 0) for row in modes_of(directory / "output/first") if row["frequency_hz"] > 0]
        return different(found, [pair for pair in expected if pair[0].imag <= 2 * math.pi * 5 * (1 + 1e-5)], 1e-7, 5)
    return Model("lossy oscillators", files, ["first.prm"], [], compare)


def cubic(coefficients):
    """Roots of a polynomial by Durand and Kerner, with a last step of Newton's method."""
    a = [c / coefficients[0] for c in coefficients]
    size = 1 + max(map(abs, a))
    roots = [(0.4 + 0.9j) ** k * abs(a[-1]) ** (1 / 3) for k in range(3)]

    def value(x):
        return ((x + a[1]) * x + a[2]) * x + a[3]
    for _ in range(500):
        for i, x in enumerate(roots):
            product = 1
            for j, y in enumerate(roots):
                if i != j:
                    product *= x - y if x != y else 1e-12 * size
            roots[i] = x - value(x) / product
    return [x - value(x) / (3 * x * x + 2 * a[1] * x + a[2] or 1) for x in roots]


KINDS = [damping, joints, superelement, samples, sweep, deck, modulus_table, pairs_of_oscillators, lossy_oscillators]


def draw(rng, number):
    """The model of a number: kinds go round."""
    return KINDS[number % len(KINDS)](rng)
