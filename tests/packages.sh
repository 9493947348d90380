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

# Prints a block of the page about Python: python_block <number>
python_block() {
  awk -v wanted="$1" '/^```python/ { inside = ++count == wanted; next } /^```/ { inside = 0 } inside' \
    "$root/examples/python/README.md"
}

try_suite() {
  local suite=$1 maker="$scratch/$1-maker" user="$scratch/$1-user" build=/srv/build
  log "$suite: a bare system that makes the packages"
  make_system "$suite" "$maker"
  copy_repository "$root" "$maker"
  install_in "$maker" g++ cmake ninja-build libopencv-dev libeigen3-dev libcli11-dev nlohmann-json3-dev \
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
find_package(dynfilter 0.3 REQUIRED COMPONENTS segmenters motion evaluation plugin)
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

  log "$suite: a host in the shape of ORB-SLAM"
  cp -r "$root/tests/consumers/orb_slam_host" "$user/srv/host"
  cat >"$user/srv/host/settings.yaml" <<'END'
%YAML:1.0
---
Camera.type: "PinHole"
Camera.RGB: 0
Camera.bf: 40.0
DepthMapFactor: 5000.0
ORBextractor.nFeatures: 500
ORBextractor.scaleFactor: 1.2
ORBextractor.nLevels: 4
ORBextractor.iniThFAST: 10
dynfilter.mask_folder: "/srv/host_data/left/masks"
dynfilter.output_folder: "/srv/host_data/out"
END
  in_system "$user" sh -ec 'cd /srv/host && cmake -B build >/dev/null 2>&1 && cmake --build build &&
    dynfilter synth ../host_data/left --frames 12 --width 320 --height 240 --persons 1 --seed 4 &&
    build/consumer rgbd /srv/host_data settings.yaml'
  (($(wc -l <"$user/srv/host_data/out/frames.csv") > 12)) || die "$suite: the host did not filter 12 frames"

  log "$suite: the Python module"
  # A frame and a sequence, as the page prints them, and what the page leaves to the reader.
  mkdir "$user/srv/python"
  {
    cat <<'END'
import numpy
height, width = 240, 320
image = numpy.zeros((height, width, 3), numpy.uint8)
depth = numpy.full((height, width), 10000, numpy.uint16)
masks = numpy.zeros((1, height, width), bool)
masks[0, 60:180, 100:160] = True
boxes = numpy.array([[100, 60, 160, 180]], float)
points = numpy.array([[130, 100], [300, 20], [10, 200]], numpy.float32)
descriptors = numpy.arange(3 * 32, dtype=numpy.uint8).reshape(3, 32)
END
    python_block 1
    cat <<'END'
assert points.tolist() == [[300, 20], [10, 200]] and descriptors[:, 0].tolist() == [32, 64]
tracked = []
def detect(image):
    return points, descriptors
def track(frame, points, descriptors):
    tracked.append(len(points))
END
    python_block 2
    echo 'assert len(tracked) == 5'
  } >"$user/srv/python/page.py"
  in_system "$user" sh -ec 'cd /srv && python3 python/page.py'

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
