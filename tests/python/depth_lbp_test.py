# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""D-LBP of arrays; the C++ tests hold the oracle."""

import numpy as np
import pytest

import dynfilter


@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
def test_codes_are_those_of_the_neighbours(dtype):
    depth = np.full((5, 7), 3, dtype)
    depth[1, 1] = depth[2, 3] = 5  # top left of (2, 2), and right of it
    depth[3, 2] = 0  # unknown, below it
    lbp = dynfilter.DepthLbp()
    codes = lbp.dense(depth)
    assert codes.dtype == np.uint8 and codes.shape == (5, 7)
    assert codes[2, 2] == 0b00001001 and codes[0, 0] == codes[3, 2] == 0
    assert lbp.code(depth, (2, 2)) == 9 and lbp.code(depth, (0, 0)) is None
    points = np.array([[2.2, 1.8], [0, 0], [2, 3]], np.float32)
    found = lbp.codes(depth, points)
    assert found.dtype == np.int16 and found.tolist() == [9, -1, -1]


def test_misuse():
    with pytest.raises(ValueError, match="DepthLbp: got a depth image of int64"):
        dynfilter.DepthLbp().dense(np.zeros((3, 3), int))
