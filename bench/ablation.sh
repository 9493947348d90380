#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: bench/ablation.sh [features|recordings|motion|coverage|quality|age|paper] [--levels LIST]
                         [--seeds LIST] [--rules LIST] [--features LIST] [--frames N] [--every N]
                         [--truth NAME] [--masks DIR] [--camera CAMERA] [--depth-offset S] [--out DIR]
                         [--readme] [-h]
                         [SEQUENCE...]

Builds the program and compares rules on levels of the rendered scene and on the given sequences, by
`dynfilter ablate`, whose --help explains the options: features left and removed, rates, and the
trajectory of the reference odometry. Prints the tables. Takes about half a minute a scene on two cores.

  (nothing)  the usual rules and depth_motion on four levels with five seeds that tuned nothing, 150 frames
  features   the usual rules on nine levels, every tenth frame, without odometry
  recordings our rules on recorded people, of which the truth by motion is known (masks_moving/)
  motion     rules that judge motion beside those that know only classes, by what moves
  coverage   how often each rule tracks: six numbers of features, six scenes and the given sequences;
             draws a curve into DIR/coverage.svg
  quality    the ATE where good masks are made worse, three scenes or the given sequences
  age        the ATE where good masks are up to a second old
  paper      the paper's Tables 1 to 4, of six numbers of features; of TUM's sequences with --camera tum3
  --levels none: the given sequences alone
  --readme   put the overview into bench/README.md, that of paper into bench/paper.md,
             that of features nowhere

  DYNFILTER_BUILD_DIR  folder of the build, default build/release in the repository
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
name=ablation
case "${1-}" in
  features | recordings | motion | coverage | quality | age | paper)
    name=$1
    shift
    ;;
esac
declare -A chosen
chosen[--levels]=medium,hard,stale_3,near_crowd
chosen[--seeds]=101-105
chosen[--frames]=150
chosen[--rules]=none,mask,mask_robust,dynaslam,lk_epipolar,crowd_slam,ngd_slam,paper,depth,depth_motion,perfect
chosen[--out]=$root/out/$name
marks='trajectory tables'
page=README.md
tables='^all: RMSE of the ATE'
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
  recordings)
    unset 'chosen[--levels]' 'chosen[--seeds]' 'chosen[--frames]'
    chosen[--truth]=motion
    chosen[--rules]=none,mask,paper,depth,depth_motion,perfect
    marks='recordings tables'
    tables='^all: (dynamic left|RMSE)'
    ;;
  motion)
    chosen[--levels]=sitting,working,stop_and_go,pushed,carried,still_camera,rotation,fast,crowd
    chosen[--seeds]=101-103
    chosen[--frames]=120
    chosen[--truth]=motion
    chosen[--rules]=none,mask,depth,motion,depth_motion,perfect
    marks='motion tables'
    tables='^all: ATE over that of rule mask'
    ;;
  coverage)
    chosen[--levels]=medium,near_crowd
    chosen[--seeds]=101-103
    chosen[--frames]=50
    chosen[--rules]=none,mask,mask_robust,lk_epipolar,paper,depth_motion,perfect
    ;;
  quality | age)
    unset 'chosen[--levels]' 'chosen[--seeds]' 'chosen[--frames]'
    chosen[--rules]=mask,mask_moved,paper,depth_motion,perfect
    chosen[--degrade]=late_0,late_3,late_6,late_15,late_30
    if [[ $name == quality ]]; then
      chosen[--rules]=mask,paper,depth_motion,perfect
      chosen[--degrade]=eroded_0,eroded_2,eroded_4,eroded_8,eroded_16,disc,boxes,missing_3
    fi
    ;;
  paper)
    unset 'chosen[--levels]' 'chosen[--seeds]' 'chosen[--frames]'
    chosen[--features]=1000,1040,1200,1500,1750,2000
    chosen[--rules]=none,mask,paper_depth,paper,depth_motion
    marks='paper tables'
    page=paper.md
    tables='^(checks of the input|in the form of|removed a frame|improvement of)'
    ;;
esac
readme=no
words=()
while (($#)); do
  case "$1" in
    --levels | --seeds | --rules | --features | --frames | --every | --truth | --masks | --camera | \
      --depth-offset | --out)
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
sequences=${words[*]}
if [[ ${chosen[--levels]-} == none ]]; then unset 'chosen[--levels]' 'chosen[--seeds]'; fi
for option in "${!chosen[@]}"; do
  [[ $option == --out ]] || words+=("$option" "${chosen[$option]}")
done

# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
build_program "$root"
if [[ $name =~ ^(coverage|quality|age)$ ]]; then need_packages python3; fi
if [[ $name =~ ^(quality|age)$ && -z $sequences ]]; then # the exact masks of rendered scenes
  for seed in 101 102 103; do
    scene=${chosen[--out]}/scenes/medium_$seed
    rm -rf "$scene"
    "$dynfilter" synth "$scene" --level medium --seed "$seed" --frames 50
    rm -r "$scene/masks"
    mv "$scene/masks_true" "$scene/masks"
    words+=("$scene")
  done
fi
log "Comparing rules; results in ${chosen[--out]}"
mkdir -p "${chosen[--out]}"
touch "${chosen[--out]}/begin"
compare() { "$dynfilter" ablate "${words[@]}" "$@"; }
if [[ $name == coverage ]]; then
  for features in 1000 1040 1200 1500 1750 2000; do
    compare --features "$features" --out "${chosen[--out]}/$features"
  done
else
  compare --out "${chosen[--out]}"
fi | tee "${chosen[--out]}/tables.txt"

table=$(awk -v RS= -v wanted="$tables" '$0 ~ wanted { if (n++) print ""; print }' "${chosen[--out]}/tables.txt")
coverage() { python3 "$root/bench/coverage.py" "$@" "${chosen[--out]}"; }
case "$name" in
  coverage)
    table=$(coverage)
    marks='coverage table'
    if python3 -c 'import matplotlib' 2>/dev/null; then coverage --draw "${chosen[--out]}/coverage.svg"; fi
    ;;
  quality | age)
    table=$(coverage --degraded)
    marks="$name table"
    ;;
esac
[[ ! $name =~ ^(coverage|quality|age)$ ]] || printf '%s\n' "$table"
if [[ $readme == yes ]]; then fill_marks "$root/bench/$page" "$marks" "$table"; fi
