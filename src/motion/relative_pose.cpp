// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/relative_pose.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mixed_bits.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "linear_residual.hpp"
#include "pose_prior.hpp"

namespace dynfilter {
namespace {

using detail::Freedom;
using detail::LinearResidual;
using detail::NormalEquations;
using detail::Twist;

// More hypotheses, a larger sample and more steps cost time.
constexpr std::size_t hypotheses = 80, turn_hypotheses = 20;
constexpr std::size_t max_sample = 300;
constexpr int concentrations = 3, tukey_steps = 3;
/// Parts of the image of this size have equal voices. Larger ones follow what is rich in texture.
constexpr double cell_px = 40;
constexpr std::uint64_t seed = 0;
// A pose is trusted up to such a scale, and if such a share agrees. A larger scale trusts a pose
// that follows a mover; a larger share abstains where movers are many.
constexpr double max_trusted_scale_px = 3;
constexpr double min_support = 0.5;
// A pose beyond the prior's limits contradicts them if the other's scale is so many times its own.
constexpr double contradicting_ratio = 2;
// A motion is dismissed after the first observations if too many of them are above the limit. Of n
// observations, n * p would be above it by chance, p = 1 - share, with a deviation of sqrt(n * p *
// (1 - p)). More than 3.1 deviations above that is one case of a thousand.
constexpr std::size_t first_observations = 60;
constexpr double rejecting_deviations = 3.1;

/// Share of the observations that decides, and share of them that counts as static where the scale
/// of the residuals is measured. A threshold in place of the quantile counts a mover that drifts by
/// a pixel among the inliers, as PnP with RANSAC does. The share is below a half, because failed
/// tracks and movers together may be the majority.
struct Deciding {
  double share, static_share;
};

constexpr Deciding with_static_third{0.33, 1};
// A trusted prior holds where most features move. Few static ones are left there.
constexpr Deciding with_trusted_prior{0.1, 0.2};

/// Sequence of random numbers, always the same.
class Random {
 public:
  /// Returns a number below `count`, which is above 0 and far below 2^32.
  std::size_t below(std::size_t count) {
    state_ += 0x9E3779B97F4A7C15U;
    return static_cast<std::size_t>(((detail::mixed_bits(state_) >> 32U) * count) >> 32U);
  }

 private:
  std::uint64_t state_ = detail::mixed_bits(seed);
};

/// Place of an observation in the order in which the sample takes them.
struct Rank {
  int cell = 0;
  std::size_t round = 0;  // how many of its part of the image come before
  std::uint64_t hash = 0;
  std::size_t index = 0;
};

struct PoseScratch {
  std::vector<Rank> ranks;
  std::vector<PoseObservation> observations;  // in order
  std::vector<LinearResidual> linear;
  std::vector<double> squares, some_squares;
};

std::uint64_t hash_of(const PoseObservation& observation) {
  std::uint64_t hash = seed;
  for (const double number : {observation.pixel_then.x, observation.pixel_then.y,
                              observation.point_now_m.x, observation.point_now_m.y}) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    hash = detail::mixed_bits(hash ^ bits);
  }
  return hash;
}

/// Puts the observations in order: one of each part of the image in turn, so that what is rich in
/// texture does not outvote the rest, and by their hash among those.
void put_in_order(const std::vector<PoseObservation>& observations, PoseScratch& scratch) {
  std::vector<Rank>& ranks = scratch.ranks;
  ranks.clear();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const auto cell = [](double position) {
      return static_cast<int>(std::clamp(position, -1e5, 1e5) / cell_px);
    };
    const cv::Point2d pixel = observations[i].pixel_then;
    ranks.push_back({cell(pixel.y) * 65536 + cell(pixel.x), 0, hash_of(observations[i]), i});
  }
  std::sort(ranks.begin(), ranks.end(), [](const Rank& a, const Rank& b) {
    return std::tie(a.cell, a.hash) < std::tie(b.cell, b.hash);
  });
  for (std::size_t i = 1; i < ranks.size(); ++i) {
    if (ranks[i].cell == ranks[i - 1].cell) ranks[i].round = ranks[i - 1].round + 1;
  }
  std::sort(ranks.begin(), ranks.end(), [](const Rank& a, const Rank& b) {
    return std::tie(a.round, a.hash) < std::tie(b.round, b.hash);
  });
  scratch.observations.clear();
  for (const Rank& rank : ranks) scratch.observations.push_back(observations[rank.index]);
}

bool is_within(const Pose& pose, const PosePrior& prior) {
  const cv::Matx33d between = pose.rotation * prior.pose.rotation.t();
  const double cosine = std::clamp((cv::trace(between) - 1) / 2, -1.0, 1.0);
  return cv::norm(pose.translation - prior.pose.translation) <= prior.max_translation_m &&
         std::acos(cosine) <= prior.max_rotation_rad;
}

