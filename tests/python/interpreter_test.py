# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""The module in the interpreter: help, texts of objects, and its end."""

import inspect
import os
import pydoc
import subprocess
import sys

import dynfilter


def test_texts_are_short_and_readable(scene):
    labels = dynfilter.DynamicFilter().apply(scene.frame(), scene.segmentation(), scene.points)
    for value, text in [
        (dynfilter.Camera(fx=500, fy=510, cx=80, cy=60), "Camera(fx=500.0, fy=510.0, cx=80.0, "),
        (scene.frame(id=7, timestamp_s=1.5), "FrameView(id=7, timestamp_s=1.5, metres_per_unit="),
        (scene.segmentation(), "Segmentation(frame_id=0, timestamp_s=0.0, image_size=(160, 120)"),
        (labels, "FeatureLabels(statistics=FrameStatistics(features="),
        (labels[0], "FeatureLabel(score=0.0, instance=-1, reason=Reason.untouched, "),
    ]:
        shown = repr(value)
        assert shown.startswith(text) and shown.endswith(")") and len(shown) < 300


def python(code, **environment):
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    )


def test_version_is_the_librarys(sources):
    header = (sources / "include/dynfilter/version.hpp").read_text()
    assert f'DYNFILTER_VERSION_STRING "{dynfilter.__version__}"' in header


def test_ends_cleanly_with_objects_alive():
    result = python(
        """
import threading, numpy, dynfilter
image = numpy.zeros((4, 4), numpy.uint8)
frame = dynfilter.FrameView(image=image)
labels = dynfilter.DynamicFilter().apply(frame, None, numpy.zeros((3, 2), numpy.float32))
view = labels.removed
class Nobody(dynfilter.Segmenter):
    def do_segment(self, frame):
        return self.empty_segmentation(frame)
keep = Nobody()
threading.Thread(target=lambda: keep.segment(frame)).start()
"""
    )
    assert result.returncode == 0 and result.stderr == ""


def test_ends_cleanly_while_daemon_threads_filter():
    result = python(
        """
import threading, numpy, dynfilter
points = numpy.random.default_rng(1).uniform(0, 600, (20000, 2)).astype(numpy.float32)
frame = dynfilter.FrameView(depth=numpy.ones((600, 600), numpy.float32))
masks = numpy.zeros((1, 600, 600), bool)
masks[0, 100:400, 100:400] = True
people = dynfilter.Segmentation.from_masks(frame, masks)
filter, started = dynfilter.DynamicFilter(), threading.Barrier(4)
def work():
    filter.apply(frame, people, points)
    started.wait()
    while True:
        filter.apply(frame, people, points)
for _ in range(3):
    threading.Thread(target=work, daemon=True).start()
started.wait()
import atexit
atexit.register(lambda: filter.apply(frame, people, points))
"""
    )
    assert result.returncode == 0 and result.stderr == ""


def test_help_tells_all():
    text = pydoc.render_doc(dynfilter, renderer=pydoc.plaintext)
    for name in dynfilter.__all__:
        assert name in text
    assert "_dynfilter." not in text  # types have the package's name
    for name in dynfilter.__all__:
        value = getattr(dynfilter, name)
        assert value.__doc__ and value.__doc__.strip(), name
        if inspect.isclass(value):
            assert value.__module__ == "dynfilter"
            for member, attribute in vars(value).items():
                if not member.startswith("_") and member not in ("name", "value"):
                    assert attribute.__doc__, f"{name}.{member}"
