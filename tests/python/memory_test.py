# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Many calls leave no memory and no reference behind."""

import gc
import sys

import numpy as np

import dynfilter


def resident_bytes():
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def test_calls_leave_no_memory_behind(scene):
    filter = dynfilter.DynamicFilter(half_width_m=0.4)
    descriptors = np.zeros((len(scene.points), 32), np.uint8)
    masks = scene.mask[None]

    class People(dynfilter.Segmenter):
        def do_segment(self, frame):
            return dynfilter.Segmentation.from_masks(frame, masks)

    segmenter = People()

    def call():
        frame = scene.frame()
        people = dynfilter.Segmentation.from_masks(frame, masks, scene.box)
        people.instances[0].mask.sum()
        segmenter.segment(frame)
        labels = filter.apply(frame, people, scene.points)
        labels.removed.any(), labels.score, labels.instance, labels.reason, labels.statistics.kept
        dynfilter.keep_static(labels, scene.points, descriptors)
        try:
            filter.apply(frame, people, descriptors)
        except ValueError:
            pass

    for _ in range(1000):
        call()
    arrays = [scene.image, scene.depth, scene.mask, scene.points, descriptors, masks]
    references = [sys.getrefcount(array) for array in arrays]
    before = resident_bytes()
    for _ in range(5000):
        call()
    growth = resident_bytes() - before
    assert [sys.getrefcount(array) for array in arrays] == references
    assert growth < 400000, f"{growth} bytes, {growth / 5000} a call"
