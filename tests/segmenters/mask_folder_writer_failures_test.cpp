// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// MaskFolderWriter when disk space runs out: a failed call can be repeated.

#include "dynfilter/segmenters/mask_folder_writer.hpp"

#include <filesystem>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/expect_error.hpp"
#include "support/file_size_limit.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;
using testing::expect_error;
using testing::FileSizeLimit;
using testing::TemporaryFolder;

Segmentation two_persons_at(double timestamp_s) {
  Segmentation segmentation;
  segmentation.timestamp_s = timestamp_s;
  segmentation.image_size = {64, 48};
  const cv::Mat block(20, 10, CV_8UC1, cv::Scalar(255));
  segmentation.instances = {Instance::from_box_mask(block, {5, 5, 10, 20}),
                            Instance::from_box_mask(block, {30, 5, 10, 20})};
  return segmentation;
}

TEST(MaskFolderWriterFailures, AddCanBeRepeatedAfterAFullDisk) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path());
  writer.add(two_persons_at(1));
  {
    const FileSizeLimit limit(20);
    expect_error<std::runtime_error>([&] { writer.add(two_persons_at(2)); },
                                     "2.000000.png: cannot be written: File too large");
  }
  EXPECT_EQ(writer.size(), 1U);
  writer.add(two_persons_at(2));
  {
    const FileSizeLimit limit(20);
    expect_error<std::runtime_error>([&] { writer.finish(); }, "instances.csv: cannot be written");
    EXPECT_FALSE(fs::exists(folder / "1.000000.png"));
  }
  writer.finish();
  EXPECT_EQ(MaskFolderSegmenter(folder.path()).size(), 2U);
}

TEST(MaskFolderWriterFailures, FinishCanBeRepeatedAfterAFileWasInTheWay) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path());
  writer.add(two_persons_at(1));
  folder.write("1.000000.png", "mine");
  for (int k = 0; k < 2; ++k) {
    expect_error<std::runtime_error>([&] { writer.finish(); }, "1.000000.png");
  }
  fs::remove(folder / "1.000000.png");
  writer.finish();
  EXPECT_EQ(MaskFolderSegmenter(folder.path()).size(), 1U);
}

}  // namespace
}  // namespace dynfilter
