// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/silhouette_lag_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_row.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/detail/rectangles.hpp"

namespace dynfilter {
namespace {

constexpr const char* component = "SilhouetteLagEstimator";
constexpr std::size_t max_edges = 4096;  // of a side; then the older half is forgotten
constexpr std::size_t stretches = 8;     // of the jackknife
constexpr int max_hole = 2;              // pixels without the object's depth that do not end it
constexpr double max_difference_frames = 1;
constexpr double max_sigma_frames = 0.25;
// Standard error of the lag by edges, where texture and shadows lie on one side of things.
constexpr double edges_sigma_frames = 0.2;

constexpr detail::OptionCheck require(component);

/// Returns the mean of the middle half of the values, which is as robust as their median, and
/// finer.
double middle_mean(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  const auto quarter = static_cast<std::ptrdiff_t>(values.size() / 4);
  const auto first = values.begin() + quarter, end = values.end() - quarter;
  return std::accumulate(first, end, 0.0) / static_cast<double>(end - first);
}

/// Returns the standard deviation of normal values with this median absolute deviation.
double spread(std::vector<double> values) {
  const double middle = detail::quantile_of(values);
  for (double& value : values) value = std::abs(value - middle);
  return 1.4826 * detail::quantile_of(values);
}

int scaled(double length_px, const FrameView& frame) {
  return std::max(
      1, static_cast<int>(std::lround(length_px * detail::pixel_scale(frame.depth.size()))));
}

/// Part of a mask's row.
struct Run {
  int y, first, last;
};

/// Follows the object's depth in a row outwards, from within the mask, and returns where it ends:
/// pixels beyond the mask's edge, negative within the mask. Returns nothing if it does not begin
/// within the mask or if its end is out of reach.
template <class Depth>
std::optional<double> find_end(const FrameView& frame, const ObjectDepth& object, const Run& run,
                               bool is_right, int reach) {
  const int way = is_right ? 1 : -1;
  const int edge = is_right ? run.last : run.first;
  const Depth* const row = frame.depth.ptr<Depth>(run.y);
  const double scale = frame.depth_scale();
  const auto is_objects = [&](int beyond) {
    return object.contains(static_cast<double>(row[edge + way * beyond]) * scale);
  };
  const int start = -std::min(reach, (run.last - run.first) / 2);
  const int to_border = is_right ? frame.depth.cols - 1 - edge : edge;
  if (!is_objects(start)) return {};
  int end = start;
  for (int beyond = start + 1; beyond <= end + max_hole + 1; ++beyond) {
    if (beyond > std::min(reach, to_border)) return {};
    if (is_objects(beyond)) end = beyond;
  }
  return end;
}

std::optional<double> find_end(const FrameView& frame, const ObjectDepth& object, const Run& run,
                               bool is_right, int reach) {
  return frame.depth.type() == CV_16UC1
             ? find_end<std::uint16_t>(frame, object, run, is_right, reach)
             : find_end<float>(frame, object, run, is_right, reach);
}

/// Calls the action with the runs of a mask in every `row_step`th row of an image of this size.
template <class Action>
void for_each_run(const Instance& instance, const cv::Size& image, int row_step,
                  const Action& action) {
  const cv::Rect masked = detail::clip({instance.mask_origin, instance.mask.size()}, image);
  for (int y = masked.y + row_step / 2; y < masked.y + masked.height; y += row_step) {
    const std::uint8_t* const row = instance.mask.ptr<std::uint8_t>(y - instance.mask_origin.y) +
                                    (masked.x - instance.mask_origin.x);
    const std::uint8_t* const end = row + masked.width;
    for (const std::uint8_t* run = detail::find_mask_pixel(row, end); run != end;) {
      const std::uint8_t* const run_end = detail::find_mask_end(run, end);
      const auto x_of = [&](const std::uint8_t* pixel) {
        return masked.x + static_cast<int>(pixel - row);
      };
      action(Run{y, x_of(run), x_of(run_end) - 1});
      run = detail::find_mask_pixel(run_end, end);
    }
  }
}

}  // namespace

SilhouetteLagEstimator::SilhouetteLagEstimator(const SilhouetteLagEstimatorOptions& options)
    : options_(options) {
  const auto require_length = [](const char* name, double value) {
    require(value > 0 && value <= 1e4, name, value, "a number above 0 and at most 10000");
  };
  require_length("row_step_px", options.row_step_px);
  require_length("reach_px", options.reach_px);
  require_length("min_width_px", options.min_width_px);
  require_length("max_gap_s", options.max_gap_s);
  require(options.min_rows > 0, "min_rows", options.min_rows, "at least 1");
  require(options.min_edges >= 2 * stretches, "min_edges", options.min_edges, "at least 16");
  require(options.min_motion_share > 0 && options.min_motion_share <= 1, "min_motion_share",
          options.min_motion_share, "a number above 0 and at most 1");
  require(options.max_age_s >= 0 && options.max_age_s <= 1e4, "max_age_s", options.max_age_s,
          "0 to 10000 seconds");
}

void SilhouetteLagEstimator::add(const FrameView& frame, const Segmentation& masks) {
  validate(frame, component);
  validate(masks, component);
  if (frame.depth.empty()) {
    detail::throw_misuse(component, "a frame without depth", "one with a depth image");
  }
  if (filled_ > 0) {
    const FrameView& last = images_.back().frame;
    const double step_s = frame.timestamp_s - last.timestamp_s;
    const bool follows =
        step_s > 0 && step_s <= options_.max_gap_s && last.depth.size() == frame.depth.size();
    if (!follows) filled_ = 0;
  }
  Image newest;  // whole before the images change: copies may fail
  newest.frame = frame;
  newest.frame.image.release();
  newest.frame.depth = frame.depth.clone();
  if (std::abs(frame.timestamp_s - masks.timestamp_s) <= options_.max_age_s) {
    newest.masks = masks.instances;
    for (Instance& instance : newest.masks) instance.mask = instance.mask.clone();
  }
  std::rotate(images_.begin(), images_.begin() + 1, images_.end());
  images_.back() = std::move(newest);
  filled_ = std::min(filled_ + 1, images_.size());
  if (filled_ < images_.size()) return;
  for (const Instance& instance : images_[1].masks) measure(instance);
}

/// Measures the ends of an object's depth in the three images, beside its mask in the middle one.
void SilhouetteLagEstimator::measure(const Instance& instance) {
  const FrameView& frame = images_[1].frame;
  const ObjectDepth object = depth_estimator_.estimate(frame, instance, depths_m_);
  if (object.empty()) return;
  for (Rows& rows : rows_) rows = {};
  const int reach = scaled(options_.reach_px, frame);
  const int min_width = scaled(options_.min_width_px, frame);
  for_each_run(instance, frame.depth.size(), scaled(options_.row_step_px, frame),
               [&](const Run& run) {
                 if (run.last - run.first + 1 < min_width) return;
                 for (const bool is_right : {false, true}) {
                   const auto end_in = [&](const Image& image) {
                     return find_end(image.frame, object, run, is_right, reach);
                   };
                   const auto before = end_in(images_[0]), now = end_in(images_[1]),
                              after = end_in(images_[2]);
                   if (!before || !now || !after) continue;
                   const int way = is_right ? 1 : -1;
                   Rows& rows = rows_[is_right ? 1 : 0];
                   rows.places_px.push_back(way * *now);
                   rows.speeds_px.push_back(way * (*after - *before) / 2);
                   rows.bends_px.push_back(way * (*after - 2 * *now + *before));
                 }
               });
  for (const std::size_t side : {0U, 1U}) add_edge(side);
}

/// Adds a silhouette's edge from what was measured in its rows.
void SilhouetteLagEstimator::add_edge(std::size_t side) {
  Rows& rows = rows_[side];
  if (rows.places_px.size() < options_.min_rows) return;
  const double scale = detail::pixel_scale(images_[1].frame.depth.size());
  std::vector<Edge>& edges = edges_[side];
  if (edges.size() == max_edges) edges.erase(edges.begin(), edges.begin() + max_edges / 2);
  edges.push_back({middle_mean(rows.places_px) / scale, middle_mean(rows.speeds_px) / scale,
                   middle_mean(rows.bends_px) / scale});
}

/// Fits a line robustly to the places over the speeds of edges, without those from `first` to
/// `end`.
SilhouetteLagEstimator::Line SilhouetteLagEstimator::line_of(const std::vector<Edge>& edges,
                                                             std::size_t first,
                                                             std::size_t end) const {
  std::vector<double> x, y, bends;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (first <= i && i < end) continue;
    x.push_back(edges[i].speed_px);
    y.push_back(edges[i].place_px);
    bends.push_back(edges[i].bend_px);
  }
  if (x.size() < options_.min_edges / 2) return {};
  // Noise s of the places is s / sqrt(2) in the speeds, and s * sqrt(6) in the bends.
  const double noise = spread(bends) / std::sqrt(12.0), speeds = spread(x);
  const double motion_share = speeds > 0 ? 1 - noise * noise / (speeds * speeds) : 0;
  if (motion_share < options_.min_motion_share) return {};

