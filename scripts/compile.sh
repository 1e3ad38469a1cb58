#!/bin/sh
# What CMake calls in place of the compiler: compile.sh ccache c++ ...
# ccache reads the precompiled header, 0.8 GB, for every file that is compiled or found, five seconds each time. With
# CCACHE_PCH_EXTSUM it takes a checksum beside it instead, which is made here, when the header is.
"$@" || exit
for argument; do
  case $argument in
    *.gch)
      if [ -f "$argument" ]; then sha256sum < "$argument" > "$argument.sum"; fi
      exit
      ;;
  esac
done