/// Returns the median of the lengths of two-dimensional normal errors, if a share of the lengths is
/// below a value. Lengths r have Rayleigh's distribution: share = 1 - exp(-r^2 / (2 s^2)), so that
/// the median is r * sqrt(ln(1/2) / ln(1 - share)).
double median_of_normal(double share, double below) {
  return below * std::sqrt(std::log(0.5) / std::log(1 - share));
}

/// Residuals of the observations under a pose. The first of them are the sample.
struct Fit {
  const Camera& camera;
  Deciding deciding;
  Freedom freedom;
  PoseScratch& scratch;

  std::size_t sample_size() const { return std::min(scratch.observations.size(), max_sample); }

  /// Linearises the residuals of the first observations around a pose.
  void linearise(const Pose& pose, std::size_t count) const {
    scratch.linear.clear();
    for (std::size_t i = 0; i < count; ++i) {
      scratch.linear.push_back(detail::linearised(scratch.observations[i], pose, camera, freedom));
    }
  }

  /// Computes the sample's squared residuals after a motion, and their quantile. Returns nothing if
  /// it is not below `limit`.
  std::optional<double> smaller_quantile(const Twist& motion, double limit) const {
    const double share = deciding.share;
    const std::size_t size = scratch.linear.size();
    const auto below = static_cast<std::size_t>(share * static_cast<double>(size));
    const std::size_t most_above = size - below - 1;
    const double first_above = first_observations * (1 - share);
    const double first_against =
        first_above + rejecting_deviations * std::sqrt(first_above * share);
    std::size_t above = 0;
    scratch.squares.clear();
    for (const LinearResidual& residual : scratch.linear) {
      const double square = residual.squared_after(motion);
      above += square < limit ? 0 : 1;
      scratch.squares.push_back(square);
      const bool is_rejected_at_once = scratch.squares.size() == first_observations &&
                                       static_cast<double>(above) > first_against;
      if (above > most_above || is_rejected_at_once) return {};
    }
    scratch.some_squares = scratch.squares;
    return detail::quantile_of(scratch.some_squares, share);
  }

  /// Returns the least-squares motion of those whose squared residuals are at most this.
  Twist concentrated(double most) const {
    NormalEquations equations;
    for (std::size_t i = 0; i < scratch.linear.size(); ++i) {
      if (scratch.squares[i] <= most) equations.add(scratch.linear[i], 1);
    }
    return equations.solved();
  }

  /// Returns the best of many poses near `start`, each from four observations. A turn needs two,
  /// and fewer hypotheses, because two static observations are found sooner than four.
  Pose searched(const Pose& start, const std::optional<PosePrior>& prior) const {
    const bool turns = freedom == Freedom::turns;
    Random random;
    linearise(start, sample_size());
    Pose best = start;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    double least = smaller_quantile({}, infinity).value_or(infinity);
    for (std::size_t h = 0; h < (turns ? turn_hypotheses : hypotheses); ++h) {
      NormalEquations equations;
      for (int i = 0; i < (turns ? 2 : 4); ++i) {
        equations.add(scratch.linear[random.below(scratch.linear.size())], 1);
      }
      Twist motion = equations.solved();
      for (int step = 0; step <= concentrations; ++step) {
        const auto quantile = smaller_quantile(motion, least);
        if (!quantile) break;
        const Pose pose = detail::moved(start, motion);
        if (prior && !is_within(pose, *prior)) break;
        least = *quantile;
        best = pose;
        motion = concentrated(least);
      }
    }
    return best;
  }

  /// Linearises the residuals around a pose. Returns their scale: of all first, then of those that
  /// agree with that.
  double scale_px(const Pose& pose) const {
    linearise(pose, scratch.observations.size());
    scratch.squares.clear();
    for (const LinearResidual& linear : scratch.linear) scratch.squares.push_back(linear.squared());
    const auto end_of_sample = scratch.squares.begin() + static_cast<std::ptrdiff_t>(sample_size());
    scratch.some_squares.assign(scratch.squares.begin(), end_of_sample);
    const auto scale_of = [&](std::vector<double>& some, double share, double static_share) {
      if (some.empty()) return std::numeric_limits<double>::infinity();  // none has a number
      const double below = std::sqrt(detail::quantile_of(some, share));
      const double median = median_of_normal(share / static_share, below);
      return std::max(detail::median_to_scale * median, detail::min_scale_px);
    };
    const double limit = detail::tukey_cutoff *
                         scale_of(scratch.some_squares, deciding.share, deciding.static_share);
    scratch.some_squares.clear();
    for (auto square = scratch.squares.begin(); square != end_of_sample; ++square) {
      if (*square <= limit * limit) scratch.some_squares.push_back(*square);
    }
    return scale_of(scratch.some_squares, 0.5, 1);
  }

