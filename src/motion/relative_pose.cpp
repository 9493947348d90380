// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/relative_pose.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "linear_residual.hpp"
#include "pose_prior.hpp"
#include "random.hpp"
#include "rotation.hpp"

namespace dynfilter {
namespace {

using detail::Freedom;
using detail::LinearResidual;
using detail::NormalEquations;
using detail::Twist;

constexpr double cell_px = 40;     // side of a part of the image that has a voice
constexpr int concentrations = 3;  // of a hypothesis that is the best one so far
constexpr double median_to_scale = 1.4826;
// A pose beyond the prior's limits contradicts them if the other's scale is so many times its own.
constexpr double contradicting_ratio = 2;
// A motion is dismissed after the first observations if too many of them are above the limit. Of n
// observations, n * p would be above it by chance, p = 1 - share, with a deviation of sqrt(n * p *
// (1 - p)). More than 3.1 deviations above that is one case of a thousand.
constexpr std::size_t first_observations = 60;
constexpr double rejecting_deviations = 3.1;

/// Share of the sample that decides, and share of it that counts as static where the scale
/// of the residuals is measured.
struct Deciding {
  double share, static_share;
};

// A trusted prior holds where most features move. Few static ones are left there.
constexpr Deciding with_trusted_prior{0.1, 0.2};

/// Place of an observation in the order in which the sample takes them.
struct Rank {
  std::size_t round = 0;  // how many of its part of the image come before
  double texture = 0;
  std::uint64_t hash = 0;
  std::size_t index = 0;
  int cell = 0;
};

struct PoseScratch {
  std::vector<Rank> order;
  std::vector<LinearResidual> sample, all;
  std::vector<double> squares, some_squares;

