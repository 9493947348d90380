// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/segmentation.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "support/scene_images.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

inline const cv::Size scene_size(320, 240);

inline FrameView frame_of(const cv::Mat& image, int index) {
  FrameView frame;
  frame.id = static_cast<std::uint64_t>(100 + index);
  frame.timestamp_s = 5.0 + index / 30.0;
  frame.image = image;
  return frame;
}

inline Segmentation result_of(const FrameView& frame, std::vector<Instance> instances,
                              const cv::Size& image = scene_size) {
  return {frame.id, frame.timestamp_s, image, std::move(instances)};
}

/// Gives a frame its own result. Returns the track ids that come out.
inline std::vector<int> track_ids(MaskPropagator& propagator, const cv::Mat& image, int index,
                                  const std::vector<Instance>& instances) {
  const FrameView frame = frame_of(image, index);
  std::vector<int> ids;
  const auto moved = propagator.propagate(frame, result_of(frame, instances));
  for (const Instance& instance : moved->instances) ids.push_back(instance.track_id.value());
  return ids;
}

/// Disc-shaped mask with a hole, whose non-zero values differ.
inline Instance ring(cv::Point centre, int radius) {
  cv::Mat1b mask(2 * radius + 1, 2 * radius + 1, std::uint8_t{0});
  cv::circle(mask, {radius, radius}, radius, 255, cv::FILLED);
  cv::circle(mask, {radius, radius}, radius / 4, 0, cv::FILLED);
  mask(radius, radius / 2) = 7;
  const cv::Point origin = centre - cv::Point(radius, radius);
  Instance instance = Instance::from_box_mask(mask, {origin, mask.size()}, 0, 0.75F);
  instance.box = {origin.x - 3, origin.y - 2, mask.cols + 6, mask.rows + 4};
  return instance;
}

/// Textured rectangle, wholly masked.
struct Patch {
  cv::Rect place;
  std::uint64_t seed;
  int class_id = 0;

  void paint(cv::Mat1b& image, cv::Point shift) const {
    const cv::Rect at = place + shift, seen = at & cv::Rect({}, image.size());
    if (seen.empty()) return;
    texture(place.size(), seed)(seen - at.tl()).copyTo(image(seen));
  }

  Instance instance(cv::Point shift) const {
    const cv::Rect at = (place + shift) & cv::Rect({}, scene_size);
    return Instance::from_box_mask(cv::Mat(at.size(), CV_8UC1, cv::Scalar(255)), at, class_id);
  }
};

inline cv::Mat1b image_with(const std::vector<std::pair<Patch, cv::Point>>& patches) {
  cv::Mat1b image = texture(scene_size, 1);
  for (const auto& [patch, shift] : patches) patch.paint(image, shift);
  return image;
}

inline double iou(const cv::Mat& a, const cv::Mat& b) {
  return double{1} * cv::countNonZero(a & b) / cv::countNonZero(a | b);
}

inline cv::Mat1b painted(const Instance& instance) {
  return testing::painted(Segmentation{0, 0, scene_size, {instance}});
}

/// Images of a camera that pans over a wide texture.
class Pan {
 public:
  explicit Pan(cv::Point step, cv::Size image = scene_size)
      : step_(step), image_(image), wide_(texture(image * 3, 7)) {}

  FrameView frame(int index) const {
    const cv::Rect window(cv::Point(image_) - index * step_, image_);
    return frame_of(wide_(window), index);
  }

 private:
  cv::Point step_;
  cv::Size image_;
  cv::Mat1b wide_;
};

}  // namespace dynfilter::testing
