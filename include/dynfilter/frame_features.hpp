// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/features.hpp"

namespace dynfilter {

/// Pixels of one frame's features, and the features inside a box. Stages find it in their input,
/// FilterInput::index. The features are sorted into strips of columns once, so that a box costs
/// only the features of its strips. Queries may nest, and many threads may ask at once.
class FrameFeatures {
  /// Feature in its strip.
  struct Place {
    cv::Point pixel;
    std::uint32_t feature;
  };

 public:
  /// Features inside bounds, in no specified order, for a range-based for loop.
  struct Inside {
    /// Walks over the features.
    struct Iterator {
      const Inside* range;  ///< what it walks over
      const Place* place;   ///< where it is

      /// Index of the feature.
      std::uint32_t operator*() const { return place->feature; }
      /// Goes on to the next feature.
      Iterator& operator++() { return *this = range->first_from(place + 1); }
      /// Whether the walk is at another place.
      bool operator!=(const Iterator& other) const { return place != other.place; }
    };

    detail::PixelBounds bounds;  ///< what the features are inside
    const Place* first;          ///< first feature of the strips that meet the bounds
    const Place* past_end;       ///< end of those features

    /// First feature.
    Iterator begin() const { return first_from(first); }
    /// End of the features.
    Iterator end() const { return {this, past_end}; }
    /// First feature inside from a place on.
    Iterator first_from(const Place* place) const {
      while (place != past_end && !bounds.contains(place->pixel.x, place->pixel.y)) ++place;
      return {this, place};
    }
  };

  /// Reads the features' pixels, reusing memory. O(features).
  void read(FeaturesView features) {
    pixels_.resize(features.size());
    places_.resize(features.size());
    // A counting sort. Counts stand two places late: strip k starts at [k + 1] then, which filling
    // it advances to its end, so that at last strip k lies between [k] and [k + 1].
    strip_begins_.fill(0);
    for (std::size_t i = 0; i < size(); ++i) {
      pixels_[i] = features.pixel(i);
      ++strip_begins_[strip_of(pixels_[i].x) + 2];
    }
    std::partial_sum(strip_begins_.begin(), strip_begins_.end(), strip_begins_.begin());
    for (std::uint32_t i = 0; i < size(); ++i) {
      places_[strip_begins_[strip_of(pixels_[i].x) + 1]++] = {pixels_[i], i};
    }
  }

  /// Number of features.
  std::size_t size() const { return pixels_.size(); }

  /// Pixel of feature i, as FeaturesView::pixel returns it. i must be below size().
  cv::Point pixel(std::size_t i) const { return pixels_[i]; }

  /// Returns the features whose pixels lie inside the box. The box may lie outside the image; its
  /// right and lower edges do not belong to it. The result refers to this object and is valid until
  /// other features are read. Write the type, cv::Rect(x, y, width, height), because bare braces
  /// are ambiguous. O(features in the box's strips).
  Inside inside(const cv::Rect& box) const { return inside(detail::bounds_of(box)); }

  /// Returns the features inside bounds, for the library's own stages: a rectangle whose width or
  /// height may exceed int.
  Inside inside(const detail::PixelBounds& bounds) const {
    if (bounds.empty()) return {bounds, nullptr, nullptr};
    const Place* const places = places_.data();
    return {bounds, places + strip_begins_[strip_of(bounds.first_x)],
            places + strip_begins_[strip_of(bounds.last_x) + 1]};
  }

 private:
  // A fixed number, so that no frame needs more memory. The last one holds all columns beyond.
  static constexpr int strips = 512, strip_px = 16;

  static std::size_t strip_of(int x) {
    return static_cast<std::size_t>(std::clamp(x, 0, strips * strip_px - 1) / strip_px);
  }

  std::vector<cv::Point> pixels_;
  std::vector<Place> places_;  // features by strip
  std::array<std::uint32_t, strips + 2> strip_begins_ = {};
};

}  // namespace dynfilter
