// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/input_checks.hpp"

#include <algorithm>
#include <cmath>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/feature_floor.hpp"
#include "io/frame_table.hpp"

namespace dynfilter {
namespace {

using detail::concatenate;

constexpr std::size_t min_checked_frames = 8;               // that a check rests on
constexpr double max_period_s = 0.9, min_period_s = 0.001;  // from frame to frame
/// Share of images that equal the one before: a camera's noise makes it 0.
constexpr double max_repeated = 0.3, max_masks_repeated = 0.8;  // masks of who sits may repeat
/// Difference of grey, from 1 to 99 % of the places. 12 bits in a 16-bit file leave 16 greys, 14
/// bits 64; recordings have 190 and more, levels 127.
constexpr double min_grey_range = 64;
/// Depth, metres: no sensor sees nearer, and few rooms are deeper.
constexpr double min_depth_m = 0.2, max_depth_m = 8;
/// Width of a square as large as the nearest person. Recorded ones have 0.26 to 0.8 (0.21 pasted at
/// a desk), so that a fifth of it is below 0.15; a row of them seen as one has 1.4.
constexpr double min_people_m = 0.15, max_people_m = 1.5;
/// A scene at a fifth of its size with people ends before 2.5 m. One without people ends before
/// 1 m, or begins before 0.3 m and ends before 1.7 m; a desk begins at 0.4 m.
constexpr double small_far_m[] = {2.5, 1.7, 1}, small_near_m = 0.3;
constexpr double hopeless_factor = 10;   // beyond these limits
constexpr double max_step = 0.03;        // between depths, as a share; a Kinect's is 0.023 at 8 m
constexpr double max_missing = 0.98;     // share of places without depth
constexpr double max_rim = 0.15;         // of width or height, never with depth; Kinect: 0.08
constexpr double max_frames_late = 0.5;  // beyond it, another depth image is nearer
constexpr double min_valley = 0.15;  // rise to one end of the tried offsets, of that to the other
constexpr double max_nearer = 0.8;   // share of what surrounds people that is before them: 0
/// Distance of people's depth from their masks, at a width of 640: the search is 4 px coarse. It is
/// steady if depth is not registered.
constexpr double max_shift_px = 10, steady_share = 0.7, min_shifted_fit = 0.75;
constexpr double max_without_depth = 0.55;  // share of features; recordings 0.43, levels 0.47
constexpr double max_hollow = 0.3;          // such a share on people; recordings 0.18, levels 0.24
/// Share of the image, and of its border, on masks. Crowds have 0.54 and 0.33.
constexpr double max_covered = 0.75, max_border = 0.6;
constexpr double max_age_s = 0.05, no_age_s = 1;  // of masks; beyond, they have no usable time
constexpr double max_gap_px = 8;       // at a width of 640; networks' masks are 4 px coarse
constexpr int max_labels = 100;        // in masks of instances
constexpr int max_values = 16;         // of masks of classes; soft masks have more
constexpr double min_found = 0.5;      // share of the features asked for
constexpr std::size_t min_kept = 200;  // features that suffice to go on tracking
constexpr double max_starved = 0.1;    // share of frames with fewer

/// Rounds to two digits.
double rounded(double value) {
  if (!(value > 0)) return value;
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

std::string percent(double share) { return detail::fixed_decimals(100 * share, 0) + " %"; }

}  // namespace

void InputChecks::look_at_features(const FrameView& frame, SegmentationView masks,
                                   FeaturesView features, Figures& figures) const {
  if (features.empty() && options_.wanted_features == 0) return;
  double without_depth = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const cv::Point pixel = features.pixel(i);
    const bool has_depth =
        features.has_depths() ? features.depth_m(i).has_value() : frame.depth_m(pixel).has_value();
    const bool is_person = masks.has_value() && is_on_people(*masks, pixel);
    without_depth += has_depth ? 0 : 1;
    figures.on_people += is_person ? 1 : 0;
    figures.hollow += is_person && !has_depth ? 1 : 0;
  }
  figures.features = static_cast<double>(features.size());
  figures.kept = figures.features - figures.on_people;
  if (!frame.depth.empty()) figures.without_depth = without_depth / std::max(1.0, figures.features);
}

void InputChecks::compare_times_of_depth(const FrameView& frame, double depth_timestamp_s) {
  const int type = frame.image.type();
  if (knows_offset_ || frame.image.empty() || frame.depth.empty() ||
      (type != CV_8UC1 && type != CV_8UC3)) {
    return;
  }
  offset_.add(frame, depth_timestamp_s);
  if (frames_.size() % 25 != 0) return;
  const std::optional<DepthOffset> offset = offset_.estimate().offset;
  if (!offset) return;
  const double late = std::abs(offset->frames_late), doubt = 2 * offset->sigma_frames;
  knows_offset_ = late - doubt > max_frames_late || late + doubt <= max_frames_late;
}

void InputChecks::add(const FrameView& frame, SegmentationView masks, FeaturesView features,
                      const FrameStatistics* statistics, std::optional<double> depth_timestamp_s) {
  validate(frame, "InputChecks");
  if (masks.has_value()) validate(*masks, "InputChecks");
  Figures figures;
  figures.time_s = frame.timestamp_s;
  figures.has_masks = masks.has_value();
  figures.has_depth = !frame.depth.empty() || features.has_depths();
  const bool has_instances = masks.has_value() && !(*masks).instances.empty();
  for (const cv::Size& size :
       {frame.image.size(), frame.depth.size(), has_instances ? (*masks).image_size : cv::Size()}) {
    if (size_.empty()) size_ = size;
    if (!size.empty() && size != size_) other_size_ = detail::size_name(size);
  }
  if (other_size_.empty()) {
    look_at_image(frame, figures);
    look_at_depth(frame, figures);
    if (masks.has_value()) look_at_masks(frame, *masks, figures);
    look_at_features(frame, masks, features, figures);
  }
  if (statistics != nullptr) {
    const std::size_t floor = std::max(min_kept, options_.map_features);
    figures.kept = static_cast<double>(statistics->kept());
    figures.suggested = static_cast<double>(suggested_features(*statistics, floor));
    figures.motion = statistics->motion.outcome;
    removes_elsewhere_ = removes_elsewhere_ || (!masks.has_value() && statistics->removed() > 0);
    for (const InstanceStatistics& instance : statistics->instances) {
      const double gap_px = 640 * instance.mask_gap_px / std::max(1, size_.width);
      if (instance.mask_gap_places > 0) figures.gap_px = gap_px;
    }
  }
  frames_.push_back(figures);
  if (other_size_.empty()) {
    compare_times_of_depth(frame, depth_timestamp_s.value_or(frame.timestamp_s));
  }
}

/// Collects the findings.
class InputChecks::Findings {
 public:
  /// Adds a finding if the check speaks, and tells so.
  template <class... Parts>
  bool operator()(bool speaks, const char* check, const Parts&... sentence) {
    if (speaks) list.push_back({check, concatenate(sentence...), false});
    return speaks;
  }

