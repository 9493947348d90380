// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_REGION_BAYES_HPP
#define DYNFILTER_SRC_LAB_RULES_REGION_BAYES_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "lab/rules/frame_pair.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

/// SMR's removal of regions (J. Cheng et al., "Improving Visual Localization Accuracy in Dynamic
/// Environments Based on Dynamic Region Removal", IEEE T-ASE 2020). The image is divided into
/// regions. A region's evidence is how similar it is to the last frame, and how different from it
/// once the camera's motion is compensated; a Bayes filter turns it into a probability, and the
/// features of regions that probably move are removed.
///
/// Open in the source: everything but this outline; all constants are ours. The difference is the
/// mean absolute one, of the earlier image compensated by depth and FrameMemory's pose, or of the
/// earlier image itself (similarity) if that is smaller. A region without depth, and all where the
/// camera's motion is unknown, gain no evidence, and beliefs fade to the prior, one half.
class RegionBayes {
 public:
  static constexpr int baseline_frames = 1;

  void operator()(const FramePair& pair, FeatureLabels& labels) {
    const auto cells = [](int pixels) { return (pixels + cell_px - 1) / cell_px; };
    const cv::Size size(cells(pair.image.cols), cells(pair.image.rows));
    if (pair.then == nullptr || log_odds_.size() != size) log_odds_ = cv::Mat1d(size, 0.0);
    if (pair.then == nullptr) return;
    for (int row = 0; row < size.height; ++row) {
      for (int column = 0; column < size.width; ++column) {
        const auto seen = difference(pair, row, column);
        const double evidence = seen ? log_likelihood_ratio(*seen) : 0;
        double& belief = log_odds_(row, column);
        belief = std::clamp(forgetting_factor * belief + evidence, -limit, limit);
      }
    }
    const cv::Rect image({0, 0}, pair.image.size());
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      const cv::Point pixel = pair.now.features.pixel(i);
      if (image.contains(pixel) && log_odds_(pixel.y / cell_px, pixel.x / cell_px) > 0) {
        remove(labels, i);
      }
    }
  }

  /// Returns the log-odds that each region moves, beyond the prior.
  const cv::Mat1d& log_odds() const { return log_odds_; }

 private:
  static constexpr int cell_px = 20;     // side of a region
  static constexpr int step_px = 4;      // every such pixel of a region is compared, each way
  static constexpr int min_samples = 5;  // pixels that a region needs
  // Difference of a static and of a moving region, grey levels: mean and standard deviation.
  // Chosen on rendered scenes of seed 11 and on frames composed of two recordings.
  static constexpr double static_mean = 4, static_deviation = 6;
  static constexpr double moving_mean = 25, moving_deviation = 12;
  static constexpr double forgetting_factor = 0.7;  // what is left of log-odds a frame later
  static constexpr double limit = 3;                // log-odds stay within minus and plus this

  /// Returns the brightness between pixels; none at the edge and beyond it.
  static std::optional<float> grey_at(const cv::Mat1b& image, cv::Point2f at) {
    if (!(at.x >= 0 && at.y >= 0 && at.x + 1 < static_cast<float>(image.cols) &&
          at.y + 1 < static_cast<float>(image.rows))) {
      return {};
    }
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y);
    const float right = at.x - static_cast<float>(x), down = at.y - static_cast<float>(y);
    const auto along = [&](int row) {
      return static_cast<float>(image(row, x)) * (1 - right) +
             static_cast<float>(image(row, x + 1)) * right;
    };
    return along(y) * (1 - down) + along(y + 1) * down;
  }

  /// Returns how much a region differs from the earlier image, grey levels: with compensation or
  /// without, whichever is less. None with too few pixels that can be compensated.
  static std::optional<double> difference(const FramePair& pair, int row, int column) {
    if (!pair.pose) return {};
    const int left = column * cell_px, top = row * cell_px;
    const int right = std::min(left + cell_px, pair.image.cols);
    const int bottom = std::min(top + cell_px, pair.image.rows);
    const cv::Mat1b then = pair.then->frame.image;
    double plain = 0, compensated = 0;
    int samples = 0;
    for (int y = top; y < bottom; y += step_px) {
      for (int x = left; x < right; x += step_px) {
        const auto depth_m = pair.now.frame.depth_m({x, y});
        if (!depth_m) continue;
        const cv::Point2f at(static_cast<float>(x), static_cast<float>(y));
        const cv::Point3d point = pair.camera.point(pair.camera.ideal(at), *depth_m);
        const auto place = pair.camera.project(*pair.pose * point);
        if (!place) continue;
        const auto now = grey_at(pair.image, at);
        const auto moved = grey_at(then, cv::Point2f(pair.camera.raw(*place)));
        if (!now || !moved) continue;
        compensated += double{std::abs(*now - *moved)};
        plain += std::abs(pair.image(y, x) - then(y, x));
        ++samples;
      }
    }
    if (samples < min_samples) return {};
    return std::min(plain, compensated) / samples;
  }

  static double log_likelihood_ratio(double difference) {
    const auto log_normal = [difference](double mean, double deviation) {
      const double scaled = (difference - mean) / deviation;
      return -0.5 * scaled * scaled - std::log(deviation);
    };
    // Below the static mean, and above the moving one, a region is not less so.
    const double is_static = difference < static_mean ? -std::log(static_deviation)
                                                      : log_normal(static_mean, static_deviation);
    const double is_moving = difference > moving_mean ? -std::log(moving_deviation)
                                                      : log_normal(moving_mean, moving_deviation);
    return is_moving - is_static;
  }

  cv::Mat1d log_odds_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_REGION_BAYES_HPP
