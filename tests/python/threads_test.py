# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Threads share filters, the interpreter's lock is released, and many calls leave no memory behind."""

import concurrent.futures
import gc
import sys
import threading
import time

import numpy as np
import pytest

import dynfilter


def test_one_filter_serves_many_threads(scene):
    filter = dynfilter.DynamicFilter()
    frames = [scene.frame(id=i) for i in range(8)]
    masks = scene.segmentation()
    random = np.random.default_rng(11)
    sets = [random.uniform(0, 150, (50 + 100 * i, 2)).astype(np.float32) for i in range(8)]
    expected = [filter.apply(f, masks, p) for f, p in zip(frames, sets)]

    def work(job):
        labels = filter.apply(frames[job % 8], masks, sets[job % 8])
        other = expected[job % 8]
        return np.array_equal(labels.reason, other.reason) and np.array_equal(
            labels.score, other.score
        )

    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        assert all(pool.map(work, range(200)))


def calls(scene, sequence):
    filter = dynfilter.DynamicFilter()
    masks = scene.segmentation()
    people = dynfilter.MaskFolderSegmenter(sequence.folder / "masks")
    first = sequence[0]
    camera = dynfilter.Camera(fx=150, fy=150, cx=80, cy=60)
    motion = dynfilter.MotionFilter(camera)
    return {
        "filter": lambda: filter.apply(scene.frame(), masks, scene.points),
        "motion": lambda: motion.apply(scene.frame(), masks, scene.points),
        "read": lambda: sequence[0],
        "segment": lambda: people.segment(first),
        "propagate": lambda: dynfilter.MaskPropagator().propagate(scene.frame(), masks),
    }


@pytest.mark.parametrize("name", ["filter", "motion", "read", "segment", "propagate"])
def test_the_interpreters_lock_is_released(scene, rendered, name):
    call = calls(scene, dynfilter.RgbdSequence(rendered))[name]
    assert other_thread_runs_during(call, attempts=20000)


def test_other_calls_keep_the_lock():
    """So the test above tells the two apart. The call makes no array: NumPy unlocks to copy."""
    labels = dynfilter.FeatureLabels(10, dynfilter.Segmentation())
    assert not other_thread_runs_during(lambda: labels[5], attempts=2000)


def other_thread_runs_during(call, attempts):
    """Whether another thread runs. The interpreter itself switches to none meanwhile."""
    gate, waiting, seen = threading.Lock(), [], []

    def wait_at_the_gate():
        waiting.append(1)  # it keeps the interpreter from here until it waits at the gate
        gate.acquire()
        seen.append(1)

    gate.acquire()
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        other = threading.Thread(target=wait_at_the_gate)
        other.start()
        while not waiting:
            time.sleep(0.001)
        gate.release()
        for _ in range(attempts):
            if seen:
                break
            call()
        has_run = bool(seen)
    finally:
        sys.setswitchinterval(interval)
    other.join()
    return has_run


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
