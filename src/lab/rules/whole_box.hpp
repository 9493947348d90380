// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_WHOLE_BOX_HPP
#define DYNFILTER_SRC_LAB_RULES_WHOLE_BOX_HPP

#include <cstddef>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "lab/rules/support.hpp"

namespace dynfilter::peers {

struct WholeBoxOptions {
  std::vector<int> dynamic_classes = {0};  ///< as in MaskCullerOptions
  int margin_px = 5;                       ///< on each side of the box
};

/// Crowd-SLAM's rule (J. Soares et al., "Crowd-SLAM: Visual SLAM Towards Crowded Environments using
/// Object Detection", J. Intell. Robot. Syst. 2021): removes every feature in a person's box, grown
/// by 5 px. The extraction of more features when persons fill the image is left out.
///
/// It needs neither masks nor depth. Here and in the other rules with boxes, a box does not include
/// its right and lower edge. If boxes overlap, the first one removes the feature. O(features x
/// instances).
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

#endif  // DYNFILTER_SRC_LAB_RULES_WHOLE_BOX_HPP
