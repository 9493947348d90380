// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Reason of a feature's label. Your own stages use `custom` and the values above it.
enum class Reason : std::uint8_t {
  untouched,    ///< kept; no stage removed it
  in_mask,      ///< on the mask of a dynamic object, or on the static mask (instance -1)
  compensated,  ///< an edge feature that the mask missed
  restored,     ///< removed by one stage and kept by a later one
  moving,       ///< it moves, whatever it belongs to
  still,        ///< kept though on the mask of an object, which stands still: no landmark for long
  custom = 128  ///< removed by a stage of your own; cast 129 to 255 for further reasons
};

/// Verdict on one feature. The score of a removed feature is the confidence in the verdict, as a
/// rule the detector's in the object; a kept one's is the share of evidence against it. So a
/// removed feature may have a lower score than a kept one: sort by is_more_dynamic.
struct FeatureLabel {
  float score = 0.0F;                 ///< 0 surely static … 1 surely dynamic
  std::int32_t instance = -1;         ///< index into Segmentation::instances; -1 = none
  Reason reason = Reason::untouched;  ///< why
  bool removed = false;               ///< whether keep_static takes the feature out
};

/// Orders labels for sorting: removed features first, then by falling scores.
inline bool is_more_dynamic(const FeatureLabel& a, const FeatureLabel& b) {
  return std::tie(b.removed, b.score) < std::tie(a.removed, a.score);
}

/// Verdicts on the features of one frame, in their order, with the frame's statistics. Stages write
/// into it. The first stage that removes a feature writes its reason, instance and score.
class FeatureLabels {
 public:
  /// Makes labels of no features. Pipeline::apply resets them; call reset only if you run stages
  /// yourself.
  FeatureLabels() = default;

  /// Makes labels with all features untouched. `segmentation` gives the instances that labels may
  /// refer to.
  FeatureLabels(std::size_t features, const Segmentation& segmentation) {
    reset(features, segmentation);
  }

  /// Makes all features untouched again, reusing memory. If memory runs out, nothing changes.
  void reset(std::size_t features, const Segmentation& segmentation) {
    labels_.reserve(features);
    statistics_.instances.reserve(segmentation.instances.size());
    clear();
    labels_.resize(features);
    statistics_.instances.resize(segmentation.instances.size());
    statistics_.features = features;
    statistics_.has_segmentation = true;
    for (std::size_t k = 0; k < segmentation.instances.size(); ++k) {
      statistics_.instances[k].class_id = segmentation.instances[k].class_id;
      statistics_.instances[k].score = segmentation.instances[k].score;
    }
  }

  /// Makes labels of no features, and keeps the memory.
  void clear() noexcept {
    labels_.clear();
    std::vector<InstanceStatistics> instances = std::move(statistics_.instances);
    instances.clear();
    statistics_ = FrameStatistics();
    statistics_.instances = std::move(instances);
  }

  /// Number of features.
  std::size_t size() const { return labels_.size(); }
  /// Whether there are no features.
  bool empty() const { return labels_.empty(); }
  /// Verdict on feature i, which must be below size().
  const FeatureLabel& operator[](std::size_t i) const { return labels_[i]; }
  /// Whether feature i is removed. i must be below size().
  bool is_removed(std::size_t i) const { return labels_[i].removed; }

  /// First verdict.
  std::vector<FeatureLabel>::const_iterator begin() const { return labels_.begin(); }
  /// End of the verdicts.
  std::vector<FeatureLabel>::const_iterator end() const { return labels_.end(); }

  /// Removes feature i in the name of an instance (-1 = none) and counts it. A feature that is
  /// already removed keeps its label. Returns whether this call removed it. Throws
  /// std::invalid_argument for a feature or instance that does not exist, for the reasons
  /// untouched, restored and still, and for a score outside 0 to 1. O(1).
  bool remove(std::size_t i, std::int32_t instance, Reason reason, float score) {
    require_verdict("FeatureLabels::remove", i, instance, score);
    require_removing(reason);
    FeatureLabel& label = labels_[i];
    if (label.removed) return false;
    if (label.reason == Reason::restored || label.reason == Reason::still) --statistics_.restored;
    label = {score, instance, reason, true};
    count(label, 1);
    return true;
  }

  /// Marks instance k as a dynamic object, whose features should be removed. Throws
  /// std::invalid_argument for an instance that does not exist. O(1).
  void mark_dynamic(std::size_t k) {
    if (k >= statistics_.instances.size()) {
      detail::throw_misuse("FeatureLabels::mark_dynamic", detail::concatenate("instance ", k),
                           detail::concatenate("an index below ", statistics_.instances.size()));
    }
    statistics_.instances[k].dynamic = true;
  }

