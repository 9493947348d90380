# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""The checks of the input."""

import numpy as np
import pytest

import dynfilter


def findings_of(scene, masks, scale=1.0):
    checks = dynfilter.InputChecks(dynamic_classes=[0])
    checks.note_camera(100, 100, 80, 60)
    for i in range(8):
        frame = scene.frame(timestamp_s=i / 30, metres_per_unit=scale / 5000)
        checks.add(frame, dynfilter.Segmentation.from_masks(frame, masks), scene.points)
    assert len(checks) == 8
    return {finding.check: finding.sentence for finding in checks.findings()}


def test_inverted_masks_and_a_wrong_unit_are_named(scene):
    sound = findings_of(scene, scene.mask[None])
    assert "masks_everywhere" not in sound and "depth_unit" not in sound
    inverted = findings_of(scene, (scene.mask[None] == 0).astype(np.uint8))
    assert "are they inverted" in inverted["masks_everywhere"]
    assert "too large" in findings_of(scene, scene.mask[None], 100)["depth_unit"]


def test_misuse_is_refused(scene):
    checks = dynfilter.InputChecks()
    checks.add(scene.frame())
    assert checks.findings() == []
    with pytest.raises(TypeError):
        checks.add(scene.frame(), scene.mask)
    with pytest.raises(ValueError, match="metres_per_unit"):
        checks.add(dynfilter.FrameView(depth=np.zeros((4, 4), np.uint16)))