  /// Returns the share of the sample within a limit, after `scale_px`.
  double support(double limit_px) const {
    const auto agreeing =
        std::count_if(scratch.squares.begin(),
                      scratch.squares.begin() + static_cast<std::ptrdiff_t>(sample_size()),
                      [&](double square) { return square <= limit_px * limit_px; });
    return static_cast<double>(agreeing) / static_cast<double>(sample_size());
  }

  /// Returns the pose after all steps with Tukey's weights.
  Pose refined(Pose pose) const {
    for (int step = 0; step < tukey_steps; ++step) {
      const double limit = detail::tukey_cutoff * scale_px(pose);
      NormalEquations equations;
      for (std::size_t i = 0; i < scratch.linear.size(); ++i) {
        equations.add(scratch.linear[i], detail::tukey_weight(scratch.squares[i], limit));
      }
      pose = detail::moved(pose, equations.solved());
    }
    return pose;
  }
};

void check(const std::vector<PoseObservation>& observations, const char* caller) {
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const cv::Point3d& point = observations[i].point_now_m;
    const cv::Point2d& pixel = observations[i].pixel_then;
    const double sum = point.x + point.y + point.z + pixel.x + pixel.y;
    if (std::isfinite(sum) && point.z > 0) continue;
    detail::throw_misuse(caller,
                         detail::concatenate("observation ", i, " at depth ", point.z, ", pixel (",
                                             pixel.x, ", ", pixel.y, ")"),
                         "finite observations in front of the camera");
  }
}

RelativePoseEstimate estimated(const std::vector<PoseObservation>& observations, const Pose& start,
                               const std::optional<PosePrior>& prior, const Camera& camera,
                               Freedom freedom, PoseScratch& scratch) {
  const char* const caller = freedom == Freedom::turns ? "RelativePoseEstimator::estimate_turn"
                                                       : "RelativePoseEstimator::estimate";
  check(observations, caller);
  detail::validate(start, caller);
  if (prior) detail::validate(*prior, caller);
  const bool is_known = prior && prior->is_trusted;
  RelativePoseEstimate estimate;
  estimate.pose = prior ? prior->pose : start;
  if (freedom == Freedom::turns) estimate.pose.translation = {0, 0, 0};
  estimate.observations = observations.size();
  if (observations.size() < RelativePoseEstimator::min_observations) {
    estimate.scale_px = detail::min_scale_px;
    estimate.is_trusted = is_known && is_within(estimate.pose, *prior);
    return estimate;
  }

  put_in_order(observations, scratch);
  const Fit fit{camera, is_known ? with_trusted_prior : with_static_third, freedom, scratch};
  const Pose found = fit.searched(estimate.pose, prior);
  const Pose best = fit.refined(found);
  const bool is_possible = !prior || is_within(best, *prior);
  estimate.pose = is_possible ? best : found;
  // The observations may say that the limits are wrong.
  const double least_scale_px = is_possible ? 0 : fit.scale_px(best);
  estimate.scale_px = fit.scale_px(estimate.pose);
  const bool is_contradicted =
      !is_possible && estimate.scale_px > contradicting_ratio * least_scale_px;
  estimate.support =
      fit.support(detail::tukey_cutoff * std::min(estimate.scale_px, max_trusted_scale_px));
  const bool is_agreed = !is_contradicted && estimate.support >= min_support &&
                         estimate.scale_px <= max_trusted_scale_px;
  // A prior may say that the camera does not only turn.
  const bool is_dismissed = freedom == Freedom::turns && prior && !is_within(estimate.pose, *prior);
  estimate.is_trusted = (is_agreed || is_known) && !is_dismissed;
  return estimate;
}

}  // namespace

RelativePoseEstimator::RelativePoseEstimator(const Camera& camera) : camera_(camera) {
  validate(camera, "RelativePoseEstimator");
}

RelativePoseEstimate RelativePoseEstimator::estimate(
    const std::vector<PoseObservation>& observations, const Pose& start,
    const std::optional<PosePrior>& prior, Workspace& workspace) const {
  return estimated(observations, start, prior, camera_, Freedom::moves_and_turns,
                   workspace.get<PoseScratch>());
}

RelativePoseEstimate RelativePoseEstimator::estimate_turn(
    const std::vector<PoseObservation>& observations, const Pose& start,
    const std::optional<PosePrior>& prior, Workspace& workspace) const {
  return estimated(observations, start, prior, camera_, Freedom::turns,
                   workspace.get<PoseScratch>());
}

}  // namespace dynfilter
