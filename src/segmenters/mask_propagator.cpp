// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_propagator.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "dynfilter/detail/best_pairs.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "propagation/point_flow.hpp"
#include "propagation/tracked_instance.hpp"

namespace dynfilter {
namespace {

constexpr const char* own_name = "MaskPropagator";
constexpr int max_missed = 3;     // late results in a row that may miss an instance
constexpr double min_iou = 0.25;  // of the boxes of a new and a known instance that are the same

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

/// A tracked instance and its identity.
struct Known {
  detail::TrackedInstance instance;
  int track_id = 0;
  bool came_with_id = false;
  int missed = 0;
};

using Steps = std::deque<detail::FlowStep>;

/// The place of a result in the history.
struct ResultPlace {
  double timestamp_s;          // of the image that was segmented
  Steps::const_iterator step;  // into that image, or else into the next one; none in the future

  bool is_known() const { return step->timestamp_s == timestamp_s; }
};

}  // namespace

struct MaskPropagator::State {
  /// Forgets everything but the track ids given so far. Allocates nothing, because it also cleans
  /// up after a call that ran out of memory.
  void forget() noexcept {
    flow.forget();
    steps.clear();
    known.clear();
    size = {};
    last_result.reset();
  }

  std::optional<Segmentation> propagate(const FrameView& frame,
                                        const std::optional<Segmentation>& newest) {
    const cv::Size frame_size = size_of(frame, newest);
    const bool is_known_size = frame_size.empty() || size.empty() || frame_size == size;
    const bool is_later = steps.empty() || frame.timestamp_s > steps.back().timestamp_s;
    if (!is_known_size || !is_later) forget();
    if (!frame_size.empty()) size = frame_size;

    move_on(frame);
    if (newest) take_if_new(frame, *newest);
    const auto is_lost = [&](const Known& one) {
      return one.instance.has_left_image() ||
             frame.timestamp_s - one.instance.timestamp_s() > options.max_age_s;
    };
    known.erase(std::remove_if(known.begin(), known.end(), is_lost), known.end());
    std::vector<cv::Rect> regions;
    for (const Known& one : known) regions.push_back(one.instance.region());
    flow.choose_points(regions);
    if (!last_result || frame.timestamp_s - last_result->true_timestamp_s > options.max_age_s) {
      return {};
    }
    Segmentation masks{frame.id, last_result->true_timestamp_s, size, {}};
    for (const Known& one : known) {
      masks.instances.push_back(one.instance.instance());
      masks.instances.back().track_id = one.track_id;
    }
    return masks;
  }

  /// Moves on to the frame: computes the image's motion, and moves all known instances.
  void move_on(const FrameView& frame) {
    detail::FlowStep step;
    step.frame_id = frame.id;
    step.timestamp_s = frame.timestamp_s;
    step.duration_s = steps.empty() ? 0 : frame.timestamp_s - steps.back().timestamp_s;
    step.motions = flow.track(frame.image);
    steps.push_back(std::move(step));
    if (steps.size() > detail::history_frames) steps.pop_front();
    for (Known& one : known) {
      one.instance.advance(steps.back());
      one.instance.settle();
    }
  }

  /// Takes a result, unless it is the last one again, too old, or of the future.
  void take_if_new(const FrameView& frame, const Segmentation& result) {
    if (last_result && result.timestamp_s && result.frame_id == last_result->frame_id &&
        result.timestamp_s == last_result->timestamp_s) {
      return;
    }
    const ResultPlace place = place_of(result);
    const double age_s = frame.timestamp_s - place.timestamp_s;
    if (age_s < 0 || age_s > options.max_age_s) return;
    if (last_result && place.timestamp_s <= last_result->true_timestamp_s) return;
    take(result, place);
    last_result = {result.frame_id, result.timestamp_s, place.timestamp_s};
  }

  /// Finds a result's place: by its time; by its id, if the host numbers its frames; otherwise at
  /// the next frame after its time. One without a time is that of the newest frame, if that has its
  /// id; where no id tells its frame, it has no place.
  ResultPlace place_of(const Segmentation& result) const {
    const auto newest = std::prev(steps.end());
    if (!result.timestamp_s && result.frame_id == newest->frame_id) {
      return {newest->timestamp_s, newest};
    }
    const double time_s = result.timestamp_s.value_or(-std::numeric_limits<double>::infinity());
    const auto find = [&](const auto& is_own) {
      return std::find_if(steps.begin(), steps.end(), is_own);
    };
    const auto not_before = find([&](const auto& s) { return s.timestamp_s >= time_s; });
    ResultPlace by_time{time_s, not_before};
    if (not_before != steps.end() && by_time.is_known()) return by_time;
    const auto has_id = [&](const auto& step) { return step.frame_id == result.frame_id; };
    if (steps.size() > 1 && std::count_if(steps.begin(), steps.end(), has_id) == 1) {
      const auto step = find(has_id);
      return {step->timestamp_s, step};
    }
    return by_time;
  }

