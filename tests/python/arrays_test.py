# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Arrays go in and out without copies; what cannot is refused by name."""

import gc
import weakref

import numpy as np
import pytest

import dynfilter


class Traced(np.ndarray):
    """An array that can be watched."""


def traced(array):
    return array.copy().view(Traced)


def test_frame_returns_the_very_arrays(scene):
    frame = scene.frame()
    assert frame.image is scene.image
    assert frame.depth is scene.depth


def test_rows_of_any_distance_are_not_copied(scene):
    wide = np.zeros((120, 400, 3), np.uint8)
    image = wide[:, 100:260]
    wide[5, 103] = (1, 2, 3)
    frame = dynfilter.FrameView(image=image)
    assert np.shares_memory(frame.image, wide)
    every_other = dynfilter.FrameView(depth=scene.depth[::2], metres_per_unit=1 / 5000)
    assert np.shares_memory(every_other.depth, scene.depth)


OTHER_IMAGES = [
    lambda a: a.astype(np.float64),
    lambda a: a.T,
    lambda a: a[:, ::2],
    lambda a: a[::-1],
    lambda a: a[0, 0],
    lambda a: a[..., ::-1],
]
OTHER_DEPTHS = [
    lambda a: a.astype(np.int32),
    lambda a: a.astype(">u2"),
    lambda a: a.T,
    lambda a: a[None],
]
OTHER_POINTS = [
    lambda a: a.astype(np.float64),
    lambda a: a.T,
    lambda a: a[:, ::-1],
    lambda a: a[::-1],
    lambda a: a[:, :1],
    lambda a: a.ravel(),
]


def test_other_arrays_are_refused(scene):
    for make in OTHER_IMAGES:
        with pytest.raises(ValueError, match=r"^dynfilter::FrameView: got an image of .*; want "):
            dynfilter.FrameView(image=make(scene.image))
    for make in OTHER_DEPTHS:
        with pytest.raises(ValueError, match=r"^dynfilter::FrameView: got a depth image of .*; want"):
            dynfilter.FrameView(depth=make(scene.depth), metres_per_unit=1 / 5000)
    for make in OTHER_POINTS:
        with pytest.raises(ValueError, match=r"^dynfilter::DynamicFilter: got features of .*; want "):
            dynfilter.DynamicFilter().apply(scene.frame(), None, make(scene.points))


def test_points_of_a_table_and_of_opencv_give_equal_labels(scene):
    filter = dynfilter.DynamicFilter()
    frame, masks = scene.frame(), scene.segmentation()
    expected = filter.apply(frame, masks, scene.points)
    table = np.zeros((len(scene.points), 5), np.float32)
    table[:, 1:3] = scene.points
    for points in (table[:, 1:3], scene.points[:, None, :]):
        labels = filter.apply(frame, masks, points)
        assert np.array_equal(labels.reason, expected.reason)
        assert np.array_equal(labels.score, expected.score)
    every_third = filter.apply(frame, masks, scene.points[::3])
    alone = filter.apply(frame, masks, scene.points[::3].copy())
    assert np.array_equal(every_third.reason, alone.reason)


def test_frame_keeps_its_arrays_alive_and_lets_them_go(scene):
    image = traced(scene.image)
    watch = weakref.ref(image)
    frame = dynfilter.FrameView(image=image)
    del image
    gc.collect()
    assert watch() is not None
    assert np.array_equal(frame.image, scene.image)
    del frame
    gc.collect()
    assert watch() is None


def test_mask_outlives_array_segmentation_and_instance(scene):
    masks = traced(scene.mask[None])
    watch = weakref.ref(masks)
    segmentation = dynfilter.Segmentation.from_masks(scene.frame(), masks)
    instance = segmentation.instances[0]
    del masks, segmentation
    view = instance.mask
    del instance
    gc.collect()
    assert watch() is not None
    assert view.all() and view.shape == (80, 30)
    del view
    gc.collect()
    assert watch() is None


def test_views_are_read_only(scene):
    labels = dynfilter.DynamicFilter().apply(scene.frame(), scene.segmentation(), scene.points)
    for view in (labels.removed, labels.score, labels.instance, labels.reason):
        with pytest.raises(ValueError):
            view[0] = 0
    with pytest.raises(ValueError):
        scene.segmentation().instances[0].mask[0, 0] = 0


class Tensor:
    """Stands for a tensor on the CPU, which NumPy may ask for its memory."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return self.array


def test_tensors_are_taken_without_a_copy(scene):
    frame = dynfilter.FrameView(image=Tensor(scene.image))
    assert frame.image is scene.image


def test_frames_without_keypoints_pass_as_opencv_gives_them(scene):
    for points in ((), [], np.empty((0, 2), np.float32), np.empty(0), None):
        labels = dynfilter.DynamicFilter().apply(scene.frame(), scene.segmentation(), points)
        assert len(labels) == 0
        kept, again, descriptors = dynfilter.keep_static(labels, points, points, None)
        assert descriptors is None and (kept is again is None or len(kept) == len(again) == 0)
    labels = dynfilter.DynamicFilter().apply(scene.frame(), scene.segmentation(), scene.points)
    with pytest.raises(ValueError, match="NoneType"):
        dynfilter.keep_static(labels, scene.points, None)