  std::vector<double> weights(x.size(), 1.0), rests(x.size());
  Line line;
  for (int iteration = 0; iteration < 10; ++iteration) {
    double sum = 0, x_mean = 0, y_mean = 0, xx = 0, xy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      sum += weights[i];
      x_mean += weights[i] * x[i];
      y_mean += weights[i] * y[i];
    }
    x_mean /= sum;
    y_mean /= sum;
    for (std::size_t i = 0; i < x.size(); ++i) {
      xx += weights[i] * (x[i] - x_mean) * (x[i] - x_mean);
      xy += weights[i] * (x[i] - x_mean) * (y[i] - y_mean);
    }
    line.slope = xy / xx;
    for (std::size_t i = 0; i < x.size(); ++i) {
      rests[i] = y[i] - y_mean - line.slope * (x[i] - x_mean);
    }
    const double scatter = spread(rests) + 0.1;  // places are whole pixels
    for (std::size_t i = 0; i < x.size(); ++i) {
      weights[i] = std::min(1.0, 1.345 * scatter / std::abs(rests[i]));  // Huber's
    }
    line.weight = xx / (scatter * scatter);
  }
  line.slope /= motion_share;
  return line;
}

/// Returns the lag without one stretch of the edges; with all of them if `left_out` is none.
std::optional<double> SilhouetteLagEstimator::lag_without(std::size_t left_out) const {
  double sum = 0, weights = 0;
  for (const std::vector<Edge>& edges : edges_) {
    const std::size_t first = left_out < stretches ? edges.size() * left_out / stretches : 0;
    const std::size_t end = left_out < stretches ? edges.size() * (left_out + 1) / stretches : 0;
    const Line line = line_of(edges, first, end);
    sum -= line.weight * line.slope;
    weights += line.weight;
  }
  if (!(weights > 0)) return {};
  return sum / weights;
}

