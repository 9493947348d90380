#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Fails where D-LBP takes more instructions than it should: count.sh <program>
# Counts, unlike times, are the same on a busy machine. valgrind knows no AVX-512, so AVX2 is counted.
# The bounds are what g++ 12 and clang 14 need, and half as much again.

set -euo pipefail
readonly program=$1

if ! command -v valgrind >/dev/null; then
  echo "SKIPPED: there is no valgrind"
  exit 77
fi

folder=$(mktemp -d)
readonly folder
trap 'rm -rf "$folder"' EXIT
failed=no

# check <u16|f32> <function> <items> <bound, instructions a hundred items>
check() {
  local depth=$1 function=$2 items=$3 bound=$4 code=0 count
  valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect="$function" \
    "$program" "$depth" >"$folder/out" 2>"$folder/err" || code=$?
  if grep SKIPPED "$folder/out"; then exit 77; fi
  count=$(sed -n 's/.*Collected : \([0-9]*\).*/\1/p' "$folder/err")
  if ((code != 0)) || [[ -z $count ]] || ((count == 0)); then
    cat "$folder/err" >&2
    echo "$function $depth: nothing was counted" >&2
    exit 1
  fi
  count=$((count * 100 / items))
  printf '%s %s: %d instructions a hundred, at most %d\n' "$function" "$depth" "$count" "$bound"
  if ((count > bound)); then failed=yes; fi
}

check u16 counted_dense $((640 * 480)) 380
check f32 counted_dense $((640 * 480)) 640
check u16 counted_sparse 1000 17500
check f32 counted_sparse 1000 17500

[[ $failed == no ]]
