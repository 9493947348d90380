// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/rules/epipolar_check.hpp"

#include <opencv2/imgproc.hpp>

#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Two frames of 320x240: the camera moves to the left before a near and a far wall, which so shift
/// by 8 and 4 px, and a patch moves by 6 px to the right and down.
struct TwoFrames {
  cv::Mat first, second;
  const cv::Rect patch{130, 90, 60, 60};  // in the second frame
  std::vector<cv::Point2f> features;      // a grid in the second frame
  Segmentation masks;                     // one person, far from the patch

  TwoFrames() : first(240, 320, CV_8UC1), second(240, 320, CV_8UC1) {
    cv::Mat texture(300, 400, CV_8UC1);
    cv::RNG(5).fill(texture, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(texture, texture, {}, 1.5);
    texture *= 1.5;
    show({0, 0, 160, 240}, {4, 0}, texture);
    show({160, 0, 160, 240}, {8, 0}, texture);
    show(patch, {6, 6}, cv::Mat(255 - texture));
    for (int y = 15; y < 230; y += 10) {
      for (int x = 15; x < 310; x += 10) features.emplace_back(cv::Point(x, y));
    }
    masks.image_size = first.size();
    masks.instances = {
        Instance::from_box_mask(cv::Mat(60, 30, CV_8UC1, cv::Scalar(1)), {260, 150, 30, 60})};
  }

  /// Shows a texture in a region of the second frame; it was elsewhere in the first.
  void show(const cv::Rect& region, cv::Point shift, const cv::Mat& texture) {
    texture(region + cv::Point(20, 20)).copyTo(second(region));
    const cv::Rect before = (region - shift) & cv::Rect({}, first.size());
    texture(before + shift + cv::Point(20, 20)).copyTo(first(before));
  }

  /// Runs the rule on both frames. Returns the labels of the second one.
  FeatureLabels labels() const {
    peers::EpipolarCheck rule;
    FeatureLabels labels;
    for (const cv::Mat& image : {first, second}) {
      FrameView frame;
      frame.image = image;
      labels = FeatureLabels(features.size(), masks);
      rule({frame, masks, features}, labels);
    }
    return labels;
  }
};

TEST(EpipolarCheck, RemovesWhatIsOnADilatedMaskOrLeavesItsEpipolarLine) {
  const TwoFrames frames;
  const FeatureLabels labels = frames.labels();
  FeatureLabels by_masks(frames.features.size(), frames.masks);
  const FrameView frame;
  peers::DilatedMask()({frame, frames.masks, frames.features}, by_masks);
  std::size_t moving = 0, moving_removed = 0, still = 0, still_removed = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const cv::Point2f point = frames.features[i];
    if (by_masks.is_removed(i)) {
      EXPECT_TRUE(labels.is_removed(i)) << point;
    } else if (frames.patch.contains(point)) {
      ++moving;
      moving_removed += labels.is_removed(i) ? 1 : 0;
    } else if (std::abs(point.x - 160) > 50) {  // the walls meet at 160
      ++still;
      still_removed += labels.is_removed(i) ? 1 : 0;
    }
  }
  EXPECT_GT(moving_removed * 10, moving * 8);
  EXPECT_LT(still_removed * 20, still);
}

}  // namespace
}  // namespace dynfilter::testing
