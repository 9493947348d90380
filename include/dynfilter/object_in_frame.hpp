// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OBJECT_IN_FRAME_HPP
#define DYNFILTER_OBJECT_IN_FRAME_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_compensator_options.hpp"
#include "dynfilter/depth_watershed.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/object_pixels.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/mask_gap.hpp"
#include "dynfilter/object_depth.hpp"
#include "dynfilter/object_nearness.hpp"

namespace dynfilter {

/// One object in one frame: where it may be, its depth, and what surrounds it. It answers for
/// DepthCompensator which pixels are the object's. It refers to the input and the options that it
/// was measured with; ask only while they live. It is for one thread, even where it is const.
class ObjectInFrame {
 public:
  /// Scratch memory that objects may share.
  struct Scratch {
    std::vector<float> depths_m;     ///< of ObjectDepthEstimator
    MaskGapEstimator::Scratch gaps;  ///< of MaskGapEstimator
  };

  /// Measures an instance, reusing memory. The input must be valid and the instance in it.
  /// O(pixels of the mask / 16), and O(n log n) in the cells of its reach.
  void measure(const FilterInput& input, std::size_t instance,
               const DepthCompensatorOptions& options, const ObjectDepthEstimator& depth_estimator,
               Scratch& scratch) {
    frame_ = &input.frame;
    mask_ = &input.segmentation.instances[instance];
    instance_ = instance;
    is_stale_ = mask_age_s(input.frame, input.segmentation) > options.stale_age_s;
    gap_ = {};
    to_depth_ = {};
    depth_ = depth_estimator.estimate(*frame_, *mask_, scratch.depths_m);
    if (depth_.empty()) return;
    pixels_ = {*frame_, depth_.mask_range_m, depth_.box_range_m};
    reach_ = object_reach(mask_->box, mask_age_s(input.frame, input.segmentation), options,
                          frame_->depth.size());
    if (!is_stale_) {
      gap_ = MaskGapEstimator::estimate(*frame_, *mask_, depth_, scratch.gaps).value_or(MaskGap());
      to_depth_.x = static_cast<int>(std::lround(gap_.shift_px));
    }
    nearness_steps_ = detail::steps_of_reach(depth_rule::reach_px, frame_->depth.size());
    margin_px_ = gap_.margin_px + pixels(options.mask_margin_px);
    shadow_px_ = gap_.margin_px + pixels(depth_rule::shadow_px);
    segmentation_ = &input.segmentation;
    is_flooded_ = false;
  }

  /// Index of the instance in the segmentation.
  std::size_t instance() const { return instance_; }
  /// Depth of the object. If it is empty, ask nothing else.
  const ObjectDepth& depth() const { return depth_; }
  /// Part of the image that the object may be in: the box with its margin, grown by the distance
  /// that the object may have moved since.
  const cv::Rect& reach() const { return reach_; }
  /// How the object's depth lies against a fresh mask. Without places it is not known.
  const MaskGap& gap() const { return gap_; }

  /// Whether the depth of a pixel in reach is the object's: it lies in the object's range, and is
  /// not connected better with the surroundings; or it lies near the range and is connected with
  /// the object.
  bool has_depth_at(cv::Point pixel) const {
    const cv::Point place = depth_place(pixel);
    const double depth_m = frame_->depth_m(place).value_or(0);
    const ValueRange range_m = depth_.hull_m();
    if (!(depth_m > 0) || depth_m < range_m.lower - depth_rule::max_beyond_range_m ||
        depth_m > range_m.upper + depth_rule::max_beyond_range_m) {
      return false;
    }
    const bool is_in_range = depth_.contains(depth_m);
    if (is_in_range && !is_off_middle(depth_m)) return true;
    flood();
    const DepthWatershed::Steps steps = watershed_.steps_to(place, depth_m);
    const bool is_surroundings = steps.to_surroundings_m < steps.to_object_m;
    if (is_in_range) return !is_surroundings || !watershed_.has_object();
    return !is_surroundings && steps.to_object_m <= depth_rule::max_step_m;
  }

  /// Returns the certainty that a pixel in reach belongs to the object, by depth and nearness. From
  /// 1/2 on it is taken to belong.
  double certainty(cv::Point pixel) const {
    return has_depth_at(pixel) ? 1 : certainty_around(pixel);
  }

  /// Returns the certainty by nearness, for a pixel in reach that has not the object's depth.
  double certainty_around(cv::Point pixel) const {
    const cv::Point place = depth_place(pixel);
    const double depth_m = frame_->depth_m(place).value_or(0);
    const bool is_not_behind = depth_m > 0 && depth_m < depth_.hull_m().upper;
    if (is_not_behind) return 0;
    const Instance* const fresh_mask = is_stale_ ? nullptr : mask_;
    const double nearness = detail::object_nearness(*frame_, place, pixels_, nearness_steps_,
                                                    fresh_mask, place - pixel);
    if (!(nearness > 0)) return 0;
    const double needed = min_nearness(pixel, nearness);
    return nearness < needed ? 0.5 * (nearness / needed) : std::min(1.0, 0.5 + nearness / 8);
  }

  /// Whether a pixel lies so close to a fresh mask that it belongs to the object in any case.
  bool is_beside_mask(cv::Point pixel) const {
    return !is_stale_ && margin_px_ > 0 && detail::mask_within(*mask_, pixel, margin_px_);
  }

  /// Whether something at this depth hides the object or is part of it: it is no farther than the
  /// object's farthest point.
  bool is_hidden_by(double depth_m) const {
    return depth_m > 0 && depth_m <= depth_.hull_m().upper;
  }

