#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/coverage.sh [-h]

Builds the libraries, the program and their tests with gcc's --coverage, runs the tests but the slow
ones, and prints the covered lines of each file of include/ and src/, and of all. Needs gcovr.

  DYNFILTER_BUILD_DIR         folder of the build, default build/coverage
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
if (($# > 0)); then
  usage
  [[ $1 == -h ]] && exit
  exit 2
fi
folder=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/coverage}")
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
readonly folder jobs

need_tool_packages
need_packages gcovr
log "Building with --coverage"
find_configure_options
# The Python module has tests of its own, and is mostly declarations.
cmake -S "$root" -B "$folder" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=None \
  -DCMAKE_CXX_FLAGS="--coverage -O1 -fprofile-update=atomic" -DDYNFILTER_BUILD_EXAMPLES=OFF \
  -DDYNFILTER_BUILD_PYTHON=OFF -DDYNFILTER_BUILD_TOOLS=ON >/dev/null
cmake --build "$folder" -j "$jobs"

log "Running the tests"
failures=0
find "$folder" -name '*.gcda' -delete
(cd "$folder" && ctest -j "$jobs" -LE 'slow|consumers|repository' --output-on-failure) || failures=1

log "Lines"
gcovr --root "$root" --filter "$root/include/" --filter "$root/src/" --exclude "$root/src/python/" \
  --exclude-throw-branches --print-summary --txt "$folder/coverage.txt" -j "$jobs" "$folder" \
  >"$folder/summary.txt"
cat "$folder/coverage.txt"
figure=$(sed -nE 's/^lines: ([0-9.]+%) \(([0-9]+) out of ([0-9]+)\)$/\1 (\2 of \3)/p' \
  "$folder/summary.txt")
echo "lines: $figure"
exit "$failures"
