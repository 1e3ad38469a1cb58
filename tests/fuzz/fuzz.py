#!/usr/bin/env python3
"""Wrong input by the hundred: mutated parameter, mesh and matrix files must run, or be refused with a message.

    scripts/build.sh asan squeal
    python3 tests/fuzz/fuzz.py [--program build/asan/squeal] [--number 200] [--seed 1] [--jobs 2] [--keep DIR]
    python3 tests/fuzz/fuzz.py --case 17 --keep DIR         one case of the same seed again
    python3 tests/fuzz/fuzz.py --of deck second_order from_deck     only cases that start from these
    python3 tests/fuzz/fuzz.py --of from_deck_quadratic from_deck_parts second_order    decks of second order
    python3 tests/fuzz/fuzz.py --new                        new models in place of mutated ones; results are compared

Every case starts from a parameter file of prm/, made small, or from a mesh of mesh_files.py, and changes it: cases with
an even number the form of the files (lines, words, bytes), those with an odd number the meaning (values, nodes, cells,
groups); each tenth is a run that was killed, with changed states, tables or manifest. A case depends on the seed and its number only, so that 40 cases are the first 40 of 200.

Allowed: the run ends well (status 0) with finite tables; the input is refused (2) or a solver gives up (3) with a message
that a user can read. Everything else is listed with the command that repeats it: exit status 1 fails. With --new models are
made (compared.py), and where the run ends well its table is compared with an independent way: what differs is "wrong", and so
is a value of a study that is refused when it is alone. tests/run/test_compared.py shows that wrong tables are found.
"""

import argparse
import collections
import concurrent.futures
import csv
import functools
import json
import math
import os
import pathlib
import random
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import cae_deck  # noqa: E402
import compared  # noqa: E402
import element_files  # noqa: E402
import mesh_files  # noqa: E402
import squeal_testing as st  # noqa: E402

LARGEST_MEMORY = 3 * 2**30  # bytes; more is "too large": a mesh of mutated size must be refused before it is made
ALLOWED = ("ran", "exit 2", "exit 3")
CATEGORIES = (*ALLOWED, "wrong", "exit 1", "bad message", "not finite", "crash", "sanitizer", "hang", "too large")

# ---- What is mutated: cases that run in a second or two

SMALL = {"Discretization/Degree": 1, "Discretization/Rotor cells": "2, 8, 1", "Discretization/Pad cells": "1, 2, 1",
         "Eigenproblem/Maximum frequency": 4000, "Refinement/Maximum unknowns": 3000}
SMALL_STRIP = {**SMALL, "Discretization/Rotor cells": "1, 10, 2", "Discretization/Pad cells": "1, 3, 2",
               "Eigenproblem/Maximum frequency": 40000}
REFERENCE = "cycle,mode,frequency_hz,growth_rate_1_per_s\n0,1,1400.5,-2.25\n0,2,1500,0.5\n"


class Case:
    """Files by name (bytes), the name of the parameter file, further arguments."""

    def __init__(self, name, files, arguments=()):
        self.name, self.files, self.arguments = name, dict(files), list(arguments)
        self.ways = []  # how elements were changed


def with_settings(text, settings):
    """A parameter file with other values: in their line where they are set already, else at the end."""
    lines, missing = text.split("\n"), dict(settings)
    for i, path, _ in st.settings_in(text):
        if path in missing:
            lines[i] = f"{lines[i][:lines[i].index('=') + 1]} {missing.pop(path)}"
    return "\n".join(lines) + "\n" + st.parameter_file(missing)


def renamed(mesh, names):
    """Groups by other names, several of the old ones into one; lengths in mm."""
    for groups in (mesh.volumes, mesh.surfaces):
        for new, olds in names.items():
            if all(old in groups for old in olds):
                groups[new] = [member for old in olds for member in groups.pop(old)]
    mesh.move(lambda x, y, z: (1000 * x, 1000 * y, 1000 * z))
    return mesh


@functools.lru_cache(maxsize=None)
def bases():
    """What there is to mutate; the order is part of what the seed means."""
    result = []
    examples = {path.stem: path.read_text() for path in sorted(st.PROJECT.glob("prm/*.prm"))}
    for name, text in examples.items():
        if name in ("realistic_brake", "vented_disc", "whole_brake"):  # without their meshes
            continue
        settings = dict(SMALL_STRIP if "strip" in text else SMALL)
        if "Cycles" in text:
            settings["Refinement/Cycles"] = 2
        if "Values" in text:
            settings["Sweep/Values"] = "0.2, 0.4"
        if "Second values" in text:
            settings["Sweep/Second values"] = "10, 20"
        if "Samples" in text:
            settings["Sampling/Samples"] = 4
        result.append(Case(name, {f"{name}.prm": with_settings(text, settings).encode()}))
    brake = with_settings(examples["brake"], SMALL)
    ladder = {"Stage": "ladder", "Output/Sensitivities": "true"}
    result.append(Case("ladder", {"ladder.prm": with_settings(brake, ladder).encode()}))
    result.append(Case("reference", {"reference.prm": with_settings(brake, {"Refinement/Reference": "known.csv"}).encode(),
                                     "known.csv": REFERENCE.encode()}))
    for path in sorted(st.PROJECT.glob("prm/theory/*.prm")):
        text = path.read_text()
        names = sorted(set(re.findall(r"prm/theory/\w+\.mtx", text)))
        files = {name: (st.PROJECT / name).read_bytes() for name in names}
        settings = dict(SMALL) if "Rotor cells" in text else {}
        if "Values" in text:
            settings["Sweep/Values"] = "0.1 : 1 : 4"
        files[f"{path.stem}.prm"] = with_settings(text, settings).encode()
        result.append(Case(path.stem, files))

    cells = {"rotor_cells": (2, 8, 1), "pad_cells": (1, 2, 1)}
    scene = {**SMALL, **mesh_files.SCENE, "Output/Fields": "none"}
    for form, write in (("msh2", mesh_files.msh2), ("msh4", mesh_files.msh4), ("inp", mesh_files.inp)):
        file = f"mesh.{'inp' if form == 'inp' else 'msh'}"
        prm = st.parameter_file({**scene, "Mesh/File": file})
        # Twice: meshes have more ways to be wrong than matrices.
        for name in (form, form + "_once_more"):
            result.append(Case(name, {f"{name}.prm": prm.encode(),
                                      file: write(mesh_files.brake(**cells)).encode()}))
    names = {"upper lining": ["upper"], "lower lining": ["lower"], "upper plate": ["upper.plate"],
             "lower plate": ["lower.plate"], "upper face": ["upper.low"], "lower face": ["lower.high"],
             "disc top": ["rotor.high"], "disc bottom": ["rotor.low"], "hub": ["rotor.inner"],
             "upper piston": ["upper.high"], "lower piston": ["lower.low"],
             "upper abutments": ["upper.begin", "upper.end"], "lower abutments": ["lower.begin", "lower.end"]}
    plates = renamed(mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 2), plate_layers=1), names)
    settings = {**SMALL, "Mesh/File": "realistic_brake.msh"}
    result.append(Case("realistic_brake", {
        "realistic_brake.prm": with_settings(examples["realistic_brake"], settings).encode(),
        "realistic_brake.msh": mesh_files.msh4(plates).encode()}))
    # Pads of tetrahedra and wedges on a disc of hexahedra: a deck with parts, and elements of order 2
    shape = {"rotor": 8, "upper": 4, "lower": 6}
    elements = element_files.Elements(mesh_files.brake(**cells), shape.get)
    deck, nodes = element_files.assembly(elements, {"Disc": ["rotor"], "Up": ["upper"], "Low": ["lower"]}, include=True)
    parts = {**scene, "Discretization/Degree": 1, "Mesh/File": "mesh.inp", "Mesh/Rotor": "DISC-1", "Mesh/Pads": "UP-1, LOW-1"}
    result.append(Case("deck", {"deck.prm": st.parameter_file(parts).encode(), "mesh.inp": deck.encode(),
                                "nodes.txt": nodes.encode()}))
    for name, (make, files) in SECOND_ORDER.items():
        result.append(Case(name, files(make())))
    result.append(superelement())
    # Decks whose model --from-deck turns into a parameter file, which then runs
    elements = element_files.Elements(mesh_files.brake(**cells), shape.get)
    deck, nodes = element_files.brake_deck(elements)
    result.append(Case("from_deck", {"brake.inp": (deck + element_files.MODEL).encode(), "nodes.txt": nodes.encode()}))
    return result


