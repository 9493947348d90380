# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Labels, and columns that are kept in step."""

import numpy as np
import pytest

import dynfilter


def some_labels(count=10, removed=(1, 2, 7)):
    labels = dynfilter.FeatureLabels(count, dynfilter.Segmentation())
    for i in removed:
        labels.remove(i, -1, dynfilter.Reason.custom, 0.5)
    return labels


def test_verdicts_of_your_own():
    labels = some_labels()
    assert labels.removed.nonzero()[0].tolist() == [1, 2, 7]
    assert (labels.reason == dynfilter.Reason.custom).nonzero()[0].tolist() == [1, 2, 7]
    assert not labels.remove(2, -1, dynfilter.Reason.custom, 1) and labels[2].score == 0.5
    assert labels[-1].score == 0 and labels[0].reason == dynfilter.Reason.untouched
    assert labels.statistics.kept == 7 and labels.statistics.custom == 3
    with pytest.raises(IndexError):
        labels[10]
    with pytest.raises(
        ValueError, match="FeatureLabels::remove: got score 2; want a score from 0 to 1"
    ):
        labels.remove(0, -1, dynfilter.Reason.custom, 2)
    for reason in (dynfilter.Reason.untouched, dynfilter.Reason.restored, dynfilter.Reason.still):
        with pytest.raises(ValueError, match="FeatureLabels::remove: got the reason"):
            labels.remove(0, -1, reason, 0.5)
    with pytest.raises(ValueError, match="FeatureLabels::remove: got feature 10; want an index below 10"):
        labels.remove(10, -1, dynfilter.Reason.custom, 0.5)


def test_columns_of_any_type_stay_in_step():
    random = np.random.default_rng(11)
    columns = [
        random.random((10, 2), np.float32),
        random.integers(0, 9, (10, 32), np.uint8),
        np.arange(10),
        np.array([str(i) for i in range(10)]),
        np.array([None] * 10),
        np.asfortranarray(random.random((10, 3, 4))),
        random.random((10, 6))[:, ::2],
    ]
    before = [column.copy() for column in columns]
    names = [f"feature {i}" for i in range(10)]
    results = dynfilter.keep_static(some_labels(), *columns, names, tuple(names))
    kept = [0, 3, 4, 5, 6, 8, 9]
    for column, result, old in zip(columns, results, before):
        assert result.dtype == column.dtype and np.array_equal(result, old[kept])
        assert np.array_equal(column, old)  # the caller's column stays as it is
    assert results[-2] == results[-1] == [names[i] for i in kept]
    assert len(names) == 10


def test_columns_that_are_no_columns_are_refused():
    labels = some_labels()
    good = np.arange(10)
    bad = [
        (np.arange(9), "column 1, of 9 elements; want one for each feature, 10"),
        (good, "column 1, column 0 again"),
        ({}, "a dict"),
        (np.float32(3), "a float32"),
        (np.array(3), "without rows"),
    ]
    for column, message in bad:
        with pytest.raises(ValueError, match=message):
            dynfilter.keep_static(labels, good, column)


def test_overlay_is_a_new_image(scene):
    labels = dynfilter.DynamicFilter().apply(scene.frame(), scene.segmentation(), scene.points)
    before = scene.image.copy()
    drawing = dynfilter.draw_overlay(scene.image, scene.segmentation(), scene.points, labels)
    assert drawing.dtype == np.uint8 and drawing.shape[1:] == (160, 3) and drawing.shape[0] > 120
    assert np.array_equal(scene.image, before)
