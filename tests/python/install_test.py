# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""The installed module works, also after its folder was moved."""

import os
import pathlib
import shutil
import subprocess
import sys

import pytest


def test_component_is_complete_and_relocatable(tmp_path):
    cmake = shutil.which("cmake")
    if cmake is None:
        pytest.skip("there is no cmake")
    first, moved = tmp_path / "first", tmp_path / "moved"
    command = [cmake, "--install", os.environ["DYNFILTER_BINARY_DIR"]]
    command += ["--component", "dynfilter-python", "--prefix", str(first)]
    subprocess.run(command, check=True)
    first.rename(moved)
    (package,) = moved.rglob("dynfilter")
    names = {path.name for path in package.iterdir()}
    stub = {"_dynfilter.pyi", "py.typed"}
    assert names & stub in (set(), stub)
    assert "__init__.py" in names and len(names - stub) == 2
    shared = {
        path for path in pathlib.Path(os.environ["DYNFILTER_BINARY_DIR"]).rglob("libdynfilter*.so*")
    }
    if shared:
        pytest.skip("the libraries are shared: they come with other components")
    code = "import dynfilter; print(dynfilter.__file__); dynfilter.DynamicFilter()"
    output = subprocess.run(
        [sys.executable, "-c", code],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(package.parent)},
    ).stdout
    assert output.strip() == str(package / "__init__.py")
