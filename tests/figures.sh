# shellcheck shell=bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Functions for scripts that measure, to be sourced: they keep the table between the marks
# <!-- figures: begin --> and <!-- figures: end --> of tests/README.md. A row has a name, a figure and
# the command that wrote it.

# Prints the figure of that name, without a row nothing.
#   figure <page> <name>
figure() {
  awk -F ' *[|] *' -v name="$2" '
    /<!-- figures: begin -->/ { inside = 1 }
    /<!-- figures: end -->/ { inside = 0 }
    inside && $2 == name { print $3 }' "$1"
}

# Puts the row of that name into the table: in its place, or at the end.
#   set_figure <page> <name> <figure> <command>
# shellcheck disable=SC2094  # the page is read whole before it is written
set_figure() {
  local page=$1
  [[ $2$3$4 != *'|'* ]] || {
    echo "set_figure: a bar would break the table: $*" >&2
    return 1
  }
  (
    flock 9 # two scripts may end at the same moment
    local changed
    changed=$(awk -F ' *[|] *' -v name="$2" -v row="| $2 | $3 | \`$4\` |" '
      /<!-- figures: begin -->/ { inside = 1; found = 1 }
      inside && /<!-- figures: end -->/ { inside = 0; if (!is_set) print row }
      inside && $2 == name { print row; is_set = 1; next }
      { print }
      END { if (!found) exit 1 }' "$page") || {
      echo "set_figure: $page has no marks of figures" >&2
      exit 1
    }
    printf '%s\n' "$changed" >"$page"
  ) 9<"$page"
}
