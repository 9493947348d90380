#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/branches.sh [--core] [--readme] [--no-tests] [-h]

Builds the tests with clang's source coverage, runs them, and prints each outcome of a condition that
no test brought about in the code that writes labels or files, and that has no reason in
tests/branches/reasons.txt. Exits with 1 if there is one. tests/branches/files.txt names that code.
gcc counts the branches that it makes of a condition, exceptions included; clang counts the condition.

  --core      look at the core's headers alone, by its tests alone
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
target=all
name="outcomes of conditions that write labels or files"
while (($# > 0)); do
  case "$1" in
    --core)
      target=core_tests
      name="outcomes of conditions that write labels, in the core"
      ;;
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
readonly readme tests target name
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
  cmake --build "$folder" -j "$jobs" --target "$target"
fi
mapfile -t programs < <(find "$folder/tests" -type f -name '*_test' -perm -u+x | sort)
if [[ $tests == yes ]]; then
  log "Running the tests"
  rm -rf "$folder/profiles"
  mkdir "$folder/profiles"
  # Models of networks, without which tests are skipped.
  (cd "$folder" && ctest -R '^networks\.models$' >"$folder/models.log" 2>&1)
  # Calls of one program share a file, so that thousands of `dynfilter` need little room.
  (cd "$folder/profiles" && export LLVM_PROFILE_FILE=$folder/profiles/%m.profraw &&
    printf '%s\0' "${programs[@]}" | xargs -0 -P "$jobs" -I '{}' env '{}' --gtest_brief=1) \
    >"$folder/tests.log" 2>&1 || die "a test failed; see $folder/tests.log"
fi

log "Outcomes of conditions"
objects=()
for program in "${programs[@]}" "$folder/src/tools/dynfilter"; do
  if [[ -x $program ]]; then objects+=(-object "$program"); fi
done
files=
if [[ $target == core_tests ]]; then files=include/; fi
llvm-profdata merge -o "$folder/merged.profdata" "$folder"/profiles/*.profraw
llvm-cov export -skip-functions -instr-profile "$folder/merged.profdata" "${objects[@]:1}" \
  >"$folder/coverage.json" 2>"$folder/coverage.log"
status=0
python3 "$root/tests/branches/not_taken.py" "$folder/coverage.json" "$root" "$files" \
  >"$folder/branches.txt" || status=1
cat "$folder/branches.txt"
if [[ $readme == yes ]]; then
  set_figure "$root/tests/README.md" "$name" "$(tail -n 1 "$folder/branches.txt")" \
    "tests/branches.sh $([[ -z $files ]] || echo '--core ')--readme"
fi
exit "$status"
