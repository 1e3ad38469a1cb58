"""What the scripts that draw share: a Python with matplotlib, loading it without a display, how they end, how values with
error bars are written."""

import math
import os
import shutil
import subprocess
import sys


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
