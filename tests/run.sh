#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/run.sh [--all] [-h] [STEP]...

Builds the library and runs its tests, in steps. Without options: first `sanitized`, then `dev`, whose
ctest summary comes last. Stops at the first step that fails. Installs the packages that are missing
(Debian, Ubuntu; as root or by sudo without password), or says which.

  --all  every step, with slow tests, the Python module, the benchmarks and the documentation
  STEP   these steps only, whose order is always this:
           sanitized  the unit tests under the address and undefined-behaviour sanitizers
           threads    the unit tests under the thread sanitizer
           clang      the unit tests, built by clang
           lint       the sources by clang-tidy, as .clang-tidy says
           hardened   the unit tests, optimised and hardened, as C++20
           fuzz       some minutes of fuzzing
           packages   the Debian packages, in bare systems (only root can make them)
           arm64      the core on ARM64, in a bare system
           valgrind   some unit tests of the dev build under valgrind
           dev        the tests of the program and of the installed package; all with --all

  DYNFILTER_BUILD_DIR         folder of the dev build, default build/dev; others lie beside it
  DYNFILTER_DATA_DIR          folder with recorded data for tests that can use it
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core
END
}

readonly all_steps=(sanitized threads clang lint hardened fuzz packages arm64 valgrind dev)
all=no wanted=' '
for argument in "$@"; do
  case "$argument" in
    --all) all=yes ;;
    sanitized | threads | clang | lint | hardened | fuzz | packages | arm64 | valgrind | dev) wanted+="$argument " ;;
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

if [[ $wanted == ' ' ]]; then
  wanted=' sanitized dev '
  if [[ $all == yes ]]; then wanted=" ${all_steps[*]} "; fi
fi
steps=()
for step in "${all_steps[@]}"; do
  if [[ $wanted == *" $step "* ]]; then steps+=("$step"); fi
done
readonly all wanted steps

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"

# An absolute path: the steps below change folders.
dev_dir=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/dev}")
if [[ -n ${DYNFILTER_BUILD_DIR:-} ]]; then other_dirs="$dev_dir-"; else other_dirs="$root/build/"; fi
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
skipped=()
readonly dev_dir other_dirs jobs

# Spells the presets out, because CMake before 3.20 cannot read them.
unit_tests_only=(-DDYNFILTER_TESTS=unit -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_TOOLS=OFF
  -DDYNFILTER_INSTALL=OFF)

# configure <folder> <option of cmake>...
configure() {
  local folder=$1
  shift
  # -g1, line numbers without variables, is quicker to build than -g.
  cmake -S "$root" -B "$folder" "${configure_options[@]}" \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O2 -g1 -DNDEBUG" "$@"
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
  if [[ $all == no ]]; then set -- "$@" -LE slow; fi
  (cd "$folder" && ctest --output-on-failure -j "$jobs" "$@")
}

# With _DEBUG, OpenCV checks each access to a matrix against its size.
step_sanitized() {
  log "Unit tests under the address and undefined-behaviour sanitizers"
  build "${other_dirs}asan-ubsan" "${unit_tests_only[@]}" -DCMAKE_BUILD_TYPE=Debug \
    -DCMAKE_CXX_FLAGS_DEBUG="-g1 -O1 -D_GLIBCXX_ASSERTIONS -D_DEBUG" -DDYNFILTER_SANITIZE=address,undefined \
    -DDYNFILTER_UNITY_BUILD=ON
  ASAN_OPTIONS=halt_on_error=1:detect_leaks=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 \
    LSAN_OPTIONS="suppressions='$root/tests/lsan.supp':print_suppressions=0" \
    run_tests "${other_dirs}asan-ubsan"
}

step_threads() {
  log "Unit tests under the thread sanitizer"
  build "${other_dirs}tsan" "${unit_tests_only[@]}" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DDYNFILTER_SANITIZE=thread -DDYNFILTER_UNITY_BUILD=ON
  TSAN_OPTIONS="halt_on_error=1:suppressions='$root/tests/tsan.supp':print_suppressions=0" \
    run_tests "${other_dirs}tsan" -LE slow
}

step_clang() {
  log "Unit tests, built by clang"
  build "${other_dirs}clang" "${unit_tests_only[@]}" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_CXX_COMPILER=clang++
  run_tests "${other_dirs}clang"
}

# Other versions have other checks. A unity build would hide what a file misses.
step_lint() {
  log "The sources by clang-tidy"
  if [[ $(clang-tidy --version) != *'version 14.'* ]]; then
    log "SKIPPED: .clang-tidy is written for clang-tidy 14"
    skipped+=("lint (there is no clang-tidy 14)")
    return
  fi
  configure "${other_dirs}lint" -DDYNFILTER_BUILD_TESTS=OFF -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
  run-clang-tidy -quiet -j "$jobs" -p "${other_dirs}lint"
}

