# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""MotionFilter, frame after frame."""

import numpy as np
import pytest

import dynfilter


def camera_of(sequence):
    c = sequence.camera
    return dynfilter.PinholeCamera(fx=c.fx, fy=c.fy, cx=c.cx, cy=c.cy)


def grid(frame):
    height, width = frame.depth.shape
    return np.ascontiguousarray(np.mgrid[8:width:10, 8:height:10].reshape(2, -1).T, np.float32)


def run(sequence, filter):
    people = dynfilter.MaskFolderSegmenter(sequence.folder / "masks")
    return [filter.apply(f, people.segment(f), grid(f)) for f in sequence]


def test_motion_is_judged_from_the_second_frame_on(rendered):
    sequence = dynfilter.RgbdSequence(rendered)
    state = dynfilter.MotionState()
    filter = dynfilter.MotionFilter(camera_of(sequence), state)
    labels = run(sequence, filter)
    outcomes = [one.statistics.motion.outcome for one in labels]
    assert outcomes[0] == dynfilter.MotionOutcome.started
    assert outcomes[-1] == dynfilter.MotionOutcome.applied
    assert not labels[0].statistics.is_motion_decided  # a host should wait with its map
    assert labels[-1].statistics.motion.tracked > 100
    state.reset()
    again = run(sequence, filter)
    for one, other in zip(labels, again):
        assert np.array_equal(one.reason, other.reason) and np.array_equal(one.score, other.score)


def test_tracks_of_features_move_masks_and_serve_the_filter(rendered):
    sequence = dynfilter.RgbdSequence(rendered)
    people = dynfilter.MaskFolderSegmenter(sequence.folder / "masks")
    alone = dynfilter.MotionFilter(camera_of(sequence), dynfilter.MotionState())
    filter = dynfilter.MotionFilter(camera_of(sequence), dynfilter.MotionState())
    propagator = dynfilter.MaskPropagator()
    for i, frame in enumerate(sequence):
        points = grid(frame)
        tracks = filter.track(frame, points)
        if i == 0:
            assert tracks is None
            newest = people.segment(frame)
        else:
            assert tracks.shape == points.shape and tracks.dtype == np.float32
            found = ~np.isnan(tracks).any(axis=1)
            assert found.mean() > 0.5
        masks = propagator.propagate(frame, newest, points, tracks)
        labels = filter.apply(frame, masks, points)
        assert np.array_equal(labels.removed, alone.apply(frame, masks, points).removed)
    assert labels.statistics.motion.outcome == dynfilter.MotionOutcome.applied


def test_misuse():
    with pytest.raises(ValueError, match="PinholeCamera"):
        dynfilter.PinholeCamera(fx=0, fy=1, cx=1, cy=1)
    camera = dynfilter.PinholeCamera(fx=500, fy=500, cx=320, cy=240)
    with pytest.raises(TypeError):
        dynfilter.MotionFilter(camera, None)
