// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Plain numbers about one frame. C++11, because hosts that compile as C++11 read them too.

#ifndef DYNFILTER_STATISTICS_HPP
#define DYNFILTER_STATISTICS_HPP

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace dynfilter {

/// A closed interval [lower, upper] of values; empty until something was estimated.
struct ValueRange {
  double lower = std::numeric_limits<double>::infinity();
  double upper = -std::numeric_limits<double>::infinity();

  bool empty() const { return !(lower <= upper); }
  bool contains(double value) const { return lower <= value && value <= upper; }
};

/// What edge compensation did with an instance.
enum class Compensation : std::uint8_t {
  not_run,          ///< no compensation in the pipeline; or another class, and nothing masked
  no_depth_image,   ///< abstained: the frame has no depth (mono, stereo)
  too_few_samples,  ///< abstained: too few features or pixels with depth to tell the ranges
  applied
};

/// What happened to the features round one instance. Counts are features.
struct InstanceStatistics {
  int class_id = 0;
  bool dynamic = false;             ///< its class is one of the dynamic ones
  std::size_t masked = 0;           ///< FP_object: removed because they lie on the mask
  std::size_t on_mask = 0;          ///< those of `masked` that no margin was needed for
  std::size_t sampled = 0;          ///< features or pixels that told the ranges
  std::size_t candidates = 0;       ///< in the box and not removed when its turn came
  std::size_t passed_depth = 0;     ///< candidates that the depth range alone would remove
  std::size_t passed_code = 0;      ///< candidates that the D-LBP range alone would remove
  std::size_t passed_nearness = 0;  ///< candidates without the object's depth that it surrounds
  std::size_t compensated = 0;      ///< removed by edge compensation
  Compensation compensation = Compensation::not_run;
  ValueRange depth_range_m;  ///< where the object is, [a, b] in eq. (1), metres; may be empty
  ValueRange code_range;     ///< [a, b] of D-LBP codes in eq. (1); may be empty
};

/// What happened in one frame. masked, compensated, custom and kept add up to features.
struct FrameStatistics {
  std::size_t features = 0;
  std::size_t masked = 0;       ///< removed on a mask or on the static mask
  std::size_t compensated = 0;  ///< removed by edge compensation
  std::size_t custom = 0;       ///< removed by a stage of the caller's
  std::size_t restored = 0;     ///< of the kept ones, those that were removed first and given back
  bool starved = false;         ///< fewer features than the floor were left, before restoring
  std::size_t suggested_features = 0;  ///< to extract next time; 0 = no more than now are needed
  bool has_segmentation = false;    ///< false: no masks are known. True with no instances: nobody
  double segmentation_age_s = 0.0;  ///< time of the frame minus time of its masks
  bool has_depth = false;
  std::vector<InstanceStatistics> instances;  ///< in the order of the segmentation's

  std::size_t removed() const { return masked + compensated + custom; }
  std::size_t kept() const { return features - removed(); }
};

}  // namespace dynfilter

#endif  // DYNFILTER_STATISTICS_HPP
