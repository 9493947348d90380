#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/branches.sh [--readme] [--no-tests] [-h]

Builds the tests with clang's source coverage, runs them, and prints each outcome of a condition that
no test brought about in the code that writes labels or files, and that has no reason in
tests/branches/reasons.txt. Exits with 1 if there is one. tests/branches/files.txt names that code.
gcc counts the branches that it makes of a condition, exceptions included; clang counts the condition.

  --readme    put the figure into the table of tests/README.md
  --no-tests  count what ran before

  DYNFILTER_BUILD_DIR         folder of the build, default build/branches
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
tests=yes
while (($# > 0)); do
  case "$1" in
    --readme) readme=yes ;;
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
readonly readme tests
folder=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/branches}")
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
readonly folder jobs

need_tool_packages
need_packages clang libclang-rt-dev llvm python3
if [[ $tests == yes ]]; then
  log "Building with clang's coverage"
  find_configure_options
  cmake -S "$root" -B "$folder" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=None \
    -DCMAKE_CXX_COMPILER=clang++ \
    -DCMAKE_CXX_FLAGS="-O1 -fprofile-instr-generate -fcoverage-mapping" \
    -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_PYTHON=OFF -DDYNFILTER_BUILD_TOOLS=ON >/dev/null
  cmake --build "$folder" -j "$jobs"
fi
mapfile -t programs < <(find "$folder/tests" -type f -name '*_test' -perm -u+x | sort)
programs+=("$folder/src/tools/dynfilter")
if [[ $tests == yes ]]; then
  log "Running the tests"
  rm -rf "$folder/profiles"
  # Programs of one kind share a file, so that thousands of calls of `dynfilter` need little room.
  (cd "$folder" && LLVM_PROFILE_FILE="$folder/profiles/%m.profraw" \
    ctest -j "$jobs" -LE 'slow|consumers|repository' --output-on-failure)
fi

log "Outcomes of conditions"
llvm-profdata merge -o "$folder/merged.profdata" "$folder"/profiles/*.profraw
objects=()
for program in "${programs[@]:1}"; do objects+=(-object "$program"); done
llvm-cov export -instr-profile "$folder/merged.profdata" "${programs[0]}" "${objects[@]}" \
  -skip-functions >"$folder/coverage.json"
status=0
python3 "$root/tests/branches/not_taken.py" "$folder/coverage.json" "$root" >"$folder/branches.txt" ||
  status=1
cat "$folder/branches.txt"
if [[ $readme == yes ]]; then
  set_figure "$root/tests/README.md" "outcomes of conditions that write labels or files" \
    "$(tail -n 1 "$folder/branches.txt")" "tests/branches.sh --readme"
fi
exit "$status"
