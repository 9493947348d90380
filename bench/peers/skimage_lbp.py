#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Times scikit-image's local binary pattern of a 16-bit image of 640x480; prints microseconds."""

import statistics
import sys
import time

import numpy
from skimage.feature import local_binary_pattern


def main():
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 9
    image = numpy.random.default_rng(1).integers(2000, 20000, (480, 640)).astype(numpy.uint16)
    codes = local_binary_pattern(image, 8, 1)
    assert codes.shape == image.shape and codes.max() > 200, "that is no pattern of 8 neighbours"
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        local_binary_pattern(image, 8, 1)
        times.append(time.perf_counter() - start)
    print(f"{1e6 * statistics.median(times):.1f}")


main()
