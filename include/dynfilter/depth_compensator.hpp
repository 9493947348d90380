// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DEPTH_COMPENSATOR_HPP
#define DYNFILTER_DEPTH_COMPENSATOR_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/mask_row.hpp"
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
  /// of all, if that is less), it is cautious: only sure ones may leave less than half. 0: never.
  double min_kept_share = 0.3;
};

/// Removes the features that masks missed, by the surfaces in the depth image: the place of the
/// paper's edge compensation (section 3.2). A feature is removed if its surface belongs to an
/// object, if it lies within the margin of a fresh mask, or if it has no depth, or one behind the
/// object, and the surfaces around it are the object's. A feature on a stale mask is given back
/// unless it would be removed without the mask. The first instance whose test it passes has it; the
/// score is the detector's confidence times the certainty, 1/2 or more. Without a depth image,
/// features with depths serve (FeaturesView::with_depths). Without these, too, and from an instance
/// whose depth or box is not known, the stage abstains; the statistics say so. Limit: a thing that
/// touches an object at its depth, inside its box, is removed with it.
class DepthCompensator {
 public:
  /// Takes the options. Throws std::invalid_argument for a number outside 0 to 1000000, and for a
  /// share above 1.
  explicit DepthCompensator(const DepthCompensatorOptions& options = {}) : options_(options) {
    const auto require = [](const char* name, double value, int most = 1000000) {
      if (value >= 0 && value <= most) return;
      detail::throw_misuse("DepthCompensator", detail::concatenate(name, " = ", value),
                           detail::concatenate("a number from 0 to ", most));
    };
    require("half_width_m", options.half_width_m);
    require("mask_margin_px", options.mask_margin_px);
    require("stale_age_s", options.stale_age_s);
    require("motion_px_per_s", options.motion_px_per_s);
    require("min_kept_share", options.min_kept_share, 1);
  }

