// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The plugin's dynamic classes, where its network has names for them.

#ifdef DYNFILTER_HAS_PLUGIN

#include "dynfilter/plugin.hpp"
#include "models.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

class PluginClasses : public Models {
 protected:
  /// Returns which of a feature on red (car) and one on blue (person) is kept: where the network
  /// finds both, then where it misses them.
  std::vector<float> kept_x(const std::string& settings) const {
    Plugin plugin(folder_
                      .write("settings.yaml", "%YAML:1.0\n---\ndynfilter.model: \"" +
                                                  model("yolo_car_person").string() +
                                                  "\"\nDepthMapFactor: 1\nCamera.fx: 64\n"
                                                  "Camera.fy: 64\nCamera.cx: 32\n"
                                                  "Camera.cy: 32\n" +
                                                  settings)
                      .string());
    cv::Mat image = black_image({64, 64});
    image(cv::Rect(32, 0, 32, 32)).setTo(red);
    image(cv::Rect(0, 32, 32, 32)).setTo(blue);
    std::vector<float> x;
    for (const double time_s : {1.0, 1.03}) {
      std::vector<cv::KeyPoint> keypoints = {{48.F, 16.F, 1.F}, {16.F, 48.F, 1.F}};
      cv::Mat descriptors(2, 32, CV_8UC1, cv::Scalar(0));
      plugin.submit(image, time_s);
      plugin.filter(time_s, cv::Mat1f(64, 64, 2), keypoints, descriptors);
      for (const cv::KeyPoint& keypoint : keypoints) x.push_back(keypoint.pt.x);
      image = black_image({64, 64});
    }
    return x;
  }

  TemporaryFolder folder_;
};

TEST_F(PluginClasses, ArePersonsByTheNetworksNames) {
  EXPECT_EQ(kept_x(""), (std::vector<float>{48, 48}));
  EXPECT_EQ(kept_x("dynfilter.dynamic_classes: [0]\n"), (std::vector<float>{16, 16}));
}

}  // namespace
}  // namespace dynfilter::testing

#endif
