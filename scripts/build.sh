#!/usr/bin/env bash
# Configures and builds; the second time only what has changed.
#   scripts/build.sh [release|debug|asan] [target...]      default: release, everything
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
preset=${1:-release}
if [[ $# -gt 0 ]]; then shift; fi

# Words of success are not worth reading, errors are.
if ! messages=$(cmake --preset "$preset" 2>&1); then
  echo "$messages" >&2
  exit 1
fi
# One compiler per core: each needs up to 1 GB, and Ninja alone would start two more. OMP_NUM_THREADS is about squeal's
# threads, yet nproc listens to it.
exec cmake --build --preset "$preset" -j "$(env -u OMP_NUM_THREADS nproc)" ${@:+--target "$@"}
