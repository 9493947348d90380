// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_propagator.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <iterator>
#include <limits>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "propagation/box_association.hpp"
#include "propagation/constants.hpp"
#include "propagation/point_flow.hpp"
#include "propagation/tracked_instance.hpp"

namespace dynfilter {
namespace {

constexpr const char* own_name = "MaskPropagator";
constexpr double cell_px = 16;  // side of a motion map's cell, at a width of 640 pixels

void require_between(const char* option, double value, double min_value, double max_value) {
  if (value >= min_value && value <= max_value) return;
  detail::throw_misuse(own_name, detail::concatenate(option, " = ", value),
                       detail::concatenate("a number from ", min_value, " to ", max_value));
}

MaskPropagatorOptions checked(const MaskPropagatorOptions& options) {
  require_between("max_missed", static_cast<double>(options.max_missed), 0, 1e6);
  require_between("max_age_s", options.max_age_s, 0, 1e6);
  require_between("history_frames", static_cast<double>(options.history_frames), 1, 1000);
  return options;
}

/// Tells whether an instance of the result came with this id.
bool brings_id(const Segmentation& result, int id) {
  return std::any_of(result.instances.begin(), result.instances.end(),
                     [id](const Instance& one) { return one.track_id == id; });
}

cv::Size size_of(const FrameView& frame, const std::optional<Segmentation>& newest) {
  if (!frame.image.empty()) return frame.image.size();
  if (!frame.depth.empty()) return frame.depth.size();
  return newest ? newest->image_size : cv::Size();
}

void check(const FrameView& frame, const std::optional<Segmentation>& newest) {
  validate(frame, own_name);
  const cv::Mat& image = frame.image;
  const int channels = image.channels();
  if (!image.empty() && (image.depth() != CV_8U || image.dims != 2 ||
                         (channels != 1 && channels != 3 && channels != 4))) {
    detail::throw_misuse(own_name,
                         detail::concatenate("an image of type ", detail::type_name(image)),
                         "CV_8UC1, CV_8UC3 or CV_8UC4");
  }
  if (!newest) return;
  validate(*newest, own_name);
  const cv::Size size = size_of(frame, newest);
  if (newest->image_size != size && !newest->instances.empty()) {
    detail::throw_misuse(
        own_name,
        detail::concatenate("masks of an image of ", detail::size_name(newest->image_size)),
        detail::concatenate("those of the frames, ", detail::size_name(size)));
  }
}

/// Returns the next track id: new ids go up to the largest number, then begin again.
int following(int track_id) {
  return track_id == std::numeric_limits<int>::max() ? 0 : track_id + 1;
}

/// A tracked instance and its identity.
struct Known {
  detail::TrackedInstance instance;
  int track_id = 0;
  bool came_with_id = false;
  std::size_t missed = 0;
};

/// The place of a result in the history.
struct ResultPlace {
  double timestamp_s;       // of the result
  double step_timestamp_s;  // of the history's frame that the result belongs to
  std::deque<detail::FlowStep>::const_iterator first_step;  // after that frame
  bool is_known;
};

}  // namespace

struct MaskPropagator::State {
  explicit State(const MaskPropagatorOptions& checked_options) : options(checked_options) {}

  void forget() noexcept;
  std::optional<Segmentation> propagate_or_forget(const FrameView& frame,
                                                  const std::optional<Segmentation>& newest);
  std::optional<Segmentation> propagate(const FrameView& frame,
                                        const std::optional<Segmentation>& newest);
  void move_on(const FrameView& frame);
  void drop_lost(double now_s);
  void take_if_new(const FrameView& frame, const Segmentation& result);
  ResultPlace place_of(const Segmentation& result) const;
  void take(const Segmentation& result, const ResultPlace& place);
  int fresh_track_id(const Segmentation& result, const std::vector<Known>& taken);
  std::vector<std::optional<std::size_t>> matches(const Segmentation& result,
                                                  double step_time_s) const;
  Segmentation output(const FrameView& frame);

