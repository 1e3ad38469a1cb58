"""Processor seconds of the tests.

    python3 tests/minutes.py [DIRECTORY]             of the last run of ctest in a build directory (default: build/release)
    python3 tests/minutes.py --cases 30 [DIRECTORY]  and of the 30 longest cases of the Python tests
    python3 tests/minutes.py --run COMMAND ...       runs a test as ctest does, and tells what it took

ctest itself tells how long one waited, which depends on what else the machine does. What is told here is what processors
spent on a test and on all processes that it started and waited for (getrusage)."""

import argparse
import os
import pathlib
import re
import signal
import subprocess
import sys

PROJECT = pathlib.Path(__file__).resolve().parents[1]
LINE = "Processor seconds{}: {:.2f}"  # of a test, or " of Class.test_name"


def run(command):
    """Runs the test; its exit status, as a shell tells it."""
    process = subprocess.Popen(command)
    signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    _, status, usage = os.wait4(process.pid, 0)
    print(LINE.format("", usage.ru_utime + usage.ru_stime), flush=True)
    status = os.waitstatus_to_exitcode(status)
    return status if status >= 0 else 128 - status


def tests(log):
    """{name: (processor seconds, seconds, {case: processor seconds})} from ctest's log of the last run."""
    result = {}
    for block in re.split(r"(?m)^\d+/\d+ Testing: ", log)[1:]:
        name = block.partition("\n")[0]
        own = re.findall(r"(?m)^Processor seconds: ([\d.]+)$", block)
        wall = re.search(r"(?m)^Test time = +([\d.]+) sec", block)
        if own and wall:
            cases = {case: float(seconds) for case, seconds in re.findall(r"Processor seconds of (\S+): ([\d.]+)", block)}
            result[name] = float(own[-1]), float(wall[1]), cases
    return result


def main():
    if sys.argv[1:2] == ["--run"]:
        return run(sys.argv[2:])
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", nargs="?", default=PROJECT / "build/release", type=pathlib.Path)
    parser.add_argument("--cases", type=int, default=0, help="how many cases of the Python tests to print")
    arguments = parser.parse_args()
    log = arguments.directory / "Testing/Temporary/LastTest.log"
    if not log.exists():
        print(f"minutes.py: {log} does not exist: ctest has not run there.", file=sys.stderr)
        return 2
    found = tests(log.read_text(errors="replace"))
    print("processor s   waited s   test")
    for name, (processor, wall, _) in sorted(found.items(), key=lambda item: -item[1][0]):
        print(f"{processor:11.1f} {wall:10.1f}   {name}")
    total = sum(processor for processor, *_ in found.values())
    print(f"{total:11.1f}              {len(found)} tests, {total / 60:.1f} minutes of a processor")
    if arguments.cases:
        print("\nprocessor s   case")
        cases = [(seconds, name, case) for name, (*_, of_test) in found.items() for case, seconds in of_test.items()]
        for seconds, name, case in sorted(cases, reverse=True)[:arguments.cases]:
            print(f"{seconds:11.1f}   {name}: {case}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