  bool has(const char* check) const {
    return std::any_of(list.begin(), list.end(), [&](auto& one) { return one.check == check; });
  }

  std::vector<InputFinding> list;
};

std::vector<InputFinding> InputChecks::findings() const {
  Findings say;
  check_frames(say);
  check_depth(say);
  check_masks(say);
  check_features(say);
  return std::move(say.list);
}

/// Returns a quantile over the frames that know the figure; unknown if these are too few.
double InputChecks::quantile(Figure figure, double share) const {
  std::vector<double> values;
  for (const Figures& frame : frames_) {
    if (!std::isnan(frame.*figure)) values.push_back(frame.*figure);
  }
  return values.size() < min_checked_frames ? unknown : detail::quantile_of(values, share);
}

double InputChecks::share_of(bool Figures::*what) const {
  if (frames_.size() < min_checked_frames) return unknown;
  const auto count = std::count_if(frames_.begin(), frames_.end(),
                                   [&](const Figures& frame) { return frame.*what; });
  return static_cast<double>(count) / static_cast<double>(frames_.size());
}

/// Whether masks cover so much that they cannot be people. Then nothing is concluded from people.
bool InputChecks::are_masks_odd() const {
  return quantile(&Figures::covered) > max_covered || quantile(&Figures::border) > max_border;
}

void InputChecks::check_frames(Findings& say) const {
  say(!camera_.model.empty(), "camera_model", "the camera is no pinhole with 5 coefficients (",
      camera_.model, "): undistort the images, and give the camera of the new ones");
  const double width = size_.width, height = size_.height;
  const bool is_usual = std::abs(camera_.cx - width / 2) < width / 5 &&
                        std::abs(camera_.cy - height / 2) < height / 5 &&
                        camera_.fx > 0.3 * width && camera_.fx < 4 * width &&
                        std::abs(camera_.fx / camera_.fy - 1) < 0.1;
  say(camera_.fx > 0 && width > 0 && !is_usual, "camera_size", "the camera (fx ", camera_.fx,
      ", fy ", camera_.fy, ", cx ", camera_.cx, ", cy ", camera_.cy, ") does not fit images of ",
      detail::size_name(size_), ": take the one that recorded them, at this size");
  say(!other_size_.empty(), "image_size", "frames of ", detail::size_name(size_),
      " pixels come with an image, depth or mask of ", other_size_, ": all need one size");
  std::vector<double> periods_s;
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    periods_s.push_back(frames_[i].time_s - frames_[i - 1].time_s);
  }
  const double period_s =
      frames_.size() < min_checked_frames ? unknown : detail::quantile_of(periods_s);
  say(period_s < min_period_s || period_s > max_period_s, "times", "frames are ", rounded(period_s),
      " s apart: are their times ",
      period_s > 1e6    ? "nanoseconds"
      : period_s > 1e3  ? "microseconds"
      : period_s > 1.01 ? "milliseconds"
                        : "indices",
      "? Give seconds");
  say(share_of(&Figures::has_image) == 0 && !options_.images_setting.empty(), "images_missing",
      "none of ", frames_.size(), " frames had an image, which ", options_.images_setting,
      " needs: call submit() with each image before the frame is filtered");
  const double range = quantile(&Figures::grey_range, 0.9);
  if (say(range < min_grey_range, "image_range", "images use ", range, " of 255 greys, up to ",
          quantile(&Figures::brightest, 0.9), ", so that few features are found: scale the greys ",
          "to the whole range (16-bit files of 10 to 14 bits need a factor), or add light")) {
    say.list.back().is_hopeless = range < min_grey_range / hopeless_factor;
  }
  const double frames = static_cast<double>(frames_.size()), pairs = frames / (frames - 1);
  const double repeated = pairs * share_of(&Figures::repeats_image);
  const double depth_repeated = pairs * share_of(&Figures::repeats_depth);
  if (say(repeated > max_repeated, "image_frozen", percent(repeated),
          " of the images are those of the frame before: write each of the camera's images once")) {
    say.list.back().is_hopeless = repeated > max_missing;
  }
  const double masks_repeated = pairs * share_of(&Figures::repeats_masks);
  say(masks_repeated > max_masks_repeated && repeated < max_repeated && !are_masks_odd(),
      "masks_frozen", percent(masks_repeated),
      " of the masks are those of the frame before, while images change: ",
      "make masks of each image");
  say(depth_repeated > max_repeated && repeated < max_repeated &&
          !(quantile(&Figures::one_value) > 0),
      "depth_frozen", percent(depth_repeated),
      " of the depth images are those of the frame before,",
      " while images change: give each image its own depth");
}

