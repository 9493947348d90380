#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Compiles every public header alone, and twice in one file: alone.sh <repository> <compiler> <option>...

set -euo pipefail
cd "$1/include"
shift
failed=0
while IFS= read -r header; do
  printf '#include "%s"\n' "$header" "$header" | "$@" -x c++ - || { echo "$header"; failed=1; }
done < <(find dynfilter -name '*.hpp' | LC_ALL=C sort)
exit "$failed"