def quadratic_brake(place=None):
    """A disc of C3D20R between pads of C3D10 and C3D15."""
    elements = element_files.Elements(mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1)),
                                      {"rotor": 8, "upper": 4, "lower": 6}.get)
    elements.make_quadratic({"rotor": place} if place else None)
    return elements


def second_order_files(elements):
    settings = {**SMALL, **mesh_files.SCENE, "Output/Fields": "none", "Discretization/Degree": 2, "Mesh/Curved bodies": "none",
                "Stage": "friction", "Operation/Angular velocity": 0, "Mesh/File": "mesh.msh"}
    return {"second_order.prm": st.parameter_file(settings).encode(), "mesh.msh": element_files.msh2(elements).encode()}


def deck_files(deck, nodes):
    return {"brake.inp": deck.encode(), "nodes.txt": nodes.encode()}


def quadratic_deck(elements):
    deck, nodes = element_files.brake_deck(elements)
    return deck_files(deck + element_files.MODEL, nodes)


# How elements of second order are made, and the files of what has become of them
SECOND_ORDER = {"second_order": (quadratic_brake, second_order_files),
                "from_deck_quadratic": (lambda: quadratic_brake(element_files.on_circle), quadratic_deck),
                "from_deck_parts": (cae_deck.elements, lambda elements: deck_files(*cae_deck.parts(elements)))}


def superelement():
    """A pad that matrices hold at four nodes of its end, by springs to the ground and one internal coordinate."""
    mesh = mesh_files.brake(rotor_cells=(2, 8, 1), pad_cells=(1, 2, 1), pads=("upper",))
    nodes = sorted({mesh.nodes[node] for face in mesh.surfaces["upper.end"] for node in face})
    size = 3 * len(nodes) + 1

    def matrix(diagonal, coupling):
        entries = [(i, i, diagonal) for i in range(1, size + 1)]
        entries += [(i, j, coupling) for a in range(1, size) for i, j in ((a, size), (size, a))]
        return "\n".join(["%%MatrixMarket matrix coordinate real general", f"{size} {size} {len(entries)}",
                          *(f"{i} {j} {x!r}" for i, j, x in entries), ""])

    table = "\n".join(["node,x_m,y_m,z_m", *(f"{k},{x!r},{y!r},{z!r}" for k, (x, y, z) in enumerate(nodes)), ""])
    settings = {**SMALL, **mesh_files.SCENE, "Output/Fields": "none", "Mesh/File": "mesh.msh", "Mesh/Pads": "upper",
                "Mesh/Contact pairs": "upper.low : rotor.high", "Mesh/Pressure on": "upper.high", "Mesh/Guided": "",
                "Joints/Superelements": "holder : holder : upper.end"}
    files = {"superelement.prm": st.parameter_file(settings), "mesh.msh": mesh_files.msh2(mesh),
             "holder-K.mtx": matrix(1e8, 1e6), "holder-M.mtx": matrix(0.01, 0.001), "holder-D.mtx": matrix(10., 0.1),
             "holder-nodes.csv": table}
    return Case("superelement", {name: text.encode() for name, text in files.items()})


# ---- Mutations of the form

NUMBERS = ["0", "-1", "nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "1e400", "2147483648", "-2147483649",
           "9223372036854775807", "-9223372036854775808", "99999999999999999999", "1.5", "1,5", "0x10", "1e", "--1", "one",
           "1e9", "4294967296", "", "1 2"]
NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")


def lines_of(data):
    return data.split(b"\n")


def some_line(rng, lines):
    return rng.randrange(len(lines))


def delete_line(rng, data):
    lines = lines_of(data)
    del lines[some_line(rng, lines)]
    return b"\n".join(lines)


def duplicate_line(rng, data):
    lines = lines_of(data)
    lines.insert(some_line(rng, lines), lines[some_line(rng, lines)])
    return b"\n".join(lines)


def swap_lines(rng, data):
    lines = lines_of(data)
    i, j = some_line(rng, lines), some_line(rng, lines)
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def change_number(rng, data):
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    # Headers of meshes stand in front of thousands of coordinates.
    at = rng.choice(found[:30] if rng.random() < 0.4 else found)
    return data[:at.start()] + rng.choice(NUMBERS).encode() + data[at.end():]


