// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DEPTH_WATERSHED_HPP
#define DYNFILTER_DEPTH_WATERSHED_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Divides the surfaces in and around an object's box between the object and its surroundings: a
/// watershed on the depth image (F. Meyer, "Topographic distance and watershed lines", Signal
/// Processing 38, 1994), on a coarse grid.
///
/// A table behind a person may lie in the person's range of depth. But it is connected with what
/// lies outside the person's box by smaller steps of depth than with the person; a hand is not.
/// The flood starts on the mask and outside the box, and takes the
/// smallest step first. Where both sides come over equal steps, the object has the place.
class DepthWatershed {
 public:
  /// Start of the flood.
  enum class Seed {
    none,          ///< the flood does not start here
    object,        ///< the place belongs to the object
    surroundings,  ///< the place does not belong to the object
  };

  /// Steps of depth that lie between a place and the flood's seeds, metres: the largest step on the
  /// way that has the smallest such step. Infinite if no way leads there.
  struct Steps {
    float to_object_m = std::numeric_limits<float>::infinity();        ///< to the object
    float to_surroundings_m = std::numeric_limits<float>::infinity();  ///< to its surroundings
  };

  /// Floods the cells of an area. Each cell has the depth of its central pixel; a cell whose depth
  /// is missing or outside `range_m` is not flooded. `seed_at` is called with the centres of the
  /// others and returns the Seed. The area may reach beyond the image, where there is no depth;
  /// `cell_px` must be above 0. The frame must be valid and have depth. O(n log n) in the cells.
  template <class SeedAt>
  void flood(const FrameView& frame, const cv::Rect& area, int cell_px, const ValueRange& range_m,
             const SeedAt& seed_at) {
    area_ = area;
    cell_px_ = cell_px;
    columns_ = (area.width + cell_px - 1) / cell_px;
    rows_ = (area.height + cell_px - 1) / cell_px;
    cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), {});
    has_object_ = false;
    queue_.clear();
    queue_.reserve(max_neighbours * cells_.size() + 1);
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        const cv::Point centre = centre_of(column, row);
        const double depth_m = frame.depth_m(centre).value_or(0);
        if (!(depth_m > 0) || !range_m.contains(depth_m)) continue;
        Cell& cell = cell_at(column, row);
        cell.depth_m = static_cast<float>(depth_m);
        const Seed owner = seed_at(centre);
        if (owner != Seed::none) push({0, owner, column, row}, cell);
        has_object_ |= owner == Seed::object;
      }
    }
    while (!queue_.empty()) rise();
  }

  /// Whether the flood started on the object somewhere. If not, nothing is connected with it.
  bool has_object() const { return has_object_; }

  /// Returns the steps from the seeds to a pixel of this depth, by the cells around it. The pixel
  /// must lie in the flooded area. O(1).
  Steps steps_to(cv::Point pixel, double depth_m) const {
    Steps steps;
    const int column = (pixel.x - area_.x) / cell_px_, row = (pixel.y - area_.y) / cell_px_;
    for_each_near(column, row, [&](int x, int y) {
      const Cell& cell = cells_[index_of(x, y)];
      if (cell.owner == Seed::none) return;
      const float step =
          std::max(cell.step_m, std::abs(static_cast<float>(depth_m) - cell.depth_m));
      float& smallest = cell.owner == Seed::object ? steps.to_object_m : steps.to_surroundings_m;
      smallest = std::min(smallest, step);
    });
    return steps;
  }

 private:
  static constexpr std::size_t max_neighbours = 8;

  struct Cell {
    float depth_m = 0;                                      // 0: not flooded
    float step_m = std::numeric_limits<float>::infinity();  // largest one on the way from a seed
    Seed owner = Seed::none;
  };

  /// Place that the flood has reached.
  struct Front {
    float step_m;
    Seed owner;
    int column, row;
  };

  /// Whether a is flooded after b. At equal steps the object comes first.
  static bool is_higher(const Front& a, const Front& b) {
    return a.step_m > b.step_m || (a.step_m == b.step_m && a.owner > b.owner);
  }

  std::size_t index_of(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  Cell& cell_at(int column, int row) { return cells_[index_of(column, row)]; }

  /// Returns the central pixel of a cell, which may lie outside the image.
  cv::Point centre_of(int column, int row) const {
    return {area_.x + column * cell_px_ + cell_px_ / 2, area_.y + row * cell_px_ + cell_px_ / 2};
  }

  /// Calls the action with a cell and its neighbours.
  template <class Action>
  void for_each_near(int column, int row, const Action& action) const {
    for (int y = std::max(0, row - 1); y <= std::min(rows_ - 1, row + 1); ++y) {
      for (int x = std::max(0, column - 1); x <= std::min(columns_ - 1, column + 1); ++x) {
        action(x, y);
      }
    }
  }

  void push(const Front& front, Cell& cell) {
    cell.step_m = front.step_m;
    cell.owner = front.owner;
    queue_.push_back(front);
    std::push_heap(queue_.begin(), queue_.end(), is_higher);
  }

  /// Takes the lowest place of the flood's front, and floods its neighbours from there.
  void rise() {
    std::pop_heap(queue_.begin(), queue_.end(), is_higher);
    const Front front = queue_.back();
    queue_.pop_back();
    const Cell from = cell_at(front.column, front.row);
    if (front.step_m > from.step_m || front.owner != from.owner) return;  // a lower way was found
    for_each_near(front.column, front.row, [&](int x, int y) {
      Cell& to = cell_at(x, y);
      if (to.depth_m == 0) return;
      const Front next{std::max(from.step_m, std::abs(to.depth_m - from.depth_m)), from.owner, x,
                       y};
      if (is_higher({to.step_m, to.owner, x, y}, next)) push(next, to);
    });
  }

  cv::Rect area_;
  int cell_px_ = 1, columns_ = 0, rows_ = 0;
  bool has_object_ = false;
  std::vector<Cell> cells_;   // row by row
  std::vector<Front> queue_;  // a heap, the lowest first
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_WATERSHED_HPP
