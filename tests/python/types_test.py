# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""The type stubs hold: mypy accepts the page's Python and a use of each name, which runs as well,
and refuses what is wrong."""

import ast
import pathlib
import re
import subprocess
import sys

import pytest
import typed_uses

import dynfilter

NETWORKS = {"NetworkSegmenter", "YoloSegmenter", "YolactSegmenter"}  # where OpenCV has dnn
# What a reader of the page has: the blocks use it.
GIVEN = """from typing import Any
import numpy as np
from numpy.typing import NDArray
import dynfilter
image: NDArray[np.uint8]
depth: NDArray[np.uint16]
masks: NDArray[np.bool_]
boxes: NDArray[np.float32]
points: NDArray[np.float32]
descriptors: NDArray[np.uint8]
estimate: NDArray[np.float64]
model: Any
detect: Any
def track(frame: dynfilter.FrameView, *columns: Any) -> None: ...
"""
WRONG = """import dynfilter
dynfilter.DynamicFilter(margin=3)
dynfilter.DynamicFilter(rule="paper")
dynfilter.DynamicFilter().apply(None, None, [[1.0, 2.0]])
dynfilter.FeatureLabels(3)
dynfilter.Instance().box = (1, 2, 3, 4)
dynfilter.FeatureLabels(3, dynfilter.Segmentation()).statistics.keptt
dynfilter.MaskFolderSegmenter(dynfilter.RgbdSequence("scene").masks_folder())
dynfilter.Reason.unknown
dynfilter.no_such_name
"""


def mypy(folder, *files, options=()):
    """The messages of mypy about these files."""
    found = subprocess.run([sys.executable, "-c", "import mypy"], capture_output=True)
    if found.returncode != 0:
        pytest.skip("mypy is not there")
    packages = pathlib.Path(dynfilter.__file__).parents[1]
    command = [sys.executable, "-m", "mypy", "--cache-dir", str(folder / "cache"), *options]
    result = subprocess.run(
        [*command, *map(str, files)],
        capture_output=True,
        text=True,
        env={"MYPYPATH": str(packages), "PATH": ""},
    )
    assert result.returncode < 2, result.stdout + result.stderr
    return [line for line in result.stdout.splitlines() if ": error: " in line]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("types")  # mypy's cache serves all tests


def test_page_has_the_types_of_the_stubs(folder, sources):
    page = (sources / "examples/python/README.md").read_text()
    files = []
    for block in re.findall(r"^```python\n(.*?)^```$", page, flags=re.M | re.S):
        files.append(folder / f"block_{len(files)}.py")
        given = GIVEN.replace("detect: Any\n", "") if "def detect" in block else GIVEN
        files[-1].write_text(given + block)
    assert len(files) == 5
    # OpenCV of Debian has no stubs.
    options = ["--ignore-missing-imports", "--check-untyped-defs"]
    assert mypy(folder, *files, options=options) == []


def test_each_name_is_used_with_its_types(folder):
    file = pathlib.Path(typed_uses.__file__)
    used = {
        node.attr
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "dynfilter"
    }
    assert used | NETWORKS == set(dynfilter.__all__) | NETWORKS
    assert mypy(folder, file, options=["--strict"]) == []


def test_wrong_uses_are_found(folder):
    file = folder / "wrong.py"
    file.write_text(WRONG)
    lines = {int(message.split(":")[1]) for message in mypy(folder, file)}
    assert lines == set(range(2, len(WRONG.splitlines()) + 1))


def test_uses_run(scene, rendered, tmp_path):
    masks = dynfilter.Segmentation(
        image_size=(160, 120), instances=typed_uses.instances(scene.mask)[:1]
    )
    typed_uses.labels(scene.frame(), masks, scene.points)
    typed_uses.segmenters(scene.frame(), scene.mask)
    typed_uses.motion(scene.frame(), scene.points)
    typed_uses.codes(scene.depth, scene.points)
    typed_uses.sequence(rendered, tmp_path / "written.txt")
    if "NetworkSegmenter" in dynfilter.__all__:
        for kind in ("yolo", "yolact"):
            with pytest.raises(RuntimeError, match="missing.onnx"):
                typed_uses.network(tmp_path / "missing.onnx", kind)
