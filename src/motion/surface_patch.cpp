// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "surface_patch.hpp"

#include <algorithm>
#include <cmath>

#include "dynfilter/features.hpp"
#include "patch.hpp"

namespace dynfilter::detail {
namespace {

constexpr int max_distance_px = 20;   // of the depth of a pixel that has none
constexpr double max_front_m = 0.15;  // what is nearer by more lies in front of a surface

}  // namespace

std::optional<double> surface_depth(const FrameView& frame, cv::Point pixel) {
  if (!cv::Rect({}, frame.depth.size()).contains(pixel)) return {};
  std::optional<double> farthest_m = frame.depth_m(pixel);
  if (farthest_m) return farthest_m;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      std::optional<double> next_m;
      for (int steps = 1; steps <= max_distance_px && !next_m; ++steps) {
        next_m = frame.depth_m({pixel.x + steps * dx, pixel.y + steps * dy});
      }
      if (next_m) farthest_m = std::max(*next_m, farthest_m.value_or(0));
    }
  }
  return farthest_m;
}

std::optional<SurfacePatch> SurfacePatch::around(const FrameView& frame, const cv::Mat1b& grey,
                                                 cv::Point2f feature,
                                                 std::optional<double> depth_m) {
  const auto patch = Patch::at(grey, feature, reach_px);
  if (!patch) return {};
  SurfacePatch result;
  const cv::Point centre = nearest_pixel(feature);
  for (int row = 0; row <= 2 * reach_px; ++row) {
    for (int column = 0; column <= 2 * reach_px; ++column) {
      const cv::Point away(column - reach_px, row - reach_px);
      const auto there_m = frame.depth_m(centre + away);
      const bool is_centre = away == cv::Point();
      if (!is_centre && depth_m && there_m && *there_m < *depth_m - max_front_m) continue;
      result.pixels_[result.count_++] = {row, column, (*patch)(row, column)};
    }
  }
  return result;
}

double SurfacePatch::contrast() const {
  const auto count = static_cast<float>(count_);
  float sum = 0, difference = 0;
  for (std::size_t i = 0; i < count_; ++i) sum += pixels_[i].brightness;
  for (std::size_t i = 0; i < count_; ++i)
    difference += std::abs(pixels_[i].brightness - sum / count);
  return double{difference / count};
}

std::optional<double> SurfacePatch::difference(const cv::Mat1b& other, cv::Point2f place) const {
  const auto patch = Patch::at(other, place, reach_px);
  if (!patch) return {};
  float sum = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Pixel& pixel = pixels_[i];
    sum += std::abs(pixel.brightness - (*patch)(pixel.row, pixel.column));
  }
  return static_cast<double>(sum) / static_cast<double>(count_);
}

}  // namespace dynfilter::detail
