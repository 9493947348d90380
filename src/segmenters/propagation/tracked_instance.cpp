// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "tracked_instance.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <iterator>

#include "constants.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter::detail {
namespace {

// A side of the box follows the mask's side if that is this near: pixels at a width of 640, or a
// share of the box.
constexpr double side_reach_px = 8;
constexpr double side_reach_share = 0.1;

// A point belongs to the background if it moves this much nearer to the background's motion than to
// the object's, as a share of the distances, and if the two motions differ at all: pixels at a
// width of 640.
constexpr double share_of_distance = 0.75;
constexpr double min_difference_px = 2;

// A mask that fills less of its box says little about the object's motion.
constexpr double min_mask_share = 0.1;

// No image is wider (see validate), so anything that moves this far in a frame has left it. The sum
// over the history still fits an int.
constexpr double max_shift_px = max_image_side_px;
constexpr double max_velocity_px_s = 1e9;

/// Limits a vector to real motion: NaN and large numbers arise from times that nearly coincide and
/// from boxes that may lie anywhere.
cv::Point2d limited(cv::Point2d vector, double limit) {
  const auto coordinate = [&](double value) {
    return std::isnan(value) ? 0.0 : std::clamp(value, -limit, limit);
  };
  return {coordinate(vector.x), coordinate(vector.y)};
}

/// Returns the median of each coordinate.
cv::Point2f median_shift(const std::vector<PointMotion>& motions) {
  std::vector<float> x, y;
  for (const PointMotion& motion : motions) {
    x.push_back(motion.shift().x);
    y.push_back(motion.shift().y);
  }
  return {quantile_of(x), quantile_of(y)};
}

/// Returns the mean of the motions around a point, with Gaussian weights of their distance;
/// std::nullopt if all are far away.
std::optional<cv::Point2f> mean_motion(const std::vector<PointMotion>& motions, cv::Point2f centre,
                                       double sigma_px) {
  cv::Point2d sum(0, 0);
  double weights = 0;
  for (const PointMotion& motion : motions) {
    const cv::Point2d away = motion.from - centre;
    const double exponent = away.dot(away) / (2 * sigma_px * sigma_px);
    if (exponent > 4.5) continue;
    const double weight = std::exp(-exponent);
    sum += weight * cv::Point2d(motion.shift());
    weights += weight;
  }
  if (weights < 0.05) return {};
  return cv::Point2f(sum / weights);
}

cv::Point2d centre(const cv::Rect2d& box) { return (box.tl() + box.br()) / 2; }

/// Rounds the box to pixels and clips it to the image; empty if it lies outside.
cv::Rect pixels_of(const cv::Rect2d& box, const cv::Size& image) {
  const auto along = [](double first, double last, int limit) {
    const auto pixel = [&](double side) {
      return static_cast<int>(std::lround(std::clamp(side, 0.0, static_cast<double>(limit))));
    };
    return cv::Range(pixel(first), pixel(last));
  };
  const cv::Range columns = along(box.x, box.x + box.width, image.width);
  const cv::Range rows = along(box.y, box.y + box.height, image.height);
  if (columns.size() <= 0 || rows.size() <= 0) return {};
  return {columns.start, rows.start, columns.size(), rows.size()};
}

}  // namespace

TrackedInstance::TrackedInstance(const Instance& instance, double timestamp_s,
                                 const cv::Size& image, float cell_px)
    : source_(instance),
      timestamp_s_(timestamp_s),
      image_(image),
      map_({}, cell_px),
      box_(instance.box),
      shifted_box_(instance.box) {
  source_.mask = instance.mask.clone();
  const cv::Rect visible = clip({instance.mask_origin, instance.mask.size()}, image);
  if (!visible.empty()) {
    const cv::Point offset = wrapping_difference(visible.tl(), instance.mask_origin);
    const cv::Mat part = source_.mask(cv::Rect(offset, visible.size()));
    const cv::Rect bounds = bounding_box(part);
    mask_ = part(bounds);
    mask_origin_ = visible.tl() + bounds.tl();
  }
  if (!mask_.empty()) map_ = MotionMap({mask_origin_, mask_.size()}, cell_px);
  moved_mask_ = mask_;
  moved_origin_ = mask_origin_;
}

void TrackedInstance::succeed(const TrackedInstance& earlier) {
  velocity_px_s_ = earlier.velocity_px_s_;
  const double passed_s = timestamp_s_ - earlier.timestamp_s_;
  if (!velocity_px_s_ && passed_s > 0) {
    const cv::Point2d moved = centre(box_) - centre(cv::Rect2d(earlier.source_.box));
    velocity_px_s_ = limited(moved / passed_s, max_velocity_px_s);
  }
}

