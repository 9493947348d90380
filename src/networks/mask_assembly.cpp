// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "mask_assembly.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace dynfilter::detail {
namespace {

/// The grid of prototypes: cell (x, y) covers [x, x+1) x [y, y+1).
struct Grid {
  int columns, rows;
  double cells_per_pixel_x, cells_per_pixel_y;  // of the network's input

  Grid(const Prototypes& prototypes, const cv::Size& input)
      : columns(prototypes.columns),
        rows(prototypes.rows),
        cells_per_pixel_x(columns / static_cast<double>(input.width)),
        cells_per_pixel_y(rows / static_cast<double>(input.height)) {}

  cv::Point2d at(cv::Point2d input) const {
    return {input.x * cells_per_pixel_x, input.y * cells_per_pixel_y};
  }
};

/// Holds the weighted sum of the prototypes in a part of the grid, and interpolates it.
class CellPatch {
 public:
  /// Computes the sum for `cells`, which must hold all cells that are read later.
  CellPatch(const Prototypes& prototypes, const std::vector<float>& coefficients,
            const cv::Rect& cells)
      : cells_(cells), grid_(prototypes.columns, prototypes.rows), values_(cells.size(), 0.0F) {
    for (int k = 0; k < prototypes.count; ++k) {
      const float weight = coefficients[static_cast<std::size_t>(k)];
      for (int y = 0; y < cells.height; ++y) {
        const std::size_t first =
            static_cast<std::size_t>(cells.y + y) * static_cast<std::size_t>(prototypes.columns) +
            static_cast<std::size_t>(cells.x);
        const float* source = prototypes.data +
                              static_cast<std::size_t>(k) * prototypes.prototype_step +
                              first * prototypes.cell_step;
        float* sum = values_[y];
        for (int x = 0; x < cells.width; ++x) {
          sum[x] += weight * source[static_cast<std::size_t>(x) * prototypes.cell_step];
        }
      }
    }
  }

  /// Replaces every value by function(value, column, row), in coordinates of the whole grid.
  template <class Function>
  void replace(const Function& function) {
    for (int y = 0; y < cells_.height; ++y) {
      for (int x = 0; x < cells_.width; ++x) {
        values_(y, x) = function(values_(y, x), cells_.x + x, cells_.y + y);
      }
    }
  }

  /// Interpolates between the four cell centres around a point of the grid. Beyond the outermost
  /// centres the value is constant.
  float interpolated(cv::Point2d point) const {
    const double x = std::clamp(point.x - 0.5, 0.0, grid_.width - 1.0);
    const double y = std::clamp(point.y - 0.5, 0.0, grid_.height - 1.0);
    const int x0 = static_cast<int>(x);
    const int y0 = static_cast<int>(y);
    const int x1 = std::min(x0 + 1, grid_.width - 1) - cells_.x;
    const int y1 = std::min(y0 + 1, grid_.height - 1) - cells_.y;
    const auto right = static_cast<float>(x - x0);
    const auto below = static_cast<float>(y - y0);
    const float* upper = values_[y0 - cells_.y];
    const float* lower = values_[y1];
    const float above = upper[x0 - cells_.x] * (1 - right) + upper[x1] * right;
    const float under = lower[x0 - cells_.x] * (1 - right) + lower[x1] * right;
    return above * (1 - below) + under * below;
  }

