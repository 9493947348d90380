#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Reads the output of the benchmarks (--benchmark_out, JSON) and prints their medians as ratios.

usage: report.py FOLDER

FOLDER holds depth_lbp.json, filter.json, and skimage_us.txt if it could be measured. Prints tables,
then a line `ratio <name> <value>` for each measured figure. Draws cost.png in FOLDER if matplotlib
is installed.
"""

import json
import os
import statistics
import sys

SETS = ["avx512", "avx2", "sse2"]
USUAL = "640x480/1000/3"  # image, features, instances


def medians(path):
    """Microseconds by name, and counters by name: medians of the repetitions."""
    units = {"ns": 1e-3, "us": 1.0, "ms": 1e3, "s": 1e6}
    runs = {}
    with open(path, encoding="utf-8") as file:
        for run in json.load(file)["benchmarks"]:
            if run.get("error_occurred"):
                sys.exit(f"{run['name']}: {run.get('error_message')}")
            if run["run_type"] == "iteration":
                runs.setdefault(run["run_name"], []).append(run)
    times, counters = {}, {}
    for name, repetitions in runs.items():
        # Threads and manual times use the wall clock.
        is_real = name.endswith(("/real_time", "/manual_time")) or "/real_time/" in name
        key = "real_time" if is_real else "cpu_time"
        unit = units[repetitions[0]["time_unit"]]
        for suffix in ["/real_time", "/manual_time"]:
            name = name.replace(suffix, "")
        name = name.split("/iterations:")[0].split("/threads:")[0]
        times[name] = statistics.median(unit * run[key] for run in repetitions)
        if "allocations" in repetitions[0]:
            counters[name] = max(run["allocations"] for run in repetitions)
    return times, counters


class Ratios:
    """Named figures, in the order in which they were added."""

    def __init__(self):
        self.lines = []

    def add(self, name, above, below=1.0):
        if above is not None and below:
            self.lines.append((name, above / below))

    def show(self):
        for name, value in self.lines:
            print(f"ratio {name} {value:.3g}")


def dense_ratios(times, skimage_us, ratios):
    for kind in ["u16", "f32"]:
        of = lambda name, kind=kind: times.get(f"dense/{kind}/640x480/{name}")
        for suffix, ours in [("", of("best"))] + [(f"_{name}", of(name)) for name in SETS]:
            if ours is None:
                continue
            ratios.add(f"dense_{kind}_vs_mat_at{suffix}", of("mat_at"), ours)
            ratios.add(f"dense_{kind}_vs_cv_compare{suffix}", of("cv_compare"), ours)
            ratios.add(f"dense_{kind}_vs_dlib{suffix}", of("dlib"), ours)
            ratios.add(f"dense_{kind}_over_memcpy{suffix}", ours, of("memcpy"))
            ratios.add(f"dense_{kind}_over_bgr2gray{suffix}", ours, of("bgr2gray"))
            if kind == "u16":
                ratios.add(f"dense_u16_vs_skimage{suffix}", skimage_us, ours)
        ratios.add(f"dense_{kind}_two_threads", of("one_thread"), of("two_threads"))
    # The machine's maximum: its processors may be two threads of one core.
    ratios.add("machine_two_threads", times.get("machine/one_thread"),
               times.get("machine/two_threads"))


def sparse_ratios(times, ratios):
    for cache in ["warm", "cold"]:
        of = lambda name, cache=cache: times.get(f"sparse/u16/1000/{name}/{cache}")
        ratios.add(f"sparse_u16_vs_naive_{cache}", of("naive"), of("codes"))


def filter_ratios(times, counters, ratios):
    paper, depth = times.get(f"filter/paper/{USUAL}"), times.get(f"filter/depth/{USUAL}")
    copy = times.get(f"limit/memcpy/{USUAL}")
    kept = times.get(f"filter_keep/paper/{USUAL}")
    restored = times.get(f"limit/restore/{USUAL}")
    dilation, naive = times.get(f"peer/dilation/{USUAL}"), times.get(f"peer/naive_filter/{USUAL}")
    if kept is not None and restored is not None:
        # Restoring the columns before every frame is not the filter's work. The alternatives
        # compared here also end with the kept rows.
        with_keep = kept - restored
        ratios.add("filter_paper_over_memcpy", with_keep, copy)
        ratios.add("filter_paper_vs_dilation", dilation, with_keep)
        ratios.add("filter_paper_vs_naive", naive, with_keep)
    ratios.add("filter_paper_labels_vs_dilation", dilation, paper)
    ratios.add("filter_paper_vs_lk_f", times.get("peer/lk_fundamental/scene"),
               times.get("filter/paper/scene"))
    ratios.add("filter_paper_4k_over_vga", times.get("filter/paper/3840x2160/1000/3"), paper)
    ratios.add("filter_default_4k_over_vga", times.get("filter/depth/3840x2160/1000/3"), depth)
    ratios.add("filter_default_over_orb", times.get("filter/depth/scene"),
               times.get("peer/orb_extraction/scene"))
    ratios.add("filter_default_ms", times.get("filter/depth/scene"), 1000)
    ratios.add("filter_worst_ms", times.get("filter/depth/640x480/16384/100"), 1000)
    ratios.add("filter_worst_paper_ms", times.get("filter/paper/640x480/16384/100"), 1000)
    if counters:
        ratios.add("filter_allocations", max(counters.values()))


def print_dense(times):
    sizes = ["640x480", "1280x720", "1920x1080", "3840x2160"]
    rows = ["memcpy", "bgr2gray"] + SETS + ["best", "cv_compare", "dlib", "mat_at"]
    for kind in ["u16", "f32"]:
        print(f"dense D-LBP, {kind}: microseconds (times memcpy of the image)")
        print(f"{'':12}" + "".join(f"{size:>18}" for size in sizes))
        for row in rows:
            cells = []
            for size in sizes:
                time = times.get(f"dense/{kind}/{size}/{row}")
                copy = times.get(f"dense/{kind}/{size}/memcpy")
                cells.append("-" if time is None else f"{time:.1f} ({time / copy:.1f})")
            if any(cell != "-" for cell in cells):
                print(f"{row:12}" + "".join(f"{cell:>18}" for cell in cells))
        print()


def print_filter(times):
    print("the filter: microseconds a frame (image, features, instances)")
    for name in sorted(times, key=lambda name: (name.split("/")[0], times[name])):
        print(f"  {name:48} {times[name]:12.2f}")
    print()


def draw(times, path):
    try:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot
    except ImportError:
        print("no plot: there is no matplotlib (python3-matplotlib)")
        return
    cases = {}  # (rule, width, features, instances) -> time
    for name, time in times.items():
        parts = name.split("/")
        if parts[0] == "filter" and len(parts) == 5:
            width, height = map(int, parts[2].split("x"))
            cases[parts[1], width * height, int(parts[3]), int(parts[4])] = time
    vga = 640 * 480
    panels = [
        ("features", lambda key: key[1] == vga and key[3] == 3, 2),
        ("instances", lambda key: key[1] == vga and key[2] == 1000, 3),
        ("pixels of the image", lambda key: key[2] == 1000 and key[3] == 3, 1),
    ]
    figure, axes = pyplot.subplots(1, 3, figsize=(12, 3.6), sharey=True)
    for axis, (label, belongs, at) in zip(axes, panels):
        for rule in ["mask", "paper", "depth"]:
            points = sorted((key[at], t) for key, t in cases.items() if key[0] == rule and belongs(key))
            if points:
                axis.plot(*zip(*points), marker="o", label=rule)
        axis.set_xlabel(label)
        axis.set_xscale("symlog" if at == 3 else "log")
        axis.set_yscale("log")
        axis.grid(True, which="both", alpha=0.3)
    axes[0].set_ylabel("microseconds a frame")
    axes[0].legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    print(f"plot of cost against features, instances and resolution: {path}")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = sys.argv[1]
    dense, _ = medians(os.path.join(folder, "depth_lbp.json"))
    whole, counters = medians(os.path.join(folder, "filter.json"))
    skimage_us = None
    skimage_file = os.path.join(folder, "skimage_us.txt")
    if os.path.exists(skimage_file):
        with open(skimage_file, encoding="utf-8") as file:
            skimage_us = float(file.read())
    print_dense(dense)
    print_filter(whole)
    draw(whole, os.path.join(folder, "cost.png"))
    ratios = Ratios()
    dense_ratios(dense, skimage_us, ratios)
    sparse_ratios(dense, ratios)
    filter_ratios(whole, counters, ratios)
    ratios.show()


main()