/// Tells whether the mask has the object at a pixel and `reach` pixels away on all sides, within
/// the image.
bool TrackedInstance::is_inside(cv::Point pixel, int reach) const {
  const auto covers = [&](cv::Point at) {
    const cv::Point in_mask = at - mask_origin_;
    return cv::Rect({}, mask_.size()).contains(in_mask) &&
           mask_.ptr<std::uint8_t>(in_mask.y)[in_mask.x] != 0;
  };
  if (!covers(pixel)) return false;
  for (int y = -1; reach > 0 && y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      const cv::Point at = pixel + reach * cv::Point(x, y);
      if (cv::Rect({}, image_).contains(at) && !covers(at)) return false;
    }
  }
  return true;
}

/// Returns the motions of the points on the mask. Some points near its edge belong to the
/// background: they move more like the points outside than like those well inside.
std::vector<PointMotion> TrackedInstance::motions_on_mask(const FlowStep& step) const {
  if (mask_.empty()) return {};
  const int edge_px = static_cast<int>(std::lround(propagation::edge_px * pixel_scale(image_)));
  std::vector<PointMotion> inside, edge, outside;
  for (const PointMotion& motion : step.motions) {
    const cv::Point2f source = map_.source_of(motion.from) + cv::Point2f(0.5F, 0.5F);
    const cv::Point pixel(cvFloor(source.x), cvFloor(source.y));
    auto& part = is_inside(pixel, edge_px) ? inside : is_inside(pixel, 0) ? edge : outside;
    part.push_back(motion);
  }
  const double sigma_px = propagation::field_sigma_px * pixel_scale(image_);
  const double min_px = min_difference_px * pixel_scale(image_);
  const auto is_background = [&](const PointMotion& motion) {
    const auto background = mean_motion(outside, motion.from, sigma_px);
    auto object = mean_motion(inside, motion.from, sigma_px);
    if (!object && velocity_px_s_) object = cv::Point2f(*velocity_px_s_ * step.duration_s);
    if (!object || !background || cv::norm(*object - *background) < min_px) return false;
    return cv::norm(motion.shift() - *background) <
           share_of_distance * cv::norm(motion.shift() - *object);
  };
  std::vector<PointMotion> motions = inside;
  std::remove_copy_if(edge.begin(), edge.end(), std::back_inserter(motions), is_background);
  return motions;
}

bool TrackedInstance::fills_box() const {
  return static_cast<double>(mask_.total()) >= min_mask_share * cv::Rect2d(source_.box).area() &&
         !mask_.empty();
}

/// Returns the motions in the middle of the box, which an object fills however it moves arms and
/// legs.
std::vector<PointMotion> TrackedInstance::motions_in_box(
    const std::vector<PointMotion>& all) const {
  const cv::Rect2d visible(pixels_of(box_, image_));
  const cv::Rect2d middle(visible.x + visible.width / 4, visible.y + visible.height / 5,
                          visible.width / 2, visible.height * 3 / 5);
  std::vector<PointMotion> in_box;
  std::copy_if(all.begin(), all.end(), std::back_inserter(in_box), [&](const PointMotion& motion) {
    return middle.contains(cv::Point2d(motion.from));
  });
  return in_box;
}

void TrackedInstance::advance(const FlowStep& step, std::size_t history_frames) {
  if (!is_moved_) {
    is_moved_ = true;
    mask_ = mask_.clone();  // pixels outside the image and around the object are no longer needed
    source_.mask.release();
  }
  std::vector<PointMotion> motions = motions_on_mask(step);
  const bool as_one = motions.size() < propagation::min_points && !fills_box();
  if (as_one) motions = motions_in_box(step.motions);
  if (!as_one && motions.size() >= propagation::min_points && has_gone_out(motions, step)) {
    motions.clear();
  }
  counts_.points = motions.size();
  if (motions.size() >= propagation::min_points) {
    move_by_flow(motions, as_one, step.duration_s);
    ++counts_.by_flow;
  } else if (velocity_px_s_) {
    shift(limited(*velocity_px_s_ * step.duration_s, max_shift_px));
    ++counts_.by_velocity;
  } else {
    ++counts_.left;
  }
  past_.push_back({step.timestamp_s, box_});
  if (past_.size() > history_frames) past_.pop_front();
}

