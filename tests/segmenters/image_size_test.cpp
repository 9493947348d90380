// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Every component that accepts a segmentation refuses an impossible image size before it allocates
// memory for it.

#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "dynfilter/host_masks.hpp"
#include "dynfilter/segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter {
namespace {

Segmentation segmentation_of(const cv::Size& size) {
  const cv::Mat mask(4, 4, CV_8UC1, cv::Scalar(255));
  const cv::Rect corner(cv::Point(size) - cv::Point(4, 4), mask.size());
  return {1, 1.0, size, {Instance::from_box_mask(mask, corner)}};
}

class FixedSegmenter final : public Segmenter {
 public:
  explicit FixedSegmenter(Segmentation result) : result_(std::move(result)) {}

 private:
  Segmentation do_segment(const FrameView&) override { return result_; }

  Segmentation result_;
};

struct Consumer {
  const char* name;
  std::function<void(const Segmentation&)> take;
};

TEST(ImageSize, ImpossibleSizesAreRefused) {
  const testing::TemporaryFolder folder;
  MaskFolderWriter writer(folder.path() / "masks");
  const Consumer consumers[] = {
      {"mask_of_static_pixels", [](const auto& masks) { mask_of_static_pixels(masks); }},
      {"mask_of_dynamic_pixels", [](const auto& masks) { mask_of_dynamic_pixels(masks); }},
      {"MaskPropagator", [](const auto& masks) { MaskPropagator().propagate({}, masks); }},
      {"MaskFolderWriter", [&](const auto& masks) { writer.add(masks); }},
      {"Segmenter", [](const auto& masks) { FixedSegmenter(masks).segment({}); }},
  };
  constexpr int int_max = std::numeric_limits<int>::max();
  for (const cv::Size& size :
       {cv::Size(int_max, int_max), cv::Size(int_max, 1), cv::Size(1, int_max),
        cv::Size(1048577, 4), cv::Size(32769, 32768)}) {
    for (const Consumer& consumer : consumers) {
      SCOPED_TRACE(std::string(consumer.name) + " " + detail::size_name(size));
      testing::expect_error<std::invalid_argument>(
          [&] { consumer.take(segmentation_of(size)); },
          "got image_size " + detail::size_name(size) +
              "; want sides of at most 1048576 pixels and at most 1073741824 pixels in all");
    }
  }
}

TEST(ImageSize, LargestSizesAreAccepted) {
  for (const cv::Size& size : {cv::Size(1048576, 1024), cv::Size(32768, 32768)}) {
    EXPECT_NO_THROW(validate(segmentation_of(size), "test")) << size;
    EXPECT_NO_THROW(MaskPropagator().propagate({}, segmentation_of(size))) << size;
  }
}

}  // namespace
}  // namespace dynfilter
