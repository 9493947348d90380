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
#include "dynfilter/workspace.hpp"

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
/// for an instance. Stages get it from frame_features.
///
/// The features are sorted into the cells of a grid once, so that a box costs only the features
/// near it, however many features and boxes there are. The order of the indices in a set is not
/// specified.
class FrameFeatures {
 public:
  /// Reads the features' pixels, reusing memory. O(features).
  void read(FeaturesView features) {
    is_kept_ = false;
    view_ = features;
    x_.resize(features.size());
    y_.resize(features.size());
    found_.resize(features.size());
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const cv::Point pixel = features.pixel(i);
      x_[i] = pixel.x;
      y_[i] = pixel.y;
    }
    sort_into_cells();
  }

  /// Object that keeps features read for all stages of a pipeline: while it lives, frame_features
  /// does not read them again. A pipeline holds one while its stages run.
  class Reading {
   public:
    /// Reads the features. They must not change while this lives.
    Reading(FrameFeatures& features, FeaturesView view) : features_(features) {
      features_.read(view);
      features_.is_kept_ = true;
    }
    ~Reading() { features_.is_kept_ = false; }
    Reading(const Reading&) = delete;
    Reading& operator=(const Reading&) = delete;

   private:
    FrameFeatures& features_;
  };

  /// Whether a Reading keeps the features of this view.
  bool keeps(const FeaturesView& features) const {
    return is_kept_ && view_.is_same_view(features);
  }

  /// Number of features.
  std::size_t size() const { return x_.size(); }

  /// Pixel of feature i, as FeaturesView::pixel returns it. i must be below size().
  cv::Point pixel(std::size_t i) const { return {x_[i], y_[i]}; }

  /// Returns the features whose pixels lie inside the box, which may lie outside the image; its
  /// right and lower edges do not belong to it. The result is valid until the next call of `read`,
  /// `inside` or `sort_by_instance`: use one result at a time. Write the type, cv::Rect(x, y,
  /// width, height), because bare braces are ambiguous. O(features near the box).
  FeatureIndices inside(const cv::Rect& box) { return inside(detail::bounds_of(box)); }

  /// Returns the features inside bounds, for the library's own stages: a rectangle whose width or
  /// height may exceed int.
  FeatureIndices inside(const detail::PixelBounds& bounds) {
    std::uint32_t* end = found_.data();
    if (bounds.empty()) return {end, end};
    const int first_column = along(bounds.first_x, cell_shift_);
    const int last_column = along(bounds.last_x, cell_shift_);
    const int last_row = along(bounds.last_y, cell_shift_);
    for (int row = along(bounds.first_y, cell_shift_); row <= last_row; ++row) {
      // The cells of a row follow each other.
      const auto first = static_cast<std::size_t>(row * grid_cells + first_column);
      const auto last = static_cast<std::size_t>(row * grid_cells + last_column);
      const std::size_t end_slot = cell_begins_[last + 1];
      for (std::size_t slot = cell_begins_[first]; slot < end_slot; ++slot) {
        const std::uint32_t i = sorted_[slot];
        *end = i;  // the next one overwrites what is not inside
        end += bounds.contains(x_[i], y_[i]) ? 1 : 0;
      }
    }
    return {found_.data(), end};
  }

  /// Returns the features that were removed for an instance when sort_by_instance was last called.
  /// Call it first: before that, and for an instance that its labels did not have, the result is
  /// undefined.
  FeatureIndices removed_for(std::size_t instance) const {
    const std::uint32_t* const first = by_instance_.data();
    return {first + instance_begins_[instance], first + instance_begins_[instance + 1]};
  }

  /// Prepares removed_for: sorts the features that `labels` has removed for this reason by their
  /// instance. Call it again when the labels or the features have changed. `labels` must be those
  /// of the features. O(features + instances).
  void sort_by_instance(const FeatureLabels& labels, Reason reason) {
    std::uint32_t* end = found_.data();
    for (std::uint32_t i = 0; i < labels.size(); ++i) {
      const FeatureLabel& label = labels[i];
      *end = i;
      end += (label.removed & (label.reason == reason) & (label.instance >= 0)) ? 1 : 0;
    }
    const FeatureIndices removed(found_.data(), end);
    const auto instance_of = [&labels](std::uint32_t i) {
      return static_cast<std::size_t>(labels[i].instance);
    };
    by_instance_.resize(size());
    instance_begins_.assign(labels.statistics().instances.size() + 2, 0);
    for (const std::uint32_t i : removed) ++instance_begins_[instance_of(i) + 2];
    add_up(instance_begins_);
    for (const std::uint32_t i : removed) by_instance_[instance_begins_[instance_of(i) + 1]++] = i;
  }

 private:
  static constexpr int grid_cells = 32;                        // each way
  static constexpr unsigned max_coordinate = (1U << 16U) - 1;  // on the grid, of any image's pixel

  /// Sorts the features by cell (counting sort). The grid spans the coordinates that they have.
  void sort_into_cells() {
    unsigned bits = 0;  // set in some coordinate, of features that are not far outside all images
    for (std::size_t i = 0; i < size(); ++i) {
      const unsigned of_both = static_cast<unsigned>(x_[i]) | static_cast<unsigned>(y_[i]);
      if (of_both <= max_coordinate) bits |= of_both;
    }
    int shift = 0;
    while (bits >> shift >= grid_cells) ++shift;
    cell_shift_ = shift;
    cell_begins_.assign(std::size_t{grid_cells} * grid_cells + 2, 0);
    cells_.resize(size());
    sorted_.resize(size());
    for (std::size_t i = 0; i < size(); ++i) {
      cells_[i] =
          static_cast<std::uint32_t>(along(y_[i], shift) * grid_cells + along(x_[i], shift));
    }
    for (const std::uint32_t cell : cells_) ++cell_begins_[cell + 2];
    add_up(cell_begins_);
    for (std::uint32_t i = 0; i < size(); ++i) sorted_[cell_begins_[cells_[i] + 1]++] = i;
  }

  /// Turns counts into start offsets of the parts of a counting sort, one place late: part k starts
  /// at [k + 1]. Filling a part advances its offset to the part's end, so that afterwards part k
  /// lies between [k] and [k + 1].
  static void add_up(std::vector<std::uint32_t>& counts) {
    for (std::size_t k = 2; k < counts.size(); ++k) counts[k] += counts[k - 1];
  }

  /// Column or row of cells of a coordinate. Features left of the grid or above it are in its first
  /// one, features beyond it in its last.
  static int along(int coordinate, int cell_shift) {
    return std::min(std::max(coordinate, 0) >> cell_shift, grid_cells - 1);
  }

  bool is_kept_ = false;  // by a Reading
  FeaturesView view_;
  std::vector<int> x_, y_;                      // the pixels
  std::vector<std::uint32_t> found_;            // the last answer of inside
  std::vector<std::uint32_t> by_instance_;      // features removed for instance 0, 1, …
  std::vector<std::uint32_t> instance_begins_;  // of each instance's part, and the end
  int cell_shift_ = 0;                          // a cell is 2^shift pixels wide and high
  std::vector<std::uint32_t> cells_;            // the cell of each feature
  std::vector<std::uint32_t> sorted_;           // features by cell, row by row
  std::vector<std::uint32_t> cell_begins_;      // of each cell's part, and the end
};

/// Returns the input's features for a stage. A pipeline has read them for all its stages; for a
/// stage that is called on its own, this function reads them. O(features) at most.
inline FrameFeatures& frame_features(const FeaturesView& features, Workspace& workspace) {
  FrameFeatures& result = workspace.get<FrameFeatures>();
  if (!result.keeps(features)) result.read(features);
  return result;
}

}  // namespace dynfilter

#endif  // DYNFILTER_FRAME_FEATURES_HPP