  MaskPropagatorOptions options;
  detail::PointFlow flow;
  std::deque<detail::FlowStep> steps;  // by time; the last one leads into the newest frame
  std::vector<Known> known;
  cv::Size size;
  int next_track_id = 0;
  struct Result {
    std::uint64_t frame_id;
    double timestamp_s;       // as it was given
    double true_timestamp_s;  // of its frame
  };
  std::optional<Result> last_result;
  PropagationStatistics statistics;
};

/// Forgets everything but the track ids given so far. Allocates nothing, because it also cleans up
/// after a call that ran out of memory.
void MaskPropagator::State::forget() noexcept {
  flow.forget();
  steps.clear();
  known.clear();
  size = {};
  last_result.reset();
  statistics = {};
  statistics.restarted = true;
}

/// Moves on to the frame: computes the image's motion, and moves all known instances.
void MaskPropagator::State::move_on(const FrameView& frame) {
  detail::FlowStep step;
  step.frame_id = frame.id;
  step.timestamp_s = frame.timestamp_s;
  step.duration_s = steps.empty() ? 0 : frame.timestamp_s - steps.back().timestamp_s;
  step.motions = flow.track(frame.image);
  statistics.tracked_points = step.motions.size();
  steps.push_back(std::move(step));
  if (steps.size() > options.history_frames) steps.pop_front();
  for (Known& one : known) {
    one.instance.advance(steps.back(), options.history_frames);
    one.instance.settle();
  }
}

void MaskPropagator::State::drop_lost(double now_s) {
  const auto drop = [&](std::size_t& counter, const auto& is_lost) {
    const auto end = std::remove_if(known.begin(), known.end(), is_lost);
    counter += static_cast<std::size_t>(known.end() - end);
    known.erase(end, known.end());
  };
  drop(statistics.left_image, [](const Known& one) { return one.instance.has_left_image(); });
  drop(statistics.given_up, [&](const Known& one) {
    return one.missed > options.max_missed ||
           now_s - one.instance.timestamp_s() > options.max_age_s;
  });
}

/// Finds a result's place: by its time; by its id, if the host numbers its frames; otherwise at the
/// next frame after its time.
ResultPlace MaskPropagator::State::place_of(const Segmentation& result) const {
  const auto find = [&](const auto& is_own) {
    return std::find_if(steps.begin(), steps.end(), is_own);
  };
  const auto own = [](std::deque<detail::FlowStep>::const_iterator step) {
    return ResultPlace{step->timestamp_s, step->timestamp_s, step + 1, true};
  };
  const auto same_time =
      find([&](const detail::FlowStep& step) { return step.timestamp_s == result.timestamp_s; });
  if (same_time != steps.end()) return own(same_time);
  const bool are_numbered = steps.size() > 1 && std::is_sorted(steps.begin(), steps.end(),
                                                               [](const auto& a, const auto& b) {
                                                                 return a.frame_id <= b.frame_id;
                                                               });
  const auto same_id =
      find([&](const detail::FlowStep& step) { return step.frame_id == result.frame_id; });
  if (are_numbered && same_id != steps.end()) return own(same_id);
  const auto later =
      find([&](const detail::FlowStep& step) { return step.timestamp_s > result.timestamp_s; });
  if (later == steps.end()) return {result.timestamp_s, result.timestamp_s, later, false};
  return {result.timestamp_s, later->timestamp_s, later + 1, false};
}

/// Returns, for each instance of the result, the index of the known instance that it continues.
std::vector<std::optional<std::size_t>> MaskPropagator::State::matches(const Segmentation& result,
                                                                       double step_time_s) const {
  std::vector<detail::LabelledBox> found, known_boxes;
  for (const Instance& instance : result.instances) {
    found.push_back({cv::Rect2d(instance.box), instance.class_id, !instance.track_id});
  }
  for (const Known& one : known) {
    known_boxes.push_back(
        {one.instance.box_at(step_time_s), one.instance.class_id(), !one.came_with_id});
  }
  std::vector<std::optional<std::size_t>> match =
      detail::associate(found, known_boxes, detail::propagation::min_iou);
  for (std::size_t i = 0; i < match.size(); ++i) {
    const std::optional<int>& id = result.instances[i].track_id;
    for (std::size_t k = 0; id && k < known.size(); ++k) {
      if (known[k].came_with_id && known[k].track_id == *id) match[i] = k;
    }
  }
  return match;
}

/// Takes a result, unless it is the last one again or is unusable.
void MaskPropagator::State::take_if_new(const FrameView& frame, const Segmentation& result) {
  if (last_result && result.frame_id == last_result->frame_id &&
      result.timestamp_s == last_result->timestamp_s) {
    return;
  }
  const ResultPlace place = place_of(result);
  const double age_s = frame.timestamp_s - place.timestamp_s;
  statistics.ignored_result = age_s < 0 || age_s > options.max_age_s ||
                              (last_result && place.timestamp_s <= last_result->true_timestamp_s);
  if (statistics.ignored_result) return;
  statistics.took_result = true;
  statistics.unknown_start = !place.is_known;
  take(result, place);
  last_result = {result.frame_id, result.timestamp_s, place.timestamp_s};
}

/// Returns an id that no instance has: known, of the result, or `taken`, which have theirs already.
int MaskPropagator::State::fresh_track_id(const Segmentation& result,
                                          const std::vector<Known>& taken) {
  const auto is_used = [&](int id) {
    const auto has_id = [id](const Known& one) { return one.track_id == id; };
    return brings_id(result, id) || std::any_of(known.begin(), known.end(), has_id) ||
           std::any_of(taken.begin(), taken.end(), has_id);
  };
  while (is_used(next_track_id)) next_track_id = following(next_track_id);
  return std::exchange(next_track_id, following(next_track_id));
}

/// Replaces the known instances by the result's, moved to the newest frame.
void MaskPropagator::State::take(const Segmentation& result, const ResultPlace& place) {
  const auto match = matches(result, place.step_timestamp_s);
  std::vector<Known> next;
  std::vector<bool> is_seen(known.size(), false);
  for (std::size_t i = 0; i < result.instances.size(); ++i) {
    const Instance& instance = result.instances[i];
    const auto cell = static_cast<float>(std::max(4.0, cell_px * detail::pixel_scale(size)));
    Known one{{instance, place.timestamp_s, size, cell}};
    if (match[i]) {
      one.instance.succeed(known[*match[i]].instance);
      one.track_id = known[*match[i]].track_id;
      is_seen[*match[i]] = true;
    }
    one.came_with_id = instance.track_id.has_value();
    if (one.came_with_id) {
      one.track_id = *instance.track_id;
      next_track_id = std::max(next_track_id, following(one.track_id));
    } else if (!match[i] || brings_id(result, one.track_id)) {
      one.track_id = fresh_track_id(result, next);
    }
    std::for_each(place.first_step, steps.cend(), [&](const detail::FlowStep& step) {
      one.instance.advance(step, options.history_frames);
    });
    one.instance.settle();
    next.push_back(std::move(one));
  }
  const auto found = static_cast<std::ptrdiff_t>(next.size());
  const bool is_fresh = place.is_known && place.first_step == steps.cend();
  for (std::size_t k = 0; k < known.size(); ++k) {
    if (is_seen[k]) continue;
    if (is_fresh) {  // what is not in its own frame is not there
      ++statistics.given_up;
      continue;
    }
    ++known[k].missed;
    if (brings_id(result, known[k].track_id)) known[k].track_id = fresh_track_id(result, next);
    next.push_back(std::move(known[k]));
  }
  std::sort(next.begin() + found, next.end(),
            [](const Known& a, const Known& b) { return a.track_id < b.track_id; });
  known = std::move(next);
}

Segmentation MaskPropagator::State::output(const FrameView& frame) {
  Segmentation segmentation{frame.id, last_result->true_timestamp_s, size, {}};
  for (const Known& one : known) {
    segmentation.instances.push_back(one.instance.instance());
    segmentation.instances.back().track_id = one.track_id;
    InstancePropagation counts = one.instance.counts();
    counts.missed = one.missed;
    counts.age_s = frame.timestamp_s - one.instance.timestamp_s();
    statistics.instances.push_back(counts);
  }
  return segmentation;
}

MaskPropagator::MaskPropagator(const MaskPropagatorOptions& options)
    : state_(std::make_unique<State>(checked(options))) {}
MaskPropagator::MaskPropagator(MaskPropagator&&) noexcept = default;
MaskPropagator& MaskPropagator::operator=(MaskPropagator&&) noexcept = default;
MaskPropagator::~MaskPropagator() = default;

void MaskPropagator::reset() {
  state_->forget();
  state_->next_track_id = 0;
  state_->statistics = {};
}

const PropagationStatistics& MaskPropagator::statistics() const { return state_->statistics; }

std::optional<Segmentation> MaskPropagator::propagate(const FrameView& frame,
                                                      const std::optional<Segmentation>& newest) {
  check(frame, newest);
  return state_->propagate_or_forget(frame, newest);
}

std::optional<Segmentation> MaskPropagator::State::propagate_or_forget(
    const FrameView& frame, const std::optional<Segmentation>& newest) {
  try {
    return propagate(frame, newest);
  } catch (...) {
    forget();  // half-done work would mislead or crash the next call
    throw;
  }
}

std::optional<Segmentation> MaskPropagator::State::propagate(
    const FrameView& frame, const std::optional<Segmentation>& newest) {
  statistics = {};
  const cv::Size frame_size = size_of(frame, newest);
  const bool is_known_size = frame_size.empty() || size.empty() || frame_size == size;
  const bool is_later = steps.empty() || frame.timestamp_s > steps.back().timestamp_s;
  if (!is_known_size || !is_later) forget();
  if (!frame_size.empty()) size = frame_size;

  move_on(frame);
  if (newest) take_if_new(frame, *newest);
  drop_lost(frame.timestamp_s);
  std::vector<cv::Rect> regions;
  for (const Known& one : known) regions.push_back(one.instance.region());
  flow.choose_points(regions);
  const bool is_known =
      last_result && frame.timestamp_s - last_result->true_timestamp_s <= options.max_age_s;
  if (!is_known) return {};
  return output(frame);
}

}  // namespace dynfilter
