#!/usr/bin/env bash
# From a fresh machine to results: installs, builds (Release) and runs.
#   scripts/run.sh [FILE.prm] [options of squeal]      default: prm/brake.prm
#   scripts/run.sh prm/brake.prm --set "Contact/Friction/Coefficient=0.4"
#   RANKS=4 scripts/run.sh ...                         in parallel by MPI
# Runs in the project's directory: there results land in output/<name of the file>, and there names of files inside
# of FILE.prm (matrices) start.
# Ends with the exit status of squeal: 0 finished, 2 wrong input, 3 a solver failed.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# The file is the first argument that is no option; its name is relative to where the caller stands.
file=
arguments=()
while [[ $# -gt 0 ]]; do
  case $1 in
    --set)
      arguments+=("$1")
      shift
      if [[ $# -gt 0 ]]; then arguments+=("$1"); fi
      ;;
    -*) arguments+=("$1") ;;
    *) if [[ -z $file ]]; then file=$1; else arguments+=("$1"); fi ;;
  esac
  shift
done
if [[ -z $file ]]; then
  file=prm/brake.prm
elif [[ -e $file && $file != /* ]]; then
  file=$PWD/$file
fi
file=${file#"$root"/} # short names in messages

cd "$root"
scripts/install-dependencies.sh
scripts/build.sh release squeal

# The mesh of an example whose Gmsh script came with squeal (in prm/): made if it is missing or older. Scripts of Gmsh
# may start any program: those from elsewhere are not run, but named. Whole paths, since a name may begin with a dash.
mesh=$(sed -n 's/^[[:space:]]*set[[:space:]][[:space:]]*File[[:space:]]*=[[:space:]]*\(.*\.msh\).*/\1/p' "$file" 2> /dev/null || true)
if [[ -n $mesh ]]; then
  mesh=$(realpath -m -- "$mesh")
  script=${mesh%.msh}.geo
  if [[ -e $script && ! $mesh -nt $script ]]; then
    if [[ $(realpath -- "$script") == "$(realpath prm)"/* ]]; then
      command -v gmsh > /dev/null || scripts/install-dependencies.sh --mesh
      gmsh -3 "$script" -o "$mesh" -v 2
    else
      printf 'The mesh is missing or older than %q; if you trust that script: gmsh -3 %q -o %q\n' \
        "$script" "$script" "$mesh" >&2
    fi
  fi
fi

squeal=(build/release/squeal)
ranks=${RANKS:-1}
if [[ $ranks -gt 1 ]]; then
  # One thread per rank. Open MPI by itself refuses root (containers) and more ranks than cores.
  export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  squeal=(mpirun --oversubscribe -np "$ranks" "${squeal[@]}")
fi

status=0
"${squeal[@]}" "$file" "${arguments[@]}" || status=$?

# Where the results are, the program itself knows best.
directory=$(build/release/squeal --check "$file" "${arguments[@]}" 2> /dev/null | sed -n 's/^Results go to //p')
if [[ $directory != /* ]]; then directory=$root/$directory; fi
tables=("modes.csv    one line per mode: growth rate, frequency, verdict"
        "sweep.csv    one line per mode and value" "critical.csv    where modes begin and cease to grow"
        "map.csv    one line per pair of values" "border.csv    the border of stability"
        "samples.csv    one line per sample" "probability.csv    of squeal, in all and by branch"
        "response.csv    amplitudes over frequency")
written=()
for table in "${tables[@]}"; do
  if [[ -e $directory/${table%% *} ]]; then written+=("$table"); fi
done
if [[ $status -eq 0 && ${#written[@]} -gt 0 && " ${arguments[*]} " != *" --check "* ]]; then
  echo
  echo "Look at:"
  # A page that lacks a picture is a page; the script says on the screen what it lacks.
  report=$(python3 scripts/report.py "$directory" || true)
  if [[ -n $report ]]; then
    echo "  $report  the run on one page, for a browser"
  fi
  echo "  $directory/log.txt      what you saw above"
  for table in "${written[@]}"; do
    echo "  $directory/$table"
  done
  for pvd in "$directory"/*.pvd; do
    if [[ -e $pvd ]]; then
      echo "  paraview $pvd"
    fi
  done
  pictures=()
  if [[ -e $directory/modes.csv ]]; then pictures+=("scripts/plot.py $directory"); fi
  if [[ -e $directory/map.csv ]]; then pictures+=("scripts/stability_map.py $directory"); fi
  if compgen -G "$directory/mode-*.pvtu" > /dev/null; then
    pictures+=("xvfb-run -a pvbatch scripts/render_mode.py $directory"
               "xvfb-run -a pvbatch scripts/paraview_state.py $directory    a state for ParaView, ready to play")
  fi
  if [[ ${#pictures[@]} -gt 0 ]]; then
    echo "  Pictures without a display (after scripts/install-dependencies.sh --pictures):"
    printf '  %s\n' "${pictures[@]}"
  fi
fi
exit $status