def change_word(rng, data):
    found = list(re.finditer(rb"[A-Za-z$*]{3,}", data))
    if not found:
        return data
    at = rng.choice(found)
    word = bytearray(at.group())
    way = rng.randrange(4)
    if way == 0:
        word.pop(rng.randrange(len(word)))
    elif way == 1:
        word = bytearray(rng.choice(found).group())
    elif way == 2:
        word = word.swapcase()
    else:
        word = bytearray(b"")
    return data[:at.start()] + bytes(word) + data[at.end():]


def truncate(rng, data):
    return data[:rng.randrange(len(data) + 1)]


def random_bytes(rng, data):
    at = rng.randrange(len(data) + 1)
    noise = bytes(rng.randrange(256) for _ in range(rng.choice([1, 4, 64])))
    return data[:at] + noise + data[at + rng.choice([0, len(noise)]):]


def change_sections(rng, data):
    lines = lines_of(data)
    lines.insert(some_line(rng, lines) + 1, rng.choice([
        b"end", b"subsection Rotor", b"subsection", b"subsection Nothing\nend", b"set", b"set =", b"set = 1", b"end end",
        b"$Nodes", b"$EndNodes", b"$Elements", b"*NODE", b"*ELEMENT", b"*ELSET, ELSET=", b"*", b"$", b"%", b","]))
    return b"\n".join(lines)


def change_encoding(rng, data):
    text = data.decode("latin-1")
    return rng.choice([lambda: text.encode("utf-16"), lambda: b"\xef\xbb\xbf" + data,
                       lambda: data.replace(b"\n", b"\r\n"), lambda: data.replace(b"\n", b"\r"),
                       lambda: data.replace(b"o", "\u00f6".encode("latin-1"), 3),
                       lambda: data.replace(b" ", "\u00a0".encode(), 5), lambda: data.replace(b"e", b"\0", 2)])()


def very_long_line(rng, data):
    lines = lines_of(data)
    i = some_line(rng, lines)
    lines[i] += rng.choice([b"x", b" ", b"1 ", b",", b"(", b"#", b"9", b"1,"]) * 200_000
    return b"\n".join(lines)


def empty_file(rng, data):
    return rng.choice([b"", b"\n", b" ", b"\0"])


FORM = [delete_line, duplicate_line, swap_lines, change_number, change_number, change_number, change_word, truncate,
        random_bytes, change_sections, change_encoding, very_long_line, empty_file]


def mutate_form(rng, case, _keys):
    if rng.random() < 0.12:
        case.arguments += rng.choice([
            ["--set"], ["--set", ""], ["--set", "="], ["--set", "Stage"], ["--set", "Stage=" + "x" * 100_000],
            ["--set", "Rotor/Thickness=\udcff".encode("utf-8", "surrogateescape").decode("latin-1")],
            ["--set", "Rotor//Thickness=1"], ["--set", "/Stage=full"], ["--set", "Rotor/=1"], ["--set", "Stage==full"],
            ["--set", "Pads/Pressure profile=" + "(" * 20_000], ["--set", "Discretization/Rotor cells=1,2"],
            ["--set", "Output/Directory=/proc/none"], ["--set", "Output/Directory=" + "d" * 5000],
            ["--check", "--check"], ["--set", "--set"], ["--help=1"], [""], ["two.prm"]])
        return
    names = sorted(case.files)
    name = rng.choice([rng.choice(names), max(names, key=lambda n: len(case.files[n]))])
    for _ in range(rng.choice([1, 1, 2, 3])):
        case.files[name] = rng.choice(FORM)(rng, case.files[name])
    if case.name.startswith("from_deck"):
        return
    # What is left of a file may be right, with the defaults' large mesh.
    small = SMALL_STRIP if b"strip" in case.files[next(n for n in names if n.endswith(".prm"))] else SMALL
    for path, value in {**small, **({"Discretization/Degree": 2} if case.name == "second_order" else {})}.items():
        case.arguments += ["--set", f"{path}={value}"]


def mutate_interrupted(rng, case, _keys):
    """What an interrupted run has left: states, tables, manifest. Parameters and arguments stay, or nothing would be read."""
    names = sorted(name for name in case.files if name.startswith("output/"))
    states = [name for name in names if name.endswith((".state", ".manifest"))]
    for _ in range(rng.choice([1, 1, 2])):
        name = rng.choice(states if rng.random() < 0.7 else names)
        case.files[name] = rng.choice(FORM)(rng, case.files[name])


# ---- Mutations of the meaning

EXPRESSIONS = ["1/0", "sqrt(x - 1)", "x +", "if(x > 0, 1, -1)", "1e400", "0/0", "(((", "log(-1)", "1e300*1e300", "v", "p",
               "exp(1000*y)", "-1", "0", "1e-300", "0.4*(p/1e6)^(-0.1)", "tan(pi/2)", "rand()", "y^0.5", "x;y", "x,y", "''",
               "1e6*(y > 0)", "abs(x)*1e-6", "v^(-1)"]
WILD = ["0", "-1", "1e-308", "1e308", "1e-12", "1e-6", "1e-3", "0.1", "0.5", "1", "2", "3", "10", "100", "1e3", "1e6", "1e12",
        "1e20", "1e100", "-1e-3", "-20", "0.4999999", "-0.999"]
COUNTS = ["0", "1", "2", "3", "4", "99999", "2147483647"]
FEW, MANY = ["0", "1", "2", "3", "6"], ["20000", "65536", "99999", "100000"]
NAMES = ["", ",", "rotor", "upper", "upper, lower", "upper.low", "rotor.high", "rotor.low : upper.low", "no such thing", "a:b:c",
         "rotor, rotor", "upper.low : rotor.high", "hub", ".", "/", "/dev/null", "mesh.msh", "known.csv"]


def keys_of(program):
    """[(path, pattern, default)] of every parameter."""
    manual = json.loads(subprocess.run([program, "--print-parameters=json"], env=environment(), check=True,
                                       capture_output=True, text=True).stdout)

    def walk(tree, path):
        for name, node in tree.items():
            name = name.replace("_20", " ")
            if "default_value" in node:
                yield "/".join((*path, name)), node["pattern_description"], node["default_value"]
            else:
                yield from walk(node, (*path, name))

    return list(walk(manual, ()))


