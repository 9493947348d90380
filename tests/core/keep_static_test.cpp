// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/keep_static.hpp"

#include "support/byte_source.hpp"
#include "support/guarded_image.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Labels in which the features of `removed` are removed.
FeatureLabels labels_with(std::size_t count, const std::vector<std::size_t>& removed) {
  FeatureLabels labels(count, Segmentation());
  for (const std::size_t i : removed) labels.remove(i, -1, Reason::custom, 1.0F);
  return labels;
}

/// Matrix whose row i holds the number i in every column.
cv::Mat numbered_rows(int rows, int columns = 32) {
  cv::Mat matrix(rows, columns, CV_8UC1);
  for (int y = 0; y < rows; ++y) matrix.row(y).setTo(y);
  return matrix;
}

std::vector<int> first_column(const cv::Mat& matrix) {
  std::vector<int> values;
  for (int y = 0; y < matrix.rows; ++y) values.push_back(matrix.at<std::uint8_t>(y, 0));
  return values;
}

/// Columns of every kind, and rows of any width: in continuous matrices and others, in whole blocks
/// of rows and parts of blocks.
TEST(KeepStatic, KeepsAllColumnsInStep) {
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    ByteSource source(seed);
    const int counts[] = {0, 1, 63, 64, 65, 127, 128, 129, 200};
    const int widths[] = {1, 31, 32, 33, 61, 64};
    const int count = counts[source.between(0, 8)], width = widths[source.between(0, 5)];
    const int first = source.chance(30) ? 70 : 0;  // the first block may lose no row
    FeatureLabels labels(static_cast<std::size_t>(count), Segmentation());
    std::vector<int> expected, ids;
    std::vector<cv::KeyPoint> keypoints;
    std::vector<std::unique_ptr<int>> landmarks;
    std::vector<bool> flags;
    for (int i = 0; i < count; ++i) {
      const bool goes = i >= first && source.chance(static_cast<int>(seed % 101));
      if (goes) labels.remove(static_cast<std::size_t>(i), -1, Reason::custom, 1.0F);
      if (!goes) expected.push_back(i);
      ids.push_back(i);
      keypoints.emplace_back(static_cast<float>(i), 0.0F, 1.0F);
      landmarks.push_back(std::make_unique<int>(i));
      flags.push_back(i % 3 == 0);
    }
    cv::Mat descriptors = numbered_rows(count, width);
    if (source.chance(50)) {  // unshared region of a matrix with longer rows
      const cv::Mat wide = numbered_rows(count, width + 7);
      descriptors = wide.colRange(3, 3 + width);
    }
    const std::size_t kept = keep_static(labels, ids, keypoints, landmarks, flags, descriptors);

    ASSERT_EQ(kept, expected.size());
    ASSERT_EQ(ids, expected) << "seed " << seed;
    ASSERT_EQ(first_column(descriptors), expected) << "seed " << seed;
    ASSERT_EQ(keypoints.size(), kept);
    for (std::size_t i = 0; i < kept; ++i) {
      ASSERT_EQ(static_cast<int>(keypoints[i].pt.x), expected[i]);
      ASSERT_EQ(*landmarks[i], expected[i]);
      ASSERT_EQ(flags[i], expected[i] % 3 == 0);
      ASSERT_EQ(descriptors.at<std::uint8_t>(static_cast<int>(i), width - 1), expected[i]);
    }
  }
}

TEST(KeepStatic, ChecksAllLengthsFirst) {
  std::vector<int> ids = {0, 1, 2};
  std::vector<int> too_short = {0, 1};
  cv::Mat descriptors = numbered_rows(4);
  const FeatureLabels labels = labels_with(3, {0});
  EXPECT_THROW(keep_static(labels, ids, too_short), std::invalid_argument);
  expect_misuse([&] { keep_static(labels, ids, descriptors); },
                "dynfilter::keep_static: got column 1 of length 4; want the number of labels, 3");
  EXPECT_EQ(ids, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(first_column(descriptors), (std::vector<int>{0, 1, 2, 3}));
}

TEST(KeepStatic, DoesNotMoveRowsOfASharedMatrix) {
  const FeatureLabels labels = labels_with(4, {0, 2});
  cv::Mat shared = numbered_rows(4);
  const cv::Mat other_header = shared;
  keep_static(labels, shared);
  EXPECT_EQ(first_column(shared), (std::vector<int>{1, 3}));
  EXPECT_EQ(first_column(other_header), (std::vector<int>{0, 1, 2, 3}));

  std::vector<std::uint8_t> buffer = {0, 1, 2, 3};
  cv::Mat borrowed(4, 1, CV_8UC1, buffer.data());
  keep_static(labels, borrowed);
  EXPECT_EQ(first_column(borrowed), (std::vector<int>{1, 3}));
  EXPECT_EQ(buffer, (std::vector<std::uint8_t>{0, 1, 2, 3}));

  cv::Mat larger = numbered_rows(6);
  cv::Mat region = larger(cv::Rect(3, 1, 5, 4));
  keep_static(labels, region);
  EXPECT_EQ(first_column(region), (std::vector<int>{2, 4}));
  EXPECT_EQ(first_column(larger), (std::vector<int>{0, 1, 2, 3, 4, 5}));
}

TEST(KeepStatic, ReadsNoRowBehindTheMatrix) {
  const GuardedImage memory({32, 128}, CV_8UC1, Guard::behind);  // one page
  cv::Mat descriptors = memory.image();
  for (int row = 0; row < descriptors.rows; ++row) descriptors.row(row).setTo(row);
  FeatureLabels labels(128, Segmentation());
  labels.remove(0, -1, Reason::custom, 1);
  keep_static(labels, descriptors);
  ASSERT_EQ(descriptors.rows, 127);
  for (int row = 0; row < descriptors.rows; ++row) {
    EXPECT_EQ(descriptors.at<std::uint8_t>(row, 31), row + 1);
  }
}

TEST(KeptBelow, CountsKeptFeaturesBelowAPivot) {
  const FeatureLabels labels = labels_with(5, {0, 3});
  const std::size_t expected[] = {0, 0, 1, 2, 2, 3};
  for (std::size_t pivot = 0; pivot <= 5; ++pivot) {
    EXPECT_EQ(kept_below(labels, pivot), expected[pivot]);
  }
  EXPECT_THROW(kept_below(labels, 6), std::invalid_argument);
}

}  // namespace
}  // namespace dynfilter::testing
