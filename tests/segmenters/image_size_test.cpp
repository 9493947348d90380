// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Every component that accepts a segmentation refuses an impossible image size before it allocates
// memory for it.

#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "dynfilter/host_masks.hpp"
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

TEST(ImageSize, ImpossibleSizesAreRefused) {
  const testing::TemporaryFolder folder;
  MaskFolderWriter writer(folder.path() / "masks");
  const std::function<void(const Segmentation&)> consumers[] = {
      [](const auto& masks) { mask_of_static_pixels(masks); },
      [](const auto& masks) { mask_of_dynamic_pixels(masks); },
      [](const auto& masks) { MaskPropagator().propagate({}, masks); },
      [&](const auto& masks) { writer.add(masks); },
  };
  constexpr int int_max = std::numeric_limits<int>::max();
  for (const cv::Size& size :
       {cv::Size(int_max, int_max), cv::Size(int_max, 1), cv::Size(1, int_max),
        cv::Size(1048577, 4), cv::Size(32769, 32768)}) {
    for (const auto& take : consumers) {
      testing::expect_error<std::invalid_argument>(
          [&] { take(segmentation_of(size)); },
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
