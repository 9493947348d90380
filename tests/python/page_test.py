# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""The Python of examples/python/README.md runs as it is printed, and has the types of the stub."""

import pathlib
import re
import subprocess
import sys
import types

import numpy as np
import pytest

import dynfilter


@pytest.fixture
def blocks(sources):
    page = (sources / "examples/python/README.md").read_text()
    return re.findall(r"^```python\n(.*?)^```$", page, flags=re.M | re.S)


def lines(block):
    return [line for line in block.splitlines() if line.strip()]


def corners(image):
    height, width = image.shape[:2]
    points = np.ascontiguousarray(np.mgrid[8:width:9, 8:height:9].reshape(2, -1).T, np.float32)
    return points, np.zeros((len(points), 32), np.uint8)


def test_a_frame_in_five_lines(blocks, scene):
    assert len(lines(blocks[0])) == 5
    points, descriptors = corners(scene.image)
    names = {
        "image": scene.image,
        "depth": scene.depth,
        "masks": scene.mask[None],
        "boxes": scene.box,
        "points": points,
        "descriptors": descriptors,
    }
    exec(blocks[0], names)
    assert 0 < len(names["points"]) == len(names["descriptors"]) < len(points)


def test_a_sequence_in_ten_lines(blocks, rendered, monkeypatch, capsys):
    assert len(lines(blocks[1])) == 10
    monkeypatch.chdir(rendered.parent)
    tracked = []
    exec(blocks[1], {"detect": corners, "track": lambda *arguments: tracked.append(arguments)})
    assert len(tracked) == 4
    assert len(capsys.readouterr().out.splitlines()) == 4
    assert all(len(points) == len(descriptors) for _, points, descriptors in tracked)


def test_features_by_opencv(blocks, scene):
    pytest.importorskip("cv2", reason="python3-opencv, which the page uses, is not there")
    names = {}
    exec(blocks[2], names)
    points, descriptors = names["detect"](scene.image)
    labels = dynfilter.DynamicFilter().apply(scene.frame(), scene.segmentation(), points)
    assert len(labels) == len(descriptors) > 0


class Boxes:
    def __init__(self, scene):
        self.xyxy = scene.box
        self.cls = np.zeros(1, np.float32)
        self.conf = np.full(1, 0.75, np.float32)


class Result:
    """Shaped like Ultralytics' results."""

    def __init__(self, scene, found):
        self.masks = (
            types.SimpleNamespace(data=scene.mask[None].astype(np.float32)) if found else None
        )
        self.boxes = Boxes(scene)
        if not found:
            self.boxes.xyxy, self.boxes.cls, self.boxes.conf = (
                np.zeros((0, 4), np.float32),
                np.zeros(0, np.float32),
                np.zeros(0, np.float32),
            )

    def cpu(self):
        return self

    def numpy(self):
        return self


@pytest.mark.parametrize("found", [True, False])
def test_network_of_your_own(blocks, scene, found):
    names = {
        "dynfilter": dynfilter,
        "model": lambda image, retina_masks: [Result(scene, found)] if retina_masks else [],
    }
    exec(blocks[3], names)
    segmentation = names["People"]().segment(scene.frame())
    assert [i.score for i in segmentation.instances] == ([0.75] if found else [])


STUB = pathlib.Path(dynfilter.__file__).with_name("_dynfilter.pyi")
needs_stub = pytest.mark.skipif(not STUB.exists(), reason="the module was built without mypy")

# What a reader of the page has: the blocks use it.
GIVEN = """from typing import Any
import dynfilter
image: Any
depth: Any
masks: Any
boxes: Any
points: Any
descriptors: Any
model: Any
detect: Any
def track(frame: dynfilter.FrameView, *columns: Any) -> None: ...
"""
WRONG = """import dynfilter
dynfilter.DynamicFilter(margin=3)
dynfilter.DynamicFilter(margin_px="wide")
dynfilter.FeatureLabels(3, dynfilter.Segmentation()).statistics.keptt
dynfilter.Reason.unknown
dynfilter.no_such_name
"""


def errors(folder, *files):
    """Lines of mypy about these files."""
    packages = str(STUB.parents[1])
    options = ["--ignore-missing-imports", "--check-untyped-defs", "--cache-dir", str(folder)]
    result = subprocess.run(
        [sys.executable, "-m", "mypy", *options, *map(str, files)],
        capture_output=True,
        text=True,
        env={"MYPYPATH": packages, "PATH": ""},
    )
    assert result.returncode < 2, result.stdout + result.stderr
    return [line for line in result.stdout.splitlines() if ": error: " in line]


@needs_stub
def test_every_class_is_in_the_stub():
    named = set(re.findall(r"^(?:class|def) (\w+)", STUB.read_text(), flags=re.M))
    assert set(dynfilter.__all__) - named == {"keep_static"}  # that one is written in Python


@needs_stub
def test_page_has_the_types_of_the_stub(tmp_path, blocks):
    files = []
    for block in blocks:
        files.append(tmp_path / f"block_{len(files)}.py")
        given = GIVEN.replace("detect: Any\n", "") if "def detect" in block else GIVEN
        files[-1].write_text(given + block)
    assert len(files) == 4
    assert errors(tmp_path, *files) == []


@needs_stub
def test_wrong_uses_are_found(tmp_path):
    file = tmp_path / "wrong.py"
    file.write_text(WRONG)
    lines = {int(message.split(":")[1]) for message in errors(tmp_path, file)}
    assert lines == set(range(2, len(WRONG.splitlines()) + 1))
