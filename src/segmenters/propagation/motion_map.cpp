// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace dynfilter::detail {
namespace {

// The weight of the common motion; a point right there has 1. Far from all points the common motion
// decides.
constexpr float common_weight = 0.05F;

/// Returns how many nodes cover this length and one cell on either side.
int nodes_for(float length, float cell_px) {
  return static_cast<int>(std::ceil(length / cell_px)) + 3;
}

}  // namespace

struct MotionMap::Place {
  int x, y;            // the cell
  float right, down;   // position in the cell, 0 to 1
  cv::Point2f beyond;  // how far outside the grid the point lies
};

MotionMap::MotionMap(const cv::Rect& mask, float cell_px)
    : mask_(mask),
      cell_px_(cell_px),
      origin_(static_cast<float>(mask.x) - cell_px, static_cast<float>(mask.y) - cell_px),
      sources_(nodes_for(static_cast<float>(mask.height), cell_px),
               nodes_for(static_cast<float>(mask.width), cell_px)) {
  for (int y = 0; y < sources_.rows; ++y) {
    for (int x = 0; x < sources_.cols; ++x) sources_(y, x) = node(x, y);
  }
}

cv::Point2f MotionMap::node(int x, int y) const {
  return origin_ + cell_px_ * cv::Point2f(static_cast<float>(x), static_cast<float>(y));
}

MotionMap::Place MotionMap::place_of(cv::Point2f point) const {
  const cv::Point2f last = node(sources_.cols - 1, sources_.rows - 1);
  const cv::Point2f inside(std::clamp(point.x, origin_.x, last.x),
                           std::clamp(point.y, origin_.y, last.y));
  const cv::Point2f cells = (inside - origin_) / cell_px_;
  const int x = std::min(static_cast<int>(cells.x), sources_.cols - 2);
  const int y = std::min(static_cast<int>(cells.y), sources_.rows - 2);
  return {x, y, cells.x - static_cast<float>(x), cells.y - static_cast<float>(y), point - inside};
}

cv::Point2f MotionMap::source_of(cv::Point2f point) const {
  const Place place = place_of(point);
  const cv::Point2f* above = sources_[place.y] + place.x;
  const cv::Point2f* below = sources_[place.y + 1] + place.x;
  const cv::Point2f upper = above[0] + place.right * (above[1] - above[0]);
  const cv::Point2f lower = below[0] + place.right * (below[1] - below[0]);
  return upper + place.down * (lower - upper) + place.beyond;
}

/// Returns bounds of the mask's present place, with a margin of one cell: around the nodes whose
/// source is on the mask or near it.
cv::Rect2f MotionMap::mask_bounds() const {
  const float reach = 1.5F * cell_px_;
  const cv::Rect2f source(static_cast<float>(mask_.x) - reach, static_cast<float>(mask_.y) - reach,
                          static_cast<float>(mask_.width) + 2 * reach,
                          static_cast<float>(mask_.height) + 2 * reach);
  cv::Point2f first(std::numeric_limits<float>::max(), std::numeric_limits<float>::max());
  cv::Point2f last = -first;
  for (int y = 0; y < sources_.rows; ++y) {
    for (int x = 0; x < sources_.cols; ++x) {
      if (!source.contains(sources_(y, x))) continue;
      const cv::Point2f here = node(x, y);
      first = {std::min(first.x, here.x), std::min(first.y, here.y)};
      last = {std::max(last.x, here.x), std::max(last.y, here.y)};
    }
  }
  return first.x <= last.x ? cv::Rect2f(first, last) : cv::Rect2f(origin_, cv::Size2f());
}

