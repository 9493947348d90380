// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_FLOW_REFINED_MASK_HPP
#define DYNFILTER_SRC_LAB_RULES_FLOW_REFINED_MASK_HPP

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "lab/rules/frame_pair.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

/// DN-SLAM's refinement (C. Ruan et al., "DN-SLAM: A Visual SLAM with ORB Features and NeRF Mapping
/// in Dynamic Environments", IEEE Sensors Journal 24(4), 2024). A network gives coarse masks; flow
/// tells which objects move and where their masks have to be completed. The features on a moving
/// object are those on its mask and those around it with residual flow.
///
/// Open in the source, or changed: there, features with flow prompt a segmentation network (SAM),
/// which draws the mask; here they are taken themselves, as far as a margin around the coarse mask.
/// All three thresholds. An object without a mask is its box. The residual flow is that beyond what
/// depth and FrameMemory's pose predict; an object none of whose features has one moves, as the
/// coarse mask says. O(pixels of the masks + features x instances).
class FlowRefinedMask {
 public:
  static constexpr int baseline_frames = 1;

  explicit FlowRefinedMask(Classes dynamic_classes = {0}) : classes_(std::move(dynamic_classes)) {}

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    const std::size_t count = pair.now.features.size();
    std::vector<std::uint8_t> is_known(count), moves(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto flow = residual_flow(pair, i);
      is_known[i] = flow ? 1 : 0;
      moves[i] = flow && cv::norm(*flow) > min_flow_px ? 1 : 0;
    }
    const std::vector<Instance>& instances = pair.now.segmentation.instances;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!is_dynamic(instances[k], classes_)) continue;
      cv::Mat coarse(pair.now.segmentation.image_size, CV_8UC1, cv::Scalar::all(0));
      paint_instance(instances[k], coarse);
      cv::Mat around = coarse.clone();
      dilate_by_square(around, margin_px);
      std::size_t known = 0, moving = 0;
      std::vector<std::size_t> found;
      for (std::size_t i = 0; i < count; ++i) {
        const cv::Point pixel = pair.now.features.pixel(i);
        if (!is_set(around, pixel)) continue;
        const bool is_masked = is_set(coarse, pixel);
        if (is_masked || moves[i] != 0) found.push_back(i);
        if (!is_masked) continue;
        known += is_known[i];
        moving += moves[i];
      }
      const double min_moving = min_moving_share * static_cast<double>(known);
      if (known > 0 && static_cast<double>(moving) <= min_moving) continue;
      for (const std::size_t i : found) remove(labels, i, static_cast<std::ptrdiff_t>(k));
    }
  }

 private:
  // All three are open in the description.
  static constexpr int margin_px = 20;             // around the coarse mask: what it misses
  static constexpr double min_flow_px = 1;         // a feature with more residual flow moves
  static constexpr double min_moving_share = 0.3;  // an object with more of them moves

  Classes classes_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_FLOW_REFINED_MASK_HPP
