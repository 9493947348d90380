#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Prints the results of a benchmark, which it reads from --benchmark_out's JSON.

usage: report.py FILE

Of depth_lbp_benchmark it prints the table; of others all times, and of filter_benchmark the ratios
that the README shows. A time is wall time, the least of all runs.
"""

import json
import sys

USUAL = "640x480/1000/3"  # image, features, instances
FILTER_RATIOS = [  # the other, ours, both in words
    ("peer/orb_extraction/scene", "filter/depth/scene", "ORB extraction / the filter, rule depth"),
    (f"peer/dilation/{USUAL}", "kept", "culling with dilated masks, as in DynaSLAM / the filter, rule paper"),
    ("peer/lk_fundamental/scene", "filter/paper/scene",
     "optical flow and a fundamental matrix, as in DS-SLAM / the filter, rule paper"),
    (f"limit/memcpy/{USUAL}", "kept", "memcpy of keypoints and descriptors / the filter, rule paper"),
]
FORMS = {
    "dense": "dense",
    "features": "single features",
    "features_not_in_cache": "single features, image not in cache",
}
DEPTHS = {"u16": "16 bits", "f32": "float"}
COLUMNS = ["memcpy", "naive_loop", "BGR_to_grey", "dlib_LBP"]  # a new case follows these


def processor():
    """Name of this machine's processor."""
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
    return names[0] if names else "unknown"


def times_of(runs):
    """Microseconds by name."""
    units = {"ns": 1e-3, "us": 1.0, "ms": 1e3, "s": 1e6}
    times = {}
    for run in runs:
        if run.get("error_occurred"):
            sys.exit(f"{run['name']}: {run.get('error_message')}")
        if run["run_type"] == "iteration":
            name = run["run_name"].replace("/manual_time", "")
            time = run.get("fastest_us", run["real_time"] * units[run["time_unit"]])
            times[name] = min(time, times.get(name, time))
    return times


def depth_lbp_table(times, cores):
    """Lines of a table with a row for each <form>/<depth>/<size>/<threads>."""
    rows = {}
    for name, time in times.items():
        form, depth, size, threads, who = name.split("/")
        key = (list(FORMS).index(form), list(DEPTHS).index(depth), int(size.split("x")[0]), threads)
        label = f"{FORMS[form]}, {DEPTHS[depth]}, {size}"
        rows.setdefault(key, {"label": label, "form": form, "threads": threads})[who] = time
    others = COLUMNS + sorted({name.split("/")[4] for name in times} - {*COLUMNS, "dynfilter"})
    heads = "".join(f"{who.replace('_', ' '):>15}" for who in others)
    yield f"D-LBP on {processor()}, {cores} cores: wall time, the least of all runs."
    yield f"{'':90}times as fast as, on as many threads"
    yield f"{'':56}{'threads':>8}{'time':>20}{heads}"
    for _, row in sorted(rows.items()):
        if "dynfilter" not in row:  # by --benchmark_filter
            continue
        ours = row["dynfilter"]
        # A call computes 1000 features, so microseconds are nanoseconds a feature.
        time = f"{ours / 1000:.3f} ms" if row["form"] == "dense" else f"{ours:.1f} ns a feature"
        ratios = [row[who] / ours if who in row else None for who in others]
        cells = "".join(f"{'-' if r is None else format(r, '.2f' if r < 10 else '.0f'):>15}" for r in ratios)
        yield f"{row['label']:56}{row['threads']:>8}{time:>20}{cells}"


def filter_ratios(times):
    """Lines that the README shows."""
    # Restoring the columns before every frame is not the filter's work. The alternatives compared
    # here also end with the kept rows.
    kept = times[f"filter_keep/paper/{USUAL}"] - times[f"limit/restore/{USUAL}"]
    times = {**times, "kept": kept}
    yield (f"The filter, rule depth, 640x480: {times['filter/depth/scene'] / 1000:.2g} ms a frame with 1000 features "
           f"and 3 persons, {times['filter/depth/640x480/16384/100'] / 1000:.2g} ms with 16384 and 100.")
    yield f"Time of the other / time of ours, {processor()}:"
    for other, ours, words in FILTER_RATIOS:
        ratio = times[other] / times[ours]
        yield f"{ratio:7.3g} {words}" if ratio < 1000 else f"{ratio:7.0f} {words}"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        results = json.load(file)
    times = times_of(results["benchmarks"])
    if any(name.startswith("dense/") for name in times):
        print(*depth_lbp_table(times, results["context"]["num_cpus"]), sep="\n")
        return
    print("microseconds, the least of all runs")
    for name in sorted(times):
        print(f"  {name:48} {times[name]:12.2f}")
    print(*filter_ratios(times), sep="\n")


main()
