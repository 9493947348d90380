# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Instances made of masks and boxes, against NumPy."""

import numpy as np
import pytest

import dynfilter


def test_members_are_those_given():
    mask = np.ones((3, 4), np.uint8)
    instance = dynfilter.Instance(
        class_id=7, score=0.5, box=(1, 2, 30, 40), mask_origin=(5, 6), mask=mask, track_id=9
    )
    assert (instance.class_id, instance.score, instance.box) == (7, 0.5, (1, 2, 30, 40))
    assert (instance.mask_origin, instance.track_id) == ((5, 6), 9)
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
