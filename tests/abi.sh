#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail
exec </dev/null # no command may wait for input

usage() {
  cat <<'END'
usage: tests/abi.sh [-h] COMMIT

Compares the binary interface of the compiled components with that of an earlier commit: both are
built as shared libraries, and abidiff (package abigail-tools) lists what changed in the types and
functions of the public headers. Run it with the last version's commit or tag before a patch version
is released. Fails if anything but additions changed.

  DYNFILTER_BUILD_DIR         folder of both builds, default build/abi
  CMAKE_BUILD_PARALLEL_LEVEL  jobs at a time, default: one a core
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"

case "${1:-}" in
  -h | --help)
    usage
    exit
    ;;
  '' | -*)
    usage >&2
    exit 2
    ;;
esac
if (($# != 1)); then
  usage >&2
  exit 2
fi
commit=$(git -C "$root" rev-parse --verify --quiet "$1^{commit}") || die "'$1' is no commit of this repository"
folder=$(realpath -m "${DYNFILTER_BUILD_DIR:-$root/build/abi}")
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
readonly commit folder jobs

need_build_packages abigail-tools
find_configure_options

# build_libraries <sources> <folder>: installs the compiled components there, as shared libraries.
build_libraries() {
  cmake -S "$1" -B "$2/build" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=Debug \
    -DCMAKE_CXX_FLAGS_DEBUG="-g -Og" -DBUILD_SHARED_LIBS=ON -DCMAKE_INSTALL_PREFIX="$2/installed" \
    -DCMAKE_INSTALL_LIBDIR=lib -DDYNFILTER_BUILD_TESTS=OFF -DDYNFILTER_BUILD_EXAMPLES=OFF \
    -DDYNFILTER_BUILD_TOOLS=OFF >/dev/null
  cmake --build "$2/build" -j "$jobs" --target install >"$2/build.log" ||
    die "the build of $1 failed: $(tail -20 "$2/build.log")"
}

log "Building the libraries of $1"
mkdir -p "$folder/earlier" "$folder/now"
rm -rf "$folder/earlier/sources" "$folder/earlier/installed" "$folder/now/installed"
mkdir "$folder/earlier/sources"
git -C "$root" archive "$commit" | tar -x -C "$folder/earlier/sources"
build_libraries "$folder/earlier/sources" "$folder/earlier"
log "Building the libraries of the working tree"
build_libraries "$root" "$folder/now"

log "Comparing them"
failures=0
for library in "$folder"/earlier/installed/lib/libdynfilter_*.so; do
  name=$(basename "$library")
  now=$folder/now/installed/lib/$name
  [[ -e $now ]] || die "$name is no longer built"
  # Added functions harm no program. Only public headers count, and no helper of theirs.
  status=0
  abidiff --suppressions "$root/tests/abi/internal.abignore" --no-added-syms --no-unreferenced-symbols \
    --drop-private-types \
    --headers-dir1 "$folder/earlier/installed/include" --headers-dir2 "$folder/now/installed/include" \
    "$library" "$now" || status=$?
  # Bits of the status: 1 and 2 errors, 4 a change, 8 a change that breaks programs.
  if ((status & 3)); then die "abidiff failed on $name"; fi
  if ((status == 0)); then
    echo "$name: the same"
  else
    echo "$name: changed"
    failures=$((failures + 1))
  fi
done
((failures == 0)) || die "$failures libraries changed their binary interface since $1"
log "The binary interface is that of $1."