 private:
  cv::Rect cells_;
  cv::Size grid_;
  cv::Mat_<float> values_;
};

/// Returns the cells that interpolation reads for points in this rectangle of the grid.
cv::Rect cells_around(cv::Point2d first, cv::Point2d last, const Grid& grid) {
  const auto interval = [](double from, double to, int limit) {
    const int begin = static_cast<int>(std::clamp(std::floor(from) - 1, 0.0, limit - 1.0));
    const int end = static_cast<int>(std::clamp(std::ceil(to) + 1, begin + 1.0, double(limit)));
    return cv::Range(begin, end);
  };
  const cv::Range columns = interval(first.x, last.x, grid.columns);
  const cv::Range rows = interval(first.y, last.y, grid.rows);
  return {columns.start, rows.start, columns.size(), rows.size()};
}

/// Returns the cells under a rectangle of the image.
cv::Rect cells_under(const cv::Rect& region, const InputPlacement& placement, const Grid& grid) {
  const cv::Point2d first = grid.at(placement.to_input(region.tl()));
  const cv::Point2d last = grid.at(placement.to_input(region.br()));
  return cells_around(first, last, grid);
}

/// Marks the pixels in a rectangle of the image whose centres, as points of the input, are on the
/// object.
template <class Predicate>
cv::Mat painted(const cv::Rect& region, const InputPlacement& placement,
                const Predicate& is_on_object) {
  cv::Mat mask(region.size(), CV_8UC1);
  for (int y = 0; y < region.height; ++y) {
    std::uint8_t* row = mask.ptr<std::uint8_t>(y);
    for (int x = 0; x < region.width; ++x) {
      const cv::Point2d centre(region.x + x + 0.5, region.y + y + 0.5);
      row[x] = is_on_object(placement.to_input(centre)) ? 255 : 0;
    }
  }
  return mask;
}

/// A mask and the image position of its first pixel.
struct PlacedMask {
  cv::Mat pixels;
  cv::Point origin;
};

PlacedMask mask_cropped_in_pixels(const Detection& detection, const Prototypes& prototypes,
                                  const InputPlacement& placement, const cv::Rect& region) {
  const Grid grid(prototypes, placement.input);
  const CellPatch sums(prototypes, detection.coefficients, cells_under(region, placement, grid));
  const Box& box = detection.box;
  return {painted(region, placement,
                  [&](cv::Point2d input) {
                    return input.x >= double{box.x1} && input.x < double{box.x2} &&
                           input.y >= double{box.y1} && input.y < double{box.y2} &&
                           sums.interpolated(grid.at(input)) > 0;
                  }),
          region.tl()};
}

PlacedMask mask_cropped_in_cells(const Detection& detection, const Prototypes& prototypes,
                                 const InputPlacement& placement) {
  const Grid grid(prototypes, placement.input);
  const auto side = [](float value, double factor, int margin, int limit) {
    return static_cast<float>(std::clamp(double{value} * factor + margin, 0.0, double(limit)));
  };
  const Box crop = {side(detection.box.x1, grid.cells_per_pixel_x, -1, grid.columns),
                    side(detection.box.y1, grid.cells_per_pixel_y, -1, grid.rows),
                    side(detection.box.x2, grid.cells_per_pixel_x, 1, grid.columns),
                    side(detection.box.y2, grid.cells_per_pixel_y, 1, grid.rows)};
  // A cell counts if it begins in the box, so the mask may end up to a cell behind it.
  const Box reach = {static_cast<float>(double{crop.x1} / grid.cells_per_pixel_x),
                     static_cast<float>(double{crop.y1} / grid.cells_per_pixel_y),
                     static_cast<float>((double{crop.x2} + 1) / grid.cells_per_pixel_x),
                     static_cast<float>((double{crop.y2} + 1) / grid.cells_per_pixel_y)};
  const cv::Rect region = box_in_image(reach, placement);
  if (region.empty()) return {};

  CellPatch cells(prototypes, detection.coefficients, cells_under(region, placement, grid));
  cells.replace([&](float sum, int column, int row) {
    const auto x = static_cast<float>(column);
    const auto y = static_cast<float>(row);
    const bool is_inside = x >= crop.x1 && x < crop.x2 && y >= crop.y1 && y < crop.y2;
    return is_inside ? sigmoid(sum) : 0.0F;
  });
  return {painted(region, placement,
                  [&](cv::Point2d input) { return cells.interpolated(grid.at(input)) > 0.5F; }),
          region.tl()};
}

}  // namespace

std::vector<Instance> assemble_instances(const std::vector<Detection>& detections,
                                         const Prototypes& prototypes,
                                         const InputPlacement& placement, MaskRule rule) {
  std::vector<Instance> instances;
  for (const Detection& detection : detections) {
    const cv::Rect box = box_in_image(detection.box, placement);
    if (box.empty()) continue;
    const PlacedMask mask = rule == MaskRule::crop_cells
                                ? mask_cropped_in_cells(detection, prototypes, placement)
                                : mask_cropped_in_pixels(detection, prototypes, placement, box);
    if (mask.pixels.empty()) continue;
    const cv::Rect used = cv::boundingRect(mask.pixels);
    if (used.empty()) continue;
    Instance instance;
    instance.class_id = detection.class_id;
    instance.score = detection.score;
    instance.box = box;
    instance.mask_origin = mask.origin + used.tl();
    instance.mask = mask.pixels(used).clone();
    instances.push_back(std::move(instance));
  }
  return instances;
}

}  // namespace dynfilter::detail
