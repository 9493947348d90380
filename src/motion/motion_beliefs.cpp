// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_beliefs.hpp"

#include <algorithm>
#include <cmath>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {

MotionBeliefs::MotionBeliefs(const MotionBeliefOptions& options) : options_(options) {
  static constexpr detail::OptionCheck require("MotionBeliefs");
  require(options.forgetting_factor >= 0 && options.forgetting_factor <= 1, "forgetting_factor",
          options.forgetting_factor, "0 to 1");
  require(options.limit > 0, "limit", options.limit, "a number above 0");
  require(options.min_moving >= 0 && options.min_moving <= options.limit, "min_moving",
          options.min_moving, "a number from 0 to the limit");
  require(options.match_radius_px >= 0 && options.match_radius_px <= 100, "match_radius_px",
          options.match_radius_px, "0 to 100");
  const auto finite = [](const char* name, double value) {
    require(std::isfinite(value), name, value, "a finite number");
  };
  finite("bias", options.bias);
  finite("supported", options.supported);
  finite("seed", options.seed);
  finite("quiet", options.quiet);
  clear();
}

double MotionBeliefs::at(cv::Point2f place) {
  const cv::Point centre = nearest_pixel(place);
  // A place far outside is in no image, and its box would not fit an int.
  if (std::abs(static_cast<double>(centre.x)) > 1e6 ||
      std::abs(static_cast<double>(centre.y)) > 1e6)
    return 0;
  const int reach = options_.match_radius_px + 1;
  const double radius = options_.match_radius_px;
  double nearest = radius * radius, belief = 0;
  for (const std::uint32_t i :
       index_.inside(cv::Rect(centre.x - reach, centre.y - reach, 2 * reach + 1, 2 * reach + 1))) {
    const cv::Point2f away = points_[i] - place;
    const double squared = away.ddot(away);
    if (squared > nearest) continue;
    const bool is_stronger = std::abs(beliefs_[i]) > std::abs(belief) ||
                             (beliefs_[i] == -belief && beliefs_[i] > belief);
    if (squared < nearest || is_stronger) belief = beliefs_[i];
    nearest = squared;
  }
  return belief;
}

double MotionBeliefs::updated(double belief, MotionEvidence evidence) const {
  double added = 0;
  if (evidence == MotionEvidence::supported) added = options_.supported;
  if (evidence == MotionEvidence::seed) added = options_.seed;
  if (evidence == MotionEvidence::quiet) added = options_.quiet;
  return std::clamp(options_.forgetting_factor * belief + options_.bias + added, -options_.limit,
                    options_.limit);
}

void MotionBeliefs::remember(FeaturesView features, const std::vector<double>& beliefs) {
  if (beliefs.size() != features.size()) {
    detail::throw_misuse(
        "MotionBeliefs::remember",
        detail::concatenate(beliefs.size(), " beliefs and ", features.size(), " features"),
        "one belief for each feature");
  }
  points_.clear();
  for (std::size_t i = 0; i < features.size(); ++i) points_.push_back(features[i]);
  beliefs_ = beliefs;
  index_.read(points_);
}

void MotionBeliefs::clear() {
  points_.clear();
  beliefs_.clear();
  index_.read(points_);
}

}  // namespace dynfilter
