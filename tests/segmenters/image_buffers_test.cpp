// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "segmenters/image_buffers.hpp"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace dynfilter::detail {
namespace {

TEST(ImageBuffers, UseFreeMemoryOfTheSameSize) {
  ImageBuffers buffers;
  const cv::Mat small(10, 20, CV_8UC3, cv::Scalar::all(1)), large(300, 200, CV_8UC3, cv::Scalar(2));
  cv::Mat first = buffers.copy_of(small), second = buffers.copy_of(large);
  const void* const memory_of_first = first.data;
  const void* const memory_of_second = second.data;
  EXPECT_NE(memory_of_first, small.data);
  const cv::Mat third = buffers.copy_of(large);
  EXPECT_NE(third.data, memory_of_second) << "the second copy is in use";
  first.release();
  second.release();
  const cv::Mat fourth = buffers.copy_of(large);
  EXPECT_EQ(fourth.data, memory_of_second);
  const cv::Mat fifth = buffers.copy_of(small);
  EXPECT_EQ(fifth.data, memory_of_first);
  EXPECT_EQ(cv::norm(fourth, large, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(fifth, small, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace dynfilter::detail