void InputChecks::check_depth(Findings& say) const {
  const double depth_m = quantile(&Figures::depth_m), missing = quantile(&Figures::missing);
  const double near_m = quantile(&Figures::near_m), far_m = quantile(&Figures::far_m);
  const double people_m = quantile(&Figures::people_m), step = quantile(&Figures::step);
  const bool has_people = people_m > 0 && !are_masks_odd();
  const bool is_small =
      depth_m < min_depth_m ||
      (has_people ? people_m < min_people_m && far_m < small_far_m[0]
                  : far_m < small_far_m[2] || (near_m < small_near_m && far_m < small_far_m[1]));
  const bool is_large = depth_m > max_depth_m * hopeless_factor ||
                        (has_people ? people_m > max_people_m : depth_m > max_depth_m);
  say(missing > max_missing, "depth_empty", percent(missing),
      " of each depth image is empty: ", "write 16 bits, or float in metres");
  const bool is_factor = options_.depth_setting == InputChecksOptions().depth_setting;
  const bool has_steps =
      say(step > max_step, "depth_steps", "depth comes in steps of ", percent(step),
          " of it: was it rounded, to whole metres? Write ", "millimetres, or float in metres");
  if (!has_steps && say(is_small || is_large, "depth_unit", "depth is too ",
                        is_small ? "small" : "large", ": its median is ", rounded(depth_m), " m",
                        has_people ? concatenate(", and people are ", rounded(people_m), " m wide")
                                   : std::string(),
                        "; set ", options_.depth_setting,
                        is_factor ? " to 1/1000 for millimetres, 1/5000 "
                                  : " to the units in a metre: 1000 for millimetres, 5000 ",
                        "for TUM and BONN")) {
    say.list.back().is_hopeless =
        depth_m < min_depth_m / hopeless_factor || depth_m > max_depth_m * hopeless_factor;
  }
  const double value = quantile(&Figures::one_value);
  const bool is_everywhere = quantile(&Figures::one_value, 0.4) == value;
  say(value > 0 && is_everywhere && !has_steps, "depth_one_value", "the value ", value,
      " holds over 5 % of each depth image: if it means \"no depth\", write 0 in its place");
  const DepthOffsetEstimate estimate = offset_.estimate();
  const DepthOffset late = estimate.offset.value_or(DepthOffset());
  bool has_valley = false;  // an offset at whose sides the edges' distances rise
  if (estimate.offset) {
    const auto& px = estimate.distances_px;
    const double lowest = *std::min_element(px.begin(), px.end());
    has_valley = std::min(px.front(), px.back()) - lowest >
                 min_valley * (std::max(px.front(), px.back()) - lowest);
  }
  const bool is_late =
      say(has_valley && std::abs(late.frames_late) - 2 * late.sigma_frames > max_frames_late,
          "depth_late", "depth is ", late.frames_late < 0 ? "early" : "late", " by ",
          rounded(std::abs(late.frames_late)),
          " frames, so that people leave features behind: pair the images anew: --depth-offset ",
          std::round(late.seconds * 1000) / 1000,
          ", for a SLAM program `dynfilter sync SEQUENCE --write FILE`");
  say(quantile(&Figures::nearer) > max_nearer && !are_masks_odd(), "depth_inverted", "people lie ",
      "behind what surrounds them: is it disparity? Write depth, focal length x baseline / "
      "disparity");
  const double x = quantile(&Figures::shift_x), y = quantile(&Figures::shift_y);
  const double apart = quantile(&Figures::distance);
  bool is_apart = !is_late && !are_masks_odd() && !(quantile(&Figures::age_s) > max_age_s) &&
                  apart > max_shift_px;
  for (const char* cause : {"depth_unit", "depth_one_value", "depth_frozen", "masks_frozen"}) {
    is_apart = is_apart && !say.has(cause);
  }
  const bool is_steady =
      std::hypot(x, y / 2) > steady_share * apart && quantile(&Figures::fit) > min_shifted_fit;
  say(is_apart && is_steady, "depth_shift", "people's depth lies ", std::abs(x), " px to the ",
      x < 0 ? "left" : "right", " of their masks and ", std::abs(y), " px ",
      y < 0 ? "above" : "below",
      ", at a width of 640: register depth to the images; or are the masks of other frames?");
  say(is_apart && !is_steady, "masks_elsewhere", "masks lie ", rounded(apart),
      " px beside the people ",
      "that depth shows, at a width of 640: are they mirrored, or of other frames?");
  const double sides = quantile(&Figures::left, 0) + quantile(&Figures::right, 0);
  const double ends = quantile(&Figures::top, 0) + quantile(&Figures::bottom, 0);
  say(std::max(sides, ends) > max_rim && depth_m > 0, "depth_rim", "depth never reaches the outer ",
      percent(std::max(sides, ends)), " of the image's ", sides > ends ? "width" : "height",
      ", where masks act alone: take a wider depth mode, or crop images, masks and depth");
}

