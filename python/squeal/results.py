"""Tables, parameters, matrices and shapes of a run's directory."""

import csv
import os
import pathlib

import numpy

from . import vtu
from .shapes import Shape


class DamagedError(ValueError):
    """A file of a run is not as squeal writes it; the text says which."""


def open_text(path):
    """Opens a file for reading. Raises DamagedError for what is no regular file: a pipe would wait for ever."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise DamagedError(f"{path} is not a regular file")
    return open(path, newline="", encoding="utf-8-sig", errors="replace")


def text_of(path):
    with open_text(path) as file:
        return file.read()


def read(directory):
    """The results in the output directory of a run, finished or not."""
    return Results(directory)


def read_table(path):
    """A CSV file as a structured array: a field for each column, numbers where all of it are numbers (an empty field is
    nan), else texts. table["frequency_hz"], table[table["verdict"] == "flutter"], pandas.DataFrame(table)."""
    try:
        with open_text(path) as file:
            lines = list(csv.reader(line.replace("\0", "\N{REPLACEMENT CHARACTER}") for line in file))
    except csv.Error as error:
        raise DamagedError(f"{path}: {error}") from None
    header = lines.pop(0) if lines else []
    if not header or "" in header or len(set(header)) < len(header):
        raise DamagedError(f"{path}: the first line does not name columns, each by a name of its own")
    # A line that a running or killed program has not finished is none.
    lines = [line for line in lines if len(line) == len(header)]
    columns = []
    for i in range(len(header)):
        texts = [line[i] for line in lines]
        try:
            column = numpy.array([float(text) if text else numpy.nan for text in texts], float)
            if header[i] in ("cycle", "mode", "branch") and (numpy.abs(column) < 2**53).all():
                column = column.astype(int)
        except ValueError:
            column = numpy.array(texts, str)
        if not lines:
            column = numpy.array([], float)
        columns.append(column)
    table = numpy.empty(len(lines), dtype=[(name, column.dtype) for name, column in zip(header, columns)])
    for name, column in zip(header, columns):
        table[name] = column
    return table


class Results:
    """What a run has written. Files are read when they are asked for."""

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        if not (self.directory / "log.txt").is_file():
            raise FileNotFoundError(f"{directory} is no output directory of a run: log.txt is missing")

    def __repr__(self):
        return f"squeal.Results({os.fspath(self.directory)!r})"

    def table(self, name):
        """A table by its name: table("sweep") is sweep.csv."""
        return read_table(self.directory / f"{name}.csv")

    @property
    def modes(self):
        """modes.csv of the last mesh. Raises DamagedError where a column that every such table has is missing, or has
        other things than numbers."""
        table = self.table("modes")
        for name in ("cycle", "mode", "growth_rate_1_per_s", "frequency_hz"):
            if name not in table.dtype.names or table[name].dtype.kind not in "if":
                raise DamagedError(f"{self.directory / 'modes.csv'} has no numbers in a column {name}")
            if numpy.isnan(table[name]).any():
                raise DamagedError(f"{self.directory / 'modes.csv'} has an empty field in the column {name}")
        return table[table["cycle"] == table["cycle"].max()] if len(table) else table

    @property
    def eigenvalues(self):
        """growth rate + i 2 pi frequency of the modes, 1/s."""
        modes = self.modes
        return modes["growth_rate_1_per_s"] + 2j * numpy.pi * modes["frequency_hz"]

    @property
    def log(self):
        return text_of(self.directory / "log.txt")

    @property
    def parameters(self):
        """All parameters of the run as {"Section/Key": text}."""
        found, section = {}, []
        for line in text_of(self.directory / "parameters.prm").splitlines():
            words = line.split("#")[0].split()
            if words[:1] == ["subsection"]:
                section.append(" ".join(words[1:]))
            elif words == ["end"] and section:
                section.pop()
            elif words[:1] == ["set"] and "=" in words:
                key, value = " ".join(words[1:]).split("=", 1)
                found["/".join([*section, key.strip()])] = value.strip()
        return found

    def matrix(self, name):
        """A Matrix Market file of a run with Output/Matrices = true, as scipy's CSC matrix: "M", "P", "Q" of
        (l^2 M + l P + Q) x = 0, a "term-...". Dense files (right_vectors, eigenvalues) are numpy arrays."""
        import scipy.io
        path = self.directory / f"{name}.mtx"
        if not path.is_file():
            raise FileNotFoundError(f"{path} is missing; a run with Output/Matrices = true writes it")
        try:
            matrix = scipy.io.mmread(str(path))
        except (ValueError, TypeError, IndexError, OverflowError) as error:
            raise DamagedError(f"{path} is no Matrix Market file: {error}") from None
        return matrix.tocsc() if hasattr(matrix, "tocsc") else matrix

    def matrices(self):
        """M, P and Q."""
        return tuple(self.matrix(name) for name in "MPQ")

    def written_modes(self, cycle=None):
        """The numbers of the modes whose fields were written (Output/Fields), of the last such mesh."""
        names = [path.name.split(".")[0].split("-") for path in self.directory.glob("mode-*-*.pvtu")]
        found = {(int(words[1]), int(words[2])) for words in names if len(words) == 3 and words[1].isdecimal() and
                 words[2].isdecimal()}
        if not found:
            return []
        cycle = max(of for of, _ in found) if cycle is None else cycle
        return sorted(mode for of, mode in found if of == cycle)

    def shape(self, mode, cycle=None):
        """The displacement of a mode at the nodes of all bodies; needs a run whose Output/Fields has it."""
        modes = self.modes if cycle is None else ()
        if cycle is None and not len(modes):
            raise FileNotFoundError(f"{self.directory / 'modes.csv'} has no modes, so that none has a shape")
        of = int(modes["cycle"][0]) if cycle is None else cycle
        path = self.directory / f"mode-{of}-{mode:03d}.pvtu"
        if not path.is_file():
            raise FileNotFoundError(f"{path} is missing; written are the modes {self.written_modes(of)}. A run with "
                                    "Output/Fields = all writes every mode.")
        try:
            points, fields = vtu.read(path)
            return Shape(points, fields["displacement_re_m"] + 1j * fields["displacement_im_m"], fields["body"])
        except (FileNotFoundError, DamagedError):
            raise
        except Exception as error:  # of text, base64, zlib, XML, sizes: each has its own
            raise DamagedError(f"{path}, or a piece of it, is not as squeal writes it: {error!r}") from None

    def shapes(self, modes=None):
        """The shapes of these modes, or of all that were written."""
        return [self.shape(mode) for mode in (self.written_modes() if modes is None else modes)]
