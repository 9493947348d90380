// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "dynfilter/detail/pixel_scale.hpp"

namespace dynfilter::detail {
namespace {

constexpr double node_distance_px = 16;  // at a width of 640
// The weight of the common motion; a point right there has 1. Far from all points the common motion
// decides.
constexpr float common_weight = 0.05F;

int nodes_for(int length, int cell_px) { return (length + cell_px - 1) / cell_px + 2; }

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

}  // namespace dynfilter::detail
