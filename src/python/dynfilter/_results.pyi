# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Types of dynfilter's statistics and results. There is no such module at run time."""

from pathlib import Path
from typing import Final, Optional

import numpy as np
from numpy.typing import NDArray

from ._options import Compensation, InstanceVerdict, MotionOutcome

_Size = tuple[int, int]
_Numbers = NDArray[np.float64]

class ValueRange:
    lower: Final[float]
    upper: Final[float]
    empty: Final[bool]
    def contains(self, value: float) -> bool: ...

class InstanceStatistics:
    class_id: Final[int]
    score: Final[float]
    dynamic: Final[bool]
    masked: Final[int]
    sampled: Final[int]
    candidates: Final[int]
    passed_depth: Final[int]
    passed_code: Final[int]
    passed_nearness: Final[int]
    compensated: Final[int]
    compensation: Final[Compensation]
    depth_range_m: Final[ValueRange]
    mask_gap_px: Final[float]
    depth_shift_px: Final[float]
    mask_gap_places: Final[int]
    verdict: Final[InstanceVerdict]
    given_back: Final[int]
    code_range: Final[ValueRange]

class MotionStatistics:
    outcome: Final[MotionOutcome]
    tracked: Final[int]
    seeds: Final[int]
    supported: Final[int]
    given_back: Final[int]
    scale_px: Final[float]
    pose_support: Final[float]
    unsettled_objects: Final[int]
    baselines: Final[int]

class FrameStatistics:
    features: Final[int]
    masked: Final[int]
    compensated: Final[int]
    moving: Final[int]
    custom: Final[int]
    restored: Final[int]
    starved: Final[bool]
    suggested_features: Final[int]
    has_segmentation: Final[bool]
    segmentation_age_s: Final[float]
    has_depth: Final[bool]
    motion: Final[MotionStatistics]
    instances: tuple[InstanceStatistics, ...]
    removed: Final[int]
    kept: Final[int]
    is_motion_decided: Final[bool]

class InstancePropagation:
    by_flow: Final[int]
    by_velocity: Final[int]
    left: Final[int]
    points: Final[int]
    missed: Final[int]
    age_s: Final[float]

class PropagationStatistics:
    instances: Final[tuple[InstancePropagation, ...]]
    tracked_points: Final[int]
    left_image: Final[int]
    given_up: Final[int]
    took_result: Final[bool]
    ignored_result: Final[bool]
    unknown_start: Final[bool]
    restarted: Final[bool]

class RgbdSequenceEntry:
    timestamp_s: Final[float]
    image_path: Final[Path]
    depth_timestamp_s: Final[float]
    depth_path: Final[Optional[Path]]
    stem: Final[str]

class ErrorSummary:
    count: Final[int]
    rmse: Final[float]
    mean: Final[float]
    median: Final[float]
    standard_deviation: Final[float]
    min_error: Final[float]
    max_error: Final[float]

class Alignment:
    rotation: Final[_Numbers]
    translation: Final[_Numbers]
    scale: Final[float]

class AbsoluteTrajectoryError:
    translation_m: Final[ErrorSummary]
    alignment: Final[Alignment]
    timestamps_s: Final[_Numbers]
    errors_m: Final[_Numbers]

class RelativePoseError:
    translation_m: Final[ErrorSummary]
    rotation_deg: Final[ErrorSummary]
    timestamps_s: Final[_Numbers]

class CameraParameters:
    fx: Final[float]
    fy: Final[float]
    cx: Final[float]
    cy: Final[float]
    k1: Final[float]
    k2: Final[float]
    p1: Final[float]
    p2: Final[float]
    k3: Final[float]
    image_size: Final[_Size]
    frames_per_second: Final[float]
    depth_units_per_metre: Final[float]
    depth_offset_s: Final[float]
