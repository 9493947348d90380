# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Uses each name of the module with the types that the stubs give. types_test.py checks this file
with mypy, and runs it."""

from pathlib import Path
from typing import Any, Optional, Union

import dynfilter
import numpy as np
from numpy.typing import NDArray


class People(dynfilter.Segmenter):
    def __init__(self, masks: NDArray[np.bool_]) -> None:
        super().__init__()
        self.masks = masks

    def do_segment(self, frame: dynfilter.FrameView) -> dynfilter.Segmentation:
        return dynfilter.Segmentation.from_masks(frame, self.masks)


def options() -> dynfilter.DynamicFilter:
    depth = dynfilter.DepthCompensatorOptions(half_width_m=0.5)
    depth.mask_margin_px = 1.5
    estimator = dynfilter.RangeEstimatorOptions(
        outlier_rule=dynfilter.OutlierRule.interquartile_range, outlier_factor=1.5
    )
    paper = dynfilter.EdgeCompensatorOptions(
        depth=estimator, missing_depth=dynfilter.MissingDepth.keep
    )
    rule: dynfilter.CompensationRule = dynfilter.CompensationRule.__members__["depth"]
    return dynfilter.DynamicFilter(rule=rule, depth=depth, paper=paper, floor=10)


def instances(mask: NDArray[np.bool_]) -> list[dynfilter.Instance]:
    found = dynfilter.instances_from_masks(mask[None], np.array([[58.0, 18.0, 102.0, 102.0]]))
    found += dynfilter.instances_from_binary_mask(mask, box_margin_px=2)
    found += dynfilter.instances_from_label_map(mask.astype(np.uint8))
    found.append(dynfilter.Instance(class_id=2, box=(1, 2, 3, 4), track_id=None))
    found.append(dynfilter.Instance.from_box((1, 2, 3, 4)))
    covered: bool = found[0].covers((70, 50)) and found[0].box_contains((70, 50))
    pixels: Optional[NDArray[Any]] = found[0].mask
    assert covered and pixels is not None
    return found


def labels(
    frame: dynfilter.FrameView, masks: dynfilter.Segmentation, points: NDArray[np.float32]
) -> dynfilter.FeatureLabels:
    result: dynfilter.FeatureLabels = options().apply(frame, masks, points)
    removed: NDArray[np.bool_] = result.removed
    reasons: NDArray[np.uint8] = result.reason
    assert (reasons[removed] == dynfilter.Reason.in_mask).any()
    label: dynfilter.FeatureLabel = result[0]
    reason: dynfilter.Reason = label.reason
    assert reason < dynfilter.Reason.custom
    statistics: dynfilter.FrameStatistics = result.statistics
    motion: dynfilter.MotionStatistics = statistics.motion
    assert motion.outcome == dynfilter.MotionOutcome.not_run
    instance: dynfilter.InstanceStatistics = statistics.instances[0]
    share: float = instance.masked / statistics.features + instance.score
    assert share > 0 and instance.verdict == dynfilter.InstanceVerdict.not_judged
    applied: bool = instance.compensation == dynfilter.Compensation.applied
    range_m: dynfilter.ValueRange = instance.depth_range_m
    assert applied and range_m.contains(range_m.lower)
    kept = dynfilter.keep_static(result, points, list(range(len(points))))
    indices: NDArray[np.int32] = dynfilter.new_indices(result)
    assert len(kept[0]) == statistics.kept == dynfilter.kept_below(result, len(points))
    assert len(indices) == len(points)
    assert frame.image is not None
    drawn: NDArray[np.uint8] = dynfilter.draw_overlay(frame.image, masks, points, result)
    assert drawn.ndim == 3
    return result


def segmenters(frame: dynfilter.FrameView, mask: NDArray[np.bool_]) -> None:
    segmenter: dynfilter.Segmenter
    for segmenter in (
        People(mask[None]),
        dynfilter.CallbackSegmenter(lambda image: dynfilter.instances_from_masks(mask[None])),
    ):
        masks: dynfilter.Segmentation = segmenter.segment(frame)
        propagator = dynfilter.MaskPropagator(max_age_s=0.5)
        moved: Optional[dynfilter.Segmentation] = propagator.propagate(frame, masks)
        statistics: dynfilter.PropagationStatistics = propagator.statistics
        moves: tuple[dynfilter.InstancePropagation, ...] = statistics.instances
        assert moved is not None and len(moves) == 1


def network(model: Path, of: str) -> dynfilter.NetworkSegmenter:
    classes: Union[type[dynfilter.YoloSegmenter], type[dynfilter.YolactSegmenter]]
    classes = dynfilter.YoloSegmenter if of == "yolo" else dynfilter.YolactSegmenter
    return classes(model, classes=[0], input_size=(640, 480))


def motion(frame: dynfilter.FrameView, points: NDArray[np.float32]) -> None:
    camera = dynfilter.PinholeCamera(fx=200, fy=200, cx=80, cy=60)
    state = dynfilter.MotionState()
    filter = dynfilter.MotionFilter(camera, state, margin_px=2)
    outcome: dynfilter.MotionOutcome = filter.apply(frame, None, points).statistics.motion.outcome
    assert outcome == dynfilter.MotionOutcome.started
    tracks: Optional[NDArray[np.float32]] = filter.track(frame, points)
    dynfilter.MaskPropagator().propagate(frame, None, points, tracks)
    state.reset()


def codes(depth: NDArray[np.uint16], points: NDArray[np.float32]) -> None:
    lbp = dynfilter.DepthLbp()
    dense: NDArray[np.uint8] = lbp.dense(depth)
    sparse: NDArray[np.int16] = lbp.codes(depth, points)
    one: Optional[int] = lbp.code(depth, (70, 50))
    assert dense.shape == depth.shape and len(sparse) == len(points)
    assert one is None or one < 256


def sequence(folder: Path, written: Path) -> None:
    frames = dynfilter.RgbdSequence(folder, max_time_difference_s=0.02)
    entry: dynfilter.RgbdSequenceEntry = frames.entry(0)
    camera: dynfilter.CameraParameters = frames.camera
    assert camera.fx == dynfilter.read_camera(folder / "camera.yaml").fx
    masks: Optional[Path] = frames.masks_folder()
    assert masks is not None and entry.image_path.exists()
    people = dynfilter.MaskFolderSegmenter(masks)
    writer = dynfilter.MaskFolderWriter(written.parent / "masks", overwrite=True)
    writer.add(people.segment(frames[0]), entry.stem)
    writer.finish()
    assert len(writer) == 1
    sizes = [people.segment(frame).image_size for frame in frames]
    assert len(sizes) == len(frames) == len(people)
    truth: NDArray[np.float64] = dynfilter.read_trajectory(folder / "groundtruth.txt")
    dynfilter.write_trajectory(written, truth)
    absolute: dynfilter.AbsoluteTrajectoryError = dynfilter.absolute_trajectory_error(truth, truth)
    alignment: dynfilter.Alignment = absolute.alignment
    relative: dynfilter.RelativePoseError = dynfilter.relative_pose_error(
        truth, truth, interval_frames=1
    )
    summary: dynfilter.ErrorSummary = relative.rotation_deg
    assert summary.count > 0 and alignment.scale == 1
