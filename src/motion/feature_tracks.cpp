// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Where the features were: the static place first, a search for what is not there.

#include <algorithm>
#include <cstdint>

#include "motion_frame.hpp"

namespace dynfilter::detail {
namespace {

constexpr float near_px = 0.75F;     // a place so near to the static one is that
constexpr float noise_px = 0.2F;     // a smaller shift is no motion of its own
constexpr float max_back_px = 0.6F;  // of a feature from where tracking it back ends
// Differences of a patch, as shares of its contrast: of a track, of one that needs no check, and of
// one that need not have settled.
constexpr float max_fit = 0.7F, sure_fit = 0.45F, static_fit = 0.4F, good_fit = 0.35F;
constexpr float noise_grey = 4;  // a smaller difference is always a fit, grey levels
constexpr int follow_steps = 4, search_steps = 6, back_steps = 5;

float square_of(cv::Point2f vector) { return vector.dot(vector); }

bool fits(float difference, float contrast, float share) {
  return difference <= std::max(noise_grey, share * contrast);
}

/// One feature over one baseline.
class Tracker {
 public:
  Tracker(const MotionContext& context, std::uint32_t index, std::size_t baseline)
      : context_(context),
        index_(index),
        baseline_(baseline),
        feature_(context.scratch.features[index]),
        patch_(context.scratch.patches[index]),
        then_(context.then(baseline).grey),
        from_raw_(cv::Point2f(feature_.pixel) - feature_.raw) {}

  /// Looks for the feature at its static place, and where else it may have been.
  PatchTrack track() {
    const Baseline& over = context_.scratch.over[baseline_];
    const auto place = context_.static_place(feature_, over.pose, double{feature_.place_depth_m});
    if (!(patch_.texture() > min_texture) || !place) return {};
    static_place_ = *place + from_raw_;
    track_.static_difference = patch_.look(then_[0], static_place_).difference;
    const bool is_found = baseline_ == short_baseline ? track_back_one() : track_back_long();
    if (!is_found) return track_;
    track_.is_found = true;
    if (baseline_ == short_baseline) {
      feature_.off_place = at_ - static_place_;
      feature_.was_at_place = is_near_place(at_);
    }
    track_.position = at_ - from_raw_;
    return track_;
  }

 private:
  bool track_back_one() {
    if (feature_.expected && is_found_near(place_of(feature_.raw - feature_.expected->flow))) {
      return true;
    }
    const FeatureTrack* const of_host =
        context_.memory.host_tracks.empty() ? nullptr : &context_.memory.host_tracks[index_];
    if (is_at_static_place(static_place_)) return true;
    if (of_host && of_host->is_found && is_found_near(place_of(of_host->position))) return true;
    return is_found_by_search(static_place_, 1) || is_found_by_search(place_of(feature_.raw), 2);
  }

  /// Over the long baseline its own motion, if it has any, goes on.
  bool track_back_long() {
    const auto times = static_cast<float>(baseline_frames[long_baseline]);
    const bool has_moved = feature_.tracks[short_baseline].is_found &&
                           square_of(feature_.off_place) > noise_px * noise_px;
    const cv::Point2f from = has_moved ? static_place_ + times * feature_.off_place : static_place_;
    if (is_at_static_place(from)) return true;
    // What was at its place a frame ago and is not now was hidden, or has no good patch.
    return !feature_.was_at_place && is_found_by_search(from, 1);
  }

  cv::Point2f place_of(cv::Point2f raw) const { return raw + from_raw_; }

  bool is_near_place(cv::Point2f at) {
    if (square_of(at - static_place_) <= near_px * near_px) return true;
    if (feature_.pose_depth_m > 0) return false;
    const auto residual =
        context_.residual(feature_, context_.scratch.over[baseline_].pose, at - from_raw_);
    return residual && residual->distance_px <= double{near_px};
  }

