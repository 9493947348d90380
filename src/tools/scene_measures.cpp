// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "scene_measures.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace dynfilter::tools {
namespace {

/// Grows a box by this many pixels on each side, within the image.
cv::Rect grown(const cv::Rect& box, int by_px, cv::Size size) {
  const cv::Rect larger(box.x - by_px, box.y - by_px, box.width + 2 * by_px,
                        box.height + 2 * by_px);
  return larger & cv::Rect({0, 0}, size);
}

/// Finds the depth of a body of which up to a quarter of the mask misses: the quartiles, expanded
/// by their distance and by 2 %.
std::optional<cv::Range> body_range(const cv::Mat1w& depth, const Instance& instance) {
  std::optional<cv::Range> range = depth_range(depth, instance, 0.25);
  if (!range) return range;
  const int reach = range->size() + range->end / 50;
  return cv::Range(range->start - reach, range->end + reach);
}

}  // namespace

cv::Mat1b persons_of(const Segmentation& segmentation, cv::Size size) {
  cv::Mat1b mask(size, std::uint8_t{0});
  for (const Instance& instance : segmentation.instances) {
    if (instance.class_id != 0 || instance.mask.empty()) continue;
    const cv::Rect place(instance.mask_origin, instance.mask.size());
    const cv::Rect seen = place & cv::Rect({0, 0}, size);
    if (seen.empty()) continue;
    mask(seen).setTo(255, instance.mask(seen - instance.mask_origin));
  }
  return mask;
}

std::optional<cv::Range> depth_range(const cv::Mat1w& depth, const Instance& instance,
                                     double share) {
  std::vector<int> values;
  for (int y = 0; y < instance.mask.rows; ++y) {
    for (int x = 0; x < instance.mask.cols; ++x) {
      const cv::Point pixel = cv::Point(x, y) + instance.mask_origin;
      if (instance.mask.at<std::uint8_t>(y, x) == 0 ||
          !cv::Rect({0, 0}, depth.size()).contains(pixel)) {
        continue;
      }
      if (depth(pixel) > 0) values.push_back(depth(pixel));
    }
  }
  if (values.size() < 500) return std::nullopt;
  std::sort(values.begin(), values.end());
  const auto skipped = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  return cv::Range(values[skipped], values[values.size() - 1 - skipped]);
}

void DepthLateness::add(const cv::Mat1w& depth, const Segmentation& segmentation) {
  window_.push_back({depth, persons_of(segmentation, depth.size()), segmentation});
  if (window_.size() > 2 * reach + 1) window_.pop_front();
  if (window_.size() == 2 * reach + 1) compare();
}

/// Adds the overlaps (intersection over union) of the middle frame's depth silhouette with all
/// masks. Pixels without depth count for neither.
void DepthLateness::compare() {
  const Frame& middle = window_[reach];
  const cv::Size size = middle.depth.size();
  cv::Mat1b area(size, std::uint8_t{0}), silhouette(size, std::uint8_t{0});
  for (const Instance& instance : middle.segmentation.instances) {
    if (instance.class_id != 0) continue;
    const std::optional<cv::Range> range = body_range(middle.depth, instance);
    if (!range) continue;
    const cv::Rect place = grown(instance.box, size.width / 16, size);
    area(place).setTo(255);
    const cv::Mat body =
        (middle.depth(place) >= range->start) & (middle.depth(place) <= range->end);
    silhouette(place).setTo(255, body);
  }
  area.setTo(0, middle.depth == 0);
  if (cv::countNonZero(silhouette) == 0) return;
  for (std::size_t k = 0; k < overlap_.size(); ++k) {
    const cv::Mat persons = window_[k].persons & area;
    overlap_[k] += static_cast<double>(cv::countNonZero(persons & silhouette)) /
                   std::max(cv::countNonZero(persons | silhouette), 1);
  }
  ++compared_;
}

std::optional<double> DepthLateness::frames() const {
  const auto best = std::max_element(overlap_.begin(), overlap_.end());
  const auto worst = std::min_element(overlap_.begin(), overlap_.end());
  const auto at = static_cast<int>(best - overlap_.begin());
  if (compared_ < 2 || *best - *worst < 0.02 * compared_) return std::nullopt;
  if (at == 0 || at == 2 * reach) return reach - at;
  // The overlap falls about linearly with the shift, on both sides of its peak.
  const double before = *best - *(best - 1);
  const double after = *best - *(best + 1);
  return reach - at - 0.5 * (before - after) / std::max({before, after, 1e-9});
}

void StaticAtPersonsDepth::add(const cv::Mat1w& depth, double units_per_metre,
                               const Segmentation& segmentation,
                               const std::vector<cv::KeyPoint>& keypoints) {
  struct Person {
    cv::Rect box;
    cv::Range range;
  };
  std::vector<Person> persons;
  for (const Instance& instance : segmentation.instances) {
    if (instance.class_id != 0) continue;
    const std::optional<cv::Range> range = depth_range(depth, instance);
    if (range) persons.push_back({instance.box, *range});
  }
  cv::Mat1f distance;
  cv::distanceTransform(~persons_of(segmentation, depth.size()), distance, cv::DIST_L2,
                        cv::DIST_MASK_PRECISE);
  ++frames_;
  for (const cv::KeyPoint& keypoint : keypoints) {
    const cv::Point pixel(static_cast<int>(std::floor(keypoint.pt.x + 0.5F)),
                          static_cast<int>(std::floor(keypoint.pt.y + 0.5F)));
    if (!cv::Rect({0, 0}, depth.size()).contains(pixel)) continue;
    bool in_box = false;
    double outside_m = std::numeric_limits<double>::infinity();  // of the nearest range
    for (const Person& person : persons) {
      if (!person.box.contains(pixel)) continue;
      in_box = true;
      const int here = depth(pixel);
      if (here == 0) continue;
      const int outside = std::max({person.range.start - here, here - person.range.end, 0});
      outside_m = std::min(outside_m, outside / units_per_metre);
    }
    for (std::size_t i = 0; i < rims_px.size(); ++i) {
      if (distance(pixel) <= static_cast<float>(rims_px[i])) continue;
      ++counts_[i].all;
      counts_[i].in_boxes += in_box ? 1 : 0;
      for (std::size_t k = 0; k < reaches_m.size(); ++k) {
        counts_[i].at_depth[k] += outside_m <= reaches_m[k] ? 1 : 0;
      }
    }
  }
}

std::string StaticAtPersonsDepth::text() const {
  std::string text;
  for (std::size_t i = 0; i < rims_px.size(); ++i) {
    const Counts& counts = counts_[i];
    const auto a_frame = [&](std::uint64_t count) {
      return static_cast<double>(count) / static_cast<double>(std::max<std::uint64_t>(frames_, 1));
    };
    const auto share = [&](std::uint64_t count) {
      return 100.0 * static_cast<double>(count) /
             static_cast<double>(std::max<std::uint64_t>(counts.in_boxes, 1));
    };
    char line[128];
    std::snprintf(line, sizeof line,
                  "  beyond %2d px of the masks              %7.1f%7.1f%7.1f%7.1f%7.1f%7.1f\n",
                  rims_px[i], a_frame(counts.all), a_frame(counts.in_boxes),
                  a_frame(counts.at_depth[0]), a_frame(counts.at_depth[1]),
                  share(counts.at_depth[0]), share(counts.at_depth[1]));
    text += line;
  }
  return text;
}

}  // namespace dynfilter::tools
