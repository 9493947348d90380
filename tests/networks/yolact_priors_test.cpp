// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/yolact_decoder.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

using detail::yolact_priors;

void expect_prior(const cv::Mat& priors, int row, double x, double y, double width, double height) {
  SCOPED_TRACE(row);
  EXPECT_NEAR(priors.at<float>(row, 0), x, 1e-6);
  EXPECT_NEAR(priors.at<float>(row, 1), y, 1e-6);
  EXPECT_NEAR(priors.at<float>(row, 2), width, 1e-6);
  EXPECT_NEAR(priors.at<float>(row, 3), height, 1e-6);
}

TEST(YolactPriors, OfYolactAreSquares) {
  const cv::Mat priors = yolact_priors(19248, {550, 550});
  ASSERT_EQ(priors.rows, 19248);
  const double root = std::sqrt(0.5);
  expect_prior(priors, 0, 0.5 / 69, 0.5 / 69, 24 / 550.0, 24 / 550.0);
  expect_prior(priors, 1, 0.5 / 69, 0.5 / 69, 24 * root / 550, 24 * root / 550);
  expect_prior(priors, 2, 0.5 / 69, 0.5 / 69, 24 / root / 550, 24 / root / 550);
  expect_prior(priors, 3, 1.5 / 69, 0.5 / 69, 24 / 550.0, 24 / 550.0);
  expect_prior(priors, 69 * 3, 0.5 / 69, 1.5 / 69, 24 / 550.0, 24 / 550.0);
  expect_prior(priors, 69 * 69 * 3, 0.5 / 35, 0.5 / 35, 48 / 550.0, 48 / 550.0);
  expect_prior(priors, 19247, 4.5 / 5, 4.5 / 5, 384 / root / 550, 384 / root / 550);
}

TEST(YolactPriors, ScaleWithTheInputTruncatedToPixels) {
  // Input 400 has maps of 50, 25, 13, 7, 4 cells and scales of 17, 34, 69, 139, 279.
  const int cells = 50 * 50 + 25 * 25 + 13 * 13 + 7 * 7 + 4 * 4;
  const cv::Mat priors = yolact_priors(3 * cells, {400, 400});
  expect_prior(priors, 0, 0.5 / 50, 0.5 / 50, 17 / 400.0, 17 / 400.0);
  expect_prior(priors, 3 * cells - 3, 3.5 / 4, 3.5 / 4, 279 / 400.0, 279 / 400.0);
}

TEST(YolactPriors, RefuseAnotherCount) {
  expect_error<std::runtime_error>(
      [] {
        yolact_priors(19247, {550, 550});
      },
      "19247 priors; YOLACT has 19248 for an input of 550x550");
}

}  // namespace
}  // namespace dynfilter::testing
