// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_object.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/workspace.hpp"
#include "plugin/row_search.hpp"

namespace dynfilter {

/// Rectified pair of images: a point has the same row in both.
struct StereoPair {
  cv::Mat left;   ///< CV_8UC1; the features are its pixels
  cv::Mat right;  ///< CV_8UC1, of the same size
  /// Focal length times baseline, above 0, pixels times metres: ORB-SLAM's Camera.bf.
  double focal_baseline = 0;
};

/// Finds the depths of features in a rectified pair of images, for frames without a depth image:
/// hosts match few features. A feature is matched with the place in its row of the right image
/// whose patch differs least (detail::RowSearch), if the patches are similar, if no other place is,
/// and if the search back from there leads to the feature. One without a match gets the depth of
/// the farthest surface around if a nearer one to its right can hide it in the right image (H.
/// Hirschmüller, Stereo Processing by Semiglobal Matching and Mutual Information, PAMI 2008,
/// section 2.5.3). Others stay unknown, near things at the left edge among them. Where the baseline
/// is wide for the distance (0.54 m at 1.5 m), or rows are half a pixel out of step, few find a
/// match.
class StereoDepths {
 public:
  /// Takes the nearest depth that is looked for, metres, above 0; it decides the time.
  explicit StereoDepths(double min_depth_m = 0.8) : min_depth_m_(min_depth_m) {}

  /// Largest difference of two patches that match, relative to the contrast of the left one.
  static constexpr double max_difference = 0.5;
  /// Factor by which every other place in the row must differ more than the match.
  static constexpr double min_distinction = 1.15;
  /// Search distance for the farthest surface around a hidden feature, pixels of an image 640
  /// pixels wide, as the lengths below.
  static constexpr double background_reach_px = 140;
  /// Search distance for the surface that hides it, in rows up and down.
  static constexpr double hider_reach_px = 30;
  /// Largest width of the strip that a surface is taken to hide beside itself.
  static constexpr double max_hidden_px = 60;
  /// Smallest share of the features that find a match, of those that are looked for, at which
  /// others may be hidden. Where fewer do, the images differ too much for a missing match to say
  /// anything: the baseline is wide for the distance, or rows are out of step.
  static constexpr double min_matched_share = 0.5;

  /// Finds the depths of the features in some areas of the left image, metres, and writes them to
  /// the column, where 0 is unknown. `depths_m` has one depth for each feature; those of features
  /// outside the areas stay as they are. What is known there before does not count. O(features in
  /// the areas * disparity at min_depth_m in pixels).
  void find(const StereoPair& pair, FeaturesView features, const std::vector<cv::Rect>& areas,
            std::vector<float>& depths_m, Workspace& workspace) const {
    Scratch& scratch = workspace.get<Scratch>();
    const FrameFeatures& pixels = scratch.pixels;
    scratch.prepare(features, pair.left.cols);
    for (const cv::Rect& area : areas) {
      for (const std::size_t i : pixels.inside(detail::bounds_of(area))) {
        if (scratch.found[i] != Found::nothing_yet) continue;
        match(pair, pixels.pixel(i), i, scratch);
      }
    }
    const bool may_be_hidden = scratch.matched_share() >= min_matched_share;
    for (std::size_t i = 0; i < depths_m.size(); ++i) {
      if (scratch.found[i] == Found::nothing_yet) continue;
      const double disparity_px = scratch.found[i] == Found::no_match && may_be_hidden
                                      ? disparity_behind(pair, i, pixels, scratch)
                                      : double{scratch.disparities_px[i]};
      depths_m[i] = disparity_px > 0 ? static_cast<float>(pair.focal_baseline / disparity_px) : 0.F;
    }
  }

 private:
  /// What the search for a feature's match gave.
  enum class Found : std::uint8_t {
    nothing_yet,  // not searched: it is in no area
    no_place,     // its patch, or the places of its match, are outside the images
    no_match,
    match
  };

  struct Scratch {
    std::vector<Found> found;           // for each feature
    std::vector<float> disparities_px;  // of the matches; 0: none
    FrameFeatures pixels;
    detail::RowSearch search;

    void prepare(const FeaturesView& features, int width) {
      found.assign(features.size(), Found::nothing_yet);
      disparities_px.assign(features.size(), 0.0F);
      pixels.read(features);
      search.reserve(width);
    }

    /// Returns the share of the features with a match in those that could have one.
    double matched_share() const {
      const auto matches = std::count(found.begin(), found.end(), Found::match);
      const auto others = std::count(found.begin(), found.end(), Found::no_match);
      const auto all = std::max<std::ptrdiff_t>(1, matches + others);
      return static_cast<double>(matches) / static_cast<double>(all);
    }
  };

