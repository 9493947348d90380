// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "scene_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "lab/odometry/orb_extractor.hpp"
#include "progress_bar.hpp"
#include "scene_measures.hpp"
#include "tracking_residual.hpp"

namespace dynfilter::tools {
namespace {

constexpr std::array<int, 4> zone_ends_px = {2, 5, 10, 20};
constexpr std::array<int, 4> side_ends_px = {3, 6, 12, 25};
constexpr int edge_reach_px = 15;  // search range for the depth edge, from the mask's border

/// Returns the zone of a distance, or the number of zones beyond the last.
std::size_t zone_of(const std::array<int, 4>& ends_px, double distance) {
  return static_cast<std::size_t>(
      std::lower_bound(ends_px.begin(), ends_px.end(), std::ceil(distance - 0.5)) -
      ends_px.begin());
}

std::string percent(std::uint64_t part, std::uint64_t all) {
  if (all == 0) return "    -";
  char text[32];
  std::snprintf(text, sizeof text, "%5.1f",
                100.0 * static_cast<double>(part) / static_cast<double>(all));
  return text;
}

std::string quartiles(std::vector<int> values) {
  if (values.empty()) return "-";
  std::sort(values.begin(), values.end());
  std::string text;
  for (const std::size_t twentieth : {1U, 5U, 10U, 15U, 19U}) {
    char one[16];
    std::snprintf(one, sizeof one, "%5d", values[(values.size() - 1) * twentieth / 20]);
    text += one;
  }
  return text;
}

}  // namespace

void DepthStatistics::add(const cv::Mat1w& depth, const Segmentation& segmentation) {
  for (const std::uint16_t value : depth) image_.count(value == 0);
  add_codes(depth);
  const cv::Mat1b persons = persons_of(segmentation, depth.size());
  if (cv::countNonZero(persons) == 0) return;
  add_zones(depth, persons);
  add_sides(depth, persons);
  add_edges(depth, persons, segmentation);
}

void DepthStatistics::add_codes(const cv::Mat1w& depth) {
  for (int y = 1; y + 1 < depth.rows; ++y) {
    for (int x = 1; x + 1 < depth.cols; ++x) {
      if (depth(y, x) == 0) continue;
      bool deeper = false;
      for (int i = 0; i < 9 && !deeper; ++i) {
        deeper = depth(y + i / 3 - 1, x + i % 3 - 1) > depth(y, x);
      }
      codes_.count(!deeper);
    }
  }
}

void DepthStatistics::add_zones(const cv::Mat1w& depth, const cv::Mat1b& persons) {
  cv::Mat1f within, beyond;
  cv::distanceTransform(persons, within, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(~persons, beyond, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const bool inside = persons(y, x) != 0;
      const bool empty = depth(y, x) == 0;
      const auto distance = static_cast<double>(inside ? within(y, x) : beyond(y, x));
      const std::size_t zone = zone_of(zone_ends_px, distance);
      if (inside) persons_.count(empty);
      if (zone < zones) (inside ? inside_ : outside_)[zone].count(empty);
    }
  }
}

void DepthStatistics::add_sides(const cv::Mat1w& depth, const cv::Mat1b& persons) {
  for (int y = 0; y < depth.rows; ++y) {
    for (const int step : {-1, 1}) {
      // From the last pixel of a person that the scan passed.
      int distance = side_ends_px.back() + 1;
      const int first = step < 0 ? depth.cols - 1 : 0;
      for (int x = first; x >= 0 && x < depth.cols; x += step) {
        distance = persons(y, x) != 0 ? 0 : distance + 1;
        const std::size_t zone = zone_of(side_ends_px, distance);
        if (distance == 0 || zone >= zones) continue;
        beside_[step < 0 ? 0 : 1][zone].count(depth(y, x) == 0);
      }
    }
  }
}

void DepthStatistics::add_edges(const cv::Mat1w& depth, const cv::Mat1b& persons,
                                const Segmentation& found) {
  for (const Instance& instance : found.instances) {
    if (instance.class_id != 0) continue;
    const std::optional<cv::Range> range = depth_range(depth, instance);
    if (!range) continue;
    const auto is_body = [&](int y, int x) {
      return depth(y, x) >= range->start && depth(y, x) <= range->end;
    };
    const cv::Rect place =
        cv::Rect(instance.mask_origin, instance.mask.size()) & cv::Rect({0, 0}, depth.size());
    for (int y = place.y; y < place.br().y; ++y) {
      const std::uint8_t* row = instance.mask.ptr(y - instance.mask_origin.y);
      for (const int step : {-1, 1}) {
        int border = step < 0 ? place.x : place.br().x - 1;
        while (border >= place.x && border < place.br().x &&
               row[border - instance.mask_origin.x] == 0) {
          border -= step;
        }
        const int start = border - step * edge_reach_px;
        const int end = border + step * edge_reach_px;
        if (std::min(start, end) < 0 || std::max(start, end) >= depth.cols) continue;
        if (border < place.x || border >= place.br().x) continue;
        if (persons(y, border + step) != 0 || persons(y, start) == 0 || !is_body(y, start))
          continue;
        int last = start;
        for (int x = start; x != end + step; x += step) {
          if (is_body(y, x)) last = x;
        }
        edge_offsets_px_[step < 0 ? 0 : 1].push_back((last - border) * step);
      }
    }
  }
}

std::string DepthStatistics::text() const {
  const auto line = [](const char* name, const std::array<Share, zones>& shares) {
    std::string text = name;
    for (const Share& share : shares) text += "  " + percent(share.part, share.all);
    return text + "\n";
  };
  return "depth missing, % of the image               " + percent(image_.part, image_.all) +
         "\n"
         "depth missing, % of the masks               " +
         percent(persons_.part, persons_.all) +
         "\n"
         "D-LBP code 0, % of pixels with depth        " +
         percent(codes_.part, codes_.all) +
         "\n"
         "depth missing, % at a distance of             1-2    3-5   6-10  11-20 px\n" +
         line("  inside the masks                       ", inside_) +
         line("  outside                                ", outside_) +
         "depth missing, % along rows at                1-3    4-6   7-12  13-25 px\n" +
         line("  left of the masks                      ", beside_[0]) +
         line("  right of them                          ", beside_[1]) +
         "last pixel of the body's depth beyond the mask's border, px (5 25 50 75 95 %)\n"
         "  left                                   " +
         quartiles(edge_offsets_px_[0]) +
         "\n"
         "  right                                  " +
         quartiles(edge_offsets_px_[1]) + "\n";
}

namespace {

/// Returns the pose of this time, to 1 ms.
std::optional<WorldPose> pose_at(const std::optional<Trajectory>& trajectory, double timestamp_s) {
  if (!trajectory) return std::nullopt;
  const auto at =
      std::lower_bound(trajectory->begin(), trajectory->end(), timestamp_s - 0.001,
                       [](const TimedPose& pose, double time) { return pose.timestamp_s < time; });
  if (at == trajectory->end() || at->timestamp_s > timestamp_s + 0.001) return std::nullopt;
  WorldPose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      pose.rotation(row, column) = at->rotation(row, column);
    pose.translation[row] = at->translation(row);
  }
  return pose;
}

/// Measures everything that depends on one source of masks.
struct MaskStatistics {
  DepthStatistics depth;
  DepthLateness lateness;
  StaticAtPersonsDepth static_at_depth;
  TrackingResidual residual;

