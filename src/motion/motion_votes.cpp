// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_votes.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"

namespace dynfilter {
namespace {

constexpr std::size_t max_neighbours = 30;
constexpr std::size_t features_a_voice = 4;  // looked at, for corners of many octaves

bool is_seed(const FeatureMotion& motion) {
  return motion.evidence == MotionEvidence::seed || motion.evidence == MotionEvidence::supported;
}

/// Neighbour of a feature.
struct Neighbour {
  int squared_distance;
  std::uint32_t index;
};

void check(const MotionVotesOptions& options) {
  static constexpr detail::OptionCheck require("support_seeds");
  const auto radius = [](const char* name, int value_px) {
    require(value_px >= 1 && value_px <= 1000, name, value_px, "1 to 1000");
  };
  const auto count = [](const char* name, std::size_t value) {
    require(value >= 1 && value <= max_neighbours, name, value, "1 to 30");
  };
  const auto share = [](const char* name, double value) {
    require(value >= 0 && value <= 1, name, value, "a share from 0 to 1");
  };
  const auto not_negative = [](const char* name, double value) {
    require(value >= 0, name, value, "a number of at least 0");
  };
  radius("radius_px", options.radius_px);
  count("neighbours", options.neighbours);
  require(options.min_spacing_px >= 0 && options.min_spacing_px <= 1000, "min_spacing_px",
          options.min_spacing_px, "0 to 1000");
  require(options.min_seeds >= 1, "min_seeds", options.min_seeds, "at least 1");
  share("min_share", options.min_share);
  not_negative("max_difference", options.max_difference);
  not_negative("max_difference_px", options.max_difference_px);
  not_negative("max_depth_difference_m", options.max_depth_difference_m);
  radius("join_radius_px", options.join_radius_px);
  count("min_joined", options.min_joined);
  radius("far_join_radius_px", options.far_join_radius_px);
  count("min_far_joined", options.min_far_joined);
  not_negative("max_far_difference", options.max_far_difference);
  radius("crowd_radius_px", options.crowd_radius_px);
  count("crowd_neighbours", options.crowd_neighbours);
  share("min_crowd_share", options.min_crowd_share);
}

/// The nearest few of the neighbours offered, the nearest first.
class Nearest {
 public:
  Nearest(const FrameFeatures& features, std::size_t limit) : features_(features), limit_(limit) {}

  void offer(const Neighbour& neighbour) {
    if (count_ == limit_ && !is_before(neighbour, kept_[count_ - 1])) return;
    if (count_ < limit_) ++count_;
    std::size_t place = count_ - 1;
    for (; place > 0 && is_before(neighbour, kept_[place - 1]); --place) {
      kept_[place] = kept_[place - 1];
    }
    kept_[place] = neighbour;
  }

  /// Squared distance beyond which none is kept any more.
  int squared_reach() const {
    return count_ < limit_ ? std::numeric_limits<int>::max() : kept_[count_ - 1].squared_distance;
  }

  const Neighbour* begin() const { return kept_.data(); }
  const Neighbour* end() const { return kept_.data() + count_; }

 private:
  bool is_before(const Neighbour& a, const Neighbour& b) const {
    if (a.squared_distance != b.squared_distance) return a.squared_distance < b.squared_distance;
    const cv::Point at = features_.pixel(a.index), other = features_.pixel(b.index);
    return std::tie(at.y, at.x, a.index) < std::tie(other.y, other.x, b.index);
  }

  const FrameFeatures& features_;
  std::array<Neighbour, max_neighbours * features_a_voice> kept_;
  std::size_t limit_, count_ = 0;
};

/// Largest difference of the shifts of features that move alike: a share of the shift, and pixels.
struct Difference {
  double share, px;
};

bool moves_alike(const FeatureMotion& a, const FeatureMotion& b, const Difference& largest) {
  const bool move_along_view = a.approach_m != 0 && b.approach_m != 0;
  if (move_along_view) return (a.approach_m > 0) == (b.approach_m > 0);
  if (!b.is_tracked[a.baseline]) return false;
  const cv::Vec2f& shift = a.shift_px[a.baseline];
  const double limit = largest.share * cv::norm(shift) + largest.px;
  return cv::norm(shift - b.shift_px[a.baseline]) <= limit;
}

/// Features that vote for a seed.
struct Voices {
  std::array<std::uint32_t, max_neighbours> features;
  std::size_t count = 0;

