#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/coverage.sh [--readme] [--no-build] [--no-tests] [-h]

Builds the libraries, the program and their tests with gcc's --coverage, runs the tests but the slow
ones, and prints the covered lines of each file of include/ and src/, and of all, and how many of the
test programs ran to their end there. Needs gcovr.

  --readme    put the figure into the table of tests/README.md
  --no-build  run what is built
  --no-tests  count what ran before

  DYNFILTER_BUILD_DIR         folder of the build, default build/coverage
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
# shellcheck source-path=SCRIPTDIR source=figures.sh
source "$root/tests/figures.sh"
readme=no
build=yes
tests=yes
while (($# > 0)); do
  case "$1" in
    --readme) readme=yes ;;
    --no-build) build=no ;;
    --no-tests) tests=no ;;
    -h | --help)
      usage
      exit
      ;;
    *)
      usage >&2
      exit 2
      ;;
  esac
  shift
done
readonly readme build tests
folder=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/coverage}")
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
readonly folder jobs

need_tool_packages
need_packages gcovr
if [[ $build == yes ]]; then
  log "Building with --coverage"
  find_configure_options
  # The Python module has tests of its own, and is mostly declarations.
  cmake -S "$root" -B "$folder" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=None \
    -DCMAKE_CXX_FLAGS="--coverage -O1 -fprofile-update=atomic" -DDYNFILTER_BUILD_EXAMPLES=OFF \
    -DDYNFILTER_BUILD_PYTHON=OFF -DDYNFILTER_BUILD_TOOLS=ON >/dev/null
  cmake --build "$folder" -j "$jobs"
fi

failures=0
if [[ $tests == yes ]]; then
  # A program writes its counters at its end, also when it only lists its tests, which ctest makes it
  # do once after each build. Those of a listing, or of an earlier call, say nothing of this one.
  (cd "$folder" && ctest -N >/dev/null)
  find "$folder" -name '*.gcda' -delete
  log "Running the tests"
  (cd "$folder" && ctest -j "$jobs" -LE 'slow|consumers|repository' --output-on-failure) || failures=1
fi

log "Lines"
gcovr --root "$root" --filter "$root/include/" --filter "$root/src/" --exclude "$root/src/python/" \
  --exclude-throw-branches --print-summary --txt "$folder/coverage.txt" -j "$jobs" "$folder" \
  >"$folder/summary.txt"
cat "$folder/coverage.txt"
figure=$(sed -nE 's/^lines: ([0-9.]+%) \(([0-9]+) out of ([0-9]+)\)$/\1 (\2 of \3)/p' \
  "$folder/summary.txt")
programs=$(cmake --build "$folder" --target help | grep -oE '^[a-z0-9_]+_test:' |
  grep -vc '^cmake_object_order')
ran=$(find "$folder/tests" -path '*_test.dir/*' -name '*.gcda' | sed -E 's:.*/([a-z0-9_]+_test)\.dir/.*:\1:' |
  sort -u | wc -l)
figure+=", by $ran of $programs test programs"
echo "lines: $figure"
if [[ $readme == yes ]] && ((failures == 0)); then
  set_figure "$root/tests/README.md" "lines covered of include/ and src/" "$figure" \
    "tests/coverage.sh --readme"
fi
exit "$failures"
