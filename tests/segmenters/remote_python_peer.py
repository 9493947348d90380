# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Peer of remote_python_test.cpp: the first pixel of an image says what it does."""

import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples" / "remote_masks"))
import remote_masks  # noqa: E402


def segment(frame):
    action = int(frame.image.flat[0])
    if action == 1:
        raise RuntimeError("no masks\ntoday")
    if action == 2:
        return [(0, float("nan"), (0, 0, 1, 1), None)]
    if action == 3:  # finds pixels nearer than 2 m
        depth = frame.depth * frame.metres_per_unit
        mask = (depth > 0) & (depth < 2.0)
        box = (-1.5, 2.0, 10.25, 3.0)
        return [{"class_id": 5, "score": 0.25, "box": box, "mask": mask, "track_id": -7}]
    return [(action, 1.0, (0, 0, 4, 4), None)] * (frame.depth is None)


remote_masks.serve(sys.argv[1], segment, pass_frame=True)
