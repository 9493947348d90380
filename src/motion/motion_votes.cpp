// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_votes.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <tuple>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {
namespace {

constexpr std::size_t max_neighbours = 30;
constexpr std::size_t max_voices = max_neighbours + 1;  // with the seed itself
constexpr std::size_t features_a_voice = 4;             // looked at, for corners of many octaves

bool is_seed(const FeatureMotion& motion) {
  return motion.evidence == MotionEvidence::seed || motion.evidence == MotionEvidence::supported;
}

/// Neighbour of a feature, ordered by distance.
struct Neighbour {
  std::int64_t squared_distance;
  cv::Point pixel;
  std::uint32_t index;

  bool operator<(const Neighbour& other) const {
    return std::tie(squared_distance, pixel.y, pixel.x, index) <
           std::tie(other.squared_distance, other.pixel.y, other.pixel.x, other.index);
  }
};

void check(const MotionVotesOptions& options) {
  const bool is_good = options.radius_px >= 1 && options.radius_px <= 1000 &&
                       options.neighbours >= 1 && options.neighbours <= max_neighbours &&
                       options.min_spacing_px >= 0 && options.min_spacing_px <= 1000 &&
                       options.min_share >= 0 && options.min_share <= 1 &&
                       options.max_difference >= 0 && options.max_difference_px >= 0 &&
                       options.max_depth_difference_m >= 0 && options.join_radius_px >= 1 &&
                       options.join_radius_px <= 1000;
  if (is_good) return;
  detail::throw_misuse(
      "support_seeds",
      detail::concatenate("radius_px = ", options.radius_px, ", neighbours = ", options.neighbours,
                          ", min_spacing_px = ", options.min_spacing_px, ", min_share = ",
                          options.min_share, ", max_difference = ", options.max_difference,
                          ", max_difference_px = ", options.max_difference_px,
                          ", max_depth_difference_m = ", options.max_depth_difference_m,
                          ", join_radius_px = ", options.join_radius_px),
      "radii of 1 to 1000, 1 to 30 neighbours, a spacing of 0 to 1000, a share from 0 to 1, no "
      "negative difference");
}

/// The nearest few of the neighbours offered.
class Nearest {
 public:
  explicit Nearest(std::size_t limit) : limit_(limit) {}

  void offer(const Neighbour& neighbour) {
    if (count_ == limit_ && !(neighbour < kept_[count_ - 1])) return;
    if (count_ < limit_) ++count_;
    std::size_t place = count_ - 1;
    for (; place > 0 && neighbour < kept_[place - 1]; --place) kept_[place] = kept_[place - 1];
    kept_[place] = neighbour;
  }

  /// Squared distance beyond which none is kept any more.
  std::int64_t squared_reach() const {
    return count_ < limit_ ? std::numeric_limits<std::int64_t>::max()
                           : kept_[count_ - 1].squared_distance;
  }

  const Neighbour* begin() const { return kept_.data(); }
  const Neighbour* end() const { return kept_.data() + count_; }

 private:
  std::array<Neighbour, max_neighbours * features_a_voice> kept_;
  std::size_t limit_, count_ = 0;
};

bool moves_alike(const FeatureMotion& a, const FeatureMotion& b,
                 const MotionVotesOptions& options) {
  const bool move_along_view = a.approach_m != 0 && b.approach_m != 0;
  if (move_along_view) return (a.approach_m > 0) == (b.approach_m > 0);
  if (!b.is_tracked[a.baseline]) return false;
  const cv::Vec2f& shift = a.shift_px[a.baseline];
  const double limit = options.max_difference * cv::norm(shift) + options.max_difference_px;
  return cv::norm(shift - b.shift_px[a.baseline]) <= limit;
}

bool has_support(std::uint32_t seed, FrameFeatures& features, const MotionVotesOptions& options,
                 const std::vector<FeatureMotion>& motions) {
  const cv::Point centre = features.pixel(seed);
  const int reach = options.radius_px;
  const std::int64_t squared_reach = std::int64_t{reach} * reach;
  const cv::Rect box(centre.x - reach, centre.y - reach, 2 * reach + 1, 2 * reach + 1);
  Nearest nearest(options.neighbours * features_a_voice);
  for (const std::uint32_t i : features.inside(box)) {
    const cv::Point pixel = features.pixel(i);
    const std::int64_t dx = pixel.x - centre.x, dy = pixel.y - centre.y;
    const std::int64_t squared_distance = dx * dx + dy * dy;
    if (squared_distance > std::min(squared_reach, nearest.squared_reach())) continue;
    if (i == seed || !motions[i].is_known()) continue;
    if (motions[seed].is_apart(motions[i], options.max_depth_difference_m)) continue;
    nearest.offer({squared_distance, pixel, i});
  }
  // One corner has features in several octaves: they are one voice, and no neighbours.
  std::array<cv::Point, max_voices> heard{centre};
  std::size_t voices = 1, alike = 0;
  for (const Neighbour& neighbour : nearest) {
    const auto is_same = [&](cv::Point other) {
      const cv::Point away = neighbour.pixel - other;
      return away.dot(away) < options.min_spacing_px * options.min_spacing_px;
    };
    if (voices > options.neighbours) break;
    if (std::any_of(heard.begin(), heard.begin() + static_cast<std::ptrdiff_t>(voices), is_same))
      continue;
    heard[voices++] = neighbour.pixel;
    const FeatureMotion& other = motions[neighbour.index];
    alike += is_seed(other) && moves_alike(motions[seed], other, options) ? 1 : 0;
  }
  const auto neighbours = static_cast<double>(voices - 1);
  return alike >= options.min_seeds && static_cast<double>(alike) >= options.min_share * neighbours;
}

/// Tells whether enough seeds that have support are near and move as this one does.
bool may_join(std::uint32_t seed, FrameFeatures& features, const MotionVotesOptions& options,
              const std::vector<FeatureMotion>& motions) {
  if (!(motions[seed].depth_m > 0)) return false;
  const cv::Point centre = features.pixel(seed);
  const int reach = options.join_radius_px;
  std::size_t joined = 0;
  for (const std::uint32_t i : features.inside(
           cv::Rect(centre.x - reach, centre.y - reach, 2 * reach + 1, 2 * reach + 1))) {
    const cv::Point away = features.pixel(i) - centre;
    const bool is_near = away.dot(away) <= reach * reach;
    const bool is_same = away.dot(away) < options.min_spacing_px * options.min_spacing_px;
    if (!motions[i].has_support || !is_near || is_same) continue;
    if (motions[seed].is_apart(motions[i], options.max_depth_difference_m)) continue;
    joined += moves_alike(motions[seed], motions[i], options) ? 1 : 0;
  }
  return joined >= options.min_joined;
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
    motions[i].has_support = is_seed(motions[i]) && has_support(i, features, options, motions);
  }
  for (std::uint32_t i = 0; i < motions.size(); ++i) {
    if (motions[i].evidence != MotionEvidence::seed) continue;
    if (motions[i].has_support || may_join(i, features, options, motions)) {
      motions[i].evidence = MotionEvidence::supported;
    }
  }
}

}  // namespace dynfilter
