# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Types of dynfilter's options and enumerations. There is no such module at run time."""

from enum import Enum
from typing import Sequence

class Compensation(Enum):
    not_run: int
    no_depth_image: int
    too_few_samples: int
    applied: int
    applied_without_image: int

class CompensationRule(Enum):
    depth: int
    paper: int
    mask: int

class FloorPolicy(Enum):
    report_only: int
    restore_best_scored: int
    restore_balanced: int

class InstanceVerdict(Enum):
    not_judged: int
    undecided: int
    moving: int
    still: int

class MissingDepth(Enum):
    keep: int
    remove: int

class MissingNeighbour(Enum):
    nearer: int
    farther: int

class MotionOutcome(Enum):
    not_run: int
    no_image: int
    started: int
    repeated: int
    too_few_tracks: int
    pose_not_trusted: int
    applied: int

class OutlierRule(Enum):
    median_absolute_deviation: int
    interquartile_range: int

class Reason(Enum):
    untouched: int
    in_mask: int
    compensated: int
    restored: int
    moving: int
    custom: int
    def __int__(self) -> int: ...

class ObjectDepthOptions:
    min_half_width_m: float
    max_half_width_m: float
    min_share: float
    min_mask_share: float
    min_box_share: float
    min_samples: int
    max_places: int
    def __init__(
        self,
        *,
        min_half_width_m: float = ...,
        max_half_width_m: float = ...,
        min_share: float = ...,
        min_mask_share: float = ...,
        min_box_share: float = ...,
        min_samples: int = ...,
        max_places: int = ...,
    ) -> None: ...

class MaskGapOptions:
    row_step_px: float
    reach_px: float
    max_gap_px: float
    min_samples: int
    def __init__(
        self,
        *,
        row_step_px: float = ...,
        reach_px: float = ...,
        max_gap_px: float = ...,
        min_samples: int = ...,
    ) -> None: ...

class DepthCompensatorOptions:
    object_depth: ObjectDepthOptions
    mask_gap: MaskGapOptions
    min_nearness: float
    min_nearness_if_stale: float
    reach_px: float
    box_margin_px: float
    mask_margin_px: float
    shadow_px: float
    min_nearness_in_shadow: float
    max_beyond_range_m: float
    max_step_m: float
    min_off_middle_m: float
    cell_px: float
    stale_age_s: float
    motion_px_per_s: float
    max_age_s: float
    feature_reach_px: float
    feature_doubt_px: float
    min_feature_share: float
    def __init__(
        self,
        *,
        object_depth: ObjectDepthOptions = ...,
        mask_gap: MaskGapOptions = ...,
        min_nearness: float = ...,
        min_nearness_if_stale: float = ...,
        reach_px: float = ...,
        box_margin_px: float = ...,
        mask_margin_px: float = ...,
        shadow_px: float = ...,
        min_nearness_in_shadow: float = ...,
        max_beyond_range_m: float = ...,
        max_step_m: float = ...,
        min_off_middle_m: float = ...,
        cell_px: float = ...,
        stale_age_s: float = ...,
        motion_px_per_s: float = ...,
        max_age_s: float = ...,
        feature_reach_px: float = ...,
        feature_doubt_px: float = ...,
        min_feature_share: float = ...,
    ) -> None: ...

class RangeEstimatorOptions:
    outlier_rule: OutlierRule
    outlier_factor: float
    min_samples: int
    expansion: float
    def __init__(
        self,
        *,
        outlier_rule: OutlierRule = ...,
        outlier_factor: float = ...,
        min_samples: int = ...,
        expansion: float = ...,
    ) -> None: ...

class DepthLbpOptions:
    bits: Sequence[int]
    missing_neighbour: MissingNeighbour
    def __init__(
        self, *, bits: Sequence[int] = ..., missing_neighbour: MissingNeighbour = ...
    ) -> None: ...

class EdgeCompensatorOptions:
    samples: int
    seed: int
    depth: RangeEstimatorOptions
    code: RangeEstimatorOptions
    depth_lbp: DepthLbpOptions
    missing_depth: MissingDepth
    def __init__(
        self,
        *,
        samples: int = ...,
        seed: int = ...,
        depth: RangeEstimatorOptions = ...,
        code: RangeEstimatorOptions = ...,
        depth_lbp: DepthLbpOptions = ...,
        missing_depth: MissingDepth = ...,
    ) -> None: ...