  const std::uint32_t* begin() const { return features.data(); }
  const std::uint32_t* end() const { return features.data() + count; }
};

/// Returns the features nearest to a seed that may vote, `most` at most. One corner may have
/// features in several octaves: they are one voice, and those of the seed's own are none.
template <class MayVote>
Voices voices_near(std::uint32_t seed, int radius_px, std::size_t most, FrameFeatures& features,
                   const MotionVotesOptions& options, const MayVote& may_vote) {
  const cv::Point centre = features.pixel(seed);
  Nearest nearest(features, std::max(options.neighbours, most) * features_a_voice);
  for (const std::uint32_t i :
       features.inside(detail::bounds_of(cv::Rect(centre, cv::Size(1, 1)), radius_px))) {
    const cv::Point away = features.pixel(i) - centre;
    const int squared_distance = away.dot(away);
    if (squared_distance > std::min(radius_px * radius_px, nearest.squared_reach())) continue;
    if (i != seed && may_vote(i)) nearest.offer({squared_distance, i});
  }
  std::array<cv::Point, max_neighbours + 1> heard{centre};
  Voices voices;
  for (const Neighbour& neighbour : nearest) {
    const cv::Point pixel = features.pixel(neighbour.index);
    const auto is_same_corner = [&](cv::Point other) {
      const cv::Point away = pixel - other;
      return away.dot(away) < options.min_spacing_px * options.min_spacing_px;
    };
    if (voices.count == most) break;
    const auto heard_end = heard.begin() + static_cast<std::ptrdiff_t>(voices.count + 1);
    if (std::any_of(heard.begin(), heard_end, is_same_corner)) continue;
    voices.features[voices.count++] = neighbour.index;
    heard[voices.count] = pixel;
  }
  return voices;
}

/// Tells whether enough of a seed's nearest neighbours are seeds that move as it does.
bool finds_support(std::uint32_t seed, FrameFeatures& features, const MotionVotesOptions& options,
                   const std::vector<FeatureMotion>& motions) {
  const FeatureMotion& own = motions[seed];
  if (!own.was_tracked()) return false;
  const Voices neighbours = voices_near(
      seed, options.radius_px, options.neighbours, features, options, [&](std::uint32_t i) {
        return motions[i].was_tracked() &&
               !own.is_apart(motions[i], options.max_depth_difference_m);
      });
  const Difference largest{options.max_difference, options.max_difference_px};
  const auto alike = static_cast<std::size_t>(
      std::count_if(neighbours.begin(), neighbours.end(), [&](std::uint32_t i) {
        return is_seed(motions[i]) && moves_alike(own, motions[i], largest);
      }));
  return alike >= options.min_seeds &&
         static_cast<double>(alike) >= options.min_share * static_cast<double>(neighbours.count);
}

/// Tells whether so many seeds that have support are near and move as this one does.
bool finds_partners(std::uint32_t seed, int radius_px, std::size_t count, const Difference& largest,
                    FrameFeatures& features, const MotionVotesOptions& options,
                    const std::vector<FeatureMotion>& motions) {
  const FeatureMotion& own = motions[seed];
  const Voices partners =
      voices_near(seed, radius_px, count, features, options, [&](std::uint32_t i) {
        return motions[i].neighbours_agree &&
               !own.is_apart(motions[i], options.max_depth_difference_m) &&
               moves_alike(own, motions[i], largest);
      });
  return partners.count == count;
}

/// Tells whether a seed joins seeds that have support, near ones or more that are farther away.
bool may_join(std::uint32_t seed, FrameFeatures& features, const MotionVotesOptions& options,
              const std::vector<FeatureMotion>& motions) {
  const FeatureMotion& own = motions[seed];
  if (!(own.depth_m > 0) || !own.was_tracked()) return false;
  const auto joins = [&](int radius_px, std::size_t count, double max_difference) {
    return finds_partners(seed, radius_px, count, {max_difference, options.max_difference_px},
                          features, options, motions);
  };
  if (joins(options.join_radius_px, options.min_joined, options.max_difference)) return true;
  return !own.is_beside_object &&
         joins(options.far_join_radius_px, options.min_far_joined, options.max_far_difference);
}

/// Tells whether most of what is near a seed, and on the same thing, are seeds, however they move.
bool is_among_seeds(std::uint32_t seed, FrameFeatures& features, const MotionVotesOptions& options,
                    const std::vector<FeatureMotion>& motions) {
  const FeatureMotion& own = motions[seed];
  if (!(own.depth_m > 0)) return false;
  const Voices neighbours =
      voices_near(seed, options.crowd_radius_px, options.crowd_neighbours, features, options,
                  [&](std::uint32_t i) {
                    return (motions[i].was_tracked() || is_seed(motions[i])) &&
                           !own.is_apart(motions[i], options.max_depth_difference_m);
                  });
  const auto seeds = std::count_if(neighbours.begin(), neighbours.end(),
                                   [&](std::uint32_t i) { return is_seed(motions[i]); });
  return 2 * neighbours.count >= options.crowd_neighbours &&
         static_cast<double>(seeds) >=
             options.min_crowd_share * static_cast<double>(neighbours.count);
}

}  // namespace

void support_seeds(FrameFeatures& features, const MotionVotesOptions& options,
                   std::vector<FeatureMotion>& motions) {
  check(options);
  if (motions.size() != features.size()) {
    detail::throw_misuse(
        "support_seeds",
        detail::concatenate(motions.size(), " motions and ", features.size(), " features"),
        "one motion for each feature");
  }
  for (std::uint32_t i = 0; i < motions.size(); ++i) {
    motions[i].neighbours_agree =
        is_seed(motions[i]) && finds_support(i, features, options, motions);
  }
  for (std::uint32_t i = 0; i < motions.size(); ++i) {
    if (motions[i].evidence != MotionEvidence::seed) continue;
    if (motions[i].neighbours_agree || may_join(i, features, options, motions) ||
        is_among_seeds(i, features, options, motions)) {
      motions[i].evidence = MotionEvidence::supported;
    }
  }
}

}  // namespace dynfilter
