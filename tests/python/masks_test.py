# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Instances made of masks and boxes; arrays as torchvision and Ultralytics return them."""

import numpy as np
import pytest

import dynfilter


def test_members_are_those_given():
    mask = np.ones((3, 4), np.uint8)
    instance = dynfilter.Instance(
        class_id=7, score=0.5, box=(1, 2, 30, 40), mask_origin=(5, 6), mask=mask, track_id=9,
        image_size=(64, 48),
    )
    assert (instance.class_id, instance.score, instance.box) == (7, 0.5, (1, 2, 30, 40))
    assert (instance.mask_origin, instance.track_id) == ((5, 6), 9)
    assert instance.image_size == (64, 48)
    assert instance.mask is mask
    with pytest.raises(AttributeError):
        instance.score = 1


def test_image_mask_is_cut_to_the_object():
    mask = np.zeros((20, 30), bool)
    mask[4:9, 10:17] = True
    instance = dynfilter.Instance.from_image_mask(mask)
    assert instance.box == (10, 4, 7, 5) and instance.mask_origin == (10, 4)
    assert np.shares_memory(instance.mask, mask) and instance.mask.dtype == bool
    assert dynfilter.Instance.from_image_mask(mask, (1, 1, 28, 18), 3, 0.25).box == (1, 1, 28, 18)


def test_binary_masks():
    mask = np.zeros((40, 50), bool)
    mask[3:9, 4:10] = mask[20:30, 25:45] = mask[35, 5] = True
    instances = dynfilter.instances_from_binary_mask(mask, box_margin_px=3, min_pixels=2)
    assert [i.box for i in instances] == [(1, 0, 12, 12), (22, 17, 26, 16)]


def test_segmentation_is_checked_and_cannot_be_changed():
    segmentation = dynfilter.Segmentation(
        frame_id=3,
        timestamp_s=1.5,
        image_size=(50, 40),
        instances=[dynfilter.Instance.from_box((1, 2, 3, 4))],
    )
    assert segmentation.image_size == (50, 40) and len(segmentation.instances) == 1
    with pytest.raises(AttributeError):
        segmentation.instances.append(1)
    with pytest.raises(ValueError, match="Segmentation: got image_size 0x0 and 1 instances"):
        dynfilter.Segmentation(instances=segmentation.instances)
    with pytest.raises(ValueError, match="got score 2 in instance 0; want a score from 0 to 1"):
        dynfilter.Segmentation(image_size=(5, 4), instances=[dynfilter.Instance(score=2)])


def two_masks():
    masks = np.zeros((2, 60, 80), bool)
    masks[0, 5:30, 10:20] = True
    masks[1, 20:50, 40:70] = True
    return masks


FRAME = dynfilter.FrameView(id=4, timestamp_s=2.5, image=np.zeros((60, 80), np.uint8))


def pixels(segmentation):
    """The masks of a segmentation, N x H x W."""
    width, height = segmentation.image_size
    result = np.zeros((len(segmentation.instances), height, width), bool)
    for one, instance in zip(result, segmentation.instances):
        if instance.mask is not None:
            x, y = instance.mask_origin
            rows, columns = instance.mask.shape
            one[y : y + rows, x : x + columns] = instance.mask != 0
    return result


def test_ultralytics():
    masks = two_masks().astype(np.float32)
    boxes = np.array([[9.3, 4.9, 21.0, 31.2], [39.0, 19.0, 70.0, 50.0]], np.float32)
    segmentation = dynfilter.Segmentation.from_masks(
        FRAME,
        masks,
        boxes,
        class_ids=np.array([0.0, 2.0], np.float32),
        scores=np.array([0.75, 0.5], np.float32),
    )
    assert (segmentation.frame_id, segmentation.timestamp_s, segmentation.image_size) == (
        4,
        2.5,
        (80, 60),
    )
    assert np.array_equal(pixels(segmentation), two_masks())
    assert [i.box for i in segmentation.instances] == [(9, 4, 12, 28), (39, 19, 31, 31)]
    assert [(i.class_id, i.score) for i in segmentation.instances] == [(0, 0.75), (2, 0.5)]


