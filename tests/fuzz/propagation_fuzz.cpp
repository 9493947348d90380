// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Propagates wild masks through sequences of wild times and images. Two propagators agree, moved
// instances lie in the image, no track id appears twice, and no statement is about the future.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include <opencv2/imgproc.hpp>

#include "dynfilter/segmenters/mask_propagator.hpp"
#include "fuzz/report.hpp"
#include "support/byte_source.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

const cv::Size size(64, 48);

/// Part of a wide texture, blank, or none.
cv::Mat image_of(ByteSource& source, int shift) {
  static const cv::Mat1b wide = texture({3 * size.width, size.height}, 5);
  const int kind = source.between(0, 15);
  if (kind == 0) return {};
  if (kind == 1) return cv::Mat(size, CV_8UC1, cv::Scalar(source.byte()));
  if (kind == 2) return wide(cv::Rect(0, 0, 50, 40));  // another size
  return wide(cv::Rect({shift, 0}, size));
}

int position(ByteSource& source) {
  constexpr int least = std::numeric_limits<int>::min(), most = std::numeric_limits<int>::max();
  const int wild[] = {least, least + 20, -1000000, -30, 1000000, most - 50, most};
  return source.chance(10) ? wild[source.between(0, 6)] : source.between(-20, 70);
}

int extent(ByteSource& source) {
  const int wild[] = {0, 1, 1000000, std::numeric_limits<int>::max()};
  return source.chance(15) ? wild[source.between(0, 3)] : source.between(2, 50);
}

Segmentation result_of(ByteSource& source, const FrameView& frame) {
  Segmentation result{
      frame.id, frame.timestamp_s, frame.image.empty() ? size : frame.image.size(), {}};
  if (source.chance(30)) *result.timestamp_s -= source.between(-3, 20) / 30.0;
  if (source.chance(10)) result.frame_id = source.byte();
  const int count = source.between(0, 4);
  for (int k = 0; k < count; ++k) {
    Instance instance;
    instance.class_id = source.between(0, 1);
    instance.box = {position(source), position(source), extent(source), extent(source)};
    instance.mask = cv::Mat(source.between(0, 40), source.between(0, 40), CV_8UC1,
                            cv::Scalar(source.chance(90) ? 255 : 0));
    instance.mask_origin = {position(source), position(source)};
    if (source.chance(20)) instance.track_id = source.between(0, 5);
    result.instances.push_back(instance);
  }
  return result;
}

bool same(const std::optional<Segmentation>& a, const std::optional<Segmentation>& b) {
  if (a.has_value() != b.has_value()) return false;
  if (!a) return true;
  if (a->timestamp_s != b->timestamp_s || a->instances.size() != b->instances.size()) return false;
  for (std::size_t k = 0; k < a->instances.size(); ++k) {
    const Instance &one = a->instances[k], &other = b->instances[k];
    if (one.box != other.box || one.mask_origin != other.mask_origin ||
        one.track_id != other.track_id || one.mask.size() != other.mask.size() ||
        (!one.mask.empty() && cv::norm(one.mask, other.mask, cv::NORM_INF) != 0)) {
      return false;
    }
  }
  return true;
}

/// Tells whether the instance is as the newest result has it.
bool is_given(const Instance& instance, const std::optional<Segmentation>& newest) {
  const auto is_same = [&](const Instance& one) {
    return one.box == instance.box && one.mask_origin == instance.mask_origin;
  };
  return newest && std::any_of(newest->instances.begin(), newest->instances.end(), is_same);
}

std::string check(const Segmentation& moved, const FrameView& frame,
                  const std::optional<Segmentation>& newest) {
  validate(moved, "a fuzzed propagator");
  if (moved.timestamp_s > frame.timestamp_s) return "masks of the future";
  const cv::Rect image({}, moved.image_size);
  for (const Instance& instance : moved.instances) {
    if (!instance.track_id) return "an instance without track id";
    if (is_given(instance, newest)) continue;
    const cv::Rect mask(instance.mask_origin, instance.mask.size());
    if ((instance.box & image) != instance.box) return "a moved box outside the image";
    if (!mask.empty() && (mask & image) != mask) return "a moved mask outside the image";
  }
  return {};
}

std::string propagate(ByteSource& source) {
  MaskPropagatorOptions options;
  for (const int most : {3, 4, 4}) {
    if (source.chance(30)) source.between(0, most);  // keeps the corpus
  }
  if (source.chance(30)) options.max_age_s = source.between(0, 20) / 10.0;
  MaskPropagator propagator(options), twin(options);
  FrameView frame;
  frame.timestamp_s = source.between(0, 4);
  std::optional<Segmentation> newest;
  const int frames = source.between(1, source.may_be_costly(16) ? 10 : 3);
  int shift = size.width;
  for (int i = 0; i < frames; ++i) {
    const double steps_s[] = {1.0 / 30, 1.0 / 30, 1.0 / 30, 0.2, 1e-9, 0, -0.5, 1e5};
    frame.timestamp_s += steps_s[source.between(0, 7)];
    frame.id = static_cast<std::uint64_t>(source.chance(90) ? i : source.byte());
    shift = std::clamp(shift + source.between(-3, 3), 0, 2 * size.width);
    frame.image = image_of(source, shift);
    const cv::Size frame_size = frame.image.empty() ? size : frame.image.size();
    if (source.chance(40)) newest = result_of(source, frame);
    if (newest && newest->image_size != frame_size) newest.reset();
    const auto moved = propagator.propagate(frame, newest);
    if (!same(moved, twin.propagate(frame, newest))) return "two propagators disagree";
    if (!moved) continue;
    const std::string complaint = check(*moved, frame, newest);
    if (!complaint.empty()) return complaint;
  }
  return {};
}

}  // namespace
}  // namespace dynfilter::testing

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  dynfilter::testing::ByteSource source(data, size);
  return dynfilter::testing::report(dynfilter::testing::propagate(source));
}