void MotionMap::deform(const std::vector<PointMotion>& motions, cv::Point2f common, float sigma_px,
                       const cv::Size& image) {
  // The new grid covers every place in the image that a point may have taken the mask to.
  cv::Point2f min_shift = common, max_shift = common;
  for (const PointMotion& motion : motions) {
    const cv::Point2f shift = motion.shift();
    min_shift = {std::min(min_shift.x, shift.x), std::min(min_shift.y, shift.y)};
    max_shift = {std::max(max_shift.x, shift.x), std::max(max_shift.y, shift.y)};
  }
  const cv::Rect2f bounds = mask_bounds();
  const cv::Rect2f visible(-cell_px_, -cell_px_, static_cast<float>(image.width) + 2 * cell_px_,
                           static_cast<float>(image.height) + 2 * cell_px_);
  const cv::Rect2f reach = cv::Rect2f(bounds.tl() + min_shift, bounds.br() + max_shift) & visible;
  if (reach.empty()) return shift(common);
  MotionMap next = *this;
  next.origin_ = reach.tl() - cv::Point2f(cell_px_, cell_px_);
  // A matrix of its own: a copy would share its elements.
  next.sources_ =
      cv::Mat_<cv::Point2f>(nodes_for(reach.height, cell_px_), nodes_for(reach.width, cell_px_));

  cv::Mat_<cv::Point3f> sums(next.sources_.size(), cv::Point3f(0, 0, common_weight));
  const float radius = 3 * sigma_px;
  for (const PointMotion& motion : motions) {
    const cv::Point2f deviation = motion.shift() - common;
    const auto range = [&](float at, float from, int count) {
      const float first = std::ceil((at - radius - from) / cell_px_);
      const float last = std::floor((at + radius - from) / cell_px_);
      const auto limit = static_cast<float>(count);
      return cv::Range(static_cast<int>(std::clamp(first, 0.0F, limit)),
                       static_cast<int>(std::clamp(last + 1, 0.0F, limit)));
    };
    const cv::Range columns = range(motion.to.x, next.origin_.x, sums.cols);
    const cv::Range rows = range(motion.to.y, next.origin_.y, sums.rows);
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
      const cv::Point2f moved = common + cv::Point2f(sum.x / sum.z, sum.y / sum.z);
      next.sources_(y, x) = source_of(next.node(x, y) - moved);
    }
  }
  *this = next;
}

cv::Mat MotionMap::moved(const cv::Mat& mask, const cv::Size& image, cv::Point& origin) const {
  const cv::Rect2f bounds = mask_bounds() & cv::Rect2f(cv::Point2f(), cv::Size2f(image));
  if (bounds.empty()) return {};
  origin = {static_cast<int>(bounds.x), static_cast<int>(bounds.y)};
  const cv::Point end(std::min(image.width, static_cast<int>(std::ceil(bounds.br().x)) + 1),
                      std::min(image.height, static_cast<int>(std::ceil(bounds.br().y)) + 1));
  cv::Mat result(end.y - origin.y, end.x - origin.x, CV_8UC1, cv::Scalar(0));
  for (int y = origin.y; y < end.y; ++y)
    sample_row(mask, y, cv::Range(origin.x, end.x), result.ptr(y - origin.y));
  return result;
}

/// Samples a row of pixels, cell by cell, because the source is linear in x within a cell.
void MotionMap::sample_row(const cv::Mat& mask, int y, const cv::Range& columns,
                           std::uint8_t* pixels) const {
  const cv::Point2f half(0.5F, 0.5F), corner(mask_.tl());
  const Place row = place_of({origin_.x, static_cast<float>(y)});
  const cv::Point2f below(0, row.beyond.y);
  const auto source = [&](int x) {
    const cv::Point2f upper = sources_(row.y, x), lower = sources_(row.y + 1, x);
    return upper + row.down * (lower - upper) + below - corner + half;
  };
  const auto width = static_cast<float>(mask.cols), height = static_cast<float>(mask.rows);
  for (int cell = 0; cell + 1 < sources_.cols; ++cell) {
    const float start = node(cell, 0).x;
    const cv::Range part(std::max(columns.start, static_cast<int>(std::ceil(start))),
                         std::min(columns.end, static_cast<int>(std::ceil(start + cell_px_))));
    const cv::Point2f left = source(cell), right = source(cell + 1);
    const bool misses_mask = (left.y < 0 && right.y < 0) ||
                             (left.y >= height && right.y >= height) ||
                             (left.x < 0 && right.x < 0) || (left.x >= width && right.x >= width);
    if (misses_mask) continue;
    const cv::Point2f slope = (right - left) / cell_px_;
    for (int x = part.start; x < part.end; ++x) {
      const cv::Point2f from = left + (static_cast<float>(x) - start) * slope;
      if (!(from.x >= 0 && from.y >= 0 && from.x < width && from.y < height)) continue;
      pixels[x - columns.start] =
          mask.ptr<std::uint8_t>(static_cast<int>(from.y))[static_cast<int>(from.x)];
    }
  }
}

}  // namespace dynfilter::detail