void InputChecks::check_masks(Findings& say) const {
  const auto list = [](const auto& numbers) {
    std::string text;
    for (const int number : numbers) {
      if (text.size() < 24) text += (text.empty() ? "" : ", ") + std::to_string(number);
    }
    return text;
  };
  const double with_masks = share_of(&Figures::has_masks);
  say(with_masks == 0 && !options_.masks_setting.empty(), "masks_missing", "none of ",
      frames_.size(), " frames had masks, so that ",
      removes_elsewhere_ ? "only motion or static_mask removed features" : "nothing was removed",
      ": does ", options_.masks_setting, " give this recording's, for the times of its frames?");
  const double covered = quantile(&Figures::covered), border = quantile(&Figures::border);
  if (say(are_masks_odd(), "masks_everywhere", "masks cover ", percent(covered),
          " of the image and ", percent(border), " of its border: are they ",
          "inverted, or maps of classes? Pixels on people are not 0, all others are")) {
    say.list.back().is_hopeless = covered > max_missing;
  }
  const int count = static_cast<int>(mask_values_.size());
  // One value, or 1 to so many; soft masks may have each of 1 to 255.
  const bool are_labels = count < 2 || (mask_values_.back() == count && count <= max_labels);
  say(!are_labels && count > max_values, "masks_soft", "masks hold ", count, " shades of grey, ",
      "and each but 0 counts as a person: threshold them at half, and save them as PNG");
  say(!are_labels && count <= max_values, "masks_values", "masks hold the values ",
      list(mask_values_), ", and each but 0 counts as a person: if they are classes, or one means ",
      "\"ignore\", keep people alone, or write instances.csv");
  say(classes_.empty() && with_masks == 1, "masks_empty", "the masks of ", frames_.size(),
      " frames mark nobody, so that nothing is removed: is nobody there?");
  say(!classes_.empty() && !has_dynamic_, "masks_classes", "no instance is of a dynamic class (",
      list(options_.dynamic_classes), "); the masks hold ",
      classes_.size() == 1 ? "class " : "classes ", list(classes_),
      ": see --classes; ids count from 0, person is 0");
  const double age_s = quantile(&Figures::age_s), gap_px = quantile(&Figures::gap_px);
  say(age_s > no_age_s, "masks_age", "the times of masks and frames differ by more than 1 s: give ",
      "masks the time of their image, for example in the column mask_time of instances.csv");
  say(age_s > max_age_s && age_s <= no_age_s && !options_.moves_masks, "masks_age", "masks are ",
      rounded(age_s), " s old, and people have moved since: take a faster segmenter, or move late ",
      "masks (--rule depth_moved, in a host dynfilter.propagate)");
  say(gap_px > max_gap_px && !are_masks_odd(), "masks_small", "people reach ", rounded(gap_px),
      " px beyond their ",
      "masks, at a width of 640: take a larger network, a lower threshold, or a margin of so much");
}

