// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// PlaceSummary: features and boxes against the image, boxes against their masks.

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "diagnosis/input_summary.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/detail/rectangles.hpp"

namespace dynfilter::detail {
namespace {

cv::Rect2d around(const Instance& instance) {
  return cv::boundingRect(instance.mask) + instance.mask_origin;
}

std::string percent(double share) { return fixed_decimals(100 * share, 0) + " %"; }

}  // namespace

void PlaceSummary::add_features(FeaturesView features, const cv::Size& image) {
  constexpr std::size_t enough = 20;  // fewer may all lie in one place
  if (features.size() < enough || image.empty()) return;
  const auto width = static_cast<float>(image.width), height = static_cast<float>(image.height);
  float farthest = 0;
  double out = 0, turned_out = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const auto [x, y] = features[i];
    farthest = std::max({farthest, x / width, y / height});
    out += x < width && y < height ? 0 : 1;
    turned_out += y < width && x < height ? 0 : 1;
  }
  reach.add(double{farthest});
  outside.add(out / static_cast<double>(features.size()));
  turned.add(turned_out / static_cast<double>(features.size()));
}

void PlaceSummary::add_boxes(const Segmentation& masks, const cv::Size& image) {
  constexpr double poor = 0.4, good = 0.7;  // overlaps; recordings have 0.6 and more
  for (const Instance& one : masks.instances) {
    const bool has_or_had_mask = !one.mask.empty() || !one.image_size.empty();
    if (one.box.empty() && has_or_had_mask) continue;  // unknown, or nobody
    ++boxes;
    const cv::Rect2d box = one.box, turned_box(box.y, box.x, box.height, box.width);
    if (box.area() <= 1) {
      ++readings[0];
    } else if (one.mask.empty()) {
      const cv::Rect2d whole({}, cv::Size2d(image));
      const bool is_in = image.empty() || (box & whole).area() > 0.9 * box.area();
      readings[1] += !is_in && (turned_box & whole) == turned_box ? 1 : 0;
      readings[6] += !is_in && (box & whole).empty() ? 1 : 0;
    } else if (intersection_over_union(box, around(one)) < poor) {
      const auto fits = [&, mask = around(one)](const cv::Rect2d& other) {
        return intersection_over_union(other, mask) > good;
      };
      const cv::Point2d a = box.tl(), b = box.br();  // cv::Rect has sorted their coordinates
      readings[6] += (box & around(one)).empty() ? 1 : 0;
      readings[1] += fits(turned_box) ? 1 : 0;
      readings[2] += fits({a, cv::Point2d(box.width, box.height)}) ? 1 : 0;
      readings[3] += fits({a.x, a.y, b.x, b.y}) || fits({b.x, a.y, a.x, b.y}) ||
                             fits({a.x, b.y, b.x, a.y}) || fits({b.x, b.y, a.x, a.y})
                         ? 1
                         : 0;
      const auto has_it = [&](const Instance& other) {
        return !other.mask.empty() && intersection_over_union(box, around(other)) > good;
      };
      readings[4] += std::any_of(masks.instances.begin(), masks.instances.end(), has_it) ? 1 : 0;
      const double scale = around(one).width / box.width;
      const cv::Rect2d scaled(scale * a, scale * b);
      readings[5] += std::abs(scale - 1) > 0.2 && fits(scaled) ? 1 : 0;
    }
  }
}

/// ORB finds features up to a rim of 5 % of the image.
std::optional<InputFinding> PlaceSummary::about_features(const cv::Size& image) const {
  if (outside() > 0.05) {
    const bool are_turned = turned(0.9) < 0.01;
    return InputFinding{
        "features_outside",
        percent(outside()) + " of the features lie outside the images of " + size_name(image) +
            ": " +
            (are_turned ? "they are (row, column): give (x, y)" : "give those of the same image") +
            ", in pixels of the image that is segmented"};
  }
  if (!(reach(0.9) < 0.55)) return {};
  return InputFinding{"features_quarter",
                      "features reach only " + percent(reach(0.9)) +
                          " of the width and height of the images of " + size_name(image) +
                          ": are they normalised, or of a smaller image? Give pixels of the image "
                          "that is segmented"};
}

std::optional<InputFinding> PlaceSummary::about_boxes() const {
  constexpr const char* causes[] = {
      ", because they are normalised: give pixels",
      ", because y comes before x: give x first",
      ", because their sizes are corners: give width and height, or name both corners",
      ", because their corners are sizes: give x1, y1, x2, y2, or name width and height",
      ", because they come in another order than the masks: give each mask its own",
      ", because they are in pixels of another size: give pixels of the image, in instances.csv of "
      "the mask",
      ": give both in pixels of the image, and each mask its own box"};
  const double all = std::max(boxes, double{min_checked_frames});
  for (std::size_t k = 0; k < readings.size(); ++k) {
    if (readings[k] <= (k < 6 ? 0.15 : 0.5) * all) continue;
    return InputFinding{"boxes", percent(readings[k] / all) +
                                     " of the boxes fit neither mask nor image" + causes[k]};
  }
  return {};
}

}  // namespace dynfilter::detail
