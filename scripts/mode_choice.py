"""What the scripts that show a mode in ParaView share: which mode."""

import csv
import glob
import math
import os
import re

from plotting import open_text


def read_modes(directory, fail):
    """{(cycle, mode): line of modes.csv}; calls fail(message) where there is no such table."""
    path = os.path.join(directory, "modes.csv")
    try:
        with open_text(path) as file:
            return {(int(line["cycle"]), int(line["mode"])): line for line in csv.DictReader(file)}
    except OSError as error:
        fail(f"{path} cannot be read: {error.strerror}. Give the output directory of a run, e.g. output/brake.")
    except (KeyError, TypeError, ValueError) as error:
        fail(f"{path} is not a table of modes: {error}")


def choose_mode(arguments, modes, ending, advice, fail):
    """Cycle, number and file of the mode to show, out of those with a file mode-C-N.ENDING: those of the arguments, or of
    the last cycle the mode growing fastest. Calls fail(message) where it was not written; @p advice is for none at all."""
    files = {}
    for path in glob.glob(os.path.join(glob.escape(arguments.directory), f"mode-*.{ending}")):
        match = re.fullmatch(rf"mode-(\d+)-(\d+)\.{ending}", os.path.basename(path))
        if match:
            files[int(match[1]), int(match[2])] = path
    if not files:
        fail(f"{arguments.directory} holds no mode-*.{ending}{advice}")
    cycle = max(c for c, _ in files) if arguments.cycle is None else arguments.cycle
    written = sorted(m for c, m in files if c == cycle)
    if not written:
        fail(f"no mode of cycle {cycle} was written; there are: {', '.join(sorted({str(c) for c, _ in files}))}")
    mode = arguments.mode
    if mode is None:
        mode = max(written, key=lambda m: float((modes.get((cycle, m)) or {}).get("growth_rate_1_per_s") or -math.inf))
    if mode not in written:
        fail(f"mode {mode} of cycle {cycle} was not written; written are: {', '.join(map(str, written))}. "
             "A run with  --set \"Output/Fields=all\"  writes every mode.")
    return cycle, mode, files[cycle, mode]
