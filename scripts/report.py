#!/usr/bin/env python3
"""One page about a run of squeal that needs nothing but a browser: report.html in its output directory.

    scripts/report.py OUTPUT_DIR [--output FILE.html] [--modes N]

What was found in one sentence, verdicts with error bars, why modes grow, the eigenvalues in the complex plane, sweeps,
stability maps, convergence, contact in the steady state, pictures of the unstable modes (at most N, default 3),
parameters and log. Reads the tables of the run, finished or not; pictures are inside of the page.

Pictures need matplotlib, those of modes ParaView (scripts/install-dependencies.sh --pictures). What is missing is named
at the end of the page.
"""

import argparse
import base64
import csv
import html
import io
import math
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from plot import FREQUENCY, FREQUENCY_ERROR, GROWTH, GROWTH_ERROR, STYLES, UNSTABLE, read_parameters

SCRIPTS = Path(__file__).resolve().parent
RENDERING_SECONDS = 300

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1b1b; margin: 0 auto; padding: 1rem; max-width: 64rem; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: .5rem 0; }
h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccc; }
.summary { font-size: 1.1rem; padding: .75rem 1rem; border-left: .4rem solid #0072B2; background: #f3f7fa; }
.summary.unstable { border-color: #D55E00; background: #fdf3ec; }
.summary.undecided { border-color: #E69F00; background: #fdf8ec; }
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
@media print { details > pre { white-space: pre-wrap; } }
"""


def fail(message):
    sys.exit("report.py: " + message)


# Of these columns numbers are taken.
NUMBERS = {"cycle", "mode", "parameter", "value", "contact_area_m2", "max_pressure_pa", "dofs", "processor_seconds", GROWTH,
           FREQUENCY}


def is_whole(row):
    """Whether a line has a field for each column, and numbers where there must be some."""
    if None in row or None in row.values():
        return False
    try:
        return all(math.isfinite(float(row[name])) for name in NUMBERS & row.keys())
    except ValueError:
        return False


def read_table(directory, name, damaged=None):
    """The whole lines of a table as dictionaries; none if there is no such file. A line that somebody or a full disk cut is
    left out; @p damaged, a list, gets a sentence about it."""
    try:
        with open(directory / name, newline="", encoding="utf-8", errors="replace") as file:
            rows = list(csv.DictReader(line.replace("\0", "\N{REPLACEMENT CHARACTER}") for line in file))
    except OSError:
        return []
    except csv.Error as error:
        rows = []
        if damaged is not None:
            damaged.append(f"{name}: {error}")
    whole = [row for row in rows if is_whole(row)]
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
    bar = f" \N{PLUS-MINUS SIGN} {number(row[error], 2)}" if row.get(error) else ""
    return fixed(row[value], decimals, digits=3 if row["verdict"] in UNSTABLE else None) + bar


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
        self.body, self.missing = [], []
        self.parameters = read_parameters(str(directory))
        modes = [row for row in self.rows("modes.csv") if "cycle" in row]
        self.cycle = max((int(float(row["cycle"])) for row in modes), default=0)
        self.modes = [row for row in modes if int(float(row["cycle"])) == self.cycle]
        self.cycles = self.rows("cycles.csv")
        self.sweep, self.map = self.rows("sweep.csv"), self.rows("map.csv")

    def rows(self, name):
        return read_table(self.directory, name, self.missing)

    # Pieces of the page.

    def section(self, title):
        self.body.append(f"<h2>{html.escape(title)}</h2>")

    def note(self, text):
        self.body.append(f'<p class="note">{html.escape(text)}</p>')

    def picture(self, data, caption):
        encoded = base64.b64encode(data).decode()
        self.body.append(f'<figure><img alt="{html.escape(caption)}" src="data:image/png;base64,{encoded}">'
                         f"<figcaption>{html.escape(caption)}</figcaption></figure>")

    def drawn_by(self, caption, script, *arguments, launcher=(sys.executable,)):
        """The picture that another script makes of the run."""
        with tempfile.TemporaryDirectory() as scratch:
            output = os.path.join(scratch, "picture.png")
            command = [*launcher, str(SCRIPTS / script), str(self.directory), *arguments, "--output", output]
            try:
                done = subprocess.run(command, capture_output=True, text=True, timeout=RENDERING_SECONDS, check=False)
                self.picture(Path(output).read_bytes(), caption)
            except subprocess.TimeoutExpired:
                self.missing.append(f"{caption}: {script} took more than {RENDERING_SECONDS} s")
            except OSError:
                words = (done.stderr.strip() or done.stdout.strip() or "no picture").splitlines()[-1]
                self.missing.append(f"{caption}: {words}")

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

    def summary(self):
        unstable = [row for row in self.modes if row["verdict"] in UNSTABLE]
        undecided = [row for row in self.modes if row["verdict"] == "undecided"]
        words = []
        if self.modes:
            highest = self.parameters.get("Eigenproblem/Maximum frequency", "")
            words.append(f"{len(self.modes)} modes" + (f" up to {number(highest)} Hz" if highest else "") + ".")
            if unstable:
                worst = max(unstable, key=lambda row: float(row[GROWTH]))
                words.append(f"{len(unstable)} grow{'s' if len(unstable) == 1 else ''}: squeal is to be expected; fastest "
                             f"mode {worst['mode']} at {with_bar(worst, FREQUENCY, FREQUENCY_ERROR, 1)} Hz with "
                             f"{with_bar(worst, GROWTH, GROWTH_ERROR, 2)} 1/s.")
            else:
                words.append("None grows of those searched for (|l| up to 1.1 times the window; what is known of growth beyond "
                             "is in the log).")
            if undecided:
                words.append(f"{len(undecided)} undecided: their error bars contain zero; refine, for example by "
                             "Refinement/Strategy = adaptive.")
            elif not any(row.get(GROWTH_ERROR) for row in self.modes):
                words.append("Without error bars: the mesh may have decided these verdicts.")
        elif self.sweep:
            values = {float(row["parameter"]) for row in self.sweep}
            unstable = [row for row in self.sweep if row["verdict"] in UNSTABLE]
            words.append(f"{len({row['branch'] for row in self.sweep})} modes at {len(values)} values of "
                         f"{self.parameters.get('Sweep/Parameter', 'a parameter')} from {number(min(values))} to "
                         f"{number(max(values))}.")
            if unstable:
                worst = max(unstable, key=lambda row: float(row[GROWTH]))
                growing = [float(row["parameter"]) for row in unstable]
                n_growing = len({row["branch"] for row in unstable})
                words.append(f"{n_growing} of them grow{'s' if n_growing == 1 else ''} at values between "
                             f"{number(min(growing))} and {number(max(growing))}; fastest "
                             f"{fixed(worst[FREQUENCY], 1)} Hz at {number(worst['parameter'])} with "
                             f"{fixed(worst[GROWTH], 2, digits=3)} 1/s.")
            else:
                words.append("None grows at any of them.")
            words.append("Sweeps have no error bars: check the mesh by a run at the values that matter.")
        elif self.map:
            words.append("A stability map: see below.")
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
        kind = "unstable" if unstable or lacks_growing else "undecided" if undecided else ""
        self.body.append(f'<p class="summary {kind}">{html.escape(" ".join(words))}</p>')

    def verdicts(self):
        if not self.modes:
            return
        self.section("Verdicts")
        header = ["mode", "frequency, Hz", "growth rate, 1/s", "damping ratio", "backward error", "condition", "verdict<"]
        self.body.append(table(header, [[row["mode"], with_bar(row, FREQUENCY, FREQUENCY_ERROR, 3),
                                         with_bar(row, GROWTH, GROWTH_ERROR, 4), number(row["damping_ratio"], 4),
                                         number(row["backward_error"], 2), number(row["condition_number"], 3),
                                         row["verdict"]] for row in self.modes],
                               ["unstable" if row["verdict"] in UNSTABLE else
                                "undecided" if row["verdict"] == "undecided" else "" for row in self.modes]))
        self.note("Behind \N{PLUS-MINUS SIGN}: what the mesh may have done to the value. A verdict stands if the bar of the "
                  "growth rate does not reach zero.")
        self.drawn_by("Eigenvalues in the complex plane", "plot.py")

    def causes(self):
        shares = {}
        for row in self.rows("contributions.csv"):
            if int(row["cycle"]) == self.cycle:
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

        def draw(pyplot):
            pyplot.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False})
            figure, (upper, lower) = pyplot.subplots(2, 1, sharex=True, figsize=(9, 8), layout="constrained")
            for rows in branches.values():
                grows = any(row["verdict"] in UNSTABLE for row in rows)
                x = [float(row["parameter"]) for row in rows]
                look = {"color": STYLES["flutter"][0] if grows else STYLES["stable"][0], "linewidth": 1.8 if grows else 0.8,
                        "zorder": 3 if grows else 2, "marker": "." if len(x) == 1 else None}
                upper.plot(x, [float(row[FREQUENCY]) for row in rows], **look)
                lower.plot(x, [float(row[GROWTH]) for row in rows], **look)
            for row in critical:
                for axis, of in ((upper, "frequency_hz"), (lower, "growth_rate_1_per_s")):
                    axis.plot(float(row["value"]), float(row[of]), "kx", markersize=7, zorder=4)
            lower.axhline(0, color="black", linewidth=1)
            lower.set_yscale("symlog", linthresh=10)
            lower.set_ylabel("growth rate, 1/s (linear within 10)")
            upper.set_ylabel("frequency, Hz")
            lower.set_xlabel(name)
            for axis in (upper, lower):
                axis.grid(color="0.92")
            return figure

        self.figure("Lock-in diagram: modes along the parameter; orange branches grow somewhere, crosses are critical values",
                    draw)
        if critical:
            self.body.append(table(["kind<", "value", "accuracy", "frequency, Hz", "branch", "with branch"],
                                   [[row["kind"], number(row["value"], 10), number(row["accuracy"], 2),
                                     number(row["frequency_hz"], 8), row["branch"], row["other_branch"] or "\N{EN DASH}"]
                                    for row in critical]))

    def stability_map(self):
        if self.map:
            self.section("Stability map")
            self.drawn_by("Largest growth rate and the border of stability", "stability_map.py")

    # What the numbers rest on.

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
        self.body.append(table(["mesh", "cells", "unknowns", "processor s", "largest bar of |l|"],
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
                axes[0].set_ylabel("largest bar of |l|, relative")
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
        if list(self.directory.glob("contact-*.pvtu")):
            self.drawn_by("Contact pressure and status", "plot_contact.py")

    def pictures_of_modes(self):
        written = [row for row in self.modes if row["verdict"] in UNSTABLE and
                   (self.directory / f"mode-{self.cycle}-{int(row['mode']):03}.pvtu").exists()]
        written.sort(key=lambda row: -float(row[GROWTH]))
        if not written or self.parameters.get("Scene") not in ("brake", "mesh", "rotor"):
            return
        self.section("Unstable modes")
        launcher = [tool for tool in ("xvfb-run", "pvbatch") if shutil.which(tool)]
        if len(launcher) < 2:
            self.missing.append("Pictures of modes: ParaView's pvbatch and xvfb-run are not installed "
                                "(scripts/install-dependencies.sh --pictures)")
        for row in written[:self.most_modes]:
            if len(launcher) == 2:
                self.drawn_by(f"Mode {row['mode']}, {number(row[FREQUENCY])} Hz: rotor and pads, displacement enlarged",
                              "render_mode.py", "--mode", row["mode"], "--cycle", str(self.cycle),
                              launcher=("xvfb-run", "-a", "pvbatch"))
            if list(self.directory.glob(f"mode-{self.cycle}-{int(row['mode']):03}-contact.pvtu")):
                self.drawn_by(f"Mode {row['mode']}: work of friction on the contact faces", "plot_contact.py", "--mode",
                              row["mode"])

    def input_and_log(self):
        self.section("Input and log")
        for name, title in (("original.prm", "Parameter file as given"), ("parameters.prm", "All parameters used"),
                            ("log.txt", "Log, with versions and times")):
            try:
                text = (self.directory / name).read_text(encoding="utf-8", errors="replace")
            except OSError:
                continue
            self.body.append(f"<details><summary>{title} ({name})</summary><pre>{html.escape(text)}</pre></details>")

    def page(self):
        scene = self.parameters.get("Scene", "")
        title = f"squeal: {self.directory.name}"
        described = f"Scene {scene}, stage {self.parameters.get('Stage', '')}" if scene else ""
        if self.cycles and self.cycles[-1].get("dofs"):
            unknowns = f"{int(float(self.cycles[-1]['dofs'])):,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
            described += f", {unknowns} unknowns"
        self.body.append(f"<h1>{html.escape(title)}</h1><p>{html.escape(described)}</p>")
        for part in (self.summary, self.verdicts, self.causes, self.sweeps, self.stability_map, self.pictures_of_modes,
                     self.contact, self.convergence, self.input_and_log):
            try:
                part()
            except (KeyError, ValueError, TypeError) as error:  # of a table with other columns, or words for numbers
                self.missing.append(f"{part.__name__.replace('_', ' ')}: a table is damaged ({error})")
        if self.missing:
            self.section("Not shown")
            self.body.append("<ul>" + "".join(f"<li>{html.escape(text)}</li>" for text in self.missing) + "</ul>")
        return ('<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
                '<meta name="viewport" content="width=device-width, initial-scale=1">'
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
    unfinished = output.with_name(output.name + ".part")
    try:
        # Names may have bytes that are no text.
        unfinished.write_text(Report(directory, arguments.modes).page(), encoding="utf-8", errors="replace")
        os.replace(unfinished, output)
    except OSError as error:
        fail(f"{output} cannot be written: {error.strerror}")
    print(output)


if __name__ == "__main__":
    main()
