# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""ATE and RPE against NumPy."""

import numpy as np
import pytest

import dynfilter


def quaternion_matrix(q):
    x, y, z, w = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def trajectory(seed, count=60):
    random = np.random.default_rng(seed)
    rows = np.empty((count, 8))
    rows[:, 0] = 100 + np.arange(count) / 10
    rows[:, 1:4] = np.cumsum(random.normal(0, 0.05, (count, 3)), axis=0)
    turns = np.cumsum(random.normal(0, 0.03, (count, 3)), axis=0)
    rows[:, 4:7] = turns
    rows[:, 7] = 1
    rows[:, 4:] /= np.linalg.norm(rows[:, 4:], axis=1, keepdims=True)
    return rows


def disturbed(rows, seed):
    random = np.random.default_rng(seed)
    other = rows.copy()
    other[:, 0] += random.uniform(-0.005, 0.005, len(rows))
    other[:, 1:4] = rows[:, 1:4] @ quaternion_matrix(np.array([0.3, 0.1, -0.2, 1])).T * 0.8 + [
        1,
        2,
        3,
    ]
    other[:, 1:4] += random.normal(0, 0.02, (len(rows), 3))
    other[:, 4:] += random.normal(0, 0.01, (len(rows), 4))
    other[:, 4:] /= np.linalg.norm(other[:, 4:], axis=1, keepdims=True)
    return other


def umeyama_errors(estimate, truth, with_scale):
    e, t = estimate[:, 1:4].T, truth[:, 1:4].T
    me, mt = e.mean(1, keepdims=True), t.mean(1, keepdims=True)
    u, d, v = np.linalg.svd((t - mt) @ (e - me).T)
    s = np.diag([1, 1, np.sign(np.linalg.det(u @ v))])
    rotation = u @ s @ v
    scale = (d * s.diagonal()).sum() / ((e - me) ** 2).sum() if with_scale else 1.0
    return np.linalg.norm(scale * rotation @ (e - me) + mt - t, axis=0), rotation, scale


@pytest.mark.parametrize("with_scale", [False, True])
@pytest.mark.parametrize("seed", [11, 12, 13])
def test_absolute_error(seed, with_scale):
    truth = trajectory(seed)
    estimate = disturbed(truth, seed + 50)
    result = dynfilter.absolute_trajectory_error(estimate, truth, with_scale=with_scale)
    errors, rotation, scale = umeyama_errors(estimate, truth, with_scale)
    assert np.allclose(result.errors_m, errors, atol=1e-9)
    assert np.array_equal(result.timestamps_s, estimate[:, 0])
    assert np.allclose(result.alignment.rotation, rotation, atol=1e-9)
    assert result.alignment.scale == pytest.approx(scale, abs=1e-9)
    moved = scale * estimate[:, 1:4] @ rotation.T + result.alignment.translation
    assert np.allclose(np.linalg.norm(moved - truth[:, 1:4], axis=1), errors, atol=1e-9)
    summary = result.translation_m
    assert summary.count == 60
    assert summary.rmse == pytest.approx(np.sqrt((errors**2).mean()), abs=1e-9)
    assert summary.median == pytest.approx(np.median(errors), abs=1e-9)
    assert summary.mean == pytest.approx(errors.mean(), abs=1e-9)
    assert summary.standard_deviation == pytest.approx(errors.std(), abs=1e-9)
    assert (summary.min_error, summary.max_error) == pytest.approx((errors.min(), errors.max()))


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_relative_error_of_frames(seed):
    truth = trajectory(seed)
    estimate = disturbed(truth, seed + 50)
    result = dynfilter.relative_pose_error(estimate, truth, interval_frames=1)

    def matrix(row):
        pose = np.eye(4)
        pose[:3, :3] = quaternion_matrix(row[4:])
        pose[:3, 3] = row[1:4]
        return pose

    translations, angles = [], []
    for i in range(len(truth) - 2):  # the interval that ends at the last pose is left out
        p = np.linalg.inv(matrix(estimate[i])) @ matrix(estimate[i + 1])
        q = np.linalg.inv(matrix(truth[i])) @ matrix(truth[i + 1])
        error = p @ np.linalg.inv(q)
        translations.append(np.linalg.norm(error[:3, 3]))
        angles.append(np.degrees(np.arccos(np.clip((np.trace(error[:3, :3]) - 1) / 2, -1, 1))))
    assert result.translation_m.count == len(translations)
    assert result.translation_m.rmse == pytest.approx(
        np.sqrt(np.mean(np.square(translations))), rel=1e-6
    )
    assert result.translation_m.max_error == pytest.approx(max(translations), rel=1e-6)
    assert result.rotation_deg.rmse == pytest.approx(np.sqrt(np.mean(np.square(angles))), rel=1e-5)
    assert np.array_equal(result.timestamps_s, estimate[:-2, 0])


def test_files_are_written_and_read(tmp_path):
    rows = trajectory(11)
    dynfilter.write_trajectory(tmp_path / "estimate.txt", rows)
    again = dynfilter.read_trajectory(tmp_path / "estimate.txt")
    assert np.allclose(again, rows, atol=1e-6)
    assert np.allclose(np.loadtxt(tmp_path / "estimate.txt"), rows, atol=1e-6)
    with pytest.raises(RuntimeError, match="absent.txt"):
        dynfilter.read_trajectory(tmp_path / "absent.txt")


@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda rows: rows[:, :7], r"got a trajectory of float64, shape \(60, 7\); want N x 8"),
        (lambda rows: rows * np.nan, "got a value that is not finite in row 0"),
        (lambda rows: rows[::-1], "got time 105.8 in row 1; want times that increase"),
        (
            lambda rows: np.hstack([rows[:, :4], rows[:, 4:] * 2]),
            "got a quaternion of length 2 in row 0",
        ),
    ],
)
def test_malformed_trajectories_are_refused(spoil, message):
    rows = trajectory(12)
    with pytest.raises(ValueError, match=message):
        dynfilter.absolute_trajectory_error(spoil(rows), rows)
    with pytest.raises(RuntimeError, match="absolute_trajectory_error|pose"):
        dynfilter.absolute_trajectory_error(rows[:1], rows)
