#!/usr/bin/env bash
# From a fresh machine to tested: installs, builds, runs all tests. The same script is called by CI.
#   scripts/test.sh [options of ctest]      e.g.  scripts/test.sh -R unit
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# In continuous integration no test skips for a missing tool: Gmsh, matplotlib, ParaView, scipy belong to it.
tools=()
if [[ ${CI:-} == true ]]; then tools=(--mesh --pictures --tests); fi
scripts/install-dependencies.sh ${tools[@]+"${tools[@]}"}
# deal.II's assertions exist only in Debug mode; the test debug_build runs what is built here.
scripts/build.sh debug
scripts/build.sh release

# Last, so that ctest's summary is the last thing to be read.
exec ctest --preset release -j "$(nproc)" "$@"
