// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "scene_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "progress_bar.hpp"

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

cv::Mat1b persons_of(const Segmentation& segmentation, cv::Size size) {
  cv::Mat1b mask(size, std::uint8_t{0});
  for (const Instance& instance : segmentation.instances) {
    if (instance.class_id != 0 || instance.mask.empty()) continue;
    const cv::Rect place(instance.mask_origin, instance.mask.size());
    const cv::Rect seen = place & cv::Rect({0, 0}, size);
    if (seen.empty()) continue;
    mask(seen).setTo(255, instance.mask(seen - instance.mask_origin));
  }
  return mask;
}

/// Computes the 5 % and 95 % points of a mask's depth; false if it has too little depth.
bool depth_range(const cv::Mat1w& depth, const Instance& instance, int* low, int* high) {
  std::vector<int> values;
  for (int y = 0; y < instance.mask.rows; ++y) {
    for (int x = 0; x < instance.mask.cols; ++x) {
      const cv::Point pixel = cv::Point(x, y) + instance.mask_origin;
      if (instance.mask.at<std::uint8_t>(y, x) == 0 ||
          !cv::Rect({0, 0}, depth.size()).contains(pixel)) {
        continue;
      }
      if (depth(pixel) > 0) values.push_back(depth(pixel));
    }
  }
  if (values.size() < 500) return false;
  std::sort(values.begin(), values.end());
  *low = values[values.size() / 20];
  *high = values[values.size() - 1 - values.size() / 20];
  return true;
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
    int low = 0, high = 0;
    if (instance.class_id != 0 || !depth_range(depth, instance, &low, &high)) continue;
    const auto is_body = [&](int y, int x) { return depth(y, x) >= low && depth(y, x) <= high; };
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

std::string depth_statistics(const std::filesystem::path& folder) {
  RgbdSequence sequence(folder);
  if (!sequence.has_depth()) throw std::runtime_error(folder.string() + ": has no depth images");
  std::string text;
  for (const auto& masks : {sequence.masks_folder(), sequence.true_masks_folder()}) {
    if (!masks) continue;
    MaskFolderSegmenter segmenter(*masks);
    DepthStatistics statistics;
    ProgressBar progress("reading", sequence.size());
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const FrameView frame = sequence.read(i);
      if (frame.depth.type() == CV_16UC1) statistics.add(frame.depth, segmenter.segment(frame));
      progress.advance();
    }
    text += masks->string() + "\n" + statistics.text();
  }
  if (text.empty())
    throw std::runtime_error(folder.string() + ": has neither masks/ nor masks_true/");
  return text;
}

}  // namespace dynfilter::tools
