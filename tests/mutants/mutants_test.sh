#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Tests mutants.sh on a small project, of which it is known which mutants its test notices, and
# checks that it finds hundreds of places in dynfilter. Needs python3; 77 means skipped.
#   mutants_test.sh <repository>

set -euo pipefail
root=$1
if ! command -v python3 >/dev/null; then
  echo "SKIPPED: there is no python3"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

before=$(find "$root/tests/mutants" -type f -exec cksum {} + | sort)
DYNFILTER_BUILD_DIR=$folder/toy bash "$root/tests/mutants.sh" --source "$root/tests/mutants/toy" \
  --count 50 >"$folder/printed"
cat "$folder/printed"
# A mutant for each of five lines: two comparisons, max, a shifted index, a check.
[[ $(wc -l <"$folder/toy/table.txt") -eq 5 ]] || fail "wants one mutant for each of 5 lines"
[[ $(tail -n 1 "$folder/printed") == '4 of 5 mutants were caught' ]] || fail "wants 4 caught"
[[ $(grep -c 'survived.*absolute' "$folder/printed") -eq 1 ]] || fail "absolute wants a survivor"
grep -q constant "$folder/toy/table.txt" && fail "the compiler computes a constant"
# The survivor is written down as one that changes nothing, and tried again.
cp -r "$root/tests/mutants/toy" "$folder/listed"
mkdir "$folder/listed/tests/mutants"
awk -F '\t' '/absolute/ { print $2 "\t" $4 "\tThe negative of 0 is 0." }' "$folder/toy/table.txt" \
  >"$folder/listed/tests/mutants/equivalent.txt"
DYNFILTER_BUILD_DIR=$folder/toy bash "$root/tests/mutants.sh" --source "$folder/listed" --again \
  --count 50 >"$folder/printed"
[[ $(tail -n 2 "$folder/printed") == $'1 mutants change nothing\n4 of 4 mutants were caught' ]] ||
  fail "wants 4 caught of 4"
# Each test knows which mutants it reaches, and tries no others.
number=$(awk -F '\t' '/absolute/ { print $1 }' "$folder/toy/table.txt")
python3 - "$folder/toy/reached/toy_tests.json" "$number" <<'END' || fail "wants the mutants of each test"
import json
import sys

reached = {name: mutants for name, _, mutants in json.load(open(sys.argv[1], encoding="utf-8"))}
survivor = int(sys.argv[2])
assert reached["Toy.HasAnAbsoluteValue"] == [survivor], reached
assert reached["Toy.ComparesAndCounts"] == [number for number in range(1, 6) if number != survivor], reached
END
[[ $(find "$root/tests/mutants" -type f -exec cksum {} + | sort) == "$before" ]] ||
  fail "the sources changed"

mkdir "$folder/copy"
cp -r "$root/include" "$root/src" "$folder/copy"
python3 "$root/tests/mutants/mutate.py" "$folder/copy" 300 "$folder/table.txt"
[[ $(wc -l <"$folder/table.txt") -eq 300 ]] || fail "wants 300 mutants"
[[ $(cut -f 2 "$folder/table.txt" | sort -u | wc -l) -gt 150 ]] || fail "wants them in many files"
