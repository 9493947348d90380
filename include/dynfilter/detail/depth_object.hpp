// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter::detail {

/// Frame as rule `depth` sees it: where its depths are, the options in its pixels, and whether its
/// masks are stale.
struct DepthRuleFrame {
  static constexpr double mask_margin_px = 1;     // With more, masks take what is beside them.
  static constexpr double motion_px_per_s = 400;  // With more, extents of old masks are too large.

  const FrameView& view;
  const FeaturesView& features;  // know depths if there is no depth image
  const FrameFeatures& index;
  cv::Size size;        // of the image, pixels
  double scale;         // from pixels at a width of 640, as constants have them
  double half_width_m;  // how far objects reach before and behind their depth
  double margin_px;     // by which fresh masks grow in any case
  double moved_px;      // how far objects may have moved since the masks were made
  bool has_image, is_stale;

  int scaled(double length_px) const {
    return std::max(1, static_cast<int>(std::lround(length_px * scale)));
  }

  /// Returns what the depth image shows at a pixel, metres; 0 where it is unknown, and outside.
  double depth_at(cv::Point pixel) const { return view.depth_m(pixel).value_or(0); }
};

/// Object whose depth is known.
struct DepthObject {
  const DepthRuleFrame* frame;
  const Instance* instance;
  std::size_t k;               // index of the instance
  double margin_px;            // the frame's, and the gap between mask and depth
  double depth_m = 0;          // its median depth
  int shift_px = 0;            // how far its depth lies to the right of its mask
  cv::Rect extent = {};        // where it may be
  cv::Rect seed_box = {};      // where its depth was found; empty: on its mask
  bool follows_edges = false;  // whether its fresh mask ends where its depth does

  /// Whether a depth, 0 where it is unknown, lies within the half width of the object's.
  bool is_at_depth(double metres) const {
    return metres > 0 && std::abs(metres - depth_m) <= frame->half_width_m;
  }

  /// Whether a pixel of this depth, 0 where it is unknown, is surely the object's: near its depth
  /// or its fresh mask.
  bool is_sure(cv::Point pixel, double metres) const {
    constexpr double sure_m = 0.1, sure_px = 4;  // With more, caution keeps less.
    return (metres > 0 && std::abs(metres - depth_m) <= sure_m) ||
           is_beside_mask(pixel, sure_px * frame->scale);
  }

  /// Returns the part of the image that the mask spans.
  cv::Rect masked() const {
    return clip({instance->mask_origin, instance->mask.size()}, frame->size);
  }

  /// Whether a pixel lies this close to the mask, if that is fresh.
  bool is_beside_mask(cv::Point pixel, double distance_px) const {
    return !frame->is_stale && mask_within(*instance, pixel, distance_px);
  }

  /// Whether the mask, shifted to the object's depth, covers a pixel of the depth image.
  bool covers_depth_pixel(cv::Point pixel) const {
    return instance->covers({pixel.x - shift_px, pixel.y});
  }

  /// Returns the pixel of the depth image that shows what the colour image shows at a pixel. Beside
  /// a fresh mask, depth is late by the shift. A stale mask itself is late, and depth is not.
  cv::Point depth_pixel_of(cv::Point pixel) const {
    return {std::clamp(pixel.x + (frame->is_stale ? 0 : shift_px), 0, frame->size.width - 1),
            pixel.y};
  }

  /// Returns the depth of a feature if it belongs to the object, metres; 0 if it is unknown.
  double depth_of(std::size_t feature) const {
    return frame->has_image ? frame->depth_at(depth_pixel_of(frame->index.pixel(feature)))
                            : frame->features.depth_m(feature).value_or(0);
  }
};

/// Finds the objects of a frame: their depths, the gaps between mask and depth, and the extents.
class ObjectFinder {
 public:
  struct Memory {
    std::vector<double> depths_m;
    std::array<std::vector<int>, 2> gaps;  // of the left and right ends of rows
  };

  /// Takes a frame, and reserves what frames of this size may need.
  ObjectFinder(const DepthRuleFrame& frame, Memory& memory)
      : frame_(frame), depths_m_(memory.depths_m), gaps_(memory.gaps) {
    const cv::Size samples = frame.size / spacing_ + cv::Size(1, 1);
    depths_m_.reserve(frame.features.size() + static_cast<std::size_t>(samples.area()));
    for (auto& side : gaps_) side.reserve(static_cast<std::size_t>(frame.size.height));
  }

  /// Finds the dynamic objects whose depths are known. The statistics say what became of each.
  void find_all(const Segmentation& masks, FeatureLabels& labels,
                std::vector<DepthObject>& objects) {
    const bool has_image = frame_.has_image, has_depths = frame_.features.has_depths();
    const auto found = has_image ? Compensation::applied : Compensation::applied_without_image;
    const auto lost =
        has_image || has_depths ? Compensation::too_few_samples : Compensation::no_depth_image;
    objects.clear();
    objects.reserve(masks.instances.size());
    for (std::size_t k = 0; k < masks.instances.size(); ++k) {
      if (!labels.is_dynamic_object(k)) continue;
      InstanceStatistics& statistics = labels.statistics().instances[k];
      DepthObject object{&frame_, &masks.instances[k], k, frame_.margin_px};
      statistics.compensation = lost;
      if (!find_depth(object, statistics.sampled) || !find_extent(object, statistics)) continue;
      const double half_width_m = frame_.half_width_m;
      statistics.compensation = found;
      statistics.depth_range_m = {object.depth_m - half_width_m, object.depth_m + half_width_m};
      objects.push_back(object);
    }
  }

