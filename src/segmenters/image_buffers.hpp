// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_IMAGE_BUFFERS_HPP
#define DYNFILTER_SRC_SEGMENTERS_IMAGE_BUFFERS_HPP

#include <algorithm>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Copies images into memory that is reused once no matrix refers to the copy: a segmenter may keep
/// the image of the last frame.
class ImageBuffers {
 public:
  cv::Mat copy_of(const cv::Mat& image) {
    const auto fits = [&](const cv::Mat& buffer) {
      return is_free(buffer) && buffer.size == image.size && buffer.type() == image.type();
    };
    auto buffer = std::find_if(buffers_.begin(), buffers_.end(), fits);
    if (buffer == buffers_.end()) {
      buffer = std::find_if(buffers_.begin(), buffers_.end(), is_free);  // another size
    }
    if (buffer == buffers_.end()) buffer = buffers_.emplace(buffer);
    image.copyTo(*buffer);
    return *buffer;
  }

 private:
  /// Tells whether only this object refers to the buffer. Reads OpenCV's count atomically, because
  /// other threads may release it.
  static bool is_free(const cv::Mat& buffer) {
    return buffer.u == nullptr || __atomic_load_n(&buffer.u->refcount, __ATOMIC_ACQUIRE) == 1;
  }

  std::vector<cv::Mat> buffers_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_SEGMENTERS_IMAGE_BUFFERS_HPP
