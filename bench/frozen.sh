#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: bench/frozen.sh FOLDER

Reads what `dynfilter ablate --out FOLDER` wrote and prints for each level and rule, to compare two
programs: dynamic features left and static ones removed a frame, each as the mean and as the least
number of the worst percent of frames; the mean ATE; the frames lost.
END
}

[[ $# == 1 && -d $1 ]] || { usage >&2; exit 2; }

# Prints level, rule, a letter and a number, for each frame and scene.
figures() {
  local summary folder level rule
  for summary in "$1"/*/*/summary.json; do
    folder=$(dirname "$summary")
    level=$(sed -n 's/^ *"group": "\(.*\)",$/\1/p' "$summary")
    rule=$(sed -n 's/^ *"rule": "\(.*\)",$/\1/p' "$summary")
    sed -n -e "s/^ *\"ate_rmse_m\": \([^,]*\),*$/$level $rule a \1/p" \
      -e "s/^ *\"lost_frames\": \([^,]*\),*$/$level $rule l \1/p" "$summary"
    awk -F, -v key="$level $rule" '
      NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
      $column["dynamic_left"] != "" {
        print key, "d", $column["dynamic_left"]
        print key, "s", $column["static_removed"]
      }' "$folder/frames.csv"
  done
}

figures "$1" | sort -k1,1 -k2,2 -k3,3 -k4,4g | awk '
  function mean(letter) { return count[letter] ? sum[letter] / count[letter] : 0 }
  function worst(letter) { return values[letter, int(0.99 * count[letter]) + 1] + 0 }
  function show() {
    if (key == "") return
    printf "%-36s %8.2f %7d %8.2f %7d %9.4f %6d\n", key, mean("d"), worst("d"), mean("s"),
      worst("s"), mean("a"), sum["l"]
    split("", sum)
    split("", count)
  }
  BEGIN {
    printf "%-36s %8s %7s %8s %7s %9s %6s\n", "level rule", "left", "worst", "removed", "worst", \
      "ATE m", "lost"
  }
  key != $1 " " $2 { show(); key = $1 " " $2 }
  { sum[$3] += $4; values[$3, ++count[$3]] = $4 }
  END { show() }'
