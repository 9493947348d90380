// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "point_flow.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "dynfilter/detail/grey_image.hpp"

namespace dynfilter::detail {
namespace {

/// Width to which images are reduced before points are tracked, about.
constexpr int work_width_px = 320;
/// Spacing of tracked points in the reduced image, on and around the known instances: one point per
/// square of this side. Elsewhere the squares are twice as wide, for instances not yet reported.
constexpr int point_spacing_px = 8;
/// Largest distance, pixels of the reduced image, between a point and where tracking it backwards
/// returns it to.
constexpr double max_forward_backward_px = 1.5;
// In pixels of the reduced image. Larger windows reach over the edge of a limb; more iterations
// change nothing that the check does not catch.
const cv::Size window(9, 9);
constexpr int levels = 3;
constexpr double min_eigenvalue = 1e-4;
const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 5, 0.03);

void follow(const std::vector<cv::Mat>& from, const std::vector<cv::Mat>& to,
            const std::vector<cv::Point2f>& points, std::vector<cv::Point2f>& found,
            std::vector<std::uint8_t>& is_found) {
  std::vector<float> errors;
  cv::calcOpticalFlowPyrLK(from, to, points, found, is_found, errors, window, levels, criteria, 0,
                           min_eigenvalue);
}

/// Adds the strongest corner in a part of the image, unless there is no texture.
void add_corner(const cv::Mat& strength, const cv::Rect& part, std::vector<cv::Point2f>& points) {
  double strongest = 0;
  cv::Point place;
  cv::minMaxLoc(strength(part), nullptr, &strongest, nullptr, &place);
  if (strongest >= min_eigenvalue) points.emplace_back(place + part.tl());
}

}  // namespace

std::vector<PointMotion> PointFlow::track(const cv::Mat& image) {
  std::swap(pyramid_, last_pyramid_);
  build_pyramid(image);
  std::vector<PointMotion> motions;
  if (pyramid_.empty() || last_pyramid_.empty() || points_.empty()) return motions;
  std::vector<cv::Point2f> forward, backward;
  std::vector<std::uint8_t> found_forward, found_backward;
  follow(last_pyramid_, pyramid_, points_, forward, found_forward);
  follow(pyramid_, last_pyramid_, forward, backward, found_backward);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (found_forward[i] == 0 || found_backward[i] == 0 ||
        !(cv::norm(backward[i] - points_[i]) <= max_forward_backward_px))
      continue;
    motions.push_back({to_full(points_[i]), to_full(forward[i])});
  }
  return motions;
}

void PointFlow::build_pyramid(const cv::Mat& image) {
  pyramid_.clear();  // its memory must not be shared with the last one
  work_.release();
  if (image.empty()) return;
  const int width = std::min(image.cols, work_width_px);
  const double height = std::round(static_cast<double>(image.rows) * width / image.cols);
  const cv::Size size(width, std::max(1, static_cast<int>(height)));
  // In an image this small, motion cannot be told from the border's effects.
  if (size.width < 2 * window.width || size.height < 2 * window.height) return;
  scale_ = {static_cast<float>(image.cols) / static_cast<float>(size.width),
            static_cast<float>(image.rows) / static_cast<float>(size.height)};
  cv::Mat memory;
  const cv::Mat grey = grey_of(image, memory);
  if (size == grey.size()) {
    work_ = grey.clone();
  } else {
    cv::resize(grey, work_, size, 0, 0, cv::INTER_AREA);
  }
  cv::buildOpticalFlowPyramid(work_, pyramid_, window, levels);
}

void PointFlow::choose_points(const std::vector<cv::Rect>& dense) {
  points_.clear();
  if (work_.empty()) return;
  cv::Mat strength;
  cv::cornerMinEigenVal(work_, strength, 3);
  const cv::Rect whole({}, work_.size());
  const auto is_dense = [&](const cv::Rect& part) {
    const cv::Rect2f full(
        static_cast<float>(part.x) * scale_.x, static_cast<float>(part.y) * scale_.y,
        static_cast<float>(part.width) * scale_.x, static_cast<float>(part.height) * scale_.y);
    return std::any_of(dense.begin(), dense.end(), [&](const cv::Rect& rectangle) {
      return !(cv::Rect2f(rectangle) & full).empty();
    });
  };
  const int fine = point_spacing_px, coarse = 2 * fine;
  for (int y = 0; y < work_.rows; y += coarse) {
    for (int x = 0; x < work_.cols; x += coarse) {
      const cv::Rect part = cv::Rect(x, y, coarse, coarse) & whole;
      if (!is_dense(part)) {
        add_corner(strength, part, points_);
        continue;
      }
      for (const cv::Point corner :
           {cv::Point(x, y), {x + fine, y}, {x, y + fine}, {x + fine, y + fine}}) {
        const cv::Rect quarter = cv::Rect(corner, cv::Size(fine, fine)) & whole;
        if (!quarter.empty()) add_corner(strength, quarter, points_);
      }
    }
  }
}

void PointFlow::forget() noexcept {
  work_.release();
  pyramid_.clear();
  last_pyramid_.clear();
  points_.clear();
}

/// Scales a point; in either image, a pixel's centre lies half a pixel from its corner.
cv::Point2f PointFlow::to_full(cv::Point2f point) const {
  return {(point.x + 0.5F) * scale_.x - 0.5F, (point.y + 0.5F) * scale_.y - 0.5F};
}

}  // namespace dynfilter::detail