  /// Whether a pixel of the image belongs to the object by all tests, or its own depth does, which
  /// may not be the depth of what it shows.
  bool contains(cv::Point pixel) const {
    if (to_depth_.x != 0 && reach_.contains(pixel) && has_depth_at(pixel - to_depth_)) return true;
    if (reach_.contains(pixel) && (certainty(pixel) >= 0.5 || is_beside_mask(pixel))) return true;
    if (!mask_->covers(pixel)) return false;
    return !is_stale_ || is_hidden_by(frame_->depth_m(pixel).value_or(0));
  }

 private:
  /// Converts a length for images 640 pixels wide to pixels of this image.
  double pixels(double length_px) const {
    return length_px * detail::pixel_scale(frame_->depth.size());
  }

  /// Returns the place in the depth image of what the image shows at a pixel. Where depth is out of
  /// step with a fresh mask, that is where the object was: the mask tells by how much.
  cv::Point depth_place(cv::Point pixel) const {
    return {std::clamp(pixel.x + to_depth_.x, 0, frame_->depth.cols - 1), pixel.y};
  }

  /// Whether a depth is so far from the middle of the object's range that the place may belong to
  /// the surroundings. Nothing before the middle does if the mask is stale, because the object may
  /// have come nearer since.
  bool is_off_middle(double depth_m) const {
    const ValueRange range_m = depth_.hull_m();
    const double behind_m = depth_m - (range_m.lower + range_m.upper) / 2;
    return (is_stale_ ? behind_m : std::abs(behind_m)) > depth_rule::min_off_middle_m;
  }

  /// Floods the reach and one row of cells around it, unless it is done: from the mask, and from
  /// outside the reach, except for boxes of the same class, because people stand close together.
  void flood() const {
    if (is_flooded_) return;
    is_flooded_ = true;
    const int cell_px = std::max(1, static_cast<int>(std::lround(pixels(depth_rule::cell_px))));
    const std::int64_t shift_px = std::abs(to_depth_.x);
    const cv::Rect area =
        detail::clip_grown(reach_, cell_px + shift_px, cell_px, frame_->depth.size());
    // Cells begin at the box's corner, so that they do not depend on the object's place.
    const auto aligned = [cell_px](int first, int corner) {
      const std::int64_t beyond = (std::int64_t{first} - corner) % cell_px;
      return first - static_cast<int>(beyond < 0 ? beyond + cell_px : beyond);
    };
    const cv::Point first(aligned(area.x, mask_->box.x), aligned(area.y, mask_->box.y));
    const cv::Rect cells = reach_.empty() ? cv::Rect() : cv::Rect(first, area.br());
    find_neighbours({cells.tl(), cells.br() + cv::Point(cell_px, cell_px)});
    const auto seed_at = [&](cv::Point pixel) {
      if (mask_->covers(pixel - to_depth_)) return DepthWatershed::Seed::object;
      if (reach_.contains(pixel) || is_neighbours(pixel)) return DepthWatershed::Seed::none;
      return DepthWatershed::Seed::surroundings;
    };
    ValueRange range_m = depth_.hull_m();
    range_m.lower -= depth_rule::max_beyond_range_m;
    range_m.upper += depth_rule::max_beyond_range_m;
    watershed_.flood(*frame_, cells, cell_px, range_m, seed_at);
  }

  /// Finds the boxes of other objects of the same class that reach into an area.
  void find_neighbours(const cv::Rect& area) const {
    neighbours_.clear();
    for (const Instance& other : segmentation_->instances) {
      if (&other == mask_ || other.class_id != mask_->class_id) continue;
      const cv::Rect box = detail::clip(other.box, frame_->depth.size());
      if (!(box & area).empty()) neighbours_.push_back(box);
    }
  }

  /// Whether a pixel lies in the box of another object of the same class.
  bool is_neighbours(cv::Point pixel) const {
    return std::any_of(neighbours_.begin(), neighbours_.end(),
                       [&](const cv::Rect& box) { return box.contains(pixel); });
  }

  /// Returns the smallest nearness for a pixel without the object's depth. It is higher beside a
  /// fresh mask, in the sensor's shadow. `nearness` is the pixel's: the distance to the mask is
  /// measured only if it decides.
  double min_nearness(cv::Point pixel, double nearness) const {
    if (is_stale_) return depth_rule::min_nearness_if_stale;
    const double in_shadow = std::max(depth_rule::min_nearness, depth_rule::min_nearness_in_shadow);
    if (nearness >= in_shadow) return depth_rule::min_nearness;
    return detail::mask_within(*mask_, pixel, shadow_px_) ? in_shadow : depth_rule::min_nearness;
  }

  const FrameView* frame_ = nullptr;
  const Instance* mask_ = nullptr;
  std::size_t instance_ = 0;
  bool is_stale_ = false;
  cv::Rect reach_;
  ObjectDepth depth_;
  detail::ObjectPixels pixels_;  // of depth_
  MaskGap gap_;
  cv::Point to_depth_;  // from a pixel of the image to its place in the depth image
  double margin_px_ = 0, shadow_px_ = 0;  // distances from the mask
  int nearness_steps_ = 1;                // reach of object_nearness
  const Segmentation* segmentation_ = nullptr;
  // Flooded when the first question needs it: few do where masks are good.
  mutable DepthWatershed watershed_;
  mutable std::vector<cv::Rect> neighbours_;
  mutable bool is_flooded_ = false;
};

}  // namespace dynfilter

#endif  // DYNFILTER_OBJECT_IN_FRAME_HPP