  /// Looks for the feature's match in the right image.
  void match(const StereoPair& pair, cv::Point pixel, std::size_t feature, Scratch& scratch) const {
    constexpr double noise = detail::RowSearch::area;  // a grey level a pixel
    constexpr double max_way_px = 1.5;                 // between a feature and the way back to it
    Found& found = scratch.found[feature];
    found = Found::no_place;
    if (!detail::RowSearch::fits(pair.left, pixel)) return;
    const double max_px = pair.focal_baseline / min_depth_m_;
    const int reach = static_cast<int>(std::min<double>(max_px, pair.left.cols));
    const int last_x = pixel.x + 1;  // so that a match at infinity has neighbours
    if (last_x - std::max(pixel.x - reach, detail::RowSearch::radius) < min_places) return;
    found = Found::no_match;
    const auto there =
        scratch.search.find(pair.left, pixel, pair.right, pixel.x - reach, last_x, min_distinction);
    if (!there) return;
    const int contrast = detail::RowSearch::contrast(pair.left, pixel);
    if (there->difference > max_difference * contrast + noise) return;
    const cv::Point place(cvRound(there->x), pixel.y);
    const auto back =
        scratch.search.find(pair.right, place, pair.left, place.x - 1, place.x + reach, 0);
    const double disparity_px = pixel.x - there->x;
    if (!back || std::abs(back->x - place.x - disparity_px) > max_way_px) return;
    found = Found::match;
    scratch.disparities_px[feature] = static_cast<float>(std::max(disparity_px, min_disparity_px));
  }

  /// Returns the disparity of the farthest surface around an unmatched feature if a nearer one
  /// hides it in the right image; otherwise 0.
  static double disparity_behind(const StereoPair& pair, std::size_t feature,
                                 const FrameFeatures& pixels, const Scratch& scratch) {
    const double scale = detail::pixel_scale(pair.left.size());
    const cv::Point pixel = pixels.pixel(feature);
    const double reach_px = background_reach_px * scale;
    double farthest_px = std::numeric_limits<double>::max();
    for (const std::size_t i : pixels.inside(around(pixel, reach_px))) {
      const double disparity_px = double{scratch.disparities_px[i]};
      const cv::Point way = pixels.pixel(i) - pixel;
      const bool is_near = std::hypot(way.x, way.y) <= reach_px;
      if (disparity_px > 0 && is_near) farthest_px = std::min(farthest_px, disparity_px);
    }
    const double max_px = max_hidden_px * scale;
    const double rows = hider_reach_px * scale;
    for (const std::size_t i : pixels.inside(around(pixel, max_px + detail::RowSearch::radius))) {
      const double disparity_px = double{scratch.disparities_px[i]};
      const double hidden_px = disparity_px - farthest_px;  // width of the strip beside the surface
      const cv::Point way = pixels.pixel(i) - pixel;
      const bool is_hider = hidden_px >= min_hidden_px && hidden_px <= max_px && way.x > 0 &&
                            way.x <= hidden_px + detail::RowSearch::radius &&
                            std::abs(way.y) <= rows &&
                            pixel.x - disparity_px >= detail::RowSearch::radius;
      if (is_hider) return farthest_px;
    }
    return 0;
  }

  /// Square around a pixel.
  static detail::PixelBounds around(cv::Point pixel, double reach_px) {
    return detail::bounds_of({pixel, cv::Size(1, 1)}, static_cast<std::int64_t>(reach_px));
  }

  static constexpr int min_places = 4;
  static constexpr double min_disparity_px = 0.25;  // of things far away
  static constexpr double min_hidden_px = 2;

  double min_depth_m_;
};

/// Finds where the depths of features matter to DepthCompensator: around the boxes of dynamic
/// objects, as far as these may have moved and as it looks for other features. Frame and
/// segmentation must be valid. Overwrites `areas`. O(instances).
inline void stereo_areas(const FrameView& frame, const Segmentation& segmentation,
                         const MaskCuller& culler, std::vector<cv::Rect>& areas) {
  const cv::Size size = segmentation.image_size;
  constexpr double votes_px = 70;  // of DepthCompensator, rounded up
  const double age_s = std::abs(segmentation.age_s(frame.timestamp_s).value_or(0));
  const double moved_px = age_s * detail::DepthRuleFrame::motion_px_per_s;
  const auto margin = static_cast<std::int64_t>(
      std::min(std::ceil((votes_px + moved_px) * detail::pixel_scale(size)),
               static_cast<double>(size.width + size.height)));
  areas.clear();
  for (const Instance& instance : segmentation.instances) {
    if (!culler.is_dynamic(instance.class_id)) continue;
    areas.push_back(detail::clip_grown(instance.box, margin, margin, size));
  }
}

}  // namespace dynfilter