 private:
  static constexpr double spacing_px = 16;           // With more, samples miss small objects.
  static constexpr std::size_t min_depths = 8;       // With more, tiny objects are not found.
  static constexpr double min_share_on_mask = 0.03;  // With more, bad masks hide their objects.
  static constexpr double min_share_in_box = 0.2;    // With more, slim objects are not found there.
  static constexpr double box_margin_px = 6;         // With more, objects take what they touch.
  static constexpr double max_box_widths = 1.25;     // With more growth, far features join.
  static constexpr double max_followed_px = 24;      // With more, a desk is taken for the object.
  static constexpr std::size_t min_rows = 4;         // With more, small objects have no gap.
  static constexpr double max_gap_px = 16;           // With more, margins take static features.
  static constexpr double max_good_gap_px = 3;       // With more, poor masks keep what they miss.
  static constexpr double max_followed_m = 0.03;     // With more, a thing behind gives the gap.
  static constexpr double min_shift_px = 4;          // With more, slightly late depth is misread.
  static constexpr double min_share_behind = 0.05;   // With more, who fills the image is a wall.

  /// Finds the nearest cluster of depths on an object's mask, or else in the middle of its box,
  /// which any pose fills. Returns false if there is none. Counts the samples.
  bool find_depth(DepthObject& object, std::size_t& samples) {
    samples = 0;
    if (object.instance->box.empty()) return false;
    const bool has_image = frame_.has_image;
    const std::size_t asked = sample(object.masked(), object.instance);
    samples = depths_m_.size();
    if (take_nearest_cluster(object, has_image ? min_share_on_mask : min_share_in_box)) return true;
    // Without a depth image, many features on the mask of which none has a depth say that those in
    // the box show what is behind it. A depth image may have holes on objects.
    if (!has_image && samples == 0 && asked >= 3 * min_depths) return false;
    const cv::Rect box = clip(object.instance->box, frame_.size);
    object.seed_box = {box.x + box.width / 4, box.y + box.height / 5, box.width / 2,
                       box.height * 3 / 5};
    sample(object.seed_box, nullptr);
    samples += depths_m_.size();
    return take_nearest_cluster(object, min_share_in_box);
  }

  /// Reads the known depths in an area, on a mask if one is given: every 16 px in the depth image,
  /// or of the features. Returns how many were asked for.
  std::size_t sample(const cv::Rect& area, const Instance* mask) {
    std::size_t asked = 0;
    depths_m_.clear();
    const auto read = [&](cv::Point pixel, double depth_m) {
      if (mask != nullptr && !mask->covers(pixel)) return;
      ++asked;
      if (depth_m > 0) depths_m_.push_back(depth_m);
    };
    if (!frame_.has_image) {
      for (const std::size_t i : frame_.index.inside(area)) {
        read(frame_.index.pixel(i), frame_.features.depth_m(i).value_or(0));
      }
      return asked;
    }
    for (int y = area.y + spacing_ / 2; y < area.br().y; y += spacing_) {
      for (int x = area.x + spacing_ / 2; x < area.br().x; x += spacing_) {
        read({x, y}, frame_.depth_at({x, y}));
      }
    }
    return asked;
  }

  /// Finds the first range of two half widths, from near to far, that has a share of the depths,
  /// and centres it on its median twice: the object's depth. Returns false if there is none.
  bool take_nearest_cluster(DepthObject& object, double min_share) {
    if (depths_m_.size() < min_depths) return false;
    const double wanted =
        std::max(min_depths / 2.0, min_share * static_cast<double>(depths_m_.size()));
    std::sort(depths_m_.begin(), depths_m_.end());
    auto first = depths_m_.begin(), end = first;
    for (;; ++first) {
      end = std::upper_bound(end, depths_m_.end(), *first + 2 * frame_.half_width_m);
      if (static_cast<double>(end - first) >= wanted) break;
      if (end == depths_m_.end()) return false;
    }
    object.depth_m = *(first + (end - first) / 2);
    for (int round = 0; round < 2; ++round) {
      first = std::lower_bound(depths_m_.begin(), depths_m_.end(),
                               object.depth_m - frame_.half_width_m);
      end = std::upper_bound(first, depths_m_.end(), object.depth_m + frame_.half_width_m);
      object.depth_m = *(first + (end - first) / 2);
    }
    return true;
  }

