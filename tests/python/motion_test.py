# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""MotionFilter, frame after frame."""

import numpy as np
import pytest

import dynfilter


def camera_of(sequence):
    c = sequence.camera
    return dynfilter.Camera(fx=c.fx, fy=c.fy, cx=c.cx, cy=c.cy)


def grid(frame):
    height, width = frame.depth.shape
    return np.ascontiguousarray(np.mgrid[8:width:10, 8:height:10].reshape(2, -1).T, np.float32)


def run(sequence, filter):
    people = dynfilter.MaskFolderSegmenter(sequence.folder / "masks")
    return [filter.apply(f, people.segment(f), grid(f)) for f in sequence]


def test_motion_is_judged_from_the_second_frame_on(rendered):
    sequence = dynfilter.RgbdSequence(rendered)
    filter = dynfilter.MotionFilter(camera_of(sequence))
    labels = run(sequence, filter)
    outcomes = [one.statistics.motion.outcome for one in labels]
    assert outcomes[0] == dynfilter.MotionOutcome.started
    assert outcomes[-1] == dynfilter.MotionOutcome.applied
    assert not labels[0].statistics.is_motion_decided  # a host should wait with its map
    assert labels[-1].statistics.motion.tracked > 100
    filter.reset()
    again = run(sequence, filter)
    for one, other in zip(labels, again):
        assert np.array_equal(one.reason, other.reason) and np.array_equal(one.score, other.score)


def test_masks_that_were_moved_serve_the_filter(rendered):
    sequence = dynfilter.RgbdSequence(rendered)
    newest = dynfilter.MaskFolderSegmenter(sequence.folder / "masks").segment(sequence[0])
    filter = dynfilter.MotionFilter(camera_of(sequence))
    propagator = dynfilter.MaskPropagator()
    for frame in sequence:
        labels = filter.apply(frame, propagator.propagate(frame, newest), grid(frame))
    assert labels.statistics.motion.outcome == dynfilter.MotionOutcome.applied
    assert labels.statistics.has_segmentation


def test_misuse():
    with pytest.raises(ValueError, match="Camera"):
        dynfilter.Camera(fx=0, fy=1, cx=1, cy=1)
    camera = dynfilter.Camera(fx=500, fy=500, cx=320, cy=240)
    with pytest.raises(TypeError):
        dynfilter.MotionFilter(None)
    with pytest.raises(TypeError):
        dynfilter.MotionFilter(camera, 3)
    with pytest.raises(ValueError, match="margin_px"):
        dynfilter.MotionFilter(camera, margin_px=-1)
