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
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Pixels of one frame's features, and the features inside a box. Stages get it from
/// frame_features.
///
/// The features are sorted into the cells of a grid once, so that a box costs only the features
/// near it, however many features and boxes there are. A query holds no memory: queries may nest,
/// and many threads may ask at once.
class FrameFeatures {
 public:
  /// Reads the features' pixels, reusing memory. O(features).
  void read(FeaturesView features) {
    is_kept_ = false;
    view_ = features;
    x_.resize(features.size());
    y_.resize(features.size());
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

  class Inside;

  /// Returns the indices of the features whose pixels lie inside the box, for a range-based for
  /// loop, in no specified order. The box may lie outside the image; its right and lower edges do
  /// not belong to it. The result refers to this object and is valid until the next call of `read`.
  /// Write the type, cv::Rect(x, y, width, height), because bare braces are ambiguous. O(features
  /// near the box).
  Inside inside(const cv::Rect& box) const;

  /// Returns the features inside bounds, for the library's own stages: a rectangle whose width or
  /// height may exceed int.
  Inside inside(const detail::PixelBounds& bounds) const;

 private:
  static constexpr int max_coordinate = (1 << 16) - 1;  // on the grid, of any image's pixel

  /// Feature in its cell.
  struct Place {
    int x, y;
    std::uint32_t feature;
  };

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
  int cell_shift_ = 0;                      // a cell is 2^shift pixels wide and high
  int columns_ = 1, rows_ = 1;              // of cells
  std::vector<std::uint32_t> cells_;        // the cell of each feature
  std::vector<Place> places_;               // features by cell, row by row
  std::vector<std::uint32_t> cell_begins_;  // of each cell's part, and the end
};

/// Answer of FrameFeatures::inside: walks through the cells that meet the bounds.
class FrameFeatures::Inside {
 public:
  /// End of every walk.
  struct End {};

  /// Place of the walk.
  class Iterator {
   public:
    /// Index of the feature.
    std::uint32_t operator*() const { return place_->feature; }
    /// Goes on to the next feature inside.
    Iterator& operator++() {
      ++place_;
      find_next();
      return *this;
    }
    /// Whether there is a feature.
    bool operator!=(End) const { return place_ != nullptr; }

   private:
    friend class Inside;

    explicit Iterator(const Inside& range) : range_(range), row_(range.first_row_) {
      if (range_.bounds_.empty()) return;
      enter_row();
      find_next();
    }

    /// Goes to the cells of a row, which follow each other.
    void enter_row() {
      const FrameFeatures& features = *range_.features_;
      const auto first = static_cast<std::size_t>(row_ * features.columns_ + range_.first_column_);
      const auto last = static_cast<std::size_t>(row_ * features.columns_ + range_.last_column_);
      place_ = features.places_.data() + features.cell_begins_[first];
      row_end_ = features.places_.data() + features.cell_begins_[last + 1];
    }

    void find_next() {
      for (;;) {
        while (place_ != row_end_ && !range_.bounds_.contains(place_->x, place_->y)) ++place_;
        if (place_ != row_end_) return;
        if (row_ == range_.last_row_) break;
        ++row_;
        enter_row();
      }
      place_ = nullptr;
    }

    const Inside& range_;
    int row_;
    const Place* place_ = nullptr;
    const Place* row_end_ = nullptr;
  };

  /// First feature.
  Iterator begin() const { return Iterator(*this); }
  /// End of the features.
  End end() const { return {}; }

 private:
  friend class FrameFeatures;

  Inside(const FrameFeatures& features, const detail::PixelBounds& bounds)
      : features_(&features), bounds_(bounds) {
    if (bounds.empty()) return;
    first_column_ = along(bounds.first_x, features.columns_, features.cell_shift_);
    last_column_ = along(bounds.last_x, features.columns_, features.cell_shift_);
    first_row_ = along(bounds.first_y, features.rows_, features.cell_shift_);
    last_row_ = along(bounds.last_y, features.rows_, features.cell_shift_);
  }

  const FrameFeatures* features_;
  detail::PixelBounds bounds_;
  int first_column_ = 0, last_column_ = 0, first_row_ = 0, last_row_ = 0;
};

inline FrameFeatures::Inside FrameFeatures::inside(const cv::Rect& box) const {
  return {*this, detail::bounds_of(box)};
}

inline FrameFeatures::Inside FrameFeatures::inside(const detail::PixelBounds& bounds) const {
  return {*this, bounds};
}

/// Returns the input's features for a stage. A pipeline has read them for all its stages; for a
/// stage that is called on its own, this function reads them. O(features) at most.
inline FrameFeatures& frame_features(const FeaturesView& features, Workspace& workspace) {
  FrameFeatures& result = workspace.get<FrameFeatures>();
  if (!result.keeps(features)) result.read(features);
  return result;
}

}  // namespace dynfilter

#endif  // DYNFILTER_FRAME_FEATURES_HPP
