#!/usr/bin/env bash
# Makes the Debian package of what is built: squeal_VERSION_ARCHITECTURE.deb.
#   scripts/build.sh release squeal && scripts/package.sh [DIRECTORY]      default: build
# Needs dpkg-dev and file: scripts/install-dependencies.sh --package. Install it with  apt-get install ./squeal_*.deb  on the Debian release where it was made.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
cpack --config build/release/CPackConfig.cmake -B "$(realpath -m "${1:-build}")" > /dev/null
rm -rf "${1:-build}/_CPack_Packages"
ls "${1:-build}"/squeal_*.deb
