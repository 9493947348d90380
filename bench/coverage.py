#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Prints how often and how well each rule tracks, from the results of `dynfilter ablate`.

usage: coverage.py [--degraded | --draw CURVE.svg] FOLDER

A run is a scene with a number of features. It is good with an ATE of at most 5 cm over at least 95 % of
its frames. Beside rule mask on the same run, it wins or loses by 5 % of the ATE; a run that tracks fewer
than 95 % of the frames loses to any that tracks them. The sign test takes the sign of a scene's wins minus
its losses, because runs of one scene are not independent. CURVE.svg has the share of good runs over the
threshold of the ATE; it needs matplotlib. --degraded prints the medians of runs with --degrade, a row each.
"""

import collections
import json
import math
import pathlib
import re
import statistics
import sys

FRAMES, LIMIT_M, TIE = 0.95, 0.05, 1.05
NO_ESTIMATE_M = 1e6  # in place of an error, larger than any
DEGRADED = r"_((?:eroded|late|missing)_\d+|cut|disc|boxes|poor)$"


class Run:
    """The figures of a scene under a rule."""

    def __init__(self, file):
        summary = json.loads(file.read_text(encoding="utf-8"))
        self.rule, features = summary["rule"], summary["options"]["features"]
        self.scene = re.sub(f"_{features}$", "", summary["scene"])  # so named by --features A,B
        self.name = f"{self.scene}, {features} features"
        self.tracked = 1 - summary["lost_frames"] / summary["frames"]
        self.ate_m = summary.get("ate_rmse_m", NO_ESTIMATE_M)
        self.error_m = self.ate_m if self.tracked >= FRAMES else NO_ESTIMATE_M


def read_rules(folder):
    """Returns each rule's runs by name, in the order in which ablate lists the rules. Leaves out what
    is older than FOLDER/begin, where there is such a file."""
    rules = collections.defaultdict(dict)
    files = sorted((file.stat().st_mtime_ns, file) for file in folder.rglob("summary.json"))
    begin = folder / "begin"
    begin_ns = begin.stat().st_mtime_ns if begin.is_file() else 0
    for run in (Run(file) for time_ns, file in files if time_ns >= begin_ns):
        rules[run.rule][run.name] = run
    if not rules:
        sys.exit(f"{folder}: holds no results of dynfilter ablate")
    return rules


def sign_test(signs):
    """Returns the two-sided p of as uneven signs, where + and - are equally likely."""
    wins, losses = sum(sign > 0 for sign in signs), sum(sign < 0 for sign in signs)
    n, k = wins + losses, max(wins, losses)
    return min(1, 2 * sum(math.comb(n, i) for i in range(k, n + 1)) / 2**n)


def outcome(error_m, other_m):
    """Returns 1, 0 or -1 for a win, a tie or a loss."""
    return (error_m * TIE < other_m) - (error_m > other_m * TIE)


def millimetres(error_m):
    return "none" if error_m > NO_ESTIMATE_M / 10 else f"{1000 * error_m:.1f}"


def print_rules(rules):
    print(f"{'rule':14}{'ATE in mm (quartiles)':>26}{'frames':>9}{'good runs':>12}"
          f"{'wins/ties/losses beside mask':>31}{'p':>10}")
    for rule, runs in rules.items():
        all_m = [run.ate_m for run in runs.values()]
        quartiles = statistics.quantiles(all_m, n=4, method="inclusive") if len(all_m) > 1 else all_m * 3
        low, middle, high = map(millimetres, quartiles)
        ate = f"{middle} ({low}..{high})"
        good = sum(run.error_m <= LIMIT_M for run in runs.values())
        outcomes, scenes = [], collections.Counter()
        for name, run in runs.items():
            if name in rules.get("mask", {}):
                outcomes.append(outcome(run.error_m, rules["mask"][name].error_m))
                scenes[run.scene] += outcomes[-1]
        pairs = "/".join(str(outcomes.count(which)) for which in (1, 0, -1))
        p = format(sign_test(scenes.values()), ".2g") if rule != "mask" else "-"
        print(f"{rule:14}{ate:>26}{100 * statistics.mean(run.tracked for run in runs.values()):>8.1f}%"
              f"{f'{good} of {len(runs)}':>12}{pairs if rule != 'mask' else '-':>31}{p:>10}")


def print_degraded(rules):
    rows = collections.defaultdict(lambda: collections.defaultdict(list))
    for rule, runs in rules.items():
        for run in runs.values():
            how = re.search(DEGRADED, run.scene)
            rows[how[1] if how else "as they are"][rule].append(run)
    print("ATE in mm/frames in %".ljust(22), *(rule.rjust(18) for rule in rules))
    for how, row in rows.items():
        cells = [f"{millimetres(statistics.median(run.ate_m for run in row[rule]))}/"
                 f"{100 * statistics.median(run.tracked for run in row[rule]):.0f}" if row[rule] else "-"
                 for rule in rules]
        print(how.ljust(22), *(cell.rjust(18) for cell in cells))


def draw(rules, file):
    import matplotlib.pyplot as plt  # pylint: disable=import-outside-toplevel

    plt.switch_backend("Agg")
    figure, axes = plt.subplots(figsize=(7, 4), constrained_layout=True)
    for rule, runs in rules.items():
        found_mm = sorted(1000 * run.error_m for run in runs.values() if run.error_m < NO_ESTIMATE_M)
        shares = [100 * (i + 1) / len(runs) for i in range(len(found_mm))]
        style = {"none": "0.6", "perfect": "black"}.get(rule)
        axes.step([*found_mm, 1000], [*shares, shares[-1] if shares else 0], where="post", label=rule,
                  color=style, lw=2 if rule == "depth_motion" else 1.2)
    axes.set(xscale="log", xlim=(2, 1000), ylim=(0, 100), xlabel="threshold of the ATE, mm",
             ylabel=f"runs within it over {FRAMES:.0%} of the frames, %")
    axes.grid(color="0.9")
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
    figure.savefig(file, metadata={"Date": None})


def main():
    words = sys.argv[1:]
    if len(words) not in (1, 2, 3) or words[-1].startswith("-"):
        sys.exit(__doc__)
    rules = read_rules(pathlib.Path(words[-1]))
    if words[0] == "--draw":
        draw(rules, words[1])
    else:
        (print_degraded if words[0] == "--degraded" else print_rules)(rules)


if __name__ == "__main__":
    main()
