# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Scenes and files that the tests share."""

import os
import pathlib
import subprocess

import numpy as np
import pytest

import dynfilter


class Scene:
    """A person 1.5 m away before a wall at 3 m: image, depth, mask, box and points of a grid."""

    def __init__(self, seed=11, width=160, height=120):
        random = np.random.default_rng(seed)
        self.image = random.integers(0, 256, (height, width, 3), dtype=np.uint8)
        self.depth = np.full((height, width), 15000, np.uint16)
        self.person = np.zeros((height, width), bool)
        self.person[20:100, 60:100] = True
        self.depth[self.person] = 7500
        self.depth += random.integers(0, 20, self.depth.shape, dtype=np.uint16)
        self.mask = self.person.copy()
        self.mask[20:100, 90:100] = False  # what the network missed
        self.box = np.array([[58.0, 18.0, 102.0, 102.0]], np.float32)
        grid = np.mgrid[4:width:7, 4:height:7].reshape(2, -1).T
        self.points = np.ascontiguousarray(grid, np.float32)

    def frame(self, **values):
        return dynfilter.FrameView(
            **{"image": self.image, "depth": self.depth, "metres_per_unit": 1 / 5000, **values}
        )

    def segmentation(self):
        return dynfilter.Segmentation.from_masks(self.frame(), self.mask[None], self.box)


@pytest.fixture
def scene():
    return Scene()


@pytest.fixture(scope="session")
def rendered(tmp_path_factory):
    """A rendered sequence of 4 frames of 320x240 with masks and truth."""
    program = os.environ.get("DYNFILTER_PROGRAM")
    if not program:
        pytest.skip("DYNFILTER_PROGRAM, the program dynfilter, is not built")
    folder = tmp_path_factory.mktemp("rendered") / "scene"
    options = "--frames 4 --width 320 --height 240 --seed 11".split()
    command = [program, "synth", str(folder), *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder


@pytest.fixture(scope="session")
def data():
    """The folder of recorded sequences."""
    folder = os.environ.get("DYNFILTER_DATA_DIR")
    if not folder:
        pytest.skip("DYNFILTER_DATA_DIR is not set")
    return pathlib.Path(folder) / "data"


@pytest.fixture(scope="session")
def sources():
    return pathlib.Path(os.environ["DYNFILTER_SOURCE_DIR"])
