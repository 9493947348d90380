// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_object.hpp"
#include "dynfilter/detail/rectangles.hpp"

namespace dynfilter::detail {

/// Surfaces of a frame, on a grid of cells between its objects and their surroundings. A cell has
/// the depth of its middle pixel. A step is a difference of depth between neighbours, and a way is
/// as hard as its largest step.
class SurfaceGrid {
 public:
  struct Steps {  // on the easiest way to each side, metres
    double object_m = std::numeric_limits<double>::infinity();
    double around_m = std::numeric_limits<double>::infinity();
  };

  struct Cell {
    double depth_m = 0;
    Steps steps = {};  // -1: a seed of this side, which has no way to the other one
  };

  /// Floods the surfaces from the seeds: the objects' depths where they were found, and all that
  /// lies outside the extents. Sweeps forth and back over the cells twice, and so misses ways with
  /// more turns. Cells lie row by row, with a frame of cells without depth around the image.
  SurfaceGrid(const DepthRuleFrame& frame, const std::vector<DepthObject>& objects,
              std::vector<Cell>& cells)
      : side_(cell_side(frame, objects)), columns_(frame.size.width / side_ + 3), cells_(cells) {
    const auto count = [&](int side) {
      return static_cast<std::size_t>(frame.size.width / side + 3) *
             static_cast<std::size_t>(frame.size.height / side + 3);
    };
    cells.reserve(count(frame.scaled(min_cell_px)));  // as any objects may need
    cells.assign(count(side_), Cell());
    cv::Rect area;
    for (const DepthObject& object : objects) area |= object.extent;
    area = clip_grown(area, side_, side_, frame.size);  // with a ring of surroundings
    for (int y = area.y / side_ * side_ + side_ / 2; y < area.br().y; y += side_) {
      for (int x = area.x / side_ * side_ + side_ / 2; x < area.br().x; x += side_) {
        const double depth_m = frame.depth_at({x, y});
        if (depth_m > 0) cells[cell_of({x, y})] = seed({x, y}, depth_m, objects);
      }
    }
    const std::size_t first = cell_of(area.tl()), end = cell_of(area.br()) + 1;
    for (int round = 0; round < 2; ++round) {
      for (std::size_t i = first; i < end; ++i) relax(cells[i], -1);
      for (std::size_t i = end; i-- > first;) relax(cells[i], 1);
    }
  }

  /// Whether the surface at a pixel belongs to an object: if the way there is easier than that to
  /// the surroundings, or if there is no way to these and the pixel is at the object's depth. Where
  /// a mask follows the edges of depth, nothing with a way to the surroundings was missed. Beyond
  /// the half width, a way gets harder.
  bool belongs_to(const DepthObject& object, cv::Point pixel, double depth_m) const {
    if (!(depth_m > 0)) return false;
    Steps least{max_step_m, max_step_m};
    const Cell* const middle = &cells_[cell_of(pixel)];
    for (const int row : {-columns_, 0, columns_}) {
      for (const Cell* cell = middle + row - 1; cell <= middle + row + 1; ++cell) {
        ease(least, cell->steps, std::abs(depth_m - cell->depth_m));
      }
    }
    const double beyond_m = std::abs(depth_m - object.depth_m) - object.frame->half_width_m;
    const double step_m = least.object_m + step_per_depth * std::max(0.0, beyond_m);
    if (least.around_m == max_step_m) return step_m <= max_step_m;
    return !object.follows_edges && step_m < least.around_m;
  }

 private:
  static constexpr double max_cell_px = 16, min_cell_px = 6;  // With more, arms are missed.
  static constexpr double max_step_m = 0.2;       // With more, limbs join the wall behind them.
  static constexpr double step_per_depth = 0.25;  // With more, hands before the body are missed.

  /// Makes steps as easy as those of a neighbour, over the step between both.
  static void ease(Steps& steps, const Steps& from, double step_m) {
    steps.object_m = std::min(steps.object_m, std::max(from.object_m, step_m));
    steps.around_m = std::min(steps.around_m, std::max(from.around_m, step_m));
  }

  std::size_t cell_of(cv::Point pixel) const {
    return static_cast<std::size_t>((pixel.y / side_ + 1) * columns_ + pixel.x / side_ + 1);
  }

  /// Returns the side of the cells, pixels: a quarter of the narrowest box, within limits.
  static int cell_side(const DepthRuleFrame& frame, const std::vector<DepthObject>& objects) {
    int side = frame.scaled(max_cell_px);
    for (const DepthObject& object : objects) {
      const int quarter = std::min(object.instance->box.width, object.instance->box.height) / 4;
      side = std::min(side, std::max(frame.scaled(min_cell_px), quarter));
    }
    return side;
  }

