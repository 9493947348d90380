# shellcheck shell=bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Functions for scripts that work in bare Debian systems of their own, to be sourced after setup.sh.
# The systems lie in the folder `scratch`, and go with it when the script ends.
#
#   DYNFILTER_SCRATCH_DIR  folder for `scratch`, default /var/tmp

# Makes the folder, or ends the script without root: make_scratch <name>
make_scratch() {
  [[ $EUID -eq 0 ]] || die "only root can make a bare system; run: sudo tests/$(basename "$0")"
  need_packages debootstrap
  scratch=$(mktemp -d "${DYNFILTER_SCRATCH_DIR:-/var/tmp}/dynfilter-$1.XXXXXX")
  readonly scratch
  trap clean_up_scratch EXIT
}

# Unmounts what this run mounted, and removes its systems.
clean_up_scratch() {
  local place
  for place in "$scratch"/*/proc; do
    ! mountpoint -q "$place" || umount "$place"
  done
  rm -rf --one-file-system "$scratch"
}

# make_system <suite> <folder>
make_system() {
  local suite=$1 folder=$2
  debootstrap --variant=minbase "$suite" "$folder" >"$folder.log" 2>&1 ||
    die "debootstrap failed for $suite: $(tail -1 "$folder.log")"
  mount -t proc proc "$folder/proc"
}

# in_system <folder> <command>...
in_system() {
  local folder=$1
  shift
  chroot "$folder" env -i PATH=/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/srv LANG=C.UTF-8 \
    DEBIAN_FRONTEND=noninteractive "$@"
}

# Installs packages, with nothing that they only recommend: install_in <folder> <package>...
install_in() {
  local folder=$1
  shift
  in_system "$folder" apt-get -qq update
  in_system "$folder" apt-get -qq -o Dpkg::Use-Pty=0 install --yes --no-install-recommends "$@" >/dev/null
}

# Copies a repository into a system, without its builds: copy_repository <repository> <folder>
copy_repository() {
  mkdir "$2/srv/dynfilter"
  (cd "$1" && tar -c --exclude=./build --exclude=./.git .) | tar -x -C "$2/srv/dynfilter"
}
