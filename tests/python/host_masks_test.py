# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""What hosts take in place of a filter: masks and depth with holes."""

import numpy
import pytest

import dynfilter


def scene():
    """A person and a chair."""
    depth = numpy.full((60, 80), 15000, numpy.uint16)
    depth[20:50, 30:50] = 7500
    masks = numpy.zeros((2, 60, 80), bool)
    masks[0, 20:50, 30:46] = True
    masks[1, 5:10, 5:10] = True
    image = numpy.zeros((60, 80, 3), numpy.uint8)
    frame = dynfilter.FrameView(image=image, depth=depth, metres_per_unit=1 / 5000)
    return frame, masks, dynfilter.Segmentation.from_masks(frame, masks, class_ids=[0, 56])


def test_masks_have_the_polarity_of_their_names():
    _, masks, people = scene()
    dynamic = dynfilter.mask_of_dynamic_pixels(people)
    assert dynamic.dtype == numpy.uint8
    assert numpy.array_equal(dynamic, masks[0] * numpy.uint8(255))
    assert numpy.array_equal(dynfilter.mask_of_static_pixels(people), 255 - dynamic)
    both = dynfilter.mask_of_dynamic_pixels(people, dynamic_classes=[0, 56])
    assert numpy.array_equal(both > 0, masks.any(axis=0))
    grown = dynfilter.mask_of_dynamic_pixels(people, margin_px=2)
    assert grown[20, 28] == 255 and grown[20, 27] == 0
    own = numpy.zeros((60, 80), bool)
    own[59] = True
    assert (dynfilter.mask_of_static_pixels(people, static_mask=own)[59] == 0).all()


@pytest.mark.parametrize("kind", [numpy.uint16, numpy.float32])
def test_depth_gets_holes(kind):
    frame, masks, people = scene()
    depth = frame.depth.astype(kind)
    holes = dynfilter.depth_with_holes(depth, people)
    assert holes.dtype == kind
    assert numpy.array_equal(holes, numpy.where(masks[0], 0, depth))
    assert (depth > 0).all()
    with pytest.raises(ValueError, match="depth image of 80x10; want the same size"):
        dynfilter.depth_with_holes(depth[:10], people)


def test_refined_masks_follow_depth():
    depth = numpy.full((480, 640), 15000, numpy.uint16)
    depth[160:400, 240:400] = 7500
    mask = numpy.zeros((1, 480, 640), bool)
    mask[0, 160:400, 240:392] = True  # lacks the eight right columns
    image = numpy.zeros((480, 640, 3), numpy.uint8)
    frame = dynfilter.FrameView(image=image, depth=depth, metres_per_unit=1 / 5000)
    refined = dynfilter.refined(frame, dynfilter.Segmentation.from_masks(frame, mask))
    found = dynfilter.mask_of_dynamic_pixels(refined) > 0
    assert found[200:360, 396].all() and not found[:, 410:].any()
