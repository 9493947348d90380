// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/dynfilter.hpp"
#include "support/byte_source.hpp"
#include "support/guarded_image.hpp"

namespace dynfilter::testing {

/// One input of the whole filter.
struct FilterCase {
  FrameView frame;
  Segmentation segmentation;
  std::vector<cv::KeyPoint> keypoints;
  DynamicFilterOptions options;
  std::optional<GuardedImage> depth_memory =
      std::nullopt;  // memory of frame.depth if it is guarded
  std::optional<std::vector<float>> depths_m = std::nullopt;  // column of depths

  FeaturesView features() const {
    return depths_m ? FeaturesView(keypoints).with_depths(*depths_m) : FeaturesView(keypoints);
  }
};

inline bool same_label(const FeatureLabel& a, const FeatureLabel& b) {
  return a.score == b.score && a.instance == b.instance && a.reason == b.reason &&
         a.removed == b.removed;
}

inline bool same_labels(const FeatureLabels& a, const FeatureLabels& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_label);
}

/// Matrix that is a region of a larger one, so that its rows are not continuous.
inline cv::Mat inside_larger_matrix(const cv::Size& size, int type) {
  const cv::Mat larger(size.height + 3, size.width + 5, type, cv::Scalar::all(77));
  return larger(cv::Rect({2, 1}, size));
}

/// Depth image of a sensor, valid or not: few distinct values, so that ties are common; missing,
/// negative, NaN and infinite ones.
inline cv::Mat arbitrary_depth(ByteSource& source, const cv::Size& size, bool floating) {
  cv::Mat depth = inside_larger_matrix(size, floating ? CV_32FC1 : CV_16UC1);
  const int hostile = source.between(0, 40);
  const float bad[] = {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity()};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const bool is_bad = source.chance(hostile);
      const int value = source.between(1, 12);
      if (floating) {
        depth.at<float>(y, x) =
            is_bad ? bad[source.between(0, 4)] : 0.2F * static_cast<float>(value);
      } else {
        depth.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(is_bad        ? 0
                                                                   : value == 12 ? 65535
                                                                                 : value * 1000);
      }
    }
  }
  return depth;
}

inline cv::Mat arbitrary_mask(ByteSource& source, const cv::Size& size) {
  if (size.empty()) return {};
  cv::Mat mask = inside_larger_matrix(size, CV_8UC1);
  const int share = source.chance(10) ? 0 : source.chance(10) ? 100 : source.between(5, 50);
  for (int y = 0; y < size.height; ++y) {
    auto* const row = mask.ptr<std::uint8_t>(y);
    for (int x = 0; x < size.width; ++x) {
      row[x] = source.chance(share) ? static_cast<std::uint8_t>(source.chance(50) ? 255 : 1) : 0;
    }
  }
  return mask;
}

/// Instance whose mask mostly lies in its box; at times both are placed independently, partly or
/// wholly outside the image.
inline Instance arbitrary_instance(ByteSource& source, const cv::Size& image) {
  const bool usual = source.chance(60);
  const auto place = [&](int length) {
    return usual ? source.between(-2, length / 3) : source.between(-length / 2 - 2, length + 2);
  };
  const auto extent = [&](int length) {
    return source.between(usual ? length / 2 : 0, length + 4);
  };
  Instance instance;
  instance.class_id = source.chance(75) ? 0 : source.between(1, 3);
  instance.score = static_cast<float>(source.between(0, 100)) / 100.0F;
  instance.box = {place(image.width), place(image.height), extent(image.width),
                  extent(image.height)};
  instance.mask_origin = {place(image.width), place(image.height)};
  instance.mask = arbitrary_mask(source, {extent(image.width), extent(image.height)});
  if (source.chance(3)) {
    const int extreme =
        source.chance(50) ? std::numeric_limits<int>::max() : std::numeric_limits<int>::min();
    instance.box.x = extreme;
    instance.mask_origin.y = extreme;
  }
  return instance;
}

