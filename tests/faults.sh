#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/faults.sh [--readme] [-h]

Builds the tests and the program, runs those tests that let allocations fail, that kill the program at
any moment, and that let each change of a folder fail, and counts the faults. It counts nothing if a
test fails.

  --readme  put the counts into the table of figures in tests/README.md

  DYNFILTER_BUILD_DIR         folder of the build, default build/faults
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
# shellcheck source-path=SCRIPTDIR source=figures.sh
source "$root/tests/figures.sh"
readme=no
for argument in "$@"; do
  case "$argument" in
    --readme) readme=yes ;;
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
folder=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/faults}")
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
readonly readme folder jobs

need_tool_packages
find_configure_options
log "Building"
cmake -S "$root" -B "$folder" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_PYTHON=OFF -DDYNFILTER_BUILD_TOOLS=ON >/dev/null
cmake --build "$folder" -j "$jobs"

# A line for each test: how many faults, and of what kind.
counts=$folder/fault_counts.txt
readonly counts
: >"$counts"
log "Running the tests"
memory='failed_allocation|failed_allocation_calls|file_memory|mask_propagator_memory|motion_memory|plugin_failures|silhouette_lag_memory'
(cd "$folder" && DYNFILTER_FAULT_COUNTS=$counts ctest --output-on-failure -j "$jobs" --no-tests=error \
  -R "^($memory)\.|\.sixty_kills\$|^failing_disk\.every_change\$")

for what in 'failed allocations' 'kills of the program' 'failed changes of a folder'; do
  count=$(awk -v what="$what" '{ number = $1; sub(/^[0-9]+ /, "") } $0 == what { sum += number }
    END { print sum + 0 }' "$counts")
  echo "$what: $count"
  if ((count == 0)); then
    echo "error: no test counted its $what" >&2
    exit 1
  fi
  if [[ $readme == yes ]]; then
    set_figure "$root/tests/README.md" "survived: $what" "$count" "tests/faults.sh --readme"
  fi
done
