#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: bench/late_masks.sh [--quick] [--seeds LIST] [--out DIR] [--readme] [-h]

Builds the program and compares what to do about masks that come late: exact masks of a network that
gives 10 and 5 results a second, for a camera of 30 frames a second. No frame waits, but for the
rule depth_waited. Prints the tables. About half a minute a scene on two cores, which is ten
minutes in all.
Installs the packages that are missing (Debian, Ubuntu), or says which.

  --quick        one seed and 60 frames a level, to see what it does
  --seeds LIST   default 101-110: seeds by which nothing was tuned
  --out DIR      default: out/late_masks in the repository
  --readme       put the tables that the README shows between its marks

  DYNFILTER_BUILD_DIR  folder of the build, default build/release in the repository
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
seeds=101-110
out=$root/out/late_masks
options=()
readme=no
while (($#)); do
  case "$1" in
    --quick)
      seeds=101
      options+=(--frames 60)
      ;;
    --seeds | --out)
      [[ $# -ge 2 ]] || { usage >&2; exit 2; }
      if [[ $1 == --seeds ]]; then seeds=$2; else out=$(realpath -m "$2"); fi
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

# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
build_program "$root"

log "Comparing what to do about late masks; results in $out"
mkdir -p "$out"
"$dynfilter" ablate --levels late_10hz,late_5hz --seeds "$seeds" \
  --rules mask,mask_moved,depth,depth_moved,depth_waited,perfect "${options[@]}" \
  --out "$out" | tee "$out/tables.txt"

if [[ $readme == yes ]]; then
  fill_marks "$root/README.md" "late masks tables" "$(sed -n '/^all: /,$p' "$out/tables.txt")"
  log "updated README.md"
fi
