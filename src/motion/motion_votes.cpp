// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_votes.hpp"

#include <algorithm>
#include <cstdint>
#include <tuple>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {
namespace {

constexpr std::size_t max_neighbours = 100;

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
                       options.min_share >= 0 && options.min_share <= 1 &&
                       options.max_difference >= 0 && options.max_difference_px >= 0;
  if (is_good) return;
  detail::throw_misuse(
      "support_seeds",
      detail::concatenate("radius_px = ", options.radius_px, ", neighbours = ", options.neighbours,
                          ", min_share = ", options.min_share,
                          ", max_difference = ", options.max_difference,
                          ", max_difference_px = ", options.max_difference_px),
      "a radius of 1 to 1000, 1 to 100 neighbours, a share from 0 to 1, no negative difference");
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

  const Neighbour* begin() const { return kept_.data(); }
  const Neighbour* end() const { return kept_.data() + count_; }
  std::size_t size() const { return count_; }

 private:
  std::array<Neighbour, max_neighbours> kept_;
  std::size_t limit_, count_ = 0;
};

bool moves_alike(const FeatureMotion& a, const FeatureMotion& b,
                 const MotionVotesOptions& options) {
  if (!b.is_tracked[a.baseline]) return false;
  const cv::Vec2f& shift = a.shift_px[a.baseline];
  const double limit = options.max_difference * cv::norm(shift) + options.max_difference_px;
  return cv::norm(shift - b.shift_px[a.baseline]) <= limit;
}

bool has_support(std::uint32_t seed, FrameFeatures& features, const MotionVotesOptions& options,
                 const std::vector<FeatureMotion>& motions) {
  const cv::Point centre = features.pixel(seed);
  const int reach = options.radius_px;
  const cv::Rect box(centre.x - reach, centre.y - reach, 2 * reach + 1, 2 * reach + 1);
  Nearest nearest(options.neighbours);
  for (const std::uint32_t i : features.inside(box)) {
    if (i == seed || !motions[i].is_known()) continue;
    const cv::Point pixel = features.pixel(i);
    const std::int64_t dx = pixel.x - centre.x, dy = pixel.y - centre.y;
    if (dx * dx + dy * dy > std::int64_t{reach} * reach) continue;
    nearest.offer({dx * dx + dy * dy, pixel, i});
  }
  std::size_t alike = 0;
  for (const Neighbour& neighbour : nearest) {
    const FeatureMotion& other = motions[neighbour.index];
    alike += is_seed(other) && moves_alike(motions[seed], other, options) ? 1 : 0;
  }
  return alike >= options.min_seeds &&
         static_cast<double>(alike) >= options.min_share * static_cast<double>(nearest.size());
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
    if (motions[i].evidence != MotionEvidence::seed) continue;
    if (has_support(i, features, options, motions)) {
      motions[i].evidence = MotionEvidence::supported;
    }
  }
}

}  // namespace dynfilter