def change_matrices(rng, case, _keys):
    """Matrices that are well-formed files: singular, without a sign, huge, of another size."""
    names = sorted(name for name in case.files if name.endswith(".mtx"))
    name = rng.choice(names)
    if case.name == "superelement" and rng.random() < 0.7:
        change_entry(rng, case, name)
        return
    n = rng.choice([1, 2, 2, 2, 2, 3, 40])
    entries = [(i, j, rng.choice(["0", "1", "-1", "1e-300", "1e300", "1e20", "1e-20", "2.5", "-3"]))
               for i in range(1, n + 1) for j in range(1, n + 1) if i == j or rng.random() < 0.3]
    lines = ["%%MatrixMarket matrix coordinate real general", f"{n} {n} {len(entries)}", *(f"{i} {j} {x}" for i, j, x in entries)]
    for name in names if n != 2 and rng.random() < 0.5 else [name]:
        case.files[name] = "\n".join([*lines, ""]).encode()


def change_entry(rng, case, name):
    """A large matrix that stays symmetric: another value on its diagonal, or on both sides of it."""
    lines = case.files[name].decode().split("\n")
    i, j, _ = rng.choice(lines[2:-1]).split()
    value = rng.choice(["0", "-1", "1e-300", "1e300", "1e12", "-1e6", "5e7"])
    lines[2:-1] = [f"{a} {b} {value if (a, b) in ((i, j), (j, i)) else x}" for a, b, x in map(str.split, lines[2:-1])]
    case.files[name] = "\n".join(lines).encode()


def value_for(rng, path, pattern, default):
    """A value that the reader of the file often accepts."""
    if path.split("/")[-1] in ("Pressure profile", "Initial gap", "Expression"):
        return rng.choice(EXPRESSIONS)
    if pattern.startswith("[Selection"):
        return rng.choice(pattern[len("[Selection "):].split("]")[0].strip().split("|"))
    if pattern.startswith("[Bool"):
        return rng.choice(["true", "false"])
    if pattern.startswith("[Double"):
        if rng.random() < 0.4:
            return repr(float(default) * 10 ** rng.uniform(-3, 3))
        return rng.choice(WILD)
    if pattern.startswith("[Integer"):
        return rng.choice(COUNTS)
    if path.endswith("cells"):
        # A mesh that can be computed with is small, and what cannot is so large that it must be refused.
        counts = [rng.choice(FEW) for _ in range(3)]
        if rng.random() < 0.4:
            counts = [rng.choice(MANY) if i else "1" for i in range(3)]
        return ", ".join(counts)
    if path.endswith("Origin"):
        return ", ".join(rng.choice(WILD) for _ in range(3))
    if path.endswith("alues"):
        return rng.choice(["0 : 1 : 3", "1, 1", "0", "1e308, -1e308", "-1 : 1 : 3", "0 : 1e300 : 2", "0.1, 0.2, 0.3", "", ":", ",",
                           "0 : 1 : 1e9", "1e-300, 2e-300", "0 : 0 : 5", "nan : 1 : 3"])
    return rng.choice(NAMES)


def change_parameters(rng, case, keys):
    """Values of other keys, in the file or on the command line. Sweeps are changed as a whole."""
    prm = next(name for name in case.files if name.endswith(".prm"))
    scene = "matrices" if b"= matrices" in case.files[prm] else "mesh" if b"= mesh" in case.files[prm] else "brake"
    useful = [key for key in keys if (scene == "matrices" or not key[0].startswith("Matrices/")) and
              (scene != "matrices" or key[0].split("/")[0] in ("Matrices", "Eigenproblem", "Sweep", "Output", "Stage")) and
              (scene == "mesh" or not key[0].startswith("Mesh/")) and
              key[0] not in ("Scene", "Output/Directory", "Output/Animation frames") and
              # Names are mostly refused at once.
              (key[1] != "[Anything]" or "xpression" in key[0] or "Pressure profile" in key[0] or rng.random() < 0.3)]
    settings = {}
    for path, pattern, default in rng.sample(useful, rng.choice([1, 1, 2, 3])):
        settings[path] = value_for(rng, path, pattern, default)
    if rng.random() < 0.15:
        numbers = [path for path, pattern, _ in keys if pattern.startswith(("[Double", "[Integer"))]
        settings["Sweep/Parameter"] = rng.choice([*numbers, "Stage", "Rotor", "Nothing/At all", "Discretization/Rotor cells"])
        settings["Sweep/Values"] = rng.choice(["0.1, 0.2", "0 : 1 : 3", "-1, 1", "1, 2", "1e300, 1e301"])
        settings["Sweep/Critical values"] = rng.choice(["true", "false"])
    if rng.random() < 0.3:
        for path, value in settings.items():
            case.arguments += ["--set", f"{path}={value}"]
    else:
        text = case.files[prm].decode("utf-8", "surrogateescape")
        case.files[prm] = with_settings(text, settings).encode("utf-8", "surrogateescape")


def change_mesh(rng, case, _keys):
    """The mesh itself, before it is written; the parameter file stays."""
    mesh = mesh_files.brake(rotor_cells=rng.choice([(2, 8, 1), (1, 3, 1), (2, 6, 2)]), pad_cells=(1, 2, 1))
    ways = [move_node, move_node, merge_nodes, merge_nodes, drop_cell, drop_cell, invert_cell, repeat_node_in_cell, double_cell,
            drop_group, empty_group, mix_groups, swap_faces, stretch, stretch, shift_body, loose_nodes, foreign_faces]
    for _ in range(rng.choice([1, 1, 2])):
        rng.choice(ways)(rng, mesh)
    write, file = rng.choice([(mesh_files.msh2, "mesh.msh"), (mesh_files.msh4, "mesh.msh"), (mesh_files.inp, "mesh.inp")])
    scene = {**SMALL, **mesh_files.SCENE, "Mesh/File": file, "Output/Fields": "none"}
    if rng.random() < 0.3:
        scene["Mesh/Curved bodies"] = rng.choice(["none", "rotor"])
    if rng.random() < 0.3:
        scene["Stage"] = rng.choice(["elastic", "friction"])
        scene["Operation/Angular velocity"] = rng.choice([0, 20])
    if rng.random() < 0.2:
        scene["Contact/Steady pressure"] = "uniform"
    if rng.random() < 0.2:
        scene["Mesh/Scale"] = rng.choice(["1e-3", "1e3", "1e-300", "1e300"])
    prm = f"{case.name}.prm"
    case.files = {prm: st.parameter_file(scene).encode(), file: write(mesh).encode()}


