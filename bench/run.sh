#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: bench/run.sh [--quick] [--out DIR] [--readme] [-h] [depth_lbp] [filter] | instructions

Builds the benchmark of D-LBP, of the whole filter, or both, in a Release build, and runs it several
times in random order. Prints wall times, and how many times as fast as others ours is. Every
result is checked before it is timed. Writes JSON files into DIR.
Installs the packages that are missing (Debian, Ubuntu), or says which. `instructions` counts, by
valgrind, those of a frame under each rule, which are the same on every machine.

  --quick    fewer repetitions
  --out DIR  default: out/bench in the repository
  --readme   put the table of D-LBP into bench/paper.md, the instructions into bench/README.md, the filter's
             ratios into README.md

  DYNFILTER_BUILD_DIR  folder of the build, default build/bench in the repository
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
out=$root/out/bench
repetitions=9
readme=no
names=()
while (($#)); do
  case "$1" in
    --quick) repetitions=3 ;;
    --out)
      [[ $# -ge 2 ]] || { usage >&2; exit 2; }
      out=$(realpath -m "$2")
      shift
      ;;
    --readme) readme=yes ;;
    depth_lbp | filter | instructions) names+=("$1") ;;
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

if ((${#names[@]} == 0)); then names=(depth_lbp filter); fi

# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
need_build_packages libbenchmark-dev python3
if [[ ${names[*]} == instructions ]]; then need_packages valgrind; fi
if is_available libdlib-dev; then need_packages libdlib-dev; fi

build_dir=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/bench}")
find_configure_options
targets=("${names[@]/%/_benchmark}")
targets=("${targets[@]/instructions_benchmark/instructions}")
log "Building ${targets[*]}"
cmake -S "$root" -B "$build_dir" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=Release \
  -DDYNFILTER_BUILD_TESTS=OFF -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_TOOLS=OFF \
  -DDYNFILTER_BUILD_BENCHMARKS=ON >/dev/null
cmake --build "$build_dir" --target "${targets[@]}"

# Tables in the pages, by benchmark.
declare -A page=([depth_lbp]=bench/paper.md [filter]=README.md)
declare -A marks=([depth_lbp]="D-LBP table" [filter]="filter ratios")
declare -A min_time_s=([depth_lbp]=0.01 [filter]=0.1)

mkdir -p "$out"
if [[ ${names[*]} == instructions ]]; then
  log "Counting; this takes minutes"
  valgrind --tool=callgrind --collect-atstart=no --toggle-collect='*benchmarks*count_*' \
    --callgrind-out-file="$out/callgrind.out" "$build_dir/bench/instructions" >"$out/instructions.txt" 2>&1 ||
    { tail -20 "$out/instructions.txt" >&2; die "instructions failed"; }
  table=$(callgrind_annotate --inclusive=yes --threshold=100 "$out/callgrind.out" |
    sed -nE 's/^ *([0-9,]+) .*::count_([a-z]+)\(.*/\2 \1/p' | tr -d , | sort -u -k1,1 | sort -k2,2g |
    awk '{ names = names sprintf("%8s", $1); counts = counts sprintf("%8.2f", $2 / 10 / 1e6) }
      END { print "millions of instructions a frame, medium, 1000 features"; print names; print counts }')
  printf '%s\n' "$table"
  if [[ $readme == yes ]]; then fill_marks "$root/bench/README.md" "instructions" "$table"; fi
  exit
fi
for name in "${names[@]}"; do
  log "Running ${name}_benchmark"
  "$build_dir/bench/${name}_benchmark" --benchmark_enable_random_interleaving=true \
    --benchmark_repetitions="$repetitions" --benchmark_min_time="${min_time_s[$name]}" \
    --benchmark_out="$out/$name.json" --benchmark_out_format=json >"$out/$name.txt" 2>&1 ||
    { tail -20 "$out/$name.txt" >&2; die "${name}_benchmark failed"; }
  python3 "$root/bench/report.py" "$out/$name.json" | tee "$out/$name.report.txt"
  if [[ $readme == yes ]]; then
    fill_marks "$root/${page[$name]}" "${marks[$name]}" \
      "$(sed -n '/^\(D-LBP on\|The filter,\) /,$p' "$out/$name.report.txt" | grep -v '1280x720\|1920x1080')"
  fi
done
