// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Lists of features by where they lie. What decides whether a feature joins a list is put into
// numbers and not into branches: pixels of masks are nothing that a processor can foresee.

#ifndef DYNFILTER_DETAIL_FEATURE_LISTS_HPP
#define DYNFILTER_DETAIL_FEATURE_LISTS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

/// Indices of features, in memory that is there already.
class FeatureList {
 public:
  /// Empty, with room for as many features as the frame has.
  FeatureList(std::vector<std::uint32_t>& memory, std::size_t features) {
    if (memory.size() < features) memory.resize(features);
    begin_ = end_ = memory.data();
  }

  /// At most once for a feature.
  void add_if(bool condition, std::size_t i) {
    *end_ = static_cast<std::uint32_t>(i);
    end_ += condition ? 1 : 0;
  }

  /// Takes out those for which predicate(i) is false.
  template <class Predicate>
  void leave_only(const Predicate& predicate) {
    const std::uint32_t* const old_end = end_;
    end_ = begin_;
    for (const std::uint32_t* feature = begin_; feature != old_end; ++feature) {
      const std::size_t i = *feature;
      add_if(predicate(i), i);
    }
  }

  std::size_t size() const { return static_cast<std::size_t>(end_ - begin_); }
  const std::uint32_t* begin() const { return begin_; }
  const std::uint32_t* end() const { return end_; }

 private:
  std::uint32_t* begin_;
  std::uint32_t* end_;
};

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
  FeatureList list(memory, pixels.size());
  const std::uint8_t* data = mask.data;
  const std::size_t row_bytes = mask.step[0];
  pixels.for_each_inside({origin, mask.size()}, [&](std::size_t i) {
    const auto x = static_cast<std::size_t>(std::int64_t{pixels[i].x} - origin.x);
    const auto y = static_cast<std::size_t>(std::int64_t{pixels[i].y} - origin.y);
    const bool is_on_mask = data[y * row_bytes + x] != 0;
    list.add_if(is_on_mask & !labels.is_removed(i), i);
  });
  return list;
}

/// The features that are not removed and lie in a rectangle.
inline FeatureList kept_inside(const FeaturePixels& pixels, const FeatureLabels& labels,
                               const cv::Rect& rectangle, std::vector<std::uint32_t>& memory) {
  FeatureList list(memory, pixels.size());
  pixels.for_each_inside(rectangle, [&](std::size_t i) { list.add_if(!labels.is_removed(i), i); });
  return list;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_FEATURE_LISTS_HPP
