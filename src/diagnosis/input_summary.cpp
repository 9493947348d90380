// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "diagnosis/input_summary.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/feature_floor.hpp"

namespace dynfilter::detail {
namespace {

// Places at which each frame is looked at; more would take longer and find little more.
constexpr int grid_columns = 64, grid_rows = 48, grid_places = grid_columns * grid_rows;

cv::Point grid_pixel(int k, const cv::Size& size) {
  return {(2 * (k % grid_columns) + 1) * size.width / (2 * grid_columns),
          (2 * (k / grid_columns) + 1) * size.height / (2 * grid_rows)};
}

/// Returns the commonest of the sorted depths if it is alone, and so may mean "no depth"; else 0. A
/// surface has depths near its commonest one. What means "no depth" is beyond all others, or there
/// is no depth of 0. A scene drawn with a few values proves nothing.
double lone_depth_m(const std::vector<double>& depths, std::size_t values, double missing) {
  constexpr double min_share = 0.05;  // of the places; a larger one overlooks small holes
  double commonest = 0;
  std::ptrdiff_t most = 0;
  for (auto first = depths.begin(), last = first; first != depths.end(); first = last) {
    last = std::upper_bound(first, depths.end(), *first);
    if (last - first > most) commonest = *first;
    most = std::max(most, last - first);
  }
  const auto around = std::upper_bound(depths.begin(), depths.end(), commonest * 1.03) -
                      std::lower_bound(depths.begin(), depths.end(), commonest * 0.97);
  const bool is_alone =
      around < most + most / 2 && static_cast<double>(most) > min_share * grid_places;
  const bool is_odd = commonest == depths.back() || missing < 0.02;
  return is_alone && is_odd && (values == 1 || values > 16) ? commonest : 0;
}

/// How a person's mask, and depth that is shifted, agree.
struct Agreement {
  double known = 0, alike = 0, apart = 0,
         in_front = 0;  // places; apart: of neither, in front of it

