// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "tracked_instance.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/segmentation.hpp"

// Constants were chosen by the overlap of moved masks with true ones. Pixels are those at a width
// of 640.
namespace dynfilter::detail {
namespace {

constexpr double node_distance_px = 16;  // of the map of motion
// The weight of the common motion; a point right there has 1. Far from all points the common motion
// decides.
constexpr float common_weight = 0.05F;
/// Standard deviation of the Gaussian by which a point's motion spreads to the pixels around it.
/// Small: limbs move independently; large: an instance moves as one piece.
constexpr double field_sigma_px = 14;
/// Width of a mask's edge. Points on the edge are ignored if they move as the background beside it
/// does: they would stretch the mask behind the object.
constexpr double edge_px = 8;
/// @{
/// A point belongs to the background if its motion is this much nearer to the background's than to
/// the object's, as a share of the distances, and if the two motions differ at all.
constexpr double share_of_distance = 0.75, min_difference_px = 2;
/// @}
constexpr std::size_t min_points = 3;  // on an instance, to move it by their flow
// No image is wider (see validate), so anything that moves this far in a frame has left it.
constexpr double max_shift_px = max_image_side_px;

int nodes_for(int length, int cell_px) { return (length + cell_px - 1) / cell_px + 2; }

/// Returns the shift of a frame, limited: velocities are large after times that nearly coincide.
cv::Point2d shift_of(cv::Point2d velocity_px_s, double duration_s) {
  const cv::Point2d shift = velocity_px_s * duration_s;
  return {std::clamp(shift.x, -max_shift_px, max_shift_px),
          std::clamp(shift.y, -max_shift_px, max_shift_px)};
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
  if (columns.start >= columns.end || rows.start >= rows.end) return {};
  return {columns.start, rows.start, columns.size(), rows.size()};
}

}  // namespace

MotionMap::MotionMap(const cv::Size& image)
    : image_(image),
      cell_px_(std::max(4, cvRound(node_distance_px * pixel_scale(image)))),
      displacements_(nodes_for(image.height, cell_px_), nodes_for(image.width, cell_px_),
                     cv::Point2f()) {}

cv::Point2f MotionMap::displacement_at(cv::Point2f point) const {
  const auto along = [&](float distance_px, int count) {
    return std::clamp(distance_px / static_cast<float>(cell_px_), 0.0F,
                      static_cast<float>(count - 1));
  };
  const cv::Point2f cells(along(point.x - origin_.x, displacements_.cols),
                          along(point.y - origin_.y, displacements_.rows));
  const int x = std::min(static_cast<int>(cells.x), displacements_.cols - 2);
  const int y = std::min(static_cast<int>(cells.y), displacements_.rows - 2);
  const float right = cells.x - static_cast<float>(x), down = cells.y - static_cast<float>(y);
  const cv::Point2f* above = displacements_[y] + x;
  const cv::Point2f* below = displacements_[y + 1] + x;
  const cv::Point2f upper = above[0] + right * (above[1] - above[0]);
  const cv::Point2f lower = below[0] + right * (below[1] - below[0]);
  return upper + down * (lower - upper);
}

void MotionMap::move(const std::vector<PointMotion>& motions, cv::Point2f common, float sigma_px) {
  const auto cell = static_cast<float>(cell_px_);
  MotionMap next(image_);
  next.origin_ = origin_ + common;
  next.origin_ -=
      cell * cv::Point2f(std::ceil(next.origin_.x / cell), std::ceil(next.origin_.y / cell));
  cv::Mat_<cv::Point3f> sums(displacements_.size(), cv::Point3f(0, 0, common_weight));
  const auto range = [&](float at, int count) {
    const auto limit = static_cast<float>(count);
    const float first = std::ceil((at - 3 * sigma_px) / cell);
    const float end = std::floor((at + 3 * sigma_px) / cell) + 1;
    return cv::Range(static_cast<int>(std::clamp(first, 0.0F, limit)),
                     static_cast<int>(std::clamp(end, 0.0F, limit)));
  };
  for (const PointMotion& motion : motions) {
    const cv::Point2f deviation = motion.shift() - common;
    const cv::Range columns = range(motion.to.x - next.origin_.x, sums.cols);
    const cv::Range rows = range(motion.to.y - next.origin_.y, sums.rows);
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = columns.start; x < columns.end; ++x) {
        const cv::Point2f away = next.node(x, y) - motion.to;
        const float weight = std::exp(-away.dot(away) / (2 * sigma_px * sigma_px));
        sums(y, x) += {weight * deviation.x, weight * deviation.y, weight};
      }
    }
  }
  for (int y = 0; y < sums.rows; ++y) {
    for (int x = 0; x < sums.cols; ++x) {
      const cv::Point3f& sum = sums(y, x);
      const cv::Point2f motion = common + cv::Point2f(sum.x / sum.z, sum.y / sum.z);
      next.displacements_(y, x) = displacement_at(next.node(x, y) - motion) - motion;
    }
  }
  *this = next;
}

