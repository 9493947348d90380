#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/mutants.sh [--core] [--count N] [--only FIRST-LAST] [--readme] [--source FOLDER] [-h]

Breaks a copy of include/ and src/ in N small ways (default: 300), one at a time, in one build, and
reports which of them the test programs do not notice. A comparison is flipped at its boundary, a
check is removed, an index is shifted, min and max are swapped, a verdict is turned around. Needs
python3. 300 mutants take hours; a stopped call goes on where it was.

  --core    break the core's headers alone, and build its tests alone; in a folder of its own
  --only    mutants of these numbers alone
  --readme  put the count into the table of figures in tests/README.md
  --source  another project with include/, src/ and tests/, for the test of this script

  DYNFILTER_BUILD_DIR         folder of the build, default build/mutants or build/mutants-core
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core

The last lines count the mutants; results.txt in the folder of the build has a line for each.
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
count=300
only=
source=$root
core=no
readme=no
while (($# > 0)); do
  case "$1" in
    --core | --readme)
      if [[ $1 == --core ]]; then core=yes; else readme=yes; fi
      shift
      continue
      ;;
    --count) count=$2 ;;
    --only) only=$2 ;;
    --source) source=$(realpath "$2") ;;
    -h | --help)
      usage
      exit
      ;;
    *)
      usage >&2
      exit 2
      ;;
  esac
  shift 2
done

name=mutants
files=
options=()
if [[ $core == yes ]]; then
  name=mutants-core
  files='^include/dynfilter/(detail/)?[^/]*$'
  for component in SEGMENTERS MOTION NETWORKS EVALUATION TOOLS EXAMPLES; do
    options+=("-DDYNFILTER_BUILD_$component=OFF")
  done
fi
folder=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/$name}")
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
readonly root count only source core readme name files options folder jobs
# shellcheck source-path=SCRIPTDIR source=figures.sh
source "$root/tests/figures.sh"

# The tree itself stays as it is.
if [[ ! -f $folder/table.txt ]]; then
  rm -rf "$folder/source"
  mkdir -p "$folder/source"
  tar -C "$source" --exclude=./build --exclude=./.git -c . | tar -C "$folder/source" -x
  python3 "$root/tests/mutants/mutate.py" "$folder/source" "$count" "$folder/new_table.txt" "$files"
  mv "$folder/new_table.txt" "$folder/table.txt"
fi
cmake -S "$folder/source" -B "$folder/build" -DCMAKE_BUILD_TYPE=Release "${options[@]}" \
  -DCMAKE_CXX_FLAGS_RELEASE=-O1 \
  -DCMAKE_CXX_FLAGS="-include $root/tests/mutants/mutant.hpp -w" >"$folder/configure.log"
targets=()
if [[ $core == yes ]]; then
  mapfile -t targets < <(sed -nE 's/^dynfilter_test\(([a-z_]+)[ )].*/\1_test/p' \
    "$folder/source/tests/CMakeLists.txt")
fi
cmake --build "$folder/build" -j "$jobs" ${targets:+--target "${targets[@]}"} >"$folder/build.log"
mapfile -t programs < <(find "$folder/build/tests" -type f -name '*_test' -perm -u+x | sort)

# Succeeds if a test program notices the mutant: fails, crashes or takes too long. Begins with those
# that are named like the file.
is_caught() {
  local number=$1 stem=$2 program
  local -a near=() far=()
  for program in "${programs[@]}"; do
    if [[ $(basename "$program") == *"$stem"* ]]; then near+=("$program"); else far+=("$program"); fi
  done
  for program in "${near[@]}" "${far[@]}"; do
    if ! DYNFILTER_MUTANT=$number timeout 120 "$program" --gtest_brief=1 >"$folder/last.log" 2>&1; then
      return 0
    fi
  done
  return 1
}

if is_caught 0 ""; then
  echo "error: a test fails without a mutant; see $folder/last.log" >&2
  exit 1
fi
touch "$folder/results.txt"
while IFS=$'\t' read -r number file line what; do
  if [[ -n $only ]] && ((number < ${only%-*} || number > ${only#*-})); then continue; fi
  if grep -q "^$number"$'\t' "$folder/results.txt"; then continue; fi
  verdict=survived
  if is_caught "$number" "$(basename "${file%.*}")"; then verdict=caught; fi
  printf '%s\t%s\t%s:%s\t%s\n' "$number" "$verdict" "$file" "$line" "$what" >>"$folder/results.txt"
done <"$folder/table.txt"

grep $'\tsurvived\t' "$folder/results.txt" || true
caught="$(grep -c $'\tcaught\t' "$folder/results.txt" || true) of $(wc -l <"$folder/results.txt")"
if [[ $readme == yes ]]; then
  set_figure "$root/tests/README.md" "$name caught" "$caught" \
    "tests/mutants.sh$([[ $core == no ]] || echo ' --core') --count $count --readme"
fi
echo "$caught mutants were caught"
