#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: bench/compile_time.sh [--runs N] [-h]

Prints what one file costs to compile, medians of several runs: user seconds and peak memory of
`g++ -O2` for OpenCV's core.hpp and imgproc.hpp alone, for a call of DynamicFilter::apply with the
headers alone, and for the same call with dynfilter::compiled. Then the ratios to OpenCV's headers.
Installs the packages that are missing (Debian, Ubuntu), or says which.

  --runs N  default 5

  CXX  the compiler, default g++
END
}

runs=5
while (($#)); do
  case "$1" in
    --runs)
      [[ $# -ge 2 && $2 =~ ^[1-9][0-9]*$ ]] || { usage >&2; exit 2; }
      runs=$2
      shift
      ;;
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

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
need_build_packages python3

folder=$(mktemp -d)
readonly folder
trap 'rm -rf "$folder"' EXIT

cat >"$folder/opencv.cpp" <<'END'
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
int main() { return cv::Mat().rows; }
END
cat >"$folder/apply.cpp" <<'END'
#include <dynfilter/dynfilter.hpp>
dynfilter::FeatureLabels filtered(const dynfilter::DynamicFilter& filter,
                                  const dynfilter::FrameView& frame,
                                  const dynfilter::Segmentation& people,
                                  const std::vector<cv::KeyPoint>& keypoints) {
  return filter.apply(frame, people, keypoints);
}
END

read -ra flags <<<"$(pkg-config --cflags opencv4) -std=c++17 -O2"
flags+=("-I$root/include")
# "<name> <user seconds> <peak MiB>" a line, in turns, since a machine's speed changes.
for ((run = 0; run < runs; ++run)); do
  while read -r name file flag; do
    python3 - "$name" "${CXX:-g++}" "${flags[@]}" ${flag:+"$flag"} -c "$folder/$file" -o "$folder/out.o" <<'END'
import resource, subprocess, sys
subprocess.run(sys.argv[2:], check=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)  # the peak is the largest process's
print(sys.argv[1], used.ru_utime, used.ru_maxrss / 1024)
END
  done <<'END'
opencv_headers opencv.cpp
apply_header_only apply.cpp
apply_compiled apply.cpp -DDYNFILTER_COMPILED
END
done >"$folder/runs.txt"

python3 - "$folder/runs.txt" <<'END'
import statistics, sys
runs = {}
for line in open(sys.argv[1]):
    name, seconds, peak = line.split()
    runs.setdefault(name, []).append((float(seconds), float(peak)))
medians = {name: [statistics.median(column) for column in zip(*values)] for name, values in runs.items()}
print(f"{'':18} {'user s':>7} {'peak MiB':>9}")
for name, (seconds, peak) in medians.items():
    print(f"{name:18} {seconds:7.2f} {peak:9.0f}")
base = medians.pop("opencv_headers")
for name, (seconds, peak) in medians.items():
    print(f"ratio {name}_over_opencv_headers {seconds / base[0]:.2f}")
END