  double fit() const { return alike / std::max(1.0, known); }
};

Agreement agreement_of(const FrameView& frame, const Instance& person, double person_m,
                       const cv::Rect& around, int step_px, cv::Point shift) {
  const double half_m = std::max(0.25, 0.12 * person_m);  // of what belongs to the person
  Agreement sum;
  for (int y = around.y; y < around.br().y; y += 2 * step_px) {
    for (int x = around.x; x < around.br().x; x += 2 * step_px) {
      const auto there_m = frame.depth_m(cv::Point(x, y) + shift);
      if (!there_m) continue;
      const bool is_near = std::abs(*there_m - person_m) < half_m, is_on = person.covers({x, y});
      ++sum.known;
      sum.alike += is_near == is_on ? 1 : 0;
      sum.apart += is_near || is_on ? 0 : 1;
      sum.in_front += !is_near && !is_on && *there_m < person_m ? 1 : 0;
    }
  }
  return sum;
}

}  // namespace

void InputSummary::add(const FrameView& frame, SegmentationView masks, FeaturesView seen,
                       const FrameStatistics* statistics, double depth_timestamp_s) {
  if (last_s_) period_s.add(frame.timestamp_s - *last_s_);
  last_s_ = frame.timestamp_s;
  are_times_whole = are_times_whole && std::floor(*last_s_) == *last_s_;
  with_image += frame.image.empty() ? 0 : 1;
  with_masks += masks.has_value() ? 1 : 0;
  with_depth += !frame.depth.empty() || seen.has_depths() ? 1 : 0;
  const bool has_instances = masks.has_value() && !(*masks).instances.empty();
  for (const cv::Size& one :
       {frame.image.size(), frame.depth.size(), has_instances ? (*masks).image_size : cv::Size()}) {
    if (size.empty()) size = one;
    if (!one.empty() && one != size) other_size = size_name(one);
  }
  if (other_size.empty()) {
    if (!frame.image.empty() && frame.image.depth() == CV_8U) add_image(frame);
    if (!frame.depth.empty()) add_depth(frame);
    if (masks.has_value()) add_masks(frame, *masks);
  }
  places.add_features(seen, size);
  if (masks.has_value()) places.add_boxes(*masks, size);
  add_features(frame, masks, seen, statistics);
  ++frames;
  constexpr std::size_t max_compared = 300;  // frames, of 3 ms each
  const bool has_both = DepthOffsetEstimator::takes(frame.image) && !frame.depth.empty();
  if (other_size.empty() && has_both && frames <= max_compared) {
    offset.add(frame, depth_timestamp_s);
  }
}

void InputSummary::add_image(const FrameView& frame) {
  const cv::Mat& image = frame.image;
  std::vector<double> greys;
  for (int k = 0; k < grid_places; ++k) {
    const cv::Point pixel = grid_pixel(k, image.size());
    const std::uint8_t* bytes = image.ptr<std::uint8_t>(pixel.y) + image.channels() * pixel.x;
    greys.push_back(image.channels() < 3 ? bytes[0] : (bytes[0] + bytes[1] + bytes[2]) / 3);
  }
  repeated_images += greys == last_greys_ ? 1 : 0;
  last_greys_ = greys;
  const double bright = quantile_of(greys, 0.99);
  brightest.add(bright);
  grey_range.add(bright - quantile_of(greys, 0.01));
}

void InputSummary::add_depth(const FrameView& frame) {
  std::vector<double> now, depths;
  cv::Rect2d seen;
  for (int k = 0; k < grid_places; ++k) {
    now.push_back(frame.depth_m(grid_pixel(k, frame.depth.size())).value_or(0));
    if (now.back() == 0) continue;
    depths.push_back(now.back());
    seen |= cv::Rect2d(k % grid_columns / double{grid_columns},
                       k / grid_columns / double{grid_rows}, 1.0 / grid_columns, 1.0 / grid_rows);
  }
  const double absent = 1 - static_cast<double>(depths.size()) / grid_places;
  missing.add(absent);
  if (depths.size() < 50) return;
  with_depth_at |= seen;
  repeated_depths += now == last_depths_ ? 1 : 0;
  last_depths_ = now;
  const double middle = quantile_of(depths);
  depth_m.add(middle);
  near_m.add(quantile_of(depths, 0.05));
  far_m.add(quantile_of(depths, 0.95));
  std::sort(depths.begin(), depths.end());
  std::vector<double> steps;
  for (std::size_t i = 1; i < depths.size(); ++i) {
    if (depths[i] != depths[i - 1]) steps.push_back(depths[i] - depths[i - 1]);
  }
  one_value.add(lone_depth_m(depths, steps.size() + 1, absent) / frame.depth_scale());
  if (steps.size() > 1) step.add(quantile_of(steps) / middle);
}

bool InputSummary::is_dynamic(const Instance& instance) const {
  const std::vector<int>& dynamic = options.dynamic_classes;
  return std::find(dynamic.begin(), dynamic.end(), instance.class_id) != dynamic.end();
}

bool InputSummary::is_on_people(const Segmentation& masks, cv::Point pixel) const {
  return std::any_of(masks.instances.begin(), masks.instances.end(), [&](const Instance& one) {
    return is_dynamic(one) && (one.mask.empty() ? one.box_contains(pixel) : one.covers(pixel));
  });
}

void InputSummary::add_masks(const FrameView& frame, const Segmentation& masks) {
  double on_masks = 0, at_border = 0;
  std::vector<double> now;
  for (int k = 0; k < grid_places; ++k) {
    now.push_back(is_on_people(masks, grid_pixel(k, size)) ? 1 : 0);
    on_masks += now.back();
    const int column = k % grid_columns, row = k / grid_columns;
    const bool is_inside =
        column > 0 && row > 0 && column < grid_columns - 1 && row < grid_rows - 1;
    at_border += is_inside ? 0 : now.back();
  }
  const bool is_fresh = masks.timestamp_s == frame.timestamp_s;
  repeated_masks += on_masks > 0 && now == last_covered_ && is_fresh ? 1 : 0;
  last_covered_ = now;
  covered.add(on_masks / grid_places);
  border.add(at_border / (2 * grid_columns + 2 * grid_rows - 4));
  const Instance* largest = nullptr;
  for (const Instance& one : masks.instances) {
    classes.insert(one.class_id);
    has_dynamic = has_dynamic || is_dynamic(one);
    has_outline = has_outline || !one.mask.empty();
    const bool is_larger = largest == nullptr || one.mask.total() > largest->mask.total();
    if (is_dynamic(one) && is_larger) largest = &one;
  }
  const std::optional<double> age = masks.age_s(frame.timestamp_s);
  if (age && !masks.instances.empty()) age_s.add(std::abs(*age));
  if (largest != nullptr) add_person(frame, *largest);
}

/// Measures how large the person is, and how far its depth is shifted against its mask: where depth
/// and mask agree best, first across, then down.
void InputSummary::add_person(const FrameView& frame, const Instance& person) {
  std::vector<double> depths;
  double count = 0;
  cv::Rect box;
  for (int k = 0; k < grid_places; ++k) {
    const cv::Point pixel = grid_pixel(k, size);
    if (!person.covers(pixel)) continue;
    ++count;
    box |= cv::Rect(pixel, cv::Size(1, 1));
    if (const auto one_m = frame.depth_m(pixel)) depths.push_back(*one_m);
  }
  if (count < 0.02 * grid_places) return;
  filled.add(cv::countNonZero(person.mask) / static_cast<double>(person.mask.total()));
  if (depths.size() < 20) return;
  const double person_m = quantile_of(depths);
  const double focal_px = camera.fx > 0 ? camera.fx : 0.85 * size.width;  // as most RGB-D cameras
  const double side_px = std::sqrt(count / grid_places * size.area());
  if (person.class_id == 0) people_m.add(side_px * person_m / focal_px);
  constexpr int reach = 10;  // steps that are tried; a larger one takes other things for the person
  const int step_px = std::max(1, size.width / 160), margin = reach * step_px;
  const cv::Rect around(box.tl() - cv::Point(margin, margin), box.br() + cv::Point(margin, margin));
  const auto compare = [&](cv::Point shift) {
    return agreement_of(frame, person, person_m, around, step_px, shift);
  };
  Agreement best = compare({0, 0});
  cv::Point best_shift(0, 0);
  // A lower fit takes other things for what surrounds the person.
  if (best.apart > 20 && best.fit() > 0.6) nearer.add(best.in_front / best.apart);
  const auto look = [&](cv::Point shift) {
    const Agreement now = compare(step_px * shift);
    if (now.fit() <= best.fit()) return;
    best = now, best_shift = shift;
  };
  for (int dx = -reach; dx <= reach; ++dx) look({dx, 0});
  const int across = best_shift.x;
  for (int dy = -reach; dy <= reach; ++dy) look({across, dy});
  const double unit = 640.0 / size.width * step_px;
  fit.add(best.fit());
  shift_x.add(unit * best_shift.x);
  shift_y.add(unit * best_shift.y);
  distance.add(unit * std::hypot(best_shift.x, best_shift.y / 2.0));
}

void InputSummary::add_features(const FrameView& frame, SegmentationView masks, FeaturesView seen,
                                const FrameStatistics* statistics) {
  double on_masks = 0, on_hollow = 0, none = 0;
  const bool are_given = other_size.empty() && (!seen.empty() || options.wanted_features > 0);
  for (std::size_t i = 0; are_given && i < seen.size(); ++i) {
    const cv::Point pixel = seen.pixel(i);
    const bool has_depth =
        seen.has_depths() ? seen.depth_m(i).has_value() : frame.depth_m(pixel).has_value();
    const bool is_person = masks.has_value() && is_on_people(*masks, pixel);
    none += has_depth ? 0 : 1;
    on_masks += is_person ? 1 : 0;
    on_hollow += is_person && !has_depth ? 1 : 0;
  }
  const auto count = static_cast<double>(seen.size());
  if (are_given) features.add(count);
  if (are_given && !frame.depth.empty()) without_depth.add(none / std::max(1.0, count));
  if (!frame.depth.empty()) on_people += on_masks, hollow += on_hollow;
  double kept = count - on_masks;
  if (statistics != nullptr) {
    kept = static_cast<double>(statistics->kept());
    const std::size_t floor = std::max(min_kept, options.map_features);
    suggested = std::max(suggested, static_cast<double>(suggested_features(*statistics, floor)));
    judged += statistics->motion.outcome == MotionOutcome::applied ? 1 : 0;
    if (statistics->motion.outcome != MotionOutcome::no_image) motion = statistics->motion.outcome;
    removes_elsewhere = removes_elsewhere || (!masks.has_value() && statistics->removed() > 0);
    for (const InstanceStatistics& instance : statistics->instances) {
      if (instance.mask_gap_places == 0) continue;
      gap_px.add(640 * instance.mask_gap_px / std::max(1, size.width));
    }
  }
  if (!are_given && statistics == nullptr) return;
  most_kept = std::max(most_kept, kept);
  starved += kept < static_cast<double>(min_kept) ? 1 : 0;
}

}  // namespace dynfilter::detail

