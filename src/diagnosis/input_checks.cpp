// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Each check is a function of the summary: the first of its findings that holds, or none. A figure
// that too few frames know is NaN, with which every comparison is false.

#include "dynfilter/diagnosis/input_checks.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "diagnosis/input_summary.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/frame_table.hpp"

namespace dynfilter {
namespace {

using detail::concatenate;
using detail::min_kept;
using detail::size_name;
using Finding = std::optional<InputFinding>;
using Summary = detail::InputSummary;

/// What each check says; parts take the place of each {}.
constexpr struct {
  const char *check, *text;
} sentences[] = {
    {"camera_size",
     "the camera (fx {}, fy {}, cx {}, cy {}) does not fit images of {}: take the one that "
     "recorded them, at this size"},
    {"times", "frames are {} s apart: {}"},
    {"image_size",
     "frames of {} pixels come with an image, depth or mask of {}: all need one size"},
    {"images_missing",
     "none of {} frames had an image, which {} needs: call submit() with each image before the "
     "frame is filtered"},
    {"image_range",
     "images use {} of 255 greys, up to {}, so that few features are found: scale the greys to the "
     "whole range (16-bit files of 10 to 14 bits need a factor), or add light"},
    {"image_frozen",
     "{} of the images are those of the frame before: write each of the camera's images once"},
    {"depth_empty", "{} of each depth image is empty: write 16 bits, or float in metres"},
    {"depth_steps",
     "depth comes in steps of {} of it: was it rounded, to whole metres? Write millimetres, or "
     "float in metres"},
    {"depth_unit", "depth is too {}: its median is {} m{}; set {} to {} for TUM and BONN"},
    {"depth_one_value",
     "the value {} holds over 5 % of each depth image: if it means \"no depth\", write 0 in its "
     "place"},
    {"depth_frozen",
     "{} of the depth images are those of the frame before, while images change: give each image "
     "its own depth"},
    {"depth_inverted",
     "people lie behind what surrounds them: is it disparity? Write depth, focal length x baseline "
     "/ disparity"},
    {"depth_late",
     "depth is {} by {} frames, so that people leave features behind: pair the images anew: "
     "--depth-offset {} (in code depth_offset_s), for a SLAM program `dynfilter sync SEQUENCE "
     "--write FILE`"},
    {"masks_missing",
     "none of {} frames had masks, so that {}: does {} give this recording's, for the times of its "
     "frames?"},
    {"masks_everywhere",
     "masks cover {} of the image and {} of its border: are they inverted, or maps of classes? "
     "Pixels on people are not 0, all others are"},
    {"masks_soft",
     "masks hold {} shades of grey, and each but 0 counts as a person: threshold them at half, and "
     "save them as PNG"},
    {"masks_values",
     "masks hold the values {}, and each but 0 counts as a person: if they are classes, or one "
     "means \"ignore\", keep people alone, or write instances.csv"},
    {"masks_empty",
     "the masks of {} frames mark nobody, so that nothing is removed: is nobody there?"},
    {"masks_classes",
     "no instance is of a dynamic class ({}); the masks hold {} {}: see --classes (else "
     "dynamic_classes); ids count from 0, person is 0"},
    {"masks_boxes",
     "masks are filled boxes, so that what is around people is removed, too: give outlines, or "
     "boxes without masks"},
    {"boxes_alone", "boxes without masks need depth, and remove nothing without it: give either"},
    {"masks_frozen",
     "{} of the masks are those of the frame before, while images change: make masks of each "
     "image"},
    {"masks_age",
     "masks are {} s old, and people have moved since: take a faster segmenter, or move late masks "
     "(--rule depth_moved, MaskPropagator, in a host dynfilter.propagate); if the age is wrong, "
     "give masks the time of their image, as in the column mask_time of instances.csv"},
    {"depth_shift",
     "people's depth lies {} px to the {} of their masks and {} px {}, at a width of 640: register "
     "depth to the images; or are the masks of other frames?"},
    {"masks_elsewhere",
     "masks lie {} px beside the people, at a width of 640: are they mirrored, or of other "
     "frames?"},
    {"masks_small",
     "people reach {} px beyond their masks, at a width of 640: take a larger network, a lower "
     "threshold, or a margin of so much"},
    {"depth_rim",
     "depth never reaches the outer {} of the image's {}, where masks act alone: take a wider "
     "depth mode, or crop images, masks and depth"},
    {"features_without_depth",
     "{} of the features have no depth: is it registered to the images, and the scene within the "
     "sensor's reach?"},
    {"people_without_depth",
     "{} of the features on people have no depth, so that masks act alone there: take a depth mode "
     "that fills people, or a margin"},
    {"motion", "motion judged nothing in {} frames: {}{}"},
    {"features_few",
     "only {} of {} features are found in an image: it is blurred, dark, plain or small. Mend "
     "that, or lower the extractor's threshold"},
    {"map_start",
     "the host has not begun a map, because none of the first {} frames kept the {} features that "
     "it needs (the best kept {}): set {} to {}"},
    {"features_left",
     "{} of the frames keep fewer than {} features, because people cover them: set {} to {}"},
};

constexpr double max_missing =
    0.98;  // share of places or frames; a larger one overlooks what is hopeless
constexpr double max_without_depth = 0.55;  // share of features; in recordings 0.43, in levels 0.47

template <class... Parts>
InputFinding say(const char* check, const Parts&... parts) {
  std::string sentence =
      std::find_if(std::begin(sentences), std::end(sentences), [&](const auto& one) {
        return std::string(check) == one.check;
      })->text;
  [[maybe_unused]] std::size_t at = 0;
  [[maybe_unused]] const auto fill = [&](const std::string& part) {
    at = sentence.find("{}", at);
    sentence.replace(at, 2, part);
    at += part.size();
  };
  (fill(concatenate(parts)), ...);
  return {check, sentence, false};
}

InputFinding hopeless_if(bool is_hopeless, InputFinding finding) {
  finding.is_hopeless = is_hopeless;
  return finding;
}

/// Rounds to two digits.
double rounded(double value) {
  if (!(value > 0)) return value;
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

std::string percent(double share) { return detail::fixed_decimals(100 * share, 0) + " %"; }

template <class Numbers>
std::string list(const Numbers& numbers) {
  std::string text;
  for (const int number : numbers) {
    if (text.size() < 24) text += (text.empty() ? "" : ", ") + std::to_string(number);
  }
  return text;
}

/// Tells whether masks cover so much that they cannot be people, of whom then nothing is concluded.
/// Crowds cover 0.54 of the image and 0.33 of its border.
bool are_masks_odd(const Summary& s) { return s.covered() > 0.75 || s.border() > 0.6; }

/// Tells whether images are too dim for their features to tell anything. 12 bits in a 16-bit file
/// leave 16 greys, 14 bits 64; recordings have 190 and more, levels 127.
bool are_images_dim(const Summary& s) { return s.grey_range(0.9) < 64; }

Finding camera_is_wrong(const Summary& s) {
  const double width = s.size.width, height = s.size.height;
  const double fx = s.camera.fx, fy = s.camera.fy, cx = s.camera.cx, cy = s.camera.cy;
  const bool is_usual = std::abs(cx - width / 2) < width / 5 &&
                        std::abs(cy - height / 2) < height / 5 && fx > 0.3 * width &&
                        fx < 4 * width && std::abs(fx / fy - 1) < 0.1;
  if (!(fx > 0) || s.size.empty() || is_usual) return {};
  return say("camera_size", fx, fy, cx, cy, size_name(s.size));
}

/// Who takes every n-th frame has them seconds apart; in milliseconds, 125 a second are 8 apart.
Finding times_are_wrong(const Summary& s) {
  const double period_s = s.period_s();
  const bool are_indices = s.are_times_whole && std::abs(period_s - 1) < 0.01;
  if (!(period_s < 0.001 || are_indices || period_s > 8)) return {};
  const char* const cure = period_s > 1e6    ? "are their times nanoseconds? Give seconds"
                           : period_s > 1e3  ? "are their times microseconds? Give seconds"
                           : are_indices     ? "are their times indices? Give seconds"
                           : period_s > 8    ? "are their times milliseconds? Give seconds"
                           : !(period_s > 0) ? "give each its own time, which grows"
                                             : "give seconds";
  return say("times", rounded(period_s), cure);
}

/// The noise of a camera makes each image another.
Finding images_are_wrong(const Summary& s) {
  const std::string& setting = s.options.images_setting;
  const double repeated = s.share_of_pairs(s.repeated_images), range = s.grey_range(0.9);
  if (!s.other_size.empty()) return say("image_size", size_name(s.size), s.other_size);
  if (s.is_none(s.with_image) && !setting.empty()) return say("images_missing", s.frames, setting);
  if (are_images_dim(s))
    return hopeless_if(range < 6.4, say("image_range", range, s.brightest(0.9)));
  if (repeated > 0.3)
    return hopeless_if(repeated > max_missing, say("image_frozen", percent(repeated)));
  return {};
}

/// No sensor sees nearer than 0.2 m, and few scenes are deeper than 40 m; a street's median is
/// 14 m. A square as large as the nearest person is 0.26 to 0.8 m wide in recordings, and 1.4 m for
/// a row of them: a fifth and the fivefold are beyond the limits. A scene at a fifth of its size
/// with people ends before 2.5 m; without people it ends before 1 m, or begins before 0.3 m and
/// ends before 1.7 m, while a desk begins at 0.4 m.
Finding unit_is_wrong(const Summary& s) {
  const double median_m = s.depth_m(), far_m = s.far_m(), people_m = s.people_m();
  const bool has_people = people_m > 0 && !are_masks_odd(s);
  const bool is_small =
      median_m < 0.2 || (has_people ? people_m < 0.15 && far_m < 2.5
                                    : far_m < 1 || (s.near_m() < 0.3 && far_m < 1.7));
  const bool is_large = median_m > 40 || (has_people && people_m > 1.5);
  if (!is_small && !is_large) return {};
  const bool is_factor = s.options.depth_setting == InputChecksOptions().depth_setting;
  return hopeless_if(
      median_m < 0.02 || median_m > 80,
      say("depth_unit", is_small ? "small" : "large", rounded(median_m),
          has_people ? concatenate(", and people are ", rounded(people_m), " m wide") : "",
          s.options.depth_setting,
          is_factor ? "1/1000 for millimetres, 1/5000"
                    : "the units in a metre: 1000 for millimetres, 5000"));
}

/// The edges' distances must rise on both sides of the offset, on one by 0.15 of the other. Less
/// takes hair, whose edges look early, for an offset.
Finding depth_is_late(const Summary& s) {
  const DepthOffsetEstimate estimate = s.offset.estimate();
  const auto [seconds, late, sigma] = estimate.offset.value_or(DepthOffset());
  const auto& px = estimate.distances_px;
  const double lowest = *std::min_element(px.begin(), px.end());
  const auto rise = std::minmax({px.front() - lowest, px.back() - lowest});
  if (!(rise.first > 0.15 * rise.second && std::abs(late) - 2 * sigma > detail::max_frames_late))
    return {};
  return say("depth_late", late < 0 ? "early" : "late", rounded(std::abs(late)),
             std::round(seconds * 1000) / 1000);
}

/// A Kinect's depths are 0.023 of them apart at 8 m. What surrounds people is behind them.
Finding depth_is_wrong(const Summary& s) {
  const double repeated = s.share_of_pairs(s.repeated_depths);
  if (s.missing() > max_missing) return say("depth_empty", percent(s.missing()));
  if (s.step() > 0.03) return say("depth_steps", percent(s.step()));
  if (Finding unit = unit_is_wrong(s)) return unit;
  if (s.one_value() > 0 && s.one_value(0.4) == s.one_value())
    return say("depth_one_value", s.one_value());
  if (repeated > 0.3 && !images_are_wrong(s)) return say("depth_frozen", percent(repeated));
  if (s.nearer() > 0.8 && !are_masks_odd(s)) return say("depth_inverted");
  return depth_is_late(s);
}

/// Labels are one value, or 1 to at most 100. Masks of classes have few values; soft ones have
/// more.
Finding values_are_wrong(const Summary& s) {
  const auto count = static_cast<int>(s.mask_values.size());
  if (count < 2 || (s.mask_values.back() == count && count <= 100)) return {};
  return count > 16 ? say("masks_soft", count) : say("masks_values", list(s.mask_values));
}

/// People fill 0.4 to 0.8 of the boxes around them. Masks of who sits may repeat.
Finding masks_are_wrong(const Summary& s) {
  const std::string& setting = s.options.masks_setting;
  const double repeated = s.share_of_pairs(s.repeated_masks);
  if (s.is_none(s.with_masks) && !setting.empty()) {
    const bool removes = s.removes_elsewhere;
    return say("masks_missing", s.frames,
               removes ? "only motion or static_mask removed features" : "nothing was removed",
               setting);
  }
  if (are_masks_odd(s))
    return hopeless_if(s.covered() > max_missing,
                       say("masks_everywhere", percent(s.covered()), percent(s.border())));
  if (Finding values = values_are_wrong(s)) return values;
  const bool are_seen = s.other_size.empty() && s.is_none(s.frames - s.with_masks);
  if (s.classes.empty() && are_seen) return say("masks_empty", s.frames);
  if (!s.classes.empty() && !s.has_dynamic) {
    return say("masks_classes", list(s.options.dynamic_classes),
               s.classes.size() == 1 ? "class" : "classes", list(s.classes));
  }
  if (s.has_dynamic && !s.has_outline && s.is_none(s.with_depth)) return say("boxes_alone");
  if (s.filled() > 0.97) return say("masks_boxes");
  if (repeated > 0.8 && !images_are_wrong(s)) return say("masks_frozen", percent(repeated));
  return {};
}

Finding masks_are_old(const Summary& s) {
  if (!(s.age_s() > 0.05) || s.options.moves_masks) return {};
  return say("masks_age", rounded(s.age_s()));
}

/// The search is 4 px coarse. Depth that is not registered is shifted alike in all frames.
Finding people_are_apart(const Summary& s) {
  const double x = s.shift_x(), y = s.shift_y(), apart = s.distance();
  if (!(apart > 10) || s.age_s() > 0.05 || depth_is_wrong(s) || masks_are_wrong(s)) return {};
  if (!(std::hypot(x, y / 2) > 0.7 * apart && s.fit() > 0.75))
    return say("masks_elsewhere", rounded(apart));
  return say("depth_shift", std::abs(x), x < 0 ? "left" : "right", std::abs(y),
             y < 0 ? "above" : "below");
}

/// Networks' masks are 4 px coarse.
Finding masks_are_small(const Summary& s) {
  if (!(s.gap_px() > 8) || are_masks_odd(s)) return {};
  return say("masks_small", rounded(s.gap_px()));
}

/// A Kinect lacks depth in 0.08 of the width.
Finding depth_has_a_rim(const Summary& s) {
  const double sides = 1 - s.with_depth_at.width, ends = 1 - s.with_depth_at.height;
  if (!(s.depth_m() > 0) || std::max(sides, ends) <= 0.15) return {};
  return say("depth_rim", percent(std::max(sides, ends)), sides > ends ? "width" : "height");
}

Finding features_are_elsewhere(const Summary& s) {
  return s.other_size.empty() ? s.places.about_features(s.size) : std::nullopt;
}

Finding boxes_are_wrong(const Summary& s) { return s.places.about_boxes(); }

/// In recordings, 0.18 of the features on people have no depth, in levels 0.24.
Finding features_lack_depth(const Summary& s) {
  const double without = s.without_depth(), hollow = s.hollow / std::max(1.0, s.on_people);
  if (features_are_elsewhere(s)) return {};
  if (without > max_without_depth && !(s.missing() > max_missing))
    return say("features_without_depth", percent(without));
  const bool is_hollow =
      without <= max_without_depth && hollow > 0.3 && s.on_people > double{min_kept};
  if (!is_hollow || masks_are_wrong(s) || people_are_apart(s)) return {};
  return say("people_without_depth", percent(hollow));
}

Finding motion_is_idle(const Summary& s) {
  if (!s.is_none(s.judged) || s.motion == MotionOutcome::not_run) return {};
  return say("motion", s.frames, detail::name_of(s.motion),
             s.with_depth == s.frames ? "" : ". It needs a depth image with each frame");
}

Finding features_are_few(const Summary& s) {
  if (!(s.features() < 0.5 * s.wanted()) || are_masks_odd(s) || are_images_dim(s)) return {};
  return say("features_few", s.features(), s.wanted());
}

/// Returns how many features to ask for: more than were, whatever the statistics suggest. 0: more
/// are no help, because few can be found, or masks take them all. Where a map is to begin, 2000
/// sufficed in all sequences that were measured, and come first.
double more_features(const Summary& s) {
  constexpr double for_maps = 2000;
  if (are_masks_odd(s) || features_are_few(s) || are_images_dim(s)) return 0;
  if (s.options.map_features > 0 && s.wanted() < for_maps) return for_maps;
  return 100 * std::ceil(std::max({s.suggested, s.features() + 1, s.wanted() + 1}) / 100);
}

Finding features_are_starved(const Summary& s) {
  const double share = s.starved / static_cast<double>(s.frames);
  if (!s.has_enough() || share <= 0.1 || more_features(s) == 0) return {};
  return say("features_left", percent(share), min_kept, s.options.features_setting,
             more_features(s));
}

/// A map without depth begins with fewer.
Finding map_cannot_start(const Summary& s) {
  const auto needed = static_cast<double>(s.options.map_features);
  const bool has_depth = s.has_enough() && s.with_depth == s.frames;
  if (!has_depth || s.most_kept >= needed || more_features(s) == 0) return {};
  return say("map_start", s.frames, needed, s.most_kept, s.options.features_setting,
             more_features(s));
}

constexpr Finding (*checks[])(const Summary&) = {
    features_are_elsewhere, boxes_are_wrong,  camera_is_wrong,  times_are_wrong,
    images_are_wrong,       depth_is_wrong,   masks_are_wrong,  masks_are_old,
    people_are_apart,       masks_are_small,  depth_has_a_rim,  features_lack_depth,
    motion_is_idle,         features_are_few, map_cannot_start, features_are_starved};

}  // namespace

std::vector<InputFinding> InputChecks::findings() const {
  std::vector<InputFinding> found;
  for (const auto& check : checks) {
    if (Finding finding = check(*summary_)) found.push_back(std::move(*finding));
  }
  return found;
}

}  // namespace dynfilter
