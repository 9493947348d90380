#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Looks at the pages of the target `docs` in a browser: browser.sh <folder> <chromium>

set -euo pipefail

readonly folder=$1 chromium=$2
work=$(mktemp -d)
readonly work
trap 'rm -rf "$work"' EXIT

fail() {
  echo "browser.sh: $*" >&2
  exit 1
}

# Prints the page's elements after its scripts ran. Fails if they complain.
browse() {
  "$chromium" --headless --no-sandbox --disable-gpu --user-data-dir="$work/profile" \
    --allow-file-access-from-files --virtual-time-budget=20000 --enable-logging=stderr --v=0 \
    --dump-dom "file://$folder/$1" 2>"$work/log" || fail "no page: $(tail -n 5 "$work/log")"
  ! grep CONSOLE "$work/log" >&2 || fail "$1 complains"
}

browse index.html >"$work/index"
# The scripts have made the search box, the menu and the tree of pages.
for part in MSearchField 'id="main-menu"' page-include-dynfilter-README.html; do
  grep -qF -- "$part" "$work/index" || fail "index.html has no $part"
done

# The search knows a class, a function and a page.
for word in EdgeCompensator keep_static 'dynfilter from Python'; do
  grep -qs -- "$word" "$folder"/search/all_*.js || fail "the search does not find $word"
done