  /// Returns the cell of a pixel before the flood.
  static Cell seed(cv::Point pixel, double depth_m, const std::vector<DepthObject>& objects) {
    bool is_outside = true;
    for (const DepthObject& object : objects) {
      const bool is_surface = object.seed_box.empty() ? object.covers_depth_pixel(pixel)
                                                      : object.seed_box.contains(pixel);
      if (is_surface && object.is_at_depth(depth_m)) return {depth_m, {-1}};
      is_outside = is_outside && !object.extent.contains(pixel);
    }
    return {depth_m, {Steps().object_m, is_outside ? -1 : Steps().around_m}};
  }

  /// Eases the ways to a cell by the four neighbours before it (direction -1) or after it (1).
  void relax(Cell& cell, int direction) const {
    if (cell.depth_m == 0 || std::min(cell.steps.object_m, cell.steps.around_m) < 0) return;
    for (const int offset : {1, columns_ - 1, columns_, columns_ + 1}) {
      const Cell& from = (&cell)[direction * offset];
      ease(cell.steps, from.steps, std::abs(cell.depth_m - from.depth_m));
    }
  }

  const int side_, columns_;  // pixels of a cell; cells in a row
  std::vector<Cell>& cells_;
};

/// Tells how certainly a pixel belongs to an object, by the surfaces in the depth image.
class SurfaceRule {
 public:
  SurfaceRule(const DepthRuleFrame& frame, const std::vector<DepthObject>& objects,
              std::vector<SurfaceGrid::Cell>& cells)
      : frame_(frame), grid_(frame, objects, cells) {}

  /// Returns the certainty, 0 to 1, that a pixel of this depth belongs to the object; 1/2 is
  /// enough. Other surfaces before the object or at its depth do not. Behind it, and without depth,
  /// there may be its edge or hair, which sensors see through: the enclosure decides. It must be
  /// twice as large in a mask's shadow, the strip beside it where sensors are blind.
  double certainty(const DepthObject& object, cv::Point pixel, double depth_m) const {
    const cv::Point depth_pixel = object.depth_pixel_of(pixel);
    if (grid_.belongs_to(object, depth_pixel, depth_m)) return 1;
    const bool is_behind = depth_m == 0 || depth_m >= object.depth_m + frame_.half_width_m;
    // The gap may be that of a thing beside the mask at the object's depth.
    if (object.is_beside_mask(pixel, is_behind ? object.margin_px : frame_.margin_px)) return 1;
    if (!is_behind) return 0;
    const double enclosure = enclosure_at(object, depth_pixel);
    const double shadow_end_px = object.margin_px + shadow_px * frame_.scale;
    const bool is_in_shadow =
        enclosure >= min_enclosure && object.is_beside_mask(pixel, shadow_end_px);
    const double needed = is_in_shadow ? 2 * min_enclosure : min_enclosure;
    return enclosure < needed ? enclosure / needed / 2 : std::min(1.0, 0.5 + enclosure / 8);
  }

  /// Whether the surface that the depth image shows at a pixel belongs to the object.
  bool belongs_to(const DepthObject& object, cv::Point depth_pixel) const {
    return grid_.belongs_to(object, depth_pixel, frame_.depth_at(depth_pixel));
  }

  static constexpr double max_enclosure_px = 12;  // With more, wide holes of depth join objects.

 private:
  static constexpr double min_enclosure = 0.45;  // With more, hair without depth is kept.
  static constexpr double shadow_px = 9;         // With more, limbs without depth are kept.

  /// Returns how the object encloses a pixel: the sum of 1 / distance in pixels over those of the
  /// eight directions in which the first surface, or fresh mask, is the object's.
  double enclosure_at(const DepthObject& object, cv::Point depth_pixel) const {
    double enclosure = 0;
    const int max_distance = frame_.scaled(max_enclosure_px);
    for (int i = 0; i < 9; ++i) {
      const cv::Point direction(i % 3 - 1, i / 3 - 1);
      cv::Point at = depth_pixel + direction;
      for (int n = 1; n <= max_distance && i != 4; ++n, at += direction) {
        const double depth_m = frame_.depth_at(at);
        const bool is_masked = !frame_.is_stale && object.covers_depth_pixel(at);
        if (depth_m == 0 && !is_masked) continue;
        if (is_masked || grid_.belongs_to(object, at, depth_m)) enclosure += frame_.scale / n;
        break;
      }
    }
    return enclosure;
  }

  const DepthRuleFrame& frame_;
  const SurfaceGrid grid_;
};

}  // namespace dynfilter::detail
