# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Label for label, the default rule gives what the C++ filter gives for the same frame."""

import os
import subprocess

import numpy as np

import dynfilter


def points_for(frame, seed):
    """Features all over the frame, and denser where somebody is."""
    height, width = frame.depth.shape
    random = np.random.default_rng(seed)
    return random.uniform(-1, [width, height], (2000, 2)).astype(np.float32)


def of_program(folder, index, points, tmp_path):
    file = tmp_path / "points.bin"
    points.tofile(file)
    output = subprocess.run(
        [os.environ["DYNFILTER_FILTER_FRAME"], str(folder), str(index), str(file)],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    return np.array([[float(word) for word in line.split()] for line in output.splitlines()])


def compare(folder, indices, tmp_path):
    sequence = dynfilter.RgbdSequence(folder)
    people = dynfilter.MaskFolderSegmenter(sequence.folder / "masks")
    filter = dynfilter.DynamicFilter()
    compensated = 0
    for index in indices:
        frame = sequence[index]
        points = points_for(frame, seed=index)
        labels = filter.apply(frame, people.segment(frame), points)
        reason, instance, removed, score = of_program(folder, index, points, tmp_path).T
        assert np.array_equal(labels.reason, reason)
        assert np.array_equal(labels.instance, instance)
        assert np.array_equal(labels.removed, removed)
        assert np.array_equal(labels.score, score.astype(np.float32))
        compensated += labels.statistics.compensated
    assert compensated > 0


def test_rendered_frames(rendered, tmp_path):
    compare(rendered, range(4), tmp_path)


def test_recorded_frames(data, tmp_path):
    compare(data / "tum_fr3_walking_halfsphere_50", [0, 20, 40], tmp_path)
