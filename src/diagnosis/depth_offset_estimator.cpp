// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/diagnosis/depth_offset_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/grey_image.hpp"

namespace dynfilter {
namespace {

constexpr const char* component = "DepthOffsetEstimator";
constexpr std::size_t max_stretches = 32;
constexpr int work_width = 320;  // images are shrunk to about this width, pixels
constexpr int work_rows = 120;   // about so many rows of the depth image have edges enough
/// @{
/// Smallest jump of depth at an edge: metres, or a share of the nearer depth if that is more.
constexpr float min_jump_m = 0.08F, min_jump_share = 0.025F;
/// @}
constexpr float max_edge_depth_m = 6;  // the near side of farther edges is noisy
/// Widest strip without depth that an edge may lie across, as in the sensor's shadow beside a near
/// thing; pixels at a width of 640.
constexpr double max_shadow_px = 12;
constexpr double canny_low = 50, canny_high = 120;  // thresholds for edges of the colour image
/// A depth edge farther from all colour edges counts as this far, pixels at a width of 640.
constexpr double max_distance_px = 8;
constexpr std::size_t min_edges = 25;      // depth edges of a usable frame
constexpr std::size_t min_frames = 10;     // usable frames for an estimate
constexpr double max_sigma_frames = 0.25;  // a less certain estimate is withheld
/// Smallest rise of the mean distance from the best offset to the farthest ones, pixels. With less,
/// nothing moves.
constexpr double min_rise_px = 0.04;
/// A larger gap between successive frames, seconds, or a step back, separates the frames before it
/// from those after it.
constexpr double max_gap_s = 0.2;

/// Collects the near sides of depth edges: a pixel's next neighbour on either side that has depth,
/// or the one above or below, is farther away by a jump. Gives them as indices of the pixels of an
/// image that is smaller by the whole number `shrink`.
template <class Unit>
void find_depth_edges(const cv::Mat& depth, double scale, int shrink, std::vector<int>& edges) {
  const float metres = static_cast<float>(scale);
  const auto jumps = [](float from, float to) {
    return to - from > std::max(min_jump_m, min_jump_share * from) && from <= max_edge_depth_m;
  };
  const int columns = depth.cols / shrink, rows = depth.rows / shrink;
  const int max_gap = std::max(1, cvRound(max_shadow_px * depth.cols / 640.0)) + 1;
  const int row_step = std::max(1, depth.rows / work_rows);
  for (int y = 1; y + 1 < depth.rows; y += row_step) {
    const Unit* const above = depth.ptr<Unit>(y - 1);
    const Unit* const row = depth.ptr<Unit>(y);
    const Unit* const below = depth.ptr<Unit>(y + 1);
    int last_x = -max_gap - 1;  // the last pixel with depth
    float last_z = 0;
    int last_edge = -1;
    const auto add = [&](int x) {
      const int column = std::min(x / shrink, columns - 1);
      if (x != last_edge) edges.push_back(std::min(y / shrink, rows - 1) * columns + column);
      last_edge = x;
    };
    for (int x = 0; x < depth.cols; ++x) {
      const float z = static_cast<float>(row[x]) * metres;
      if (!(z > 0) || !std::isfinite(z)) continue;
      const float vertical =
          std::max(static_cast<float>(above[x]), static_cast<float>(below[x])) * metres;
      if (x - last_x <= max_gap) {
        if (jumps(last_z, z)) add(last_x);
        if (jumps(z, last_z)) add(x);
      }
      if (jumps(z, vertical) && std::isfinite(vertical)) add(x);
      last_x = x;
      last_z = z;
    }
  }
}

double mean_distance(const cv::Mat& distance, const std::vector<int>& edges, float max_distance) {
  const float* const distances = distance.ptr<float>();
  double sum = 0;
  for (const int i : edges) sum += std::min(distances[i], max_distance);
  return sum / static_cast<double>(edges.size());
}

/// The lowest point of a curve, in the units of its abscissae.
struct Vertex {
  std::size_t nearest = 0;  ///< the lowest of the curve's points
  double x = 0;
  double rise = 0;  ///< from there to the mean of the curve's ends
};

using Curve = decltype(DepthOffsetEstimate::distances_px);

/// Lays two lines of equal and opposite slope through the lowest point and its neighbours:
/// distances grow evenly to either side of the true offset. The steeper neighbour's line goes
/// through the lowest point too. At an end of the curve, and on a flat curve, that point itself is
/// the vertex.
Vertex vertex_of(const Curve& x, const Curve& y) {
  Vertex vertex;
  vertex.nearest = static_cast<std::size_t>(std::min_element(y.begin(), y.end()) - y.begin());
  const std::size_t b = vertex.nearest;
  vertex.x = x[b];
  vertex.rise = (y.front() + y.back()) / 2 - y[b];
  if (b == 0 || b + 1 == x.size()) return vertex;
  const double fall = (y[b - 1] - y[b]) / (x[b] - x[b - 1]);
  const double climb = (y[b + 1] - y[b]) / (x[b + 1] - x[b]);
  const double slope = std::max(fall, climb);
  if (!(slope > 0)) return vertex;
  const std::size_t left = fall >= climb ? b : b - 1;  // the vertex lies between it and the next
  vertex.x = (x[left] + x[left + 1]) / 2 + (y[left] - y[left + 1]) / (2 * slope);
  return vertex;
}

}  // namespace

bool DepthOffsetEstimator::takes(const cv::Mat& image) {
  const int type = image.type();
  return !image.empty() && (type == CV_8UC1 || type == CV_8UC3 || type == CV_8UC4);
}

void DepthOffsetEstimator::add(const FrameView& frame, double depth_timestamp_s) {
  validate(frame, component);
  if (frame.depth.empty() || !takes(frame.image)) {
    detail::throw_misuse(
        component,
        detail::concatenate("an image of type ", detail::type_name(frame.image), " and size ",
                            detail::size_name(frame.image.size()), ", depth of size ",
                            detail::size_name(frame.depth.size())),
        "an image CV_8UC1, CV_8UC3 or CV_8UC4 and depth of its size");
  }
  detail::OptionCheck{component}(std::isfinite(depth_timestamp_s), "depth_timestamp_s",
                                 depth_timestamp_s, "a finite time in seconds");
  const double step_s = frame.timestamp_s - last_s_;
  const bool follows = step_s > 0 && step_s <= max_gap_s && !last_.empty() &&
                       last_.back().size == frame.image.size();
  if (!follows) last_.clear();
  last_s_ = frame.timestamp_s;
  Edges edges;
  if (last_.size() == lags) {  // reuses memory
    edges = std::move(last_.front());
    last_.pop_front();
  }
  edges.colour_s = frame.timestamp_s;
  edges.depth_s = depth_timestamp_s;
  find_edges(frame, edges);
  last_.push_back(std::move(edges));
  if (last_.size() == lags) compare();
}

void DepthOffsetEstimator::find_edges(const FrameView& frame, Edges& edges) {
  const int shrink = std::max(1, std::min(frame.image.cols / work_width, frame.image.rows));
  const cv::Size size(frame.image.cols / shrink, frame.image.rows / shrink);
  cv::resize(frame.image, small_, size, 0, 0, cv::INTER_AREA);
  cv::Canny(detail::grey_of(small_, small_), canny_, canny_low, canny_high);
  cv::bitwise_not(canny_, canny_);
  cv::distanceTransform(canny_, edges.distance, cv::DIST_L2, cv::DIST_MASK_3);
  edges.depth.clear();
  edges.size = frame.image.size();
  if (frame.depth.type() == CV_16UC1) {
    find_depth_edges<std::uint16_t>(frame.depth, frame.depth_scale(), shrink, edges.depth);
  } else {
    find_depth_edges<float>(frame.depth, frame.depth_scale(), shrink, edges.depth);
  }
}

/// Compares the colour image in the middle with every depth image.
void DepthOffsetEstimator::compare() {
  const Edges& colour = last_[lags / 2];
  const double pixels_per_unit = colour.distance.cols / 640.0;
  const float max_distance = static_cast<float>(max_distance_px * pixels_per_unit);
  Sums row;
  row.frames = 1;
  for (std::size_t k = 0; k < lags; ++k) {
    const Edges& depth = last_[k];
    if (depth.depth.size() < min_edges) return;
    row.differences_s[k] = depth.depth_s - colour.colour_s;
    row.distances_px[k] =
        mean_distance(colour.distance, depth.depth, max_distance) / pixels_per_unit;
  }
  add_row(row);
}

void DepthOffsetEstimator::Sums::add(const Sums& other, double sign) {
  frames += sign * other.frames;
  for (std::size_t k = 0; k < lags; ++k) {
    differences_s[k] += sign * other.differences_s[k];
    distances_px[k] += sign * other.distances_px[k];
  }
}

/// Adds a frame's row to the last stretch. When the stretches are many, joins them in pairs.
void DepthOffsetEstimator::add_row(const Sums& row) {
  if (!stretches_.empty() && stretches_.back().frames < stretch_frames_) {
    stretches_.back().add(row);
    return;
  }
  if (stretches_.size() == max_stretches) {
    for (std::size_t i = 0; i < max_stretches / 2; ++i) {
      Sums both = stretches_[2 * i];
      both.add(stretches_[2 * i + 1]);
      stretches_[i] = both;
    }
    stretches_.resize(max_stretches / 2);
    stretch_frames_ *= 2;
  }
  stretches_.push_back(row);
}

DepthOffsetEstimate DepthOffsetEstimator::estimate() const {
  DepthOffsetEstimate result;
  if (stretches_.empty()) return result;
  Sums all;
  for (const Sums& stretch : stretches_) all.add(stretch);
  const auto mean_of = [](Sums sums) {
    for (std::size_t k = 0; k < lags; ++k) {
      sums.differences_s[k] /= sums.frames;
      sums.distances_px[k] /= sums.frames;
    }
    return sums;
  };
  const Sums mean = mean_of(all);
  result.frames = static_cast<std::size_t>(all.frames);
  result.distances_px = mean.distances_px;
  const double period_s = (mean.differences_s.back() - mean.differences_s.front()) / (lags - 1);
  if (result.frames < min_frames || stretches_.size() < 2 || !(period_s > 0)) return result;

  const Vertex vertex = vertex_of(mean.differences_s, mean.distances_px);
  // The jackknife: how far do the results change if one stretch is left out?
  double x_variance = 0, rise_variance = 0;
  const double share = 1 - 1 / static_cast<double>(stretches_.size());
  for (const Sums& stretch : stretches_) {
    Sums others = all;
    others.add(stretch, -1);
    others = mean_of(others);
    const Vertex moved = vertex_of(others.differences_s, others.distances_px);
    x_variance += share * (moved.x - vertex.x) * (moved.x - vertex.x);
    rise_variance += share * (moved.rise - vertex.rise) * (moved.rise - vertex.rise);
  }
  const double min_rise = std::max(min_rise_px, 3 * std::sqrt(rise_variance));
  DepthOffset offset;
  offset.seconds = vertex.x;
  offset.frames_late = (vertex.x - mean.differences_s[lags / 2]) / period_s;
  offset.sigma_frames = std::sqrt(x_variance) / period_s;
  if (vertex.rise < min_rise) {
    result.verdict = DepthOffsetVerdict::nothing_moves;
  } else if (vertex.nearest == 0 || vertex.nearest + 1 == lags) {
    result.verdict = DepthOffsetVerdict::out_of_reach;
  } else if (offset.sigma_frames > max_sigma_frames) {
    result.verdict = DepthOffsetVerdict::uncertain;
  } else {
    result.verdict = DepthOffsetVerdict::measured;
    result.offset = offset;
  }
  return result;
}

}  // namespace dynfilter
