// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

/// @file
/// Includes the whole core: everything that needs no file, no network and no thread.

#pragma once

#include "dynfilter/camera.hpp"
#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/edge_compensator.hpp"
#include "dynfilter/feature_floor.hpp"
#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/host_masks.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/keep_enough.hpp"
#include "dynfilter/keep_static.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/mask_refiner.hpp"
#include "dynfilter/overlay.hpp"
#include "dynfilter/pipeline.hpp"
#include "dynfilter/pose.hpp"
#include "dynfilter/range_estimator.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/segmenter.hpp"
#include "dynfilter/stage.hpp"
#include "dynfilter/statistics.hpp"
#include "dynfilter/version.hpp"
#include "dynfilter/workspace.hpp"

/// Keeps the features of moving objects out of visual SLAM.
namespace dynfilter {}