  /// Replaces the known instances by the result's, moved to the newest frame.
  void take(const Segmentation& result, const ResultPlace& place) {
    std::set<int> brought, used;  // ids of the result; ids that a new instance must not get
    for (const Instance& instance : result.instances) {
      if (instance.track_id) brought.insert(*instance.track_id);
    }
    used = brought;
    for (const Known& one : known) used.insert(one.track_id);
    const auto following = [](int id) {
      return id == std::numeric_limits<int>::max() ? 0 : id + 1;
    };
    for (const int id : brought) next_track_id = std::max(next_track_id, following(id));
    const auto give_id = [&] {
      while (!used.insert(next_track_id).second) next_track_id = following(next_track_id);
      return std::exchange(next_track_id, following(next_track_id));
    };

    const Steps::const_iterator first_step = std::next(place.step);
    const std::vector<Known*> match = matches(result, place.step->timestamp_s);
    std::vector<Known> next;
    for (std::size_t i = 0; i < result.instances.size(); ++i) {
      const Instance& instance = result.instances[i];
      Known one{{instance, place.timestamp_s, size}};
      if (match[i] != nullptr) one.instance.succeed(match[i]->instance);
      one.came_with_id = instance.track_id.has_value();
      const bool keeps_id = match[i] != nullptr && brought.count(match[i]->track_id) == 0;
      one.track_id = one.came_with_id ? *instance.track_id
                     : keeps_id       ? match[i]->track_id
                                      : give_id();
      std::for_each(first_step, steps.cend(),
                    [&](const detail::FlowStep& step) { one.instance.advance(step); });
      one.instance.settle();
      next.push_back(std::move(one));
    }
    const auto found = static_cast<std::ptrdiff_t>(next.size());
    // What a result of the newest frame itself misses is not there.
    const bool is_late = !place.is_known() || first_step != steps.cend();
    for (Known& one : known) {
      const bool is_found = std::find(match.begin(), match.end(), &one) != match.end();
      if (is_found || !is_late || ++one.missed > max_missed) continue;
      if (brought.count(one.track_id) > 0) one.track_id = give_id();
      next.push_back(std::move(one));
    }
    std::sort(next.begin() + found, next.end(),
              [](const Known& a, const Known& b) { return a.track_id < b.track_id; });
    known = std::move(next);
  }

  /// Returns, for each instance of the result, the known instance that it continues, or null: the
  /// one with its track_id or else, of those of its class without one, that with the largest
  /// overlap of boxes. Of equal overlaps, the lower index wins, the result's first.
  std::vector<Known*> matches(const Segmentation& result, double step_time_s) {
    const auto likeness = [&](std::size_t i, std::size_t k) {
      const Instance& instance = result.instances[i];
      constexpr double before_any_overlap = 2;
      if (instance.track_id || known[k].came_with_id) {
        const bool is_it = known[k].came_with_id && instance.track_id == known[k].track_id;
        return is_it ? before_any_overlap : 0;
      }
      if (instance.class_id != known[k].instance.class_id()) return 0.0;
      const double iou = detail::intersection_over_union(detail::place_of(instance),
                                                         known[k].instance.box_at(step_time_s));
      return iou >= min_iou ? iou : 0;
    };
    std::vector<Known*> match;
    detail::BestPairs pairs;
    for (const auto& k : pairs.find(result.instances.size(), known.size(), likeness)) {
      match.push_back(k ? &known[*k] : nullptr);
    }
    return match;
  }

  MaskPropagatorOptions options;
  detail::PointFlow flow = {};
  Steps steps = {};  // by time; the last one leads into the newest frame
  std::vector<Known> known = {};
  cv::Size size = {};
  int next_track_id = 0;
  struct Result {
    std::uint64_t frame_id;
    std::optional<double> timestamp_s;  // as it was given
    double true_timestamp_s;            // of its frame
  };
  std::optional<Result> last_result = {};
};

MaskPropagator::MaskPropagator(const MaskPropagatorOptions& options)
    : state_(std::make_unique<State>(State{options})) {
  constexpr detail::OptionCheck require(own_name);
  require(options.max_age_s >= 0 && options.max_age_s <= 1e6, "max_age_s", options.max_age_s,
          "0 to 1000000 seconds");
}
MaskPropagator::MaskPropagator(MaskPropagator&&) noexcept = default;
MaskPropagator& MaskPropagator::operator=(MaskPropagator&&) noexcept = default;
MaskPropagator::~MaskPropagator() = default;

void MaskPropagator::reset() {
  state_->forget();
  state_->next_track_id = 0;
}

std::optional<Segmentation> MaskPropagator::propagate(const FrameView& frame,
                                                      const std::optional<Segmentation>& newest) {
  check(frame, newest);
  try {
    return state_->propagate(frame, newest);
  } catch (...) {
    state_->forget();  // half-done work would mislead or crash the next call
    throw;
  }
}

}  // namespace dynfilter
