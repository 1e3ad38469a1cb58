#!/usr/bin/env bash
# Makes the code's documentation: build/doxygen/html/index.html. Installs doxygen if it is missing (Debian).
# Says how many warnings there are; they are in build/doxygen/warnings.txt. Exit status: 0, or 1 if doxygen fails or
# is missing. Formulas are drawn by MathJax, which the browser fetches.
#   scripts/doxygen.sh              make it
#   scripts/doxygen.sh --strict     1 if there are warnings, too
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

strict=0
for option in "$@"; do
  case $option in
    --strict) strict=1 ;;
    *)
      echo "usage: ${0##*/} [--strict]" >&2
      exit 2
      ;;
  esac
done

command -v doxygen > /dev/null || scripts/install-dependencies.sh --doxygen
if ! command -v doxygen > /dev/null; then
  echo "doxygen is missing; please install it." >&2
  exit 1
fi
mkdir -p build/doxygen
doxygen doc/Doxyfile

# Some are repeated for every page on which the comment appears.
warnings=$(grep -E ': (warning|error): ' build/doxygen/warnings.txt | sort -u | sed "s|^$PWD/||" || true)
number=$(printf '%s' "$warnings" | grep -c . || true)
if [[ $number -gt 0 ]]; then
  printf '%s\n' "$warnings"
fi
echo "build/doxygen/html/index.html: $number warnings"
[[ $strict -eq 0 || $number -eq 0 ]]