namespace dynfilter {

InputChecks::InputChecks(InputChecksOptions options)
    : summary_(std::make_unique<detail::InputSummary>(std::move(options))) {}
InputChecks::InputChecks(InputChecks&&) noexcept = default;
InputChecks::~InputChecks() = default;

void InputChecks::note_camera(const Camera& camera) { summary_->camera = camera; }

void InputChecks::note_mask_values(const std::vector<int>& values) {
  summary_->mask_values = values;
}

void InputChecks::add(const FrameView& frame, SegmentationView masks, FeaturesView features,
                      const FrameStatistics* statistics, std::optional<double> depth_timestamp_s) {
  validate(frame, "InputChecks");
  if (masks.has_value()) validate(*masks, "InputChecks");
  summary_->add(frame, masks, features, statistics, depth_timestamp_s.value_or(frame.timestamp_s));
}

std::string InputChecks::unchecked() const {
  std::string names;
  const auto add = [&](std::size_t frames, const char* name) {
    if (frames >= detail::min_checked_frames) return;
    names += (names.empty() ? "" : " or ") + std::string(name);
  };
  add(summary_->with_image, "images");
  if (!summary_->options.depth_setting.empty()) add(summary_->with_depth, "depth");
  add(summary_->with_masks, "masks");
  return names;
}

std::size_t InputChecks::frames() const { return summary_->frames; }

}  // namespace dynfilter
