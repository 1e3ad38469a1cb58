"""Error bars against the true errors, by the reference tables: shared by test_error_bars.py and benchmark/."""

import dataclasses
import math

import mesh_files
import squeal_testing as st

# reference.md: the stated accuracy of the tables, relative for frequencies; for growth rates relative or 1/s,
# whichever is larger. Stage transport is conservative: its growth rates are zero.
FREQUENCY_ACCURACY = {"T3": 2e-7, "T4": 2e-7, "T5": 5e-7, "T6": 2e-7, "T10": 6e-6, "T11": 6e-6}
GROWTH_ACCURACY = (1e-4, 2e-3)

# Damping of theory.md, section 12, in the stage full: 25 modes below 6350 Hz.
WITHOUT_RAYLEIGH = {"Rotor/Material/Stiffness proportional damping": 0, "Pads/Material/Stiffness proportional damping": 0,
                    "Eigenproblem/Maximum frequency": 6350}
PRONY_T11 = f"0.2 : {1 / (2 * math.pi * 500)!r}, 0.3 : {1 / (2 * math.pi * 4000)!r}"
TABLES = {
    "T3": ("brake_T3_transport_k1e12.csv", {"Stage": "transport", "Contact/Friction/Coefficient": 0}),
    "T4": ("brake_T4_friction_k1e12.csv", {"Stage": "friction"}),
    "T5": ("brake_T5_friction_damping_k1e12.csv", {"Stage": "friction_damping"}),
    "T6": ("brake_T6_full_k1e12.csv", {"Stage": "full"}),
    "T10": ("brake_T10_loss_factor_k1e12.csv",
            {**WITHOUT_RAYLEIGH, "Rotor/Material/Loss factor": 0.004, "Pads/Material/Loss factor": 0.06}),
    "T11": ("brake_T11_prony_k1e12.csv",
            {**WITHOUT_RAYLEIGH, "Rotor/Material/Stiffness proportional damping": 1e-7,
             "Pads/Material/Prony series": PRONY_T11}),
}
MESH = {
    "Discretization/Degree": 2,
    "Discretization/Rotor cells": "5, 36, 1",
    "Discretization/Pad cells": "3, 6, 1",
    "Discretization/Clamp layers": 1,
}
ADAPTIVE = {"Refinement/Strategy": "adaptive", "Refinement/Tolerance": 1e-3}


def brake_of(table):
    return {**st.REFERENCE_BRAKE, **st.PENALTY, **TABLES[table][1]}


def settings(table, **refinement):
    return {**brake_of(table), **MESH, **refinement}


def settings_of_file(table, file, degree):
    """The same brake on a mesh of its own."""
    return {**brake_of(table), **mesh_files.SCENE, "Mesh/File": file, "Mesh/Curved bodies": "rotor",
            "Discretization/Degree": degree}


def assign(costs):
    """For each row of a cost matrix its column in the assignment with the least sum, None where there are fewer
    columns than rows and none is left (shortest augmenting paths; Jonker and Volgenant, 1987)."""
    n_rows, n_columns = len(costs), len(costs[0]) if costs else 0
    n = max(n_rows, n_columns)
    cost = [[costs[i][j] if i < n_rows and j < n_columns else 0.0 for j in range(n)] for i in range(n)]
    row_price, column_price, row_of = [0.0] * n, [0.0] * (n + 1), [None] * (n + 1)
    for row in range(n):
        row_of[n], column = row, n  # column n: a place to start from
        shortest, previous, done = [math.inf] * n, [n] * n, [False] * (n + 1)
        while row_of[column] is not None:
            done[column], i = True, row_of[column]
            for j in range(n):
                if not done[j]:
                    reduced = cost[i][j] - row_price[i] - column_price[j]
                    if reduced < shortest[j]:
                        shortest[j], previous[j] = reduced, column
            following = min((j for j in range(n) if not done[j]), key=shortest.__getitem__)
            delta = shortest[following]
            for j in range(n + 1):
                if done[j]:
                    row_price[row_of[j]] += delta
                    column_price[j] -= delta
                elif j < n:
                    shortest[j] -= delta
            column = following
        while column != n:
            row_of[column] = row_of[previous[column]]
            column = previous[column]
    partner = [None] * n_rows
    for j in range(n_columns):
        if row_of[j] < n_rows:
            partner[row_of[j]] = j
    return partner


def corrected(row):
    return complex(row["corrected_growth_rate_1_per_s"], 2 * math.pi * row["corrected_frequency_hz"])


@dataclasses.dataclass
class Comparison:
    """One mode of one mesh beside its partner in the reference. Frequencies in Hz, growth rates in 1/s."""

    table: str
    cycle: int
    row: dict
    reference: complex

    @property
    def frequency_accuracy(self):
        return FREQUENCY_ACCURACY[self.table] * abs(self.reference) / (2 * math.pi)

    @property
    def growth_accuracy(self):
        if self.table == "T3":
            return 1e-9 * abs(self.reference)  # the solver's tolerance
        if self.table in ("T10", "T11"):
            return FREQUENCY_ACCURACY[self.table] * abs(self.reference)
        return max(GROWTH_ACCURACY[0] * abs(self.reference.real), GROWTH_ACCURACY[1])

    @property
    def frequency_error(self):
        return abs(self.row["frequency_hz"] - self.reference.imag / (2 * math.pi))

    @property
    def growth_error(self):
        return abs(self.row["growth_rate_1_per_s"] - self.reference.real)

    @property
    def is_contradicted(self):
        """Whether the reference says the opposite of the verdict, beyond its own accuracy."""
        growth, accuracy = self.reference.real, self.growth_accuracy
        return (self.row["verdict"] == "stable" and growth > accuracy
                or self.row["verdict"] in ("flutter", "divergence") and growth < -accuracy)

    @property
    def is_improved(self):
        computed, better = abs(st.eigenvalue(self.row) - self.reference), abs(corrected(self.row) - self.reference)
        return better <= max(computed, self.frequency_accuracy)


