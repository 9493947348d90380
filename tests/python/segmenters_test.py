# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Sequences of TUM, segmenters, written in Python and built in, and masks that are moved."""

import pathlib

import numpy as np
import pytest

import dynfilter


def test_frames_are_those_of_the_lists(rendered):
    sequence = dynfilter.RgbdSequence(rendered)
    assert len(sequence) == 4 and sequence.has_depth
    assert sequence.folder == rendered and isinstance(sequence.folder, pathlib.Path)
    frames = list(sequence)
    assert [f.id for f in frames] == [0, 1, 2, 3]
    rows = [
        line.split()
        for line in (rendered / "associations.txt").read_text().splitlines()
        if not line.startswith("#")
    ]
    for frame, row in zip(frames, rows):
        assert frame.timestamp_s == float(row[0])
    assert frames[0].image.shape == (240, 320, 3) and frames[0].image.dtype == np.uint8
    assert frames[0].depth.shape == (240, 320) and frames[0].depth.dtype == np.uint16
    assert frames[0].metres_per_unit == 1 / sequence.camera.depth_units_per_metre
    assert np.array_equal(sequence[-1].image, frames[3].image)
    assert np.array_equal(sequence.read(1).depth, frames[1].depth)


def test_errors_name_the_file(rendered, tmp_path):
    with pytest.raises(RuntimeError, match="absent"):
        dynfilter.RgbdSequence(tmp_path / "absent")
    with pytest.raises(ValueError, match="RgbdSequence: got max_time_difference_s = -1"):
        dynfilter.RgbdSequence(rendered, max_time_difference_s=-1)
    with pytest.raises(IndexError):
        dynfilter.RgbdSequence(rendered)[4]
    with pytest.raises(IndexError):
        dynfilter.RgbdSequence(rendered).read(-5)
    with pytest.raises(TypeError):
        dynfilter.RgbdSequence(3)


class People(dynfilter.Segmenter):
    """Finds what the scene says."""

    def __init__(self, masks):
        super().__init__()
        self.masks = masks
        self.frames = []

    def do_segment(self, frame):
        self.frames.append(frame)
        return dynfilter.Segmentation.from_masks(frame, self.masks)


def test_derived_class_is_called_and_its_result_taken(scene):
    people = People(scene.mask[None])
    frame = scene.frame(id=7, timestamp_s=1.5)
    segmentation = people.segment(frame)
    assert (segmentation.frame_id, segmentation.timestamp_s) == (7, 1.5)
    assert np.shares_memory(segmentation.instances[0].mask, scene.mask)
    assert people.frames[0].image is scene.image


def test_result_is_checked(scene):
    class Wrong(dynfilter.Segmenter):
        def do_segment(self, frame):
            return self.result

    wrong = Wrong()
    wrong.result = dynfilter.Segmentation(image_size=(3, 4))
    with pytest.raises(ValueError, match="image_size 3x4; want the frame's size, 160x120"):
        wrong.segment(scene.frame())
    wrong.result = None
    with pytest.raises(
        ValueError, match=r"\(result of do_segment\): got a NoneType; want a Segmentation"
    ):
        wrong.segment(scene.frame())
    with pytest.raises(ValueError, match="got a class without do_segment"):
        dynfilter.Segmenter().segment(scene.frame())


def test_exceptions_pass_unchanged(scene):
    class Failed(Exception):
        pass

    error = Failed("no network")

    class Failing(dynfilter.Segmenter):
        def do_segment(self, frame):
            raise error

    with pytest.raises(Failed) as caught:
        Failing().segment(scene.frame())
    assert caught.value is error


def test_mask_folder(rendered, tmp_path):
    sequence = dynfilter.RgbdSequence(rendered)
    people = dynfilter.MaskFolderSegmenter(sequence.folder / "masks")
    assert len(people) == len(sequence)
    for frame in sequence:
        assert people.has_mask(frame.timestamp_s)
        segmentation = people.segment(frame)
        assert segmentation.image_size == (320, 240)
        assert all(0 <= i.score <= 1 and i.class_id == 0 for i in segmentation.instances)
    with pytest.raises(RuntimeError, match="there is no such mask"):
        people.segment(dynfilter.FrameView(timestamp_s=1e6))
    with pytest.raises(RuntimeError, match="missing"):
        dynfilter.MaskFolderSegmenter(tmp_path / "missing")
    with pytest.raises(ValueError, match="MaskFolder"):
        dynfilter.MaskFolderSegmenter(str(sequence.folder / "masks"), max_time_difference_s=-1)


def test_masks_are_written_and_read(scene, tmp_path):
    writer = dynfilter.MaskFolderWriter(tmp_path / "masks")
    for time_s in (1.5, 2.5):
        masks = dynfilter.Segmentation.from_masks(
            scene.frame(timestamp_s=time_s), scene.mask[None], scene.box, [3], [0.25]
        )
        writer.add(masks, *["2.50"][: int(time_s) - 1])
    with pytest.raises(ValueError, match="stem"):
        writer.add(masks, "person")
    assert len(writer) == 2
    assert not list(tmp_path.glob("masks/*.png"))
    writer.finish()
    assert {path.name for path in tmp_path.glob("masks/*.png")} == {"1.500000.png", "2.50.png"}
    people = dynfilter.MaskFolderSegmenter(tmp_path / "masks")
    (found,) = people.segment(scene.frame(timestamp_s=2.5)).instances
    assert (found.class_id, found.score, found.box) == (3, 0.25, (58, 18, 44, 84))
    assert found.mask.astype(bool).sum() == scene.mask.sum()
    with pytest.raises(RuntimeError, match="masks"):
        dynfilter.MaskFolderWriter(tmp_path / "masks")
    dynfilter.MaskFolderWriter(tmp_path / "masks", overwrite=True)
    with dynfilter.MaskFolderWriter(tmp_path / "others") as writer:
        writer.add(masks)
    assert [path.name for path in tmp_path.glob("others/*.png")] == ["2.500000.png"]
    with pytest.raises(KeyError):
        with dynfilter.MaskFolderWriter(tmp_path / "none") as writer:
            writer.add(masks)
            raise KeyError
    assert not list(tmp_path.glob("none/*.png"))


def test_propagator_returns_the_newest_masks(scene):
    propagator = dynfilter.MaskPropagator()
    first, later = scene.frame(), scene.frame(id=1, timestamp_s=0.03)
    assert propagator.propagate(first) is None
    propagator.propagate(first, scene.segmentation())
    moved = propagator.propagate(later, scene.segmentation())
    assert (moved.frame_id, moved.timestamp_s) == (1, 0)
    assert moved.instances[0].mask.astype(bool).sum() > 0.9 * scene.mask.sum()
    propagator.reset()
    assert propagator.propagate(later, None) is None
    with pytest.raises(ValueError, match="MaskPropagator"):
        dynfilter.MaskPropagator(max_age_s=-1)
