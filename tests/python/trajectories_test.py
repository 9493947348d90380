# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""ATE and RPE of arrays; the C++ tests hold the oracle."""

import numpy as np
import pytest

import dynfilter


def trajectory(count=60):
    random = np.random.default_rng(11)
    rows = np.empty((count, 8))
    rows[:, 0] = 100 + np.arange(count) / 10
    rows[:, 1:4] = np.cumsum(random.normal(0, 0.05, (count, 3)), axis=0)
    rows[:, 4:7] = np.cumsum(random.normal(0, 0.03, (count, 3)), axis=0)
    rows[:, 7] = 1
    rows[:, 4:] /= np.linalg.norm(rows[:, 4:], axis=1, keepdims=True)
    return rows


def test_absolute_error():
    truth, moved = trajectory(), trajectory()
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    moved[:, 1:4] = moved[:, 1:4] @ turn.T / 2 + [1, 2, 3]
    result = dynfilter.absolute_trajectory_error(moved, truth, with_scale=True)
    assert result.translation_m.rmse == pytest.approx(0, abs=1e-9)
    assert np.allclose(result.alignment.rotation, turn.T)
    assert result.alignment.scale == pytest.approx(2)
    assert np.array_equal(result.timestamps_s, truth[:, 0])
    moved[5, 1] += 1
    errors = dynfilter.absolute_trajectory_error(moved, truth).errors_m
    assert len(errors) == 60 and errors.max() > 0.1


def test_relative_error():
    truth, moved = trajectory(), trajectory()
    moved[:, 1] += np.arange(60) * 0.1
    result = dynfilter.relative_pose_error(moved, truth, interval_frames=1)
    assert result.translation_m.rmse == pytest.approx(0.1)
    assert result.rotation_deg.max_error == pytest.approx(0, abs=1e-5)
    assert np.array_equal(result.timestamps_s, truth[:-2, 0])


def test_files_are_written_and_read(tmp_path):
    rows = trajectory()
    dynfilter.write_trajectory(tmp_path / "estimate.txt", rows)
    assert np.allclose(dynfilter.read_trajectory(tmp_path / "estimate.txt"), rows, atol=1e-6)
    assert np.allclose(np.loadtxt(tmp_path / "estimate.txt"), rows, atol=1e-6)
    with pytest.raises(RuntimeError, match="absent.txt"):
        dynfilter.read_trajectory(tmp_path / "absent.txt")


@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda rows: rows[:, :7], r"got a trajectory of float64, shape \(60, 7\); want N x 8"),
        (lambda rows: rows * np.nan, "got a value that is not finite in row 0"),
        (lambda rows: rows[::-1], "got time 105.8 in row 1; want times that increase"),
        (lambda rows: rows * [1, 1, 1, 1, 2, 2, 2, 2], "got a quaternion of length 2 in row 0"),
    ],
)
def test_malformed_trajectories_are_refused(spoil, message):
    rows = trajectory()
    with pytest.raises(ValueError, match=message):
        dynfilter.absolute_trajectory_error(spoil(rows), rows)
    with pytest.raises(RuntimeError, match="absolute_trajectory_error|pose"):
        dynfilter.absolute_trajectory_error(rows[:1], rows)
