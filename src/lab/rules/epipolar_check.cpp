// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "epipolar_check.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace dynfilter::peers {
namespace {

// DS-SLAM's own constants.
constexpr double max_distance_px = 1;       // from the epipolar line; more keeps slow movers
constexpr double ransac_distance_px = 0.1;  // of those that the matrix rests on
constexpr double ransac_confidence = 0.99;
constexpr int pyramid_levels = 5;
const cv::Size patch(22, 22);

constexpr std::size_t min_features = 15;  // with fewer, RANSAC finds a matrix of chance

/// Returns for each feature (a position in both frames) its distance from its epipolar line in the
/// second frame, px; none without a matrix.
std::vector<double> epipolar_distances(const std::vector<cv::Point2f>& first,
                                       const std::vector<cv::Point2f>& second) {
  if (first.size() < min_features) return {};
  const cv::Mat matrix =
      cv::findFundamentalMat(first, second, cv::FM_RANSAC, ransac_distance_px, ransac_confidence);
  if (matrix.rows != 3) return {};
  std::vector<cv::Vec3f> lines;  // a x + b y + c = 0 with a² + b² = 1
  cv::computeCorrespondEpilines(first, 1, matrix, lines);
  std::vector<double> distances;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    distances.push_back(std::abs(lines[i].dot({second[i].x, second[i].y, 1})));
  }
  return distances;
}

}  // namespace

void EpipolarCheck::operator()(const FilterInput& input, FeatureLabels& labels) {
  masks_(input, labels);
  if (input.frame.image.empty()) return;
  cv::Mat grey = input.frame.image.clone();
  if (grey.channels() != 1) cv::cvtColor(grey, grey, cv::COLOR_BGR2GRAY);
  const cv::Mat last = std::exchange(last_grey_, grey);
  std::vector<std::size_t> kept;
  std::vector<cv::Point2f> points;
  for (std::size_t i = 0; i < input.features.size(); ++i) {
    if (labels.is_removed(i)) continue;
    kept.push_back(i);
    points.push_back(input.features[i]);
  }
  if (last.size() != grey.size() || points.empty()) return;
  std::vector<cv::Point2f> before;
  std::vector<std::uint8_t> found;
  cv::calcOpticalFlowPyrLK(grey, last, points, before, found, cv::noArray(), patch, pyramid_levels);
  std::size_t tracked = 0;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (found[i] == 0) continue;
    kept[tracked] = kept[i];
    points[tracked] = points[i];
    before[tracked++] = before[i];
  }
  points.resize(tracked);
  before.resize(tracked);
  const std::vector<double> distances = epipolar_distances(before, points);
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (distances[i] > max_distance_px) labels.remove(kept[i], -1, Reason::custom, 1.0F);
  }
}

}  // namespace dynfilter::peers
