#!/usr/bin/env python3
"""Runs the examples of prm/ and shows them on one page: picture, command, what came out, seconds and memory.

    scripts/examples.py [NAME...] [--program FILE] [--output DIR]

Without names all of them: about half an hour on one core. Each run has its own page (report.py), to which the gallery,
examples.html, leads; it is written anew after each run. Ends with 1 if an example failed. The program is that of
build/release, or the installed one.
"""

import argparse
import html
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from report import STYLE

ROOT = Path(__file__).resolve().parent.parent
# From the simple to the whole; others behind them
ORDER = ["strip", "rotor", "brake", "off_centre", "falling_friction", "friction_sweep", "stability_map", "sampling", "adaptive_fast",
         "adaptive", "realistic_brake", "vented_disc", "whole_brake", "whole_brake_fine"]
GRID = """
body { max-width: 90rem; }
.examples { display: grid; grid-template-columns: repeat(auto-fill, minmax(20rem, 1fr)); gap: 1.5rem; }
.examples section { border: 1px solid #ddd; padding: 0 1rem; }
.examples img { width: 100%; height: 14rem; object-fit: contain; }
.examples code { font-size: .85rem; overflow-wrap: anywhere; }
"""


def fail(message):
    sys.exit("examples.py: " + message)


def names_of_examples():
    """Files of prm/ in the order in which they are shown."""
    names = sorted(path.stem for path in (ROOT / "prm").glob("*.prm"))
    return sorted(names, key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name))


def purpose(text):
    """The first paragraph of the comment at the head of a parameter file."""
    lines = []
    for line in text.splitlines():
        words = line.removeprefix("#").strip()
        if not line.startswith("#") or not words or "--" in words or line.startswith("#   "):
            break
        lines.append(words)
    return " ".join(lines)


def make_mesh(text):
    """The mesh that a parameter file names, by its Gmsh script; a sentence if that cannot be."""
    named = re.search(r"^\s*set\s+File\s*=\s*(prm/\S+)\.msh", text, re.M)
    if not named:
        return None
    mesh, script = ROOT / f"{named[1]}.msh", ROOT / f"{named[1]}.geo"
    if mesh.exists() and mesh.stat().st_mtime > script.stat().st_mtime:
        return None
    if not shutil.which("gmsh"):
        return "its mesh needs Gmsh: scripts/install-dependencies.sh --mesh"
    done = subprocess.run(["gmsh", "-3", str(script), "-o", str(mesh), "-v", "2"], check=False, capture_output=True, text=True)
    return None if done.returncode == 0 else f"gmsh: {done.stderr.strip() or done.stdout.strip()}"


def picture_of(page):
    """The picture that tells most of a run: a mode, else what is not the mesh; its text and data, or None."""
    figures = re.findall(r'<figure><img alt="([^"]*)" src="(data:image/[a-z]+;base64,[^"]*)">', page)
    for wanted in (lambda text: "displacement enlarged" in text, lambda text: not text.startswith("The mesh")):
        for text, data in figures:
            if wanted(text):
                return text, data
    return None


def run(name, program, directory):
    """Runs an example and makes its page; the pieces of its section in the gallery, and whether it went well."""
    file = ROOT / f"prm/{name}.prm"
    text = file.read_text(encoding="utf-8")
    pieces = [f"<h2>{html.escape(name)}</h2>", f"<p>{html.escape(purpose(text))}</p>",
              f"<p><code>scripts/run.sh prm/{html.escape(name)}.prm</code></p>"]
    if message := make_mesh(text):
        return [*pieces, f"<p>Not run: {html.escape(message)}</p>"], False
    command = [str(program), f"prm/{name}.prm", "--overwrite", "--set", f"Output/Directory={directory}"]
    done = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)
    if done.returncode != 0:
        print(f"{shlex.join(command)}: exit status {done.returncode}\n{done.stderr}", file=sys.stderr)
        return [*pieces, f"<p>Failed with status {done.returncode}: {html.escape(done.stderr.strip())}</p>"], False
    page = subprocess.run([sys.executable, str(ROOT / "scripts/report.py"), str(directory)], check=False, capture_output=True,
                          text=True)
    if page.stderr:
        print(page.stderr, end="", file=sys.stderr)
    written = directory / "report.html"
    if not written.exists():
        return [*pieces, "<p>It has no page.</p>"], False
    content = written.read_text(encoding="utf-8")
    if picture := picture_of(content):
        pieces.insert(1, f'<img alt="{picture[0]}" src="{picture[1]}">')
    if headline := re.search(r'class="summary[^"]*">(.*?)</', content, re.S):
        pieces.append(f"<p>{headline[1]}</p>")
    seconds = re.search(r"^  total +([\d.]+)", done.stdout, re.M)
    memory = re.search(r"Peak memory (\d+) MiB", done.stdout)
    cost = f"{float(seconds[1]):.0f} s, {memory[1]} MiB. " if seconds and memory else ""
    pieces.append(f'<p class="note">{cost}<a href="{html.escape(directory.name)}/report.html">Its page</a></p>')
    return pieces, page.returncode == 0


def main():
    parser = argparse.ArgumentParser(description="Run the examples and show them on one page.")
    parser.add_argument("names", metavar="NAME", nargs="*", help="of files in prm/, without .prm; default: all")
    built, installed = ROOT / "build/release/squeal", shutil.which("squeal")
    parser.add_argument("--program", type=Path, default=Path(installed) if installed and not built.exists() else built)
    parser.add_argument("--output", type=Path, default=ROOT / "output", help="where results and examples.html go")
    arguments = parser.parse_args()
    known = names_of_examples()
    if unknown := [name for name in arguments.names if name not in known]:
        fail(f"there is no example {unknown[0]}; there are {', '.join(known)}")
    if not arguments.program.exists():
        fail(f"{arguments.program} does not exist: scripts/build.sh release squeal")
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    sections, good = [], True
    for name in arguments.names or known:
        print(name, flush=True)
        pieces, went_well = run(name, arguments.program.resolve(), output / name)
        good &= went_well
        sections.append("<section>" + "\n".join(pieces) + "</section>")
        (output / "examples.html").write_text(
            '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>squeal: examples</title><style>{STYLE}{GRID}</style></head>\n<body><h1>squeal: examples</h1>\n"
            '<div class="examples">' + "\n".join(sections) + "</div></body></html>\n", encoding="utf-8")
    print(output / "examples.html")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