std::optional<SilhouetteLag> SilhouetteLagEstimator::estimate() const {
  SilhouetteLag result;
  result.edges = edges_[0].size() + edges_[1].size();
  if (result.edges < options_.min_edges) return {};
  const std::optional<double> lag = lag_without(stretches);
  if (!lag) return {};
  result.frames_late = *lag;
  double variance = 0;
  for (std::size_t k = 0; k < stretches; ++k) {
    const std::optional<double> other = lag_without(k);
    if (!other) return {};
    variance += (*other - *lag) * (*other - *lag) * (stretches - 1) / stretches;
  }
  result.sigma_frames = std::sqrt(variance);
  return result;
}

DepthOffsetEstimate sharpened(DepthOffsetEstimate by_edges,
                              const std::optional<SilhouetteLag>& by_silhouettes) {
  if (!by_edges.offset || !by_silhouettes) return by_edges;
  if (!(by_silhouettes->sigma_frames <= max_sigma_frames)) return by_edges;
  DepthOffset& offset = *by_edges.offset;
  const double difference = by_silhouettes->frames_late - offset.frames_late;
  if (!(std::abs(difference) <= max_difference_frames)) {
    by_edges.verdict = DepthOffsetVerdict::masks_disagree;
    by_edges.offset.reset();
    return by_edges;
  }
  const auto certainty = [](double sigma) { return 1 / (sigma * sigma + 1e-6); };
  const double of_edges = certainty(std::max(offset.sigma_frames, edges_sigma_frames));
  const double of_silhouettes = certainty(by_silhouettes->sigma_frames);
  const double change = difference * of_silhouettes / (of_edges + of_silhouettes);
  offset.frames_late += change;
  offset.seconds += change * by_edges.period_s;
  offset.sigma_frames = 1 / std::sqrt(of_edges + of_silhouettes);
  offset.sigma_s = offset.sigma_frames * by_edges.period_s;
  return by_edges;
}

}  // namespace dynfilter
