#!/usr/bin/env bash
# Installs what is needed to build, run and test, on Debian 12 or 13 (as root, or with sudo). Where everything is
# installed it does nothing. Without apt it names what is missing and ends with 1.
#   scripts/install-dependencies.sh              compiler, deal.II, MPI, OpenBLAS, test tools
#   scripts/install-dependencies.sh --pictures   also ParaView and matplotlib, to make pictures without a display
#   scripts/install-dependencies.sh --mesh       also Gmsh, to make the mesh of prm/realistic_brake.prm
#   scripts/install-dependencies.sh --tests      also scipy, to read its matrices, venv, to install the Python package, and
#                                                what --package brings
#   scripts/install-dependencies.sh --package    also what scripts/package.sh needs
#   scripts/install-dependencies.sh --doxygen    also doxygen, for scripts/doxygen.sh
set -euo pipefail

packages=(
  g++ cmake ninja-build
  ccache              # makes building again quick
  libdeal.ii-dev      # brings PETSc, SLEPc, MUMPS, Trilinos, p4est
  libslepc-real-dev   # deal.II is built with the real one; the complex one must not be linked beside it
  libopenblas0-pthread # the reference BLAS is three times slower
  openmpi-bin
  doctest-dev python3 # tests
)
for option in "$@"; do
  case $option in
    --pictures) packages+=(paraview python3-paraview xvfb xauth python3-numpy python3-matplotlib) ;;
    --mesh) packages+=(gmsh) ;;
    --tests) packages+=(python3-numpy python3-scipy python3-venv dpkg-dev file) ;;
    --package) packages+=(dpkg-dev file) ;;
    --doxygen) packages+=(doxygen) ;;
    *)
      echo "usage: ${0##*/} [--pictures] [--mesh] [--tests] [--package] [--doxygen]" >&2
      exit 2
      ;;
  esac
done

# A machine of another kind: look for the things themselves.
if ! command -v dpkg-query > /dev/null || ! command -v apt-get > /dev/null; then
  missing=()
  for program in c++ cmake ninja mpirun python3; do
    command -v "$program" > /dev/null || missing+=("$program")
  done
  if [[ -z ${DEAL_II_DIR:-} && ! -e /usr/include/deal.II/base/config.h && ! -e /usr/local/include/deal.II/base/config.h ]]; then
    missing+=("deal.II 9.4 or later with MPI, p4est, PETSc, SLEPc, Trilinos, LAPACK (tell where by DEAL_II_DIR)")
  fi
  if [[ ${#missing[@]} -gt 0 ]]; then
    {
      echo "This machine has no apt. Please install what is missing:"
      printf '  %s\n' "${missing[@]}"
      echo "On Debian 12 the packages are: ${packages[*]}"
    } >&2
    exit 1
  fi
  exit 0
fi

installed() {
  [[ $(dpkg-query -W -f '${db:Status-Status}' "$1" 2> /dev/null) == installed ]]
}
# Debian 13's deal.II exports flags that ask for the linker mold, which it does not bring.
needs_mold() {
  installed libdeal.ii-dev && ! command -v mold > /dev/null &&
    dpkg -L libdeal.ii-dev | grep -E 'deal\.II.*\.cmake$' | xargs -r grep -qs -e '-fuse-ld=mold'
}

missing=()
for package in "${packages[@]}"; do
  if ! installed "$package"; then
    missing+=("$package")
  fi
done
if needs_mold; then missing+=(mold); fi
if [[ ${#missing[@]} -eq 0 ]]; then
  exit 0
fi

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  if ! command -v sudo > /dev/null; then
    echo "Missing packages: ${missing[*]}" >&2
    echo "Installing them needs root, and there is no sudo. As root: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

echo "Installing: ${missing[*]}"
apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=600 "$@"
}
install() {
  apt install --no-install-recommends "${missing[@]}"
}

# The package lists are fetched only if they do not know a package, or if what they name is no longer there.
known=true
for package in "${missing[@]}"; do
  if ! LC_ALL=C apt-cache policy "$package" 2> /dev/null | grep -q 'Candidate: [^(]'; then known=false; fi
done
$known || apt update
install || { apt update && install; }

if needs_mold; then
  missing=(mold)
  install
fi
