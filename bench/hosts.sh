#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

set -euo pipefail

usage() {
  cat <<'END'
usage: bench/hosts.sh [--levels LIST] [--seeds LIST] [--runs N] [--out DIR] [--readme] [-h] [SEQUENCE...]

Runs systems of others that Debian's packages hold, with masks that dynfilter writes: COLMAP on every
eighth image, and OpenCV's odometries of RGB-D images on every frame. The scenes are levels of the
rendered scene with seeds that tuned nothing; given SEQUENCES (TUM's layout, with masks/ and a camera.yaml)
join OpenCV's rows. Prints an error in mm for the hosts without masks (off), with the masks as they are,
with those of `dynfilter masks --refine`, and with exact ones: the median over seeds and runs; in brackets
the least and the greatest. COLMAP's is that of camera centres after a similarity, OpenCV's the ATE.
Builds the program first. Prints each result as it comes. Takes a quarter of an hour on two idle
cores, with three seeds half an hour.

  --levels LIST  default near_crowd,medium,hard,cross
  --seeds LIST   default 301
  --runs N       of COLMAP with different random numbers, default 1: its start is a lottery
  --readme       put the table into bench/README.md, and bars of it into README.md
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
levels=near_crowd,medium,hard,cross
seeds=301
runs=1
out=$root/out/hosts
readme=no
sequences=()
while (($#)); do
  case "$1" in
    --levels | --seeds | --runs | --out)
      [[ $# -ge 2 ]] || { usage >&2; exit 2; }
      declare "${1#--}=$2"
      shift
      ;;
    --readme) readme=yes ;;
    -h | --help)
      usage
      exit
      ;;
    -*)
      usage >&2
      exit 2
      ;;
    *) sequences+=("$(realpath "$1")") ;;
  esac
  shift
done
out=$(realpath -m "$out")

# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$root/cmake/setup.sh"
build_program "$root"
need_packages colmap libopencv-contrib-dev python3
export out dynfilter

camera_of() { # SCENE: fx fy cx cy, and units of depth a metre
  awk '/\.(fx|fy|cx|cy):|^DepthMapFactor:/ { value[$1] = $2 }
    END { print value["Camera.fx:"], value["Camera.fy:"], value["Camera.cx:"], value["Camera.cy:"],
      value["DepthMapFactor:"] }' "$1/camera.yaml"
}

# Renders a level (LEVEL SEED) or links a sequence (SEQUENCE), and writes its masks of every kind.
prepare() {
  local name=$1${2:+_$2} scene truth
  [[ $# == 2 ]] || name=$(basename "$1")
  scene=$out/$name
  mkdir -p "$scene"
  if [[ $# == 2 ]]; then
    "$dynfilter" synth "$scene/sequence" --level "$1" --seed "$2" --frames 80 --overwrite
  else
    ln -sfn "$1" "$scene/sequence"
  fi
  mask() {
    "$dynfilter" masks "$scene/sequence" --format colmap --missing-masks keep --overwrite --out "$scene/$1" "${@:2}"
  }
  truth=$scene/sequence/masks_true
  if [[ $# == 1 && -d $scene/sequence/masks_moving ]]; then truth=$scene/sequence/masks_moving; fi
  mask masks --margin 4 && mask refined --margin 4 --refine && { [[ ! -d $truth ]] || mask exact --masks "$truth"; }
}

# Prints "pairs error_mm" of a trajectory.
error_of() { # TRAJECTORY SCENE [--scale]
  "$dynfilter" eval "$1" "$2/sequence/groundtruth.txt" "${@:3}" 2>/dev/null |
    awk '$1 == "pairs" { pairs = $2 } $1 == "ate_rmse_m" { error = 1000 * $2 }
      END { print pairs + 0, pairs ? error : "inf" }'
}

# Prints a trajectory in TUM's format from COLMAP's images.txt: every other line has QW QX QY QZ TX TY TZ
# of the camera from the world, and the image's name, which is its time.
centres_of() {
  awk '!/^#/ && ++n % 2 {
    w = $2; x = -$3; y = -$4; z = -$5
    cx = 2 * (y * $8 - z * $7); cy = 2 * (z * $6 - x * $8); cz = 2 * (x * $7 - y * $6)
    sub(/\.[a-z]*$/, "", $10)
    print $10, -($6 + w * cx + y * cz - z * cy), -($7 + w * cy + z * cx - x * cz), \
      -($8 + w * cz + x * cy - y * cx), x, y, z, w
  }' "$1"
}

run_colmap() { # NAME KIND RUN
  local scene=$out/$1 work=$out/$1/colmap_$2_$3 masks=() cpu_s model best=0 count
  rm -rf "$work"
  mkdir -p "$work/models"
  read -r fx fy cx cy _ < <(camera_of "$scene/sequence")
  find "$scene/sequence/rgb/" -name '*.png' -printf '%f\n' | sort | awk 'NR % 8 == 1' >"$work/list.txt"
  [[ $2 == off ]] || masks=(--ImageReader.mask_path "$scene/$2")
  TIMEFORMAT='%U'
  cpu_s=$({ time {
    set -- --random_seed "$3" --database_path "$work/data.db"
    colmap feature_extractor "$@" --image_path "$scene/sequence/rgb" --image_list_path "$work/list.txt" \
      --ImageReader.single_camera 1 --ImageReader.camera_model PINHOLE "${masks[@]}" \
      --ImageReader.camera_params "$fx,$fy,$cx,$cy" --SiftExtraction.use_gpu 0 --SiftExtraction.num_threads 1 \
      --SiftExtraction.max_image_size 400
    colmap exhaustive_matcher "$@" --SiftMatching.use_gpu 0 --SiftMatching.num_threads 1
    colmap mapper "$@" --image_path "$scene/sequence/rgb" --output_path "$work/models" \
      --Mapper.ba_refine_focal_length 0 --Mapper.ba_refine_extra_params 0 --Mapper.init_min_tri_angle 8 \
      --Mapper.num_threads 1
  } >"$work/log.txt" 2>&1 || true; } 2>&1)
  : >"$work/best.txt"
  for model in "$work"/models/*/; do # the largest of the models
    [[ -d $model ]] || continue
    colmap model_converter --input_path "$model" --output_path "$model" --output_type TXT >>"$work/log.txt" 2>&1
    centres_of "$model/images.txt" >"$model/centres.txt"
    count=$(wc -l <"$model/centres.txt")
    if ((count > best)); then best=$count && cp "$model/centres.txt" "$work/best.txt"; fi
  done
  echo "$(error_of "$work/best.txt" "$scene" --scale)" "$(wc -l <"$work/list.txt")" "$cpu_s"
}

run_opencv() { # NAME KIND METHOD
  local scene=$out/$1 folder=- cpu_s
  [[ $2 == off ]] || folder=$scene/$2
  TIMEFORMAT='%U'
  # shellcheck disable=SC2046  # five words
  cpu_s=$({ time "$out/rgbd_odometry" "$scene/sequence" "$folder" "$3" $(camera_of "$scene/sequence") \
    >"$scene/$3_$2.txt"; } 2>&1) || die "$cpu_s"
  echo "$(error_of "$scene/$3_$2.txt" "$scene")" "$(wc -l <"$scene/$3_$2.txt")" "$cpu_s"
}

# Does one line of the list of work; prints it, if it measures, with what came out.
work() {
  local figures
  case "$1" in
    prepare)
      prepare "${@:2}" >"$out/prepare_$(basename "$2")_${3-}.txt" 2>&1 || die "$* failed, see $out/prepare_*.txt"
      ;;
    COLMAP) figures=$(run_colmap "$3" "$4" "$5") && echo "$@" "$figures" ;;
    *) figures=$(run_opencv "$3" "$4" "$1") && echo "$@" 1 "$figures" ;;
  esac
}
export -f work prepare camera_of error_of centres_of run_colmap run_opencv die
in_parallel() { xargs -P "$(nproc)" -I{} bash -euo pipefail -c 'work {}'; }

mkdir -p "$out"
# Another release may lack the module.
methods=()
if g++ -std=c++17 -O2 "$root/bench/rgbd_odometry.cpp" -o "$out/rgbd_odometry" -I/usr/include/opencv4 \
  -lopencv_rgbd -lopencv_calib3d -lopencv_imgcodecs -lopencv_core 2>"$out/rgbd_odometry.txt"; then
  methods=(Rgbd RgbdICP)
else
  log "Without OpenCV's odometry, see $out/rgbd_odometry.txt"
fi

log "Rendering, and writing masks"
{
  for level in ${levels//,/ }; do
    for seed in ${seeds//,/ }; do echo "prepare $level $seed"; done
  done
  for sequence in "${sequences[@]}"; do echo "prepare '$sequence'"; done
} | in_parallel

log "Running COLMAP and OpenCV's odometry; results in $out"
{
  for kind in off masks refined exact; do
    for level in ${levels//,/ }; do
      for seed in ${seeds//,/ }; do
        for ((run = 1; run <= runs; ++run)); do echo "COLMAP $level ${level}_$seed $kind $run"; done
        for method in "${methods[@]}"; do echo "$method $level ${level}_$seed $kind"; done
      done
    done
    for sequence in "${sequences[@]}"; do
      name=$(basename "$sequence")
      [[ -d $out/$name/$kind || $kind == off ]] || continue
      for method in "${methods[@]}"; do echo "$method $name $name $kind"; done
    done
  done
} | in_parallel | tee "$out/results.txt" >&2

# Columns: host, level, scene, kind, run, poses, error, images, CPU s.
table=$(
  python3 - "$out/results.txt" "$out/bars.txt" "$levels" <<'END'
import statistics, sys

KINDS = ["off", "masks", "refined", "exact"]
rows = {}
for line in open(sys.argv[1]):
    host, level, _, kind, _, *figures = line.split()
    rows.setdefault((host, level), {}).setdefault(kind, []).append([float(figure) for figure in figures])


def text(error_mm):
    return "none" if error_mm == float("inf") else format(error_mm, ".1f" if error_mm < 10 else ".0f")


def cell(results):
    if not results:
        return "-"
    poses, errors_mm, images, cpu_s = zip(*results)
    spread = f" ({text(min(errors_mm))}..{text(max(errors_mm))})" if len(results) > 1 else ""
    return (f"{text(statistics.median(errors_mm))}{spread} {100 * sum(poses) / sum(images):.0f}% "
            f"{statistics.mean(cpu_s):.0f}s")


print("error, mm; images with a pose; CPU".ljust(34), *(kind.rjust(24) for kind in KINDS))
for (host, level), kinds in sorted(rows.items(), key=lambda row: row[0][0]):
    print(f"{host} {level}".ljust(34), *(cell(kinds.get(kind)).rjust(24) for kind in KINDS))

def median_mm(results):
    return statistics.median(result[1] for result in results)


def bar(results, worst_mm):
    error_mm = median_mm(results)
    share = sum(result[0] for result in results) / sum(result[2] for result in results)
    length = max(1, round(20 * min(1, error_mm / worst_mm)))
    return f"{'█' * length} {text(error_mm)} mm, {100 * share:.0f} %".ljust(43)


# Each bar is the median of all rows of its kind.
columns = {"COLMAP, rendered people": {}, "cv::rgbd, recorded people": {}}
for (host, level), kinds in rows.items():
    is_rendered = level in sys.argv[3].split(",")
    if is_rendered == (host == "COLMAP"):
        for kind, results in kinds.items():
            columns[list(columns)[host != "COLMAP"]].setdefault(kind, []).extend(results)
columns = {title: kinds for title, kinds in columns.items() if kinds}
with open(sys.argv[2], "w") as bars:
    print(" " * 16 + "".join(title.ljust(43) for title in columns).rstrip(), file=bars)
    for kind, name in zip(KINDS, ["nothing removed", "masks alone", "refined masks"]):
        cells = (bar(kinds[kind], median_mm(kinds["off"])) for kinds in columns.values())
        print(name.ljust(16) + "".join(cells).rstrip(), file=bars)
END
)
printf '%s\n' "$table" | tee "$out/table.txt"
if [[ $readme == yes ]]; then
  fill_marks "$root/bench/README.md" "host tables" "$table"
  fill_marks "$root/README.md" "host bars" "$(cat "$out/bars.txt")"
fi
