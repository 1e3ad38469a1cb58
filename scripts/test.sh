#!/usr/bin/env bash
# From a fresh machine to tested: installs, builds, runs all tests. The same script is called by CI.
#   scripts/test.sh [options of ctest]      e.g.  scripts/test.sh -R unit
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/install-dependencies.sh
# deal.II's assertions exist only in Debug mode; the test debug_build runs what is built here.
scripts/build.sh debug
scripts/build.sh release

# Last, so that ctest's summary is the last thing to be read.
exec ctest --preset release -j "$(nproc)" "$@"
