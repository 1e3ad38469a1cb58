#!/usr/bin/env python3
"""Error bars against the true errors of T3 to T6 (reference.md) on adaptively refined meshes.

    error_bars.py [--tables T3 T6] [--cycles 3] [--ranks 1] [--modes] [--set "Section/Key=value"]...

Prints the statistics of all modes and meshes; with --modes each mode's bars and true errors too. Four tables and
three meshes take some minutes.
"""

import argparse
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import error_statistics as es  # noqa: E402
import squeal_testing as st  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tables", nargs="+", choices=sorted(es.TABLES), default=sorted(es.TABLES))
    parser.add_argument("--cycles", type=int, default=3)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--modes", action="store_true")
    parser.add_argument("--set", action="append", default=[])
    arguments = parser.parse_args()

    comparisons = []
    for name in arguments.tables:
        settings = es.settings(name, **es.ADAPTIVE, **{"Refinement/Cycles": arguments.cycles})
        settings.update(pair.split("=", 1) for pair in arguments.set)
        with tempfile.TemporaryDirectory() as directory:
            file = pathlib.Path(directory) / "run.prm"
            file.write_text(st.parameter_file(settings))
            done = st.run(file.name, ranks=arguments.ranks, directory=directory, timeout=3600)
            if done.returncode != 0:
                sys.exit(f"{name}: exit status {done.returncode}\n{done.stdout[-2000:]}{done.stderr}")
            results = pathlib.Path(directory) / "output/run"
            found = es.compare(name, st.read_table(results / "modes.csv"))
            for cycle in st.read_table(results / "cycles.csv"):
                print(f"{name} mesh {cycle['cycle']:.0f}: {cycle['cells']:.0f} cells, {cycle['dofs']:.0f} unknowns, "
                      f"{cycle['seconds_total']:.1f} s, of this error bars {cycle['seconds_estimate']:.1f} s, "
                      f"{cycle['memory_mib']:.0f} MiB", flush=True)
        if arguments.modes:
            print(es.mode_table(found))
        comparisons += found
    print(es.table(comparisons))


if __name__ == "__main__":
    main()