/// Keypoints on pixels, between them, outside the image, repeated, and at NaN.
inline std::vector<cv::KeyPoint> arbitrary_keypoints(ByteSource& source, const cv::Size& image) {
  const int most = source.may_be_costly(16) ? 120 : 24;
  std::vector<cv::KeyPoint> keypoints(static_cast<std::size_t>(source.between(0, most)));
  const float odd[] = {std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(), -1e30F, 3e9F, 2147483520.0F};
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    cv::KeyPoint& keypoint = keypoints[i];
    keypoint.pt.x = static_cast<float>(source.between(-8, image.width * 4 + 8)) / 4;
    keypoint.pt.y = static_cast<float>(source.between(-8, image.height * 4 + 8)) / 4;
    keypoint.size = static_cast<float>(source.between(0, 40)) / 4;
    if (source.chance(2)) keypoint.pt.x = odd[source.between(0, 4)];
    if (source.chance(2)) keypoint.size = odd[source.between(0, 2)];
    if (i > 0 && source.chance(5)) keypoint = keypoints[i - 1];
  }
  return keypoints;
}

/// Random options of the paper's rule.
inline DynamicFilterOptions arbitrary_options(ByteSource& source, const cv::Size& image) {
  DynamicFilterOptions options;
  if (source.chance(30)) options.mask_culler.dynamic_classes = {0, 2};
  if (source.chance(20)) options.mask_culler.margin_px = source.between(0, 20) / 4.0;
  if (source.chance(15)) options.mask_culler.static_mask = arbitrary_mask(source, image);
  options.compensator.rule = CompensationRule::paper;
  EdgeCompensatorOptions& edge = options.compensator.paper;
  edge.seed = source.byte();
  edge.depth.expansion = source.between(0, 10) / 20.0;
  source.chance(50);  // keeps the corpus, as the one below
  edge.code.expansion = source.between(0, 64);
  source.chance(50);
  edge.samples = RangeEstimator::min_samples + static_cast<std::size_t>(source.between(0, 24));
  edge.uses_codes = edge.seed % 4 != 3;  // draws no byte, which the fuzzer's corpus lacks
  return options;
}

/// Random input of that size that the filter accepts, hostile values included; the paper's rule.
inline FilterCase arbitrary_case(ByteSource& source, const cv::Size& image) {
  FilterCase made;
  made.frame.id = source.word();
  made.frame.timestamp_s = source.between(0, 100);
  const int kind = source.between(0, 9);  // 0: no depth; then 16-bit or float
  if (kind > 0) made.frame.depth = arbitrary_depth(source, image, kind > 5);
  if (kind <= 5 || source.chance(50)) made.frame.metres_per_unit = kind > 5 ? 0.5 : 1.0 / 5000;
  made.segmentation.image_size = image;
  const int instances = source.chance(10) ? 0 : source.between(1, source.may_be_costly(16) ? 6 : 3);
  for (int k = 0; k < instances; ++k) {
    made.segmentation.instances.push_back(arbitrary_instance(source, image));
  }
  made.keypoints = arbitrary_keypoints(source, image);
  made.options = arbitrary_options(source, image);
  return made;
}

/// Random input of any small size; the paper's rule.
inline FilterCase arbitrary_case(ByteSource& source) {
  const int most = source.may_be_costly(16) ? 28 : 14;
  const auto length = [&] {
    return source.chance(20) ? source.between(1, 4) : source.between(5, most);
  };
  const int width = length();
  return arbitrary_case(source, cv::Size(width, length()));
}

/// Random options of the rule `depth`.
inline DepthCompensatorOptions arbitrary_depth_options(ByteSource& source) {
  DepthCompensatorOptions options;
  options.half_width_m = source.between(1, 90) / 100.0;
  options.min_kept_share = source.between(0, 4) / 4.0;
  return options;
}

/// Gives the input options of that rule, and its masks any age, or none.
inline void draw_rule(ByteSource& source, FilterCase& made, CompensationRule rule) {
  const std::optional<double> ages_s[] = {0, 0.01, 0.03, 0.1, 1.5, -0.03, std::nullopt};
  const std::optional<double> age_s = ages_s[source.between(0, 6)];
  if (age_s) made.segmentation.timestamp_s = made.frame.timestamp_s - *age_s;
  made.options.compensator.rule = rule;
  if (source.chance(70)) {
    made.options.compensator.depth = arbitrary_depth_options(source);
  }
}

