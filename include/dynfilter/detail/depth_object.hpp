// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_DEPTH_OBJECT_HPP
#define DYNFILTER_DETAIL_DEPTH_OBJECT_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/mask_gap.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// Frame as rule `depth` sees it: its depth, the options in its pixels, and the age of its masks.
struct DepthRuleFrame {
  const FrameView& view;
  cv::Size size;        // of the image, pixels
  double scale;         // from pixels at a width of 640, as constants have them
  double half_width_m;  // how far objects reach before and behind their depth
  double margin_px;     // what lies this close to a fresh mask is the object's
  double moved_px;      // how far objects may have moved since the masks were made
  bool is_stale;        // whether masks are too old to be trusted

  int scaled(double length_px) const {
    return std::max(1, static_cast<int>(std::lround(length_px * scale)));
  }

  /// Returns the depth at a pixel, metres; 0 where it is unknown, and outside the image.
  double depth_at(cv::Point pixel) const { return view.depth_m(pixel).value_or(0); }
};

/// Object whose depth is known.
struct DepthObject {
  const DepthRuleFrame* frame;
  const Instance* instance;
  std::size_t k;           // index of the instance
  double margin_px;        // what lies this close to its fresh mask is its own
  double depth_m = 0;      // its median depth
  int shift_px = 0;        // how far its depth lies to the right of its mask
  cv::Rect extent = {};    // where it may be
  cv::Rect seed_box = {};  // where its surface was found; empty: on its mask

  /// Whether a depth, 0 where it is unknown, lies within the half width of the object's.
  bool is_at_depth(double metres) const {
    return metres > 0 && std::abs(metres - depth_m) <= frame->half_width_m;
  }

  /// Returns the part of the image that the mask spans.
  cv::Rect masked() const {
    return clip({instance->mask_origin, instance->mask.size()}, frame->size);
  }

  /// Whether a pixel lies this close to the mask, if that is fresh.
  bool is_beside_mask(cv::Point pixel, double distance_px) const {
    return !frame->is_stale && mask_within(*instance, pixel, distance_px);
  }

  /// Whether the mask covers what a pixel of the depth image shows.
  bool covers_depth_pixel(cv::Point pixel) const {
    return instance->covers({pixel.x - shift_px, pixel.y});
  }

  /// Returns the pixel of the depth image that shows what the colour image shows at a pixel. The
  /// shift of a stale mask is the object's motion: there, both images show the same.
  cv::Point depth_pixel_of(cv::Point pixel) const {
    return {std::clamp(pixel.x + (frame->is_stale ? 0 : shift_px), 0, frame->size.width - 1),
            pixel.y};
  }

  /// Returns by how many pixels the box must grow to hold an object that moved.
  double growth_px() const {
    constexpr double max_widths = 1.25;  // With more, small objects take features from far away.
    return std::min({frame->moved_px, max_widths * instance->box.width, 1.0 * frame->size.width});
  }

  /// Returns the box, grown. Boxes are not exact, so that it grows by a margin in any case.
  cv::Rect grown_box(double growth_px) const {
    constexpr double box_margin_px = 6;  // With more, objects take more of what they touch.
    const double margin = box_margin_px * frame->scale;
    return clip_grown(instance->box, std::lround(margin + growth_px),
                      std::lround(margin + growth_px / 2), frame->size);
  }
};

constexpr std::size_t min_object_depths = 8;  // With more, small objects are not found.
constexpr double min_share_in_box = 0.2;      // With more, slim objects are not found in their box.

/// Finds the first range of two half widths, from near to far, that has a share of the depths, and
/// centres it on its median twice. Sets the object's depth to the median, or returns false. Sorts
/// the depths.
inline bool take_nearest_cluster(DepthObject& object, std::vector<double>& depths_m,
                                 double min_share) {
  if (depths_m.size() < min_object_depths) return false;
  const double half_width_m = object.frame->half_width_m;
  const double wanted =
      std::max(min_object_depths / 2.0, min_share * static_cast<double>(depths_m.size()));
  std::sort(depths_m.begin(), depths_m.end());
  auto first = depths_m.begin(), end = first;
  for (;; ++first) {
    end = std::upper_bound(end, depths_m.end(), *first + 2 * half_width_m);
    if (static_cast<double>(end - first) >= wanted) break;
    if (end == depths_m.end()) return false;
  }
  object.depth_m = *(first + (end - first) / 2);
  for (int round = 0; round < 2; ++round) {
    first = std::lower_bound(depths_m.begin(), depths_m.end(), object.depth_m - half_width_m);
    end = std::upper_bound(first, depths_m.end(), object.depth_m + half_width_m);
    object.depth_m = *(first + (end - first) / 2);
  }
  return true;
}

/// Finds the depth of an object: the nearest cluster on its mask; if there is none, in the middle
/// of its box, which objects fill wherever their limbs are. Returns false if there is none, either.
/// `source.sample(area, mask, depths_m)` reads the known depths in an area, on the mask if there is
/// one, and returns how many it asked for. Counts the samples.
template <class Source>
bool find_depth(DepthObject& object, const Source& source, std::vector<double>& depths_m,
                std::size_t& samples) {
  samples = 0;
  const cv::Rect box = clip(object.instance->box, object.frame->size);
  if (object.instance->box.empty()) return false;
  const std::size_t asked = source.sample(object.masked(), object.instance, depths_m);
  samples = depths_m.size();
  if (take_nearest_cluster(object, depths_m, Source::min_share_on_mask)) return true;
  if (samples == 0 && asked > Source::max_without_depth) return false;
  object.seed_box = {box.x + box.width / 4, box.y + box.height / 5, box.width / 2,
                     box.height * 3 / 5};
  source.sample(object.seed_box, nullptr, depths_m);
  samples += depths_m.size();
  return take_nearest_cluster(object, depths_m, min_share_in_box);
}

