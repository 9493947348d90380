// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TOOLS_FEATURE_EXTRACTOR_HPP
#define DYNFILTER_TOOLS_FEATURE_EXTRACTOR_HPP

#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

namespace dynfilter::tools {

/// ORB features as a SLAM system extracts them: OpenCV's, which crowd where the texture is
/// strongest, thinned out so that they cover the image as those of ORB-SLAM's quadtree do.
class FeatureExtractor {
 public:
  explicit FeatureExtractor(int features);

  /// "4000, spread to 1000": what its time is the time of.
  std::string description() const;

  /// At most that many keypoints of a grey image, and a descriptor a row for each.
  void extract(const cv::Mat& grey, std::vector<cv::KeyPoint>& keypoints,
               cv::Mat& descriptors) const;

 private:
  int features_;
  cv::Ptr<cv::ORB> orb_;
};

/// Keeps the strongest keypoint of every cell of a grid, then the second strongest of every cell,
/// and so on until `count` are kept. Ties go to the earlier keypoint. O(n log n).
void spread_keypoints(std::vector<cv::KeyPoint>& keypoints, std::size_t count,
                      const cv::Size& image_size);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_TOOLS_FEATURE_EXTRACTOR_HPP
