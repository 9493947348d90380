// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DEPTH_COMPENSATOR_HPP
#define DYNFILTER_DEPTH_COMPENSATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Options of DepthCompensator. Lengths in pixels are for images 640 pixels wide and scale with the
/// width.
struct DepthCompensatorOptions {
  /// How far a person's limbs reach before and behind the median depth, metres.
  double half_width_m = 0.55;
  /// Features this close to a fresh mask and its gap are removed in any case.
  double mask_margin_px = 1;
  /// Masks older than this, seconds, are stale. Above 1 s they count as fresh: no time was set.
  double stale_age_s = 0.02;
  double motion_px_per_s = 400;  ///< largest speed of objects in the image
  /// Smallest share of the features to leave. Where fewer would be left, or fewer than 300 (or half
  /// of all, if that is less), the stage is cautious and removes only what is sure. 0: it never is.
  double min_kept_share = 0.3;
};

/// Removes the features that masks missed, by the surfaces in the depth image: the place of the
/// paper's edge compensation (section 3.2). A watershed divides surfaces between objects and
/// surroundings: it starts on the masks and outside the boxes, and takes the smallest step of depth
/// first (F. Meyer, "Topographic distance and watershed lines", Signal Processing 38, 1994). A
/// surface at depth z belongs to an object at depth m if
///
///     step to the object - step to the surroundings <= 1/4 (half_width_m - |z - m|).
///
/// So what lies at the object's depth needs good reasons to be surroundings, and what lies before
/// or behind needs good reasons to be the object. A feature is removed if its surface belongs to an
/// object; if it lies within the margin of a fresh mask; or if it has no depth, or one behind the
/// object, and the surfaces around it are the object's. A feature on a stale mask is given back
/// unless it would be removed without the mask. The first instance whose test it passes has it.
///
/// Hosts lose the camera by too few features sooner than by some moving ones. So in a frame that
/// would leave too few (min_kept_share) the stage removes only what is sure: features within 4 px
/// of a fresh mask or 0.1 m of the object's depth.
///
/// Without a depth image, features with depths serve (FeaturesView::with_depths). The stage
/// abstains without these, too, and from an instance whose depth or box is not known. The
/// statistics say so. Limit: a thing that touches an object at its depth, inside its box, is
/// removed with it.
///
/// The score is the detector's confidence times the certainty: from 1/2 on the feature belongs to
/// the object, and is removed unless the stage is cautious.
class DepthCompensator {
 public:
  /// Takes the options. Throws std::invalid_argument for a number outside 0 to 1000000, and for a
  /// share above 1.
  explicit DepthCompensator(const DepthCompensatorOptions& options = {}) : options_(options) {
    const auto require = [](const char* name, double value, int most) {
      if (value >= 0 && value <= most) return;
      detail::throw_misuse("DepthCompensator", detail::concatenate(name, " = ", value),
                           detail::concatenate("a number from 0 to ", most));
    };
    require("half_width_m", options.half_width_m, 1000000);
    require("mask_margin_px", options.mask_margin_px, 1000000);
    require("stale_age_s", options.stale_age_s, 1000000);
    require("motion_px_per_s", options.motion_px_per_s, 1000000);
    require("min_kept_share", options.min_kept_share, 1);
  }

