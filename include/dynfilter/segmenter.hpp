// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTER_HPP
#define DYNFILTER_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <functional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Finds the objects in an image (paper section 3.1: Yolact++). Anything that can is one: a
/// network, a folder of masks, another process, a callback. Implement `do_segment`; callers use
/// `segment`, which checks what the implementer returned.
class Segmenter {
 public:
  virtual ~Segmenter() = default;

  /// The instances of the frame's image. Throws std::invalid_argument for a result that is
  /// malformed (see validate) or of another image size than the frame's; passes on what the
  /// implementer throws. A frame with neither image nor depth is for segmenters that need none,
  /// such as a folder of masks; its size is then what they say.
  Segmentation segment(const FrameView& frame) {
    validate(frame, "Segmenter");
    Segmentation result = do_segment(frame);
    validate(result, "Segmenter (what do_segment returned)");
    const cv::Size size = size_of(frame);
    if (!size.empty() && result.image_size != size) {
      detail::throw_misuse("Segmenter (what do_segment returned)",
                           detail::concatenate("image_size ", detail::size_name(result.image_size)),
                           detail::concatenate("that of the frame, ", detail::size_name(size)));
    }
    return result;
  }

 protected:
  Segmenter() = default;
  Segmenter(const Segmenter&) = default;
  Segmenter(Segmenter&&) = default;
  Segmenter& operator=(const Segmenter&) = default;
  Segmenter& operator=(Segmenter&&) = default;

  /// A segmentation of this frame without instances, with id, time and size filled in. The size is
  /// empty for a frame with neither image nor depth.
  static Segmentation empty_segmentation(const FrameView& frame) {
    return {frame.id, frame.timestamp_s, size_of(frame), {}};
  }

 private:
  static cv::Size size_of(const FrameView& frame) {
    return frame.image.empty() ? frame.depth.size() : frame.image.size();
  }

  virtual Segmentation do_segment(const FrameView& frame) = 0;
};

/// A segmenter from any callable that takes the image and returns its instances. A frame with
/// neither image nor depth is refused (std::invalid_argument).
class CallbackSegmenter final : public Segmenter {
 public:
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
    Segmentation result = empty_segmentation(frame);
    if (result.image_size.empty()) {
      detail::throw_misuse("CallbackSegmenter", "a frame without an image", "an image to segment");
    }
    result.instances = callback_(frame.image);
    return result;
  }

  Callback callback_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTER_HPP
