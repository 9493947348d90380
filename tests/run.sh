#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/run.sh [--all] [-h]

Builds the library and runs its tests: first the unit tests under the address and
undefined-behaviour sanitizers, then all tests in the dev build, whose ctest summary comes last.
Installs the packages that are missing (Debian, Ubuntu; as root or by sudo without password), or says
which.

  --all  slow tests too, the unit tests built by clang, and optimised and hardened as C++20, those of
         threads under the thread sanitizer, some minutes of fuzzing, and some tests under valgrind;
         in bare systems, if root runs this, the Debian packages, and the core on ARM64; the
         documentation; checks of format and scripts, which are skipped otherwise where their tools are
         missing

  DYNFILTER_BUILD_DIR         folder of the dev build, default build/dev; others lie beside it
  DYNFILTER_DATA_DIR          folder with recorded data for tests that can use it
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core
END
}

all=no
for argument in "$@"; do
  case "$argument" in
    --all) all=yes ;;
    -h | --help)
      usage
      exit
      ;;
    *)
      usage >&2
      exit 2
      ;;
  esac
done

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"

# An absolute path: the steps below change folders.
dev_dir=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/dev}")
if [[ -n ${DYNFILTER_BUILD_DIR:-} ]]; then other_dirs="$dev_dir-"; else other_dirs="$root/build/"; fi
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
if [[ $all == yes ]]; then not_these=consumers; else not_these='consumers|slow'; fi
readonly dev_dir other_dirs jobs not_these

# Spells out the presets of CMakePresets.json, because older CMake than 3.20 cannot read them.
unit_tests_only=(-DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_TOOLS=OFF)

# configure <folder> <option of cmake>...
configure() {
  local folder=$1
  shift
  cmake -S "$root" -B "$folder" "${configure_options[@]}" "$@"
}

# build <folder> <option of cmake>...
build() {
  configure "$@"
  cmake --build "$1" -j "$jobs"
}

# run_tests <folder> <option of ctest>...
run_tests() {
  local folder=$1
  shift
  (cd "$folder" && ctest --output-on-failure -j "$jobs" "$@")
}

# With _DEBUG, OpenCV checks each access to a matrix against its size.
sanitized() {
  log "Unit tests under the address and undefined-behaviour sanitizers"
  build "${other_dirs}asan-ubsan" "${unit_tests_only[@]}" -DCMAKE_BUILD_TYPE=Debug \
    -DCMAKE_CXX_FLAGS_DEBUG="-g -O1 -D_GLIBCXX_ASSERTIONS -D_DEBUG" -DDYNFILTER_SANITIZE=address,undefined
  ASAN_OPTIONS=halt_on_error=1:detect_leaks=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 \
    LSAN_OPTIONS="suppressions=$root/tests/lsan.supp:print_suppressions=0" \
    run_tests "${other_dirs}asan-ubsan" -LE "$not_these"
}

# Builds and runs only the tests with the label `threads`.
threads_sanitized() {
  log "Tests of threads under the thread sanitizer"
  local folder=${other_dirs}tsan
  configure "$folder" "${unit_tests_only[@]}" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DDYNFILTER_SANITIZE=thread
  cmake --build "$folder" -j "$jobs" --target threads_tests
  TSAN_OPTIONS="halt_on_error=1:suppressions=$root/tests/tsan.supp:print_suppressions=0" \
    run_tests "$folder" -L threads --no-tests=error
}

by_clang() {
  log "Unit tests, built by clang"
  build "${other_dirs}clang" "${unit_tests_only[@]}" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_CXX_COMPILER=clang++
  run_tests "${other_dirs}clang" -LE "$not_these|repository"
}

# The flags of the preset `hardened`, and what hosts choose: a newer language, all instructions of this
# processor, and a unity build.
hardened() {
  log "Unit tests, optimised and hardened, as C++20"
  build "${other_dirs}hardened" "${unit_tests_only[@]}" -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_CXX_FLAGS_RELEASE="-O3 -march=native -D_GLIBCXX_ASSERTIONS -D_FORTIFY_SOURCE=2 -fstack-protector-strong" \
    -DCMAKE_CXX_STANDARD=20 -DCMAKE_UNITY_BUILD=ON
  run_tests "${other_dirs}hardened" -LE "$not_these|repository"
}

# Runs tests of code that handles memory directly, with the programs of the dev build.
under_valgrind() {
  log "Some unit tests under valgrind"
  local name
  for name in instance features labels keep_static edge_compensator depth_compensator dynamic_filter; do
    if [[ -x $dev_dir/tests/${name}_test ]]; then
      valgrind --quiet --error-exitcode=1 --leak-check=full --show-leak-kinds=definite \
        --errors-for-leak-kinds=definite "$dev_dir/tests/${name}_test" --gtest_brief=1
    fi
  done
}

# Fuzzes all targets under the sanitizers, from their corpus.
fuzzed() {
  log "Some minutes of fuzzing"
  DYNFILTER_BUILD_DIR=${other_dirs}fuzz bash "$root/tests/fuzz/long_run.sh" 240
}

# Needs root and debootstrap, which makes the bare system.
packaged() {
  log "The Debian packages in bare systems"
  if [[ $EUID -ne 0 ]]; then
    log "SKIPPED: only root can make a bare system"
  else
    bash "$root/tests/packages.sh"
  fi
}

on_arm64() {
  log "The core's tests on ARM64, under qemu"
  if [[ $EUID -ne 0 ]]; then
    log "SKIPPED: only root can make a bare system"
  else
    bash "$root/tests/arm64.sh"
  fi
}

packages=(libbenchmark-dev python3-numpy)
# The tests of networks make their models with it; without it they are skipped.
if is_available python3-onnx; then packages+=(python3-onnx); fi
dev_options=(-DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
  -DDYNFILTER_BUILD_BENCHMARKS=ON)
if is_available libcli11-dev; then
  packages+=(libcli11-dev nlohmann-json3-dev)
  dev_options+=(-DDYNFILTER_BUILD_TOOLS=ON)
else
  log "This release has no package libcli11-dev: the program dynfilter is neither built nor tested"
  dev_options+=(-DDYNFILTER_BUILD_TOOLS=OFF)
fi
# The Python module, and its tests.
if is_available pybind11-dev; then packages+=(pybind11-dev python3-dev python3-mypy python3-pytest); fi
if [[ $all == yes ]]; then
  packages+=(clang libclang-rt-dev valgrind clang-format shellcheck doxygen)
  if is_available chromium; then packages+=(chromium); fi # Ubuntu has none outside its store
fi
need_build_packages "${packages[@]}"
pybind11_version=$(dpkg-query -W -f '${Version}' pybind11-dev 2>/dev/null || true)
if [[ -n $pybind11_version ]] && dpkg --compare-versions "$pybind11_version" ge 2.9; then
  dev_options+=(-DDYNFILTER_BUILD_PYTHON=ON)
else
  log "There is no pybind11 2.9: the Python module is neither built nor tested"
fi
find_configure_options
# Only with the compiler that we test with: others have other warnings.
if [[ $("${CXX:-c++}" -dumpversion) == 12* ]]; then
  configure_options+=(-DDYNFILTER_WARNINGS_AS_ERRORS=ON)
fi

sanitized
if [[ $all == yes ]]; then
  threads_sanitized
  by_clang
  hardened
  fuzzed
  packaged
  on_arm64
fi

log "All tests"
build "$dev_dir" "${dev_options[@]}"
if [[ $all == yes ]]; then
  under_valgrind
  run_tests "$dev_dir"
else
  run_tests "$dev_dir" -LE slow
fi
