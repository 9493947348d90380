#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: examples/demo.sh [SEQUENCE] [--camera CAMERA] [--depth-offset S] [--out DIR] [-h]

Builds the program and runs its main job: removes the features of moving objects on every frame of a
sequence (TUM RGB-D or BONN layout, with masks in SEQUENCE/masks), or, without one, of a small scene
that it renders first. Prints a table and writes pictures, frames.csv and summary.json into DIR.
Installs the packages that are missing (Debian, Ubuntu; as root or by sudo without password), or says
which.

  --camera CAMERA  file, or tum1, tum2, tum3 or bonn; default: SEQUENCE/camera.yaml
  --depth-offset S pairs each image with the depth of S seconds later
  --out DIR        default: out/demo in the repository

  DYNFILTER_BUILD_DIR  folder of the build, default build/release in the repository
END
}

sequence=
out=
options=()
while (($#)); do
  case "$1" in
    --out | --camera | --depth-offset)
      [[ $# -ge 2 ]] || { usage >&2; exit 2; }
      if [[ $1 == --out ]]; then out=$2; else options+=("$1" "$2"); fi
      shift
      ;;
    --out=*) out=${1#--out=} ;;
    -h | --help)
      usage
      exit
      ;;
    -*)
      echo "There is no option $1" >&2
      usage >&2
      exit 2
      ;;
    *)
      [[ -z $sequence && -n $1 ]] || { usage >&2; exit 2; }
      sequence=$1
      ;;
  esac
  shift
done

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
out=$(realpath -m "${out:-$root/out/demo}")
[[ -z $sequence || -d $sequence ]] || die "$sequence is no folder"

build_program "$root"

if [[ -z $sequence ]]; then
  log "Rendering a scene"
  sequence=${out}_scene
  "$dynfilter" synth "$sequence" --overwrite
fi
log "Filtering $sequence"
"$dynfilter" run "$sequence" "${options[@]}" --out "$out"

if python3 -c 'import matplotlib' 2>/dev/null; then
  python3 "$root/examples/report.py" "$out" "$out.html"
else
  log "For a page of pictures, install python3-matplotlib and run examples/report.py $out $out.html"
fi
log "The program is $dynfilter"
cat <<END
Filter a sequence of your own:  $dynfilter run SEQUENCE --out DIR
See what else it does:          $dynfilter --help
Install it and the libraries:   cmake --install $build_dir --prefix ~/.local
END
