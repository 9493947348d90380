# shellcheck shell=bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Shared functions of this repository's scripts, to be sourced. On Debian and Ubuntu they install
# the tools that a script needs, but only as root or if sudo asks no password. They change nothing
# else.

# Prints progress, set apart from the tools' output.
log() {
  printf '\n== %s\n' "$*"
}

die() {
  printf '\n%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

is_installed() {
  dpkg-query -W -f '${db:Status-Status}\n' "$1" 2>/dev/null | grep -qx installed
}

# Runs a command as root, or fails.
as_root() {
  if [[ $EUID -eq 0 ]]; then
    "$@"
  elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    sudo -n "$@"
  else
    return 1
  fi
}

# Updates Debian's package lists, once: a fresh container has none.
update_package_lists() {
  if [[ -z ${package_lists_are_fresh:-} ]]; then
    as_root apt-get -qq update </dev/null || return
    package_lists_are_fresh=yes
  fi
}

# Installs the packages that are missing. If it may not, ends the script with the command to run.
#   need_packages <package>...
need_packages() {
  local package missing=()
  if ! command -v dpkg-query >/dev/null; then
    log "This is neither Debian nor Ubuntu. Install what they call: $*"
    return
  fi
  for package in "$@"; do
    is_installed "$package" || missing+=("$package")
  done
  if ((${#missing[@]} == 0)); then return; fi

  local install=(apt-get install --yes --no-install-recommends "${missing[@]}")
  as_root true || die "packages are missing, and only root can install them. Run:
  sudo apt-get update && sudo ${install[*]}"
  log "Installing ${missing[*]} and their dependencies; this can take some minutes"
  update_package_lists || die "apt-get update failed"
  # Without this, packages ask questions (the time zone). Another apt may be running, so wait for
  # it. Errors appear on standard error.
  as_root env DEBIAN_FRONTEND=noninteractive "${install[@]}" -qq -o Dpkg::Use-Pty=0 \
    -o DPkg::Lock::Timeout=600 </dev/null >/dev/null || die "${install[*]} failed"
}

# Tells whether a package is installed or can be: not every release has every package.
is_available() {
  if ! command -v dpkg-query >/dev/null || is_installed "$1"; then return; fi
  if as_root true; then update_package_lists || die "apt-get update failed"; fi
  [[ -n $(apt-cache --quiet=0 madison "$1" 2>/dev/null) ]]
}

# Installs the packages that build and test the library. Our builds use Ninja; `make` and GoogleTest
# are for `cmake -S . -B build` without options.
need_build_packages() {
  need_packages g++ cmake make ninja-build pkg-config libopencv-dev libeigen3-dev libgtest-dev "$@"
}

# Installs the packages that the program dynfilter needs, too. Not every release has libcli11-dev.
need_tool_packages() {
  is_available libcli11-dev || die "this release has no package libcli11-dev, which the program needs.
The library and its tests do without: bash tests/run.sh"
  local packages=(libcli11-dev nlohmann-json3-dev)
  if is_available cppzmq-dev; then packages+=(cppzmq-dev); fi # masks of another process
  need_build_packages "${packages[@]}"
}

# Sets the array `configure_options` for every build: Ninja, and ccache if it is installed.
# Checkouts in different folders share ccache's results.
# shellcheck disable=SC2034  # for the script that sources this file
find_configure_options() {
  configure_options=(-G Ninja)
  if command -v ccache >/dev/null; then
    configure_options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
    export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)}
    export CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-true}
  fi
}

# Builds the libraries and the program dynfilter as Release, ready to be installed. Sets the variables
# `build_dir` and `dynfilter`, the program's path. DYNFILTER_BUILD_DIR may name the folder.
#   build_program <repository>
# shellcheck disable=SC2034  # for the script that sources this file
build_program() {
  build_dir=$(realpath -m "${DYNFILTER_BUILD_DIR:-$1/build/release}")
  need_tool_packages
  find_configure_options
  log "Building the libraries and the program dynfilter"
  cmake -S "$1" -B "$build_dir" "${configure_options[@]}" -DCMAKE_BUILD_TYPE=Release \
    -DDYNFILTER_BUILD_TESTS=OFF -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_TOOLS=ON \
    -DDYNFILTER_UNITY_BUILD=ON >/dev/null
  cmake --build "$build_dir"
  dynfilter=$build_dir/src/tools/dynfilter
}

# Puts a text, fenced, between the marks <!-- NAME: begin --> and <!-- NAME: end --> of a page.
#   fill_marks <file> <name> <text>
fill_marks() {
  [[ -n $3 ]] || die "there is no text to put between the marks '$2' of $1"
  if ! grep -q "<!-- $2: begin -->" "$1" || ! grep -q "<!-- $2: end -->" "$1"; then
    die "$1 has no marks '$2'"
  fi
  local page
  page=$(mktemp "$1.XXXXXX")
  awk -v name="$2" -v text="$(printf '%s\n' '```text' "$3" '```')" '
    index($0, "<!-- " name ": begin -->") { print; print text; skip = 1; next }
    index($0, "<!-- " name ": end -->") { skip = 0 }
    !skip' "$1" >"$page" || { rm "$page" && die "$1 could not be rewritten"; }
  chmod --reference="$1" "$page"
  mv "$page" "$1"
  log "updated the $2 in $1"
}
