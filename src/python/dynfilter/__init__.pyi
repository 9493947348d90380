# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Types of the module dynfilter. See help(dynfilter)."""

from os import PathLike
from pathlib import Path
from typing import Any, Callable, Final, Iterator, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._options import (
    Compensation as Compensation,
    CompensationRule as CompensationRule,
    DepthCompensatorOptions as DepthCompensatorOptions,
    EdgeCompensatorOptions as EdgeCompensatorOptions,
    InstanceVerdict as InstanceVerdict,
    MissingDepth as MissingDepth,
    MotionOutcome as MotionOutcome,
    OutlierRule as OutlierRule,
    RangeEstimatorOptions as RangeEstimatorOptions,
    Reason as Reason,
)
from ._results import (
    AbsoluteTrajectoryError as AbsoluteTrajectoryError,
    Alignment as Alignment,
    CameraParameters as CameraParameters,
    ErrorSummary as ErrorSummary,
    FrameStatistics as FrameStatistics,
    InstancePropagation as InstancePropagation,
    InstanceStatistics as InstanceStatistics,
    MotionStatistics as MotionStatistics,
    PropagationStatistics as PropagationStatistics,
    RelativePoseError as RelativePoseError,
    RgbdSequenceEntry as RgbdSequenceEntry,
    ValueRange as ValueRange,
)

__version__: str

_Path = Union[str, "PathLike[str]"]
_Pixel = tuple[int, int]
_Size = tuple[int, int]
_Box = tuple[int, int, int, int]
_Numbers = NDArray[np.float64]

class FrameView:
    id: Final[int]
    timestamp_s: Final[float]
    image: Final[Optional[NDArray[np.uint8]]]
    depth: Final[Optional[NDArray[Any]]]
    metres_per_unit: Final[float]
    depth_scale: Final[float]
    def __init__(
        self,
        *,
        id: int = 0,
        timestamp_s: float = 0.0,
        image: Optional[ArrayLike] = None,
        depth: Optional[ArrayLike] = None,
        metres_per_unit: float = 0.0,
    ) -> None: ...
    def depth_m(self, pixel: _Pixel) -> Optional[float]: ...

class Instance:
    class_id: Final[int]
    score: Final[float]
    box: Final[_Box]
    mask_origin: Final[_Pixel]
    mask: Final[Optional[NDArray[Any]]]
    track_id: Final[Optional[int]]
    def __init__(
        self,
        *,
        class_id: int = 0,
        score: float = 1.0,
        box: _Box = (0, 0, 0, 0),
        mask_origin: _Pixel = (0, 0),
        mask: Optional[ArrayLike] = None,
        track_id: Optional[int] = None,
    ) -> None: ...
    def covers(self, pixel: _Pixel) -> bool: ...
    def box_contains(self, pixel: _Pixel) -> bool: ...
    @staticmethod
    def from_image_mask(
        mask: ArrayLike, box: Optional[_Box] = None, class_id: int = 0, score: float = 1.0
    ) -> Instance: ...
    @staticmethod
    def from_static_mask(
        static_mask: ArrayLike, class_id: int = 0, score: float = 1.0
    ) -> Instance: ...
    @staticmethod
    def from_box_mask(
        mask: ArrayLike, box: _Box, class_id: int = 0, score: float = 1.0
    ) -> Instance: ...
    @staticmethod
    def from_box(box: _Box, class_id: int = 0, score: float = 1.0) -> Instance: ...

def instances_from_binary_mask(
    mask: ArrayLike, box_margin_px: int = 0, min_pixels: int = 1
) -> list[Instance]: ...
def instances_from_label_map(label_map: ArrayLike) -> list[Instance]: ...
def instances_from_masks(
    masks: Optional[ArrayLike],
    boxes: Optional[ArrayLike] = None,
    class_ids: Optional[ArrayLike] = None,
    scores: Optional[ArrayLike] = None,
    threshold: float = 0.5,
) -> list[Instance]: ...