def some_cell(rng, mesh):
    return rng.randrange(len(mesh.cells))


def move_node(rng, mesh):
    i = rng.randrange(len(mesh.nodes))
    size = rng.choice([1e-9, 1e-5, 1e-3, 1e-2, 1, 1e200, 1e308])
    mesh.nodes[i] = tuple(x + size * rng.uniform(-1, 1) for x in mesh.nodes[i])


def merge_nodes(rng, mesh):
    """One node in the place of another: the cells collapse, or bodies are glued together."""
    a, b = rng.randrange(len(mesh.nodes)), rng.randrange(len(mesh.nodes))
    if rng.random() < 0.5:
        mesh.nodes[a] = mesh.nodes[b]
    else:
        mesh.cells = [[b if node == a else node for node in cell] for cell in mesh.cells]
        for name, faces in mesh.surfaces.items():
            mesh.surfaces[name] = [[b if node == a else node for node in face] for face in faces]


def drop_cell(rng, mesh):
    gone = some_cell(rng, mesh)
    for cells in mesh.volumes.values():
        if gone in cells:
            cells.remove(gone)
    if rng.random() < 0.5:  # of the mesh too, not only of its group
        mesh.cells.pop(gone)
        mesh.volumes = {name: [c - (c > gone) for c in cells] for name, cells in mesh.volumes.items()}


def invert_cell(rng, mesh):
    cell = mesh.cells[some_cell(rng, mesh)]
    way = rng.randrange(3)
    if way == 0:
        cell[:] = cell[4:] + cell[:4]
    elif way == 1:
        i, j = rng.sample(range(8), 2)
        cell[i], cell[j] = cell[j], cell[i]
    else:
        rng.shuffle(cell)


def repeat_node_in_cell(rng, mesh):
    cell = mesh.cells[some_cell(rng, mesh)]
    cell[rng.randrange(8)] = cell[rng.randrange(8)]


def double_cell(rng, mesh):
    i = some_cell(rng, mesh)
    mesh.cells.append(list(mesh.cells[i]))
    rng.choice(list(mesh.volumes.values())).append(len(mesh.cells) - 1)


def drop_group(rng, mesh):
    groups = rng.choice([mesh.volumes, mesh.surfaces])
    if groups:
        groups.pop(rng.choice(sorted(groups)))


def empty_group(rng, mesh):
    groups = rng.choice([mesh.volumes, mesh.surfaces])
    if groups:
        groups[rng.choice(sorted(groups))] = []


def mix_groups(rng, mesh):
    groups = rng.choice([mesh.volumes, mesh.surfaces])
    if len(groups) > 1:
        a, b = rng.sample(sorted(groups), 2)
        if rng.random() < 0.5:
            groups[a], groups[b] = groups[b], groups[a]
        else:
            groups[a] = groups[a] + groups[b][:3]


def swap_faces(rng, mesh):
    """A face that is no cell's, or inside of a body."""
    faces = mesh.surfaces[rng.choice(sorted(mesh.surfaces))]
    if faces:
        cell = mesh.cells[some_cell(rng, mesh)]
        faces[rng.randrange(len(faces))] = rng.choice([[cell[v] for v in rng.choice(mesh_files.FACES)], rng.sample(cell, 4)])


def stretch(rng, mesh):
    factors = [rng.choice([1, 1, -1, 0, 1e-3, 1e3, 1e-12, 1e100, 1e-160, 2]) for _ in range(3)]
    mesh.move(lambda *x: tuple(f * y for f, y in zip(factors, x)))


def shift_body(rng, mesh):
    """A pad is pushed away, or into the rotor, or turned away from it."""
    cells = mesh.volumes.get(rng.choice(["upper", "lower", "rotor"]), [])
    nodes = {node for c in cells for node in mesh.cells[c]}
    by = [rng.choice([0, 0, 1e-7, 1e-3, -1e-3, 0.05]) for _ in range(3)]
    mesh.nodes = [tuple(x + d for x, d in zip(node, by)) if i in nodes else node for i, node in enumerate(mesh.nodes)]


def loose_nodes(rng, mesh):
    mesh.nodes += [(rng.uniform(-1, 1) * rng.choice([1, 1e300]), 0, 0) for _ in range(3)]


def foreign_faces(rng, mesh):
    mesh.surfaces["rotor.high"] = mesh.surfaces.get("rotor.high", []) + mesh.surfaces.get("upper.low", [])[:1]


