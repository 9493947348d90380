// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "orb_extractor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

namespace odometry {
namespace {

constexpr int candidates_a_feature = 4;
constexpr int fast_threshold = 7;  // low, so that weak texture has corners to choose from

/// Orders the corners totally, so that the choice depends on the corners alone.
bool is_stronger(const cv::KeyPoint& a, const cv::KeyPoint& b) {
  return std::make_tuple(-a.response, a.pt.y, a.pt.x, a.octave) <
         std::make_tuple(-b.response, b.pt.y, b.pt.x, b.octave);
}

/// Keeps the strongest corner of every grid cell, then the second strongest of every cell, and so
/// on until there are `count`.
void keep_spread(std::vector<cv::KeyPoint>& keypoints, std::size_t count,
                 const cv::Size& image_size) {
  if (keypoints.size() <= count) return;
  std::sort(keypoints.begin(), keypoints.end(), is_stronger);
  // Half as many cells as features, because some cells have no corner.
  const double spacing_px = std::sqrt(2.0 * image_size.area() / static_cast<double>(count));
  std::map<std::pair<int, int>, std::size_t> taken_by_cell;
  std::vector<std::pair<std::size_t, std::size_t>> ranked;  // rank in its cell, keypoint
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const cv::Point2f& position = keypoints[i].pt;
    const std::pair<int, int> cell(static_cast<int>(position.y / spacing_px),
                                   static_cast<int>(position.x / spacing_px));
    ranked.emplace_back(taken_by_cell[cell]++, i);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<cv::KeyPoint> kept;
  kept.reserve(count);
  for (std::size_t i = 0; i < count; ++i) kept.push_back(keypoints[ranked[i].second]);
  keypoints = std::move(kept);
}

}  // namespace

double octave_scale(int octave) {
  static const std::array<double, octaves> scales = [] {
    std::array<double, octaves> powers{1};
    for (std::size_t i = 1; i < octaves; ++i) powers[i] = powers[i - 1] * octave_factor;
    return powers;
  }();
  return scales[static_cast<std::size_t>(std::clamp(octave, 0, octaves - 1))];
}

OrbExtractor::OrbExtractor(int features)
    : features_(static_cast<std::size_t>(features)),
      orb_(cv::ORB::create(candidates_a_feature * features, static_cast<float>(octave_factor),
                           octaves)) {
  orb_->setFastThreshold(fast_threshold);
}

void OrbExtractor::extract(const cv::Mat& grey, std::vector<cv::KeyPoint>& keypoints,
                           cv::Mat& descriptors) const {
  orb_->detect(grey, keypoints);
  keep_spread(keypoints, features_, grey.size());
  orb_->compute(grey, keypoints, descriptors);
  // OpenCV scales pixel indices, but the octaves' images are aligned at their corners, not at the
  // centres of their first pixels.
  for (cv::KeyPoint& keypoint : keypoints) {
    const auto shift = static_cast<float>((octave_scale(keypoint.octave) - 1) / 2);
    keypoint.pt += cv::Point2f(shift, shift);
  }
}

}  // namespace odometry