# With what hosts choose: -O3, a newer language, and all instructions of this processor.
step_hardened() {
  log "Unit tests, optimised and hardened, as C++20"
  build "${other_dirs}hardened" "${unit_tests_only[@]}" -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_CXX_FLAGS_RELEASE="-O3 -march=native -D_GLIBCXX_ASSERTIONS -D_FORTIFY_SOURCE=2 -fstack-protector-strong" \
    -DCMAKE_CXX_STANDARD=20 -DDYNFILTER_WARNINGS_AS_ERRORS=OFF
  run_tests "${other_dirs}hardened"
}

# Fuzzes all targets under the sanitizers, from their corpus.
step_fuzz() {
  log "Some minutes of fuzzing"
  DYNFILTER_BUILD_DIR=${other_dirs}fuzz bash "$root/tests/fuzz/long_run.sh" 240
}

# Runs a script that needs root and debootstrap, which makes bare systems.
#   in_bare_systems <step> <title> <script>
in_bare_systems() {
  log "$2"
  if [[ $EUID -eq 0 ]]; then
    bash "$3"
  else
    log "SKIPPED: only root can make a bare system"
    skipped+=("$1 (only root can make a bare system)")
  fi
}

step_packages() { in_bare_systems packages "The Debian packages in bare systems" "$root/tests/packages.sh"; }

step_arm64() { in_bare_systems arm64 "The core's tests on ARM64, under qemu" "$root/tests/arm64.sh"; }

build_dev() {
  log "The dev build"
  build "$dev_dir" "${dev_options[@]}"
}

# Runs tests of code that handles memory directly, with the programs of the dev build.
step_valgrind() {
  build_dev
  log "Some unit tests under valgrind"
  valgrind --quiet --error-exitcode=1 --leak-check=full --show-leak-kinds=definite \
    --errors-for-leak-kinds=definite "$dev_dir/tests/core_tests" --gtest_brief=1 \
    --gtest_filter='Instance*:Features*:Labels*:KeepStatic*:EdgeCompensator*:DepthCompensator*'
}

step_dev() {
  build_dev
  log "All tests"
  run_tests "$dev_dir"
}

packages=(python3-numpy)
# The tests of networks make their models with it; without it they are skipped.
if is_available python3-onnx; then packages+=(python3-onnx); fi
# Without them, masks of another process are neither built nor tested.
for package in cppzmq-dev nlohmann-json3-dev python3-zmq; do
  if is_available "$package"; then packages+=("$package"); fi
done
dev_options=(-DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_EXPORT_COMPILE_COMMANDS=ON)
# Without --all, the unit tests run once, in the sanitized build.
if [[ $all == yes || $wanted == *' valgrind '* ]]; then
  dev_options+=(-DDYNFILTER_TESTS=all -DDYNFILTER_UNITY_BUILD=OFF)
else
  dev_options+=(-DDYNFILTER_TESTS=program -DDYNFILTER_UNITY_BUILD=ON)
fi
if is_available libcli11-dev; then
  packages+=(libcli11-dev nlohmann-json3-dev)
  dev_options+=(-DDYNFILTER_BUILD_TOOLS=ON)
else
  log "This release has no package libcli11-dev: the program dynfilter is neither built nor tested"
  dev_options+=(-DDYNFILTER_BUILD_TOOLS=OFF)
fi
if [[ $wanted == *' clang '* || $wanted == *' fuzz '* ]]; then
  packages+=(clang)
  if is_available libclang-rt-dev; then packages+=(libclang-rt-dev); fi # Debian 11 has it in `clang`
fi
if [[ $wanted == *' lint '* ]]; then packages+=(clang-tidy); fi
if [[ $wanted == *' valgrind '* ]]; then packages+=(valgrind); fi
if [[ $all == yes ]]; then
  packages+=(clang-format shellcheck doxygen libbenchmark-dev)
  if is_available colmap; then packages+=(colmap); fi # judges masks for it
  if is_available pybind11-dev; then packages+=(pybind11-dev python3-dev python3-mypy python3-pytest); fi
fi
need_build_packages "${packages[@]}"
if [[ $all == yes ]]; then
  dev_options+=(-DDYNFILTER_BUILD_BENCHMARKS=ON)
  pybind11_version=$(dpkg-query -W -f '${Version}' pybind11-dev 2>/dev/null || true)
  if [[ -n $pybind11_version ]] && dpkg --compare-versions "$pybind11_version" ge 2.9; then
    dev_options+=(-DDYNFILTER_BUILD_PYTHON=ON)
  else
    log "There is no pybind11 2.9: the Python module is neither built nor tested"
  fi
fi
find_configure_options
# Only with the compiler that we test with: others have other warnings.
if [[ $("${CXX:-c++}" -dumpversion) == 12* ]]; then
  configure_options+=(-DDYNFILTER_WARNINGS_AS_ERRORS=ON)
fi

passed=()
for step in "${steps[@]}"; do
  # Before the last one, whose summary ends the output.
  if ((${#steps[@]} > 1)) && [[ $step == "${steps[-1]}" ]]; then
    log "Passed: ${passed[*]:-none}"
    ((${#skipped[@]} == 0)) || printf 'Skipped: %s\n' "${skipped[@]}"
  fi
  skips=${#skipped[@]}
  "step_$step"
  ((${#skipped[@]} > skips)) || passed+=("$step")
done
