// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_WORKSPACE_HPP
#define DYNFILTER_WORKSPACE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_readings.hpp"
#include "dynfilter/detail/likely_samples.hpp"
#include "dynfilter/detail/rectangle_table.hpp"
#include "dynfilter/detail/sample_lanes.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/object_depth.hpp"

namespace dynfilter {

/// A removed feature that may be given back.
struct RestoreCandidate {
  std::size_t cell = 0;  ///< of the image
  float score = 0.0F;
  bool on_mask = false;
  std::uint64_t key = 0;  ///< hash that decides among equals
  std::size_t feature = 0;
};

/// A dynamic object whose depth is known.
struct ObjectInFrame {
  std::size_t instance = 0;  ///< index into the segmentation's
  cv::Rect reach;            ///< features outside it are not the object's
  ObjectDepth depth;
  double least_nearness = 0;  ///< from which on a pixel without its depth is the object's
};

/// Scratch memory of a filter, kept by the caller between frames so that a frame allocates nothing
/// once one of at least that many features and instances was seen. It carries no information from
/// call to call. One for each thread.
struct Workspace {
  FeaturePixels frame_pixels;                  ///< a pipeline's, for all its stages
  FeaturePixels pixels;                        ///< of the features, read by a stage on its own
  std::vector<std::uint32_t> features;         ///< of one instance
  detail::LikelySamplesMemory likely_samples;  ///< of all instances
  std::vector<SampleCandidate> candidates;     ///< for the sample of one instance
  detail::DepthReadings readings;              ///< at the pixels of features
  std::vector<detail::LaneRow> lanes;          ///< of the samples of some instances
  std::vector<double> depths_m;                ///< of the sample
  std::vector<double> codes;                   ///< of the sample
  std::vector<RestoreCandidate> restorable;
  std::vector<float> pixel_depths_m;  ///< of one instance
  std::vector<ObjectInFrame> objects;
  std::vector<detail::RectangleTable> reaches;  ///< of the objects, 64 in each
};

}  // namespace dynfilter

#endif  // DYNFILTER_WORKSPACE_HPP