def change_deck(rng, case, _keys):
    """A keyword of the deck: its parameters, its data, its place."""
    lines = case.files["brake.inp"].decode().split("\n")
    keywords = [i for i, line in enumerate(lines) if line.startswith("*") and not line.startswith("**")]
    for _ in range(rng.choice([1, 1, 2, 3])):
        at = rng.choice(keywords[len(keywords) // 2:] if rng.random() < 0.7 else keywords)
        end = next((i for i in range(at + 1, len(lines)) if lines[i].startswith("*")), len(lines))
        way = rng.randrange(6)
        if way == 0:  # gone
            lines[at:end] = [""] * (end - at)
        elif way == 1:  # twice
            lines[at] = "\n".join([*lines[at:end], lines[at]])
        elif way == 2:  # elsewhere
            block, lines[at:end] = lines[at:end], [""] * (end - at)
            lines[rng.choice(keywords)] += "\n" + "\n".join(block)
        elif way == 3:  # without its data
            lines[at + 1:end] = [""] * (end - at - 1)
        elif way == 4:  # another parameter
            words = lines[at].split(",")
            words[rng.randrange(len(words))] = rng.choice(["", " elset=none", " type=C3D8", " GENERATE", " name=x", " input=brake.inp"])
            lines[at] = ",".join(words)
        else:  # another number
            i = rng.randrange(at, end)
            lines[i] = change_number(rng, lines[i].encode()).decode()
    case.files["brake.inp"] = "\n".join(lines).encode()


def some_element(rng, elements):
    return rng.randrange(len(elements.elements))


def n_corners(element):
    return element_files.N_CORNERS[len(element)]


def move_middle(rng, elements):
    """A middle node beside its edge: by rounding, within what elements bear, and so far that they fold."""
    element = elements.elements[some_element(rng, elements)]
    i, size = rng.choice(element[n_corners(element):] or element), rng.choice([1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1e200])
    elements.nodes[i] = tuple(x + size * rng.uniform(-1, 1) for x in elements.nodes[i])


def move_corner(rng, elements):
    element = elements.elements[some_element(rng, elements)]
    i, size = element[rng.randrange(n_corners(element))], rng.choice([1e-12, 1e-6, 1e-4, 1e-3, 1e-2, 1])
    elements.nodes[i] = tuple(x + size * rng.uniform(-1, 1) for x in elements.nodes[i])


def quarter_point(rng, elements):
    """Middle nodes at a quarter of their edges, as elements at the tips of cracks have them."""
    element = elements.elements[some_element(rng, elements)]
    for k, (a, b) in enumerate(element_files.EDGES[n_corners(element)]):
        if len(element) > n_corners(element) and rng.random() < 0.5:
            weight = rng.choice([0.25, 0.4, 0.49, 0, 1])
            elements.nodes[element[n_corners(element) + k]] = tuple(
                (1 - weight) * x + weight * y for x, y in zip(elements.nodes[element[a]], elements.nodes[element[b]]))


def swap_in_element(rng, elements):
    e = some_element(rng, elements)
    nodes = list(elements.elements[e])
    i, j = rng.sample(range(len(nodes)), 2)
    nodes[i], nodes[j] = nodes[j], nodes[i]
    elements.elements[e] = tuple(nodes)


def other_order(rng, elements):
    """Middle nodes in another program's order, in one element or in all."""
    shift = rng.choice([1, 2, -1])
    all_of_them = range(len(elements.elements))
    for e in all_of_them if rng.random() < 0.5 else [some_element(rng, elements)]:
        element = elements.elements[e]
        corners, middles = element[:n_corners(element)], element[n_corners(element):]
        elements.elements[e] = corners + middles[shift:] + middles[:shift]


def own_middle(rng, elements):
    """A middle node that an element does not share with its neighbours, where theirs is or beside it."""
    e = some_element(rng, elements)
    nodes = list(elements.elements[e])
    k, by = rng.randrange(len(nodes)), rng.choice([0, 1e-9, 1e-4])
    elements.nodes.append(tuple(x + by for x in elements.nodes[nodes[k]]))
    nodes[k] = len(elements.nodes) - 1
    elements.elements[e] = tuple(nodes)


def repeat_in_element(rng, elements):
    e = some_element(rng, elements)
    nodes = list(elements.elements[e])
    nodes[rng.randrange(len(nodes))] = nodes[rng.randrange(len(nodes))]
    elements.elements[e] = tuple(nodes)


def lose_middles(rng, elements):
    """Elements of the first order beside those of the second, whose middle nodes are left alone."""
    for e in rng.choice([range(len(elements.elements)), [some_element(rng, elements)]]):
        elements.elements[e] = elements.elements[e][:n_corners(elements.elements[e])]


def lose_element(rng, elements):
    e = some_element(rng, elements)
    for groups, member in ((elements.volumes, lambda x: x), (elements.surfaces, lambda x: x[0])):
        for name, group in groups.items():
            groups[name] = [x for x in group if member(x) != e]


def double_element(rng, elements):
    e = some_element(rng, elements)
    elements.elements.append(elements.elements[e])
    next(group for group in elements.volumes.values() if e in group).append(len(elements.elements) - 1)


def strange_faces(rng, elements):
    """A face of another element in a surface, or of none."""
    faces = elements.surfaces[rng.choice(sorted(elements.surfaces))]
    body = next(group for group in elements.volumes.values() if faces and faces[0][0] in group) if faces else []
    if body:
        faces[rng.randrange(len(faces))] = (rng.choice(body), rng.randrange(4))


def stretch_elements(rng, elements):
    factors = [rng.choice([1, 1, -1, 0, 1e-3, 0.5, 2]) for _ in range(3)]
    elements.nodes = [tuple(f * x for f, x in zip(factors, node)) for node in elements.nodes]


def change_elements(rng, case, _keys):
    """Elements of second order, before their deck is written; sometimes it then names them by another kind."""
    make, files = SECOND_ORDER[case.name]
    elements = make()
    ways = [move_middle, move_middle, move_middle, move_corner, quarter_point, swap_in_element, swap_in_element, other_order,
            own_middle, repeat_in_element, lose_middles, lose_element, double_element, strange_faces, stretch_elements]
    chosen = [rng.choice(ways) for _ in range(rng.choice([1, 1, 2]))]
    for way in chosen:
        way(rng, elements)
    case.ways = [way.__name__ for way in chosen]
    case.files = files(elements)
    if rng.random() < 0.15 and "brake.inp" in case.files:
        kind = rng.choice([b"C3D10M", b"C3D10H", b"C3D10MH", b"C3D4", b"C3D20", b"C3D8", b"C3D15", b"C3D10E", b"STRI65", b"DC3D10", b"c3d10"])
        case.files["brake.inp"] = case.files["brake.inp"].replace(b"C3D10", kind, rng.choice([1, -1]))


def mutate_meaning(rng, case, keys):
    if case.name in SECOND_ORDER and rng.random() < 0.7:
        change_elements(rng, case, keys)
    elif case.name.startswith("from_deck"):
        change_deck(rng, case, keys)
    elif any(name.endswith((".msh", ".inp")) for name in case.files) and \
            case.name not in ("realistic_brake", "deck", "second_order", "superelement") and rng.random() < 0.75:
        change_mesh(rng, case, keys)
    elif any(name.endswith(".mtx") for name in case.files) and rng.random() < 0.5:
        change_matrices(rng, case, keys)
    else:
        change_parameters(rng, case, keys)


# ---- Running

def environment():
    leaks = st.PROJECT / "tests/fuzz/asan_suppressions.txt"
    return {**st.ENVIRONMENT,
            # Whole stacks: a leak is a library's own or ours by what stands below the library.
            "ASAN_OPTIONS": "exitcode=99:detect_leaks=1:fast_unwind_on_malloc=0:max_allocation_size_mb=3000",
            "LSAN_OPTIONS": f"suppressions={leaks}:print_suppressions=0:exitcode=99",
            "UBSAN_OPTIONS": "print_stacktrace=1",
            # What killed runs leave in shared memory would stay.
            "OMPI_MCA_btl": "self"}


class Result:
    def __init__(self, number, case, directory, command):
        self.number, self.case, self.directory, self.command = number, case, directory, command
        self.category, self.detail, self.seconds, self.memory = "", "", 0, 0
        self.compared = False  # with another way


def make_case(number, seed, keys, interrupted, names):
    """The case of a number: what it starts from goes round, how it is changed is random. Every tenth resumes, unless
    the names of those that are wanted are given."""
    rng = random.Random(f"{seed}-{number}")
    if number % 10 == 8 and not names:
        base = interrupted[number // 10 % len(interrupted)]
        case = Case(base.name, base.files)
        mutate_interrupted(rng, case, keys)
        return case
    all_bases = [base for base in bases() if not names or base.name in names]
    base = all_bases[(number // 2 * 7 + number % 2 * 3 + seed) % len(all_bases)]
    case = Case(base.name, base.files, base.arguments)
    (mutate_meaning if number % 2 else mutate_form)(rng, case, keys)
    return case


def interrupted_runs(program):
    """A sweep and a map of a small brake that were killed, with what they left."""
    settings = {**SMALL, "Output/Fields": "none", "Sweep/Parameter": "Contact/Friction/Coefficient",
                "Sweep/Values": "0 : 0.5 : 40"}
    of_a_map = {**settings, "Sweep/Values": "0 : 0.5 : 6", "Sweep/Second parameter": "Operation/Angular velocity",
                "Sweep/Second values": "1 : 30 : 6"}
    of_meshes = {**SMALL, "Output/Fields": "none", "Refinement/Strategy": "uniform",
                 "Refinement/Cycles": 3, "Refinement/Maximum unknowns": 20000}
    cases = []
    for name, values in (("sweep", settings), ("map", of_a_map), ("refinement", of_meshes)):
        with tempfile.TemporaryDirectory(prefix="squeal-fuzz-") as scratch:
            file = pathlib.Path(scratch) / f"{name}.prm"
            file.write_text(st.parameter_file(values))
            process = subprocess.Popen([program, file.name], cwd=scratch, env=environment(), stdin=subprocess.DEVNULL,
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            while process.poll() is None and not list(file.parent.glob("output/*/*.state")):
                time.sleep(0.005)
            process.kill()
            process.wait()
            if not list(file.parent.glob("output/*/*.state")):
                sys.exit(f"The {name} ended before it could be killed.")
            cases.append(Case(f"interrupted {name}", {str(path.relative_to(scratch)): path.read_bytes()
                                                      for path in sorted(file.parent.rglob("*"))
                                                      if path.is_file() and path.name != "run.lock"}))
    return cases


def usage(pid):
    """Resident bytes and processor seconds of a process."""
    try:
        memory = int(pathlib.Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        times = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
        return memory, sum(map(int, times)) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError):
        return 0, 0


def readable(message):
    """What is wrong with a message for users; empty: nothing."""
    if message.count("squeal: ") != 1:
        return f"{message.count('squeal: ')} messages instead of one"
    text = message.split("squeal: ", 1)[1].strip()
    if len(text) < 20 or " " not in text:
        return "the message is too short"
    if len(text) > 4000:
        return f"the message has {len(text)} characters"
    for word in ("deal.II", "An error occurred", "exception", "PETSC ERROR", "std::", "basic_string", "bad_alloc", "stoi", "boost"):
        if word in text:
            return f"the message talks of '{word}', which tells a user nothing"
    if any(ord(c) < 32 and c not in "\n\t\r" for c in text):
        return "the message has control characters"
    return ""


def not_finite(directory):
    """The first number in a table that is not finite."""
    for path in sorted(directory.glob("output/**/*.csv")):
        with open(path, newline="", errors="replace") as file:
            for line, row in enumerate(csv.reader(file), start=1):
                for field in row:
                    if field.strip().lower().lstrip("+-") in ("nan", "inf", "infinity"):
                        return f"{path.name}, line {line}: {field}"
    return ""


def judge(status, out, err, directory):
    """Category and detail of a run that ended by itself."""
    report = re.search(r"(ERROR: (?:Address|Leak)Sanitizer.*|.*runtime error:.*)", err)
    if report or status == 99:
        frames = re.findall(r"#\d+ 0x[0-9a-f]+ in (.*)", err)
        own = next((frame for frame in frames if "squeal" in frame), "")
        return "sanitizer", (report.group(1) if report else "") + (f"\n      in {own[:200]}" if own else "")
    if status < 0 or status >= 128:
        return "crash", signal.Signals(-status).name if status < 0 else f"status {status}"
    if status == 0:
        bad = not_finite(directory)
        return ("not finite", bad) if bad else ("ran", "")
    if status in (2, 3):
        bad = readable(err)
        return ("bad message", f"exit {status}: {bad}") if bad else (f"exit {status}", "")
    return "exit 1", f"exit {status}"


def write_case(case, directory, commands):
    """Files and command.sh, which repeats the commands."""
    shutil.rmtree(directory, ignore_errors=True)
    for name, data in case.files.items():
        path = directory / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    (directory / "command.sh").write_text("\n".join(
        [f"export {name}={shlex.quote(value)}" for name, value in environment().items()
         if name not in os.environ or os.environ[name] != value] +
        [f"cd {shlex.quote(str(directory))}", " && ".join(" ".join(map(shlex.quote, command)) for command in commands), ""]),
        errors="surrogateescape")


def run_new(number, options, top):
    """A new model: the first run as any other; if it ends well, those beside it, and the comparison."""
    model = compared.draw(random.Random(f"new-{options.seed}-{number}"), number)
    directory = top / f"case-{number:03}"
    commands = [[str(options.program), *arguments] for arguments in (model.first, *model.others)]
    write_case(model, directory, commands)
    result = Result(number, model, directory, commands[0])
    start, said, ended = time.monotonic(), [], {}
    for k, command in enumerate(commands):
        status = supervise(command, directory, result, options)
        out, err = ((directory / name).read_text(errors="replace") for name in ("stdout", "stderr"))
        said.append(err.strip() or out.strip()[-600:])
        if result.category:
            result.detail = f"run {k + 1}, after {time.monotonic() - start:.0f} s, {result.memory / 2**20:.0f} MiB"
        else:
            result.category, result.detail = judge(status, out, err, directory)
        if result.category != "ran" and result.category in ALLOWED and k > 0 and model.of_a_study:
            ended[k - 1], result.category = result.category, "ran"
        elif result.category != "ran":
            if k > 0 and result.category in ALLOWED:  # nothing to compare with
                result.category, result.detail = "ran", f"not compared: run {k + 1} ended with {result.category}"
            break
        if k + 1 < len(commands):
            result.category = ""
    else:
        try:
            result.detail = model.compare(directory, ended) if model.of_a_study else model.compare(directory)
        except (OSError, KeyError, TypeError, ValueError) as error:
            result.detail = f"tables cannot be compared: {error!r}"
        result.compared = len(ended) < max(1, len(model.others))
        if result.detail:
            result.category = "wrong"
    result.seconds, result.message = time.monotonic() - start, said[-1]
    return result


def run_case(number, options, keys, top, interrupted):
    if options.new:
        return run_new(number, options, top)
    case = make_case(number, options.seed, keys, interrupted, options.of)
    directory = top / f"case-{number:03}"
    program = str(options.program)
    if case.name.startswith("from_deck"):
        # Elements keep their own polynomials of degree 2.
        settings = {**SMALL, "Discretization/Degree": 2, "Output/Fields": "none"} if case.name in SECOND_ORDER else SMALL
        small = [word for path, value in settings.items() for word in ("--set", f"{path}={value}")]
        commands = [[program, "--from-deck", "brake.inp", *case.arguments], [program, "brake.prm", *small]]
    else:
        prm = next(name for name in sorted(case.files) if name.endswith(".prm") and not name.startswith("output/"))
        commands = [[program, prm, *case.arguments]]
    write_case(case, directory, commands)
    result = Result(number, case, directory, commands[0])
    start = time.monotonic()
    for command in commands:
        status = supervise(command, directory, result, options)
        if status != 0:
            break
    result.seconds = time.monotonic() - start
    out, err = ((directory / name).read_text(errors="replace") for name in ("stdout", "stderr"))
    if result.category:
        result.detail = f"after {result.seconds:.0f} s, {result.memory / 2**20:.0f} MiB"
    else:
        result.category, result.detail = judge(status, out, err, directory)
    result.message = err.strip() or out.strip()[-600:]
    return result


def supervise(command, directory, result, options):
    """The status of a command that ends by itself; else it is killed, and the result's category says why."""
    encoded = [os.fsencode(argument.replace("\0", "")) for argument in command]
    start = time.monotonic()
    with open(directory / "stdout", "wb") as out, open(directory / "stderr", "wb") as err:
        process = subprocess.Popen(encoded, cwd=directory, env=environment(), stdin=subprocess.DEVNULL, stdout=out, stderr=err)
        while process.poll() is None:
            memory, processor_seconds = usage(process.pid)
            result.memory = max(result.memory, memory)
            # Processor seconds, so that a busy machine makes no hangs; who waits for ever uses none.
            if processor_seconds > options.timeout or time.monotonic() - start > 10 * options.timeout:
                result.category = "hang"
            elif result.memory > LARGEST_MEMORY:
                result.category = "too large"
            if result.category:
                process.kill()
                process.wait()
                break
            time.sleep(0.05)
    return process.returncode


def shortened(text, n_lines, n_characters=240):
    lines = [line for line in text.splitlines() if line.strip()]
    return "\n".join("      " + (line[:n_characters] + " ..." if len(line) > n_characters else line) for line in lines[:n_lines])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", type=pathlib.Path, default=st.PROJECT / "build/asan/squeal")
    parser.add_argument("--number", type=int, default=200, help="number of cases")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", type=pathlib.Path, help="directory in which the cases stay")
    parser.add_argument("--case", type=int, action="append", help="only this case; may be given several times")
    parser.add_argument("--of", nargs="+", metavar="NAME", help="only cases that start from these, and none that was interrupted")
    parser.add_argument("--new", action="store_true", help="new models, whose results are compared")
    parser.add_argument("--timeout", type=float, default=90,
                        help="processor seconds for a case; longer is a hang (or ten times as long by the clock)")
    parser.add_argument("--verbose", action="store_true", help="print the message of every case")
    options = parser.parse_args()
    options.program = options.program.resolve()
    if not options.program.exists():
        sys.exit(f"{options.program} does not exist; build it with scripts/build.sh asan squeal")
    top = options.keep.resolve() if options.keep else pathlib.Path(tempfile.mkdtemp(prefix="squeal-fuzz-"))
    top.mkdir(parents=True, exist_ok=True)
    keys = keys_of(options.program)
    interrupted = [] if options.of or options.new else interrupted_runs(options.program)
    numbers = options.case if options.case is not None else range(options.number)
    start = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        results = []
        for result in pool.map(lambda number: run_case(number, options, keys, top, interrupted), numbers):
            results.append(result)
            if options.verbose:
                print(f"{result.number:4} {result.case.name:24} {result.category:12} {result.seconds:6.1f} s "
                      f"{result.memory / 2**20:6.0f} MiB  {' '.join(result.case.ways)} {result.detail}", flush=True)
                if result.category not in ("ran", "wrong"):
                    print(shortened(result.message, 3), flush=True)
    counts = collections.Counter(result.category for result in results)
    print(f"\n{len(results)} cases, seed {options.seed}, {time.monotonic() - start:.0f} s, {options.program}")
    for category in CATEGORIES:
        mark = "" if category in ALLOWED or not counts[category] else "   not allowed"
        print(f"  {category:12} {counts[category]:5}{mark}")
    if options.new:
        print(f"  compared with another way: {sum(result.compared for result in results)}")
        for kind in sorted({result.case.name for result in results}):
            own = [result for result in results if result.case.name == kind]
            print(f"    {kind:20} {sum(result.compared for result in own):4} of {len(own)}")
    bad = [result for result in results if result.category not in ALLOWED]
    for result in bad:
        print(f"\ncase {result.number} ({result.case.name}): {result.category}: {result.detail}")
        print(f"    python3 tests/fuzz/fuzz.py --program {options.program} --seed {options.seed} --case {result.number} --keep DIR" +
              (" --new" if options.new else ""))
        print(shortened(result.message, 6))
    if options.keep:
        print(f"\nEach case is in {top}, to be repeated with  bash {top}/case-NNN/command.sh")
    else:
        shutil.rmtree(top, ignore_errors=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
