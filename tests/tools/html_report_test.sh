#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Tests the page of `dynfilter ablate --report` in a browser:
# html_report_test.sh <dynfilter> <chromium>

set -euo pipefail

readonly dynfilter=$1 chromium=$2
work=$(mktemp -d)
readonly work
trap 'rm -rf "$work"' EXIT
cd "$work"

fail() {
  echo "html_report_test: $*" >&2
  exit 1
}

# browse <file>: prints the page's elements after its scripts ran; writes its console to console.txt.
browse() {
  "$chromium" --headless --no-sandbox --disable-gpu --user-data-dir="$work/profile" \
    --allow-file-access-from-files --virtual-time-budget=20000 --enable-logging=stderr --v=0 \
    --dump-dom "file://$work/$1" 2>browser.txt || fail "no page: $(tail -n 5 browser.txt)"
  grep CONSOLE browser.txt >console.txt || true
}

# count <text> <file>: prints how often the text occurs
count() {
  { grep -oF -- "$1" "$2" || true; } | wc -l
}

# expect_count <number> <text> <file>
expect_count() {
  local found
  found=$(count "$2" "$3")
  [[ $found -eq $1 ]] || fail "$2 occurs $found times in $3, not $1"
}

# --- The page -------------------------------------------------------------------------------------
# Two groups of scenes: a level, and a sequence. The sequence's name looks like markup unless escaped,
# and has a word too long for a line on a telephone.
readonly word=rgbd_dataset_freiburg3_walking_halfsphere_validation
readonly scene="a <b>&\"'$word" scene_in_html="a &lt;b&gt;&amp;\"'$word"
small=(--frames 6 --width 160 --height 120)
"$dynfilter" synth "$scene" --level medium --seed 3 "${small[@]}" >/dev/null
"$dynfilter" ablate "$scene" --levels medium --seeds 1-2 "${small[@]}" --rules none,crowd_slam,paper \
  --out sweep --report page.html >tables.txt
browse page.html >page.dom
[[ ! -s console.txt ]] || fail "the page complains: $(<console.txt)"

# Counts every figure of every table.
cells=0
while IFS= read -r cell; do
  grep -qF ">$cell</td>" page.dom || fail "no cell '$cell'"
  cells=$((cells + 1))
done < <(awk -F '  +' '/^(none|crowd_slam|paper) / { for (k = 2; k <= NF; ++k) print $k }' tables.txt)
((cells >= 2 * 3 * (4 + 8 + 3))) || fail "only $cells cells in tables.txt"

# Expects all rules in the legend and in three plots of each group.
for line in 0 1 2; do expect_count 8 "<path class=\"line line$line\" d=\"M" page.dom; done

# Expects one picture of each group and rule that has any.
images=0
for rule in none crowd_slam paper; do
  for pictures in "sweep/medium_?/$rule/worst_frame.jpg" "sweep/a */$rule/worst_frame.jpg"; do
    if compgen -G "$pictures" >/dev/null; then images=$((images + 1)); fi
  done
done
((images >= 4)) || fail "only $images rules leave dynamic features"
expect_count "$images" 'src="data:image/jpeg;base64,/9j/' page.dom

grep -qF ">$scene_in_html<" page.dom || fail "the name of the scene is not there"
expect_count 0 '<b>' page.html
grep -oE 'https?://.*|(src|href)="[^"]{0,9}|url\(.*|<(script|link|iframe|object).*' page.html |
  grep -vE '^(src="data:imag|href="#)' && fail "the page asks for something beyond itself"

# --- A telephone ----------------------------------------------------------------------------------
# A headless browser's window cannot be so narrow, but a frame in it can. With all details open and
# no lazy pictures, everything is loaded before the frame counts as loaded.
sed 's/<details>/<details open>/; s/ loading="lazy"//' page.html >open.html
cat >telephone.html <<'END'
<!DOCTYPE html>
<iframe src="open.html" style="width: 360px; height: 800px; border: 0"></iframe>
<script>
  addEventListener('load', () => {
    const page = document.querySelector('iframe').contentDocument;
    const shown = [...page.images].filter(image => image.naturalWidth && image.clientWidth);
    const hidden = page.documentElement.scrollWidth - page.documentElement.clientWidth;
    document.body.append(`pixels beyond the side: ${hidden}; images: ${shown.length};`);
  });
</script>
END
browse telephone.html >telephone.dom
[[ ! -s console.txt ]] || fail "the page complains on a telephone: $(<console.txt)"
expect_count 1 "pixels beyond the side: 0; images: $images;" telephone.dom

# --- Files that are missing or broken -------------------------------------------------------------
rm sweep/medium_1/none/frames.csv
echo '1.0 2.0' >sweep/medium_2/none/trajectory.txt
echo '1.0 2.0' >sweep/medium_1/none/trajectory.txt
rm "sweep/$scene/paper/groundtruth.txt"
echo 'no picture' >"sweep/$scene/none/worst_frame.jpg"
sed -i '3s/,[^,]*$//' "sweep/$scene/paper/frames.csv"
"$dynfilter" ablate --gather sweep --report broken.html >/dev/null
for file in medium_1/none/frames.csv '/none/trajectory.txt:1' '/paper/groundtruth.txt' \
  '/none/worst_frame.jpg' '/paper/frames.csv:3:'; do
  grep -F "$file" broken.html | grep -q '^<li>' || fail "the page does not say what is wrong with $file"
done
browse broken.html >broken.dom
[[ ! -s console.txt ]] || fail "the page with gaps complains: $(<console.txt)"
grep -q '<path class="line line2" d="M' broken.dom || fail "what is not broken is gone too"

"$dynfilter" ablate --gather sweep --report no/such/folder.html >/dev/null 2>refusal.txt &&
  fail "a page that cannot be written goes unnoticed"
grep -qF no/such/folder.html refusal.txt || fail "the refusal names no file: $(<refusal.txt)"

# --- The test itself ------------------------------------------------------------------------------
echo '<!DOCTYPE html><script>throw 1</script>' >error.html
browse error.html >/dev/null
[[ -s console.txt ]] || fail "errors of a page go unnoticed"
echo "the page is $(stat -c %s page.html) bytes"
