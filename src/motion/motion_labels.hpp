// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// From measured motion to verdicts and labels.

#ifndef DYNFILTER_SRC_MOTION_MOTION_LABELS_HPP
#define DYNFILTER_SRC_MOTION_MOTION_LABELS_HPP

#include "motion_measurement.hpp"

namespace dynfilter::detail {

/// Says which features do not tell the camera's motion: removed ones, those near the mask of a
/// dynamic object, those believed dynamic, and those between them. Sets the beliefs to those of the
/// last frame, and notes which features are beside a dynamic object. The features' places must be
/// measured.
void suspect_features(const MotionContext& context, const FeatureLabels& labels);

/// Updates the beliefs by the evidence that measure_motions and support_seeds wrote, and says what
/// is dynamic.
void decide_features(const MotionContext& context);

/// Judges the instances: without known baselines, as a frame in which nothing could be judged.
void judge_instances(const MotionContext& context, FeatureLabels& labels);

/// Gives back what is static (see MotionJudgeOptions::min_kept_share), and removes what moves.
/// Needs the verdicts that judge_instances wrote.
void write_labels(const MotionContext& context, FeatureLabels& labels);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_MOTION_LABELS_HPP
