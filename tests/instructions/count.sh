#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Fails if a program's functions take more instructions than allowed: count.sh <program>
# `program list` prints one line for each function to count: argument, function, items, and the bound
# in instructions per hundred items. `program <argument>` calls the function once.
# Unlike times, counts are the same on a busy machine. valgrind lacks AVX-512, so AVX2 is counted.

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

# check <argument> <function> <items> <bound>
check() {
  local argument=$1 function=$2 items=$3 bound=$4 code=0 count
  valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect="$function" \
    "$program" "$argument" >"$folder/out" 2>"$folder/err" || code=$?
  if grep SKIPPED "$folder/out"; then exit 77; fi
  count=$(sed -n 's/.*Collected : \([0-9]*\).*/\1/p' "$folder/err")
  if ((code != 0)) || [[ -z $count ]] || ((count == 0)); then
    cat "$folder/err" >&2
    echo "$function $argument: nothing was counted" >&2
    exit 1
  fi
  count=$((count * 100 / items))
  printf '%s %s: %d instructions a hundred, at most %d\n' "$function" "$argument" "$count" "$bound"
  if ((count > bound)); then failed=yes; fi
}

"$program" list >"$folder/list"
[[ -s $folder/list ]] || { echo "$program lists nothing to count" >&2; exit 1; }
while read -r argument function items bound; do
  check "$argument" "$function" "$items" "$bound"
done <"$folder/list"

[[ $failed == no ]]