cv::Mat1b MotionMap::moved(const cv::Mat& mask, cv::Point origin) const {
  cv::Mat1b result(image_, std::uint8_t{0});
  const auto width = static_cast<float>(mask.cols), height = static_cast<float>(mask.rows);
  const auto cell = static_cast<float>(cell_px_);
  const cv::Point2f to_pixel = cv::Point2f(0.5F, 0.5F) - cv::Point2f(origin);
  const auto source = [&](int x, int y) { return node(x, y) + displacements_(y, x) + to_pixel; };
  for (int y = 0; y + 1 < displacements_.rows; ++y) {
    for (int x = 0; x + 1 < displacements_.cols; ++x) {
      const cv::Point2f a = source(x, y), b = source(x + 1, y);
      const cv::Point2f c = source(x, y + 1), d = source(x + 1, y + 1);
      const auto [left, right] = std::minmax({a.x, b.x, c.x, d.x});
      const auto [top, bottom] = std::minmax({a.y, b.y, c.y, d.y});
      if (!(right >= 0 && bottom >= 0 && left < width && top < height)) continue;
      const cv::Point2f first = node(x, y);
      const cv::Rect square(cvCeil(first.x), cvCeil(first.y), cell_px_, cell_px_);
      const cv::Rect part = square & cv::Rect({}, image_);
      for (int py = part.y; py < part.br().y; ++py) {
        const float down = (static_cast<float>(py) - first.y) / cell;
        const cv::Point2f start = a + down * (c - a);
        const cv::Point2f slope = (b + down * (d - b) - start) / cell;
        for (int px = part.x; px < part.br().x; ++px) {
          const cv::Point2f from = start + (static_cast<float>(px) - first.x) * slope;
          if (!(from.x >= 0 && from.y >= 0 && from.x < width && from.y < height)) continue;
          result(py, px) =
              mask.ptr<std::uint8_t>(static_cast<int>(from.y))[static_cast<int>(from.x)];
        }
      }
    }
  }
  return result;
}

TrackedInstance::TrackedInstance(const Instance& instance, double timestamp_s,
                                 const cv::Size& image)
    : source_(instance),
      timestamp_s_(timestamp_s),
      image_(image),
      map_(image),
      box_(place_of(instance)) {
  source_.mask = instance.mask.clone();
  const cv::Rect visible = clip({instance.mask_origin, instance.mask.size()}, image);
  if (!visible.empty()) {
    const cv::Point offset = wrapping_difference(visible.tl(), instance.mask_origin);
    const cv::Mat part = source_.mask(cv::Rect(offset, visible.size()));
    const cv::Rect bounds = bounding_box(part);
    mask_ = part(bounds);
    mask_origin_ = visible.tl() + bounds.tl();
  }
  moved_mask_ = mask_;
  moved_origin_ = mask_origin_;
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
  const int edge = cvRound(edge_px * pixel_scale(image_));
  std::vector<PointMotion> inside, at_edge, outside;
  for (const PointMotion& motion : step.motions) {
    const cv::Point2f source = map_.source_of(motion.from) + cv::Point2f(0.5F, 0.5F);
    const cv::Point pixel(cvFloor(source.x), cvFloor(source.y));
    auto& part = is_inside(pixel, edge) ? inside : is_inside(pixel, 0) ? at_edge : outside;
    part.push_back(motion);
  }
  const double sigma_px = field_sigma_px * pixel_scale(image_);
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
  std::remove_copy_if(at_edge.begin(), at_edge.end(), std::back_inserter(motions), is_background);
  return motions;
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

void TrackedInstance::advance(const FlowStep& step) {
  const bool has_mask = !mask_.empty();
  std::vector<PointMotion> motions =
      has_mask ? motions_on_mask(step) : motions_in_box(step.motions);
  const bool is_followed =
      motions.size() >= min_points && !(has_mask && has_gone_out(motions, step));
  cv::Point2d common;
  if (is_followed) {
    common = cv::Point2d(median_shift(motions));
    const cv::Point2d now = common / step.duration_s;
    velocity_px_s_ = velocity_px_s_ ? (*velocity_px_s_ + now) / 2 : now;
  } else {
    motions.clear();
    if (velocity_px_s_) common = shift_of(*velocity_px_s_, step.duration_s);
  }
  if (has_mask) {
    const double sigma_px = field_sigma_px * pixel_scale(image_);
    map_.move(motions, cv::Point2f(common), static_cast<float>(sigma_px));
  }
  box_ += common;
  past_.emplace_back(step.timestamp_s, box_);
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

void TrackedInstance::settle() {
  if (past_.empty() || mask_.empty()) return;
  const cv::Mat mask = map_.moved(mask_, mask_origin_);
  const cv::Rect now = bounding_box(mask);
  moved_mask_ = mask(now).clone();
  moved_origin_ = now.tl();
  if (now.empty()) return;
  // The sides of the box keep their distances from those of the mask.
  const cv::Rect2d given(place_of(source_)), mask_then(cv::Rect(mask_origin_, mask_.size()));
  const cv::Point2d first = cv::Point2d(now.tl()) + given.tl() - mask_then.tl();
  const cv::Point2d last = cv::Point2d(now.br()) + given.br() - mask_then.br();
  box_ = {first.x, first.y, std::max(0.0, last.x - first.x), std::max(0.0, last.y - first.y)};
  past_.back().second = box_;
}

Instance TrackedInstance::instance() const {
  Instance moved = source_;
  if (past_.empty()) {
    moved.mask = source_.mask.clone();  // the caller may modify it
    return moved;
  }
  moved.box = source_.box.empty() ? cv::Rect() : pixels_of(box_, image_);
  moved.mask = moved_mask_;
  moved.mask_origin = moved_origin_;
  return moved;
}

bool TrackedInstance::has_left_image() const {
  if (past_.empty()) return false;
  return mask_.empty() ? pixels_of(box_, image_).empty() : moved_mask_.empty();
}

cv::Rect2d TrackedInstance::box_at(double time_s) const {
  const auto found = std::find_if(past_.begin(), past_.end(),
                                  [&](const auto& past) { return past.first == time_s; });
  return found == past_.end() ? box_ : found->second;
}

cv::Rect TrackedInstance::region() const {
  return pixels_of(box_ | cv::Rect2d(cv::Rect(moved_origin_, moved_mask_.size())), image_);
}

}  // namespace dynfilter::detail
