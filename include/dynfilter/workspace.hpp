// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_WORKSPACE_HPP
#define DYNFILTER_WORKSPACE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/features.hpp"
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
  std::vector<cv::Point> pixels;            ///< of the features
  std::vector<SampleCandidate> candidates;  ///< for the sample of one instance
  std::vector<double> depths_m;             ///< of the sample
  std::vector<double> codes;                ///< of the sample
  std::vector<RestoreCandidate> restorable;
  std::vector<float> pixel_depths_m;  ///< of one instance
  std::vector<ObjectInFrame> objects;
};

namespace detail {

/// Puts the features' pixels into the workspace.
inline void read_pixels(FeaturesView features, Workspace& workspace) {
  workspace.pixels.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) workspace.pixels[i] = features.pixel(i);
}

}  // namespace detail
}  // namespace dynfilter

#endif  // DYNFILTER_WORKSPACE_HPP
