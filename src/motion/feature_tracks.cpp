// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Where the features were: the static place first, a search for what is not there.

#include <algorithm>
#include <cstdint>

#include "motion_frame.hpp"

namespace dynfilter::detail {
namespace {

/// A position so near to the static place is that place. A larger one hides slow motion.
constexpr float near_px = 0.75F;
/// A smaller shift is noise, which goes on over no longer baseline.
constexpr float noise_px = 0.2F;
/// A feature that is tracked back must end so near. A larger one lets wrong tracks pass.
constexpr float max_back_px = 0.6F;
// A patch fits if its difference is at most a share of its contrast: where it was tracked, where
// the fit needs no check, and where the steps need not have settled. Larger shares accept other
// patches.
constexpr float max_fit = 0.7F, sure_fit = 0.45F, static_fit = 0.4F, good_fit = 0.35F;
/// A smaller difference always fits, grey levels: sensors differ by as much.
constexpr float noise_grey = 4;
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
        place_(context.found.places[index]),
        patch_(context.found.patches[index]),
        then_(context.then(baseline).grey),
        from_raw_(cv::Point2f(place_.pixel) - place_.raw) {}

  /// Looks for the feature at its static place, and where else it may have been.
  PatchTrack track() {
    const Baseline& over = context_.found.over[baseline_];
    const auto at = context_.static_place(index_, over.pose, double{place_.place_depth_m});
    if (!(patch_.texture() > min_texture) || !at) return {};
    static_place_ = *at + from_raw_;
    track_.static_difference = patch_.look(then_[0], static_place_).difference;
    const bool is_found = baseline_ == short_baseline ? track_back_one() : track_back_long();
    if (!is_found) return track_;
    track_.is_found = true;
    if (baseline_ == short_baseline) {
      track_.off_place = at_ - static_place_;
      track_.was_at_place = is_near_place(at_);
    }
    track_.position = at_ - from_raw_;
    return track_;
  }

 private:
  bool track_back_one() {
    const Mover* const expected = context_.found.suspects[index_].expected;
    if (expected && is_found_near(in_patch(place_.raw - expected->flow))) return true;
    return is_at_static_place(static_place_) || is_found_by_search(static_place_, 1) ||
           is_found_by_search(in_patch(place_.raw), 2);
  }

  /// Over the long baseline its own motion, if it has any, goes on.
  bool track_back_long() {
    const auto times = static_cast<float>(baseline_frames[long_baseline]);
    const PatchTrack& short_track = context_.found.tracks[short_baseline][index_];
    const bool has_moved =
        short_track.is_found && square_of(short_track.off_place) > noise_px * noise_px;
    const cv::Point2f from =
        has_moved ? static_place_ + times * short_track.off_place : static_place_;
    if (is_at_static_place(from)) return true;
    // What was at its place a frame ago and is not now was hidden, or has no good patch.
    return !short_track.was_at_place && is_found_by_search(from, 1);
  }

  cv::Point2f in_patch(cv::Point2f raw) const { return raw + from_raw_; }

  bool is_near_place(cv::Point2f at) {
    if (square_of(at - static_place_) <= near_px * near_px) return true;
    if (place_.pose_depth_m > 0) return false;
    const auto residual =
        context_.residual(index_, context_.found.over[baseline_].pose, at - from_raw_);
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
    const bool is_sure =
        fits(match.difference, contrast, sure_fit) ||
        (baseline_ == long_baseline && context_.found.tracks[short_baseline][index_].was_at_place);
    const bool is_enough = is_sure && is_near_place(match.place);
    if (!is_enough && !is_found_back(match.place)) return false;
    at_ = match.place;
    track_.difference = match.difference;
    return true;
  }

  bool is_found_near(cv::Point2f from) {
    const ImagePatch::Match match = patch_.follow(then_[0], from, follow_steps);
    const bool is_match = match.has_settled && fits(match.difference, patch_.contrast(), max_fit);
    if (!is_match || !is_found_back(match.place)) return false;
    at_ = match.place;
    track_.difference = match.difference;
    return true;
  }

  bool is_found_by_search(cv::Point2f from, std::size_t top_level) {
    PatchTrack found;
    if (!search(context_, index_, baseline_, from, top_level, found)) return false;
    if (!is_found_back(found.position)) return false;
    at_ = found.position;
    track_.difference = found.difference;
    return true;
  }

  /// Tells whether tracking a feature from where it was found ends where it began.
  bool is_found_back(cv::Point2f found) const {
    ImagePatch back;
    back.read(then_[0], nearest_pixel(found));
    if (!(back.texture() > 0)) return false;
    const cv::Point2f expected = cv::Point2f(place_.pixel) + (cv::Point2f(back.centre()) - found);
    const ImagePatch::Match match = back.follow(context_.memory.now.grey[0], expected, back_steps);
    return match.difference >= 0 && square_of(match.place - expected) <= max_back_px * max_back_px;
  }

  const MotionContext& context_;
  std::uint32_t index_;
  std::size_t baseline_;
  const FeaturePlace& place_;
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
  const ImagePatch& fine = context.found.patches[index];
  const cv::Point2f centre(context.found.places[index].pixel);
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

void track_features(const MotionContext& context, std::size_t baseline,
                    std::vector<PatchTrack>& tracks) {
  const std::vector<FeaturePlace>& places = context.found.places;
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    if (places[i].corner == i) tracks[i] = Tracker(context, i, baseline).track();
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::uint32_t corner = places[i].corner;
    if (corner == i) continue;
    tracks[i] = tracks[corner];
    tracks[i].position += places[i].raw - places[corner].raw;
  }
}

}  // namespace dynfilter::detail
