# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""What all classes have in common: objects without __init__, texts, copies and pickles."""

import copy
import inspect
import pickle

import numpy as np
import pytest

import dynfilter

CLASSES = [kind for _, kind in inspect.getmembers(dynfilter, inspect.isclass)]
UNMADE = "got an object whose __init__ was not called; want one that its class made"
each_class = pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)


def own_members(kind):
    """Names and values that the class has from dynfilter, not from Python or pybind11."""
    for base in kind.__mro__:
        if base.__module__ == "dynfilter":
            yield from vars(base).items()


@each_class
def test_object_without_init_cannot_be_used(kind):
    unmade = kind.__new__(kind)
    used = 0
    for name, member in own_members(kind):
        signature = (getattr(member, "__doc__", None) or "").splitlines()[:1]
        if type(member) is property:
            with pytest.raises(TypeError, match=UNMADE):
                getattr(unmade, name)
            used += 1
        elif name not in ("__init__", "__setstate__") and "(self: " in "".join(signature):
            with pytest.raises(TypeError, match=UNMADE):
                getattr(unmade, name)(*[unmade] * (signature[0].count(": ") - 1))
            used += 1
    assert used > 0 or hasattr(kind, "__members__")


def test_object_without_init_is_no_argument(scene):
    def unmade(kind):
        return kind.__new__(kind)

    labels = dynfilter.FeatureLabels(len(scene.points), scene.segmentation())
    motion = dynfilter.MotionFilter
    camera = dynfilter.PinholeCamera(fx=500, fy=500, cx=80, cy=60)
    calls = [
        lambda: dynfilter.DynamicFilter().apply(unmade(dynfilter.FrameView), None, scene.points),
        lambda: dynfilter.DynamicFilter().apply(
            scene.frame(), unmade(dynfilter.Segmentation), scene.points
        ),
        lambda: dynfilter.DynamicFilter(rule=unmade(dynfilter.CompensationRule)),
        lambda: dynfilter.DynamicFilter(depth=unmade(dynfilter.DepthCompensatorOptions)),
        lambda: dynfilter.Segmentation(instances=[unmade(dynfilter.Instance)]),
        lambda: dynfilter.FeatureLabels(3, unmade(dynfilter.Segmentation)),
        lambda: dynfilter.keep_static(unmade(dynfilter.FeatureLabels), scene.points),
        lambda: labels.remove(0, -1, unmade(dynfilter.Reason), 1.0),
        lambda: motion(unmade(dynfilter.PinholeCamera), dynfilter.MotionState()),
        lambda: motion(camera, unmade(dynfilter.MotionState)),
        lambda: int(unmade(dynfilter.Reason)),
    ]
    for call in calls:
        with pytest.raises(TypeError, match=UNMADE):
            call()


def test_object_made_by_hand_can_be_used():
    frame = dynfilter.FrameView.__new__(dynfilter.FrameView)
    frame.__init__(id=7)
    assert frame.id == 7


def labels_of(scene):
    return dynfilter.DynamicFilter().apply(scene.frame(), scene.segmentation(), scene.points)


def propagated(scene):
    propagator = dynfilter.MaskPropagator()
    propagator.propagate(scene.frame(), scene.segmentation())
    return propagator.statistics


def trajectory():
    rows = np.zeros((5, 8))
    rows[:, 0] = np.arange(5)
    rows[:, 1:4] = np.random.default_rng(11).random((5, 3))
    rows[:, 7] = 1
    return rows


def absolute_error():
    moved = trajectory()
    moved[:, 1] += np.arange(5) / 100
    return dynfilter.absolute_trajectory_error(moved, trajectory())


CAMERA = dynfilter.PinholeCamera(fx=500, fy=510, cx=80, cy=60, k1=0.25)

# Values, which can be copied and pickled, by class.
VALUES = {
    "AbsoluteTrajectoryError": lambda scene: absolute_error(),
    "Alignment": lambda scene: absolute_error().alignment,
    "DepthCompensatorOptions": lambda scene: dynfilter.DepthCompensatorOptions(half_width_m=0.5),
    "DepthLbp": lambda scene: dynfilter.DepthLbp(),
    "DynamicFilter": lambda scene: dynfilter.DynamicFilter(
        dynamic_classes=[0, 2], margin_px=3, static_mask=scene.mask, floor=10
    ),
    "EdgeCompensatorOptions": lambda scene: dynfilter.EdgeCompensatorOptions(
        seed=5, missing_depth=dynfilter.MissingDepth.remove
    ),
    "ErrorSummary": lambda scene: absolute_error().translation_m,
    "FeatureLabel": lambda scene: labels_of(scene)[100],
    "FrameStatistics": lambda scene: labels_of(scene).statistics,
    "FrameView": lambda scene: scene.frame(id=7, timestamp_s=1.5),
    "Instance": lambda scene: scene.segmentation().instances[0],
    "InstancePropagation": lambda scene: propagated(scene).instances[0],
    "InstanceStatistics": lambda scene: labels_of(scene).statistics.instances[0],
    "MotionStatistics": lambda scene: labels_of(scene).statistics.motion,
    "PinholeCamera": lambda scene: CAMERA,
    "PropagationStatistics": propagated,
    "RangeEstimatorOptions": lambda scene: dynfilter.RangeEstimatorOptions(expansion=3),
    "RelativePoseError": lambda scene: dynfilter.relative_pose_error(trajectory(), trajectory()),
    "Segmentation": lambda scene: scene.segmentation(),
    "ValueRange": lambda scene: labels_of(scene).statistics.instances[0].depth_range_m,
}
# Others, which have a text only.
OTHERS = {
    "CallbackSegmenter": lambda scene: dynfilter.CallbackSegmenter(labels_of),
    "FeatureLabels": labels_of,
    "MaskPropagator": lambda scene: dynfilter.MaskPropagator(),
    "MotionFilter": lambda scene: dynfilter.MotionFilter(CAMERA, dynfilter.MotionState()),
    "MotionState": lambda scene: dynfilter.MotionState(),
    "Segmenter": lambda scene: dynfilter.Segmenter(),
}
# Values and others that need files: they are made by other fixtures.
OF_FILES = {"CameraParameters", "RgbdSequenceEntry", "RgbdSequence"}
OF_FILES |= {"MaskFolderSegmenter", "MaskFolderWriter"}
NETWORKS = {"NetworkSegmenter", "YoloSegmenter", "YolactSegmenter"}  # see networks_test.py