class Segmentation:
    frame_id: Final[int]
    timestamp_s: Final[float]
    image_size: Final[_Size]
    instances: tuple[Instance, ...]
    def __init__(
        self,
        *,
        frame_id: int = 0,
        timestamp_s: float = 0.0,
        image_size: _Size = (0, 0),
        instances: Sequence[Instance] = ...,
    ) -> None: ...
    @staticmethod
    def from_masks(
        frame: FrameView,
        masks: Optional[ArrayLike],
        boxes: Optional[ArrayLike] = None,
        class_ids: Optional[ArrayLike] = None,
        scores: Optional[ArrayLike] = None,
        threshold: float = 0.5,
    ) -> Segmentation: ...

class FeatureLabel:
    score: Final[float]
    instance: Final[int]
    reason: Final[Reason]
    removed: Final[bool]

class FeatureLabels:
    removed: Final[NDArray[np.bool_]]
    score: Final[NDArray[np.float32]]
    instance: Final[NDArray[np.int32]]
    reason: Final[NDArray[np.uint8]]
    statistics: Final[FrameStatistics]
    def __init__(self, features: int, segmentation: Segmentation) -> None: ...
    def __len__(self) -> int: ...
    def __getitem__(self, feature: int) -> FeatureLabel: ...
    def remove(self, feature: int, instance: int, reason: Reason, score: float) -> bool: ...
    def suspect(self, feature: int, instance: int, score: float) -> bool: ...
    def restore(self, feature: int) -> bool: ...
    def mark_dynamic(self, instance: int) -> None: ...

def keep_static(
    labels: FeatureLabels, *columns: Any, in_place: bool = False
) -> tuple[Any, ...]: ...
def new_indices(labels: FeatureLabels) -> NDArray[np.int32]: ...
def kept_below(labels: FeatureLabels, pivot: int) -> int: ...

class DynamicFilter:
    def __init__(
        self,
        *,
        dynamic_classes: Sequence[int] = [0],
        margin_px: float = 0.0,
        static_mask: Optional[ArrayLike] = None,
        rule: CompensationRule = ...,
        depth: DepthCompensatorOptions = ...,
        paper: EdgeCompensatorOptions = ...,
        floor: int = 0,
    ) -> None: ...
    def apply(
        self,
        frame: FrameView,
        segmentation: Optional[Segmentation],
        features: ArrayLike,
        depths_m: Optional[ArrayLike] = None,
    ) -> FeatureLabels: ...

def draw_overlay(
    image: ArrayLike,
    segmentation: Segmentation,
    features: ArrayLike,
    labels: FeatureLabels,
) -> NDArray[np.uint8]: ...

class DepthLbp:
    def __init__(self) -> None: ...
    def dense(self, depth: ArrayLike) -> NDArray[np.uint8]: ...
    def codes(self, depth: ArrayLike, features: ArrayLike) -> NDArray[np.int16]: ...
    def code(self, depth: ArrayLike, pixel: _Pixel) -> Optional[int]: ...

class Segmenter:
    def __init__(self) -> None: ...
    def segment(self, frame: FrameView) -> Segmentation: ...
    @staticmethod
    def empty_segmentation(frame: FrameView) -> Segmentation: ...
    def do_segment(self, frame: FrameView) -> Segmentation: ...

class CallbackSegmenter(Segmenter):
    def __init__(self, callback: Callable[[NDArray[np.uint8]], Sequence[Instance]]) -> None: ...

class MaskFolderSegmenter(Segmenter):
    def __init__(
        self,
        folder: _Path,
        *,
        max_time_difference_s: float = 0.001,
        box_margin_px: int = 20,
        min_pixels: int = 1,
        allow_missing: bool = False,
    ) -> None: ...
    def __len__(self) -> int: ...
    def has_mask(self, timestamp_s: float) -> bool: ...

class MaskFolderWriter:
    def __init__(self, folder: _Path, *, overwrite: bool = False) -> None: ...
    def __len__(self) -> int: ...
    def add(self, segmentation: Segmentation, stem: Optional[str] = None) -> None: ...
    def finish(self) -> None: ...

