# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Sequences in the layout of TUM."""

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
