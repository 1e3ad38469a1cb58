#!/usr/bin/env bash
# Configures and builds; the second time only what has changed.
#   scripts/build.sh [release|debug|asan] [target...]      default: release, everything
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
preset=${1:-release}
if [[ $# -gt 0 ]]; then shift; fi

# A directory that was moved or copied here knows other places: CMake would refuse it.
cache=build/$preset/CMakeCache.txt
configured=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$cache" 2> /dev/null || true)
if [[ -n $configured && $(realpath -m "$configured") != "$(realpath .)" ]]; then
  echo "build/$preset was configured in $configured; it is configured anew, and everything is built again." >&2
  rm -rf "$cache" "build/$preset/CMakeFiles"
fi

# Words of success are not worth reading, errors are.
if ! messages=$(cmake --preset "$preset" 2>&1); then
  echo "$messages" >&2
  exit 1
fi
# One compiler per core: each needs up to 1 GB, and Ninja alone would start two more. OMP_NUM_THREADS is about squeal's
# threads, yet nproc listens to it.
exec cmake --build --preset "$preset" -j "$(env -u OMP_NUM_THREADS nproc)" ${@:+--target "$@"}