/// Gives the input's features a column of depths: few distinct values, with unknown ones of every
/// kind.
inline void draw_depths(ByteSource& source, FilterCase& made) {
  const float unknown[] = {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN(),
                           std::numeric_limits<float>::infinity(),
                           -std::numeric_limits<float>::infinity()};
  const int share = source.chance(10) ? 100 : source.between(0, 80);
  made.depths_m.emplace();
  for (std::size_t i = 0; i < made.keypoints.size(); ++i) {
    const int value = source.chance(60) ? source.between(4, 7) : source.between(1, 14);
    made.depths_m->push_back(source.chance(share) ? unknown[source.between(0, 4)]
                             : value == 14        ? 1e30F
                                                  : 0.2F * static_cast<float>(value));
  }
}

/// Black image of a larger size with the smaller one at a place in it.
inline cv::Mat embedded(const cv::Mat& image, const cv::Size& size, cv::Point place) {
  cv::Mat larger = cv::Mat::zeros(size, image.type());
  image.copyTo(larger(cv::Rect(place, image.size())));
  return larger;
}

/// Moves the case into an image of any size up to that length, often into its lower right corner.
/// Its depth begins or ends at a guard page, and some features lie up to 100 pixels outside.
inline void enlarge(ByteSource& source, FilterCase& made, const cv::Size& largest) {
  const cv::Size small = made.segmentation.image_size;
  const cv::Size size(source.between(small.width, std::max(small.width, largest.width)),
                      source.between(small.height, std::max(small.height, largest.height)));
  const cv::Size free = size - small;
  const cv::Point place(source.chance(60) ? free.width : source.between(0, free.width),
                        source.chance(60) ? free.height : source.between(0, free.height));
  made.segmentation.image_size = size;
  if (!made.frame.depth.empty()) {
    const Guard guard = source.chance(70) ? Guard::behind : Guard::before;
    const std::optional<GuardedImage> copied = made.depth_memory;  // lives until then
    made.depth_memory.emplace(size, made.frame.depth.type(), guard);
    made.frame.depth.copyTo(made.depth_memory->image()(cv::Rect(place, small)));
    made.frame.depth = made.depth_memory->image();
  }
  cv::Mat& static_mask = made.options.mask_culler.static_mask;
  if (!static_mask.empty()) static_mask = embedded(static_mask, size, place);
  for (Instance& instance : made.segmentation.instances) {
    const auto moved = [](int position, int by) {  // positions far outside stay there
      return std::abs(std::int64_t{position}) > 100000 ? position : position + by;
    };
    instance.box.x = moved(instance.box.x, place.x);
    instance.box.y = moved(instance.box.y, place.y);
    instance.mask_origin.x = moved(instance.mask_origin.x, place.x);
    instance.mask_origin.y = moved(instance.mask_origin.y, place.y);
  }
  const auto outside = [&](int length) {
    return static_cast<float>(source.chance(30) ? -source.between(1, 100)
                                                : length + source.between(-4, 100));
  };
  for (cv::KeyPoint& keypoint : made.keypoints) {
    keypoint.pt += cv::Point2f(place);
    if (source.chance(20)) keypoint.pt.x = outside(size.width);
    if (source.chance(20)) keypoint.pt.y = outside(size.height);
  }
}

/// Random input by any rule. A source without bytes chooses the paper's rule, for which the
/// fuzzer's corpus was made.
inline FilterCase arbitrary_case_of_any_rule(ByteSource& source) {
  FilterCase made = arbitrary_case(source);
  const int rule = source.between(0, 9);
  draw_rule(source, made,
            rule < 3   ? CompensationRule::paper
            : rule < 9 ? CompensationRule::depth
                       : CompensationRule::mask);
  return made;
}

/// Random input by any rule, at times in an image of up to 100 pixels; one of 500 of a fuzzer's
/// inputs may lie in one of any size.
inline FilterCase arbitrary_case_of_any_size(ByteSource& source) {
  FilterCase made = arbitrary_case_of_any_rule(source);
  const bool is_large = source.is_fuzzed() && source.may_be_costly(500);
  if (source.byte() == 255 || is_large) {
    enlarge(source, made, source.may_be_costly(500) ? cv::Size(4096, 4096) : cv::Size(100, 100));
  }
  made.options.feature_floor = source.byte();
  const bool is_by_depth = made.options.compensator.rule == CompensationRule::depth;
  // The rule's lengths are pixels of wide images.
  if (is_by_depth && source.byte() % 4 == 3) enlarge(source, made, {700, 40});
  if (is_by_depth && made.frame.depth.empty() && source.byte() % 2 == 1) draw_depths(source, made);
  return made;
}

}  // namespace dynfilter::testing
