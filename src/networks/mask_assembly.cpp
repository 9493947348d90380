// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "mask_assembly.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace dynfilter::detail {
namespace {

/// Returns the whole numbers from `first` on and below `last`, from 0 to `limit`.
cv::Range whole_numbers(double first, double last, int limit) {
  const auto clamped = [&](double value) {
    return static_cast<int>(std::ceil(std::clamp(value, 0.0, static_cast<double>(limit))));
  };
  return {clamped(first), std::max(clamped(first), clamped(last))};
}

cv::Rect rectangle_of(const cv::Range& x, const cv::Range& y) {
  return {x.start, y.start, x.size(), y.size()};
}

/// Returns the pixels whose centres lie in the box.
cv::Rect pixels_in(const Box& box, const InputPlacement& placement) {
  const cv::Point2d first = placement.to_image({box.x1, box.y1});
  const cv::Point2d last = placement.to_image({box.x2, box.y2});
  return rectangle_of(whole_numbers(first.x - 0.5, last.x - 0.5, placement.image.width),
                      whole_numbers(first.y - 0.5, last.y - 0.5, placement.image.height));
}

/// A mask of a part of the image.
struct PlacedMask {
  cv::Mat pixels;
  cv::Point origin;
};

PlacedMask mask_cropped_in_cells(const cv::Mat& sums, const Box& box,
                                 const InputPlacement& placement) {
  const double x = sums.cols / static_cast<double>(placement.input.width);  // cells a pixel
  const double y = sums.rows / static_cast<double>(placement.input.height);
  const cv::Rect inside =
      rectangle_of(whole_numbers(double{box.x1} * x - 1, double{box.x2} * x + 1, sums.cols),
                   whole_numbers(double{box.y1} * y - 1, double{box.y2} * y + 1, sums.rows));
  if (inside.empty()) return {};
  cv::Mat weights, cells(sums.size(), CV_32F, cv::Scalar(0));
  cv::exp(-sums(inside), weights);
  cells(inside) = 1 / (1 + weights);
  // Beyond the border of the last cell, no interpolation with the next one, which is 0, passes 0.5.
  const Box reach = {static_cast<float>(inside.x / x), static_cast<float>(inside.y / y),
                     static_cast<float>(inside.br().x / x), static_cast<float>(inside.br().y / y)};
  const cv::Rect part = box_in_image(reach, placement);
  if (part.empty()) return {};
  return {in_image(cells, placement, part) > 0.5, part.tl()};
}

PlacedMask mask_cropped_in_pixels(const cv::Mat& sums, const Box& box,
                                  const InputPlacement& placement) {
  const cv::Rect part = pixels_in(box, placement);
  if (part.empty()) return {};
  return {in_image(sums, placement, part) > 0, part.tl()};
}

}  // namespace

cv::Mat in_image(const cv::Mat& grid, const InputPlacement& placement, const cv::Rect& part) {
  const double x = grid.cols / static_cast<double>(placement.input.width);  // cells a pixel
  const double y = grid.rows / static_cast<double>(placement.input.height);
  const cv::Point2d factor = placement.to_input.factor;
  const cv::Point2d first = placement.to_input({part.x + 0.5, part.y + 0.5});
  const cv::Matx23d to_grid(factor.x * x, 0, first.x * x - 0.5, 0, factor.y * y, first.y * y - 0.5);
  cv::Mat pixels;
  cv::warpAffine(grid, pixels, to_grid, part.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  return pixels;
}

std::vector<Instance> assemble_instances(const std::vector<Detection>& detections,
                                         const Planes& prototypes, const InputPlacement& placement,
                                         MaskRule rule) {
  cv::Mat planes;
  if (prototypes.count > 0) planes = prototypes.cells();
  std::vector<Instance> instances;
  for (const Detection& detection : detections) {
    const cv::Rect box = box_in_image(detection.box, placement);
    if (box.empty()) continue;
    if (planes.empty()) {
      Instance& alone = instances.emplace_back();
      alone.class_id = detection.class_id;
      alone.score = detection.score;
      alone.box = box;
      continue;
    }
    const cv::Mat sum = cv::Mat(detection.coefficients).t() * planes;
    const cv::Mat sums = sum.reshape(1, prototypes.rows);
    const PlacedMask mask = rule == MaskRule::crop_cells
                                ? mask_cropped_in_cells(sums, detection.box, placement)
                                : mask_cropped_in_pixels(sums, detection.box, placement);
    if (mask.pixels.empty()) continue;
    Instance instance =
        Instance::from_image_mask(mask.pixels, box, detection.class_id, detection.score);
    if (instance.mask.empty()) continue;
    instance.mask_origin += mask.origin;
    instance.image_size = {};  // the mask was cut from a part of the image
    instances.push_back(std::move(instance));
  }
  return instances;
}

}  // namespace dynfilter::detail