  explicit MaskStatistics(const CameraParameters& camera) : residual(camera) {}

  void add(const FrameView& frame, double units_per_metre, const Segmentation& masks,
           const std::vector<cv::KeyPoint>& keypoints, const std::optional<WorldPose>& pose) {
    depth.add(frame.depth, masks);
    residual.add(frame, masks, keypoints, pose);
    lateness.add(frame.depth, masks);
    static_at_depth.add(frame.depth, units_per_metre, masks, keypoints);
  }

  std::string text() const {
    const std::optional<double> late = lateness.frames();
    char late_text[32] = "    -";
    if (late) std::snprintf(late_text, sizeof late_text, "%5.2f", *late);
    return depth.text() + "depth is older than the masks by, frames     " + late_text +
           "\nstatic features a frame: all, in boxes, of these within 0.10 and 0.30 m of the "
           "person's\ndepth, and % of those in boxes\n" +
           static_at_depth.text() + residual.text();
  }
};

}  // namespace

std::string scene_statistics(FrameSource& source, const std::string& name) {
  if (!source.has_depth()) throw std::runtime_error(name + ": has no depth images");
  const odometry::OrbExtractor orb(1000);
  const double units_per_metre = source.camera().depth_units_per_metre;
  MaskStatistics found(source.camera()), truth(source.camera());
  const std::optional<Trajectory> trajectory = source.true_trajectory();
  bool has_masks = false, has_truth = false;
  ProgressBar progress("reading", source.size());
  for (std::size_t i = 0; i < source.size(); ++i) {
    const SourceFrame frame = source.read(i);
    progress.advance();
    if (frame.frame.depth.type() != CV_16UC1) continue;
    cv::Mat grey, descriptors;
    cv::cvtColor(frame.frame.image, grey, cv::COLOR_BGR2GRAY);
    std::vector<cv::KeyPoint> keypoints;
    orb.extract(grey, keypoints, descriptors);
    const std::optional<WorldPose> pose = pose_at(trajectory, frame.frame.timestamp_s);
    if (frame.masks) found.add(frame.frame, units_per_metre, *frame.masks, keypoints, pose);
    if (frame.true_masks)
      truth.add(frame.frame, units_per_metre, *frame.true_masks, keypoints, pose);
    has_masks |= frame.masks.has_value();
    has_truth |= frame.true_masks.has_value();
  }
  if (!has_masks && !has_truth) {
    throw std::runtime_error(name + ": has neither masks/ nor masks_true/");
  }
  std::string text;
  if (has_masks) text += name + "/masks\n" + found.text();
  if (has_truth) text += name + "/masks_true\n" + truth.text();
  return text;
}

}  // namespace dynfilter::tools
