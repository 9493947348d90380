#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Checks a rule of the house in the sources: check.sh <licences|names|format|scripts> <repository>
# Exit code 0 if it is kept, 1 with the offenders, 77 if the tool for it is not installed.

set -euo pipefail

readonly skipped=77
cd "$2"

# The files that match, but none in a folder where something was built. NUL-terminated.
files() {
  local patterns=(-name "$1")
  shift
  local pattern
  for pattern in "$@"; do patterns+=(-o -name "$pattern"); done
  find . -type d \( -name .git -o -exec test -e '{}/CMakeCache.txt' \; \) -prune -o \
    -type f \( "${patterns[@]}" \) -print0
}

# Succeeds if nothing comes in on standard input, else shows it.
nothing() {
  ! grep .
}

# Every source says whose it is and under which licence.
licences() {
  {
    files '*.hpp' '*.cpp' '*.sh' '*.py' '*.msg'
    printf '%s\0' .ci/run
  } | xargs -0 awk '
    FNR == 1 { if (file != "" && found < 2) print file; file = FILENAME; found = 0 }
    FNR <= 5 && /SPDX-(FileCopyrightText|License-Identifier): / { ++found }
    END { if (found < 2) print file }' | nothing
}

# No name of ours in the public headers is one that X11 or Windows defines as a macro. Comments,
# strings, what belongs to a namespace (std::min) and what is called are not ours.
# shellcheck disable=SC2016  # the dollars are awk's
names() {
  local name='None|Status|Success|Bool|Always|Complex|CursorShape|near|far|min|max'
  find include -name '*.hpp' -print0 | sort -z | xargs -0 awk -v name="$name" '
    {
      code = $0
      gsub(/"([^"\\]|\\.)*"/, "\"\"", code)
      sub(/\/\/.*/, "", code)
      gsub("::(" name ")[^A-Za-z0-9_]", "::_ ", code)
      if (code ~ "(^|[^A-Za-z0-9_])(" name ")([^A-Za-z0-9_(]|$)") print FILENAME ":" FNR ": " $0
    }' | nothing
}

# Formatted by the version of clang-format that .clang-format is written for.
format() {
  local program
  for program in clang-format-14 clang-format; do
    if [[ $(command "$program" --version 2>/dev/null) == *' version 14.'* ]]; then
      files '*.hpp' '*.cpp' | xargs -0 "$program" --dry-run --Werror
      return
    fi
  done
  echo "SKIPPED: there is no clang-format 14"
  exit "$skipped"
}

scripts() {
  if ! command -v shellcheck >/dev/null; then
    echo "SKIPPED: there is no shellcheck"
    exit "$skipped"
  fi
  {
    files '*.sh'
    printf '%s\0' .ci/run
  } | xargs -0 shellcheck --external-sources
}

case "$1" in
  licences | names | format | scripts) "$1" ;;
  *)
    echo "check.sh: there is no check '$1'" >&2
    exit 2
    ;;
esac
