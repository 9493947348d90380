// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_SCENE_STATISTICS_HPP
#define DYNFILTER_SRC_TOOLS_SCENE_STATISTICS_HPP

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/segmentation.hpp"
#include "frame_source.hpp"

namespace dynfilter::tools {

/// Measures how depth behaves at persons' silhouettes, summed over frames. Distances are pixels
/// from the border of the masks of class 0. O(pixels) a frame.
class DepthStatistics {
 public:
  /// Adds a frame's depth in CV_16UC1, 0 = none. Frames without a mask count only for the whole
  /// image.
  void add(const cv::Mat1w& depth, const Segmentation& segmentation);

  /// Returns a table with one line a figure; "-" for a figure without data.
  std::string text() const;

 private:
  struct Share {
    std::uint64_t part = 0;
    std::uint64_t all = 0;

    void count(bool is_part) {
      part += is_part ? 1 : 0;
      ++all;
    }
  };

  void add_zones(const cv::Mat1w& depth, const cv::Mat1b& persons);
  void add_sides(const cv::Mat1w& depth, const cv::Mat1b& persons);
  void add_edges(const cv::Mat1w& depth, const cv::Mat1b& persons, const Segmentation& found);
  void add_codes(const cv::Mat1w& depth);

  static constexpr int zones = 4;  // 1-2, 3-5, 6-10, 11-20 px
  Share image_, persons_, codes_;
  std::array<Share, zones> inside_, outside_;
  std::array<std::array<Share, zones>, 2> beside_;  // left and right; 1-3, 4-6, 7-12, 13-25 px
  std::array<std::vector<int>, 2> edge_offsets_px_;
};

/// Returns the statistics of a scene, rendered or recorded: one table for its masks and one for its
/// true masks, if it has them. `name` heads the tables. Reads every frame and extracts 1000 ORB
/// features in it. Throws std::runtime_error that names what is missing.
std::string scene_statistics(FrameSource& source, const std::string& name);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_SCENE_STATISTICS_HPP
