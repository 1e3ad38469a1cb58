#!/usr/bin/env python3
"""One page about a run of squeal that needs nothing but a browser: report.html in its output directory.

    scripts/report.py OUTPUT_DIR [--output FILE.html] [--modes N]

What was found in one sentence, what was computed, verdicts with error bars, why modes grow, what would help, the
eigenvalues in the complex plane, sweeps, stability maps, convergence, contact in the steady state, pictures of modes that
grow or may grow (at most N, default 3), parameters and log. Reads the tables of the run, finished or not; pictures are
inside of the page.

Pictures need matplotlib, those of modes ParaView (scripts/install-dependencies.sh --pictures). A Python that has matplotlib
is looked for. What is missing is named at the end of the page; without these tools also on the screen. Exit status 1: a
picture that was possible could not be made.
"""

import argparse
import base64
import csv
import html
import io
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from plotting import MARK, axis_of, draw_with_matplotlib, open_text, refuse_foreign, rounded, write_output
from plot import FREQUENCY, FREQUENCY_ERROR, GROWTH, GROWTH_ERROR, STYLES, UNSTABLE, read_parameters

# What a probability is uncertain by
PROBABILITY_BARS = (("sampling_error", "number of samples"), ("reduction_error", "solver"), ("mesh_error", "mesh"))
SCRIPTS = Path(__file__).resolve().parent
# Of Okabe and Ito, told apart with any colour vision
RESPONSE_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000")
RENDERING_SECONDS = 300
# -noreset: without it the display is gone for a moment when ParaView has tried it, and under load ParaView meets that moment.
PARAVIEW = ("xvfb-run", "-a", "-s", "-screen 0 1280x1024x24 -noreset", "pvbatch")

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1b1b; margin: 0 auto; padding: 1rem; max-width: 70rem; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: .5rem 0; }
h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccc; }
.summary { font-size: 1.1rem; padding: .75rem 1rem; border-left: .4rem solid #0072B2; background: #f3f7fa; }
.summary.unstable { border-color: #D55E00; background: #fdf3ec; }
.summary.undecided { border-color: #E69F00; background: #fdf8ec; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1rem; margin: .5rem 0; }
dt { color: #555; }
dd { margin: 0; overflow-wrap: anywhere; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .15rem .7rem; white-space: nowrap; }
th { border-bottom: 2px solid #888; font-weight: 600; }
tr:nth-child(even) td { background: #f6f6f6; }
tr.unstable td { background: #fbe3d5; font-weight: 600; }
tr.undecided td { background: #fbf0d0; }
.text { text-align: left; }
img { max-width: 100%; height: auto; }
figure { margin: 1rem 0; }
figcaption, .note { color: #555; font-size: .9rem; }
pre { overflow-x: auto; background: #f6f6f6; padding: .75rem; font-size: .8rem; }
@media (max-width: 40rem) { th, td { padding: .15rem .4rem; } body { font-size: 15px; } }
@media print { details > pre { white-space: pre-wrap; } }
"""


HEAD, VIEWPORT = '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">', "width=device-width, initial-scale=1"
# Pages of earlier versions had no mark.
OF_EARLIER_VERSIONS = f'{HEAD}<meta name="viewport" content="{VIEWPORT}"><title>squeal: '.encode()


def fail(message):
    sys.exit("report.py: " + message)


# Of these columns numbers are taken.
NUMBERS = {"cycle", "mode", "parameter", "value", "contact_area_m2", "max_pressure_pa", "dofs", "processor_seconds", GROWTH,
           FREQUENCY}
# In these tables the parameter is a name, or a field may be empty: that of all branches has no frequency, a sample may have
# no mode.
NAMED = {"critical.csv": {"parameter"}, "sensitivities.csv": {"parameter"}, "indices.csv": {"parameter"},
         "probability.csv": {FREQUENCY}, "samples.csv": {FREQUENCY, GROWTH}}


def is_whole(row, named=frozenset()):
    """Whether a line has a field for each column, and numbers where there must be some."""
    if None in row or None in row.values():
        return False
    try:
        return all(math.isfinite(float(row[name])) for name in (NUMBERS - named) & row.keys())
    except ValueError:
        return False


def read_table(directory, name, damaged=None):
    """The whole lines of a table as dictionaries; none if there is no such file. A line that somebody or a full disk cut is
    left out; @p damaged, a list, gets a sentence about it."""
    try:
        with open_text(directory / name) as file:
            rows = list(csv.DictReader(line.replace("\0", "\N{REPLACEMENT CHARACTER}") for line in file))
    except OSError:
        return []
    except csv.Error as error:
        rows = []
        if damaged is not None:
            damaged.append(f"{name}: {error}")
    whole = [row for row in rows if is_whole(row, NAMED.get(name, frozenset()))]
    if damaged is not None and len(whole) < len(rows):
        damaged.append(f"{name}: {len(rows) - len(whole)} of {len(rows)} lines are incomplete")
    return whole


def number(text, digits=5):
    """A field of a table for people; an empty one is unknown."""
    try:
        value = float(text)
    except (TypeError, ValueError):
        return "\N{EN DASH}" if not text else str(text)
    return f"{value:.{digits}g}".replace("-", "\N{MINUS SIGN}") if math.isfinite(value) else str(text)


def fixed(text, decimals, digits=None):
    """With so many decimals; what would lose all of its digits has so many digits, if they are given."""
    try:
        value = float(text)
        if digits and 0 < abs(value) < 10 ** -decimals:
            return number(text, digits)
        return f"{value:.{decimals}f}".replace("-", "\N{MINUS SIGN}")
    except (TypeError, ValueError):
        return "\N{EN DASH}"


def with_bar(row, value, error, decimals):
    if row.get(error):
        return " \N{PLUS-MINUS SIGN} ".join(rounded(float(row[value]), float(row[error])))
    return fixed(row[value], decimals, digits=3 if row["verdict"] in UNSTABLE else None)


def shape_of(row):
    """What a mode looks like: bending or in-plane, the disc's nodal diameters and circles."""
    if not row.get("shape"):
        return "\N{EN DASH}"
    return f"{row['shape'].replace('_', '-')} {row['nodal_diameters']}, {row['nodal_circles']}"


def critical_value(row):
    """A critical value with what the mesh may have done to it, if that is known."""
    return (with_bar(row, "value", "mesh_error", 5) if row.get("mesh_error") else number(row["value"]))


def table(header, rows, classes=()):
    """Cells are texts; a header that ends with '<' is of a column of words."""
    kinds = [' class="text"' if name.endswith("<") else "" for name in header]
    lines = ['<div class="wide"><table><tr>',
             *(f"<th{kind}>{html.escape(name.rstrip('<'))}</th>" for name, kind in zip(header, kinds)), "</tr>"]
    for i, row in enumerate(rows):
        mark = f' class="{classes[i]}"' if i < len(classes) and classes[i] else ""
        lines.append(f"<tr{mark}>" + "".join(f"<td{kind}>{html.escape(cell)}</td>" for cell, kind in zip(row, kinds)) +
                     "</tr>")
    return "".join(lines) + "</table></div>"


class Report:
    def __init__(self, directory, most_modes):
        self.directory, self.most_modes = directory, most_modes
        # Pictures that tools or tables do not allow, and those whose making failed
        self.body, self.missing, self.failed = [], [], []
        self.parameters = read_parameters(str(directory))
        modes = [row for row in self.rows("modes.csv") if "cycle" in row]
        self.cycle = max((int(float(row["cycle"])) for row in modes), default=0)
        self.modes = [row for row in modes if int(float(row["cycle"])) == self.cycle]
        self.cycles = self.rows("cycles.csv")
        self.sweep, self.map = self.rows("sweep.csv"), self.rows("map.csv")
        self.samples, self.probabilities = self.rows("samples.csv"), self.rows("probability.csv")

    def rows(self, name):
        return read_table(self.directory, name, self.missing)

    # Pieces of the page.

    def section(self, title):
        self.body.append(f"<h2>{html.escape(title)}</h2>")

    def note(self, text):
        self.body.append(f'<p class="note">{html.escape(text)}</p>')

    def picture(self, data, caption, kind="png"):
        encoded = base64.b64encode(data).decode()
        self.body.append(f'<figure><img alt="{html.escape(caption)}" src="data:image/{kind};base64,{encoded}">'
                         f"<figcaption>{html.escape(caption)}</figcaption></figure>")

    def drawn_by(self, caption, script, *arguments, launcher=(sys.executable,), kind="png", option="--output",
                 subject=None):
        """The picture that another script makes of the run, or of another subject."""
        with tempfile.TemporaryDirectory() as scratch:
            output = os.path.join(scratch, "picture." + kind)
            command = [*launcher, str(SCRIPTS / script), str(subject or self.directory), *arguments, option, output]
            try:
                # xvfb-run -a takes a display that another may take at the same moment: a second try finds a free one.
                for _ in range(2 if "xvfb-run" in launcher else 1):
                    done = subprocess.run(command, capture_output=True, text=True, timeout=RENDERING_SECONDS, check=False)
                    if os.path.exists(output):
                        break
                self.picture(Path(output).read_bytes(), caption, kind)
            except subprocess.TimeoutExpired:
                self.failed.append(f"{caption}: {script} took more than {RENDERING_SECONDS} s")
            except OSError:
                words = (done.stderr.strip() or done.stdout.strip() or "no picture").splitlines()[-1]
                # 2: the script names what its input lacks.
                (self.missing if done.returncode == 2 else self.failed).append(f"{caption}: {words}")

    def figure(self, caption, draw):
        """A picture drawn here: draw(pyplot) gives a figure."""
        try:
            import matplotlib
            matplotlib.use("Agg")
            from matplotlib import pyplot
        except ImportError as error:
            self.missing.append(f"{caption}: matplotlib cannot be loaded ({error})")
            return
        data = io.BytesIO()
        draw(pyplot).savefig(data, dpi=110, format="png")
        pyplot.close("all")
        self.picture(data.getvalue(), caption)

    # What was found.

    @staticmethod
    def of_modes(rows, most):
        """The modes of the largest growth rates, at most so many, in words."""
        rows = sorted(rows, key=lambda row: -float(row[GROWTH]))
        words = [f"mode {row['mode']} at {with_bar(row, FREQUENCY, FREQUENCY_ERROR, 1)} Hz with "
                 f"{with_bar(row, GROWTH, GROWTH_ERROR, 2)} 1/s" for row in rows[:most]]
        return "; ".join(words) + ("; ..." if len(rows) > most else "")

    def advice(self):
        """What makes the bars of undecided modes shorter: not what the run has done already."""
        raises = "a higher Discretization/Degree (" + self.parameters.get("Discretization/Degree", "?") + " now)"
        if self.parameters.get("Scene") == "matrices":
            return ""
        if self.parameters.get("Refinement/Strategy") == "adaptive":
            return f"Shorter bars: {raises}, or more Refinement/Cycles and Maximum unknowns."
        if float(self.parameters.get("Discretization/Degree") or 3) < 3:
            return f"Shorter bars: {raises}, then Refinement/Strategy = adaptive."
        return "Shorter bars: Refinement/Strategy = adaptive."

    def summary_of_sweep(self):
        """A sweep's findings. Critical values are known better than the values between which they lie."""
        name = self.parameters.get("Sweep/Parameter", "a parameter")
        values = sorted({float(row["parameter"]) for row in self.sweep})
        branches = {row["branch"] for row in self.sweep}
        unstable = [row for row in self.sweep if row["verdict"] in UNSTABLE]
        described = (f"{len(branches)} modes at {len(values)} values of {name} from {number(values[0])} to "
                     f"{number(values[-1])}.")
        words = []
        if unstable:
            worst = max(unstable, key=lambda row: float(row[GROWTH]))
            growing = sorted(float(row["parameter"]) for row in unstable)
            n_growing = len({row["branch"] for row in unstable})
            where = (f"at {number(growing[0])} alone" if growing[0] == growing[-1] else
                     f"at values from {number(growing[0])} to {number(growing[-1])}")
            words.append(f"{n_growing} mode{'s grow' if n_growing > 1 else ' grows'} along {name}: {where} of those computed; fastest "
                         f"{fixed(worst[FREQUENCY], 1)} Hz at {number(worst['parameter'])} with "
                         f"{fixed(worst[GROWTH], 2, digits=3)} 1/s.")
            onsets = sorted((row for row in self.rows("critical.csv") if row["kind"] in ("onset", "divergence")),
                            key=lambda row: float(row["value"]))
            if onsets:
                words.append("Growth begins at " + ", ".join(f"{critical_value(row)} (branch {row['branch']})"
                                                             for row in onsets[:5])
                             + (", ..." if len(onsets) > 5 else "") + ".")
        else:
            words.append(f"No mode grows at any of the values of {name}.")
        undecided = {row["branch"] for row in self.sweep if row["verdict"] == "undecided"}
        if undecided:
            words.append(f"The mesh leaves {len(undecided)} mode{'s' if len(undecided) > 1 else ''} undecided at some of them.")
        if not any(row.get(GROWTH_ERROR) for row in self.sweep):
            words.append("This sweep has no error bars: check the mesh by a run at the values that matter.")
        return [*words, described]

    def summary_of_map(self):
        names = list(self.map[0])[:2]
        points = [row for row in self.map if row.get("growth_rate_1_per_s")]
        growing = [row for row in points if float(row.get("unstable_modes") or 0) > 0]
        if not points:
            return "A stability map without points yet."
        undecided = sum(float(row.get("undecided_modes") or 0) > 0 for row in points)
        left = f" The mesh leaves some mode undecided at {undecided} of them." if undecided else ""
        if not growing:
            return f"No mode grows at any of {len(points)} points of {names[0]} and {names[1]}.{left}"
        worst = max(growing, key=lambda row: float(row["growth_rate_1_per_s"]))
        return (f"A mode grows at {len(growing)} of {len(points)} points of {names[0]} and {names[1]}, fastest with "
                f"{fixed(worst['growth_rate_1_per_s'], 2, digits=3)} 1/s at {names[0]} = {number(worst[names[0]])}, "
                f"{names[1]} = {number(worst[names[1]])}.{left}")

    def summary_of_samples(self):
        of_all = next((row for row in self.probabilities if row["branch"] == "any"), None)
        if not of_all:
            return [f"{len(self.samples)} samples so far; probabilities follow when all are there."]
        bars = ", ".join(f"\N{PLUS-MINUS SIGN} {number(of_all[column], 2)} by the {what}"
                         for column, what in PROBABILITY_BARS if of_all.get(column))
        if not of_all["probability"]:
            return ["No sample has a mode in the window: that says nothing about squeal."]
        words = [f"A mode grows with a probability of {number(of_all['probability'], 3)} ({bars}), of {of_all['samples']} "
                 "samples."]
        likely = sorted((row for row in self.probabilities if row["branch"] != "any" and float(row["probability"] or 0) > 0),
                        key=lambda row: -float(row["probability"]))
        if likely:
            words.append("Most often " + ", ".join(f"{number(row['frequency_hz'], 5)} Hz ({number(row['probability'], 3)})"
                                                   for row in likely[:3]) + ".")
        if not of_all.get("mesh_error"):
            if self.parameters.get("Scene") != "matrices":
                words.append("Without error bars: the mesh may have decided these verdicts.")
        elif float(of_all["mesh_error"]) > float(of_all["sampling_error"]):
            words.append("The mesh leaves more open than the number of samples does: a finer mesh tells more than more samples.")
        return words

    def summary(self):
        unstable = [row for row in self.modes if row["verdict"] in UNSTABLE]
        undecided = [row for row in self.modes if row["verdict"] == "undecided"]
        words = []
        if self.modes:
            highest = self.parameters.get("Eigenproblem/Maximum frequency", "")
            searched = f"{len(self.modes)} modes" + (f" up to {number(highest)} Hz" if highest else "") + "."
            if unstable:
                words.append(f"Squeal is to be expected: {len(unstable)} mode{'s grow' if len(unstable) > 1 else ' grows'}, "
                             f"fastest {self.of_modes(unstable, 1)}.")
                if undecided:
                    words.append(f"{len(undecided)} more may grow (undecided): {self.of_modes(undecided, 2)}.")
            elif undecided:
                words.append(f"Squeal cannot be excluded: {len(undecided)} mode{'s' if len(undecided) > 1 else ''} may grow "
                             f"(undecided: the error bar of the growth rate contains zero): {self.of_modes(undecided, 3)}.")
            else:
                words.append("No mode grows of those searched for (up to 1.1 times the window; what is known of growth beyond "
                             "is in the log).")
            words.append(searched)
            if undecided:
                words.append(self.advice())
            if not any(row.get(GROWTH_ERROR) for row in self.modes):
                words.append("Without error bars: the mesh may have decided these verdicts.")
        elif self.sweep:
            words += self.summary_of_sweep()
        elif self.map:
            words.append(self.summary_of_map())
        elif self.samples:
            words += self.summary_of_samples()
        elif self.cycles:
            words.append(f"No mode up to {number(self.parameters.get('Eigenproblem/Maximum frequency'))} Hz was found: "
                         "nothing is said about squeal.")
        else:
            words.append("There are no modes yet.")
        turns = self.parameters.get("Stage") != "elastic" and self.parameters.get("Scene") != "matrices"
        if turns and self.parameters.get("Rotor/Transport") == "none":
            words.append("Neglected (Rotor/Transport = none): the rotor's gyroscopic and centrifugal terms, which move modes "
                         "of n nodal diameters by up to n times the speed of rotation, and Q_R of friction damping.")
        # Modes that grow outside of the region that was searched are told by the log only.
        log = (self.directory / "log.txt").read_text(encoding="utf-8", errors="replace")
        lacks_growing = "more modes grow than are listed" in log
        if lacks_growing:
            words.append("But more modes grow than are listed: there are signs of growth outside of the region that was "
                         "searched; see the log.")
        grow = unstable or any(row["verdict"] in UNSTABLE for row in self.sweep) or \
            any(float(row.get("unstable_modes") or 0) > 0 for row in self.map + self.samples)
        kind = "unstable" if grow or lacks_growing else "undecided" if undecided else ""
        for warning in dict.fromkeys(line for line in log.splitlines() if line.startswith("Warning")):
            self.body.append(f'<p class="summary undecided"><strong>{html.escape(warning)}</strong></p>')
        self.body.append(f'<p class="summary {kind}">{html.escape(" ".join(words))}</p>')

    def computed(self):
        """What the numbers are of: what who gets only this page must know."""
        log = (self.directory / "log.txt").read_text(encoding="utf-8", errors="replace")

        def last(pattern):
            found = re.findall(pattern, log, re.M)
            return found[-1].strip() if found else ""

        of = self.parameters.get
        varied = {of("Sweep/Parameter"), of("Sweep/Second parameter"), *self.uncertain_numbers()}
        lines = [("Command", last("^Command: (.*)$")), ("Started", last("^Started: (.*)$")),
                 ("Version", last(r"^(squeal \S+ \(.*)$"))]
        if of("Scene") and of("Scene") != "matrices":
            lines += self.of_the_brake(of, varied)
        if of("Scene") == "matrices":
            lines.append(("Matrices", ", ".join(of("Matrices/" + key) for key in ("Mass", "Velocity", "Stiffness", "Circulatory")
                                                if of("Matrices/" + key))))
        # What a sweep varies has no value of its own.
        for key in ("", "Second "):
            name = of(f"Sweep/{key}Parameter".replace("Second P", "Second p"), "none")
            if name != "none":
                lines.append(("Along", f"{name} = {of(f'Sweep/{key}Values'.replace('Second V', 'Second v'))}"))
        if self.samples:
            lines.append(("Samples of", of("Sampling/File") or of("Sampling/Parameters", "")))
        self.section("What was computed")
        self.body.append("<dl>" + "".join(f"<dt>{html.escape(key)}</dt><dd>{html.escape(value)}</dd>"
                                          for key, value in lines if value) + "</dl>")
        if of("Scene") and of("Scene") != "matrices":
            self.materials(of)
        if of("Scene") == "mesh":
            self.assembly(of)

    def assembly(self, of):
        """The joints, and a picture of the mesh where it is still there."""
        keys = {"Ties": "tie", "Contacts": "contact", "Springs": "spring", "Dashpots": "dashpot", "Masses": "mass",
                "Rigid links": "rigid link", "Superelements": "superelement"}
        rows = [[name, entry.strip()] for key, name in keys.items() for entry in of("Joints/" + key, "").split(",")
                if entry.strip()]
        if rows:
            self.body.append(table(["joint<", "between<"], rows))
        places = [Path(of("Mesh/File")), SCRIPTS.parent / of("Mesh/File")]
        mesh = next((place for place in places if place.suffix == ".msh" and place.is_file()), None)
        if mesh:
            self.drawn_by("The mesh: dark are named surfaces", "plot_mesh.py", *(["--lift", "0"] if rows else []), subject=mesh)

    def of_the_brake(self, of, varied):
        lines = []
        friction = "varied" if "Contact/Friction/Coefficient" in varied else of("Contact/Friction/Coefficient", "")
        law = of("Contact/Friction/Law", "constant")
        if law == "falling":
            friction += f" at rest, falling to {of('Contact/Friction/Coefficient at speed')}"
        elif law == "expression":
            friction = of("Contact/Friction/Expression", "")
        if of("Contact/Friction/Of pads"):
            friction += f"; of pads: {of('Contact/Friction/Of pads')}"
        has_pads = of("Pads/Arrangement") != "none"
        if has_pads and of("Stage") not in ("elastic", "transport"):
            lines.append(("Friction", f"{friction} ({law})"))
        if has_pads:
            profile, own, parts = of("Pads/Pressure profile", "1"), of("Mesh/Pressures", ""), []
            if not own or of("Mesh/Pressure on", ""):
                parts.append(("varied" if "Pads/Pressure" in varied else f"{number(1e-6 * float(of('Pads/Pressure')))} MPa") +
                             (f" times {profile}" if profile != "1" else "") + " on the pads")
            if own:
                parts.append(f"of surfaces, Pa: {own}")
                parts += [f"{name[len('Mesh/Pressures/'):]} varied" for name in varied
                          if name and name.startswith("Mesh/Pressures/")]
            lines.append(("Pressure", "; ".join([*parts, f"in the contact {of('Contact/Steady pressure')}"])))
        speed = float(of("Operation/Angular velocity"))
        if "Operation/Angular velocity" in varied:
            lines.append(("Speed", "varied"))
        elif of("Scene") == "strip":
            lines.append(("Speed", f"{number(speed)} m/s"))
        else:
            lines.append(("Speed", f"{number(speed)} rad/s = {number(60 * speed / (2 * math.pi), 4)} rev/min"))
        if has_pads:
            contact = of("Contact/Formulation", "")
            lines.append(("Contact", contact if contact == "mortar" else
                          f"{contact}, {number(of('Contact/Penalty stiffness'))} N/m\N{SUPERSCRIPT THREE}"))
        if of("Scene") == "brake":
            size = {key: number(1e3 * float(of(key)), 4) for key in
                    ("Rotor/Inner radius", "Rotor/Outer radius", "Rotor/Thickness", "Pads/Inner radius", "Pads/Outer radius",
                     "Pads/Thickness")}
            lines.append(("Rotor", f"radii {size['Rotor/Inner radius']} to {size['Rotor/Outer radius']} mm, "
                          f"{size['Rotor/Thickness']} mm thick, clamped: {of('Rotor/Clamped boundary')}"))
            if has_pads:
                lines.append(("Pads", f"{of('Pads/Arrangement')}, {number(of('Pads/Sector angle'))} degrees, radii "
                              f"{size['Pads/Inner radius']} to {size['Pads/Outer radius']} mm, {size['Pads/Thickness']} mm thick, "
                              f"back face {of('Pads/Back face')}"))
        mesh = f"degree {of('Discretization/Degree')}"
        if of("Scene") == "mesh":
            mesh = f"{of('Mesh/File')}, {mesh}"
        if self.cycles and self.cycles[-1].get("dofs"):
            unknowns = f"{int(float(self.cycles[-1]['dofs'])):,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
            mesh += f", {self.cycles[-1]['cells']} cells, {unknowns} unknowns"
        if len(self.cycles) > 1:
            mesh += f", the last of {len(self.cycles)} meshes ({of('Refinement/Strategy')})"
        return [*lines, ("Mesh", mesh)]

    def materials(self, of):
        """Elastic constants, density, damping by part, and masses where mesh.csv has them."""
        parts = [("rotor", "Rotor/Material")] + ([("pads", "Pads/Material")] if of("Pads/Arrangement") != "none" else [])
        numbers = sorted(int(found[1]) for key in self.parameters if (found := re.fullmatch(r"Mesh/Part (\d+)/Volumes", key)))
        parts += [(of(f"Mesh/Part {i}/Volumes"), f"Mesh/Part {i}/Material") for i in numbers
                  if of("Scene") == "mesh" and of(f"Mesh/Part {i}/Volumes")]
        if of("Scene") == "mesh" and of("Mesh/Rotor"):
            parts[0] = (of("Mesh/Rotor"), "Rotor/Material")
        rows = []
        for name, path in parts:
            young = number(1e-9 * float(of(path + "/Young modulus")))
            if of(path + "/Law") == "transversely_isotropic":
                young += f" ({number(1e-9 * float(of(path + '/Axial Young modulus')))} along z)"
            of_frequency = [f"{key.lower()} {of(path + '/' + key)}" for key in
                            ("Bulk viscosity", "Shear viscosity", "Viscosity tensor", "Loss factor", "Prony series",
                             "Fractional Zener", "Modulus table")
                            if of(path + "/" + key, "") not in ("", "0")]
            rows.append([name, young, number(of(path + "/Poisson ratio")), number(of(path + "/Density")),
                         number(of(path + "/Mass proportional damping")), number(of(path + "/Stiffness proportional damping")),
                         "; ".join(of_frequency)])
        header = ["material of<", "E, GPa", "\N{GREEK SMALL LETTER NU}", "density, kg/m\N{SUPERSCRIPT THREE}",
                  "damping \N{GREEK SMALL LETTER ALPHA}, 1/s", "\N{GREEK SMALL LETTER BETA}, s", "other damping<"]
        n_columns = len(header) if any(row[-1] for row in rows) else len(header) - 1
        self.body.append(table(header[:n_columns], [row[:n_columns] for row in rows]))
        factor = float(of("Modal damping/Factor", 1))
        if of("Modal damping/Ratios", "") and factor:
            times = f", times {number(factor, 4)}" if factor != 1 else ""
            self.note(f"Damping of real modes, frequency in Hz : ratio{times}. {of('Modal damping/Ratios')}.")
        masses = [f"{row['name']} {number(row['mass_kg'], 4)} kg" for row in self.rows("mesh.csv")
                  if row.get("kind") == "body" and row.get("mass_kg")]
        if masses:
            self.note("Masses: " + ", ".join(masses) + ".")

    def verdicts(self):
        if not self.modes:
            return
        self.section("Verdicts")
        header = ["mode", "verdict<", "growth rate, 1/s", "frequency, Hz", "shape<", "damping ratio", "backward error",
                  "condition"]
        self.body.append(table(header, [[row["mode"], row["verdict"], with_bar(row, GROWTH, GROWTH_ERROR, 4),
                                         with_bar(row, FREQUENCY, FREQUENCY_ERROR, 3), shape_of(row),
                                         number(row["damping_ratio"], 3),
                                         number(row["backward_error"], 2), number(row["condition_number"], 3)]
                                        for row in self.modes],
                               ["unstable" if row["verdict"] in UNSTABLE else
                                "undecided" if row["verdict"] == "undecided" else "" for row in self.modes]))
        if any(row.get(GROWTH_ERROR) for row in self.modes):
            self.note("Behind \N{PLUS-MINUS SIGN}: what the mesh may have done to the value. A verdict stands if the bar of the "
                      "growth rate does not reach zero. modes.csv has all digits.")
        if any(row.get("shape") for row in self.modes):
            self.note("Shape: nodal diameters and circles of the disc; pads: most of the energy is theirs.")
        self.drawn_by("Eigenvalues in the complex plane", "plot.py")

    def causes(self):
        shares = {}
        contributions = [row for row in self.rows("contributions.csv") if int(row["cycle"]) == self.cycle]
        for row in contributions:
            of_mode = shares.setdefault(row["mode"], {})
            of_mode[row["origin"]] = of_mode.get(row["origin"], 0) + float(row["growth_rate_1_per_s"])
        shown = [row for row in self.modes if row["verdict"] in UNSTABLE + ("undecided",) and row["mode"] in shares]
        if not shown:
            return
        self.section("Why modes grow")
        origins = sorted({origin for row in shown for origin, value in shares[row["mode"]].items()
                          if abs(value) > 1e-6 * max(map(abs, shares[row["mode"]].values()))})
        self.body.append(table(["mode", "growth rate, 1/s", *origins],
                               [[row["mode"], number(row[GROWTH]), *(number(shares[row["mode"]].get(origin, 0), 4)
                                                                     for origin in origins)] for row in shown]))
        self.note("The growth rate as the sum over what feeds the mode (positive) and what brakes it (negative), 1/s.")
        worst = max(shown, key=lambda row: float(row[GROWTH]))["mode"]
        self.causes_by_part(worst, [row for row in contributions if row["mode"] == worst])

    def causes_by_part(self, mode, parts):
        """Of one mode, by its contributions: what happens in which body, contact or joint."""
        bodies = list(dict.fromkeys(row["body"] for row in parts))
        values = {(row["body"], row["origin"]): float(row["growth_rate_1_per_s"]) for row in parts}
        largest = max(map(abs, values.values()), default=0)
        origins = [origin for origin in dict.fromkeys(row["origin"] for row in parts)
                   if any(abs(values.get((body, origin), 0)) > 1e-4 * largest for body in bodies)]
        bodies = [body for body in bodies if any(abs(values.get((body, origin), 0)) > 1e-4 * largest for origin in origins)]
        if len(bodies) < 3:
            return
        self.body.append(table([f"mode {mode}, by part<", *origins],
                               [[body, *(number(values[body, origin], 4) if (body, origin) in values else "" for origin in origins)]
                                for body in bodies]))

    def bars(self):
        """What the bars of flutter and undecided growth rates are made of."""
        names = {row["mode"]: row for row in self.modes if row["verdict"] in UNSTABLE + ("undecided",)}
        rows = [row for row in self.rows("bars.csv") if int(row["cycle"]) == self.cycle and row["mode"] in names]
        if not rows:
            return
        self.section("What the bars are made of")
        causes = list(dict.fromkeys(row["cause"] for row in rows if not row["at"]))
        parts = {(row["mode"], row["cause"]): float(row["growth_rate_1_per_s"]) for row in rows if not row["at"]}

        def places(mode):
            own = sorted(((float(row["growth_rate_1_per_s"]), row["at"]) for row in rows if row["mode"] == mode and row["at"]),
                         reverse=True)
            return ", ".join(f"{at} {number(value, 2)}" for value, at in own[:3])
        self.body.append(table(["mode", "growth rate, 1/s", *causes, "mostly of<"],
                               [[mode, with_bar(row, GROWTH, GROWTH_ERROR, 4),
                                 *(number(parts.get((mode, cause), 0), 2) for cause in causes), places(mode)]
                                for mode, row in names.items()]))
        self.note("How much of the bar each cause alone makes up, 1/s. The last column: bodies whose cells, and contacts whose edges, "
                  "have most of it; finer cells there make the bar shorter. bars.csv has all modes.")

    def remedies(self):
        """What a tenth more of each parameter would do to the mode that grows fastest, or would first."""
        if not self.modes:
            return
        worst = max(self.modes, key=lambda row: float(row[GROWTH]))
        rows = [row for row in self.rows("sensitivities.csv") if int(row["cycle"]) == self.cycle and row["mode"] == worst["mode"]
                and float(row["relative_d_growth_rate_1_per_s"] or 0) != 0]
        if not rows:
            return
        rows.sort(key=lambda row: -abs(float(row["relative_d_growth_rate_1_per_s"])))
        self.section(f"What would help mode {worst['mode']}")
        self.body.append(table(["parameter<", "value", "growth rate by 10 % more, 1/s", "frequency by 10 % more, Hz"],
                               [[row["parameter"], number(row["value"]),
                                 number(0.1 * float(row["relative_d_growth_rate_1_per_s"]), 3),
                                 number(0.1 * float(row["relative_d_frequency_hz"]), 3)] for row in rows[:8]]))
        self.note("From derivatives: small changes only, one at a time. sensitivities.csv has every mode and parameter.")

    # Sweeps.

    def sweeps(self):
        if not self.sweep:
            return
        name = self.parameters.get("Sweep/Parameter", "parameter")
        self.section("Sweep over " + name)
        branches = {}
        for row in self.sweep:
            branches.setdefault(row["branch"], []).append(row)
        critical = self.rows("critical.csv")

        def points(rows):
            """Along a branch, with the critical points on it: value, frequency, growth rate, bar."""
            on_branch = [(float(row["value"]), float(row["frequency_hz"]), float(row["growth_rate_1_per_s"]), None)
                         for row in critical if rows[0]["branch"] in (row["branch"], row["other_branch"])]
            own = [(float(row["parameter"]), float(row[FREQUENCY]), float(row[GROWTH]), float(row.get(GROWTH_ERROR) or 0)) for row in rows]
            return sorted(own + on_branch, key=lambda point: point[0])

        def draw(pyplot):
            import numpy  # matplotlib is there, and needs it

            pyplot.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False})
            figure, (upper, lower) = pyplot.subplots(2, 1, sharex=True, figsize=(9, 8), layout="constrained")
            for rows in branches.values():
                grows = any(row["verdict"] in UNSTABLE for row in rows)
                x, frequency, growth, bars = zip(*points(rows))
                look = {"color": STYLES["flutter"][0] if grows else STYLES["stable"][0], "linewidth": 1.8 if grows else 0.8,
                        "zorder": 3 if grows else 2, "marker": "." if len(x) == 1 else None}
                upper.plot(x, frequency, **look)
                lower.plot(x, growth, **look)
                if grows and any(bars):
                    # Critical points have no bar of their own: that between their neighbours, as bands follow branches.
                    known = [(at, bar) for at, bar in zip(x, bars) if bar is not None]
                    bars = numpy.interp(x, *zip(*known))
                    lower.fill_between(x, [g - b for g, b in zip(growth, bars)], [g + b for g, b in zip(growth, bars)],
                                       color=look["color"], alpha=0.2, linewidth=0, zorder=1)
            for row in critical:
                for axis, of in ((upper, "frequency_hz"), (lower, "growth_rate_1_per_s")):
                    axis.errorbar(float(row["value"]), float(row[of]), xerr=float(row.get("mesh_error") or 0), fmt="kx",
                                  markersize=7, elinewidth=1, capsize=3, zorder=4)
            # Bars of critical values may reach far: the values computed fill the picture.
            of_values = [float(row["parameter"]) for row in self.sweep]
            margin = 0.03 * (max(of_values) - min(of_values)) or 1
            lower.set_xlim(min(of_values) - margin, max(of_values) + margin)
            lower.axhline(0, color="black", linewidth=1)
            lower.set_yscale("symlog", linthresh=10)
            lower.set_ylabel("growth rate, 1/s (linear within 10)")
            upper.set_ylabel("frequency, Hz")
            label, factor = axis_of(name, self.parameters.get("Scene"))
            lower.set_xlabel(label)
            if factor != 1:
                lower.xaxis.set_major_formatter(lambda value, _: f"{factor * value:.6g}")
            for axis in (upper, lower):
                axis.grid(color="0.92")
            return figure

        self.figure("Lock-in diagram: modes along the parameter; orange branches grow somewhere, bands and the bars of the "
                    "crosses, which are critical values, are what the mesh may have done", draw)
        if critical:
            self.body.append(table(["kind<", "value", "corrected", "search and reduction", "frequency, Hz", "branch",
                                    "with branch"],
                                   [[row["kind"], critical_value(row),
                                     number(row["corrected_value"]) if row.get("corrected_value") else "", number(row["accuracy"], 2),
                                     number(row["frequency_hz"], 8), row["branch"], row["other_branch"] or "\N{EN DASH}"]
                                    for row in critical]))

    def stability_map(self):
        if self.map:
            self.section("Stability map")
            self.drawn_by("Largest growth rate and the border of stability", "stability_map.py")
            curves = {}
            for row in self.rows("border.csv"):
                curves.setdefault(row["curve"], []).append(row)
            if not curves:
                return
            names, scene = list(self.map[0])[:2], self.parameters.get("Scene")
            (first, by_first), (second, by_second) = (axis_of(name, scene) for name in names)

            def span(rows, name, factor):
                values = [factor * float(row[name]) for row in rows]
                return f"{number(min(values), 4)} to {number(max(values), 4)}"

            def half_width(rows, name, factor):
                known = [abs(factor * float(row["band_" + name])) for row in rows if row.get("mesh_error_cells")]
                return number(max(known), 2) if known else "\N{EN DASH}"

            self.body.append(table(["curve", "kind<", "frequency, Hz", first, second, "band, first", "band, second"],
                                   [[curve, rows[0]["kind"], span(rows, "frequency_hz", 1), span(rows, names[0], by_first),
                                     span(rows, names[1], by_second), half_width(rows, names[0], by_first),
                                     half_width(rows, names[1], by_second)] for curve, rows in curves.items()]))
            self.note("Black: where a mode begins to grow. The band: what the mesh may move the curve by, to both sides, at most "
                      "along it, in the units of the parameters; dotted: corrected. border.csv has all points.")

    # Samples.

    def uncertain_numbers(self):
        """Columns between the number of the sample and what was found."""
        columns = list(self.samples[0]) if self.samples else []
        return columns[1:columns.index("modes")] if "modes" in columns else []

    def sampling(self):
        if not self.samples:
            return
        self.section("Samples")
        names = self.uncertain_numbers()

        def draw_growth(pyplot):
            pyplot.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False})
            n_columns = min(len(names), 3)
            n_rows = -(-len(names) // n_columns)
            figure, axes = pyplot.subplots(n_rows, n_columns, sharey=True, squeeze=False, layout="constrained",
                                           figsize=(9, 1 + 2.6 * n_rows))
            known = [row for row in self.samples if row["growth_rate_1_per_s"]]
            growth = [float(row["growth_rate_1_per_s"]) for row in known]
            bars = [float(row["mesh_error_1_per_s"] or 0) for row in known]
            colors = [STYLES["undecided" if abs(g) < bar else "flutter" if g > 0 else "stable"][0]
                      for g, bar in zip(growth, bars)]
            for axis, name in zip(axes.flat, names):
                label, factor = axis_of(name, self.parameters.get("Scene"))
                axis.scatter([factor * float(row[name]) for row in known], growth, s=9, c=colors, linewidths=0)
                axis.axhline(0, color="black", linewidth=1)
                axis.set_xlabel(label, fontsize=9)
                axis.grid(color="0.92")
            for axis in axes.flat[len(names):]:
                axis.set_visible(False)
            for axis in axes[:, 0]:
                axis.set_ylabel("largest growth rate, 1/s")
            return figure

        self.figure("The largest growth rate of each sample over each uncertain number; orange samples grow, those in the "
                    "colour of undecided modes may", draw_growth)
        shown = [row for row in self.probabilities if float(row["probability"] or 0) > 0 or row["branch"] == "any" or
                 float(row.get("mesh_error") or 0) > 0]
        if shown:
            self.body.append(table(["branch", "frequency, Hz", "probability", "by samples", "by reduction", "by mesh",
                                    "growth rate: 5 %", "50 %", "95 %, 1/s"],
                                   [[row["branch"], number(row["frequency_hz"], 6), number(row["probability"], 4),
                                     *(number(row[column], 2) for column, _ in PROBABILITY_BARS),
                                     *(number(row[f"growth_rate_{share}_percent_1_per_s"], 4) for share in (5, 50, 95))]
                                    for row in shown], ["unstable" if float(row["probability"] or 0) > 0.5 else "" for row in shown]))
            self.note("How probable it is that a branch of modes grows, and that any does. By samples: half of the interval of "
                      "95 % that so many samples leave; by reduction and by mesh: how far the probability would move if all "
                      "growth rates were off by their errors to one side. Branches that cannot grow are in probability.csv.")
        self.sensitivity_indices()

    def sensitivity_indices(self):
        of_all = [row for row in self.rows("indices.csv") if row["branch"] == "any" and row["total"]]
        if not of_all:
            return

        def draw(pyplot):
            figure, axis = pyplot.subplots(figsize=(9, 1 + 0.6 * len(of_all)), layout="constrained")
            rows = sorted(of_all, key=lambda row: float(row["total"]))
            for shift, kind, color in ((-0.18, "first_order", "#0072B2"), (0.18, "total", "#E69F00")):
                axis.barh([i - shift for i in range(len(rows))], [float(row[kind]) for row in rows], 0.34,
                          xerr=[float(row[kind + "_error"]) for row in rows], color=color, capsize=3,
                          label="alone" if kind == "first_order" else "with all others")
            axis.set_yticks(range(len(rows)), [axis_of(row["parameter"], self.parameters.get("Scene"))[0].split(",")[0]
                                               for row in rows])
            axis.set_xlabel("share of the variance of the largest growth rate")
            axis.legend(frameon=False)
            return figure

        self.figure("Which uncertain number governs the growth rate", draw)

    # What the numbers rest on.

    def response(self):
        """Amplitude and phase over the frequency, a line for each force and observation; ticks are the modes."""
        curves = {}
        for row in self.rows("response.csv"):
            curves.setdefault((int(row["force"]), int(row["observation"])), []).append(
                (float(row["frequency_hz"]), float(row["amplitude_m"]), float(row["phase_deg"])))
        if not curves:
            return
        self.section("Frequency response")

        def draw(pyplot):
            pyplot.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False})
            figure, (upper, lower) = pyplot.subplots(2, 1, sharex=True, figsize=(9, 7), height_ratios=(2, 1), layout="constrained")
            for number, ((force, observation), points) in enumerate(sorted(curves.items())):
                frequency, amplitude, phase = zip(*sorted(points))
                look = {"color": RESPONSE_COLOURS[number % len(RESPONSE_COLOURS)], "linewidth": 1.2,
                        "linestyle": ("-", "--", ":", "-.")[number // len(RESPONSE_COLOURS) % 4],
                        "marker": "." if len(points) == 1 else None}
                upper.plot(frequency, amplitude, label=f"force {force}, observation {observation}", **look)
                # A jump by a whole turn is none.
                turned = [value if k == 0 or abs(value - phase[k - 1]) < 180 else math.nan for k, value in enumerate(phase)]
                lower.plot(frequency, turned, **look)
            low, high = (of(point[0] for points in curves.values() for point in points) for of in (min, max))
            for row in self.modes:
                if low <= float(row[FREQUENCY]) <= high:
                    upper.axvline(float(row[FREQUENCY]), ymax=0.03, linewidth=1,
                                  color=STYLES["flutter" if row["verdict"] in UNSTABLE else "stable"][0])
            upper.set_yscale("log")
            upper.set_ylabel("amplitude, m")
            lower.set_ylabel("phase, degrees")
            lower.set_yticks(range(-180, 181, 90))
            lower.set_xlabel("frequency, Hz")
            upper.legend(fontsize=8, frameon=False)
            for axis in (upper, lower):
                axis.grid(color="0.92")
            return figure

        self.figure("Displacement under harmonic forces; ticks below are the modes, orange ones grow", draw)
        places = [[kind, str(k + 1), text.strip()] for kind, key in (("force", "Forces"), ("observation", "Observations"))
                  for k, text in enumerate(filter(None, self.parameters.get(f"Response/{key}", "").split(",")))]
        self.body.append(table(["<", "number", "place : direction<"], places))

    def convergence(self):
        study = self.rows("convergence.csv")
        if len(self.cycles) < 2 and not study:
            return
        self.section("Meshes")
        bars = {}
        for row in read_table(self.directory, "modes.csv"):
            if row.get(GROWTH_ERROR):
                size = 2 * math.pi * max(float(row[FREQUENCY]), 1e-300)
                error = math.hypot(float(row[GROWTH_ERROR]), 2 * math.pi * float(row[FREQUENCY_ERROR] or 0)) / size
                bars[row["cycle"]] = max(bars.get(row["cycle"], 0), error)
        self.body.append(table(["mesh", "cells", "unknowns", "processor s", "largest bar, relative"],
                               [[row["cycle"], row["cells"], row["dofs"], number(row.get("processor_seconds"), 3),
                                 number(bars.get(row["cycle"]), 2)] for row in self.cycles]))
        points = [(row, bars[row["cycle"]]) for row in self.cycles if row["cycle"] in bars]
        if len(points) > 1:
            def draw(pyplot):
                pyplot.rcParams.update({"font.size": 10})
                figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.6), sharey=True, layout="constrained")
                for axis, key, label in ((axes[0], "dofs", "unknowns"), (axes[1], "processor_seconds", "processor s")):
                    axis.loglog([float(row[key]) for row, _ in points], [bar for _, bar in points], "o-", color="#0072B2")
                    axis.set_xlabel(label)
                    axis.grid(color="0.9", which="both")
                axes[0].set_ylabel("largest bar of an eigenvalue, relative")
                return figure
            self.figure("Estimated error against unknowns and time", draw)

    def contact(self):
        rows = [row for row in self.rows("static.csv") if row["cycle"] == str(self.cycle)]
        if not rows:
            return
        self.section("Contact in the steady state")
        self.body.append(table(["pad<", "normal force, N", "friction force, N", "torque, N m", "area, cm\N{SUPERSCRIPT TWO}",
                                "largest pressure, MPa"],
                               [[row["pad"], number(row["normal_force_n"]), number(row["friction_force_n"]),
                                 number(row["friction_torque_nm"]), number(1e4 * float(row["contact_area_m2"])),
                                 number(1e-6 * float(row["max_pressure_pa"]))] for row in rows]))
        if any(path.is_file() for path in self.directory.glob("contact-*.pvtu")):
            self.drawn_by("Contact pressure and status", "plot_contact.py")

    def pictures_of_modes(self):
        written = [row for row in self.modes if row["verdict"] in (*UNSTABLE, "undecided") and
                   (self.directory / f"mode-{self.cycle}-{int(row['mode']):03}.pvtu").is_file()]
        written.sort(key=lambda row: (row["verdict"] not in UNSTABLE, -float(row[GROWTH])))  # certain ones first
        if not written or self.parameters.get("Scene") not in ("brake", "mesh", "rotor"):
            return
        self.section("Modes that grow or may grow")
        launcher = [tool for tool in ("xvfb-run", "pvbatch") if shutil.which(tool)]
        if len(launcher) < 2:
            self.missing.append("Pictures of modes: ParaView's pvbatch and xvfb-run are not installed "
                                "(scripts/install-dependencies.sh --pictures)")
        for number_of_picture, row in enumerate(written[:self.most_modes]):
            if len(launcher) == 2 and number_of_picture == 0:
                self.drawn_by(f"Mode {row['mode']} in motion, much slowed down", "render_mode.py", "--mode", row["mode"],
                              "--cycle", str(self.cycle), launcher=PARAVIEW, kind="webp",
                              option="--animation")
            if len(launcher) == 2:
                self.drawn_by(f"Mode {row['mode']}, {row['verdict']}, {number(row[FREQUENCY])} Hz: rotor and pads, displacement enlarged",
                              "render_mode.py", "--mode", row["mode"], "--cycle", str(self.cycle),
                              launcher=PARAVIEW)
            if (self.directory / f"mode-{self.cycle}-{int(row['mode']):03}-contact.pvtu").is_file():
                self.drawn_by(f"Mode {row['mode']}: work of friction on the contact faces", "plot_contact.py", "--mode",
                              row["mode"])

    def input_and_log(self):
        self.section("Input and log")
        for name, title in (("original.prm", "Parameter file as given"), ("parameters.prm", "All parameters used"),
                            ("log.txt", "Log, with versions and times")):
            try:
                with open_text(self.directory / name) as file:
                    text = file.read()
            except OSError:
                continue
            self.body.append(f"<details><summary>{title} ({name})</summary><pre>{html.escape(text)}</pre></details>")

    def page(self):
        scene = self.parameters.get("Scene", "")
        title = f"squeal: {self.directory.name}"
        described = f"Scene {scene}, stage {self.parameters.get('Stage', '')}" if scene else ""
        self.body.append(f"<h1>{html.escape(title)}</h1><p>{html.escape(described)}</p>")
        for part in (self.summary, self.computed, self.verdicts, self.causes, self.bars, self.remedies, self.sweeps, self.stability_map, self.sampling, self.response,
                     self.pictures_of_modes, self.contact, self.convergence, self.input_and_log):
            try:
                part()
            except (KeyError, ValueError, TypeError) as error:  # of a table with other columns, or words for numbers
                self.missing.append(f"{part.__name__.replace('_', ' ')}: a table is damaged ({error})")
        if lacking := self.missing + self.failed:
            self.section("Not shown")
            self.body.append("<ul>" + "".join(f"<li>{html.escape(text)}</li>" for text in lacking) + "</ul>")
        return (f'{HEAD}<meta name="generator" content="{MARK}report.py">'
                f'<meta name="viewport" content="{VIEWPORT}">'
                f"<title>{html.escape(title)}</title><style>{STYLE}</style></head>\n<body>" + "\n".join(self.body) +
                "</body></html>\n")


def main():
    parser = argparse.ArgumentParser(description="Write report.html about a run.")
    parser.add_argument("directory", metavar="OUTPUT_DIR", type=Path, help="output directory of a run, e.g. output/brake")
    parser.add_argument("--output", metavar="FILE.html", type=Path, help="default: OUTPUT_DIR/report.html")
    parser.add_argument("--modes", metavar="N", type=int, default=3, help="pictures of at most so many modes; default 3")
    arguments = parser.parse_args()
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="surrogateescape")
    directory = arguments.directory.resolve()
    if not (directory / "log.txt").is_file():
        fail(f"{arguments.directory} is no output directory of a run: log.txt is missing")
    output = arguments.output or directory / "report.html"
    refuse_foreign(output, arguments.output, fail, [OF_EARLIER_VERSIONS])  # before pictures are drawn
    if not draw_with_matplotlib():
        print("report.py: without pictures: no Python with matplotlib was found (scripts/install-dependencies.sh --pictures)",
              file=sys.stderr)
    report = Report(directory, arguments.modes)
    page = report.page()
    # Names may have bytes that are no text.
    write_output(output, arguments.output, lambda name: Path(name).write_text(page, encoding="utf-8", errors="replace"), fail,
                 [OF_EARLIER_VERSIONS])
    print(output)
    if report.failed:
        fail("not every picture could be made:\n  " + "\n  ".join(report.failed))


if __name__ == "__main__":
    main()