def test_torchvision():
    soft = np.where(two_masks(), 0.9, 0.3).astype(np.float32)[:, None]  # N x 1 x H x W
    boxes = np.array([[10, 5, 20, 30], [40, 20, 70, 50]], np.float64)
    segmentation = dynfilter.Segmentation.from_masks(FRAME, soft, boxes, np.array([1, 3]))
    assert np.array_equal(pixels(segmentation), two_masks())
    assert [i.class_id for i in segmentation.instances] == [1, 3]
    everything = dynfilter.Segmentation.from_masks(FRAME, soft, boxes, threshold=0.2)
    assert pixels(everything).all()


def test_probabilities_as_bytes_are_doubted():
    soft = (np.random.default_rng(7).random((1, 60, 80)) * 255).astype(np.uint8)
    with pytest.warns(UserWarning, match="many grey levels.*threshold it first"):
        dynfilter.Segmentation.from_masks(FRAME, soft)


def test_nobody_and_boxes_alone():
    nobody = dynfilter.Segmentation.from_masks(FRAME, np.zeros((0, 60, 80), bool), np.zeros((0, 4)))
    assert nobody.instances == () and nobody.image_size == (80, 60)
    assert dynfilter.Segmentation.from_masks(FRAME, None, np.zeros((0, 4))).instances == ()
    for masks, boxes in ([], None), ([], []), (None, []), ([], np.zeros((0, 4))):  # of a list
        nobody = dynfilter.Segmentation.from_masks(FRAME, masks, boxes, [], [])
        assert nobody.instances == () and nobody.image_size == (80, 60)
    (boxed,) = dynfilter.Segmentation.from_masks(FRAME, None, [[1.5, 2, 3, 4.5]]).instances
    assert boxed.box == (1, 2, 2, 3) and boxed.mask is None
    empty = dynfilter.Segmentation.from_masks(FRAME, np.zeros((1, 60, 80), bool), [[1, 2, 3, 4]])
    assert empty.instances[0].mask is None and empty.instances[0].box == (1, 2, 2, 2)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (
            (np.zeros((2, 30, 40), bool),),
            r"got masks of 40x30; want the frame's size, 80x60 \(Ultralytics",
        ),
        (
            (two_masks()[0],),
            r"got masks of bool, shape \(60, 80\); want bool, uint8 or float, N x H x W",
        ),
        ((two_masks().astype(int),), "got masks of int64"),
        ((two_masks(), np.zeros((2, 5))), "got boxes of float64, .*; want N x 4: x1, y1, x2, y2"),
        ((two_masks(), np.zeros((3, 4))), "got boxes of .*; want one for each mask, 2"),
        (
            (two_masks(), [[1, 2, 0, 4], [0, 0, 1, 1]]),
            "got a box from .*; want finite x1, y1, x2, y2 with x1 <= x2",
        ),
        (
            (two_masks(), [[np.nan, 2, 3, 4], [0, 0, 1, 1]]),
            "got a box from .nan, 2. to .*; want finite x1",
        ),
        ((two_masks(), None, [0.5, 1]), "got a class id of 0.5; want whole numbers"),
        ((two_masks(), None, [0, -1]), "got a class id of -1; want whole numbers from 0"),
        ((two_masks(), None, [1]), "got class_ids of .*; want one for each instance, 2"),
        ((two_masks(), None, None, [0.5, 1.5]), "got score 1.5 in instance 1"),
        ((two_masks(), None, ["person", "car"]), "got class_ids of <U6, .*; want numbers"),
        ((None,), "got neither masks nor boxes; want masks, N x H x W, or boxes, N x 4"),
        ((two_masks()[:, ::-1],), "want rows of neighbouring pixels"),
    ],
)
def test_other_arrays_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        dynfilter.Segmentation.from_masks(FRAME, *arguments)
