#!/usr/bin/python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Measures what a call from Python costs beside the same call from C++.

    export PYTHONPATH=build/dev/src/python
    /usr/bin/python3 bench/python_overhead.py SEQUENCE build/dev/tests/python/filter_frame

SEQUENCE has masks (`dynfilter synth scene`). Both filter its first frame with 1000 features, rule
depth, in turn. Prints the best of 21 rounds, in microseconds: what else the machine does only adds.
"""

import argparse
import os
import subprocess
import tempfile
import time

import numpy as np

import dynfilter

ROUNDS = 21
CALLS = 200


def time_of(call):
    """Mean time of a call, microseconds."""
    begin = time.perf_counter()
    for _ in range(CALLS):
        call()
    return (time.perf_counter() - begin) / CALLS * 1e6


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sequence")
    parser.add_argument("filter_frame", help="the program of tests/python")
    arguments = parser.parse_args()

    sequence = dynfilter.RgbdSequence(arguments.sequence)
    frame = sequence[0]
    masks = dynfilter.MaskFolderSegmenter(sequence.masks_folder()).segment(frame)
    height, width = frame.depth.shape
    points = np.random.default_rng(11).uniform(0, [width, height], (1000, 2)).astype(np.float32)
    descriptors = np.zeros((1000, 32), np.uint8)
    filter = dynfilter.DynamicFilter()
    labels = filter.apply(frame, masks, points)
    nothing = dynfilter.FrameView()
    nobody = dynfilter.Segmentation()
    image, depth = np.array(frame.image), np.array(frame.depth)
    stack = np.zeros((3, height, width), bool)
    stack[:, 100:200, 100:200] = True
    boxes = np.tile([100.0, 100, 200, 200], (3, 1))
    calls = {
        "apply, 1000 features": lambda: filter.apply(frame, masks, points),
        "apply, no features": lambda: filter.apply(nothing, nobody, points[:0]),
        "FrameView": lambda: dynfilter.FrameView(
            image=image, depth=depth, metres_per_unit=1 / 5000
        ),
        "Segmentation.from_masks, 3 masks": lambda: dynfilter.Segmentation.from_masks(
            frame, stack, boxes
        ),
        "keep_static, two columns": lambda: dynfilter.keep_static(labels, points, descriptors),
        "labels.removed": lambda: labels.removed,
    }
    rounds = {name: [] for name in ("C++: apply, 1000 features", *calls)}
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "points.bin")
        points.tofile(file)
        for _ in range(ROUNDS):
            output = subprocess.run(
                [arguments.filter_frame, arguments.sequence, "0", file, str(CALLS)],
                check=True,
                capture_output=True,
                text=True,
            ).stdout
            rounds["C++: apply, 1000 features"].append(float(output))
            for name, call in calls.items():
                rounds[name].append(time_of(call))
    for name, times in rounds.items():
        print(f"{min(times):9.2f}  {name}")
    overhead = min(rounds["apply, 1000 features"]) - min(rounds["C++: apply, 1000 features"])
    print(f"{overhead:9.2f}  overhead of apply, 1000 features")


if __name__ == "__main__":
    main()
