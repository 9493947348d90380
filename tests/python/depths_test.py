# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Depths of features, for frames without a depth image."""

import numpy as np
import pytest

import dynfilter


def person_in_its_box():
    """A mask in the left half of its box, features on it, on the wall, and two to its right."""
    mask = np.zeros((480, 640), bool)
    mask[100:400, 200:300] = True
    frame = dynfilter.FrameView(image=np.zeros((480, 640), np.uint8))
    segmentation = dynfilter.Segmentation.from_masks(
        frame, mask[None], boxes=np.array([[200, 100, 400, 400]], np.float32)
    )
    on_mask = [(x, y) for x in (210, 250, 290) for y in range(110, 390, 30)]
    on_wall = [(500, 100 + 5 * k) for k in range(40)]
    points = np.array(on_mask + on_wall + [(380, 200), (380, 300)], np.float32)
    depths_m = np.full(len(points), 2.0)
    depths_m[len(on_mask) : -2] = 6.0
    depths_m[-1] = 6.0
    return frame, segmentation, points, depths_m


def test_what_stands_at_the_persons_depth_goes():
    frame, segmentation, points, depths_m = person_in_its_box()
    labels = dynfilter.DynamicFilter().apply(frame, segmentation, points, depths_m=depths_m)
    assert labels.removed[:30].all()
    assert not labels.removed[30:-2].any()
    assert labels[-2].reason == dynfilter.Reason.compensated
    assert not labels.removed[-1]
    compensation = labels.statistics.instances[0].compensation
    assert compensation == dynfilter.Compensation.applied_without_image
    with pytest.raises(ValueError, match="depths_m of .*; want one for each feature, 72"):
        dynfilter.DynamicFilter().apply(frame, segmentation, points, depths_m=depths_m[1:])
