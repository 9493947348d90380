# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Peer of remote_python_test.cpp: the first pixel of an image says what it does."""

import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples" / "remote_masks"))
import remote_masks  # noqa: E402


def segment(image):
    action = int(image.flat[0])
    if action == 1:
        raise RuntimeError("no masks\ntoday")
    if action == 2:
        return [(0, float("nan"), (0, 0, 1, 1), None)]
    return [{"class_id": action, "box": (-1.5, 2.0, 10.25, 3.0), "track_id": -7}]


remote_masks.serve(sys.argv[1], segment)