  /// Makes room for as many observations as the caller has room for, so that warm frames allocate
  /// nothing.
  void reserve(std::size_t observations) {
    order.reserve(observations);
    sample.reserve(observations);
    all.reserve(observations);
    squares.reserve(observations);
    some_squares.reserve(observations);
  }
};

std::uint64_t hash_of(const PoseObservation& observation, std::uint64_t seed) {
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
/// texture does not outvote the rest, and by their hash among those. Of each part the one with the
/// most texture comes first: its track is the most exact.
void put_in_order(const std::vector<PoseObservation>& observations, std::uint64_t seed,
                  std::vector<Rank>& order) {
  order.clear();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const cv::Point2d pixel = observations[i].pixel_then;
    const auto cell = [](double position) {
      return static_cast<int>(std::clamp(position, -1e5, 1e5) / cell_px);
    };
    order.push_back({0, observations[i].texture, hash_of(observations[i], seed), i,
                     cell(pixel.y) * 65536 + cell(pixel.x)});
  }
  std::sort(order.begin(), order.end(), [](const Rank& a, const Rank& b) {
    return std::tie(a.cell, b.texture, a.hash) < std::tie(b.cell, a.texture, b.hash);
  });
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (order[i].cell == order[i - 1].cell) order[i].round = order[i - 1].round + 1;
  }
  std::sort(order.begin(), order.end(), [](const Rank& a, const Rank& b) {
    return std::tie(a.round, a.hash) < std::tie(b.round, b.hash);
  });
}

RelativePose moved(const RelativePose& pose, const Twist& motion) {
  const cv::Matx33d turn = detail::rotation_of({motion[0], motion[1], motion[2]});
  return {detail::orthonormal(turn * pose.rotation),
          turn * pose.translation + cv::Vec3d(motion[3], motion[4], motion[5])};
}

bool is_within(const RelativePose& pose, const PosePrior& prior) {
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

/// Computes the sample's squared residuals after a motion, and their quantile. Returns nothing if
/// it is not below `limit`.
std::optional<double> smaller_quantile(const Twist& motion, double limit, double share,
                                       PoseScratch& scratch) {
  const std::size_t sample_size = scratch.sample.size();
  const auto below = static_cast<std::size_t>(share * static_cast<double>(sample_size));
  const std::size_t most_above = sample_size - below - 1;
  const double first_above = first_observations * (1 - share);
  const double first_against = first_above + rejecting_deviations * std::sqrt(first_above * share);
  std::size_t above = 0;
  scratch.squares.clear();
  for (const LinearResidual& residual : scratch.sample) {
    const double square = residual.squared_after(motion);
    above += square < limit ? 0 : 1;
    scratch.squares.push_back(square);
    const bool is_rejected_at_once =
        scratch.squares.size() == first_observations && static_cast<double>(above) > first_against;
    if (above > most_above || is_rejected_at_once) return {};
  }
  scratch.some_squares = scratch.squares;
  return detail::quantile_of(scratch.some_squares, share);
}

/// Returns the least-squares motion of those in the sample whose squared residuals are at most
/// this.
Twist concentrated(double most, const PoseScratch& scratch) {
  NormalEquations equations;
  for (std::size_t i = 0; i < scratch.sample.size(); ++i) {
    if (scratch.squares[i] <= most) equations.add(scratch.sample[i], 1);
  }
  return equations.solved();
}

/// Returns the best of many poses near `start`, each from four observations. A turn needs two, and
/// fewer hypotheses, because two static observations are found sooner than four.
RelativePose least_quantile(const RelativePose& start, const std::optional<PosePrior>& prior,
                            const RelativePoseOptions& options, double deciding_share,
                            Freedom freedom, detail::Random& random, PoseScratch& scratch) {
  const bool turns = freedom == Freedom::turns;
  const std::size_t in_hypothesis = turns ? 2 : 4;
  const std::size_t hypotheses = turns ? (options.hypotheses + 3) / 4 : options.hypotheses;
  const std::vector<LinearResidual>& sample = scratch.sample;
  RelativePose best = start;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double least = smaller_quantile({}, infinity, deciding_share, scratch).value_or(infinity);
  for (std::size_t h = 0; h < hypotheses; ++h) {
    NormalEquations equations;
    for (std::size_t i = 0; i < in_hypothesis; ++i) {
      equations.add(sample[random.below(sample.size())], 1);
    }
    Twist motion = equations.solved();
    for (int step = 0; step <= concentrations; ++step) {
      const auto quantile = smaller_quantile(motion, least, deciding_share, scratch);
      if (!quantile) break;
      const RelativePose pose = moved(start, motion);
      if (prior && !is_within(pose, *prior)) break;
      least = *quantile;
      best = pose;
      motion = concentrated(least, scratch);
    }
  }
  return best;
}

void check(const RelativePoseOptions& options) {
  static constexpr detail::OptionCheck require("RelativePoseEstimator");
  require(options.min_observations >= 6, "min_observations", options.min_observations,
          "at least 6");
  require(options.hypotheses >= 1 && options.hypotheses <= 100000, "hypotheses", options.hypotheses,
          "1 to 100000");
  require(options.sample_size >= 20, "sample_size", options.sample_size, "at least 20");
  require(options.quantile >= 0.1 && options.quantile <= 0.5, "quantile", options.quantile,
          "a share from 0.1 to 0.5");
  require(options.refinements >= 0 && options.refinements <= 100, "refinements",
          options.refinements, "0 to 100");
  const auto is_in_reason = [](double value) { return value >= 1e-6 && value <= 1e6; };
  require(is_in_reason(options.cutoff), "cutoff", options.cutoff, "1e-6 to 1e6");
  require(is_in_reason(options.min_scale_px), "min_scale_px", options.min_scale_px, "1e-6 to 1e6");
  require(options.max_scale_px > 0, "max_scale_px", options.max_scale_px, "a number above 0");
  require(options.min_support >= 0 && options.min_support <= 1, "min_support", options.min_support,
          "a share from 0 to 1");
}

void check(const std::vector<PoseObservation>& observations, const char* caller) {
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const cv::Point3d& point = observations[i].point_now_m;
    const cv::Point2d& pixel = observations[i].pixel_then;
    const double texture = observations[i].texture;
    const double sum = point.x + point.y + point.z + pixel.x + pixel.y + texture;
    if (std::isfinite(sum) && point.z > 0 && texture >= 0) continue;
    detail::throw_misuse(caller,
                         detail::concatenate("observation ", i, " at depth ", point.z, ", pixel (",
                                             pixel.x, ", ", pixel.y, "), of texture ", texture),
                         "finite observations in front of the camera, of texture 0 or more");
  }
}

/// Residuals of all observations under a pose, in the order of put_in_order.
struct Fit {
  const std::vector<PoseObservation>& observations;
  const PinholeCamera& camera;
  const RelativePoseOptions& options;
  Deciding deciding;
  Freedom freedom;
  PoseScratch& scratch;

  std::size_t sample_size() const { return std::min(options.sample_size, observations.size()); }

  const PoseObservation& at(std::size_t i) const { return observations[scratch.order[i].index]; }