  /// Runs the stage with a temporary workspace.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Runs the stage. Throws std::invalid_argument for malformed input. O(pixels / 256 + features),
  /// and for each instance O(features in its box); without a depth image, each of these that has no
  /// depth asks those around it.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "DepthCompensator");
    Surfaces surfaces(options_, input, frame_features(input.features, workspace),
                      workspace.get<Scratch>());
    for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
      if (labels.is_dynamic_object(k)) surfaces.add(k, labels.statistics().instances[k]);
    }
    if (surfaces.flood()) surfaces.judge(labels);
  }

  /// Returns instance k with a refined mask: the tests above for every pixel of its box and what is
  /// around. It is for dense mapping: the functions of host_masks.hpp take it in place of the
  /// network's mask. Instances of its class count as objects. Returns the instance unchanged
  /// without a depth image, or if its depth is not known. Throws std::invalid_argument for
  /// malformed input and an index out of range.
  Instance refined(const FrameView& frame, const Segmentation& segmentation, std::size_t k) const {
    const FilterInput input{frame, segmentation, {}};
    validate(input, "DepthCompensator");
    if (k >= segmentation.instances.size()) {
      detail::throw_misuse("DepthCompensator::refined", detail::concatenate("instance ", k),
                           detail::concatenate("an index below ", segmentation.instances.size()));
    }
    Instance instance = segmentation.instances[k];
    if (frame.depth.empty()) return instance;
    Scratch scratch;
    const FrameFeatures no_features;
    Surfaces surfaces(options_, input, no_features, scratch);
    for (std::size_t i = 0; i < segmentation.instances.size(); ++i) {
      InstanceStatistics unused;
      if (segmentation.instances[i].class_id == instance.class_id) surfaces.add(i, unused);
    }
    if (surfaces.flood()) surfaces.refine(k, instance);
    return instance;
  }

 private:
  // Lengths in pixels are for images 640 pixels wide. The numbers were chosen on rendered and on
  // recorded scenes.
  static constexpr double max_step_m = 0.2;       // surfaces farther apart are not connected
  static constexpr double step_per_depth = 0.25;  // of the inequality
  static constexpr double max_age_s = 1;          // older: the masks' time was not set
  static constexpr double sample_px = 16;         // distance of the depths that are read
  static constexpr std::size_t min_samples = 8;   // of depth on a mask or in a box
  static constexpr double min_share = 0.03;       // of the object's among those on its mask
  static constexpr double min_box_share = 0.2;    // in the middle of its box, and of features
  static constexpr double max_cell_px = 16;       // of the flood; narrow objects need smaller cells
  static constexpr double min_cell_px = 6;
  static constexpr double box_margin_px = 6;    // detectors' boxes are not exact
  static constexpr double max_growth = 1.25;    // of a stale box, in its widths
  static constexpr double min_behind = 0.05;    // share of the depths around a stale object
  static constexpr double gap_reach_px = 24;    // depth is followed so far beyond a mask
  static constexpr double max_gap_px = 16;      // what reaches farther is not the object
  static constexpr double min_shift_px = 4;     // less is noise
  static constexpr double min_nearness = 0.45;  // sum of 1 / distance in eight directions …
  static constexpr double nearness_px = 12;     // … up to this distance
  static constexpr double shadow_px = 9;        // width of the strip without depth at an edge
  static constexpr double min_kept = 300;       // features: with fewer, hosts lose the track
  static constexpr double sure_px = 4;          // from a fresh mask, or …
  static constexpr double sure_m = 0.1;         // … from the object's depth
  static constexpr double sparse_width = 0.75;  // of the half width: features show no steps
  static constexpr double sparse_px = 60;       // distance of features that vote, and …
  static constexpr double doubt_px = 24;        // … of one imagined vote against the object
  static constexpr double min_votes = 0.9;      // share of the object's

  struct Object {
    std::size_t k = 0;  // index of the instance
    const Instance* instance = nullptr;
    double depth_m = 0;
    cv::Rect reach;        // where the object may be
    cv::Rect seeds;        // the middle of the box, if the mask tells no depth
    int shift_px = 0;      // of the depth image to the right of the mask
    double margin_px = 0;  // beside the mask
  };

  struct Cell {
    double depth_m = 0;                                       // 0: unknown
    double step_m = std::numeric_limits<double>::infinity();  // largest on the way to the owner
    int owner = 0;                                            // 1: an object, -1: surroundings
  };

  struct Verdict {
    double certainty = 0;
    const Object* object = nullptr;
  };

  struct Scratch {
    std::vector<Object> objects;
    std::vector<Cell> cells;
    std::vector<double> depths_m;
    std::vector<int> gaps_px[2];  // at the left and right edges of a mask
    std::vector<Verdict> verdicts;
  };

  /// Objects and surfaces of one frame.
  class Surfaces {
   public:
    Surfaces(const DepthCompensatorOptions& options, const FilterInput& input,
             const FrameFeatures& features, Scratch& scratch)
        : options_(options), input_(input), features_(features), scratch_(scratch) {
      if (age_s_ > max_age_s) age_s_ = 0;
      scratch.objects.clear();
      // All memory that frames of this size may need, whether or not this one does.
      const auto places = [](int length, int step) {
        return static_cast<std::size_t>(length / step + 1);
      };
      const int step = scaled(sample_px), row_step = scaled(gap_reach_px / 3);
      scratch.objects.reserve(input.segmentation.instances.size());
      scratch.verdicts.reserve(features.size());
      scratch.depths_m.reserve(features.size() +
                               places(size_.width, step) * places(size_.height, step));
      for (std::vector<int>& gaps_px : scratch.gaps_px) {
        gaps_px.reserve(places(size_.height, row_step));
      }
      scratch.cells.reserve(lay_grid(min_cell_px * scale_));
    }

    /// Adds an instance to the objects if its depth is known.
    void add(std::size_t k, InstanceStatistics& statistics) {
      Object object;
      object.k = k;
      object.instance = &input_.segmentation.instances[k];
      const bool is_known = measure(object, statistics);
      statistics.compensation = is_known && has_image_ ? Compensation::applied
                                : is_known             ? Compensation::applied_without_image
                                : has_image_ || input_.features.has_depths()
                                    ? Compensation::too_few_samples
                                    : Compensation::no_depth_image;
      if (!is_known) return;
      statistics.depth_range_m = {object.depth_m - half_m_, object.depth_m + half_m_};
      scratch_.objects.push_back(object);
    }

    /// Divides the surfaces around the objects: the watershed, on a coarse grid. Returns false if
    /// there are no objects.
    bool flood() {
      if (scratch_.objects.empty() || !has_image_) return !scratch_.objects.empty();
      cv::Rect area;
      double cell_px = max_cell_px * scale_;
      for (const Object& object : scratch_.objects) {
        const cv::Rect& box = object.instance->box;
        const double quarter_px = std::min(box.width, box.height) / 4;
        cell_px = std::min(cell_px, std::max(min_cell_px * scale_, quarter_px));
        area |= object.reach;
      }
      scratch_.cells.assign(lay_grid(cell_px), Cell());
      area = detail::clip_grown(area, cell_, cell_, size_);  // with a ring of surroundings
      const std::size_t first = cell_at(area.tl()), end = cell_at(area.br()) + 1;
      for (int y = area.y / cell_ * cell_ + cell_ / 2; y < area.br().y; y += cell_) {
        for (int x = area.x / cell_ * cell_ + cell_ / 2; x < area.br().x; x += cell_) {
          Cell& cell = scratch_.cells[cell_at({x, y})];
          cell.depth_m = depth_at({x, y});
          cell.owner = cell.depth_m > 0 ? seed_at({x, y}, cell.depth_m) : 0;
          if (cell.owner != 0) cell.step_m = -1;  // below every step: a seed keeps its owner
        }
      }
      for (int round = 0; round < 2; ++round) {
        for (std::size_t i = first; i < end; ++i) spread_to(i, -1);
        for (std::size_t i = end; i-- > first;) spread_to(i, 1);
      }
      return true;
    }

    /// Judges the features, and writes the labels.
    void judge(FeatureLabels& labels) {
      std::vector<Verdict>& verdicts = scratch_.verdicts;
      verdicts.assign(labels.size(), Verdict());
      for (const Object& object : scratch_.objects) {
        for (const std::size_t i : features_.inside(object.reach)) {
          const bool may_return = is_stale_ && labels[i].reason == Reason::in_mask;
          if (verdicts[i].certainty >= 0.5 || (labels.is_removed(i) && !may_return)) continue;
          const double certainty = certainty_of(object, i);
          if (certainty > verdicts[i].certainty) verdicts[i] = {certainty, &object};
        }
      }
      std::size_t kept = 0;
      for (std::size_t i = 0; i < labels.size(); ++i) {
        const bool is_objects = verdicts[i].certainty >= 0.5;
        if (!is_objects && is_on_stale_mask(labels[i])) labels.restore(i, 0);
        kept += labels.is_removed(i) || is_objects ? 0 : 1;
      }
      const double all = static_cast<double>(labels.size()), share = options_.min_kept_share;
      const double wanted = std::max(share * all, std::min(min_kept, all / 2));
      const bool is_cautious = share > 0 && static_cast<double>(kept) < wanted;
      for (std::size_t i = 0; i < labels.size(); ++i) {
        const auto [certainty, object] = verdicts[i];
        if (labels.is_removed(i) || object == nullptr) continue;
        const float score = static_cast<float>(certainty) * object->instance->score;
        const auto k = static_cast<std::int32_t>(object->k);
        if (certainty >= 0.5 && (!is_cautious || is_sure(*object, i))) {
          labels.remove(i, k, Reason::compensated, score);
        } else {
          labels.suspect(i, k, score);
        }
      }
      if (!is_cautious) return;
      for (const Object& object : scratch_.objects) {
        labels.statistics().instances[object.k].compensation = Compensation::cautious;
      }
    }

    /// Gives instance k the mask of what belongs to it: its fresh mask, and the pixels whose
    /// surface, or whose own depth, which may be shifted, is the object's.
    void refine(std::size_t k, Instance& instance) const {
      for (const Object& object : scratch_.objects) {
        if (object.k != k) continue;
        const cv::Rect masked = detail::clip({instance.mask_origin, instance.mask.size()}, size_);
        const cv::Rect area = is_stale_ ? object.reach : object.reach | masked;
        cv::Mat mask(area.size(), CV_8UC1, cv::Scalar(0));
        for (cv::Point at = area.tl(); at.y < area.br().y; ++at.y) {
          for (at.x = area.x; at.x < area.br().x; ++at.x) {
            const bool is_objects =
                (!is_stale_ && instance.covers(at)) ||
                (object.reach.contains(at) &&
                 (owns(object, at, depth_at(at)) || certainty_at(object, at) >= 0.5));
            if (is_objects) mask.at<std::uint8_t>(at - area.tl()) = 255;
          }
        }
        instance.mask = mask;
        instance.mask_origin = area.tl();
      }
    }

   private:
    /// Returns the depth at a pixel; 0 where it is unknown and outside the image.
    double depth_at(cv::Point pixel) const {
      const cv::Mat& depth = input_.frame.depth;
      if (pixel.x < 0 || pixel.y < 0 || pixel.x >= depth.cols || pixel.y >= depth.rows) return 0;
      const double units = is_16_bit_
                               ? static_cast<double>(depth.ptr<std::uint16_t>(pixel.y)[pixel.x])
                               : static_cast<double>(depth.ptr<float>(pixel.y)[pixel.x]);
      const double depth_m = units * unit_m_;
      return depth_m > 0 && depth_m <= std::numeric_limits<double>::max() ? depth_m : 0;
    }
    bool is_near(const Object& object, double depth_m) const {
      return depth_m > 0 && std::abs(depth_m - object.depth_m) <= half_m_;
    }
    int scaled(double length_px) const {
      return std::max(1, static_cast<int>(std::lround(length_px * scale_)));
    }

    /// Measures the object's depth, margin, shift and reach. Returns whether its depth is known.
    bool measure(Object& object, InstanceStatistics& statistics) {
      object.margin_px = options_.mask_margin_px * scale_;
      if (object.instance->box.empty() || !find_depth(object, statistics.sampled)) return false;
      const double moved_px = options_.motion_px_per_s * age_s_ * scale_;
      double growth_px = std::min(moved_px, max_growth * object.instance->box.width);
      growth_px = std::clamp<double>(growth_px, 0, size_.width);
      if (has_image_ && measure_gaps(object, growth_px, statistics) && is_stale_) {
        growth_px = std::min(growth_px, moved_px / 2 + 2 * std::abs(object.shift_px));
      }
      const double margin_px = box_margin_px * scale_;
      object.reach = detail::clip_grown(object.instance->box, std::lround(margin_px + growth_px),
                                        std::lround(margin_px + growth_px / 2), size_);
      if (!is_stale_ || !has_image_ || !is_background(object)) return true;
      object.seeds = object.reach;  // it has left its mask, and may be beside it
      return find_cluster(min_box_share, object.depth_m) && !is_background(object);
    }

    /// Finds the depth of the nearest cluster on the mask; if there is none, in the middle of the
    /// box, which an object fills wherever its limbs are.
    bool find_depth(Object& object, std::size_t& samples) {
      const Instance& instance = *object.instance;
      const cv::Rect masked = detail::clip({instance.mask_origin, instance.mask.size()}, size_);
      const std::size_t places = read_depths(masked, &instance);
      samples = scratch_.depths_m.size();
      if (find_cluster(has_image_ ? min_share : min_box_share, object.depth_m)) return true;
      // Many features on the mask without any depth: those in the box are of what is behind it.
      if (!has_image_ && samples == 0 && places >= 3 * min_samples) return false;
      const cv::Rect box = detail::clip(instance.box, size_);
      object.seeds = {box.x + box.width / 4, box.y + box.height / 5, box.width / 2,
                      box.height * 3 / 5};
      read_depths(object.seeds, nullptr);
      samples += scratch_.depths_m.size();
      return find_cluster(min_box_share, object.depth_m);
    }

    /// Reads the depths in an area, on the mask of an instance if there is one. Returns the number
    /// of places.
    std::size_t read_depths(const cv::Rect& area, const Instance* instance) {
      scratch_.depths_m.clear();
      std::size_t places = 0;
      const auto read = [&](cv::Point pixel, double depth_m) {
        if (instance != nullptr && !instance->covers(pixel)) return;
        ++places;
        if (depth_m > 0) scratch_.depths_m.push_back(depth_m);
      };
      const int step = scaled(sample_px);
      for (int y = area.y + step / 2; has_image_ && y < area.br().y; y += step) {
        for (int x = area.x + step / 2; x < area.br().x; x += step) read({x, y}, depth_at({x, y}));
      }
      if (has_image_) return places;
      for (const std::size_t i : features_.inside(area)) {
        read(features_.pixel(i), input_.features.depth_m(i).value_or(0));
      }
      return places;
    }

    /// Finds the first range of two half widths, from near to far, that has a share of the depths,
    /// and centres it on its median twice.
    bool find_cluster(double share, double& median_m) {
      std::vector<double>& depths_m = scratch_.depths_m;
      if (depths_m.size() < min_samples) return false;
      std::sort(depths_m.begin(), depths_m.end());
      const auto wanted = std::max<std::ptrdiff_t>(
          min_samples / 2, std::lround(std::ceil(share * static_cast<double>(depths_m.size()))));
      auto first = depths_m.begin(), end = first;
      for (;; ++first) {
        end = std::upper_bound(end, depths_m.end(), *first + 2 * half_m_);
        if (end - first >= wanted) break;
        if (end == depths_m.end()) return false;
      }
      median_m = *(first + (end - first) / 2);
      for (int round = 0; round < 2; ++round) {
        first = std::lower_bound(depths_m.begin(), depths_m.end(), median_m - half_m_);
        end = std::upper_bound(first, depths_m.end(), median_m + half_m_);
        median_m = *(first + (end - first) / 2);
      }
      return true;
    }

    /// Whether hardly anything around lies behind the object, as behind a wall.
    bool is_background(const Object& object) {
      read_depths(object.reach, nullptr);
      const std::vector<double>& depths_m = scratch_.depths_m;
      const auto behind = std::count_if(depths_m.begin(), depths_m.end(), [&](double depth_m) {
        return depth_m > object.depth_m + half_m_;
      });
      return static_cast<double>(behind) < min_behind * static_cast<double>(depths_m.size());
    }

    /// Measures in some rows how far the object's depth goes on beyond its mask. The mean of left
    /// and right is the mask's gap, half the difference the shift of depth against the mask, which
    /// is out of step or stale. Returns whether there were enough rows.
    bool measure_gaps(Object& object, double growth_px, InstanceStatistics& statistics) {
      const Instance& instance = *object.instance;
      const cv::Rect masked = detail::clip({instance.mask_origin, instance.mask.size()}, size_);
      const int step = scaled(gap_reach_px / 3);
      const int reach = scaled(gap_reach_px) + static_cast<int>(growth_px);
      auto& [lefts, rights] = scratch_.gaps_px;
      lefts.clear();
      rights.clear();
      for (int y = masked.y + step / 2; y < masked.br().y; y += step) {
        int left = masked.x, right = masked.br().x - 1;
        while (left <= right && !instance.covers({left, y})) ++left;
        while (left <= right && !instance.covers({right, y})) --right;
        measure_gap(object, {left, y}, -1, reach, right - left, lefts);
        measure_gap(object, {right, y}, 1, reach, right - left, rights);
      }
      statistics.mask_gap_places = 0;
      if (std::min(lefts.size(), rights.size()) < min_samples / 2) return false;
      const auto median = [](std::vector<int>& values) {
        const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
        std::nth_element(values.begin(), middle, values.end());
        return static_cast<double>(*middle);
      };
      const double left = median(lefts), right = median(rights), shift = (right - left) / 2;
      if (std::abs(shift) >= min_shift_px * scale_) {
        object.shift_px = static_cast<int>(std::lround(shift));
      }
      if (is_stale_) return true;
      const double gap = (left + right) / 2, max_gap = max_gap_px * scale_;
      object.margin_px += std::clamp(gap + std::abs(shift) / 2, 0.0, max_gap);
      statistics.mask_gap_px = std::clamp(gap, 0.0, max_gap);
      statistics.depth_shift_px = object.shift_px;
      statistics.mask_gap_places = lefts.size() + rights.size();
      return true;
    }

    /// Walks from an edge of a mask to where the object's depth ends, over holes of two pixels, or
    /// back to where it begins. Adds the distance unless there is no end within reach.
    void measure_gap(const Object& object, cv::Point edge, int way, int reach, int run_px,
                     std::vector<int>& gaps_px) const {
      const int to_border = way < 0 ? edge.x : size_.width - 1 - edge.x;
      const auto is_objects = [&](int distance) {
        return is_near(object, depth_at({edge.x + way * distance, edge.y}));
      };
      int last = 0;
      while (last >= -std::min(reach, run_px) && !is_objects(last)) --last;
      if (to_border == 0 || last < -std::min(reach, run_px)) return;
      for (int next = 1; last >= 0 && next <= last + 3; ++next) {
        if (next > std::min(reach, to_border)) return;
        if (is_objects(next)) last = next;
      }
      gaps_px.push_back(last);
    }

    /// Chooses the width of the cells. Returns their number, with a frame of dry ones.
    std::size_t lay_grid(double cell_px) {
      cell_ = std::max(1, static_cast<int>(std::lround(cell_px)));
      stride_ = size_.width / cell_ + 3;
      return static_cast<std::size_t>(stride_) * static_cast<std::size_t>(size_.height / cell_ + 3);
    }
    std::size_t cell_at(cv::Point place) const {
      return static_cast<std::size_t>((place.y / cell_ + 1) * stride_ + place.x / cell_ + 1);
    }

    /// Returns the owner of a place where the flood starts, and 0 elsewhere.
    int seed_at(cv::Point place, double depth_m) const {
      int owner = -1;
      for (const Object& object : scratch_.objects) {
        const bool is_seed = object.seeds.empty()
                                 ? object.instance->covers({place.x - object.shift_px, place.y})
                                 : object.seeds.contains(place);
        if (is_seed && is_near(object, depth_m)) return 1;
        if (object.reach.contains(place)) owner = 0;
      }
      return owner;
    }

    /// Floods a cell from its four neighbours before or after it. At equal steps objects win.
    void spread_to(std::size_t i, int way) {
      Cell& cell = scratch_.cells[i];
      if (cell.depth_m == 0) return;
      for (const int offset : {1, stride_ - 1, stride_, stride_ + 1}) {
        const Cell& from = (&cell)[way * offset];
        const double step_m = std::max(from.step_m, std::abs(cell.depth_m - from.depth_m));
        const bool is_less =
            step_m < cell.step_m || (step_m == cell.step_m && from.owner > cell.owner);
        if (from.owner == 0 || step_m > max_step_m || !is_less) continue;
        cell.step_m = step_m;
        cell.owner = from.owner;
      }
    }

    /// Whether the surface at a place of the depth image belongs to an object: the inequality.
    bool owns(const Object& object, cv::Point place, double depth_m) const {
      const double needed = step_per_depth * (half_m_ - std::abs(depth_m - object.depth_m));
      if (!(depth_m > 0) || needed < -max_step_m) return false;
      double to_object = max_step_m, to_surroundings = max_step_m;
      const Cell* const middle = &scratch_.cells[cell_at(place)];
      for (const int row : {-stride_, 0, stride_}) {
        for (const Cell* cell = middle + row - 1; cell <= middle + row + 1; ++cell) {
          if (cell->owner == 0) continue;
          double& least = cell->owner > 0 ? to_object : to_surroundings;
          least = std::min(least, std::max(cell->step_m, std::abs(depth_m - cell->depth_m)));
        }
      }
      return to_object - to_surroundings <= needed;
    }

    /// Returns the certainty that a feature in reach belongs to the object.
    double certainty_of(const Object& object, std::size_t feature) const {
      const cv::Point pixel = features_.pixel(feature);
      if (has_image_) return certainty_at(object, pixel);
      const auto depth_m = input_.features.depth_m(feature);
      if (is_beside_mask(object, pixel, 0) || (depth_m && is_near(object, *depth_m))) return 1;
      return depth_m ? 0 : share_around(object, pixel);
    }

    /// Whether a feature that belongs to the object surely does.
    bool is_sure(const Object& object, std::size_t feature) const {
      const cv::Point pixel = features_.pixel(feature);
      const double depth_m = has_image_ ? depth_at(place_of(object, pixel))
                                        : input_.features.depth_m(feature).value_or(0);
      return (depth_m > 0 && std::abs(depth_m - object.depth_m) <= sure_m) ||
             (!is_stale_ && detail::mask_within(*object.instance, pixel, sure_px * scale_));
    }

    /// Whether a feature lies on the stale mask of an object. One whose depth is not known keeps
    /// it.
    bool is_on_stale_mask(const FeatureLabel& label) const {
      return is_stale_ && label.removed && label.reason == Reason::in_mask &&
             std::any_of(scratch_.objects.begin(), scratch_.objects.end(), [&](const Object& o) {
               return static_cast<std::int32_t>(o.k) == label.instance;
             });
    }

    /// Returns the place in the depth image of what the image shows at a pixel. A stale mask is
    /// what moved, not the depth.
    cv::Point place_of(const Object& object, cv::Point pixel) const {
      const int shift_px = is_stale_ ? 0 : object.shift_px;
      return {std::clamp(pixel.x + shift_px, 0, size_.width - 1), pixel.y};
    }

    /// Returns the certainty for a pixel of a frame with a depth image.
    double certainty_at(const Object& object, cv::Point pixel) const {
      const cv::Point place = place_of(object, pixel);
      const double depth_m = depth_at(place);
      if (owns(object, place, depth_m) || is_beside_mask(object, pixel, 0)) return 1;
      if (depth_m > 0 && depth_m < object.depth_m + half_m_) return 0;
      const double nearness = nearness_at(object, place);
      double needed = min_nearness;
      if (nearness >= needed && is_beside_mask(object, pixel, shadow_px)) needed *= 2;
      return nearness < needed ? nearness / needed / 2 : std::min(1.0, 0.5 + nearness / 8);
    }

    /// Whether a pixel lies within the margin of a fresh mask, and a length beyond.
    bool is_beside_mask(const Object& object, cv::Point pixel, double beyond_px) const {
      const double margin_px = object.margin_px + beyond_px * scale_;
      return !is_stale_ && detail::mask_within(*object.instance, pixel, margin_px);
    }

    /// Sums 1 / distance over the eight directions in which the first surface, or fresh mask, is
    /// the object's.
    double nearness_at(const Object& object, cv::Point place) const {
      double sum = 0;
      const int reach = scaled(nearness_px);
      for (int way = 0; way < 9; ++way) {
        const cv::Point step(way % 3 - 1, way / 3 - 1);
        cv::Point at = place + step;
        for (int n = 1; n <= reach && way != 4; ++n, at += step) {
          const double depth_m = depth_at(at);
          const bool is_masked =
              !is_stale_ && object.instance->covers({at.x - object.shift_px, at.y});
          if (depth_m == 0 && !is_masked) continue;
          if (is_masked || owns(object, at, depth_m)) sum += scale_ / n;
          break;
        }
      }
      return sum;
    }

    /// Returns the certainty for a feature without depth, by the features around: they vote by
    /// their squared distances, in whole numbers, whose sum does not depend on their order.
    double share_around(const Object& object, cv::Point pixel) const {
      constexpr double vote = 1LL << 32;
      const double reach = sparse_px * scale_, doubt = doubt_px * scale_;
      std::int64_t objects = 0, all = static_cast<std::int64_t>(vote / (doubt * doubt));
      const cv::Rect square(pixel, cv::Size(1, 1));
      for (const std::size_t i : features_.inside(detail::bounds_of(square, std::lround(reach)))) {
        const auto depth_m = input_.features.depth_m(i);
        const cv::Point apart = features_.pixel(i) - pixel;
        const double squared = std::max(1.0, apart.ddot(apart));
        if (!depth_m || squared > reach * reach) continue;
        all += static_cast<std::int64_t>(vote / squared);
        if (is_near(object, *depth_m)) objects += static_cast<std::int64_t>(vote / squared);
      }
      const double share = static_cast<double>(objects) / static_cast<double>(all);
      return share < min_votes ? share / min_votes / 2 : std::max(0.5, share);
    }

    const DepthCompensatorOptions& options_;
    const FilterInput& input_;
    const FrameFeatures& features_;
    Scratch& scratch_;
    const bool has_image_ = !input_.frame.depth.empty();
    const bool is_16_bit_ = input_.frame.depth.type() == CV_16UC1;
    const double unit_m_ = input_.frame.depth_scale();
    const double half_m_ = options_.half_width_m * (has_image_ ? 1 : sparse_width);
    const cv::Size size_ = input_.segmentation.image_size;
    const double scale_ = detail::pixel_scale(size_);
    double age_s_ = std::abs(input_.frame.timestamp_s - input_.segmentation.timestamp_s);
    const bool is_stale_ = age_s_ <= max_age_s && age_s_ > options_.stale_age_s;
    int cell_ = 1, stride_ = 2;  // width of the cells; number in a row
  };

  DepthCompensatorOptions options_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_COMPENSATOR_HPP
