#!/usr/bin/env python3
"""Error bars on brakes with layered pads (shim, lining, plate), against a solution of higher degree.

    layered_pads.py [--brakes soft_shim slot ...] [--degrees 2 3] [--reference-degree 5] [--modes]
                    [--set "Section/Key=value"]...

Eight brakes: shims of 0.05 to 200 GPa and 0.3 to 2 mm, linings of 0.3 to 3 GPa along their normal, a rubber of nu = 0.49,
pads with chamfers and with a slot, a disc with a hat. For each: how many bars hold, how long they are beside the error, how many
corrected values are nearer. The reference is the corrected solution of the highest degree; its accuracy, the median and the
largest of its own bars, is printed, is added to a bar where it is asked whether the bar holds, and bounds errors from
below where they are compared with bars. All eight take a quarter of an hour; references are kept in --cache.
"""

import argparse
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import error_statistics as es  # noqa: E402
import layered_brakes as lp  # noqa: E402
import squeal_testing as st  # noqa: E402

def modes(brake, degree, extra):
    """The lines of modes.csv and the line of cycles.csv."""
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        settings = {**lp.files(brake, directory), **extra, "Discretization/Degree": degree}
        (directory / "run.prm").write_text(st.parameter_file(settings))
        done = st.run("run.prm", directory=directory, timeout=3600)
        if done.returncode != 0:
            sys.exit(f"exit status {done.returncode}\n{done.stdout[-2000:]}{done.stderr}")
        cycle = st.read_table(directory / "output/run/cycles.csv")[-1]
        return st.read_table(directory / "output/run/modes.csv"), cycle


def compare(name, degree, rows, reference):
    """Modes beside the corrected values of the reference, whose accuracy is its own bar."""
    values = [es.corrected(row) for row in reference]
    return [es.KnownTo(name, degree, row, values[partner],
                       complex(reference[partner]["growth_rate_error_1_per_s"],
                               reference[partner]["frequency_error_hz"]))
            for row, partner in es.pair(rows, values)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--brakes", nargs="+", choices=lp.BRAKES, default=list(lp.BRAKES))
    parser.add_argument("--degrees", nargs="+", type=int, default=[2, 3])
    parser.add_argument("--reference-degree", type=int, default=5)
    parser.add_argument("--cache", type=pathlib.Path, help="directory for the references' tables")
    parser.add_argument("--modes", action="store_true")
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()
    extra = dict(pair.split("=", 1) for pair in arguments.set)

    comparisons = []
    print(f"{'brake':12s} degree  unknowns  seconds  eigenproblem  bars", flush=True)
    for name in arguments.brakes:
        brake = lp.BRAKES[name]

        def run(degree, window=1.0, name=name, brake=brake):
            rows, cycle = modes(brake, degree, {**extra, "Eigenproblem/Maximum frequency": lp.WINDOW * window})
            print(f"{name:12s} {degree:6d} {cycle['dofs']:9.0f} {cycle['seconds_total']:8.1f} "
                  f"{cycle['seconds_eigenproblem']:14.1f} {cycle['seconds_estimate']:5.1f}", flush=True)
            return rows

        kept = arguments.cache and arguments.cache / f"{name}_{arguments.reference_degree}.csv"
        if kept and kept.exists():
            reference = st.read_table(kept)
        else:
            reference = run(arguments.reference_degree, 1.02)
            if kept:
                arguments.cache.mkdir(parents=True, exist_ok=True)
                keys = [key for key, value in reference[0].items() if isinstance(value, (int, float))]
                lines = [",".join(keys)] + [",".join("" if row[key] is None else f"{row[key]:.17g}" for key in keys)
                                            for row in reference]
                kept.write_text("\n".join(lines) + "\n")
        for degree in arguments.degrees:
            found = compare(name, degree, run(degree), reference)
            comparisons += found
            if arguments.modes:
                print(es.mode_table(found))
    print(es.table(comparisons))
    for quantity, unit in (("frequency", "Hz"), ("growth", "1/s")):
        print(f"{quantity} bars beyond 10 times the error: {100 * es.share_beyond(10, comparisons, quantity):.1f} %")
        accuracies = sorted(getattr(c, f"{quantity}_accuracy") for c in comparisons)
        print(f"reference's {quantity} bars: median {accuracies[len(accuracies) // 2]:.2g} {unit}, "
              f"largest {accuracies[-1]:.2g} {unit}")


if __name__ == "__main__":
    main()
