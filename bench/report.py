#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Reads the output of the benchmarks (--benchmark_out, JSON) and prints their medians as ratios.

usage: report.py FOLDER

FOLDER holds depth_lbp.json and filter.json. Prints all medians, then a line `ratio <name> <value>`
for each measured figure.
"""

import json
import os
import statistics
import sys

USUAL = "640x480/1000/3"  # image, features, instances


def medians(path):
    """Microseconds by name, and the largest number of allocations a frame, if counted."""
    units = {"ns": 1e-3, "us": 1.0, "ms": 1e3, "s": 1e6}
    times, allocations = {}, []
    with open(path, encoding="utf-8") as file:
        for run in json.load(file)["benchmarks"]:
            if run.get("error_occurred"):
                sys.exit(f"{run['name']}: {run.get('error_message')}")
            if run["run_type"] == "iteration":
                times.setdefault(run["run_name"], []).append(run["cpu_time"] * units[run["time_unit"]])
                allocations += [run["allocations"]] if "allocations" in run else []
    return {name: statistics.median(runs) for name, runs in times.items()}, max(allocations, default=None)


def ratios_of(times, allocations):
    """Yields names and values; a value that was not measured is None."""

    def over(above, below):
        return above / below if above is not None and below else None

    for kind in ["u16", "f32"]:
        of = lambda name, kind=kind: times.get(f"dense/{kind}/640x480/{name}")
        for suffix, ours in [("", of("best")), ("_without_avx2", of("without_avx2"))]:
            yield f"dense_{kind}_vs_mat_at{suffix}", over(of("mat_at"), ours)
            yield f"dense_{kind}_vs_dlib{suffix}", over(of("dlib"), ours)
            yield f"dense_{kind}_over_memcpy{suffix}", over(ours, of("memcpy"))
            yield f"dense_{kind}_over_bgr2gray{suffix}", over(ours, of("bgr2gray"))
    for cache in ["warm", "cold"]:
        of = lambda name, cache=cache: times.get(f"sparse/u16/1000/{name}/{cache}")
        yield f"sparse_u16_vs_naive_{cache}", over(of("naive"), of("codes"))
    paper, depth = times.get(f"filter/paper/{USUAL}"), times.get(f"filter/depth/{USUAL}")
    kept, restored = times.get(f"filter_keep/paper/{USUAL}"), times.get(f"limit/restore/{USUAL}")
    # Restoring the columns before every frame is not the filter's work. The alternatives compared
    # here also end with the kept rows.
    with_keep = None if kept is None or restored is None else kept - restored
    yield "filter_paper_over_memcpy", over(with_keep, times.get(f"limit/memcpy/{USUAL}"))
    yield "filter_paper_vs_dilation", over(times.get(f"peer/dilation/{USUAL}"), with_keep)
    yield "filter_paper_vs_naive", over(times.get(f"peer/naive_filter/{USUAL}"), with_keep)
    yield "filter_paper_vs_lk_f", over(times.get("peer/lk_fundamental/scene"),
                                       times.get("filter/paper/scene"))
    yield "filter_paper_4k_over_vga", over(times.get("filter/paper/3840x2160/1000/3"), paper)
    yield "filter_default_4k_over_vga", over(times.get("filter/depth/3840x2160/1000/3"), depth)
    yield "filter_default_over_orb", over(times.get("filter/depth/scene"),
                                          times.get("peer/orb_extraction/scene"))
    yield "filter_default_ms", over(times.get("filter/depth/scene"), 1000)
    yield "filter_worst_ms", over(times.get("filter/depth/640x480/16384/100"), 1000)
    yield "filter_allocations", allocations


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    times, _ = medians(os.path.join(sys.argv[1], "depth_lbp.json"))
    more, allocations = medians(os.path.join(sys.argv[1], "filter.json"))
    times.update(more)
    print("microseconds, medians")
    for name in sorted(times):
        print(f"  {name:48} {times[name]:12.2f}")
    for name, value in ratios_of(times, allocations):
        if value is not None:
            print(f"ratio {name} {value:.3g}")


main()
