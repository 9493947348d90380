# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""What all classes have in common: texts, copies and pickles."""

import copy
import pickle

import numpy as np
import pytest

import dynfilter

def own_members(kind):
    """Names and values that the class has from dynfilter, not from Python or pybind11."""
    for base in kind.__mro__:
        if base.__module__ == "dynfilter":
            yield from vars(base).items()


def labels_of(scene):
    return dynfilter.DynamicFilter().apply(scene.frame(), scene.segmentation(), scene.points)


CAMERA = dynfilter.Camera(fx=500, fy=510, cx=80, cy=60, k1=0.25)

# Values, which can be copied and pickled, by class.
VALUES = {
    "DynamicFilter": lambda scene: dynfilter.DynamicFilter(
        dynamic_classes=[0, 2], margin_px=3, static_mask=scene.mask, half_width_m=0.4, floor=10
    ),
    "FeatureLabel": lambda scene: labels_of(scene)[100],
    "FrameStatistics": lambda scene: labels_of(scene).statistics,
    "FrameView": lambda scene: scene.frame(id=7, timestamp_s=1.5),
    "Instance": lambda scene: scene.segmentation().instances[0],
    "InstanceStatistics": lambda scene: labels_of(scene).statistics.instances[0],
    "MotionStatistics": lambda scene: labels_of(scene).statistics.motion,
    "Camera": lambda scene: CAMERA,
    "Segmentation": lambda scene: scene.segmentation(),
    "ValueRange": lambda scene: labels_of(scene).statistics.instances[0].depth_range_m,
}
# Others, which cannot.
OTHERS = {
    "FeatureLabels": labels_of,
    "MaskPropagator": lambda scene: dynfilter.MaskPropagator(),
    "MotionFilter": lambda scene: dynfilter.MotionFilter(CAMERA),
    "Segmenter": lambda scene: dynfilter.Segmenter(),
}


@pytest.mark.parametrize("name", [name for name in VALUES if name != "DynamicFilter"])
def test_text_is_short_and_readable(name, scene):
    value = VALUES[name](scene)
    assert type(value).__name__ == name
    text = repr(value)
    assert text.startswith(name + "(") and text.endswith(")")
    assert " at 0x" not in text and "\n" not in text and "<" not in text
    assert len(text) < 300


def members(value):
    """All that can be read of a value: arrays, numbers, texts, and members of members."""
    if isinstance(value, (list, tuple)):
        return [members(element) for element in value]
    if type(value).__module__ != "dynfilter" or hasattr(type(value), "__members__"):
        return value.tolist() if isinstance(value, np.ndarray) else value
    return {
        name: members(getattr(value, name))
        for name, member in own_members(type(value))
        if type(member) is property
    }


COPIES = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
}
each_copy = pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES.keys())


@each_copy
@pytest.mark.parametrize("name", VALUES)
def test_values_are_copied_and_pickled(name, copied, scene):
    value = VALUES[name](scene)
    other = copied(value)
    assert type(other) is type(value) and other is not value
    assert members(other) == members(value)


@each_copy
@pytest.mark.parametrize("name", OTHERS)
def test_others_are_neither_copied_nor_pickled(name, copied, scene):
    with pytest.raises(TypeError, match="pickle"):
        copied(OTHERS[name](scene))
