#!/usr/bin/env bash
# Builds and tests squeal on Debian 13 (trixie), in a directory that holds a whole Debian 13. Needs root and debootstrap.
#   scripts/debian13.sh DIRECTORY [modes.csv]
# Makes DIRECTORY if it is not there, copies this checkout into it, installs what scripts/install-dependencies.sh names,
# builds, passes `ctest -L quick`, and runs prm/brake.prm, whose table ends in DIRECTORY/root/squeal/output/brake/modes.csv.
# With the modes.csv of a run here: compares eigenvalues and verdicts, which must agree to 9 digits.
# Packages come from the mirror that apt of this machine is set to. A second call goes on with the same DIRECTORY.
# Removing DIRECTORY afterwards is up to you; nothing is left mounted in it.
set -euo pipefail
usage="usage: ${0##*/} DIRECTORY [modes.csv of prm/brake.prm here]"
root=${1:?$usage}
table=${2:-}
if [[ $# -gt 2 ]]; then
  echo "$usage" >&2
  exit 2
fi
if [[ $(id -u) -ne 0 ]]; then
  echo "${0##*/} needs root: debootstrap, mount and chroot." >&2
  exit 1
fi
if ! command -v debootstrap > /dev/null; then
  echo "${0##*/} needs debootstrap: apt-get install debootstrap" >&2
  exit 1
fi
if [[ -n $table ]]; then table=$(realpath "$table"); fi
project=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

if [[ ! -e $root/etc/debian_version ]]; then
  mirror=$(apt-get indextargets --format '$(REPO_URI) $(COMPONENT)' 'Created-By: Packages' |
    awk '$2 == "main" && $1 ~ /debian\/?$/ { print $1; exit }')
  if [[ -z $mirror ]]; then
    echo "apt of this machine names no mirror of Debian (apt-get update fetches its lists)." >&2
    exit 1
  fi
  mkdir -p "$root"
  debootstrap --variant=minbase trixie "$root" "$mirror" > "$root.log" || {
    echo "debootstrap failed: see $root.log" >&2
    exit 1
  }
  rm "$root.log"
fi
root=$(realpath "$root")
# What this machine tells apt (proxies, dates), and where names of hosts are looked up.
find /etc/apt/apt.conf.d -type f -exec grep -hE '^Acquire::' {} + > "$root/etc/apt/apt.conf.d/99of-the-host" || true
cp /etc/resolv.conf "$root/etc/resolv.conf"

# Unmounted whatever happens, the last first.
mounted=()
unmount() {
  for ((i = ${#mounted[@]} - 1; i >= 0; --i)); do
    umount "${mounted[i]}" || umount -l "${mounted[i]}"
  done
  mounted=()
}
trap unmount EXIT
mount_in() {
  mount "${@:1:$#-1}" "$root/${!#}"
  mounted+=("$root/${!#}")
}
mount_in -t proc proc proc
mount_in -t sysfs -o ro sysfs sys
mount_in -t tmpfs -o mode=755 tmpfs dev
mkdir "$root/dev/shm" "$root/dev/pts"
ln -s /proc/self/fd "$root/dev/fd"
for device in null zero full random urandom tty; do
  touch "$root/dev/$device"
  mount_in --bind "/dev/$device" "dev/$device"
done
mount_in -t tmpfs tmpfs dev/shm
mount_in -t devpts -o newinstance,ptmxmode=0666 devpts dev/pts
ln -sf pts/ptmx "$root/dev/ptmx"

# The files of the checkout; those that did not change keep their times, so that little is built again.
mkdir -p "$root/root/squeal"
git -C "$project" ls-files -z --cached --others --exclude-standard |
  while IFS= read -r -d '' file; do
    if [[ -f $project/$file ]] && ! cmp -s "$project/$file" "$root/root/squeal/$file"; then
      mkdir -p "$(dirname "$root/root/squeal/$file")"
      cp -p "$project/$file" "$root/root/squeal/$file"
      touch "$root/root/squeal/$file"
    fi
  done
# Files that were removed here must not be compiled there.
(cd "$root/root/squeal" && find source include tests -type f -print0) |
  while IFS= read -r -d '' file; do
    if [[ ! -e $project/$file ]]; then rm "$root/root/squeal/$file"; fi
  done

inside() {
  chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
    ${JOBS:+JOBS="$JOBS"} bash -euo pipefail -c "cd /root/squeal; $1"
}
inside 'scripts/install-dependencies.sh'
inside 'scripts/build.sh release'
inside 'build/release/squeal --version'
inside 'ctest --preset release -L quick -j "$(nproc)"'
inside 'OMP_NUM_THREADS=1 build/release/squeal prm/brake.prm'

if [[ -n $table ]]; then
  python3 - "$table" "$root/root/squeal/output/brake/modes.csv" << 'PYTHON'
import csv
import math
import sys

here, there = (list(csv.DictReader(open(name, newline=""))) for name in sys.argv[1:])
if [row["verdict"] for row in here] != [row["verdict"] for row in there]:
    sys.exit("The numbers of modes or their verdicts differ.")
eigenvalues = [[complex(float(row["growth_rate_1_per_s"]), 2 * math.pi * float(row["frequency_hz"])) for row in rows]
               for rows in (here, there)]
largest = max(abs(a - b) / abs(a) for a, b in zip(*eigenvalues))
print(f"{len(here)} modes with equal verdicts; eigenvalues differ by {largest:.1e} at most.")
sys.exit(not largest <= 1e-9)
PYTHON
fi
