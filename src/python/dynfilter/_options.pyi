# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Types of dynfilter's options and enumerations. There is no such module at run time."""

from typing import Any, ClassVar, Sequence

class _Enumerator:
    """One of some named values. The class is no enum.Enum: not iterable, not subscriptable."""

    __members__: ClassVar[dict[str, Any]]
    def __init__(self, value: int) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...
    def __int__(self) -> int: ...
    def __index__(self) -> int: ...
    def __hash__(self) -> int: ...

class Compensation(_Enumerator):
    not_run: ClassVar[Compensation]
    no_depth_image: ClassVar[Compensation]
    too_few_samples: ClassVar[Compensation]
    applied: ClassVar[Compensation]
    applied_without_image: ClassVar[Compensation]

class CompensationRule(_Enumerator):
    depth: ClassVar[CompensationRule]
    paper: ClassVar[CompensationRule]
    mask: ClassVar[CompensationRule]

class InstanceVerdict(_Enumerator):
    not_judged: ClassVar[InstanceVerdict]
    undecided: ClassVar[InstanceVerdict]
    moving: ClassVar[InstanceVerdict]
    still: ClassVar[InstanceVerdict]

class MissingDepth(_Enumerator):
    keep: ClassVar[MissingDepth]
    remove: ClassVar[MissingDepth]

class MotionOutcome(_Enumerator):
    not_run: ClassVar[MotionOutcome]
    no_image: ClassVar[MotionOutcome]
    started: ClassVar[MotionOutcome]
    repeated: ClassVar[MotionOutcome]
    too_few_tracks: ClassVar[MotionOutcome]
    pose_not_trusted: ClassVar[MotionOutcome]
    applied: ClassVar[MotionOutcome]

class OutlierRule(_Enumerator):
    median_absolute_deviation: ClassVar[OutlierRule]
    interquartile_range: ClassVar[OutlierRule]

class Reason(_Enumerator):
    untouched: ClassVar[Reason]
    in_mask: ClassVar[Reason]
    compensated: ClassVar[Reason]
    restored: ClassVar[Reason]
    moving: ClassVar[Reason]
    custom: ClassVar[Reason]
    def __lt__(self, other: Reason) -> bool: ...
    def __le__(self, other: Reason) -> bool: ...
    def __gt__(self, other: Reason) -> bool: ...
    def __ge__(self, other: Reason) -> bool: ...

class DepthCompensatorOptions:
    half_width_m: float
    mask_margin_px: float
    stale_age_s: float
    motion_px_per_s: float
    def __init__(
        self,
        *,
        half_width_m: float = ...,
        mask_margin_px: float = ...,
        stale_age_s: float = ...,
        motion_px_per_s: float = ...,
    ) -> None: ...

class RangeEstimatorOptions:
    outlier_rule: OutlierRule
    outlier_factor: float
    expansion: float
    def __init__(
        self,
        *,
        outlier_rule: OutlierRule = ...,
        outlier_factor: float = ...,
        expansion: float = ...,
    ) -> None: ...

class EdgeCompensatorOptions:
    samples: int
    seed: int
    depth: RangeEstimatorOptions
    code: RangeEstimatorOptions
    missing_depth: MissingDepth
    def __init__(
        self,
        *,
        samples: int = ...,
        seed: int = ...,
        depth: RangeEstimatorOptions = ...,
        code: RangeEstimatorOptions = ...,
        missing_depth: MissingDepth = ...,
    ) -> None: ...
