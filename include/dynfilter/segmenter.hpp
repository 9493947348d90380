// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <functional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Finds the objects in an image (paper section 3.1: Yolact++). A segmenter may be a network, a
/// folder of masks, another process or a callback. Derived classes implement `do_segment`; callers
/// use `segment`, which checks the result.
class Segmenter {
 public:
  virtual ~Segmenter() = default;

  /// Segments the frame's image. A result without a time gets the frame's. Throws
  /// std::invalid_argument for a result that is malformed (see validate) or differs from the frame
  /// in image size, and passes on what `do_segment` throws. A frame with neither image nor depth
  /// suits segmenters that need none, such as a folder of masks; the result then has the size that
  /// they report.
  Segmentation segment(const FrameView& frame) {
    validate(frame, "Segmenter");
    Segmentation result = do_segment(frame);
    if (!result.timestamp_s) result.timestamp_s = frame.timestamp_s;
    validate(result, "Segmenter (result of do_segment)");
    const cv::Size size = size_of(frame);
    if (!size.empty() && result.image_size != size) {
      detail::throw_misuse("Segmenter (result of do_segment)",
                           detail::concatenate("image_size ", detail::size_name(result.image_size)),
                           detail::concatenate("the frame's size, ", detail::size_name(size)));
    }
    return result;
  }

 protected:
  Segmenter() = default;
  /// @{
  /// Derived classes may be copied and moved.
  Segmenter(const Segmenter&) = default;
  Segmenter(Segmenter&&) = default;
  Segmenter& operator=(const Segmenter&) = default;
  Segmenter& operator=(Segmenter&&) = default;
  /// @}

  /// Makes a segmentation of this frame without instances: id, time and size are filled in. The
  /// size is empty for a frame with neither image nor depth.
  static Segmentation empty_segmentation(const FrameView& frame) {
    return {frame.id, frame.timestamp_s, size_of(frame), {}};
  }

 private:
  static cv::Size size_of(const FrameView& frame) {
    return frame.image.empty() ? frame.depth.size() : frame.image.size();
  }

  virtual Segmentation do_segment(const FrameView& frame) = 0;
};

/// Segmenter that calls a function with the image and takes the instances that it returns. Throws
/// std::invalid_argument for a frame without an image.
class CallbackSegmenter final : public Segmenter {
 public:
  /// Function that returns the instances of an image.
  using Callback = std::function<std::vector<Instance>(const cv::Mat& image)>;

  /// Throws std::invalid_argument for an empty callback.
  explicit CallbackSegmenter(Callback callback) : callback_(std::move(callback)) {
    if (!callback_) {
      detail::throw_misuse("CallbackSegmenter", "an empty callback",
                           "a callable from cv::Mat to std::vector<Instance>");
    }
  }

 private:
  Segmentation do_segment(const FrameView& frame) override {
    if (frame.image.empty()) {
      detail::throw_misuse("CallbackSegmenter", "a frame without an image", "an image to segment");
    }
    Segmentation result = empty_segmentation(frame);
    result.instances = callback_(frame.image);
    return result;
  }

  Callback callback_;
};

}  // namespace dynfilter
