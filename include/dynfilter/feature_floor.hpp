// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FEATURE_FLOOR_HPP
#define DYNFILTER_FEATURE_FLOOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/statistics.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Policy for frames with fewer features than the floor.
enum class FloorPolicy {
  report_only,          ///< only report it in the statistics
  restore_best_scored,  ///< give back the removed features with the lowest scores
  restore_balanced      ///< give back features where the image has fewest, lowest scores first
};

/// Options of FeatureFloor.
struct FeatureFloorOptions {
  /// Features that should be left; ORB-SLAM needs more than 500 to initialise. 0 = no check: no
  /// frame is starved.
  std::size_t floor = 0;
  FloorPolicy policy = FloorPolicy::report_only;  ///< what to do about it
};

/// Suggests how many features to extract so that a frame would keep `floor` of them if the same
/// share survives: at most four times the present number, or `floor` if there are none.
inline std::size_t suggested_features(const FrameStatistics& statistics, std::size_t floor) {
  if (statistics.features == 0) return floor;
  const std::size_t max_features = 4 * statistics.features;
  if (statistics.kept() == 0) return max_features;
  const double share =
      static_cast<double>(statistics.kept()) / static_cast<double>(statistics.features);
  const double wanted = std::ceil(static_cast<double>(floor) / share);
  return wanted < static_cast<double>(max_features) ? static_cast<std::size_t>(wanted)
                                                    : max_features;
}

/// Last stage: keeps a frame from being left with too few features to track, or reports it. A frame
/// with fewer features than the floor is `starved` in the statistics, whatever the policy, and the
/// statistics suggest how many features to extract next time.
///
/// Features on the static mask are never given back, because the robot moves with the camera.
/// Restored features keep their instance and score. Among equal scores, features that compensation
/// removed come before those on a mask; a hash of frame and pixel breaks further ties, then the
/// exact position and diameter. So the choice is spread, and depends on the order of the features
/// only among those that agree in all of this.
class FeatureFloor {
 public:
  /// Takes the options.
  explicit FeatureFloor(const FeatureFloorOptions& options = {}) : options_(options) {}

  /// Runs the stage with a temporary workspace.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Runs the stage. Throws std::invalid_argument for malformed input. O(features); if features are
  /// restored, O(n log n) of the removed ones.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "FeatureFloor");
    std::vector<Candidate>& restorable = workspace.get<Scratch>().restorable;
    restorable.reserve(labels.size());
    FrameStatistics& statistics = labels.statistics();
    statistics.starved = statistics.kept() < options_.floor;
    if (!statistics.starved) return;
    statistics.suggested_features = suggested_features(statistics, options_.floor);
    if (options_.policy != FloorPolicy::report_only) restore(input, labels, restorable);
  }

 private:
  /// A feature's position and diameter, as bits: these have an order even if one is NaN.
  using Bits = std::array<std::uint32_t, 3>;

  /// Removed feature that may be given back.
  struct Candidate {
    std::size_t cell;  // cell of the image
    float score;
    bool on_mask;
    std::uint64_t key;  // hash that breaks ties
    Bits bits;          // tells features of one pixel apart
    std::size_t feature;
  };

  struct Scratch {
    std::vector<Candidate> restorable;
  };

  static constexpr int columns = 8, rows = 6;  // cells of 80x80 at 640x480
  using CellCounts = std::array<std::size_t, std::size_t{columns * rows}>;

  void restore(const FilterInput& input, FeatureLabels& labels,
               std::vector<Candidate>& restorable) const {
    CellCounts kept{};
    collect(input, labels, restorable, kept);
    std::sort(restorable.begin(), restorable.end(), [](const auto& a, const auto& b) {
      return std::tie(a.cell, a.score, a.on_mask, a.key, a.bits, a.feature) <
             std::tie(b.cell, b.score, b.on_mask, b.key, b.bits, b.feature);
    });
    CellCounts next{}, end{};  // each cell's part of restorable
    for (const Candidate& candidate : restorable) ++end[candidate.cell];
    for (std::size_t cell = 1; cell < end.size(); ++cell) {
      next[cell] = end[cell - 1];
      end[cell] += end[cell - 1];
    }
    const std::size_t missing = options_.floor - labels.statistics().kept();
    for (std::size_t i = 0; i < std::min(missing, restorable.size()); ++i) {
      const std::size_t cell = emptiest(kept, next, end);
      labels.restore(restorable[next[cell]++].feature);
      ++kept[cell];
    }
  }

  /// Collects the features that may be restored, with their sorting keys, and counts the kept
  /// features of each cell.
  void collect(const FilterInput& input, const FeatureLabels& labels,
               std::vector<Candidate>& restorable, CellCounts& kept) const {
    const FeatureSampler sampler;
    restorable.clear();
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const cv::Point pixel = input.features.pixel(i);
      const std::size_t cell = cell_of(pixel, input);
      const FeatureLabel& label = labels[i];
      const bool on_mask = label.reason == Reason::in_mask;
      if (!label.removed) {
        ++kept[cell];
      } else if (!on_mask || label.instance >= 0) {
        restorable.push_back({cell, label.score, on_mask, sampler.key(input.frame.id, 0, pixel),
                              bits_of(input.features, i), i});
      }
    }
  }

  static Bits bits_of(const FeaturesView& features, std::size_t i) {
    const cv::Point2f position = features[i];
    const std::array<float, 3> numbers = {position.x, position.y, features.diameter_px(i)};
    Bits bits;
    std::memcpy(bits.data(), numbers.data(), sizeof(bits));
    return bits;
  }

  /// Returns a feature's cell. All features share cell 0 if only scores count or no image size is
  /// known.
  std::size_t cell_of(cv::Point pixel, const FilterInput& input) const {
    const FrameView& frame = input.frame;
    const cv::Size of_frame = frame.depth.empty() ? frame.image.size() : frame.depth.size();
    const cv::Size size = of_frame.empty() ? input.segmentation.image_size : of_frame;
    if (options_.policy == FloorPolicy::restore_best_scored || size.empty()) return 0;
    const auto along = [](int position, int length, int cells) {
      const std::int64_t clamped = std::clamp(position, 0, length - 1);
      return static_cast<std::size_t>(clamped * cells / length);
    };
    return along(pixel.y, size.height, rows) * columns + along(pixel.x, size.width, columns);
  }

  /// Returns the cell with the fewest kept features among those with something to restore; ties go
  /// to the first.
  static std::size_t emptiest(const CellCounts& kept, const CellCounts& next,
                              const CellCounts& end) {
    std::size_t best = kept.size();
    for (std::size_t cell = 0; cell < kept.size(); ++cell) {
      if (next[cell] == end[cell]) continue;
      if (best == kept.size() || kept[cell] < kept[best]) best = cell;
    }
    return best;
  }

  FeatureFloorOptions options_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_FEATURE_FLOOR_HPP
