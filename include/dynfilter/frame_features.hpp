// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FRAME_FEATURES_HPP
#define DYNFILTER_FRAME_FEATURES_HPP

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
/// FilterInput::index.
///
/// The features are sorted into strips of columns once, so that a box costs only the features of
/// its strips, however many features and boxes there are. A query holds no memory: queries may
/// nest, and many threads may ask at once.
class FrameFeatures {
 public:
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

  class Inside;

  /// Returns the indices of the features whose pixels lie inside the box, for a range-based for
  /// loop, in no specified order. The box may lie outside the image; its right and lower edges do
  /// not belong to it. The result refers to this object and is valid until other features are read.
  /// Write the type, cv::Rect(x, y, width, height), because bare braces are ambiguous. O(features
  /// in the box's strips).
  Inside inside(const cv::Rect& box) const;

  /// Returns the features inside bounds, for the library's own stages: a rectangle whose width or
  /// height may exceed int.
  Inside inside(const detail::PixelBounds& bounds) const;

 private:
  // A fixed number, so that no frame needs more memory. The last one holds all columns beyond.
  static constexpr int strips = 512, strip_px = 16;

  /// Feature in its strip.
  struct Place {
    cv::Point pixel;
    std::uint32_t feature;
  };

  static std::size_t strip_of(int x) {
    return static_cast<std::size_t>(std::clamp(x, 0, strips * strip_px - 1) / strip_px);
  }

  std::vector<cv::Point> pixels_;
  std::vector<Place> places_;  // features by strip
  std::array<std::uint32_t, strips + 2> strip_begins_ = {};
};

/// Answer of FrameFeatures::inside: walks through the strips that meet the bounds.
class FrameFeatures::Inside {
 public:
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
    /// Whether the walk is at another place.
    bool operator!=(const Iterator& other) const { return place_ != other.place_; }

   private:
    friend class Inside;

    Iterator(const Inside& range, const Place* place) : range_(range), place_(place) {
      find_next();
    }

    void find_next() {
      while (place_ != range_.end_ && !range_.bounds_.contains(place_->pixel.x, place_->pixel.y)) {
        ++place_;
      }
    }

    const Inside& range_;
    const Place* place_;
  };

  /// First feature.
  Iterator begin() const { return {*this, begin_}; }
  /// End of the features.
  Iterator end() const { return {*this, end_}; }

 private:
  friend class FrameFeatures;

  Inside(const FrameFeatures& features, const detail::PixelBounds& bounds) : bounds_(bounds) {
    if (bounds.empty()) return;
    begin_ = features.places_.data() + features.strip_begins_[strip_of(bounds.first_x)];
    end_ = features.places_.data() + features.strip_begins_[strip_of(bounds.last_x) + 1];
  }

  detail::PixelBounds bounds_;
  const Place *begin_ = nullptr, *end_ = nullptr;
};

inline FrameFeatures::Inside FrameFeatures::inside(const cv::Rect& box) const {
  return {*this, detail::bounds_of(box)};
}

inline FrameFeatures::Inside FrameFeatures::inside(const detail::PixelBounds& bounds) const {
  return {*this, bounds};
}

}  // namespace dynfilter

#endif  // DYNFILTER_FRAME_FEATURES_HPP