class MaskPropagator:
    statistics: Final[PropagationStatistics]
    def __init__(
        self,
        *,
        work_width_px: int = ...,
        point_spacing_px: int = ...,
        max_forward_backward_px: float = ...,
        field_sigma_px: float = ...,
        edge_px: float = ...,
        min_points: int = ...,
        min_iou: float = ...,
        max_missed: int = ...,
        max_age_s: float = ...,
        history_frames: int = ...,
        age_share: float = ...,
    ) -> None: ...
    def propagate(
        self,
        frame: FrameView,
        newest: Optional[Segmentation] = None,
        features: Optional[ArrayLike] = None,
        tracks: Optional[ArrayLike] = None,
    ) -> Optional[Segmentation]: ...
    def reset(self) -> None: ...

class NetworkSegmenter(Segmenter):
    class_names: Final[list[str]]
    input_size: Final[_Size]
    def __init__(
        self,
        model: _Path,
        *,
        classes: Sequence[int] = [],
        score_threshold: Optional[float] = None,
        iou_threshold: Optional[float] = None,
        max_instances: Optional[int] = None,
        class_names: Sequence[str] = [],
        input_size: _Size = (0, 0),
    ) -> None: ...
    def class_id(self, name: str) -> Optional[int]: ...

class YoloSegmenter(NetworkSegmenter): ...
class YolactSegmenter(NetworkSegmenter): ...

class PinholeCamera:
    fx: Final[float]
    fy: Final[float]
    cx: Final[float]
    cy: Final[float]
    k1: Final[float]
    k2: Final[float]
    p1: Final[float]
    p2: Final[float]
    k3: Final[float]
    def __init__(
        self,
        *,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        k1: float = 0.0,
        k2: float = 0.0,
        p1: float = 0.0,
        p2: float = 0.0,
        k3: float = 0.0,
    ) -> None: ...

class MotionState:
    def __init__(self) -> None: ...
    def reset(self) -> None: ...

class MotionFilter:
    def __init__(
        self,
        camera: PinholeCamera,
        state: MotionState,
        *,
        dynamic_classes: Sequence[int] = [0],
        margin_px: float = 0.0,
        static_mask: Optional[ArrayLike] = None,
        rule: CompensationRule = ...,
        depth: DepthCompensatorOptions = ...,
        paper: EdgeCompensatorOptions = ...,
        floor: int = 0,
    ) -> None: ...
    def apply(
        self,
        frame: FrameView,
        segmentation: Optional[Segmentation],
        features: ArrayLike,
        depths_m: Optional[ArrayLike] = None,
    ) -> FeatureLabels: ...
    def track(
        self, frame: FrameView, features: ArrayLike
    ) -> Optional[NDArray[np.float32]]: ...

def read_camera(path: _Path) -> CameraParameters: ...

class RgbdSequence:
    camera: Final[CameraParameters]
    folder: Final[Path]
    depth_offset_s: Final[float]
    has_depth: Final[bool]
    def __init__(
        self,
        folder: _Path,
        *,
        max_time_difference_s: float = 0.02,
        camera_file: Optional[_Path] = None,
        depth_offset_s: Optional[float] = None,
    ) -> None: ...
    def __len__(self) -> int: ...
    def __getitem__(self, frame: int) -> FrameView: ...
    def __iter__(self) -> Iterator[FrameView]: ...
    def read(self, frame: int) -> FrameView: ...
    def entry(self, frame: int) -> RgbdSequenceEntry: ...
    def groundtruth_file(self) -> Optional[Path]: ...
    def masks_folder(self) -> Optional[Path]: ...
    def true_masks_folder(self) -> Optional[Path]: ...

def read_trajectory(path: _Path) -> _Numbers: ...
def write_trajectory(path: _Path, trajectory: ArrayLike) -> None: ...
def absolute_trajectory_error(
    estimate: ArrayLike,
    truth: ArrayLike,
    *,
    max_time_difference_s: float = 0.02,
    with_scale: bool = False,
) -> AbsoluteTrajectoryError: ...
def relative_pose_error(
    estimate: ArrayLike,
    truth: ArrayLike,
    *,
    interval_s: float = 1.0,
    interval_frames: int = 0,
    max_time_difference_s: float = 0.02,
    scale: float = 1.0,
) -> RelativePoseError: ...
