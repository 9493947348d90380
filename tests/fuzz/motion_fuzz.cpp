// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Filters sequences of wild frames by motion: times that go back, repeat and jump, blank, repeated
// and cut images, depth of any kind or none. Two filters with memories of their own agree, one of
// which tracks ahead; labels and statistics agree, and a memory that was reset is like a new one.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "dynfilter/motion/motion_filter.hpp"
#include "fuzz/report.hpp"
#include "support/filter_case.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

const cv::Size size(64, 48);

struct Shot {
  FrameView frame;
  Segmentation masks;
  std::vector<cv::Point2f> features;
};

cv::Mat image_of(ByteSource& source, int shift) {
  static const cv::Mat1b wide = texture({2 * size.width, size.height}, 5);
  const int kind = source.between(0, 15);
  if (kind == 0) return {};
  if (kind == 1) return cv::Mat(size, CV_8UC1, cv::Scalar(source.byte()));
  cv::Mat image = wide(cv::Rect({shift, 0}, size)).clone();
  if (kind < 6) {  // an object moves
    const cv::Rect object(source.between(0, 40), source.between(0, 26), 20, 20);
    cv::flip(image(object).clone(), image(object), 0);
  }
  return image;
}

Shot shot_of(ByteSource& source, double timestamp_s, int shift, int step) {
  Shot shot;
  shot.frame.timestamp_s = timestamp_s;
  shot.frame.image = image_of(source, shift);
  const int kind = source.between(0, 9);
  if (kind > 7) shot.frame.depth = arbitrary_depth(source, size, kind == 9);
  if (kind > 0 && kind < 8) {
    shot.frame.depth = cv::Mat(size, CV_16UC1, cv::Scalar(100 * source.between(1, 200)));
  }
  shot.frame.metres_per_unit = kind == 9 ? 0.0 : 1.0 / 5000;
  shot.masks.image_size = size;
  shot.masks.timestamp_s = timestamp_s;
  for (int k = source.between(0, 2); k > 0; --k) {
    shot.masks.instances.push_back(arbitrary_instance(source, size));
    if (source.chance(50)) shot.masks.instances.back().track_id = source.between(0, 2);
  }
  for (int y = 4; y < size.height; y += step) {
    for (int x = 4; x < size.width; x += step) shot.features.emplace_back(x, y);
  }
  for (int k = source.between(0, 6); k > 0; --k) {
    const float odd[] = {std::numeric_limits<float>::quiet_NaN(), -100, 1e9F, -0.5F, 63.5F, 164};
    shot.features.emplace_back(odd[source.between(0, 5)], odd[source.between(0, 5)]);
  }
  return shot;
}

const Camera& camera() {
  static const Camera made{60, 60, 32, 24};
  return made;
}

struct Rig {
  MotionFilter filter;
  FeatureLabels labels;
  Workspace workspace;

  explicit Rig(const MotionFilterOptions& options) : filter(camera(), options) {}

  const FeatureLabels& see(const Shot& shot) {
    filter.apply(shot.frame, shot.masks, shot.features, labels, workspace);
    return labels;
  }
};

std::string check(const FeatureLabels& labels, const Shot& shot) {
  if (labels.size() != shot.features.size()) return "labels of other features";
  std::size_t removed = 0, restored = 0;
  for (const FeatureLabel& label : labels) {
    removed += label.removed ? 1 : 0;
    restored += label.reason == Reason::restored || label.reason == Reason::still ? 1 : 0;
    if (!(label.score >= 0 && label.score <= 1)) return "a score out of range";
    if (label.instance >= static_cast<int>(shot.masks.instances.size())) return "no such instance";
    if (label.removed && label.reason == Reason::untouched) return "removed for no reason";
  }
  const FrameStatistics& statistics = labels.statistics();
  if (statistics.removed() != removed) return "the counts do not add up";
  if (statistics.restored != restored) return "a wrong number of restored features";
  if (statistics.motion.tracked > labels.size()) return "more tracks than features";
  return {};
}

std::string filter(ByteSource& source) {
  MotionFilterOptions options;
  if (source.chance(30)) options.motion.min_speed_m_s = source.between(0, 4) / 4.0;
  if (source.chance(30)) options.motion.max_gap_s = source.between(1, 20) / 10.0;
  if (source.chance(20)) options.motion.still_frames = source.between(1, 4);
  const bool is_long = source.may_be_costly(16);  // many frames with many features
  Rig rig(options), twin(options);
  const int frames = source.between(1, is_long ? 7 : 2);
  const int step = is_long ? 5 : 10;
  const bool is_twice = is_long || source.may_be_costly(2);  // else it is reset
  double timestamp_s = source.between(0, 4);
  int shift = size.width / 2;
  for (int i = 0; i < frames; ++i) {
    const double steps_s[] = {1.0 / 30, 1.0 / 30, 1.0 / 30, 0.1, 0.1, 0, -0.5, 1e5};
    timestamp_s += steps_s[source.between(0, 7)];
    shift = std::clamp(shift + source.between(-4, 4), 0, size.width);
    const Shot shot = shot_of(source, timestamp_s, shift, step);
    const std::string complaint = check(rig.see(shot), shot);
    if (!complaint.empty()) return complaint;
    if (is_twice && !same_labels(rig.labels, twin.see(shot))) return "two filters disagree";
  }
  if (is_twice && !is_long) return {};
  Rig fresh(options);
  rig.filter.judge().reset();
  for (int i = 0; i < 2; ++i) {
    const Shot shot = shot_of(source, timestamp_s + i / 30.0, shift + i, step);
    if (!same_labels(rig.see(shot), fresh.see(shot)))
      return "a memory that was reset is not like new";
  }
  return {};
}

}  // namespace
}  // namespace dynfilter::testing

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  dynfilter::testing::ByteSource source(data, size);
  return dynfilter::testing::report(dynfilter::testing::filter(source));
}
