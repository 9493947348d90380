// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FRAME_FEATURES_HPP
#define DYNFILTER_FRAME_FEATURES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter {

/// Indices of some of a frame's features, for a range-based for loop. It refers to memory of the
/// object that returned it.
class FeatureIndices {
 public:
  /// Refers to the indices from `first` up to, not including, `last`.
  FeatureIndices(const std::uint32_t* first, const std::uint32_t* last)
      : first_(first), last_(last) {}

  /// First index.
  const std::uint32_t* begin() const { return first_; }
  /// End of the indices.
  const std::uint32_t* end() const { return last_; }
  /// Number of indices.
  std::size_t size() const { return static_cast<std::size_t>(last_ - first_); }
  /// Whether there are none.
  bool empty() const { return first_ == last_; }

 private:
  const std::uint32_t* first_;
  const std::uint32_t* last_;
};

/// Pixels of one frame's features, with set queries: the features inside a box, or those removed
/// for an instance. Stages keep it in their scratch memory, see Workspace::get.
///
/// For crowds, the features are sorted into a grid once, so that a box costs only the features near
/// it. The order of the indices in a set is not specified.
class FrameFeatures {
 public:
  /// Reads the features' pixels, reusing memory. `boxes` is about how many boxes will be queried;
  /// for many boxes the grid is built. O(features).
  void read(FeaturesView features, std::size_t boxes) {
    x_.resize(features.size());
    y_.resize(features.size());
    is_inside_.resize(features.size());
    found_.resize(features.size());
    sorted_.resize(features.size());
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const cv::Point pixel = features.pixel(i);
      x_[i] = pixel.x;
      y_[i] = pixel.y;
    }
    // Sorting costs about as much as comparing all features with eight boxes.
    has_grid_ = boxes > 8;
    if (has_grid_) sort_into_cells();
  }

  std::size_t size() const { return x_.size(); }

  /// The pixel of feature i, as FeaturesView::pixel gives it. i must be below size().
  cv::Point pixel(std::size_t i) const { return {x_[i], y_[i]}; }

  /// Returns the features whose pixels lie inside the box, which may lie outside the image; its
  /// right and lower edges do not belong to it. The result is valid until the next call of `read`
  /// or `inside`. O(features near the box), or O(features) without the grid.
  FeatureIndices inside(const cv::Rect& box) { return inside(detail::bounds_of(box)); }

  /// Returns the features inside bounds of 64 bits, for the library's own stages.
  FeatureIndices inside(const detail::PixelBounds& bounds) {
    std::uint32_t* end = found_.data();
    if (has_grid_) {
      for_each_near(bounds, [&](std::uint32_t i) {
        *end = i;
        end += is_inside(bounds, i);
      });
    } else {
      mark_inside(bounds, x_.data(), y_.data(), size(), is_inside_.data());
      const std::uint8_t* const is_inside = is_inside_.data();
      const auto count = static_cast<std::uint32_t>(size());
      for (std::uint32_t i = 0; i < count; ++i) {
        *end = i;
        end += is_inside[i];
      }
    }
    return {found_.data(), end};
  }

  /// Returns the features that were removed for an instance with the reason given to
  /// sort_by_instance. Call sort_by_instance first, and again when labels have changed.
  FeatureIndices removed_for(std::size_t instance) const {
    const std::uint32_t* const first = by_instance_.data();
    return {first + instance_begins_[instance], first + instance_begins_[instance + 1]};
  }

  /// Prepares removed_for. `labels` must have one label per feature. O(features + instances).
  void sort_by_instance(const FeatureLabels& labels, Reason reason) {
    const std::size_t instances = labels.statistics().instances.size();
    const auto counts = [reason](const FeatureLabel& label) {
      return label.removed && label.reason == reason && label.instance >= 0;
    };
    instance_begins_.assign(instances + 2, 0);
    by_instance_.resize(labels.size());
    for (const FeatureLabel& label : labels) {
      if (counts(label)) ++instance_begins_[static_cast<std::size_t>(label.instance) + 2];
    }
    for (std::size_t k = 2; k < instance_begins_.size(); ++k) {
      instance_begins_[k] += instance_begins_[k - 1];
    }
    for (std::uint32_t i = 0; i < labels.size(); ++i) {
      if (!counts(labels[i])) continue;
      by_instance_[instance_begins_[static_cast<std::size_t>(labels[i].instance) + 1]++] = i;
    }
  }

 private:
  static constexpr int grid_cells = 64;                   // each way
  static constexpr int greatest_on_grid = (1 << 16) - 1;  // coordinate of any image's pixel

  /// 1 if the feature lies inside, else 0; without a branch.
  std::uint8_t is_inside(const detail::PixelBounds& bounds, std::uint32_t i) const {
    std::uint8_t result = 0;
    mark_inside(bounds, &x_[i], &y_[i], 1, &result);
    return result;
  }

  /// Writes 1 for each pixel that lies inside, else 0. Compilers make vector code of the loop,
  /// because all that it reads is local: bytes may alias anything else.
  static void mark_inside(const detail::PixelBounds bounds, const int* x, const int* y,
                          std::size_t count, std::uint8_t* is_inside) {
    for (std::size_t i = 0; i < count; ++i) {
      is_inside[i] = static_cast<std::uint8_t>((x[i] >= bounds.first_x) & (x[i] <= bounds.last_x) &
                                               (y[i] >= bounds.first_y) & (y[i] <= bounds.last_y));
    }
  }

  /// Counting sort by cell. The grid spans the coordinates that the features have.
  void sort_into_cells() {
    int greatest = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      if (x_[i] <= greatest_on_grid) greatest = std::max(greatest, x_[i]);
      if (y_[i] <= greatest_on_grid) greatest = std::max(greatest, y_[i]);
    }
    cell_shift_ = 0;
    while (greatest >> cell_shift_ >= grid_cells) ++cell_shift_;
    cell_begins_.assign(std::size_t{grid_cells} * grid_cells + 2, 0);
    cells_.resize(size());
    for (std::size_t i = 0; i < size(); ++i) {
      cells_[i] = static_cast<std::uint32_t>(along(y_[i]) * grid_cells + along(x_[i]));
      ++cell_begins_[cells_[i] + 2];
    }
    for (std::size_t cell = 2; cell < cell_begins_.size(); ++cell) {
      cell_begins_[cell] += cell_begins_[cell - 1];
    }
    for (std::uint32_t i = 0; i < size(); ++i) sorted_[cell_begins_[cells_[i] + 1]++] = i;
  }

  /// The column or row of cells. Features left of the grid or above it are in its first one,
  /// features beyond it in its last.
  int along(int coordinate) const {
    return std::min(std::max(coordinate, 0) >> cell_shift_, grid_cells - 1);
  }

  /// Calls action(i) for the features in all cells that the bounds meet. The cells of one row are
  /// adjacent in memory.
  template <class Action>
  void for_each_near(const detail::PixelBounds& bounds, const Action& action) const {
    if (bounds.empty()) return;
    for (int row = along(bounds.first_y); row <= along(bounds.last_y); ++row) {
      const auto first = static_cast<std::size_t>(row * grid_cells + along(bounds.first_x));
      const auto last = static_cast<std::size_t>(row * grid_cells + along(bounds.last_x));
      for (std::size_t slot = cell_begins_[first]; slot < cell_begins_[last + 1]; ++slot) {
        action(sorted_[slot]);
      }
    }
  }

  std::vector<int> x_, y_;                      // the pixels
  std::vector<std::uint8_t> is_inside_;         // of the last box
  std::vector<std::uint32_t> found_;            // the last answer of inside
  std::vector<std::uint32_t> by_instance_;      // features removed for instance 0, 1, …
  std::vector<std::uint32_t> instance_begins_;  // start of each instance's part, and the end
  bool has_grid_ = false;
  int cell_shift_ = 0;                      // a cell is 2^shift pixels wide and high
  std::vector<std::uint32_t> cells_;        // the cell of each feature
  std::vector<std::uint32_t> sorted_;       // features by cell, row by row
  std::vector<std::uint32_t> cell_begins_;  // start of each cell's part, and the end
};

}  // namespace dynfilter

#endif  // DYNFILTER_FRAME_FEATURES_HPP
