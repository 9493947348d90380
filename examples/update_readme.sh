#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Makes the picture of README.md and the demo's lines in it anew: runs the demo on its own scene, and
# shrinks an overlay.

set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
need_packages imagemagick

mkdir -p "$root/examples/images"
output=$(bash "$root/examples/demo.sh" | tee /dev/stderr)
fill_marks "$root/README.md" "demo output" \
  "$(grep -E '^features|^ +(removed by|dynamic left|static removed)' <<<"$output")"
# Picks the drawn frame with the most compensated features.
frame=$(awk -F, 'FNR == NR { drawn[$1] = 1; next } $1 in drawn && $8 > most { most = $8; frame = $1 }
  END { print frame }' <(basename -s .png "$root"/out/demo/overlays/*.png) "$root/out/demo/frames.csv")
convert "$root/out/demo/overlays/$frame.png" -resize 1440x -strip -quality 82 \
  "$root/examples/images/filter.jpg"

log "updated examples/images/filter.jpg ($(stat -c %s "$root/examples/images/filter.jpg") bytes)"
