#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Tests the functions of tests/figures.sh in a repository of their own: figures_test.sh <repository>.
# 77 means skipped.

set -euo pipefail
root=$1
if ! command -v git >/dev/null; then
  echo "SKIPPED: there is no git"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
page=$folder/tests/README.md

fail() {
  echo "FAILED: $*" >&2
  cat "$page" >&2
  exit 1
}

# No settings of the user's, nor of a hook that runs this, nor a repository around the folder.
unset "${!GIT_@}"
export GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_SYSTEM=/dev/null GIT_CEILING_DIRECTORIES=${folder%/*}
commit() {
  git -C "$folder" add --all
  git -C "$folder" -c user.name=nobody -c user.email=nobody@localhost commit --quiet -m "$1"
}

# Calls a function as a script does that sources the file at its beginning.
call() {
  bash -euo pipefail -c 'source "$1"; "${@:2}"' bash "$folder/tests/figures.sh" "$@"
}

expect_row() {
  grep -qFx "$1" "$page" || fail "wants the row $1"
}

mkdir "$folder/tests"
cp "$root/tests/figures.sh" "$folder/tests"
echo unchanged >"$folder/source"
printf '%s\n' before '<!-- figures: begin -->' '| what | figure | command | at commit |' '|---|---|---|---|' \
  '<!-- figures: end -->' after >"$page"

call set_figure "$page" speed 7 "measure.sh --readme"
expect_row "| speed | 7 | \`measure.sh --readme\` | unknown |"
git -C "$folder" init --quiet
commit first
hash=$(git -C "$folder" rev-parse --short HEAD)
call set_figure "$page" speed 8 "measure.sh --readme"
expect_row "| speed | 8 | \`measure.sh --readme\` | $hash |"
[[ $(call figure "$page" speed) == 8 ]] || fail "wants the figure 8"

# The page itself is no change; a file that differs or is new is one.
call set_figure "$page" size 9 weigh.sh
expect_row "| size | 9 | \`weigh.sh\` | $hash |"
echo new >"$folder/other"
call set_figure "$page" size 10 weigh.sh
expect_row "| size | 10 | \`weigh.sh\` | $hash+ |"
rm "$folder/other"
echo changed >"$folder/source"
call set_figure "$page" size 11 weigh.sh
expect_row "| size | 11 | \`weigh.sh\` | $hash+ |"

# A commit during the measurement is not what was measured.
commit second
bash -euo pipefail -c '
  source "$1/tests/figures.sh"
  echo later >"$1/source"
  git -C "$1" -c user.name=nobody -c user.email=nobody@localhost commit --quiet -a -m later
  set_figure "$2" size 12 weigh.sh' bash "$folder" "$page"
expect_row "| size | 12 | \`weigh.sh\` | $(git -C "$folder" rev-parse --short HEAD^) |"

# Sums: of a target over calls, and over the targets.
hash=$(git -C "$folder" rev-parse --short HEAD)
call add_to_figure "$page" "inputs: " a 5 fuzz.sh
call add_to_figure "$page" "inputs: " b 20 fuzz.sh
call add_to_figure "$page" "inputs: " a 300 fuzz.sh
expect_row "| inputs: a | 305 | \`fuzz.sh\` | $hash |"
expect_row "| inputs: b | 20 | \`fuzz.sh\` | $hash |"
expect_row "| inputs: all targets | 325 | \`fuzz.sh\` | $hash |"

before=$(cat "$page")
if call set_figure "$page" 'a|b' 1 x.sh 2>"$folder/printed"; then fail "a bar must be refused"; fi
grep -q 'a bar would break the table' "$folder/printed" || fail "wants the reason"
if call set_figure "$folder/source" a 1 x.sh 2>"$folder/printed"; then fail "wants marks"; fi
grep -q 'has no marks of figures' "$folder/printed" || fail "wants the reason"
[[ $(cat "$page") == "$before" ]] || fail "the page changed"
[[ $(head -n 1 "$page") == before && $(tail -n 1 "$page") == after ]] || fail "wants the text around"
