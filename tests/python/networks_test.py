# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Networks from ONNX files: the tiny models of the C++ tests find red and blue blocks."""

import os
import subprocess
import sys

import numpy as np
import pytest

import dynfilter

if not os.environ.get("DYNFILTER_HAS_NETWORKS"):
    pytest.skip("dynfilter::networks is not built", allow_module_level=True)


@pytest.fixture(scope="module")
def models(tmp_path_factory, sources):
    pytest.importorskip("onnx", reason="python3-onnx, which makes the models, is not there")
    folder = tmp_path_factory.mktemp("networks") / "models"
    subprocess.run(
        [
            sys.executable,
            str(sources / "tests/networks/make_models.py"),
            str(folder),
            str(sources / "examples/cut_yolo_heads.py"),
        ],
        check=True,
    )
    return folder


def test_finds_the_red_block(models):
    image = np.zeros((64, 64, 3), np.uint8)
    image[0:32, 32:64] = (0, 0, 255)
    frame = dynfilter.FrameView(id=5, image=image)
    network = dynfilter.NetworkSegmenter(str(models / "yolo_raw.onnx"))
    assert list(network.class_names) == ["red", "blue"] and network.input_size == (64, 64)
    assert network.class_id("blue") == 1 and network.class_id("green") is None
    segmentation = network.segment(frame)
    assert segmentation.frame_id == 5
    (instance,) = segmentation.instances
    x, y = instance.mask_origin
    assert instance.class_id == 0 and instance.mask[16 - y, 48 - x]
    only_blue = dynfilter.NetworkSegmenter(models / "yolo_raw.onnx", classes=[1])
    assert only_blue.segment(frame).instances == ()
    (person,) = dynfilter.NetworkSegmenter(models / "deeplab.onnx").segment(frame).instances
    assert person.class_id == 0 and person.mask_origin == (32, 0)


def test_other_files_are_refused(models, tmp_path):
    with pytest.raises(RuntimeError, match="missing.onnx"):
        dynfilter.NetworkSegmenter(tmp_path / "missing.onnx")
    with pytest.raises(RuntimeError, match="bad_outputs.onnx"):
        dynfilter.NetworkSegmenter(models / "bad_outputs.onnx")
    with pytest.raises(ValueError):
        dynfilter.NetworkSegmenter(models / "yolo_raw.onnx", score_threshold=2)
    with pytest.raises(ValueError, match="cpu, opencl, cuda or openvino"):
        dynfilter.NetworkSegmenter(models / "yolo_raw.onnx", device="gpu")
