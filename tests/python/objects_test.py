# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""What all classes have in common: objects without __init__."""

import inspect

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
