#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Compares ways to handle late masks: exact masks of a network that gives 10 and 5 results a second,
# for a camera of 30 frames a second. Only the rule depth_waited lets frames wait. Takes the options
# of ablation.sh, which its --help lists.

set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
exec bash "$root/bench/ablation.sh" --levels late_10hz,late_5hz --seeds 101-110 \
  --rules mask,mask_moved,depth,depth_moved,depth_waited,perfect --marks 'late masks tables' \
  --table 'ATE over' --out "$root/out/late_masks" "$@"
