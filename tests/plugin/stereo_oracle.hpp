// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "plugin/stereo_depths.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

/// StereoDepths in images 640 pixels wide, with its default options, written for the eye: each step
/// is a loop over all that there is.
class StereoOracle {
 public:
  explicit StereoOracle(const StereoPair& pair) : pair_(pair) {}

  std::vector<float> find(const std::vector<cv::Point>& pixels) const {
    std::vector<double> disparities;
    for (const cv::Point& pixel : pixels) disparities.push_back(disparity_at(pixel));
    std::size_t possible = 0, matched = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      possible += can_match(pixels[i]) ? 1 : 0;
      matched += disparities[i] > 0 ? 1 : 0;
    }
    std::vector<float> depths_m;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const bool is_missing =
          disparities[i] == 0 && can_match(pixels[i]) && 2 * matched >= possible;
      const double disparity =
          is_missing ? disparity_behind(i, pixels, disparities) : disparities[i];
      depths_m.push_back(disparity > 0 ? static_cast<float>(pair_.focal_baseline / disparity) : 0);
    }
    return depths_m;
  }

 private:
  struct Place {
    double x;
    double difference;
  };

  static bool fits(const cv::Point& p) { return p.x >= 3 && p.x < 637 && p.y >= 3; }

  bool can_match(const cv::Point& pixel) const {
    return fits(pixel) && pixel.y < pair_.left.rows - 3 &&
           pixel.x + 1 - std::max(3, pixel.x - reach()) >= 4;
  }

  int reach() const { return static_cast<int>(std::min(640.0, pair_.focal_baseline / 0.8)); }

  /// Patch around a pixel, relative to its mean.
  static cv::Mat patch(const cv::Mat& image, const cv::Point& centre) {
    cv::Mat values;
    image(cv::Rect(centre.x - 3, centre.y - 3, 7, 7)).convertTo(values, CV_64F);
    return values - std::floor(cv::mean(values)[0] + 0.5);
  }

  static std::optional<Place> search(const cv::Mat& from, const cv::Point& pixel, const cv::Mat& to,
                                     int first_x, int last_x, bool is_unique) {
    std::vector<Place> places;
    for (int x = std::max(3, first_x); x <= std::min(636, last_x); ++x) {
      places.push_back(
          {double(x), cv::norm(patch(from, pixel), patch(to, {x, pixel.y}), cv::NORM_L1)});
    }
    std::size_t best = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i].difference < places[best].difference) best = i;
    }
    if (best == 0 || best + 1 >= places.size()) return {};
    for (const Place& other : places) {
      const bool is_other = std::abs(other.x - places[best].x) > 2;
      if (is_unique && is_other && other.difference <= 1.15 * places[best].difference) return {};
    }
    const double before = places[best - 1].difference - places[best].difference;
    const double after = places[best + 1].difference - places[best].difference;
    const double shift = before + after > 0 ? 0.5 * (before - after) / (before + after) : 0;
    return Place{places[best].x + shift, places[best].difference};
  }

  double disparity_at(const cv::Point& pixel) const {
    if (!can_match(pixel)) return 0;
    const auto there = search(pair_.left, pixel, pair_.right, pixel.x - reach(), pixel.x + 1, true);
    const double contrast = cv::norm(patch(pair_.left, pixel), cv::NORM_L1);
    if (!there || there->difference > 0.5 * contrast + 49) return 0;
    const cv::Point place(cvRound(there->x), pixel.y);
    const auto back = search(pair_.right, place, pair_.left, place.x - 1, place.x + reach(), false);
    const double disparity = pixel.x - there->x;
    if (!back || std::abs(back->x - place.x - disparity) > 1.5) return 0;
    return double{static_cast<float>(std::max(disparity, 0.25))};
  }

  static double disparity_behind(std::size_t hidden, const std::vector<cv::Point>& pixels,
                                 const std::vector<double>& disparities) {
    double farthest = 1e9;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (disparities[i] > 0 && cv::norm(pixels[i] - pixels[hidden]) <= 140) {
        farthest = std::min(farthest, disparities[i]);
      }
    }
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const cv::Point way = pixels[i] - pixels[hidden];
      const double strip = disparities[i] - farthest;
      if (disparities[i] > 0 && strip >= 2 && strip <= 60 && way.x > 0 && way.x <= strip + 3 &&
          std::abs(way.y) <= 30 && pixels[hidden].x - disparities[i] >= 3) {
        return farthest;
      }
    }
    return 0;
  }

  StereoPair pair_;
};

}  // namespace dynfilter::testing
