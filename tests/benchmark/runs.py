"""One run of squeal for a benchmark, with one thread unless told, and what is read from its files."""

import math
import os
import resource
import subprocess
import tempfile
from pathlib import Path

from accuracy import read_csv

PROJECT = Path(__file__).resolve().parents[2]
PROGRAM = PROJECT / "build/release/squeal"
DEFAULT_BRAKE = PROJECT / "prm/brake.prm"
# Processor seconds of the eigen-solver's parts, a line of the log
PARTS = r"counting ([\d.]+), factorisation ([\d.]+), right vectors ([\d.]+), left vectors ([\d.]+)"


def run(program, file, settings, ranks=1, environment=()):
    """The log, the rows of modes.csv and the last row of cycles.csv. Raises subprocess.CalledProcessError."""
    with tempfile.TemporaryDirectory() as directory:
        settings = [*settings, "Output/Fields=none", f"Output/Directory={directory}"]
        command = [program, file, *(a for s in settings for a in ("--set", s))]
        if ranks > 1:
            command = ["mpirun", "--oversubscribe", "-np", str(ranks), *command]
        subprocess.run(command, check=True, capture_output=True, text=True,
                       env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **dict(environment)})
        return (Path(directory, "log.txt").read_text(), read_csv(f"{directory}/modes.csv"),
                read_csv(f"{directory}/cycles.csv")[-1])


def processor_seconds():
    """What all processes took that this one started and waited for."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def eigenvalues(modes):
    return [complex(float(m["growth_rate_1_per_s"]), 2 * math.pi * float(m["frequency_hz"])) for m in modes]


def largest_difference(of_some, of_others):
    """Relative, of each to the nearest of the others."""
    return max(min(abs(x - y) for y in of_others) / abs(x) for x in of_some)
