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
    lay_grid();
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
  /// right and lower edges do not belong to it. The result is valid until the next question or call
  /// of `read`: use one result at a time. Write the type, cv::Rect(x, y, width, height), because
  /// bare braces are ambiguous. O(features near the box).
  FeatureIndices inside(const cv::Rect& box) { return inside(detail::bounds_of(box)); }

  /// Returns the features inside bounds, for the library's own stages: a rectangle whose width or
  /// height may exceed int.
  FeatureIndices inside(const detail::PixelBounds& bounds) {
    return find(bounds, [](std::uint32_t) { return true; });
  }

  /// Returns the features inside the box that `labels` has not removed. `labels` must be those of
  /// the features. Otherwise as `inside`.
  FeatureIndices kept_inside(const cv::Rect& box, const FeatureLabels& labels) {
    return kept_inside(detail::bounds_of(box), labels);
  }

  /// Returns the features inside bounds that `labels` has not removed.
  FeatureIndices kept_inside(const detail::PixelBounds& bounds, const FeatureLabels& labels) {
    return find(bounds, [&labels](std::uint32_t i) { return !labels.is_removed(i); });
  }

  /// Returns the features inside the box that `labels` has removed for an instance, for a reason.
  /// `labels` must be those of the features. Otherwise as `inside`.
  FeatureIndices removed_inside(const cv::Rect& box, const FeatureLabels& labels,
                                std::size_t instance, Reason reason) {
    return find(detail::bounds_of(box), [=, &labels](std::uint32_t i) {
      const FeatureLabel& label = labels[i];
      return label.removed & (label.reason == reason) &
             (label.instance == static_cast<std::int32_t>(instance));
    });
  }

 private:
  static constexpr int max_coordinate = (1 << 16) - 1;  // on the grid, of any image's pixel

  /// Feature in its cell.
  struct Place {
    int x, y;
    std::uint32_t feature;
  };

  /// Returns the features inside bounds that a condition holds for.
  template <class Condition>
  FeatureIndices find(const detail::PixelBounds& bounds, const Condition& condition) {
    std::uint32_t* end = found_.data();
    if (bounds.empty()) return {end, end};
    const int first_column = along(bounds.first_x, columns_, cell_shift_);
    const int last_column = along(bounds.last_x, columns_, cell_shift_);
    const int last_row = along(bounds.last_y, rows_, cell_shift_);
    for (int row = along(bounds.first_y, rows_, cell_shift_); row <= last_row; ++row) {
      // The cells of a row follow each other.
      const auto first = static_cast<std::size_t>(row * columns_ + first_column);
      const auto last = static_cast<std::size_t>(row * columns_ + last_column);
      const Place* place = places_.data() + cell_begins_[first];
      const Place* const row_end = places_.data() + cell_begins_[last + 1];
      for (; place != row_end; ++place) {
        *end = place->feature;  // the next one overwrites what is not wanted
        const bool is_inside = bounds.contains(place->x, place->y);
        end += (is_inside & condition(place->feature)) ? 1 : 0;
      }
    }
    return {found_.data(), end};
  }

  /// Number of cells, at most: one for about two features.
  std::size_t max_cells() const { return 64 + size() / 2; }

  /// Chooses the width of the grid's cells, and how many they are. The grid spans the coordinates
  /// that features in images have.
  void lay_grid() {
    const int max_x = max_of(x_), max_y = max_of(y_);
    const auto cells = [&](int shift) {
      return (std::int64_t{max_x >> shift} + 1) * ((max_y >> shift) + 1);
    };
    cell_shift_ = 0;
    while (cells(cell_shift_) > static_cast<std::int64_t>(max_cells())) ++cell_shift_;
    columns_ = (max_x >> cell_shift_) + 1;
    rows_ = (max_y >> cell_shift_) + 1;
  }

  /// Returns the largest coordinate that a pixel of an image may have; 0 if there is none.
  static int max_of(const std::vector<int>& coordinates) {
    int result = 0;
    for (const int coordinate : coordinates) {
      result = std::max(result, coordinate <= max_coordinate ? coordinate : 0);
    }
    return result;
  }

  /// Sorts the features by cell (counting sort).
  void sort_into_cells() {
    cell_begins_.reserve(max_cells() + 2);  // the same for all frames of as many features
    cell_begins_.assign(static_cast<std::size_t>(columns_ * rows_) + 2, 0);
    cells_.resize(size());
    places_.resize(size());
    // Copies, because compilers must assume that writing cells changes members.
    const int columns = columns_, rows = rows_, shift = cell_shift_;
    for (std::size_t i = 0; i < size(); ++i) {
      cells_[i] = static_cast<std::uint32_t>(along(y_[i], rows, shift) * columns +
                                             along(x_[i], columns, shift));
    }
    for (const std::uint32_t cell : cells_) ++cell_begins_[cell + 2];
    add_up(cell_begins_);
    for (std::uint32_t i = 0; i < size(); ++i) {
      Place& place = places_[cell_begins_[cells_[i] + 1]++];
      place.x = x_[i];
      place.y = y_[i];
      place.feature = i;
    }
  }

  /// Turns counts into start offsets of the parts of a counting sort, one place late: part k starts
  /// at [k + 1]. Filling a part advances its offset to the part's end, so that afterwards part k
  /// lies between [k] and [k + 1].
  static void add_up(std::vector<std::uint32_t>& counts) {
    for (std::size_t k = 2; k < counts.size(); ++k) counts[k] += counts[k - 1];
  }

  /// Column or row of cells that a coordinate lies in. What is left of the grid or above it is in
  /// the first one, what is beyond it in the last.
  static int along(int coordinate, int cells, int cell_shift) {
    return std::min(std::max(coordinate, 0) >> cell_shift, cells - 1);
  }

  bool is_kept_ = false;  // by a Reading
  FeaturesView view_;
  std::vector<int> x_, y_;                  // the pixels
  std::vector<std::uint32_t> found_;        // the last answer
  int cell_shift_ = 0;                      // a cell is 2^shift pixels wide and high
  int columns_ = 1, rows_ = 1;              // of cells
  std::vector<std::uint32_t> cells_;        // the cell of each feature
  std::vector<Place> places_;               // features by cell, row by row
  std::vector<std::uint32_t> cell_begins_;  // of each cell's part, and the end
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
