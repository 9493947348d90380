# shellcheck shell=bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Functions for scripts that measure, to be sourced: they keep the table between the marks
# <!-- figures: begin --> and <!-- figures: end --> of tests/README.md. A row has a name, a figure, the
# command that wrote it and the commit that was measured.

# Prints the commit of the tree in this folder, with a + if the tree differs from it in anything but the
# page of figures; `unknown` if git does not know.
tree_commit() {
  local hash changes
  if ! hash=$(git -C "$1" rev-parse --short HEAD 2>/dev/null) ||
    ! changes=$(git -C "$1" status --porcelain -- ':/' ':(top,exclude)tests/README.md' 2>/dev/null); then
    echo unknown
    return
  fi
  echo "$hash${changes:++}"
}

# A script sources this file before it builds: a commit that somebody makes while it measures is not the
# one that it measured.
measured_commit=$(tree_commit "$(dirname "${BASH_SOURCE[0]}")")
readonly measured_commit

# Prints the figure of that name, without a row nothing.
#   figure <page> <name>
figure() {
  awk -F ' *[|] *' -v name="$2" '
    /<!-- figures: begin -->/ { inside = 1 }
    /<!-- figures: end -->/ { inside = 0 }
    inside && $2 == name { print $3 }' "$1"
}

# Calls a function with a page while no other script changes its figures.
#   alone_with <page> <function> <argument>...
# shellcheck disable=SC2094  # the lock is on the page itself
alone_with() {
  (
    flock 9
    "$2" "$1" "${@:3}"
  ) 9<"$1"
}

# Puts the row of that name into the table: in its place, or at the end.
#   set_figure <page> <name> <figure> <command>
set_figure() { alone_with "$1" write_figure "${@:2}"; }

# Adds to the number in the row of that name, and writes the sum of all rows whose names begin like it
# into the row `<beginning>all targets`.
#   add_to_figure <page> <beginning> <rest of the name> <number> <command>
add_to_figure() { alone_with "$1" write_sums "${@:2}"; }

write_sums() {
  local page=$1 beginning=$2 name=$2$3 earlier sum
  earlier=$(figure "$page" "$name")
  write_figure "$page" "$name" "$((${earlier:-0} + $4))" "$5"
  sum=$(awk -F ' *[|] *' -v beginning="$beginning" '
    /<!-- figures: begin -->/ { inside = 1 }
    /<!-- figures: end -->/ { inside = 0 }
    inside && index($2, beginning) == 1 && $2 != beginning "all targets" { sum += $3 }
    END { printf "%d", sum }' "$page")
  write_figure "$page" "${beginning}all targets" "$sum" "$5"
}

# shellcheck disable=SC2094  # the page is read whole before it is written
write_figure() {
  local page=$1 changed
  [[ $2$3$4 != *'|'* ]] || {
    echo "set_figure: a bar would break the table: $*" >&2
    return 1
  }
  changed=$(awk -F ' *[|] *' -v name="$2" -v row="| $2 | $3 | \`$4\` | $measured_commit |" '
      /<!-- figures: begin -->/ { inside = 1; found = 1 }
      inside && /<!-- figures: end -->/ { inside = 0; if (!is_set) print row }
      inside && $2 == name { print row; is_set = 1; next }
      { print }
      END { if (!found) exit 1 }' "$page") || {
    echo "set_figure: $page has no marks of figures" >&2
    return 1
  }
  printf '%s\n' "$changed" >"$page"
}
