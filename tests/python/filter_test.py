# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""The filter: the rule `mask` against an oracle in NumPy, depths of features, checks of the input."""

import numpy as np
import pytest

import dynfilter


def oracle(points, masks, margins):
    """Index of the first mask within the margin of each point's nearest pixel; -1 for none."""
    pixels = np.floor(points.astype(np.float64) + 0.5)
    owner = np.full(len(points), -1)
    for k in reversed(range(len(masks))):
        rows, columns = np.nonzero(masks[k])
        if len(rows) == 0:
            continue
        squares = (pixels[:, :1] - columns) ** 2 + (pixels[:, 1:] - rows) ** 2
        owner[squares.min(axis=1) <= margins**2] = k
    return owner


def random_case(seed):
    random = np.random.default_rng(seed)
    masks = np.zeros((3, 48, 64), bool)
    for mask in masks[: random.integers(1, 4)]:
        x, y = random.integers(-5, 60), random.integers(-5, 40)
        mask[max(y, 0) : y + 14, max(x, 0) : x + 9] = (
            random.random((48, 64))[max(y, 0) : y + 14, max(x, 0) : x + 9] < 0.7
        )
    points = random.uniform(-3, 67, (200, 2)).astype(np.float32)
    points[::7] = np.floor(points[::7]) + 0.5  # halves are rounded up
    return masks, points


@pytest.mark.parametrize("seed, margin", [(11, 0.0), (12, 1.0), (13, 2.5)])
def test_labels_are_those_of_the_oracle(seed, margin):
    masks, points = random_case(seed)
    frame = dynfilter.FrameView(image=np.zeros((48, 64), np.uint8))
    scores = [0.25, 0.5, 0.75]
    segmentation = dynfilter.Segmentation.from_masks(frame, masks, scores=scores)
    filter = dynfilter.DynamicFilter(rule=dynfilter.CompensationRule.mask, margin_px=margin)
    labels = filter.apply(frame, segmentation, points)
    owner = oracle(points, masks, np.full(len(points), margin))
    assert (owner >= 0).any() and (owner < 0).any()
    assert np.array_equal(labels.instance, owner)
    assert np.array_equal(labels.removed, owner >= 0)
    assert np.array_equal(labels.reason, np.where(owner >= 0, int(dynfilter.Reason.in_mask), 0))
    assert np.array_equal(labels.score, np.append(scores, 0)[owner].astype(np.float32))
    assert labels.statistics.masked == (owner >= 0).sum()
    assert [s.masked for s in labels.statistics.instances] == [(owner == k).sum() for k in range(3)]


def test_static_mask_is_culled_as_no_instance():
    _, points = random_case(12)
    robot = np.zeros((48, 64), bool)
    robot[30:] = True
    filter = dynfilter.DynamicFilter(static_mask=robot)
    frame = dynfilter.FrameView(image=np.zeros((48, 64), np.uint8))
    robot_then = robot.copy()
    robot[:] = False  # the filter has a copy
    labels = filter.apply(frame, None, points)
    owner = oracle(points, robot_then[None], np.zeros(len(points)))
    assert np.array_equal(labels.removed, owner == 0)
    assert (labels.instance == -1).all()


def test_masks_in_place_of_a_segmentation_are_told_what_is_wanted(scene):
    camera = dynfilter.Camera(fx=500, fy=500, cx=80, cy=60)
    for filter in (dynfilter.DynamicFilter(), dynfilter.MotionFilter(camera)):
        for wrong in (scene.mask, scene.segmentation().instances, 0):
            with pytest.raises(TypeError, match="want a Segmentation or None; see Segmentation.from"):
                filter.apply(scene.frame(), wrong, scene.points)


def test_options_are_checked():
    message = "^dynfilter::MaskCuller: got margin_px = -1; want a finite number of at least 0"
    with pytest.raises(ValueError, match=message):
        dynfilter.DynamicFilter(margin_px=-1)
    with pytest.raises(ValueError, match="^dynfilter::MaskCuller: got a static_mask of float64"):
        dynfilter.DynamicFilter(static_mask=np.zeros((2, 2)))
    with pytest.raises(TypeError):
        dynfilter.DynamicFilter(margin=3)
    with pytest.raises(ValueError, match="half_width_m = -1"):
        dynfilter.DynamicFilter(half_width_m=-1)


def test_floor_reports(scene):
    few = dynfilter.DynamicFilter(floor=10000).apply(
        scene.frame(), scene.segmentation(), scene.points
    )
    assert few.statistics.starved and few.statistics.suggested_features > len(scene.points)


def test_missed_limb_is_compensated(scene):
    labels = dynfilter.DynamicFilter().apply(scene.frame(), scene.segmentation(), scene.points)
    column, row = scene.points.astype(int).T
    limb = scene.person[row, column] & ~scene.mask[row, column]
    assert (labels.reason[limb] == int(dynfilter.Reason.compensated)).all()
    assert labels.statistics.instances[0].compensation == dynfilter.Compensation.applied
    assert labels.statistics.instances[0].depth_range_m.contains(1.5)


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


def findings_of(scene, masks, scale=1.0):
    checks = dynfilter.InputChecks(dynamic_classes=[0])
    checks.note_camera(100, 100, 80, 60)
    for i in range(8):
        frame = scene.frame(timestamp_s=i / 30, metres_per_unit=scale / 5000)
        checks.add(frame, dynfilter.Segmentation.from_masks(frame, masks), scene.points)
    assert len(checks) == 8
    return {finding.check: finding.sentence for finding in checks.findings()}


def test_inverted_masks_and_a_wrong_unit_are_named(scene):
    sound = findings_of(scene, scene.mask[None])
    assert "masks_everywhere" not in sound and "depth_unit" not in sound
    inverted = findings_of(scene, (scene.mask[None] == 0).astype(np.uint8))
    assert "are they inverted" in inverted["masks_everywhere"]
    assert "too large" in findings_of(scene, scene.mask[None], 100)["depth_unit"]


def test_misuse_is_refused(scene):
    checks = dynfilter.InputChecks()
    checks.add(scene.frame())
    assert checks.findings() == []
    with pytest.raises(TypeError):
        checks.add(scene.frame(), scene.mask)
    with pytest.raises(ValueError, match="metres_per_unit"):
        checks.add(dynfilter.FrameView(depth=np.zeros((4, 4), np.uint16)))