  /// Finds where an object may be: in its box, grown by a margin, because boxes are not exact, and
  /// by how far it may have moved. Returns false if it has left its stale mask for out of reach.
  bool find_extent(DepthObject& object, InstanceStatistics& statistics) {
    const cv::Rect& box = object.instance->box;
    double growth_px = std::min(
        {frame_.moved_px, max_box_widths * box.width, static_cast<double>(frame_.size.width)});
    const bool is_measured = frame_.has_image && measure_gap(object, growth_px, statistics);
    if (is_measured && frame_.is_stale) {
      growth_px = std::min(growth_px, frame_.moved_px / 2 + 2 * std::abs(object.shift_px));
    }
    object.follows_edges = !frame_.is_stale && object.seed_box.empty() &&
                           statistics.mask_gap_px <= max_good_gap_px * frame_.scale;
    const double margin_px = box_margin_px * frame_.scale;
    object.extent = clip_grown(box, std::lround(margin_px + growth_px),
                               std::lround(margin_px + growth_px / 2), frame_.size);
    return !frame_.has_image || !frame_.is_stale || is_before_something(object);
  }

  /// Measures in some rows how far the object's depth goes on beyond the left and the right end of
  /// its mask. The mean of both medians is the gap, by which the margin grows; half their
  /// difference is the shift of depth, or of a stale mask. Returns false if the end of the depth is
  /// found in too few rows.
  bool measure_gap(DepthObject& object, double growth_px, InstanceStatistics& statistics) {
    const Instance& instance = *object.instance;
    const cv::Rect masked = object.masked();
    const int spacing = frame_.scaled(max_followed_px / 3);
    const int farthest = frame_.scaled(max_followed_px) + static_cast<int>(growth_px);
    for (auto& side : gaps_) side.clear();
    for (int y = masked.y + spacing / 2; y < masked.br().y; y += spacing) {
      const std::uint8_t* const row = instance.mask.ptr<std::uint8_t>(y - instance.mask_origin.y) +
                                      (masked.x - instance.mask_origin.x);
      const auto first = static_cast<int>(find_mask_pixel(row, row + masked.width) - row);
      int last = masked.width - 1;
      while (last >= first && row[last] == 0) --last;
      if (last < first) continue;
      const int left = masked.x + first, right = masked.x + last;
      const int inwards = std::min(farthest, last - first);
      follow_depth(object, {left, y}, -1, std::min(farthest, left), inwards);
      follow_depth(object, {right, y}, 1, std::min(farthest, frame_.size.width - 1 - right),
                   inwards);
    }
    if (std::min(gaps_[0].size(), gaps_[1].size()) < min_rows) return false;
    const double left = quantile_of(gaps_[0]), right = quantile_of(gaps_[1]);
    const double gap = (left + right) / 2, shift = (right - left) / 2;
    const bool is_shifted = std::abs(shift) >= min_shift_px * frame_.scale;
    object.shift_px = is_shifted ? static_cast<int>(std::lround(shift)) : 0;
    if (frame_.is_stale) return true;
    const double max_gap = max_gap_px * frame_.scale;
    object.margin_px += std::clamp(gap + std::abs(shift) / 2, 0.0, max_gap);
    statistics.mask_gap_px = std::clamp(gap, 0.0, max_gap);
    statistics.depth_shift_px = object.shift_px;
    statistics.mask_gap_places = gaps_[0].size() + gaps_[1].size();
    return true;
  }

  /// Follows the object's depth from the end of a row of its mask to the left (direction -1) or
  /// right (1), over holes of two pixels, to a step or where it ends. If the end of the row lacks
  /// it, looks for it inwards. Notes the distance, negative inwards, unless it exceeds its limit.
  void follow_depth(const DepthObject& object, cv::Point end, int direction, int max_outwards,
                    int max_inwards) {
    const auto depth_m = [&](int distance) {
      return frame_.depth_at({end.x + direction * distance, end.y});
    };
    int gap = 0;
    while (gap >= -max_inwards && !object.is_at_depth(depth_m(gap))) --gap;
    if (max_outwards == 0 || gap < -max_inwards) return;
    for (int next = 1; gap >= 0 && next <= gap + 3; ++next) {
      if (next > max_outwards) return;
      const double step_m = std::abs(depth_m(next) - depth_m(gap));
      if (object.is_at_depth(depth_m(next)) && step_m <= max_followed_m) gap = next;
    }
    gaps_[direction < 0 ? 0 : 1].push_back(gap);
  }

  /// Tells whether depths in its extent lie behind an object. If not, its stale mask may be on the
  /// wall that it left, and the nearest cluster in the extent is tried.
  bool is_before_something(DepthObject& object) {
    sample(object.extent, nullptr);
    const auto is_before = [&] {
      const double end_m = object.depth_m + frame_.half_width_m;
      const auto behind = std::count_if(depths_m_.begin(), depths_m_.end(),
                                        [&](double depth_m) { return depth_m > end_m; });
      return static_cast<double>(behind) >=
             min_share_behind * static_cast<double>(depths_m_.size());
    };
    if (is_before()) return true;
    object.seed_box = object.extent;
    return take_nearest_cluster(object, min_share_in_box) && is_before();
  }

  const DepthRuleFrame& frame_;
  std::vector<double>& depths_m_;
  std::array<std::vector<int>, 2>& gaps_;
  const int spacing_ = frame_.scaled(spacing_px);
};

}  // namespace dynfilter::detail
