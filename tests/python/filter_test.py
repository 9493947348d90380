# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""The filter: labels as arrays, depths of features, checks of the input."""

import numpy as np
import pytest

import dynfilter


def test_labels_tell_whose_mask_a_feature_is_on(scene):
    masks = dynfilter.Segmentation.from_masks(scene.frame(), scene.mask[None], scores=[0.75])
    filter = dynfilter.DynamicFilter(rule=dynfilter.CompensationRule.mask)
    labels = filter.apply(scene.frame(), masks, scene.points)
    column, row = scene.points.astype(int).T
    is_masked = scene.mask[row, column]
    assert np.array_equal(labels.removed, is_masked)
    assert np.array_equal(labels.instance, np.where(is_masked, 0, -1))
    assert np.array_equal(labels.reason, np.where(is_masked, int(dynfilter.Reason.in_mask), 0))
    assert np.array_equal(labels.score, np.where(is_masked, 0.75, 0))
    assert labels.statistics.masked == labels.statistics.instances[0].masked == is_masked.sum()
    wide = dynfilter.DynamicFilter(rule=dynfilter.CompensationRule.mask, margin_px=8)
    assert wide.apply(scene.frame(), masks, scene.points).statistics.masked > is_masked.sum()


def test_static_mask_is_culled_as_no_instance(scene):
    robot = np.zeros(scene.depth.shape, bool)
    robot[100:] = True
    filter = dynfilter.DynamicFilter(static_mask=robot)
    robot[:] = False  # the filter has a copy
    labels = filter.apply(scene.frame(), None, scene.points)
    assert np.array_equal(labels.removed, scene.points[:, 1] >= 100)
    assert (labels.instance == -1).all()


def test_masks_in_place_of_a_segmentation_are_told_what_is_wanted(scene):
    camera = dynfilter.Camera(fx=500, fy=500, cx=80, cy=60)
    for filter in (dynfilter.DynamicFilter(), dynfilter.MotionFilter(camera)):
        for wrong in (scene.mask, scene.segmentation().instances, 0):
            with pytest.raises(TypeError, match=r"segmentation: Optional\[dynfilter.Segmentation\]"):
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


def test_depths_of_features_stand_for_a_depth_image(scene):
    frame = dynfilter.FrameView(image=scene.image)
    masks = dynfilter.Segmentation.from_masks(frame, scene.mask[None], scene.box)
    column, row = scene.points.astype(int).T
    depths_m = scene.depth[row, column] / 5000
    filter = dynfilter.DynamicFilter()
    labels = filter.apply(frame, masks, scene.points, depths_m=depths_m)
    compensation = labels.statistics.instances[0].compensation
    assert compensation == dynfilter.Compensation.applied_without_image
    assert labels.removed[scene.person[row, column]].all()
    with pytest.raises(ValueError, match=f"depths_m of .*; want one for each feature, {len(row)}"):
        filter.apply(frame, masks, scene.points, depths_m=depths_m[1:])


def findings_of(scene, masks, scale=1.0, points=None, boxes=None):
    checks = dynfilter.InputChecks(dynamic_classes=[0])
    checks.note_camera(dynfilter.Camera(fx=100, fy=100, cx=80, cy=60))
    for i in range(8):
        frame = scene.frame(timestamp_s=i / 30, metres_per_unit=scale / 5000)
        found = dynfilter.Segmentation.from_masks(frame, masks, boxes=boxes)
        checks.add(frame, found, scene.points if points is None else points)
    assert len(checks) == 8
    return {finding.check: finding.sentence for finding in checks.findings()}


def test_inverted_masks_and_a_wrong_unit_are_named(scene):
    sound = findings_of(scene, scene.mask[None])
    assert "masks_everywhere" not in sound and "depth_unit" not in sound
    inverted = findings_of(scene, (scene.mask[None] == 0).astype(np.uint8))
    assert "are they inverted" in inverted["masks_everywhere"]
    assert "too large" in findings_of(scene, scene.mask[None], 100)["depth_unit"]


def test_points_and_boxes_of_another_reading_are_named(scene):
    sound = findings_of(scene, scene.mask[None])
    assert not {"features_outside", "features_quarter", "boxes"} & set(sound)
    for points, part in [(scene.points[:, ::-1], "give (x, y)"), (scene.points / (160, 120), "normalised")]:
        found = findings_of(scene, scene.mask[None], points=np.ascontiguousarray(points, np.float32))
        assert part in found.get("features_outside", "") + found.get("features_quarter", "")
    y, x = np.nonzero(scene.mask)
    x1, y1, x2, y2 = x.min(), y.min(), x.max() + 1, y.max() + 1
    for box, part in [((y1, x1, y2, x2), "y comes before x"), ((0.1, 0.1, 0.5, 0.9), "normalised")]:
        assert part in findings_of(scene, scene.mask[None], boxes=np.array([box]))["boxes"]


def test_soft_masks_are_named(scene):
    checks = dynfilter.InputChecks()
    checks.note_mask_values(list(range(1, 200, 2)))
    for i in range(8):
        frame = scene.frame(timestamp_s=i / 30)
        checks.add(frame, dynfilter.Segmentation.from_masks(frame, scene.mask[None]))
    assert "masks_soft" in {finding.check for finding in checks.findings()}


def test_misuse_is_refused(scene):
    checks = dynfilter.InputChecks()
    checks.add(scene.frame())
    assert checks.findings() == []
    with pytest.raises(TypeError):
        checks.add(scene.frame(), scene.mask)
    with pytest.raises(ValueError, match="metres_per_unit"):
        checks.add(dynfilter.FrameView(depth=np.zeros((4, 4), np.uint16)))