  /// Follows the patch from its static place, or from where its motion leads. A good match near the
  /// static place is enough there; any other must be found back.
  bool is_at_static_place(cv::Point2f from) {
    const float contrast = patch_.contrast();
    const ImagePatch::Match match =
        patch_.follow(then_[0], from, follow_steps, good_fit * contrast);
    const bool is_match = match.has_settled || match.difference <= static_fit * contrast;
    if (match.difference < 0 || !is_match || !fits(match.difference, contrast, max_fit)) {
      return false;
    }
    const bool is_sure = fits(match.difference, contrast, sure_fit) ||
                         (baseline_ == long_baseline && feature_.was_at_place);
    const bool is_enough = is_sure && is_near_place(match.place);
    if (!is_enough && !comes_back(match.place)) return false;
    at_ = match.place;
    track_.difference = match.difference;
    return true;
  }

  bool is_found_near(cv::Point2f from) {
    const ImagePatch::Match match = patch_.follow(then_[0], from, follow_steps);
    const bool is_match = match.has_settled && fits(match.difference, patch_.contrast(), max_fit);
    if (!is_match || !comes_back(match.place)) return false;
    at_ = match.place;
    track_.difference = match.difference;
    return true;
  }

  bool is_found_by_search(cv::Point2f from, std::size_t top_level) {
    PatchTrack found;
    if (!search(context_, index_, baseline_, from, top_level, found)) return false;
    if (!comes_back(found.position)) return false;
    at_ = found.position;
    track_.difference = found.difference;
    return true;
  }

  /// Tells whether tracking a feature from where it was found ends where it began.
  bool comes_back(cv::Point2f found) const {
    ImagePatch back;
    back.read(then_[0], nearest_pixel(found));
    if (!(back.texture() > 0)) return false;
    const cv::Point2f expected = cv::Point2f(feature_.pixel) + (cv::Point2f(back.centre()) - found);
    const ImagePatch::Match match = back.follow(context_.memory.now.grey[0], expected, back_steps);
    return match.difference >= 0 && square_of(match.place - expected) <= max_back_px * max_back_px;
  }

  const MotionContext& context_;
  std::uint32_t index_;
  std::size_t baseline_;
  FeatureMotion& feature_;
  const ImagePatch& patch_;
  const std::array<cv::Mat1b, MotionMemory::levels>& then_;
  cv::Point2f from_raw_;           // the patch lies around the nearest pixel
  cv::Point2f static_place_, at_;  // of the patch
  PatchTrack track_;
};

}  // namespace

bool search(const MotionContext& context, std::uint32_t index, std::size_t baseline,
            cv::Point2f from, std::size_t top_level, PatchTrack& track) {
  const auto& now = context.memory.now.grey;
  const auto& then = context.then(baseline).grey;
  const ImagePatch& fine = context.scratch.patches[index];
  const cv::Point2f centre(context.scratch.features[index].pixel);
  cv::Point2f found = from;
  ImagePatch coarse;
  for (std::size_t level = top_level + 1; level-- > 0;) {
    const auto scale = static_cast<float>(std::size_t{1} << level);
    if (level > 0) coarse.read(now[level], nearest_pixel(centre / scale));
    const ImagePatch& patch = level > 0 ? coarse : fine;
    if (!(patch.texture() > 0)) continue;
    const cv::Point2f at(patch.centre());
    const ImagePatch::Match match =
        patch.follow(then[level], at + (found - centre) / scale, search_steps);
    if (match.difference < 0) return false;
    found = centre + (match.place - at) * scale;
    track.difference = match.difference;
  }
  track.position = found;
  return fits(track.difference, fine.contrast(), max_fit);
}

void track_features(const MotionContext& context, std::size_t baseline) {
  std::vector<FeatureMotion>& features = context.scratch.features;
  for (std::uint32_t i = 0; i < features.size(); ++i) {
    if (features[i].corner == i)
      features[i].tracks[baseline] = Tracker(context, i, baseline).track();
  }
  for (FeatureMotion& feature : features) {
    const FeatureMotion& corner = features[feature.corner];
    if (&corner == &feature) continue;
    feature.tracks[baseline] = corner.tracks[baseline];
    feature.tracks[baseline].position += feature.raw - corner.raw;
    feature.off_place = corner.off_place;
    feature.was_at_place = corner.was_at_place;
  }
}

}  // namespace dynfilter::detail
