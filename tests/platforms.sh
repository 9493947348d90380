#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/platforms.sh [-h] [STEP]... [SUITE]...

Clones the last commit into a bare system of each Debian suite (default: bullseye trixie), and runs
steps of tests/run.sh there, which installs what it needs. A step takes half an hour on two idle
cores, and 6 gigabytes while it runs. Needs root and debootstrap.

  STEP      sanitized, clang, dev: those of tests/run.sh, by that suite's compilers; default: all three

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

steps=() suites=()
for argument in "$@"; do
  case "$argument" in
    -h | --help)
      usage
      exit
      ;;
    sanitized | clang | dev) steps+=("$argument") ;;
    -*)
      usage >&2
      exit 2
      ;;
    *) suites+=("$argument") ;;
  esac
done
((${#steps[@]} > 0)) || steps=(sanitized clang dev)
((${#suites[@]} > 0)) || suites=(bullseye trixie)
readonly steps suites

make_scratch platforms

# try_step <suite> <system> <step> <variable>...
try_step() {
  local suite=$1 system=$2 step=$3
  shift 3
  log "$suite: tests/run.sh $step"
  in_system "$system" env "$@" bash /srv/dynfilter/tests/run.sh "$step" ||
    die "$suite: tests/run.sh $step failed"
}

try_suite() {
  local suite=$1 system="$scratch/$1" step
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
  for step in "${steps[@]}"; do try_step "$suite" "$system" "$step" "${variables[@]}"; done
  umount "$system/proc"
  rm -rf --one-file-system "$system"
}

for suite in "${suites[@]}"; do try_suite "$suite"; done
log "The steps ${steps[*]} passed on ${suites[*]}."