/// Finds objects in a depth image.
class ObjectFinder {
 public:
  struct Memory {
    std::vector<double> depths_m;
    MaskGap::Memory gaps;
  };

  static constexpr double min_share_on_mask = 0.03;  // With more, bad masks hide their objects.
  // Depth images have holes on objects. So the box is asked however many depths the mask lacks.
  static constexpr std::size_t max_without_depth = std::numeric_limits<std::size_t>::max();

  /// Takes a frame with a depth image, and reserves what frames of this size may need.
  ObjectFinder(const DepthRuleFrame& frame, Memory& memory) : frame_(frame), memory_(memory) {
    const cv::Size samples = frame.size / spacing_ + cv::Size(1, 1);
    memory.depths_m.reserve(static_cast<std::size_t>(samples.area()));
    for (auto& side : memory.gaps) side.reserve(static_cast<std::size_t>(frame.size.height));
  }

  /// Finds the object of an instance: its depth, and where it may be. Returns nothing if its depth
  /// is not known.
  std::optional<DepthObject> find(const Instance& instance, std::size_t k,
                                  InstanceStatistics& statistics) const {
    DepthObject object{&frame_, &instance, k, frame_.margin_px};
    if (!find_depth(object, *this, memory_.depths_m, statistics.sampled)) return {};
    object.extent = object.grown_box(measure_gap(object, statistics));
    if (frame_.is_stale && !is_before_something(object)) return {};
    return object;
  }

  /// Reads depths on a coarse grid, see find_depth.
  std::size_t sample(const cv::Rect& area, const Instance* mask,
                     std::vector<double>& depths_m) const {
    std::size_t asked = 0;
    depths_m.clear();
    for (int y = area.y + spacing_ / 2; y < area.br().y; y += spacing_) {
      for (int x = area.x + spacing_ / 2; x < area.br().x; x += spacing_) {
        if (mask != nullptr && !mask->covers({x, y})) continue;
        ++asked;
        const double depth_m = frame_.depth_at({x, y});
        if (depth_m > 0) depths_m.push_back(depth_m);
      }
    }
    return asked;
  }

 private:
  static constexpr double spacing_px = 16;          // With more, samples miss small objects.
  static constexpr double max_distance_px = 24;     // With more, a desk is taken for a gap.
  static constexpr double max_gap_px = 16;          // With more, the margin takes static features.
  static constexpr double min_shift_px = 4;         // With more, slightly late depth is misread.
  static constexpr double min_share_behind = 0.05;  // With more, who fills the image is a wall.

  /// Measures the gap between mask and depth, which gives the shift of the depth, and either the
  /// margin of a fresh mask or the way that a stale one has moved. Returns the growth of the box.
  double measure_gap(DepthObject& object, InstanceStatistics& statistics) const {
    const double growth_px = object.growth_px();
    const auto gap = measure_mask_gap(
        *object.instance, object.masked(), frame_.scaled(max_distance_px / 3),
        frame_.scaled(max_distance_px) + static_cast<int>(growth_px), frame_.size.width,
        [&](cv::Point pixel) { return object.is_at_depth(frame_.depth_at(pixel)); }, memory_.gaps);
    if (!gap) return growth_px;
    const double shift = std::abs(gap->shift), max_gap = max_gap_px * frame_.scale;
    const bool is_shifted = shift >= min_shift_px * frame_.scale;
    object.shift_px = is_shifted ? static_cast<int>(std::lround(gap->shift)) : 0;
    if (frame_.is_stale) {
      return std::min(growth_px, frame_.moved_px / 2 + 2 * std::abs(object.shift_px));
    }
    object.margin_px += std::clamp(gap->width + shift / 2, 0.0, max_gap);
    statistics.mask_gap_px = std::clamp(gap->width, 0.0, max_gap);
    statistics.depth_shift_px = object.shift_px;
    statistics.mask_gap_places = gap->edges;
    return growth_px;
  }

  /// Tells whether depths in its extent lie behind an object. If not, its stale mask may be on the
  /// wall that it left, and the nearest cluster in the extent is tried.
  bool is_before_something(DepthObject& object) const {
    std::vector<double>& depths_m = memory_.depths_m;
    sample(object.extent, nullptr, depths_m);
    const auto is_before = [&] {
      const double end_m = object.depth_m + frame_.half_width_m;
      const auto behind = std::count_if(depths_m.begin(), depths_m.end(),
                                        [&](double depth_m) { return depth_m > end_m; });
      return static_cast<double>(behind) >= min_share_behind * static_cast<double>(depths_m.size());
    };
    if (is_before()) return true;
    object.seed_box = object.extent;
    return take_nearest_cluster(object, depths_m, min_share_in_box) && is_before();
  }

  const DepthRuleFrame& frame_;
  Memory& memory_;
  const int spacing_ = frame_.scaled(spacing_px);
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_OBJECT_HPP
