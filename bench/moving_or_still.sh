#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Compares rules that judge motion with those that know only classes, by what moves: on scenes with
# persons who stay, and with boxes of no class. Takes the options of ablation.sh, which its --help
# lists.

set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
rules=none,mask,depth,motion,masks_motion,depth_motion,depth_motion_kept,depth_motion_waits
rules+=,ds_slam,dynaslam_geometry,derome,eppenberger,dai,smr,dyna_tm,dn_slam,perfect
levels=sitting,stop_and_go,pushed,pushed_slow,carried,carried_slow,still_camera,rotation,fast,crowd
exec bash "$root/bench/ablation.sh" --truth motion --levels "$levels" --seeds 101-103 \
  --frames 120 --rules "$rules" --marks 'motion tables' --table 'dynamic left' \
  --out "$root/out/moving_or_still" "$@"
