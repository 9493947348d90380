#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/packages.sh [--readme] [-h] [SUITE]...

Builds the Debian packages in bare systems of these suites (default: bookworm trixie), checks them
with lintian, installs them in a second bare system, uses them as a newcomer would, and removes them
again. Needs root and debootstrap, and a gigabyte or two for each suite while it runs.

  --readme  put the time and the size of the installation into README.md

  DYNFILTER_SCRATCH_DIR  folder for the systems, default /var/tmp; each run makes its own below it
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
# shellcheck source-path=SCRIPTDIR source=bare_system.sh
source "$root/tests/bare_system.sh"

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
((${#suites[@]} > 0)) || suites=(bookworm trixie)

make_scratch packages

try_suite() {
  local suite=$1 maker="$scratch/$1-maker" user="$scratch/$1-user" build=/srv/build
  log "$suite: a bare system that makes the packages"
  make_system "$suite" "$maker"
  copy_repository "$root" "$maker"
  install_in "$maker" g++ cmake ninja-build libopencv-dev libeigen3-dev libcli11-dev nlohmann-json3-dev cppzmq-dev \
    pybind11-dev python3-dev python3-mypy python3-numpy file dpkg-dev help2man lintian
  in_system "$maker" cmake -S /srv/dynfilter -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_INSTALL_PREFIX=/usr -DDYNFILTER_DEBIAN=ON -DDYNFILTER_BUILD_PYTHON=ON -DDYNFILTER_BUILD_TESTS=OFF \
    -DDYNFILTER_BUILD_EXAMPLES=OFF >/dev/null
  in_system "$maker" cmake --build "$build" -j "$(nproc)" >"$maker.build" ||
    die "$suite: the build failed: $(tail -20 "$maker.build")"
  in_system "$maker" sh -c "cd $build && cpack -G DEB && cpack -G TGZ" >"$maker.cpack" ||
    die "$suite: cpack failed: $(tail -20 "$maker.cpack")"
  log "$suite: lintian"
  in_system "$maker" sh -c "lintian --allow-root --fail-on error $build/*.deb" ||
    die "$suite: lintian found errors"

  if in_system "$maker" apt-cache show python3-scikit-build-core >/dev/null 2>&1; then
    log "$suite: pip install"
    install_in "$maker" python3-pip python3-scikit-build-core
    in_system "$maker" pip install --quiet --no-build-isolation --break-system-packages /srv/dynfilter
    in_system "$maker" sh -ec 'cd / && dynfilter --version && pip show --files dynfilter &&
      python3 -c "import dynfilter; dynfilter.DynamicFilter()"'
  fi

  log "$suite: a bare system that uses them"
  make_system "$suite" "$user"
  mkdir "$user/srv/packages"
  cp "$maker/$build"/*.deb "$user/srv/packages"
  umount "$maker/proc"
  rm -rf --one-file-system "$maker"
  in_system "$user" apt-get -qq update
  local before seconds=$SECONDS megabytes
  before=$(du -sm --one-file-system "$user" | cut -f 1)
  in_system "$user" sh -c 'apt-get -qq -o Dpkg::Use-Pty=0 install --yes --no-install-recommends \
    ./srv/packages/*.deb g++ cmake make pkg-config >/dev/null'
  in_system "$user" apt-get clean
  seconds=$((SECONDS - seconds))
  megabytes=$(($(du -sm --one-file-system "$user" | cut -f 1) - before))
  log "$suite: $seconds s and $megabytes MB for the packages, a compiler and what they need"

  log "$suite: the first program and the command line"
  mkdir "$user/srv/first"
  # The first program and the lines for CMake, as the README prints them.
  awk '/^```cpp/ { inside = 1; next } /^```/ { if (inside) exit } inside' "$root/README.md" \
    >"$user/srv/first/first_program.cpp"
  cat >"$user/srv/first/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.16)
project(first LANGUAGES CXX)
find_package(dynfilter 0.3 REQUIRED COMPONENTS segmenters remote motion evaluation plugin)
find_package(OpenCV 4 REQUIRED COMPONENTS features2d imgcodecs)
add_executable(first first_program.cpp)
target_link_libraries(first PRIVATE dynfilter::dynfilter ${OpenCV_LIBS})
END
  in_system "$user" sh -ec 'cd /srv/first && cmake -B build >/dev/null && cmake --build build'
  # shellcheck disable=SC2016  # the shell in the system runs pkg-config
  in_system "$user" sh -ec 'cd /srv/first && g++ -std=c++17 first_program.cpp -o first \
    $(pkg-config --cflags --libs dynfilter) -lopencv_features2d -lopencv_imgcodecs'
  in_system "$user" sh -ec 'dynfilter --version && ls /usr/share/man/man1/dynfilter.1*'
  in_system "$user" sh -ec 'cd /srv && dynfilter synth scene --frames 5 --width 320 --height 240 &&
    dynfilter run scene --out out' | tail -3

  log "$suite: the Python module"
  # tests/python/page_test.py runs the page's blocks.
  in_system "$user" sh -ec 'cd /srv && python3 -c "
import dynfilter, numpy
points = numpy.float32([[130, 100], [300, 20]])
filter = dynfilter.DynamicFilter()
frames = list(dynfilter.RgbdSequence(\"scene\"))
people = dynfilter.MaskFolderSegmenter(\"scene/masks\")
for frame in frames:
    labels = filter.apply(frame, people.segment(frame), points)
assert len(frames) == 5 and len(labels) == 2
"'

  log "$suite: removing them"
  in_system "$user" apt-get -qq -o Dpkg::Use-Pty=0 purge --yes libdynfilter-dev dynfilter-tools python3-dynfilter >/dev/null
  in_system "$user" sh -c "find / -xdev -name '*dynfilter*' -not -path '/srv/*' -not -path '/proc/*'" |
    { ! grep . || die "$suite: the packages left these behind"; }
  umount "$user/proc"
  rm -rf --one-file-system "$user"
  if [[ $readme == yes ]]; then
    sed -i "s/<!-- $suite: begin -->.*<!-- $suite: end -->/<!-- $suite: begin -->$seconds s, $megabytes MB<!-- $suite: end -->/" \
      "$root/README.md"
  fi
}

for suite in "${suites[@]}"; do try_suite "$suite"; done
log "The packages of ${suites[*]} were built, installed, used and removed."
