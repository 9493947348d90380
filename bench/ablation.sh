#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: bench/ablation.sh [--quick] [--every N] [--frames N] [--levels LIST] [--seeds LIST]
                         [--rules LIST] [--truth NAME] [--out DIR] [--readme] [--marks NAME]
                         [--table TEXT] [-h] [SEQUENCE...]

Builds the program and compares all rules on the levels of the rendered scene, and on the given
sequences: features left and removed, rates, and the trajectory of the reference odometry. Prints the
tables and writes DIR/report.html. Takes about half a minute a scene on two cores, an hour in all; with
--every 5, which omits the trajectories, ten minutes.
Installs the packages that are missing (Debian, Ubuntu), or says which.

  --quick        one seed and 60 frames a level, as a trial
  --every N      every n-th frame, features only, without odometry
  --frames N     frames of a level, default 300
  --levels LIST  default: cross,medium,hard,stale_3,stale_6,late_10hz,late_5hz,furniture,two_in_one
                 others: static,together,leave,depth_late_33,depth_late_16,depth_early_33,
                 depth_early_16,desk,two_near,hair,sitting,stop_and_go,pushed,pushed_slow,
                 pushed_plain,carried,carried_slow,carried_plain,still_camera,rotation,fast,
                 crowd; any name with _depth_late after it: depth a frame older
  --seeds LIST   default 101-115: seeds that tuned nothing
  --rules LIST   default: all but those that compare frames, those about motion and with weights,
                 and those for late masks, which late_masks.sh compares
  --truth NAME   what is dynamic: class (the default), persons whether they move or not, or motion,
                 what moves
  --out DIR      default: out/ablation in the repository, with --every out/ablation_every_N,
                 because results of all frames and of every n-th do not go into one folder
  --readme       put an overview into bench/README.md: that of the features with --every, else that of
                 the trajectories
  --marks NAME   between other marks
  --table TEXT   another overview: the table whose title begins with `all: TEXT`

  DYNFILTER_BUILD_DIR  folder of the build, default build/release in the repository
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
levels=cross,medium,hard,stale_3,stale_6,late_10hz,late_5hz,furniture,two_in_one
seeds=101-115
frames=
rules=
truth=class
marks='trajectory tables'
tables='^(all: ATE over|in the form)'
out=
name=ablation
options=()
sequences=()
readme=no
while (($#)); do
  case "$1" in
    --quick)
      seeds=101
      frames=60
      ;;
    --every | --frames | --levels | --seeds | --rules | --truth | --out | --marks | --table)
      [[ $# -ge 2 ]] || { usage >&2; exit 2; }
      case "$1" in
        --every)
          options+=(--every "$2")
          name=ablation_every_$2
          marks='feature tables'
          tables='^all: dynamic left'
          ;;
        --levels) levels=$2 ;;
        --seeds) seeds=$2 ;;
        --frames) frames=$2 ;;
        --rules) rules=$2 ;;
        --truth) truth=$2 ;;
        --marks) marks=$2 ;;
        --table) tables="^all: $2" ;;
        *) out=$(realpath -m "$2") ;;
      esac
      shift
      ;;
    --readme) readme=yes ;;
    -h | --help)
      usage
      exit
      ;;
    -*)
      usage >&2
      exit 2
      ;;
    *) sequences+=("$(realpath "$1")") ;;
  esac
  shift
done

out=${out:-$root/out/$name}

# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
build_program "$root"

if [[ -n $frames ]]; then options+=(--frames "$frames"); fi
if [[ -n $rules ]]; then options+=(--rules "$rules"); fi
log "Comparing all rules; results in $out"
mkdir -p "$out"
"$dynfilter" ablate "${sequences[@]}" --levels "$levels" --seeds "$seeds" \
  --truth "$truth" "${options[@]}" --out "$out" --report "$out/report.html" |
  tee "$out/tables.txt"

if [[ $readme == yes ]]; then
  fill_marks "$root/bench/README.md" "$marks" \
    "$(awk -v RS= -v wanted="$tables" '$0 ~ wanted { if (n++) print ""; print }' "$out/tables.txt")"
fi
