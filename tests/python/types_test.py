# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""The generated stub names the module's classes, and the page's Python has its types."""

import pathlib
import re
import subprocess
import sys

import pytest

import dynfilter

STUB = pathlib.Path(dynfilter.__file__).with_name("_dynfilter.pyi")
if not STUB.exists():
    pytest.skip("the module was built without mypy", allow_module_level=True)

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


def test_every_class_is_in_the_stub():
    named = set(re.findall(r"^(?:class|def) (\w+)", STUB.read_text(), flags=re.M))
    assert set(dynfilter.__all__) - named == set()


def test_page_has_the_types_of_the_stub(tmp_path, sources):
    page = (sources / "examples/python/README.md").read_text()
    files = []
    for block in re.findall(r"^```python\n(.*?)^```$", page, flags=re.M | re.S):
        files.append(tmp_path / f"block_{len(files)}.py")
        given = GIVEN.replace("detect: Any\n", "") if "def detect" in block else GIVEN
        files[-1].write_text(given + block)
    assert len(files) == 4
    assert errors(tmp_path, *files) == []


def test_wrong_uses_are_found(tmp_path):
    file = tmp_path / "wrong.py"
    file.write_text(WRONG)
    lines = {int(message.split(":")[1]) for message in errors(tmp_path, file)}
    assert lines == set(range(2, len(WRONG.splitlines()) + 1))