  /// Whether a stage marked instance k as dynamic, or removed features on its mask. k must be the
  /// index of an instance. O(1).
  bool is_dynamic_object(std::size_t k) const {
    return statistics_.instances[k].dynamic || statistics_.instances[k].masked > 0;
  }

  /// Raises the score of a kept feature that may belong to an instance, and names the instance.
  /// Does nothing for a removed feature or one whose score is at least as high. Returns whether
  /// this call changed the label. Throws std::invalid_argument for a feature or instance that does
  /// not exist and for a score outside 0 to 1. O(1).
  bool suspect(std::size_t i, std::int32_t instance, float score) {
    require_verdict("FeatureLabels::suspect", i, instance, score);
    FeatureLabel& label = labels_[i];
    if (label.removed || !(score > label.score)) return false;
    label.score = score;
    label.instance = instance;
    return true;
  }

  /// Gives a removed feature back; its instance and score stay readable. Returns whether it was
  /// removed. Throws std::invalid_argument for a feature that does not exist. O(1).
  bool restore(std::size_t i) {
    require_feature("FeatureLabels::restore", i);
    return restore(i, labels_[i].score);
  }

  /// Gives a removed feature back with a new score, for a stage that knows better than the one that
  /// removed it, and with the reason restored or still. Returns whether it was removed. Throws
  /// std::invalid_argument for a feature that does not exist, for a score outside 0 to 1, and for
  /// another reason. O(1).
  bool restore(std::size_t i, float score, Reason reason = Reason::restored) {
    require_verdict("FeatureLabels::restore", i, -1, score);
    if (reason != Reason::restored && reason != Reason::still) {
      detail::throw_misuse("FeatureLabels::restore",
                           detail::concatenate("the reason ", static_cast<int>(reason)),
                           "restored or still");
    }
    FeatureLabel& label = labels_[i];
    if (!label.removed) return false;
    count(label, std::size_t{0} - 1);
    label.score = score;
    label.reason = reason;
    label.removed = false;
    ++statistics_.restored;
    return true;
  }

  /// Statistics of the frame.
  const FrameStatistics& statistics() const { return statistics_; }

  /// Statistics for stages to complete with their own results (ranges, abstentions). remove and
  /// restore keep the counts of features.
  FrameStatistics& statistics() { return statistics_; }

 private:
  void require_feature(const char* call, std::size_t i) const {
    if (i >= labels_.size()) {
      detail::throw_misuse(call, detail::concatenate("feature ", i),
                           detail::concatenate("an index below ", labels_.size()));
    }
  }

  void require_verdict(const char* call, std::size_t i, std::int32_t instance, float score) const {
    require_feature(call, i);
    const auto instances = static_cast<std::int64_t>(statistics_.instances.size());
    if (instance < -1 || instance >= instances) {
      detail::throw_misuse(call, detail::concatenate("instance ", instance),
                           detail::concatenate("-1, or an index below ", instances));
    }
    if (!(score >= 0.0F && score <= 1.0F)) {
      detail::throw_misuse(call, detail::concatenate("score ", score), "a score from 0 to 1");
    }
  }

  static void require_removing(Reason reason) {
    if (reason == Reason::in_mask || reason == Reason::compensated || reason == Reason::moving ||
        reason >= Reason::custom) {
      return;
    }
    detail::throw_misuse("FeatureLabels::remove",
                         detail::concatenate("the reason ", static_cast<int>(reason)),
                         "in_mask, compensated, moving, or custom and above");
  }

  /// Adds `change` to the counts of such labels, modulo 2^64, so that -1 decrements.
  void count(const FeatureLabel& label, std::size_t change) {
    const auto add = [change](std::size_t& counter) { counter += change; };
    InstanceStatistics* instance =
        label.instance < 0 ? nullptr
                           : &statistics_.instances[static_cast<std::size_t>(label.instance)];
    if (label.reason == Reason::in_mask) {
      add(statistics_.masked);
      if (instance) add(instance->masked);
    } else if (label.reason == Reason::compensated) {
      add(statistics_.compensated);
      if (instance) add(instance->compensated);
    } else if (label.reason == Reason::moving) {
      add(statistics_.moving);
    } else {
      add(statistics_.custom);
    }
  }

  std::vector<FeatureLabel> labels_;
  FrameStatistics statistics_;
};

}  // namespace dynfilter
