// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_RULES_WHOLE_BOX_HPP
#define DYNFILTER_SRC_RULES_WHOLE_BOX_HPP

#include <cstddef>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "rules/support.hpp"

namespace dynfilter::peers {

struct WholeBoxOptions {
  std::vector<int> dynamic_classes = {0};  ///< as MaskCullerOptions has them
  int margin_px = 5;                       ///< on each side of the box
};

/// The rule of Crowd-SLAM (J. Soares et al., "Crowd-SLAM: Visual SLAM Towards
/// Crowded Environments using Object Detection", J. Intell. Robot. Syst. 2021): every feature in
/// the box of a person, grown by 5 px, goes. How it extracts more features where persons fill the
/// image is no part of this.
///
/// It needs neither masks nor depth. The right and lower edge of a box do not belong to it, here
/// and in the other rules with boxes. Overlapping boxes: the first one has the feature.
/// O(features x instances).
class WholeBox {
 public:
  /// Throws std::invalid_argument for a negative margin.
  explicit WholeBox(WholeBoxOptions options = {}) : options_(std::move(options)) {
    require_option(options_.margin_px >= 0, "peers::WholeBox: margin_px must be 0 or more");
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "peers::WholeBox");
    const std::vector<Instance>& instances = input.segmentation.instances;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!is_dynamic(instances[k], options_.dynamic_classes)) continue;
      const cv::Rect region =
          grown_box(instances[k].box, options_.margin_px, input.segmentation.image_size);
      remove_in(region, k, input, labels, [](cv::Point) { return true; });
    }
  }

 private:
  WholeBoxOptions options_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_RULES_WHOLE_BOX_HPP
