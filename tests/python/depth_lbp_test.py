# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""D-LBP against an oracle in NumPy: compare each pixel with its eight neighbours."""

import numpy as np
import pytest

import dynfilter

CLOCKWISE = [(-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1)]  # row, column


def oracle(depth):
    """Codes of all pixels, and whether each has one."""
    values = depth.astype(np.float64)
    has_depth = np.isfinite(values) & (values > 0)
    codes = np.zeros(depth.shape, np.uint8)
    inner = values[1:-1, 1:-1]
    for bit, (row, column) in enumerate(CLOCKWISE):
        rows = slice(1 + row, depth.shape[0] - 1 + row)
        columns = slice(1 + column, depth.shape[1] - 1 + column)
        with np.errstate(invalid="ignore"):
            farther = has_depth[rows, columns] & (values[rows, columns] > inner)
        if missing_is_farther:
            farther |= ~has_depth[rows, columns]
        codes[1:-1, 1:-1] |= (farther.astype(np.uint8) << bit).astype(np.uint8)
    has_code = np.zeros(depth.shape, bool)
    has_code[1:-1, 1:-1] = has_depth[1:-1, 1:-1]
    return np.where(has_code, codes, 0).astype(np.uint8), has_code


def depth_image(seed, dtype, shape=(37, 83)):
    random = np.random.default_rng(seed)
    depth = random.integers(0, 9, shape).astype(dtype)
    if dtype == np.float32:
        depth += random.random(shape, dtype=np.float32)
        depth[random.random(shape) < 0.05] = np.nan
        depth[random.random(shape) < 0.05] = np.inf
        depth[random.random(shape) < 0.05] = -1
    return depth


@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
@pytest.mark.parametrize("seed", [11, 12, 13])
def test_dense_codes_are_those_of_the_oracle(seed, dtype):
    depth = depth_image(seed, dtype)
    assert np.array_equal(dynfilter.DepthLbp().dense(depth), oracle(depth)[0])


def test_codes_of_features_are_those_of_the_image():
    depth = depth_image(11, np.uint16)
    points = np.random.default_rng(12).uniform(-2, 85, (300, 2)).astype(np.float32)
    codes, has_code = oracle(depth)
    expected = []
    for column, row in np.floor(points + np.float32(0.5)).astype(int):
        inside = 0 <= row < depth.shape[0] and 0 <= column < depth.shape[1]
        expected.append(int(codes[row, column]) if inside and has_code[row, column] else -1)
    lbp = dynfilter.DepthLbp()
    assert lbp.codes(depth, points).tolist() == expected
    row, column = np.argwhere(has_code)[0]
    assert lbp.code(depth, (int(column), int(row))) == codes[row, column]
    assert lbp.code(depth, (0, 0)) is None


def test_codes_of_a_part_of_an_image():
    depth = depth_image(13, np.uint16)
    part = depth[5:30:2, 10:50]
    assert np.array_equal(dynfilter.DepthLbp().dense(part), oracle(part)[0])


def test_the_result_is_the_callers():
    codes = dynfilter.DepthLbp().dense(depth_image(11, np.uint16))
    codes[:] = 7
    assert (codes == 7).all()


def test_misuse():
    with pytest.raises(ValueError, match="^dynfilter::DepthLbp: got a depth image of int64"):
        dynfilter.DepthLbp().dense(np.zeros((4, 4), np.int64))