void InputChecks::check_features(Findings& say) const {
  if (frames_.size() < min_checked_frames) return;
  double hollow = 0, on_people = 0, most_kept = 0, suggested = 0, starved = 0, judged = 0;
  MotionOutcome motion = MotionOutcome::not_run;  // of the last frame with an image
  for (const Figures& frame : frames_) {
    hollow += frame.depth_m > 0 ? frame.hollow : 0;
    on_people += frame.depth_m > 0 ? frame.on_people : 0;
    most_kept = std::max(most_kept, std::isnan(frame.kept) ? 0 : frame.kept);
    suggested = std::max(suggested, frame.suggested);
    starved += frame.kept < min_kept ? 1 : 0;
    judged += frame.motion == MotionOutcome::applied ? 1 : 0;
    if (frame.motion != MotionOutcome::no_image) motion = frame.motion;
  }
  const bool has_depth = share_of(&Figures::has_depth) == 1;
  const double without = quantile(&Figures::without_depth);
  say(without > max_without_depth && quantile(&Figures::missing) <= max_missing,
      "features_without_depth", percent(without), " of the features ",
      "have no depth: is it registered to the images, and the scene within the sensor's reach?");
  say(!are_masks_odd() && !say.has("masks_elsewhere") && without <= max_without_depth &&
          hollow > max_hollow * on_people && on_people > min_kept,
      "people_without_depth", percent(hollow / on_people), " of the features on people have no ",
      "depth, so that masks act alone there: take a depth mode that fills people, or a margin");
  say(motion != MotionOutcome::not_run && judged == 0, "motion", "motion judged nothing in ",
      frames_.size(), " frames: ", detail::name_of(motion),
      has_depth ? "" : ". It needs a depth image with each frame");
  const double wanted = static_cast<double>(options_.wanted_features);
  const double found = quantile(&Figures::features);
  if (are_masks_odd() || quantile(&Figures::grey_range, 0.9) < min_grey_range) return;
  if (say(found < min_found * wanted, "features_few", "only ", found, " of ", wanted, " features ",
          "are found in an image: it is blurred, dark, plain or small. Mend that, or lower the ",
          "extractor's threshold")) {
    return;
  }
  // More than were asked for, whatever the statistics suggest.
  const double more = 100 * std::ceil(std::max({suggested, found + 1, wanted + 1}) / 100);
  const double needed = static_cast<double>(options_.map_features);
  const double share = starved / static_cast<double>(frames_.size());
  say(share > max_starved, "features_left", percent(share), " of the frames keep fewer than ",
      min_kept, " features, because people cover them: set ", options_.features_setting, " to ",
      more);
  say(most_kept < needed && has_depth, "map_start", "the host cannot begin a map, because none of ",
      frames_.size(), " frames kept the ", needed, " features that it needs (the best kept ",
      most_kept, "): set ", options_.features_setting, " to at least ", more);
}

}  // namespace dynfilter
