// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/patch_difference.hpp"

#include <cmath>

#include "patch.hpp"

namespace dynfilter {
namespace {

using detail::Patch;

template <class Value>
double mean_over(int reach, const Value& value) {
  const int side = 2 * reach + 1;
  float sum = 0;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) sum += value(row, column);
  }
  return static_cast<double>(sum) / (side * side);
}

}  // namespace

std::optional<double> patch_difference(const cv::Mat1b& image, cv::Point2f at,
                                       const cv::Mat1b& other, cv::Point2f other_at, int reach_px) {
  const std::optional<Patch> a = Patch::at(image, at, reach_px);
  const std::optional<Patch> b = Patch::at(other, other_at, reach_px);
  if (!a || !b) return {};
  return mean_over(reach_px, [&](int row, int column) {
    return std::abs((*a)(row, column) - (*b)(row, column));
  });
}

std::optional<double> patch_contrast(const cv::Mat1b& image, cv::Point2f at, int reach_px) {
  const std::optional<Patch> patch = Patch::at(image, at, reach_px);
  if (!patch) return {};
  const auto mean = static_cast<float>(
      mean_over(reach_px, [&](int row, int column) { return (*patch)(row, column); }));
  return mean_over(reach_px,
                   [&](int row, int column) { return std::abs((*patch)(row, column) - mean); });
}

}  // namespace dynfilter
