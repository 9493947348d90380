// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "feature_extractor.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numeric>
#include <tuple>

namespace dynfilter::tools {
namespace {

constexpr int spare = 4;  // so many times the features wanted are extracted, to choose from

}  // namespace

FeatureExtractor::FeatureExtractor(int features)
    : features_(features), orb_(cv::ORB::create(spare * features)) {
  orb_->setFastThreshold(7);  // ORB-SLAM's lower threshold: weak texture gets features too
}

std::string FeatureExtractor::description() const {
  return std::to_string(spare * features_) + ", spread to " + std::to_string(features_);
}

void FeatureExtractor::extract(const cv::Mat& grey, std::vector<cv::KeyPoint>& keypoints,
                               cv::Mat& descriptors) const {
  orb_->detect(grey, keypoints);
  spread_keypoints(keypoints, static_cast<std::size_t>(features_), grey.size());
  orb_->compute(grey, keypoints, descriptors);
}

void spread_keypoints(std::vector<cv::KeyPoint>& keypoints, std::size_t count,
                      const cv::Size& image_size) {
  if (keypoints.size() <= count) return;
  // About half as many cells as keypoints are wanted, since some cells hold none.
  const double cell_px =
      std::max(1.0, std::sqrt(2.0 * image_size.area() / static_cast<double>(count)));
  const auto cell_of = [&](const cv::KeyPoint& keypoint) {
    return std::make_pair(static_cast<int>(keypoint.pt.y / cell_px),
                          static_cast<int>(keypoint.pt.x / cell_px));
  };
  std::vector<std::size_t> order(keypoints.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::make_tuple(cell_of(keypoints[a]), -keypoints[a].response, a) <
           std::make_tuple(cell_of(keypoints[b]), -keypoints[b].response, b);
  });
  std::vector<std::pair<std::size_t, std::size_t>> ranked;  // rank in the cell, keypoint
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same_cell =
        i > 0 && cell_of(keypoints[order[i]]) == cell_of(keypoints[order[i - 1]]);
    ranked.emplace_back(same_cell ? ranked.back().first + 1 : 0, order[i]);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<cv::KeyPoint> kept;
  kept.reserve(count);
  for (std::size_t i = 0; i < count; ++i) kept.push_back(keypoints[ranked[i].second]);
  keypoints = std::move(kept);
}

}  // namespace dynfilter::tools
