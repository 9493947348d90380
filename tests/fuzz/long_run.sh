#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/fuzz/long_run.sh [--only TARGET] SECONDS

Builds the fuzz targets with clang's libFuzzer and the address and undefined-behaviour sanitizers,
fuzzes all of them, one after another, for that many seconds altogether (the whole filter longest),
and prints the inputs of each. Goes on with the corpus of earlier runs. A failing input is kept and named, and the others go
on; the exit code is 1 then. SIGTERM ends the run after the input at hand.

  --only    fuzz one target, such as motion

  DYNFILTER_BUILD_DIR         folder of the build, default build/fuzz
  CMAKE_BUILD_PARALLEL_LEVEL  jobs of the build at a time, default: one a core
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
readonly root
only='*'
seconds=
while (($# > 0)); do
  case "$1" in
    --only)
      only=${2:?--only wants a target}
      shift
      ;;
    -h | --help)
      usage
      exit
      ;;
    *)
      [[ -z $seconds && $1 =~ ^[1-9][0-9]*$ ]] || { usage >&2; exit 2; }
      seconds=$1
      ;;
  esac
  shift
done
[[ -n $seconds ]] || { usage >&2; exit 2; }
readonly only seconds
# shellcheck source-path=SCRIPTDIR source=../../cmake/setup.sh
source "$root/cmake/setup.sh"

need_build_packages clang libclang-rt-dev
find_configure_options
folder=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/fuzz}")
readonly folder
log "Building the fuzz targets"
mkdir -p "$(dirname "$folder")"
ignored=-fsanitize-coverage-ignorelist
cmake -S "$root" -B "$folder" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_CXX_FLAGS="-fsanitize=fuzzer-no-link $ignored=$root/tests/fuzz/not_followed.txt" \
  -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_TOOLS=OFF -DDYNFILTER_BUILD_FUZZERS=ON \
  -DDYNFILTER_SANITIZE=address,undefined >"$folder.log"
cmake --build "$folder" -j "${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}" --target fuzzers

# shellcheck disable=SC2206  # a pattern of names
fuzzers=("$folder"/tests/fuzz/${only}_fuzz)
[[ -x ${fuzzers[0]} ]] || die "there is no target $only"

# Files that targets write lie in memory.
files=$(mktemp -d -p "$([[ -w /dev/shm ]] && echo /dev/shm || echo "${TMPDIR:-/tmp}")")
trap 'rm -rf "$files"' EXIT
stopped=no
child=
trap 'stopped=yes; [[ -z $child ]] || kill -TERM "$child"' INT TERM

export OPENCV_FOR_THREADS_NUM=1 # one core is enough, and threads of a pool would wait for it
# A short stack of each allocation and little freed memory kept: they take much of the time.
export ASAN_OPTIONS=quarantine_size_mb=2:malloc_context_size=2
declare -A inputs=()
failures=0

# fuzz <program> <seconds>: adds to inputs[<target>].
fuzz() {
  local target printed done_now
  target=$(basename "$1" _fuzz)
  printed=$folder/$target.log
  mkdir -p "$folder/corpus/$target"
  TMPDIR=$files "$1" -max_len=4096 -max_total_time="$2" -print_final_stats=1 -print_funcs=0 -verbosity=0 \
    -entropic=0 -reload=0 -detect_leaks=0 \
    -artifact_prefix="$folder/${target}_" "$folder/corpus/$target" \
    "$root/tests/fuzz/corpus/$target" >"$printed" 2>&1 &
  child=$!
  local status=0
  wait "$child" || status=$?
  if [[ $stopped == yes ]]; then wait "$child" || true; fi
  child=
  done_now=$(sed -n 's/^stat::number_of_executed_units: *//p' "$printed")
  inputs[$target]=${done_now:-0}
  if ((status != 0)) && [[ $stopped == no ]]; then
    grep -v '^stat::' "$printed" | tail -n 60 >&2 || true
    log "FAILED: $target; its input is kept in $folder"
    failures=$((failures + 1))
  fi
}

# The whole filter matters most; of the others, those get more time that do the most with it.
declare -A weights=([whole_filter]=4 [depth_lbp]=3 [remote_reply]=3 [onnx_file]=2)
weight_of() {
  local target
  target=$(basename "$1" _fuzz)
  echo "${weights[$target]:-1}"
}
sum=0
for fuzzer in "${fuzzers[@]}"; do sum=$((sum + $(weight_of "$fuzzer"))); done
for fuzzer in "${fuzzers[@]}"; do
  share=$((seconds * $(weight_of "$fuzzer") / sum))
  if [[ $stopped == no ]]; then fuzz "$fuzzer" "$((share > 0 ? share : 1))"; fi
done

log "Inputs"
sum=0
for target in $(printf '%s\n' "${!inputs[@]}" | sort); do
  printf '%12d  %s\n' "${inputs[$target]}" "$target"
  sum=$((sum + inputs[$target]))
done
printf '%12d  of all targets\n' "$sum"
((failures == 0))
