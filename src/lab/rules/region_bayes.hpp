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
#include "motion/patch.hpp"

namespace dynfilter::peers {

struct RegionBayesOptions {
  int baseline_frames = 1;  ///< frames between the two images
  int cell_px = 20;         ///< side of a region
  int step_px = 4;          ///< every such pixel of a region is compared, each way
  int min_samples = 5;      ///< pixels that a region needs
  /// @{
  /// Difference of a static and of a moving region, grey levels: mean and standard deviation.
  /// Chosen on rendered scenes of seed 11 and on frames composed of two recordings.
  double static_mean = 4, static_deviation = 6;
  double moving_mean = 25, moving_deviation = 12;
  /// @}
  double prior = 0.5;              ///< probability that a region moves, without evidence
  double forgetting_factor = 0.7;  ///< share of a region's log-odds that is left a frame later
  double limit = 3;                ///< log-odds stay within minus and plus this
  double min_dynamic = 0.5;        ///< above this probability, a region's features are removed
};

/// Memory of RegionBayes: log-odds of each region beyond the prior. One for each rule and scene.
struct RegionBeliefs {
  cv::Mat1d log_odds;
};

/// SMR's removal of regions (J. Cheng et al., "Improving Visual Localization Accuracy in Dynamic
/// Environments Based on Dynamic Region Removal", IEEE T-ASE 2020). The image is divided into
/// regions. A region's evidence is how similar it is to the last frame, and how different from it
/// once the camera's motion is compensated; a Bayes filter turns it into a probability, and the
/// features of regions that probably move are removed.
///
/// Open in the source: everything but this outline; each constant is an option. Here the difference
/// is the mean absolute one of the region's pixels. The earlier image is compensated pixel by
/// pixel, by depth and FrameMemory's pose. A region that looks the same without compensation
/// (similarity) is as static as one that does with it: the smaller difference counts. Its
/// likelihoods are normal distributions that stay flat below the static and above the moving mean,
/// and beliefs fade to the prior. A region without depth, and
/// all where the camera's motion is unknown, gain no evidence. It needs no masks. O(pixels).
class RegionBayes {
 public:
  /// Takes the memory, which must outlive the rule. Throws std::invalid_argument for options out of
  /// range.
  explicit RegionBayes(RegionBeliefs& memory, const RegionBayesOptions& options = {})
      : memory_(&memory), options_(options) {
    require_option(options_.baseline_frames >= 1 && options_.cell_px >= 1 &&
                       options_.step_px >= 1 && options_.min_samples >= 1,
                   "peers::RegionBayes: baseline_frames, cell_px, step_px and min_samples must be "
                   "1 or more");
    require_option(options_.static_deviation > 0 && options_.moving_deviation > 0,
                   "peers::RegionBayes: deviations must be above 0");
    const auto is_probability = [](double value) { return value > 0 && value < 1; };
    require_option(is_probability(options_.prior) && is_probability(options_.min_dynamic) &&
                       options_.forgetting_factor >= 0 && options_.forgetting_factor <= 1 &&
                       options_.limit >= 0,
                   "peers::RegionBayes: prior and min_dynamic must be between 0 and 1, "
                   "forgetting_factor 0 to 1, limit 0 or more");
  }

  int baseline_frames() const { return options_.baseline_frames; }

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    cv::Mat1d& beliefs = memory_->log_odds;
    const auto cells = [&](int pixels) {
      return (pixels + options_.cell_px - 1) / options_.cell_px;
    };
    const cv::Size size(cells(pair.image.cols), cells(pair.image.rows));
    if (pair.then == nullptr || beliefs.size() != size) beliefs = cv::Mat1d(size, 0.0);
    if (pair.then == nullptr) return;
    for (int row = 0; row < size.height; ++row) {
      for (int column = 0; column < size.width; ++column) {
        const auto seen = difference(pair, row, column);
        const double evidence = seen ? log_likelihood_ratio(*seen) : 0;
        double& belief = beliefs(row, column);
        belief = std::clamp(options_.forgetting_factor * belief + evidence, -options_.limit,
                            options_.limit);
      }
    }
    const auto log_odds = [](double probability) {
      return std::log(probability / (1 - probability));
    };
    const double min_belief = log_odds(options_.min_dynamic) - log_odds(options_.prior);
    const cv::Rect image({0, 0}, pair.image.size());
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      const cv::Point pixel = pair.now.features.pixel(i);
      if (!image.contains(pixel)) continue;
      if (beliefs(pixel.y / options_.cell_px, pixel.x / options_.cell_px) > min_belief) {
        labels.remove(i, -1, Reason::custom, 1.0F);
      }
    }
  }

 private:
  /// Returns how much a region differs from the earlier image, grey levels: with compensation or
  /// without, whichever is less. None with too few pixels that can be compensated.
  std::optional<double> difference(const FramePair& pair, int row, int column) const {
    if (!pair.pose) return {};
    const int left = column * options_.cell_px, top = row * options_.cell_px;
    const int right = std::min(left + options_.cell_px, pair.image.cols);
    const int bottom = std::min(top + options_.cell_px, pair.image.rows);
    const cv::Mat1b then = pair.then->frame.image;
    double plain = 0, compensated = 0;
    int samples = 0;
    for (int y = top; y < bottom; y += options_.step_px) {
      for (int x = left; x < right; x += options_.step_px) {
        const auto depth_m = pair.now.frame.depth_m({x, y});
        if (!depth_m) continue;
        const cv::Point2f at(static_cast<float>(x), static_cast<float>(y));
        const cv::Point3d point = pair.camera.point(pair.camera.ideal(at), *depth_m);
        const auto place = pair.camera.project(*pair.pose * point);
        if (!place) continue;
        const auto now = detail::Patch::at(pair.image, at, 0);
        const auto moved = detail::Patch::at(then, cv::Point2f(pair.camera.raw(*place)), 0);
        if (!now || !moved) continue;
        compensated += double{std::abs((*now)(0, 0) - (*moved)(0, 0))};
        plain += std::abs(pair.image(y, x) - then(y, x));
        ++samples;
      }
    }
    if (samples < options_.min_samples) return {};
    return std::min(plain, compensated) / samples;
  }

  double log_likelihood_ratio(double difference) const {
    const auto log_normal = [difference](double mean, double deviation) {
      const double scaled = (difference - mean) / deviation;
      return -0.5 * scaled * scaled - std::log(deviation);
    };
    // Below the static mean, and above the moving one, a region is not less so.
    const double is_static = difference < options_.static_mean
                                 ? -std::log(options_.static_deviation)
                                 : log_normal(options_.static_mean, options_.static_deviation);
    const double is_moving = difference > options_.moving_mean
                                 ? -std::log(options_.moving_deviation)
                                 : log_normal(options_.moving_mean, options_.moving_deviation);
    return is_moving - is_static;
  }

  RegionBeliefs* memory_;
  RegionBayesOptions options_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_REGION_BAYES_HPP
