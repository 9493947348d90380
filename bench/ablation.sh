#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: bench/ablation.sh [features|late|recordings|motion] [--levels LIST] [--seeds LIST] [--rules LIST]
                         [--frames N] [--every N] [--truth NAME] [--out DIR] [--readme] [-h]
                         [SEQUENCE...]

Builds the program and compares rules on levels of the rendered scene and on the given sequences, by
`dynfilter ablate`, whose --help explains the options: features left and removed, rates, and the
trajectory of the reference odometry. Prints the tables. Takes about half a minute a scene on two cores.

  (nothing)  the usual rules and depth_motion on four levels with five seeds that tuned nothing, 150 frames
  features   the usual rules on ten levels, every tenth frame, without odometry
  late       ways to handle masks of a network that is slower than the camera
  recordings our rules on recorded people, of which the truth by motion is known (masks_moving/)
  motion     rules that judge motion beside those that know only classes, by what moves
  --readme   put the overview into bench/README.md

  DYNFILTER_BUILD_DIR  folder of the build, default build/release in the repository
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
name=ablation
case "${1-}" in
  features | late | recordings | motion)
    name=$1
    shift
    ;;
esac
declare -A chosen
chosen[--levels]=medium,hard,stale_3,near_crowd
chosen[--seeds]=101-105
chosen[--frames]=150
chosen[--rules]=none,mask,dynaslam,crowd_slam,ngd_slam,paper,depth,depth_motion,perfect
chosen[--out]=$root/out/$name
marks='trajectory tables'
tables='^all: (RMSE|ATE over that of rule mask)'
case "$name" in
  features)
    chosen[--levels]=cross,medium,hard,stale_3,stale_6,late_5hz,furniture,two_in_one
    chosen[--levels]+=,near_crowd
    chosen[--seeds]=101-103
    chosen[--every]=10
    unset 'chosen[--frames]'
    chosen[--rules]=none,mask,dynaslam,crowd_slam,ngd_slam,paper,depth
    marks='feature tables'
    tables='^all: dynamic left'
    ;;
  late)
    chosen[--levels]=late_10hz,late_5hz
    chosen[--rules]=mask,mask_moved,depth,depth_moved,perfect
    marks='late masks tables'
    tables='^all: ATE over that of rule mask'
    ;;
  recordings)
    unset 'chosen[--levels]' 'chosen[--seeds]' 'chosen[--frames]'
    chosen[--truth]=motion
    chosen[--rules]=none,mask,paper,depth,masks_motion,depth_motion,perfect
    marks='recordings tables'
    tables='^all: (dynamic left|RMSE)'
    ;;
  motion)
    chosen[--levels]=sitting,working,stop_and_go,pushed,carried,still_camera,rotation,fast,crowd
    chosen[--seeds]=101-103
    chosen[--frames]=120
    chosen[--truth]=motion
    chosen[--rules]=none,mask,depth,motion,masks_motion,depth_motion,perfect
    marks='motion tables'
    tables='^all: (dynamic left|ATE over that of rule mask)'
    ;;
esac
readme=no
words=()
while (($#)); do
  case "$1" in
    --levels | --seeds | --rules | --frames | --every | --truth | --out)
      [[ $# -ge 2 ]] || { usage >&2; exit 2; }
      chosen[$1]=$2
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
    *) words+=("$(realpath "$1")") ;;
  esac
  shift
done
chosen[--out]=$(realpath -m "${chosen[--out]}")
for option in "${!chosen[@]}"; do words+=("$option" "${chosen[$option]}"); done

# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
build_program "$root"
log "Comparing rules; results in ${chosen[--out]}"
mkdir -p "${chosen[--out]}"
"$dynfilter" ablate "${words[@]}" | tee "${chosen[--out]}/tables.txt"

if [[ $readme == yes ]]; then
  fill_marks "$root/bench/README.md" "$marks" \
    "$(awk -v RS= -v wanted="$tables" '$0 ~ wanted { if (n++) print ""; print }' \
      "${chosen[--out]}/tables.txt")"
fi