def test_every_class_is_tried():
    enumerations = {kind.__name__ for kind in CLASSES if hasattr(kind, "__members__")}
    tried = enumerations | set(VALUES) | set(OTHERS) | OF_FILES | NETWORKS
    assert {kind.__name__ for kind in CLASSES} - tried == set()


@pytest.mark.parametrize("name", [*VALUES, *OTHERS])
def test_text_is_short_and_readable(name, scene):
    value = {**VALUES, **OTHERS}[name](scene)
    assert type(value).__name__ == name
    text = repr(value)
    assert text.startswith(name + "(") and text.endswith(")")
    assert " at 0x" not in text and "\n" not in text and "<" not in text
    assert len(text) < (1000 if name.endswith("Options") else 300)


def test_texts_say_what_the_objects_are(scene):
    text = repr(VALUES["DynamicFilter"](scene))
    assert (
        text
        == "DynamicFilter(dynamic_classes=[0, 2], margin_px=3, rule=CompensationRule.depth, floor=10)"
    )
    assert repr(CAMERA).startswith("PinholeCamera(fx=500.0, fy=510.0, cx=80.0, cy=60.0, k1=0.25, ")
    assert repr(OTHERS["CallbackSegmenter"](scene)) == "CallbackSegmenter(labels_of)"
    assert "reason=Reason.in_mask" in repr(max(labels_of(scene), key=lambda label: label.score))

    class People(dynfilter.Segmenter):
        pass

    assert repr(People()) == "People()"


def test_texts_of_files(rendered):
    sequence = dynfilter.RgbdSequence(rendered)
    assert repr(sequence) == f"RgbdSequence('{rendered}', 4 frames)"
    masks = dynfilter.MaskFolderSegmenter(rendered / "masks")
    assert repr(masks) == "MaskFolderSegmenter(4 masks)"
    assert repr(sequence.camera).startswith("CameraParameters(fx=")
    assert repr(sequence.entry(0)).startswith("RgbdSequenceEntry(timestamp_s=")


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
    assert members(other) == members(value) and repr(other) == repr(value)


@each_copy
def test_values_of_files_are_copied_and_pickled(rendered, copied):
    sequence = dynfilter.RgbdSequence(rendered)
    for value in (sequence.camera, sequence.entry(0)):
        assert members(copied(value)) == members(value)


def test_copied_filter_and_masks_give_the_same_labels(scene):
    filter = dynfilter.DynamicFilter(
        rule=dynfilter.CompensationRule.paper,
        static_mask=np.roll(scene.mask, 30, axis=1),
        paper=dynfilter.EdgeCompensatorOptions(samples=11, seed=5),
        floor=500,
    )
    arguments = scene.frame(), scene.segmentation(), scene.points
    labels = filter.apply(*arguments)
    others = [
        pickle.loads(pickle.dumps(filter)).apply(*arguments),
        filter.apply(*pickle.loads(pickle.dumps(arguments))),
    ]
    assert 0 < labels.removed.sum() < len(labels)
    for other in others:
        assert (other.reason == labels.reason).all() and (other.score == labels.score).all()


def test_deep_copy_has_pixels_of_its_own(scene):
    frame = scene.frame()
    assert copy.copy(frame).image is scene.image
    assert not np.shares_memory(copy.deepcopy(frame).image, scene.image)
    instance = scene.segmentation().instances[0]
    assert np.shares_memory(copy.copy(instance).mask, scene.mask)
    assert not np.shares_memory(copy.deepcopy(instance).mask, scene.mask)


@each_copy
@pytest.mark.parametrize("name", OTHERS)
def test_others_are_neither_copied_nor_pickled(name, copied, scene):
    with pytest.raises(TypeError, match="pickle"):
        copied(OTHERS[name](scene))
