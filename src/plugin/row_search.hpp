// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Search along a row of one image for a pixel of another one: both CV_8UC1 and of equal size.
/// Square patches are compared by the sum of absolute differences, each pixel relative to the
/// rounded mean of its patch, so that the images may differ in brightness.
class RowSearch {
 public:
  static constexpr int radius = 3;  ///< a patch is 2 * radius + 1 pixels wide and high
  static constexpr int width = 2 * radius + 1;
  static constexpr int area = width * width;  ///< pixels of a patch

  /// Place in the row.
  struct Match {
    double x = 0;        ///< column, with a fraction
    int difference = 0;  ///< of the patches, sum over their pixels
  };

  /// Makes room for images of this width.
  void reserve(int image_width) {
    const auto places = static_cast<std::size_t>(image_width);
    column_sums_.resize(places);
    means_.resize(places);
    differences_.resize(places);
  }

  /// Whether the patch around a pixel lies in the image.
  static bool fits(const cv::Mat& image, cv::Point pixel) {
    return pixel.x >= radius && pixel.y >= radius && pixel.x < image.cols - radius &&
           pixel.y < image.rows - radius;
  }

  /// Returns the sum of the differences between a patch's pixels and their mean. The patch must
  /// fit.
  static int contrast(const cv::Mat& image, cv::Point pixel) {
    const int mean = mean_around(image, pixel);
    int sum = 0;
    for (int v = -radius; v <= radius; ++v) {
      const std::uint8_t* const row = image.ptr<std::uint8_t>(pixel.y + v) + pixel.x;
      for (int u = -radius; u <= radius; ++u) sum += std::abs(row[u] - mean);
    }
    return sum;
  }

  /// Finds the place in the row of `pixel` of `to`, between two columns, whose patch differs least
  /// from that around `pixel` of `from`, which must fit; the leftmost one of several. A parabola
  /// through it and its neighbours gives the fraction. Returns nothing if the place is the first or
  /// the last one, or if there is another one, more than 2 px away, that differs by
  /// `min_distinction` times as much or less; 0 allows others. O(columns * area).
  std::optional<Match> find(const cv::Mat& from, cv::Point pixel, const cv::Mat& to, int first_x,
                            int last_x, double min_distinction) {
    first_x = std::max(first_x, radius);
    last_x = std::min(last_x, to.cols - 1 - radius);
    if (last_x - first_x < 2) return {};
    const int count = last_x - first_x + 1;
    find_means(to, {first_x, pixel.y}, count);
    find_differences(from, pixel, to, first_x, count);
    const auto begin = differences_.begin(), end = begin + count;
    const auto best = std::min_element(begin, end);
    if (best == begin || best == end - 1) return {};
    if (min_distinction > 0 && !(rival(begin, best, end) > min_distinction * *best)) return {};
    const int before = *(best - 1), after = *(best + 1), bend = before + after - 2 * *best;
    const double vertex = bend > 0 ? 0.5 * (before - after) / bend : 0;
    return Match{first_x + static_cast<double>(best - begin) + vertex, *best};
  }

 private:
  using Differences = std::vector<std::uint16_t>;  // a pixel's is at most 510, a patch's 24990

  static int mean_of(int sum) { return (sum + area / 2) / area; }

  static int mean_around(const cv::Mat& image, cv::Point pixel) {
    int sum = 0;
    for (int v = -radius; v <= radius; ++v) {
      const std::uint8_t* const row = image.ptr<std::uint8_t>(pixel.y + v) + pixel.x;
      for (int u = -radius; u <= radius; ++u) sum += row[u];
    }
    return mean_of(sum);
  }

  /// Finds the means of the patches around `count` pixels that follow each other.
  void find_means(const cv::Mat& image, cv::Point first, int count) {
    std::fill_n(column_sums_.begin(), count + 2 * radius, std::uint16_t{0});
    for (int v = -radius; v <= radius; ++v) {
      const std::uint8_t* const row = image.ptr<std::uint8_t>(first.y + v) + first.x - radius;
      for (int i = 0; i < count + 2 * radius; ++i) {
        column_sums_[static_cast<std::size_t>(i)] += row[i];
      }
    }
    const std::uint16_t* const sums = column_sums_.data();
    int sum = 0;
    for (int i = 0; i < width - 1; ++i) sum += sums[i];
    for (int i = 0; i < count; ++i) {
      sum += sums[i + width - 1];
      means_[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(mean_of(sum));
      sum -= sums[i];
    }
  }

  /// Compares the patch with those of all places, in blocks of a fixed length, which compilers turn
  /// into vector instructions. The last block may overlap the one before.
  void find_differences(const cv::Mat& from, cv::Point pixel, const cv::Mat& to, int first_x,
                        int count) {
    constexpr int block = 32;
    const int mean = mean_around(from, pixel);
    if (count < block) {
      for (int i = 0; i < count; ++i) compare<1>(from, pixel, mean, to, first_x, i);
      return;
    }
    for (int i = 0; i < count; i += block) {
      compare<block>(from, pixel, mean, to, first_x, std::min(i, count - block));
    }
  }

  /// Compares the patch with those of `places` places, from the `first` one on.
  template <int places>
  void compare(const cv::Mat& from, cv::Point pixel, int mean, const cv::Mat& to, int first_x,
               int first) {
    std::uint16_t sums[places] = {};
    std::int16_t means[places];
    std::copy_n(means_.begin() + first, places, means);
    for (int v = -radius; v <= radius; ++v) {
      const std::uint8_t* const patch = from.ptr<std::uint8_t>(pixel.y + v) + pixel.x;
      const std::uint8_t* const row = to.ptr<std::uint8_t>(pixel.y + v) + first_x + first;
      for (int u = -radius; u <= radius; ++u) {
        const int value = patch[u] - mean;
        for (int i = 0; i < places; ++i) {
          const auto difference = static_cast<std::int16_t>(value + means[i] - row[u + i]);
          sums[i] = static_cast<std::uint16_t>(sums[i] + std::abs(difference));
        }
      }
    }
    std::copy_n(sums, places, differences_.begin() + first);
  }

  /// Returns the smallest difference more than 2 px away from the best place.
  static int rival(Differences::const_iterator begin, Differences::const_iterator best,
                   Differences::const_iterator end) {
    int smallest = std::numeric_limits<int>::max();
    for (auto place = begin; place != end; ++place) {
      if (std::abs(place - best) > 2) smallest = std::min<int>(smallest, *place);
    }
    return smallest;
  }

  std::vector<std::uint16_t> column_sums_;
  std::vector<std::int16_t> means_;
  Differences differences_;
};

}  // namespace dynfilter::detail
