"""What the scripts that draw share: a Python with matplotlib, loading it without a display, how they end, how files are read
and written, how values with error bars are written."""

import errno
import math
import os
import shutil
import subprocess
import sys
import tempfile

# By these words in its first bytes a script knows what a script wrote.
MARK = "squeal scripts/"


def stop(message):
    """Ends a script that cannot draw what it was given. The exit status 2 tells this from an error of the script: 1."""
    print(message, file=sys.stderr, flush=True)
    sys.exit(2)


def has_matplotlib():
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return False
    return True


def other_python_that_draws():
    """Another Python that has matplotlib: that of the PATH or the system's; None if neither has it."""
    for candidate in dict.fromkeys((shutil.which("python3"), "/usr/bin/python3")):
        if candidate and os.path.exists(candidate):
            found = subprocess.run([candidate, "-c", "import matplotlib"], capture_output=True, check=False)
            if found.returncode == 0:
                return candidate
    return None


def draw_with_matplotlib():
    """Starts the script again with a Python that has matplotlib where this one has none: a Python of the user's own often
    comes first in the PATH. Returns whether there is one."""
    if has_matplotlib():
        return True
    python = other_python_that_draws()
    if python:
        sys.stdout.flush()
        os.execv(python, [python, *sys.argv])
    return False


def load_pyplot(fail):
    """matplotlib.pyplot for files only; calls fail(message) where no Python has matplotlib."""
    if not draw_with_matplotlib():
        fail("no Python with matplotlib was found. Debian: apt-get install python3-matplotlib")
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    return plt


def open_text(path):
    """Opens a file for reading. Raises OSError, also for what is no regular file: a pipe would wait for ever."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise OSError(errno.EINVAL, "it is not a regular file", str(path))
    return open(path, newline="", encoding="utf-8", errors="replace")


def results_of_run(directory):
    """The names of the files that a run has written there, by its manifest."""
    try:
        with open_text(os.path.join(directory, "run.manifest")) as file:
            return {"run.manifest", *(line[5:].rstrip("\n") for line in file if line.startswith("file "))}
    except OSError:
        return set()


def refuse_foreign(path, is_named, fail, beginnings=()):
    """Calls fail(message) where writing `path` would destroy what is not the script's: what a link leads to, a result of the
    run, and, unless the user named the path, a file that neither has MARK nor one of these beginnings."""
    if not os.path.lexists(path):
        return
    path = os.fspath(path)
    if os.path.islink(path) or not os.path.isfile(path):
        fail(f"{path} is {'a link, which is not followed' if os.path.islink(path) else 'no regular file'}; name another file by --output")
    if os.path.basename(path) in results_of_run(os.path.dirname(path) or "."):
        fail(f"{path} is a result of the run and not replaced; name another file by --output")
    if is_named:
        return
    try:
        with open(path, "rb") as file:
            head = file.read(4096)
    except OSError as error:
        fail(f"{path} cannot be read: {error.strerror}")
    if MARK.encode() not in head and not head.startswith(tuple(beginnings)):
        fail(f"{path} was not written by this version's scripts and is not replaced; move it, or name another file by --output")


def write_output(path, is_named, write, fail, beginnings=()):
    """Calls write(name) with a new name beside `path` and renames what was written; foreign files stay (refuse_foreign)."""
    path = os.fspath(path)
    refuse_foreign(path, is_named, fail, beginnings)
    unfinished = None
    try:
        descriptor, unfinished = tempfile.mkstemp(suffix=os.path.splitext(path)[1], prefix=".squeal-",
                                                  dir=os.path.dirname(path) or ".")
        os.close(descriptor)
        write(unfinished)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(unfinished, 0o666 & ~mask)
        os.replace(unfinished, path)
        unfinished = None
    except (OSError, ValueError) as error:
        fail(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}")
    finally:
        if unfinished:
            os.unlink(unfinished)


def save_figure(figure, path, is_named, fail, dpi=110):
    """Writes a picture by write_output(). Other formats than PNG have no place for the mark."""
    own = {"metadata": {"Software": MARK + os.path.basename(sys.argv[0])}} if os.fspath(path).lower().endswith(".png") else {}
    write_output(path, is_named, lambda name: figure.savefig(name, dpi=dpi, **own), fail)


def rounded(value, bar):
    """A value and its bar as texts: the bar with two digits, the value to the same place; 1890 and 120, not 1885.547 and
    1.2e+02. The log does the same (with_bar in text.cc)."""
    place = int(f"{bar:.1e}".split("e")[1]) - 1 if bar > 0 and math.isfinite(bar) else -8
    if abs(place) >= 8:
        texts = f"{value:.5g}", f"{bar:.2g}"
    else:
        decimals, unit = max(-place, 0), 10.0 ** place
        texts = f"{round(value / unit) * unit + 0.0:.{decimals}f}", f"{float(f'{bar:.1e}'):.{decimals}f}"
    return tuple(text.replace("-", "\N{MINUS SIGN}") for text in texts)


# By the last words of a key: what an axis calls it, its unit there, and by what numbers are multiplied.
QUANTITIES = {"Friction/Coefficient": ("friction coefficient", "", 1), "Angular velocity": ("angular velocity", "rad/s", 1),
              "Pressure": ("pressure", "MPa", 1e-6), "Young modulus": ("Young's modulus", "GPa", 1e-9),
              "Axial Young modulus": ("axial Young's modulus", "GPa", 1e-9),
              "Axial shear modulus": ("axial shear modulus", "GPa", 1e-9), "Density": ("density", "kg/m\u00b3", 1),
              "Poisson ratio": ("Poisson's ratio", "", 1), "Loss factor": ("loss factor", "", 1),
              "Mass proportional damping": ("mass proportional damping", "1/s", 1),
              "Stiffness proportional damping": ("stiffness proportional damping", "\u00b5s", 1e6),
              "Penalty stiffness": ("contact stiffness", "N/mm\u00b3", 1e-9), "Decay speed": ("decay speed", "m/s", 1),
              "Smoothing speed": ("smoothing speed", "m/s", 1), "Normal dashpot": ("normal dashpot", "N s/m\u00b3", 1),
              "Tangential dashpot": ("tangential dashpot", "N s/m\u00b3", 1), "Thickness": ("thickness", "mm", 1e3),
              "Inner radius": ("inner radius", "mm", 1e3), "Outer radius": ("outer radius", "mm", 1e3),
              "Sector angle": ("sector angle", "degrees", 1)}


def axis_of(key, scene="brake"):
    """What the axis of a parameter is called, with its unit, and by what its values are multiplied there. A parameter
    without a name here keeps its key."""
    words = key.split("/")
    name, unit, factor = QUANTITIES.get("/".join(words[-2:])) or QUANTITIES.get(words[-1]) or (key, "", 1)
    if scene == "matrices":
        return key, 1
    if scene == "strip" and key == "Operation/Angular velocity":
        name, unit = "belt speed", "m/s"
    owner = {"Rotor": "rotor", "Pads": "pads", "Strip": "strip", "Mesh": "/".join(words[1:2]).lower()}.get(words[0], "")
    label = f"{name} ({owner})" if owner and name != key else name
    return label + (f", {unit}" if unit else ""), factor
