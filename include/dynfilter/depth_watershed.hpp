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
/// The flood starts on the mask and outside the box, and takes the smallest step first. Where both
/// sides come over equal steps, the object has the place. The places where it starts keep their
/// owner.
class DepthWatershed {
 public:
  /// Largest step of depth between cells that are connected, metres.
  static constexpr float max_step_m = 0.15F;

  /// Start of the flood.
  enum class Seed {
    none,          ///< the flood does not start here
    object,        ///< the place belongs to the object
    surroundings,  ///< the place does not belong to the object
  };

  /// Steps of depth that lie between a place and the flood's seeds, metres: the largest step on the
  /// way that has the smallest such step. Infinite if no way leads there by steps of at most
  /// max_step_m.
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
    const int columns = (area.width + cell_px - 1) / cell_px;
    const int rows = (area.height + cell_px - 1) / cell_px;
    stride_ = columns + 2;  // with a frame of dry cells around, so that each cell has neighbours
    cells_.assign(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(rows + 2), {});
    has_object_ = false;
    open_.clear();
    open_.reserve(cells_.size());
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const cv::Point centre =
            area.tl() + cv::Point(column, row) * cell_px + cv::Point(cell_px / 2, cell_px / 2);
        const double depth_m = frame.depth_m(centre).value_or(0);
        if (!(depth_m > 0) || !range_m.contains(depth_m)) continue;
        const std::size_t index = index_of(column, row);
        const Seed seed = seed_at(centre);
        cells_[index] = {static_cast<float>(depth_m), seed == Seed::none ? nowhere : source, seed};
        if (seed == Seed::none) open_.push_back(index);
        has_object_ |= seed == Seed::object;
      }
    }
    spread_from_seeds();
    while (!front_.empty()) rise();
  }

  /// Whether the flood started on the object somewhere. If not, nothing is connected with it.
  bool has_object() const { return has_object_; }

  /// Returns the steps from the seeds to a pixel of this depth, by the cells around it. The pixel
  /// must lie in the flooded area. O(1).
  Steps steps_to(cv::Point pixel, double depth_m) const {
    Steps steps;
    const cv::Point place = (pixel - area_.tl()) / cell_px_;
    for_each_near(index_of(place.x, place.y), [&](std::size_t i) {
      const Cell& cell = cells_[i];
      if (cell.owner == Seed::none) return;
      const float step =
          std::max(cell.step_m, std::abs(static_cast<float>(depth_m) - cell.depth_m));
      if (step > max_step_m) return;  // not connected
      float& smallest = cell.owner == Seed::object ? steps.to_object_m : steps.to_surroundings_m;
      smallest = std::min(smallest, step);
    });
    return steps;
  }

 private:
  static constexpr std::size_t max_neighbours = 8;

  static constexpr float nowhere = std::numeric_limits<float>::infinity();
  static constexpr float source = -1;  // below every step: a seed keeps its owner

  struct Cell {
    float depth_m = 0;       // 0: not flooded
    float step_m = nowhere;  // largest one on the way from a seed
    Seed owner = Seed::none;
  };

  /// Place that the flood has reached.
  struct Front {
    float step_m;
    Seed owner;
    std::size_t index;
  };

  /// Whether a is flooded after b. At equal steps the object comes first.
  template <class A, class B>
  static bool is_higher(const A& a, const B& b) {
    return (a.step_m > b.step_m) | ((a.step_m == b.step_m) & (a.owner > b.owner));
  }

  /// Order of the heap: a type and no function, so that compilers put it in place.
  struct IsLater {
    bool operator()(const Front& a, const Front& b) const { return is_higher(a, b); }
  };

  /// What a cell offers to a neighbour, at `index`: the way from its seed on to there.
  static Front offer(const Cell& from, const Cell& to, std::size_t index) {
    return {std::max(from.step_m, std::abs(to.depth_m - from.depth_m)), from.owner, index};
  }

  std::size_t index_of(int column, int row) const {
    return static_cast<std::size_t>(row + 1) * static_cast<std::size_t>(stride_) +
           static_cast<std::size_t>(column + 1);
  }

  /// Calls the action with a cell and its eight neighbours.
  template <class Action>
  void for_each_near(std::size_t index, const Action& action) const {
    const auto stride = static_cast<std::size_t>(stride_);
    for (const std::size_t middle : {index - stride, index, index + stride}) {
      for (const std::size_t i : {middle - 1, middle, middle + 1}) action(i);
    }
  }

  /// Makes the first front: of the cells beside seeds. Most seeds lie among seeds, so it is quicker
  /// to look from the other cells.
  void spread_from_seeds() {
    front_.clear();
    front_.reserve(max_neighbours * cells_.size());
    for (const std::size_t index : open_) {
      Front best{nowhere, Seed::none, index};
      for_each_near(index, [&](std::size_t i) {
        if (cells_[i].owner == Seed::none) return;
        const Front next = offer(cells_[i], cells_[index], index);
        if (is_higher(best, next)) best = next;
      });
      if (best.step_m <= max_step_m) front_.push_back(best);
    }
    for (const Front& reached : front_) {
      cells_[reached.index].step_m = reached.step_m;
      cells_[reached.index].owner = reached.owner;
    }
    std::make_heap(front_.begin(), front_.end(), IsLater());
  }

  /// Takes the lowest place of the flood's front, and floods those neighbours from there that have
  /// no lower way.
  void rise() {
    std::pop_heap(front_.begin(), front_.end(), IsLater());
    const Front lowest = front_.back();
    front_.pop_back();
    if (is_higher(lowest, cells_[lowest.index])) return;  // a lower way was found
    const Cell from = cells_[lowest.index];
    for_each_near(lowest.index, [&](std::size_t i) {
      Cell& to = cells_[i];
      if (to.depth_m == 0 || to.step_m < from.step_m) return;
      const Front next = offer(from, to, i);
      if (next.step_m > max_step_m || !is_higher(to, next)) return;
      to.step_m = next.step_m;
      to.owner = next.owner;
      front_.push_back(next);
      std::push_heap(front_.begin(), front_.end(), IsLater());
    });
  }

  cv::Rect area_;
  int cell_px_ = 1, stride_ = 2;
  bool has_object_ = false;
  std::vector<Cell> cells_;        // row by row, with one dry cell beyond each end
  std::vector<std::size_t> open_;  // cells with depth that are no seeds
  std::vector<Front> front_;       // a heap, the lowest first
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_WATERSHED_HPP
