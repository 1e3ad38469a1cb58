#!/usr/bin/env bash
# Is every C++ file laid out as .clang-format says? Exit status: 0 yes, 1 no, 77 clang-format 14 is not there.
#   scripts/check-format.sh          check
#   scripts/check-format.sh --fix    lay out
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Other versions break some lines elsewhere, so only one can be the judge: Debian 12's.
wanted=14
for program in clang-format clang-format-$wanted ""; do
  if [[ -z $program ]]; then
    echo "SKIPPED: clang-format $wanted is missing (package clang-format-$wanted); the layout was not checked."
    exit 77
  fi
  if command -v "$program" > /dev/null && "$program" --version | grep -q "version $wanted\."; then
    break
  fi
done

shopt -s nullglob
files=(source/*.cc source/*/*.cc include/squeal/*/*.h tests/*/*.cc tests/unit/*.h tests/unit/*/*.h tests/unit/*/*.cc)
if [[ ${1:-} == --fix ]]; then
  exec "$program" -i "${files[@]}"
fi

# All files in one call, whose start costs more than most files. One line per file: a page of what is different helps nobody.
if messages=$("$program" --dry-run -Werror "${files[@]}" 2>&1); then
  exit 0
fi
sed -n 's/^\([^:]*\):[0-9]*:[0-9]*: error: .*/\1/p' <<< "$messages" | sort -u |
  sed 's/$/: not laid out as .clang-format says; mend with scripts\/check-format.sh --fix/'
exit 1