  /// Runs the stage with a temporary workspace.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Runs the stage. Throws std::invalid_argument for labels of another input. O(pixels / 256 +
  /// features), and for each instance O(features in its box); without a depth image, each of these
  /// that has no depth asks those around it.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "DepthCompensator");
    Surfaces surfaces(options_, input, workspace.get<Scratch>());
    for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
      if (labels.is_dynamic_object(k)) surfaces.add(k, labels.statistics().instances[k]);
    }
    if (surfaces.flood()) surfaces.judge(labels);
  }

  /// Returns instance k with a refined mask, for dense mapping (host_masks.hpp): the tests above
  /// for every pixel in reach. Instances of its class count as objects. Returns the instance
  /// unchanged without a depth image, or if its depth is not known. Throws std::invalid_argument
  /// for malformed input and an index out of range.
  Instance refined(const FrameView& frame, const Segmentation& segmentation, std::size_t k) const {
    const FilterInput input(frame, segmentation, {});
    if (k >= segmentation.instances.size()) {
      detail::throw_misuse("DepthCompensator::refined", detail::concatenate("instance ", k),
                           detail::concatenate("an index below ", segmentation.instances.size()));
    }
    if (frame.depth.empty()) return segmentation.instances[k];
    Scratch scratch;
    InstanceStatistics unused;
    Surfaces surfaces(options_, input, scratch);
    for (std::size_t i = 0; i < segmentation.instances.size(); ++i) {
      const int class_id = segmentation.instances[i].class_id;
      if (class_id == segmentation.instances[k].class_id) surfaces.add(i, unused);
    }
    return surfaces.flood() ? surfaces.refined(k) : segmentation.instances[k];
  }

 private:
  // Lengths in pixels are for images 640 pixels wide. The numbers were chosen on rendered and on
  // recorded scenes.
  static constexpr double sample_px = 16;        // distance of the depths that are read
  static constexpr std::size_t min_samples = 8;  // of depth on a mask or in a box
  static constexpr double min_share = 0.03;      // of the object's among those on its mask
  static constexpr double min_box_share = 0.2;   // in the middle of its box, and of features
  static constexpr double max_age_s = 1;         // older: the masks' time was not set
  static constexpr double box_margin_px = 6;     // detectors' boxes are not exact
  static constexpr double max_growth = 1.25;     // of a stale box, in its widths
  static constexpr double min_behind = 0.05;     // share of the depths around a stale object
  static constexpr double gap_reach_px = 24;     // depth is followed so far beyond a mask
  static constexpr double max_gap_px = 16;       // what reaches farther is not the object
  static constexpr double min_shift_px = 4;      // less is noise
  static constexpr double max_cell_px = 16, min_cell_px = 6;  // narrow objects need small cells
  static constexpr double max_step_m = 0.2;           // surfaces farther apart are not connected
  static constexpr double step_per_depth = 0.25;      // of the inequality
  static constexpr double min_nearness = 0.45;        // sum of 1 / distance in eight directions …
  static constexpr double nearness_px = 12;           // … up to this distance
  static constexpr double shadow_px = 9;              // width of the strip without depth at an edge
  static constexpr double min_kept = 300;             // features: with fewer, hosts lose the track
  static constexpr double sure_px = 4, sure_m = 0.1;  // from a fresh mask, or the object's depth
  static constexpr double sparse_width = 0.75;        // of the half width: features show no steps
  static constexpr double sparse_px = 60;             // distance of features that vote, and …
  static constexpr double doubt_px = 24;              // … of one imagined vote against the object
  static constexpr double min_votes = 0.9;            // share of the object's

  struct Object {
    std::size_t k;  // index of the instance
    const Instance* instance;
    cv::Rect masked;        // part of the image that the mask spans
    cv::Rect reach = {};    // where the object may be
    cv::Rect sources = {};  // where the flood starts, if not on the mask
    double depth_m = 0;
    double margin_px = 0;  // beside the mask
    int shift_px = 0;      // of the depth image to the right of the mask
  };

  enum Owner { nobody, surroundings, an_object };

  struct Cell {
    double depth_m = 0;
    double step_m = -1;  // largest on the way from a source; -1: a source, or no depth
    Owner owner = nobody;
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
    Surfaces(const DepthCompensatorOptions& options, const FilterInput& input, Scratch& scratch)
        : options_(options), input_(input), features_(input.index), scratch_(scratch) {
      // All memory that frames of this size may need, whether or not this one does.
      const auto places = [](int length, int step) {
        return static_cast<std::size_t>(length / step + 1);
      };
      const int step = scaled(sample_px), row_step = scaled(gap_reach_px / 3);
      scratch.objects.clear();
      scratch.objects.reserve(input.segmentation.instances.size());
      scratch.verdicts.reserve(features_.size());
      scratch.depths_m.reserve(features_.size() +
                               places(size_.width, step) * places(size_.height, step));
      for (auto& gaps_px : scratch.gaps_px) gaps_px.reserve(places(size_.height, row_step));
      scratch.cells.reserve(lay_grid(min_cell_px * scale_));
    }

    /// Adds an instance to the objects if its depth is known.
    void add(std::size_t k, InstanceStatistics& statistics) {
      const Instance& instance = input_.segmentation.instances[k];
      const cv::Rect masked = {instance.mask_origin, instance.mask.size()};
      Object object = {k, &instance, detail::clip(masked, size_)};
      statistics.mask_gap_places = 0;
      if (find_depth(object, statistics.sampled) && find_reach(object, statistics)) {
        statistics.compensation = applied_;
        statistics.depth_range_m = {object.depth_m - half_m_, object.depth_m + half_m_};
        scratch_.objects.push_back(object);
      } else {
        statistics.compensation = has_image_ || input_.features.has_depths()
                                      ? Compensation::too_few_samples
                                      : Compensation::no_depth_image;
      }
    }

    /// Divides the surfaces between objects and surroundings, on a coarse grid: the watershed (F.
    /// Meyer, "Topographic distance and watershed lines", Signal Processing 38, 1994). The flood
    /// starts on the masks and outside what the objects reach, and takes the smallest step of depth
    /// first. Returns false if there are no objects.
    bool flood() {
      if (scratch_.objects.empty()) return false;
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
      for (int y = area.y / cell_ * cell_ + cell_ / 2; y < area.br().y; y += cell_) {
        for (int x = area.x / cell_ * cell_ + cell_ / 2; x < area.br().x; x += cell_) {
          const double depth_m = depth_at({x, y});
          if (depth_m == 0) continue;
          const Owner owner = owner_at({x, y}, depth_m);
          const double step_m = owner == nobody ? std::numeric_limits<double>::infinity() : -1;
          scratch_.cells[cell_at({x, y})] = {depth_m, step_m, owner};
        }
      }
      const std::size_t first = cell_at(area.tl()), end = cell_at(area.br()) + 1;
      for (int round = 0; round < 2; ++round) {
        for (std::size_t i = first; i < end; ++i) spread_to(i, -1);
        for (std::size_t i = end; i-- > first;) spread_to(i, 1);
      }
      return true;
    }

    /// Judges the features, and writes the labels. Hosts lose the camera by too few features sooner
    /// than by some moving ones: where few would be left, only what is sure is removed.
    void judge(FeatureLabels& labels) {
      std::vector<Verdict>& verdicts = scratch_.verdicts;
      verdicts.assign(labels.size(), Verdict());
      for (const Object& object : scratch_.objects) {
        for (const std::size_t i : features_.inside(object.reach)) {
          const bool may_return = is_stale_ && labels[i].reason == Reason::in_mask;
          if (verdicts[i].certainty >= 0.5 || (labels.is_removed(i) && !may_return)) continue;
          const double certainty = certainty_at(object, features_.pixel(i), depth_of(object, i));
          if (certainty > verdicts[i].certainty) verdicts[i] = {certainty, &object};
        }
      }
      std::size_t kept = 0;
      for (std::size_t i = 0; i < labels.size(); ++i) {
        if (verdicts[i].certainty >= 0.5) continue;
        if (is_on_stale_mask(labels, i)) labels.restore(i, 0);
        kept += labels.is_removed(i) ? 0 : 1;
      }
      const double all = static_cast<double>(labels.size()), share = options_.min_kept_share;
      const double wanted = std::max(share * all, std::min(min_kept, all / 2));
      const bool is_cautious = share > 0 && static_cast<double>(kept) < wanted;
      const auto enough = static_cast<std::size_t>(std::ceil(std::max(wanted, all / 2)));
      const double near_m = is_cautious ? be_cautious(labels, enough - kept) : 0;
      for (std::size_t i = 0; i < labels.size(); ++i) {
        const auto [certainty, object] = verdicts[i];
        if (object == nullptr || labels.is_removed(i)) continue;
        const auto k = static_cast<std::int32_t>(object->k);
        const float score = static_cast<float>(certainty) * object->instance->score;
        if (certainty >= 0.5 &&
            (!is_cautious || distance_m(*object, i) < near_m || is_sure(*object, i))) {
          labels.remove(i, k, Reason::compensated, score);
        } else {
          labels.suspect(i, k, score);
        }
      }
    }

    /// Returns instance k with the mask of what belongs to it: its fresh mask, and the pixels whose
    /// surface, or whose own depth, which may be shifted, is the object's.
    Instance refined(std::size_t k) const {
      Instance instance = input_.segmentation.instances[k];
      for (const Object& object : scratch_.objects) {
        if (object.k != k) continue;
        const cv::Rect area = is_stale_ ? object.reach : object.reach | object.masked;
        instance.mask = cv::Mat(area.size(), CV_8UC1, cv::Scalar(0));
        instance.mask_origin = area.tl();
        for (cv::Point at = area.tl(); at.y < area.br().y; ++at.y) {
          for (at.x = area.x; at.x < area.br().x; ++at.x) {
            const double depth_m = depth_at(place_of(object, at));
            const bool is_objects =
                (!is_stale_ && object.instance->covers(at)) ||
                (object.reach.contains(at) &&
                 (owns(object, at, depth_at(at)) || certainty_at(object, at, depth_m) >= 0.5));
            instance.mask.at<std::uint8_t>(at - area.tl()) = is_objects ? 255 : 0;
          }
        }
      }
      return instance;
    }

   private:
    double distance_m(const Object& object, std::size_t feature) const {
      const double depth_m = depth_of(object, feature);
      return depth_m > 0 ? std::abs(depth_m - object.depth_m) : HUGE_VAL;
    }

    /// Says so, and returns how near in depth features go, so that `count` not sure ones stay.
    double be_cautious(FeatureLabels& labels, std::size_t count) {
      std::vector<double>& unsure_m = scratch_.depths_m;
      unsure_m.clear();
      unsure_m.reserve(labels.size());
      for (std::size_t i = 0; i < labels.size(); ++i) {
        const auto [certainty, object] = scratch_.verdicts[i];
        if (certainty < 0.5 || labels.is_removed(i) || is_sure(*object, i)) continue;
        unsure_m.push_back(distance_m(*object, i));
      }
      for (const Object& object : scratch_.objects) {
        labels.statistics().instances[object.k].compensation = Compensation::cautious;
      }
      if (unsure_m.size() <= count) return 0;
      const auto farthest = unsure_m.end() - static_cast<std::ptrdiff_t>(count);
      std::nth_element(unsure_m.begin(), farthest, unsure_m.end());
      return *farthest;
    }

    int scaled(double length_px) const {
      return std::max(1, static_cast<int>(std::lround(length_px * scale_)));
    }

    /// Returns the depth at a pixel; 0 where it is unknown and outside the image.
    double depth_at(cv::Point pixel) const {
      const auto x = static_cast<unsigned>(pixel.x), y = static_cast<unsigned>(pixel.y);
      if (x >= columns_ || y >= rows_) return 0;  // negative ones wrap
      const unsigned char* const row = pixels_ + y * row_bytes_;
      const double units = is_16_bit_ ? reinterpret_cast<const std::uint16_t*>(row)[x]
                                      : double{reinterpret_cast<const float*>(row)[x]};
      const double depth_m = units * unit_m_;
      return depth_m > 0 && depth_m <= std::numeric_limits<double>::max() ? depth_m : 0;
    }

    /// Returns the depth of a feature; 0 if it is unknown.
    double depth_of(const Object& object, std::size_t feature) const {
      return has_image_ ? depth_at(place_of(object, features_.pixel(feature)))
                        : input_.features.depth_m(feature).value_or(0);
    }

    bool is_near(const Object& object, double depth_m) const {
      return depth_m > 0 && std::abs(depth_m - object.depth_m) <= half_m_;
    }

    /// Finds the depth of the nearest cluster on the mask; if there is none, in the middle of the
    /// box, which an object fills wherever its limbs are. Returns whether there is one.
    bool find_depth(Object& object, std::size_t& samples) {
      if (object.instance->box.empty()) return false;
      const std::size_t places = read_depths(object.masked, object.instance);
      samples = scratch_.depths_m.size();
      if (find_cluster(has_image_ ? min_share : min_box_share, object.depth_m)) return true;
      // Many features on the mask without any depth: those in the box are of what is behind it.
      if (!has_image_ && samples == 0 && places >= 3 * min_samples) return false;
      const cv::Rect box = detail::clip(object.instance->box, size_);
      object.sources = {box.x + box.width / 4, box.y + box.height / 5, box.width / 2,
                        box.height * 3 / 5};
      read_depths(object.sources, nullptr);
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
      const double wanted =
          std::max(min_samples / 2.0, share * static_cast<double>(depths_m.size()));
      auto first = depths_m.begin(), end = first;
      for (;; ++first) {
        end = std::upper_bound(end, depths_m.end(), *first + 2 * half_m_);
        if (static_cast<double>(end - first) >= wanted) break;
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

    /// Finds where the object may be, and its margin. Returns false if it has left its stale mask
    /// and is not beside it: hardly anything around lies behind its depth, as behind a wall.
    bool find_reach(Object& object, InstanceStatistics& statistics) {
      object.margin_px = options_.mask_margin_px * scale_;
      const double moved_px = options_.motion_px_per_s * age_s_ * scale_;
      double growth_px =
          std::min({moved_px, max_growth * object.instance->box.width, 1.0 * size_.width});
      if (has_image_ && measure_gaps(object, growth_px, statistics) && is_stale_) {
        growth_px = std::min(growth_px, moved_px / 2 + 2 * std::abs(object.shift_px));
      }
      const double margin_px = box_margin_px * scale_;
      object.reach = detail::clip_grown(object.instance->box, std::lround(margin_px + growth_px),
                                        std::lround(margin_px + growth_px / 2), size_);
      if (!is_stale_ || !has_image_) return true;
      read_depths(object.reach, nullptr);
      const auto is_background = [&] {
        const auto behind =
            std::count_if(scratch_.depths_m.begin(), scratch_.depths_m.end(),
                          [&](double depth_m) { return depth_m > object.depth_m + half_m_; });
        return static_cast<double>(behind) <
               min_behind * static_cast<double>(scratch_.depths_m.size());
      };
      if (!is_background()) return true;
      object.sources = object.reach;
      return find_cluster(min_box_share, object.depth_m) && !is_background();
    }

    /// Measures in some rows how far the object's depth goes on beyond its mask. The mean of left
    /// and right is the mask's gap, half the difference the shift of depth against the mask, which
    /// is out of step or stale. Returns whether there were enough rows.
    bool measure_gaps(Object& object, double growth_px, InstanceStatistics& statistics) {
      const Instance& instance = *object.instance;
      const cv::Rect& masked = object.masked;
      const int step = scaled(gap_reach_px / 3);
      const int reach = scaled(gap_reach_px) + static_cast<int>(growth_px);
      auto& [lefts, rights] = scratch_.gaps_px;
      lefts.clear();
      rights.clear();
      for (int y = masked.y + step / 2; y < masked.br().y; y += step) {
        const auto* const row = instance.mask.ptr<std::uint8_t>(y - instance.mask_origin.y) +
                                (masked.x - instance.mask_origin.x);
        const auto first = detail::find_mask_pixel(row, row + masked.width) - row;
        auto last = std::ptrdiff_t{masked.width} - 1;
        while (last >= first && row[last] == 0) --last;
        if (last < first) continue;
        const int left = masked.x + static_cast<int>(first);
        const int right = masked.x + static_cast<int>(last);
        measure_gap(object, {left, y}, -1, reach, right - left, lefts);
        measure_gap(object, {right, y}, 1, reach, right - left, rights);
      }
      if (std::min(lefts.size(), rights.size()) < min_samples / 2) return false;
      std::sort(lefts.begin(), lefts.end());
      std::sort(rights.begin(), rights.end());
      const double left = lefts[lefts.size() / 2], right = rights[rights.size() / 2];
      const double gap = (left + right) / 2, shift = (right - left) / 2;
      const double max_gap = max_gap_px * scale_;
      const bool is_shifted = std::abs(shift) >= min_shift_px * scale_;
      object.shift_px = is_shifted ? static_cast<int>(std::lround(shift)) : 0;
      if (is_stale_) return true;
      object.margin_px += std::clamp(gap + std::abs(shift) / 2, 0.0, max_gap);
      statistics.mask_gap_px = std::clamp(gap, 0.0, max_gap);
      statistics.depth_shift_px = object.shift_px;
      statistics.mask_gap_places = lefts.size() + rights.size();
      return true;
    }

    /// Walks from an edge of a mask to where the object's depth ends, over holes of two pixels, or
    /// back to where it begins. Adds the distance unless there is no end within reach.
    void measure_gap(const Object& object, cv::Point edge, int way, int reach, int run,
                     std::vector<int>& gaps_px) const {
      const int room = way < 0 ? edge.x : size_.width - 1 - edge.x;
      const auto is_objects = [&](int distance) {
        return is_near(object, depth_at({edge.x + way * distance, edge.y}));
      };
      int last = 0;
      while (last >= -std::min(reach, run) && !is_objects(last)) --last;
      if (room == 0 || last < -std::min(reach, run)) return;
      for (int next = 1; last >= 0 && next <= last + 3; ++next) {
        if (next > std::min(reach, room)) return;
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

    /// Returns whose source a place is.
    Owner owner_at(cv::Point place, double depth_m) const {
      bool is_in_reach = false;
      for (const Object& object : scratch_.objects) {
        const bool is_source = object.sources.empty()
                                   ? object.instance->covers({place.x - object.shift_px, place.y})
                                   : object.sources.contains(place);
        if (is_source && is_near(object, depth_m)) return an_object;
        is_in_reach = is_in_reach || object.reach.contains(place);
      }
      return is_in_reach ? nobody : surroundings;
    }

    /// Floods a cell from its four neighbours before or after it. At equal steps objects win.
    void spread_to(std::size_t i, int way) {
      Cell& cell = scratch_.cells[i];
      if (cell.step_m < 0) return;
      for (const int offset : {1, stride_ - 1, stride_, stride_ + 1}) {
        const Cell& from = (&cell)[way * offset];
        const double step_m = std::max(from.step_m, std::abs(cell.depth_m - from.depth_m));
        if (from.owner == nobody || step_m > max_step_m || step_m > cell.step_m) continue;
        if (step_m == cell.step_m && from.owner <= cell.owner) continue;
        cell.step_m = step_m;
        cell.owner = from.owner;
      }
    }

    /// Whether the surface at a place of the depth image belongs to an object:
    ///
    ///     step to the object - step to the surroundings <= 1/4 (half_width_m - |z - m|).
    ///
    /// So what lies at the object's depth m needs good reasons to be surroundings, and what lies
    /// before or behind needs good reasons to be the object. Without an image, depth z alone
    /// decides.
    bool owns(const Object& object, cv::Point place, double depth_m) const {
      const double needed = step_per_depth * (half_m_ - std::abs(depth_m - object.depth_m));
      if (!(depth_m > 0) || needed < -max_step_m) return false;
      double steps_m[] = {max_step_m, max_step_m, max_step_m};  // to each owner
      const Cell* const middle = &scratch_.cells[cell_at(place)];
      for (const int row : {-stride_, 0, stride_}) {
        for (const Cell* cell = middle + row - 1; cell <= middle + row + 1; ++cell) {
          const double step_m = std::max(cell->step_m, std::abs(depth_m - cell->depth_m));
          steps_m[cell->owner] = std::min(steps_m[cell->owner], step_m);
        }
      }
      return steps_m[an_object] - steps_m[surroundings] <= needed;
    }

    /// Returns the place in the depth image of what the image shows at a pixel. A stale mask is
    /// what moved, not the depth.
    cv::Point place_of(const Object& object, cv::Point pixel) const {
      const int shift_px = is_stale_ ? 0 : object.shift_px;
      return {std::clamp(pixel.x + shift_px, 0, size_.width - 1), pixel.y};
    }

    /// Whether a pixel lies this close to a fresh mask.
    bool is_beside_mask(const Object& object, cv::Point pixel, double margin_px) const {
      return !is_stale_ && detail::mask_within(*object.instance, pixel, margin_px);
    }

    /// Returns the certainty that a pixel of that depth belongs to the object.
    double certainty_at(const Object& object, cv::Point pixel, double depth_m) const {
      const cv::Point place = place_of(object, pixel);
      if (owns(object, place, depth_m) || is_beside_mask(object, pixel, object.margin_px)) return 1;
      if (depth_m > 0 && (!has_image_ || depth_m < object.depth_m + half_m_)) return 0;
      if (!has_image_) return certainty_by_votes(object, pixel);
      const double nearness = nearness_at(object, place);
      const double shadow_end_px = object.margin_px + shadow_px * scale_;
      const bool is_in_shadow =
          nearness >= min_nearness && is_beside_mask(object, pixel, shadow_end_px);
      const double needed = is_in_shadow ? 2 * min_nearness : min_nearness;
      return nearness < needed ? nearness / needed / 2 : std::min(1.0, 0.5 + nearness / 8);
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
    double certainty_by_votes(const Object& object, cv::Point pixel) const {
      constexpr double vote = 1LL << 32;
      const double reach = sparse_px * scale_, doubt = doubt_px * scale_;
      double objects = 0, all = std::floor(vote / (doubt * doubt));
      const cv::Rect square(pixel, cv::Size(1, 1));
      for (const std::size_t i : features_.inside(detail::bounds_of(square, std::lround(reach)))) {
        const auto depth_m = input_.features.depth_m(i);
        const cv::Point apart = features_.pixel(i) - pixel;
        const double squared = std::max(1.0, apart.ddot(apart));
        if (!depth_m || squared > reach * reach) continue;
        all += std::floor(vote / squared);
        objects += is_near(object, *depth_m) ? std::floor(vote / squared) : 0;
      }
      const double share = objects / all;
      return share < min_votes ? share / min_votes / 2 : std::max(0.5, share);
    }

    /// Whether a feature that belongs to the object surely does.
    bool is_sure(const Object& object, std::size_t feature) const {
      return distance_m(object, feature) <= sure_m ||
             is_beside_mask(object, features_.pixel(feature), sure_px * scale_);
    }

    /// Whether a feature lies on the stale mask of an object. One whose depth is not known keeps
    /// it.
    bool is_on_stale_mask(const FeatureLabels& labels, std::size_t i) const {
      const FeatureLabel& label = labels[i];
      if (!is_stale_ || label.reason != Reason::in_mask || label.instance < 0) return false;
      const auto k = static_cast<std::size_t>(label.instance);
      return label.removed && labels.statistics().instances[k].compensation == applied_;
    }

    const DepthCompensatorOptions& options_;
    const FilterInput& input_;
    const FrameFeatures& features_;
    Scratch& scratch_;
    const cv::Mat& depth_ = input_.frame.depth;
    const unsigned char* const pixels_ = depth_.data;
    const std::size_t row_bytes_ = depth_.empty() ? 0 : depth_.step[0];
    const unsigned columns_ = static_cast<unsigned>(depth_.cols);
    const unsigned rows_ = static_cast<unsigned>(depth_.rows);
    const bool has_image_ = !depth_.empty(), is_16_bit_ = depth_.type() == CV_16UC1;
    const double unit_m_ = input_.frame.depth_scale();
    const Compensation applied_ =
        has_image_ ? Compensation::applied : Compensation::applied_without_image;
    const double half_m_ = options_.half_width_m * (has_image_ ? 1 : sparse_width);
    const cv::Size size_ = input_.segmentation.image_size;
    const double scale_ = detail::pixel_scale(size_);
    const double since_s_ = std::abs(input_.frame.timestamp_s - input_.segmentation.timestamp_s);
    const double age_s_ = since_s_ > max_age_s ? 0 : since_s_;
    const bool is_stale_ = age_s_ > options_.stale_age_s;
    int cell_ = 1, stride_ = 2;  // width of the cells; number in a row
  };

  DepthCompensatorOptions options_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_COMPENSATOR_HPP
