#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/mutants.sh [--core] [--again] [--count N] [-h]

Breaks a copy of include/ and src/ in N small ways (default: 300), one at a time, in one build, and
reports which of them the tests do not notice. A comparison is flipped at its boundary, a
check is removed, an index is shifted, min and max are swapped, a verdict is turned around. Only the
tests that reach a mutant try it. Needs python3. A stopped call goes on where it was.

  --core    break the core's headers alone, and build its tests alone; in a folder of its own
  --again   try those that survived again, with the tests as they are now

  DYNFILTER_BUILD_DIR         folder of the build, default build/mutants or build/mutants-core
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core

The last lines count the mutants; results.txt in the folder of the build has a line for each.
tests/mutants/equivalent.txt names those that change nothing, each with its reason.
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
count=300
core=no
again=no
while (($# > 0)); do
  case "$1" in
    --core | --again)
      declare "${1#--}=yes"
      shift
      continue
      ;;
    --count) count=$2 ;;
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
  for component in SEGMENTERS REMOTE MOTION NETWORKS EVALUATION TOOLS EXAMPLES; do
    options+=("-DDYNFILTER_BUILD_$component=OFF")
  done
fi
folder=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/$name}")
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
equivalent=$root/tests/mutants/equivalent.txt
readonly root count core again name files options folder jobs equivalent

# The tree itself stays as it is.
if [[ ! -f $folder/table.txt ]]; then
  rm -rf "$folder/source"
  mkdir -p "$folder/source"
  tar -C "$root" --exclude=./build --exclude=./.git -c . | tar -C "$folder/source" -x
  python3 "$root/tests/mutants/mutate.py" "$folder/source" "$count" "$folder/new_table.txt" "$files"
  mv "$folder/new_table.txt" "$folder/table.txt"
fi
if [[ $again == yes ]]; then
  cp -r --update --preserve=timestamps "$root/tests" "$folder/source"
  sed -i '/\tsurvived\t/d' "$folder/results.txt"
fi
cmake -S "$folder/source" -B "$folder/build" -DCMAKE_BUILD_TYPE=Release "${options[@]}" \
  -DCMAKE_CXX_FLAGS_RELEASE="-O1 -D_GLIBCXX_ASSERTIONS -D_DEBUG" \
  -DCMAKE_CXX_FLAGS="-include \"$root/tests/mutants/mutant.hpp\" -w" >"$folder/configure.log"
targets=()
if [[ $core == yes ]]; then
  targets=(--target core_tests replay_whole_filter_tests replay_depth_lbp_tests)
fi
cmake --build "$folder/build" -j "$jobs" "${targets[@]}" >"$folder/build.log"
# Models of networks, without which tests are skipped.
(cd "$folder/build" && ctest -R '^networks\.models$' >>"$folder/build.log" 2>&1)
python3 "$root/tests/mutants/try_mutants.py" "$folder" "$equivalent" "$jobs"

grep $'\tsurvived\t' "$folder/results.txt" || true
caught=$(grep -c $'\tcaught\t' "$folder/results.txt" || true)
equal=$(grep -c $'\tequivalent\t' "$folder/results.txt" || true)
figure="$caught of $(($(wc -l <"$folder/results.txt") - equal))"
echo "$equal mutants change nothing"
echo "$figure mutants were caught"
