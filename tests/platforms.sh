#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/platforms.sh [--readme] [-h] [SUITE]...

Clones the last commit into a bare system of each Debian suite (default: bullseye trixie), and runs
`tests/run.sh clang dev` there, which installs what it needs: the unit tests built by that suite's
clang, and all tests but the slow ones built by its g++. A suite takes an hour on two cores, and 8
gigabytes while it runs. Needs root and debootstrap.

  --readme  put the number of tests into the table of figures in tests/README.md

  DYNFILTER_DATA_DIR          folder with recorded data, which is copied into the systems
  DYNFILTER_SCRATCH_DIR       folder for the systems, default /var/tmp; each run makes its own below it
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
# shellcheck source-path=SCRIPTDIR source=bare_system.sh
source "$root/tests/bare_system.sh"
# shellcheck source-path=SCRIPTDIR source=figures.sh
source "$root/tests/figures.sh"

suites=() readme=no
for argument in "$@"; do
  case "$argument" in
    -h | --help)
      usage
      exit
      ;;
    --readme) readme=yes ;;
    -*)
      usage >&2
      exit 2
      ;;
    *) suites+=("$argument") ;;
  esac
done
((${#suites[@]} > 0)) || suites=(bullseye trixie)
readonly suites readme

make_scratch platforms

try_suite() {
  local suite=$1 system="$scratch/$1" output="$scratch/$1.output"
  log "$suite: a bare system"
  make_system "$suite" "$system"
  install_in "$system" git ca-certificates # what a clone needs
  git clone --quiet "$root" "$system/srv/dynfilter"
  local variables=(CMAKE_BUILD_PARALLEL_LEVEL="${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}")
  if [[ -n ${DYNFILTER_DATA_DIR:-} ]]; then
    mkdir "$system/srv/recorded"
    local folder
    for folder in data models; do
      [[ ! -d $DYNFILTER_DATA_DIR/$folder ]] || cp -r "$DYNFILTER_DATA_DIR/$folder" "$system/srv/recorded"
    done
    variables+=(DYNFILTER_DATA_DIR=/srv/recorded)
  fi

  log "$suite: tests/run.sh clang dev"
  in_system "$system" env "${variables[@]}" bash /srv/dynfilter/tests/run.sh clang dev 2>&1 | tee "$output" ||
    die "$suite: tests/run.sh failed"
  local gcc clang tests
  gcc=$(in_system "$system" g++ -dumpfullversion)
  clang=$(in_system "$system" clang --version | sed -nE '1s/.*version ([0-9.]+).*/\1/p')
  # Of each run, the tests that were not skipped.
  tests=$(awk '/ tests failed out of [0-9]+$/ { if (all) print all - skipped; all = $NF; skipped = 0 }
    /^\t *[0-9]+ - .* \(Skipped\)/ { ++skipped }
    END { print all - skipped }' "$output" | paste -sd ' ')
  local of_clang=${tests% *} of_gcc=${tests#* } result
  result="$of_gcc by g++ $gcc, $of_clang unit tests by clang $clang"
  log "$suite: $result"
  if [[ $readme == yes ]]; then
    set_figure "$root/tests/README.md" "tests passed on Debian $suite" "$result" "tests/platforms.sh --readme"
  fi
  umount "$system/proc"
  rm -rf --one-file-system "$system"
}

for suite in "${suites[@]}"; do try_suite "$suite"; done
log "The tests passed on ${suites[*]}."
