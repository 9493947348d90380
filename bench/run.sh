#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: bench/run.sh [--quick] [--out DIR] [--readme] [-h]

Builds the benchmarks of D-LBP and of the whole filter in a Release build. Runs them several times in
random order, each beside its physical limit (memcpy) and the alternatives. Prints medians, then lines
`ratio <name> <value>`: `_vs_` is the peer's time over ours, `_over_` ours over the other's, with the
best instruction set, or without AVX2 where the name ends so. Writes JSON files into DIR.
Every benchmark checks its result before it is timed.
Installs the packages that are missing (Debian, Ubuntu), or says which.

  --quick    fewer repetitions: some minutes
  --out DIR  default: out/bench in the repository
  --readme   put ten ratios and the filter's time into README.md

  DYNFILTER_BUILD_DIR  folder of the build, default build/bench in the repository
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
out=$root/out/bench
repetitions=9
min_time=0.1
readme=no
while (($#)); do
  case "$1" in
    --quick)
      repetitions=3
      min_time=0.03
      ;;
    --out)
      [[ $# -ge 2 ]] || { usage >&2; exit 2; }
      out=$(realpath -m "$2")
      shift
      ;;
    --readme) readme=yes ;;
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

# Prints the name of the processor.
processor() {
  local name
  name=$(LC_ALL=C lscpu | sed -n '/^Model name: */{s///p;q}')
  printf '%s\n' "${name:-unknown}"
}

# Reads lines `ratio <name> <value>` and prints what README.md shows: the filter's time, and ten
# ratios in words. All are the other's time over ours, so `_over_` is inverted.
describe_ten_ratios() {
  awk -v processor="$(processor)" '
    FNR == NR { value[$2] = $3; next }
    FNR == 1 {
      printf "The filter, rule depth, 640x480: %.2g ms a frame with 1000 features and 3 persons,\n",
        value["filter_default_ms"]
      printf "%.2g ms with 16384 features and 100 persons. ", value["filter_worst_ms"]
      printf "Processor: %s.\nTime of the other / time of ours:\n", processor
    }
    $1 in value {
      name = $1
      $1 = ""
      ratio = name ~ /_over_/ && name !~ /4k/ ? 1 / value[name] : value[name]
      printf ratio < 1000 ? "%7.3g %s\n" : "%7.0f %s\n", ratio, $0
    }' - <(
    cat <<'END'
filter_default_over_orb ORB extraction / the filter, rule depth
filter_default_4k_over_vga the filter at 3840x2160 / the filter at 640x480, same features
filter_paper_vs_dilation culling with dilated masks, as in DynaSLAM / the filter, rule paper
filter_paper_vs_naive the same rule, written naively with codes of the whole image / the filter, rule paper
filter_paper_vs_lk_f optical flow and a fundamental matrix, as in DS-SLAM / the filter, rule paper
filter_paper_over_memcpy memcpy of keypoints and descriptors / the filter, rule paper
dense_u16_vs_mat_at a loop over cv::Mat::at / dense D-LBP
dense_u16_vs_dlib dlib's LBP / dense D-LBP
dense_u16_over_bgr2gray cv::cvtColor, BGR to grey / dense D-LBP
dense_u16_over_memcpy memcpy of the depth image / dense D-LBP
END
  )
}

# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
need_build_packages libbenchmark-dev python3
if is_available libdlib-dev; then need_packages libdlib-dev; fi

build_dir=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/bench}")
find_configure_options
log "Building the benchmarks"
cmake -S "$root" -B "$build_dir" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=Release \
  -DDYNFILTER_BUILD_TESTS=OFF -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_TOOLS=OFF \
  -DDYNFILTER_BUILD_BENCHMARKS=ON >/dev/null
cmake --build "$build_dir" --target depth_lbp_benchmark filter_benchmark

mkdir -p "$out"
for name in depth_lbp filter; do
  log "Running ${name}_benchmark"
  "$build_dir/bench/${name}_benchmark" --benchmark_enable_random_interleaving=true \
    --benchmark_repetitions="$repetitions" --benchmark_min_time="$min_time" \
    --benchmark_out="$out/$name.json" --benchmark_out_format=json >"$out/$name.txt" 2>&1 ||
    { tail -20 "$out/$name.txt" >&2; die "${name}_benchmark failed"; }
done
python3 "$root/bench/report.py" "$out" | tee "$out/report.txt"

if [[ $readme == yes ]]; then
  ratios=$(grep '^ratio ' "$out/report.txt")
  fill_marks "$root/README.md" "ten ratios" "$(describe_ten_ratios <<<"$ratios")"
fi
