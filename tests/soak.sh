#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/soak.sh [--readme] [--frames N] [--minutes N] [--kills N] [--motion-frames N]
                     [--limit SECONDS] [-h]

Builds soak_test and motion_soak_test as Release and runs them for long: random frames through the
filter by every rule at full speed, the asynchronous segmenter beside a slow network, another process
that gives masks and is killed and started again, and a rendered scene by motion, with masks that are
moved. Each checks that memory stays flat and answers stay the same.

  --readme         put what was run into the table of figures in tests/README.md
  --frames         random ones, default 1000000
  --minutes        of the asynchronous segmenter, default 10
  --kills          default 1000
  --motion-frames  of the rendered scene, default 50000
  --limit          end each of the four after so many seconds, however far it came

  DYNFILTER_BUILD_DIR  folder of the build, default build/soak
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
# shellcheck source-path=SCRIPTDIR source=figures.sh
source "$root/tests/figures.sh"
readme=no
frames=1000000
minutes=10
kills=1000
motion_frames=50000
limit_s=1000000
while (($# > 0)); do
  case "$1" in
    --readme) readme=yes ;;
    --frames | --minutes | --kills | --motion-frames | --limit)
      [[ ${2:-} =~ ^[1-9][0-9]*$ ]] || { usage >&2; exit 2; }
      case "$1" in
        --frames) frames=$2 ;;
        --minutes) minutes=$2 ;;
        --kills) kills=$2 ;;
        --motion-frames) motion_frames=$2 ;;
        --limit) limit_s=$2 ;;
      esac
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
readonly readme frames minutes kills motion_frames limit_s

need_build_packages
find_configure_options
folder=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/soak}")
readonly folder
log "Building soak_test and motion_soak_test"
cmake -S "$root" -B "$folder" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=Release \
  -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_TOOLS=OFF >/dev/null
cmake --build "$folder" --target soak_test motion_soak_test

log "Running $frames frames, $minutes minutes, $kills kills and $motion_frames frames by motion"
export DYNFILTER_SOAK_FRAMES=$frames DYNFILTER_SOAK_SECONDS=$((60 * minutes)) \
  DYNFILTER_SOAK_KILLS=$kills DYNFILTER_SOAK_MOTION_FRAMES=$motion_frames \
  DYNFILTER_SOAK_LIMIT_S=$limit_s
{
  "$folder/tests/soak_test"
  "$folder/tests/motion_soak_test"
} | tee "$folder/soak.txt"
if [[ $readme == yes ]]; then
  while IFS=: read -r _ name text; do
    set_figure "$root/tests/README.md" "soaked:$name" "${text# }" "tests/soak.sh --readme"
  done < <(grep '^soaked: ' "$folder/soak.txt")
fi