@dataclasses.dataclass
class KnownTo(Comparison):
    """A mode beside one of another run, which is known to an accuracy: of the growth rate, 1/s, and j times the frequency's,
    Hz."""

    accuracy: complex = 0

    @property
    def frequency_accuracy(self):
        return self.accuracy.imag

    @property
    def growth_accuracy(self):
        return self.accuracy.real


def pair(rows, values):
    """Lines of modes.csv, each with the number of its partner among the eigenvalues, by their corrected ones."""
    partners = assign([[abs(corrected(row) - value) ** 2 for value in values] for row in rows])
    return [(row, partner) for row, partner in zip(rows, partners) if partner is not None]


def compare(table, rows):
    """The modes of all meshes (lines of modes.csv), paired with the reference by their corrected eigenvalues."""
    reference = st.reference_eigenvalues(TABLES[table][0])
    result = []
    for cycle in sorted({row["cycle"] for row in rows}):
        of_cycle = [row for row in rows if row["cycle"] == cycle]
        result += [Comparison(table, int(cycle), row, reference[partner]) for row, partner in pair(of_cycle, reference)]
    return result


@dataclasses.dataclass
class Statistics:
    modes: int
    covered: dict  # quantity: number of bars that cover the true error
    wide: dict  # quantity: number of bars more than WIDE times the true error
    median: dict  # quantity: median of bar / true error
    contradicted: int
    improved: int
    undecided: int


WIDE = 5


def bars_beside_errors(comparisons, quantity):
    """Bar, true error and the accuracy to which that is known, of "frequency" or "growth"."""
    if quantity == "frequency":
        return [(c.row["frequency_error_hz"], c.frequency_error, c.frequency_accuracy) for c in comparisons]
    return [(c.row["growth_rate_error_1_per_s"], c.growth_error, c.growth_accuracy) for c in comparisons]


def n_beyond(factor, triples):
    """The number of bars more than that many times the true error."""
    return sum(bar > factor * max(error, accuracy) for bar, error, accuracy in triples)


def share_beyond(factor, comparisons, quantity):
    """The share of bars more than that many times the true error."""
    return n_beyond(factor, bars_beside_errors(comparisons, quantity)) / len(comparisons)


def statistics(comparisons):
    """The true error is known to the reference's accuracy only: that is added to the bar for covering, and a true
    error below it counts as large as it."""
    covered, wide, median = {}, {}, {}
    for quantity in ["frequency", "growth"]:
        triples = bars_beside_errors(comparisons, quantity)
        covered[quantity] = sum(bar + accuracy >= error for bar, error, accuracy in triples)
        wide[quantity] = n_beyond(WIDE, triples)
        ratios = sorted(bar / max(error, accuracy) for bar, error, accuracy in triples)
        median[quantity] = ratios[len(ratios) // 2]
    return Statistics(len(comparisons), covered, wide, median, sum(c.is_contradicted for c in comparisons),
                      sum(c.is_improved for c in comparisons),
                      sum(c.row["verdict"] == "undecided" for c in comparisons))


HEADER = ("table  mesh  modes   frequency: covered  > 5 times  median   growth rate: covered  > 5 times  median"
          "   nearer  undecided  contradicted")


def line(name, cycle, comparisons):
    s = statistics(comparisons)
    percent = lambda part: f"{100 * part / s.modes:5.1f} %"
    return (f"{name:5s}  {cycle!s:>4s}  {s.modes:5d}            {percent(s.covered['frequency'])}    "
            f"{percent(s.wide['frequency'])}  {s.median['frequency']:6.2f}              "
            f"{percent(s.covered['growth'])}    {percent(s.wide['growth'])}  {s.median['growth']:6.2f}  "
            f"{percent(s.improved)}  {s.undecided:9d}  {s.contradicted:12d}")


def table(comparisons):
    """Statistics by table and mesh, and of everything; growth rates of T3, all zero, stay out of the last line."""
    lines = [HEADER]
    for name in sorted({c.table for c in comparisons}):
        of_table = [c for c in comparisons if c.table == name]
        for cycle in sorted({c.cycle for c in of_table}):
            lines.append(line(name, cycle, [c for c in of_table if c.cycle == cycle]))
    lines.append(line("all", "all", comparisons))
    damped = [c for c in comparisons if c.table != "T3"]
    if len(damped) < len(comparisons) and damped:
        lines.append(line("T4-T6", "all", damped))
    return "\n".join(lines)


def mode_table(comparisons):
    """Each mode's bars and true errors."""
    lines = ["mesh  reference, Hz      1/s        frequency error  bar        corrected    growth error    bar"
             "       corrected   verdict"]
    for c in comparisons:
        better = corrected(c.row)
        lines.append(f"{c.cycle:4d}  {c.reference.imag / (2 * math.pi):13.4f} {c.reference.real:10.4f}   "
                     f"{c.frequency_error:12.5f} {c.row['frequency_error_hz']:12.5f} "
                     f"{abs(better.imag - c.reference.imag) / (2 * math.pi):12.5f}   "
                     f"{c.growth_error:10.5f} {c.row['growth_rate_error_1_per_s']:10.5f} "
                     f"{abs(better.real - c.reference.real):10.5f}   {c.row['verdict']}")
    return "\n".join(lines)
