// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Lists of features by where they lie, and by why they were removed.

#ifndef DYNFILTER_DETAIL_FEATURE_LISTS_HPP
#define DYNFILTER_DETAIL_FEATURE_LISTS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/feature_list.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

/// The features that were removed as in_mask, by their instance: a chain for each, through arrays
/// that are kept, so that one pass over the labels serves all instances.
class MaskedFeatures {
 public:
  MaskedFeatures(const FeatureLabels& labels, std::vector<std::uint32_t>& first_of_instance,
                 std::vector<std::uint32_t>& next)
      : first_(first_of_instance), next_(next) {
    first_.assign(labels.statistics().instances.size(), none);
    if (next_.size() < labels.size()) next_.resize(labels.size());
    const std::vector<std::uint64_t>& removed = labels.removed_bits();
    for (std::size_t block = 0; block < removed.size(); ++block) {
      for_each_bit(removed[block], [&](std::size_t bit) {
        const std::size_t i = block * block_size + bit;
        if (labels[i].reason == Reason::in_mask && labels[i].instance >= 0) add(labels[i], i);
      });
    }
  }

  template <class Action>
  void for_each_of(std::size_t instance, const Action& action) const {
    for (std::uint32_t i = first_[instance]; i != none; i = next_[i]) action(std::size_t{i});
  }

 private:
  static constexpr std::uint32_t none = 0xFFFFFFFFU;

  void add(const FeatureLabel& label, std::size_t i) {
    std::uint32_t& first = first_[static_cast<std::size_t>(label.instance)];
    next_[i] = first;
    first = static_cast<std::uint32_t>(i);
  }

  std::vector<std::uint32_t>& first_;
  std::vector<std::uint32_t>& next_;
};

/// The features that are not removed and lie on a mask whose first pixel is at `origin`: as
/// Instance::covers has it.
inline FeatureList kept_on_mask(const FeaturePixels& pixels, const FeatureLabels& labels,
                                const cv::Mat& mask, cv::Point origin,
                                std::vector<std::uint32_t>& memory) {
  FeatureList list = pixels.inside({origin, mask.size()}, labels.removed_bits(), memory);
  const std::uint8_t* data = mask.data;
  const auto row_bytes = static_cast<std::int64_t>(mask.step[0]);
  const std::int64_t before = origin.y * row_bytes + origin.x;
  list.leave_only(
      [&](std::size_t i) { return data[pixels[i].y * row_bytes + pixels[i].x - before] != 0; });
  return list;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_FEATURE_LISTS_HPP
