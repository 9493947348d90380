#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Checks a rule of the house in the sources: check.sh <check> <repository>, with a check of
# CMakeLists.txt beside this file. Exit code 0 if the rule is kept, 1 with the offenders, 77 if the
# tool for it is not installed.

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
    files '*.hpp' '*.cpp' '*.sh' '*.py' '*.pyi' '*.msg'
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

# Only detail/kernels/ names an instruction set; `doctor` asks it for the name. One header there
# defines the macro of the target.
kernels() {
  local name='_mm[0-9]*_|[a-z]mmintrin|x86intrin|arm_neon|(^|[^a-z])(avx|sse[0-9]|neon)'
  name+='|gnu::target|__attribute__.*target|__builtin_cpu|instruction_?set'
  local asked='^src/tools/doctor_command\.cpp:'
  {
    find include src \( -name '*.hpp' -o -name '*.cpp' \) \
      ! -path 'include/dynfilter/detail/kernels/*' -print0 | sort -z |
      { xargs -0 grep -nHiE "$name" || true; } | { grep -vE "$asked" || true; }
    grep -rnE 'define +DYNFILTER_(AVX|SSE)|^[^#]*gnu::target' include/dynfilter/detail/kernels \
      --include='*.hpp' --exclude=instruction_set.hpp || true
  } | nothing
}

# The lab is built as a stranger would build it: it includes public headers and its own files. No
# header of ours and no file of the library includes it.
lab_apart() {
  {
    grep -rnE '^ *# *include' src/lab | grep -vE \
      '<dynfilter/[a-z_/]+[.]hpp>|"(lab/)?[a-z_/]+[.]hpp"|<(opencv2|Eigen)/[^>]*>|<[a-z_0-9]+>' || true
    grep -rnE '^ *# *include *.dynfilter/detail/|[^a-z_]detail::' src/lab || true
    grep -rhoE '^ *# *include *"[^"]+"' src/lab | cut -d'"' -f2 | sort -u | while read -r header; do
      case "$header" in
        lab/*) [[ -e src/$header ]] ;;
        */*) false ;;
        *) [[ -n $(find src/lab -name "$header") ]] ;;
      esac || echo "src/lab includes $header"
    done
    grep -rnE '^ *# *include *["<](\.\./)*lab/' include src --exclude-dir=lab --exclude-dir=tools || true
  } | nothing
}

# Includes point down: no header of detail/ leads to a stage, the workspace or a pipeline. No header
# includes itself by a way, and no chain of our headers, each of which includes the next, is longer
# than 9.
# shellcheck disable=SC2016  # the dollars are awk's
layers() {
  lab_apart
  find include/dynfilter -name '*.hpp' -print0 | sort -z | xargs -0 awk -v longest=9 '
    # Returns the longest chain from a header on. `way` leads to it, with a space on either side.
    function chain(header, way,   i, names, count, next_chain, best) {
      if (header in chains) return chains[header]
      if (index(way, " " header " ")) { print "a circle:" way header; return "" }
      count = split(includes[header], names)
      for (i = 1; i <= count; ++i) {
        next_chain = chain(names[i], way header " ")
        if (split(next_chain, parts) > split(best, parts)) best = next_chain
      }
      return chains[header] = header (best == "" ? "" : " " best)
    }
    # Says where a header leads upwards.
    function climb(header, way,   i, names, count) {
      if (header in seen) return
      seen[header] = 1
      if (header ~ above) { print "upwards: " way header; return }
      count = split(includes[header], names)
      for (i = 1; i <= count; ++i) climb(names[i], way header " > ")
    }
    FNR == 1 { file = substr(FILENAME, length("include/dynfilter/") + 1); includes[file] = "" }
    /^#include "dynfilter\// {
      split($0, parts, "\"")
      sub("^dynfilter/", "", parts[2])
      includes[file] = includes[file] " " parts[2]
    }
    END {
      above = "^(mask_culler|edge_compensator|depth_compensator|feature_floor|workspace|stage" \
              "|pipeline|dynamic_filter|dynfilter)[.]hpp$"
      for (header in includes) {
        if (split(chain(header, " "), parts) > longest) print "too long: " chains[header]
        split("", seen)
        if (header ~ "^detail/") climb(header, "")
      }
    }' | sort | nothing
}

# A comment, and a docstring, begins with its subject or its verb.
# shellcheck disable=SC2016  # the dollars are awk's
dialect() {
  local opens='(//+[!<]*|^[ \t]*#|R"[(]|""")'
  find include src \( -name '*.hpp' -o -name '*.cpp' -o -name '*.py' -o -name '*.pyi' \) -print0 |
    sort -z | xargs -0 awk -v opens="$opens" '
    FNR == 1 { goes_on = 0 }
    {
      alone = $0 ~ "^[ \t]*(//|# )"
      if (!(alone && goes_on) && $0 ~ opens " *(Of|Those|The same|That of)($|[^A-Za-z])") {
        print FILENAME ":" FNR ": " $0
      }
      goes_on = alone && $0 !~ "^[ \t]*(//+|#) *$"
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

# Every file that states the version states that of version.hpp, the only one that programs read.
versions() {
  local version
  version=$(sed -n 's/.*DYNFILTER_VERSION_STRING "\(.*\)".*/\1/p' include/dynfilter/version.hpp)
  [[ -n $version ]] || {
    echo "include/dynfilter/version.hpp states no version"
    return 1
  }
  {
    sed -n 's|.*<version>\(.*\)</version>.*|package.xml: \1|p' package.xml
    sed -n 's|^version: \(.*\)|CITATION.cff: \1|p' CITATION.cff
    grep -m 1 '^## ' CHANGELOG.md | sed 's|## |CHANGELOG.md: |'
  } | awk -v version="$version" '
    { ++files }
    $2 != version { print $0 "; version.hpp says " version }
    END { if (files != 3) print "want a version in package.xml, CITATION.cff and CHANGELOG.md" }' |
    nothing
}

# The house stays as small as budget.txt says. Prints what there is.
budget() {
  local kind where limit found over=0 paths
  while read -r kind where limit; do
    case "$kind" in
      lines)
        IFS=, read -ra paths <<<"$where"
        found=$(git ls-files -- "${paths[@]}" ':!*/corpus/*' | xargs cat | wc -l)
        ;;
      words) found=$(git ls-files -- "$where" | xargs cat | wc -w) ;;
      options) found=$(option_fields) ;;
      settings) found=$(grep -rhoE 'keys\.(text|flag|choice|number|count|integers)\("[a-z_.]+"' "$where" | cut -d'"' -f2 | sort -u | wc -l) ;;
      *) continue ;;
    esac
    printf '%-8s %-24s %6d of %6d\n' "$kind" "$where" "$found" "$limit"
    ((found <= limit)) || over=1
  done < <(grep -v '^#' tests/repository/budget.txt)
  return "$over"
}

# Counts the fields of public option structs, but motion's.
# shellcheck disable=SC2016  # the dollars are awk's
option_fields() {
  find include -name '*.hpp' ! -path '*/motion/*' -print0 | xargs -0 awk '
    /^struct [A-Za-z]*Options/ { inside = 1 }
    /^};/ { inside = 0 }
    inside && /^  [A-Za-z][^()]*( = [^;]*|\{[^;]*\})?;/ && !/^  (static|using|friend) / { ++fields }
    END { print fields + 0 }'
}

case "$1" in
  licences | names | kernels | layers | dialect | format | scripts | versions | budget) "$1" ;;
  *)
    echo "check.sh: there is no check '$1'" >&2
    exit 2
    ;;
esac