/// Tells whether the object has left through the border of the image that its mask was crossing.
/// The points on the mask are then the background's: the rest of the object is too small for points
/// of its own, and its mask would stay at the border forever.
bool TrackedInstance::has_gone_out(const std::vector<PointMotion>& on_mask,
                                   const FlowStep& step) const {
  if (!velocity_px_s_) return false;
  const cv::Rect place = region();
  const cv::Point2d expected = *velocity_px_s_ * step.duration_s;
  const bool crosses_border = (place.x <= 1 && expected.x < 0) ||
                              (place.y <= 1 && expected.y < 0) ||
                              (place.br().x + 1 >= image_.width && expected.x > 0) ||
                              (place.br().y + 1 >= image_.height && expected.y > 0);
  if (!crosses_border) return false;
  const cv::Point2d background(median_shift(step.motions)), now(median_shift(on_mask));
  return cv::norm(expected - background) > min_difference_px * pixel_scale(image_) &&
         cv::norm(now - background) < share_of_distance * cv::norm(now - expected);
}

void TrackedInstance::move_by_flow(const std::vector<PointMotion>& motions, bool as_one,
                                   double duration_s) {
  const cv::Point2f common = median_shift(motions);
  if (as_one) {
    map_.shift(common);
  } else {
    const double sigma_px = propagation::field_sigma_px * pixel_scale(image_);
    map_.deform(motions, common, static_cast<float>(sigma_px), image_);
  }
  box_ += cv::Point2d(common);
  shifted_box_ += cv::Point2d(common);
  const cv::Point2d now = limited(cv::Point2d(common) / duration_s, max_velocity_px_s);
  velocity_px_s_ = velocity_px_s_ ? (*velocity_px_s_ + now) / 2 : now;
}

void TrackedInstance::shift(cv::Point2d by) {
  map_.shift(cv::Point2f(by));
  box_ += by;
  shifted_box_ += by;
}

void TrackedInstance::settle() {
  if (!is_moved_) return;
  if (!mask_.empty()) {
    cv::Point origin;
    const cv::Mat mask = map_.moved(mask_, image_, origin);
    const cv::Rect bounds = bounding_box(mask);
    moved_mask_ = mask(bounds).clone();
    moved_origin_ = origin + bounds.tl();
    fit_box();
  }
  if (!past_.empty()) past_.back().box = box_;
}

/// Moves the sides of the box that the mask reached together with the mask's sides.
void TrackedInstance::fit_box() {
  box_ = shifted_box_;
  if (moved_mask_.empty()) return;
  const cv::Rect2d box(source_.box), mask(cv::Rect(mask_origin_, mask_.size())),
      now(cv::Rect(moved_origin_, moved_mask_.size()));
  const auto fitted = [&](double box_side, double mask_side, double now_side, double shifted_side,
                          double length) {
    const double reach = std::max(side_reach_px * pixel_scale(image_), side_reach_share * length);
    const double beyond = box_side - mask_side;
    return std::abs(beyond) <= reach ? now_side + beyond : shifted_side;
  };
  const cv::Point2d first(fitted(box.x, mask.x, now.x, shifted_box_.x, box.width),
                          fitted(box.y, mask.y, now.y, shifted_box_.y, box.height));
  const cv::Point2d last(
      fitted(box.br().x, mask.br().x, now.br().x, shifted_box_.br().x, box.width),
      fitted(box.br().y, mask.br().y, now.br().y, shifted_box_.br().y, box.height));
  box_ = {first.x, first.y, std::max(0.0, last.x - first.x), std::max(0.0, last.y - first.y)};
}

Instance TrackedInstance::instance() const {
  Instance moved = source_;
  if (!is_moved_) {
    moved.mask = source_.mask.clone();  // the caller may modify it
    return moved;
  }
  moved.box = pixels_of(box_, image_);
  moved.mask = moved_mask_;
  moved.mask_origin = moved_origin_;
  return moved;
}

bool TrackedInstance::has_left_image() const {
  if (!is_moved_) return false;
  return mask_.empty() ? pixels_of(box_, image_).empty() : moved_mask_.empty();
}

cv::Rect2d TrackedInstance::box_at(double time_s) const {
  const auto found = std::find_if(past_.begin(), past_.end(),
                                  [&](const PastBox& past) { return past.timestamp_s == time_s; });
  return found == past_.end() ? box_ : found->box;
}

cv::Rect TrackedInstance::region() const {
  return pixels_of(box_ | cv::Rect2d(cv::Rect(moved_origin_, moved_mask_.size())), image_);
}

}  // namespace dynfilter::detail
