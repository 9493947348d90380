#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/arm64.sh [-h]

Compiles the core and its tests for ARM64 in a bare system of Debian 12, with g++'s cross compiler
and Debian's OpenCV for ARM64, and runs them there under qemu's user mode. Needs root and debootstrap,
and two gigabytes while it runs.

  DYNFILTER_SCRATCH_DIR       folder for the system, default /var/tmp; each run makes its own below it
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
# shellcheck source-path=SCRIPTDIR source=bare_system.sh
source "$root/tests/bare_system.sh"

if (($# > 0)); then
  usage
  [[ $1 == -h ]] && exit
  exit 2
fi
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
readonly jobs
make_scratch arm64
system=$scratch/system

log "A bare system with a compiler and OpenCV for ARM64"
make_system bookworm "$system"
in_system "$system" dpkg --add-architecture arm64
install_in "$system" g++-aarch64-linux-gnu cmake ninja-build qemu-user libopencv-dev:arm64 libgtest-dev:arm64
copy_repository "$root" "$system"

log "Building the core's tests"
in_system "$system" cmake -S /srv/dynfilter -B /srv/build -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 \
  -DCMAKE_CXX_COMPILER=aarch64-linux-gnu-g++ -DCMAKE_CROSSCOMPILING_EMULATOR=/usr/bin/qemu-aarch64 \
  -DOpenCV_DIR=/usr/lib/aarch64-linux-gnu/cmake/opencv4 \
  -DDYNFILTER_BUILD_SEGMENTERS=OFF -DDYNFILTER_BUILD_MOTION=OFF -DDYNFILTER_BUILD_NETWORKS=OFF \
  -DDYNFILTER_BUILD_EVALUATION=OFF -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_TOOLS=OFF \
  >"$scratch/configure.log" ||
  die "cmake failed: $(tail -20 "$scratch/configure.log")"
in_system "$system" cmake --build /srv/build -j "$jobs" \
  --target core_tests replay_whole_filter_tests replay_depth_lbp_tests >"$scratch/build.log" ||
  die "the build failed: $(tail -20 "$scratch/build.log")"

log "Running them under qemu"
passed=0 failures=0
for program in "$system"/srv/build/tests/core_tests "$system"/srv/build/tests/fuzz/*_tests; do
  name=$(basename "$program")
  if in_system "$system" qemu-aarch64 "${program#"$system"}" --gtest_brief=1 >"$scratch/$name.log" 2>&1; then
    count=$(sed -nE 's/^\[  PASSED  \] ([0-9]+) tests?\.$/\1/p' "$scratch/$name.log")
    passed=$((passed + count))
    echo "$name: $count passed"
  else
    cat "$scratch/$name.log" >&2
    log "FAILED: $name"
    failures=$((failures + 1))
  fi
done
((failures == 0)) || die "$failures programs failed"
log "$passed tests of the core passed on ARM64"