  /// Linearises all residuals around a pose. Returns their scale: of all first, then of those that
  /// agree with that.
  double scale_px(const RelativePose& pose) const {
    std::vector<double>& squares = scratch.squares;
    squares.clear();
    scratch.all.resize(observations.size());
    for (std::size_t i = 0; i < observations.size(); ++i) {
      scratch.all[i] = linearised(at(i), pose, camera, freedom);
      squares.push_back(scratch.all[i].squared());
    }
    const auto end_of_sample = squares.begin() + static_cast<std::ptrdiff_t>(sample_size());
    scratch.some_squares.assign(squares.begin(), end_of_sample);
    const auto scale_of = [&](std::vector<double>& some, double share, double static_share) {
      if (some.empty()) return std::numeric_limits<double>::infinity();  // none has a number
      const double below = std::sqrt(detail::quantile_of(some, share));
      const double median = median_of_normal(share / static_share, below);
      return std::max(median_to_scale * median, options.min_scale_px);
    };
    const double limit =
        options.cutoff * scale_of(scratch.some_squares, deciding.share, deciding.static_share);
    scratch.some_squares.clear();
    for (auto square = squares.begin(); square != end_of_sample; ++square) {
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

  /// Returns the pose after one step with Tukey's weights.
  RelativePose refined(const RelativePose& pose) const {
    const double limit = options.cutoff * scale_px(pose);
    NormalEquations equations;
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const double share = scratch.squares[i] / (limit * limit);
      if (share < 1) equations.add(scratch.all[i], (1 - share) * (1 - share));
    }
    return moved(pose, equations.solved());
  }
};

/// Returns the best hypothesis near a pose.
RelativePose searched(const Fit& fit, const RelativePose& pose,
                      const std::optional<PosePrior>& prior) {
  detail::Random random(fit.options.seed);
  PoseScratch& scratch = fit.scratch;
  scratch.sample.resize(fit.sample_size());
  for (std::size_t i = 0; i < scratch.sample.size(); ++i) {
    scratch.sample[i] = linearised(fit.at(i), pose, fit.camera, fit.freedom);
  }
  return least_quantile(pose, prior, fit.options, fit.deciding.share, fit.freedom, random, scratch);
}

/// Returns a pose after all steps of the refinement.
RelativePose refined(const Fit& fit, RelativePose pose) {
  for (int step = 0; step < fit.options.refinements; ++step) pose = fit.refined(pose);
  return pose;
}

RelativePoseEstimate estimated(const std::vector<PoseObservation>& observations,
                               const RelativePose& start, const std::optional<PosePrior>& prior,
                               const PinholeCamera& camera, const RelativePoseOptions& options,
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
  if (observations.size() < options.min_observations) {
    estimate.scale_px = options.min_scale_px;
    estimate.is_trusted = is_known && is_within(estimate.pose, *prior);
    return estimate;
  }

  scratch.reserve(observations.capacity());
  put_in_order(observations, options.seed, scratch.order);
  const Deciding deciding = is_known ? with_trusted_prior : Deciding{options.quantile, 1};
  const Fit fit{observations, camera, options, deciding, freedom, scratch};
  const RelativePose found = searched(fit, estimate.pose, prior);
  const RelativePose best = refined(fit, found);
  const bool is_possible = !prior || is_within(best, *prior);
  estimate.pose = is_possible ? best : found;
  // The observations may say that the limits are wrong.
  const double least_scale_px = is_possible ? 0 : fit.scale_px(best);
  estimate.scale_px = fit.scale_px(estimate.pose);
  const bool is_contradicted =
      !is_possible && estimate.scale_px > contradicting_ratio * least_scale_px;
  estimate.support =
      fit.support(options.cutoff * std::min(estimate.scale_px, options.max_scale_px));
  const bool is_agreed = !is_contradicted && estimate.support >= options.min_support &&
                         estimate.scale_px <= options.max_scale_px;
  // A prior may say that the camera does not only turn.
  const bool is_dismissed = freedom == Freedom::turns && prior && !is_within(estimate.pose, *prior);
  estimate.is_trusted = (is_agreed || is_known) && !is_dismissed;
  return estimate;
}

}  // namespace

RelativePoseEstimator::RelativePoseEstimator(const PinholeCamera& camera,
                                             const RelativePoseOptions& options)
    : camera_(camera), options_(options) {
  validate(camera, "RelativePoseEstimator");
  check(options);
}

RelativePoseEstimate RelativePoseEstimator::estimate(
    const std::vector<PoseObservation>& observations, const RelativePose& start,
    const std::optional<PosePrior>& prior, Workspace& workspace) const {
  return estimated(observations, start, prior, camera_, options_, Freedom::moves_and_turns,
                   workspace.get<PoseScratch>());
}

RelativePoseEstimate RelativePoseEstimator::estimate_turn(
    const std::vector<PoseObservation>& observations, const RelativePose& start,
    const std::optional<PosePrior>& prior, Workspace& workspace) const {
  return estimated(observations, start, prior, camera_, options_, Freedom::turns,
                   workspace.get<PoseScratch>());
}

}  // namespace dynfilter
