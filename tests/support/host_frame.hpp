// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/plugin.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

inline const cv::Size image_size(160, 120);

/// Frame with a person at 1.5 m in front of a wall at 3 m, whose mask misses the lower half.
struct HostFrame {
  double timestamp_s;
  cv::Mat image = cv::Mat(image_size, CV_8UC3, cv::Scalar(30, 60, 90));
  cv::Mat depth = cv::Mat(image_size, CV_32FC1, cv::Scalar(3.0));
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  Segmentation segmentation;

  explicit HostFrame(int index) : timestamp_s(100 + index * 0.1) {
    const int x = 20 + 3 * (index % 20);
    depth(cv::Rect(x, 20, 40, 80)).setTo(1.5);
    segmentation.timestamp_s = timestamp_s;
    segmentation.image_size = image_size;
    Instance person = Instance::from_box({x - 5, 15, 50, 90}, 0, 0.75F);
    person.mask_origin = {x, 20};
    person.mask = cv::Mat(40, 40, CV_8UC1, cv::Scalar(255));
    segmentation.instances.push_back(person);
    for (int v = 2; v < image_size.height; v += 7) {
      for (int u = 2; u < image_size.width; u += 7) {
        keypoints.emplace_back(static_cast<float>(u), static_cast<float>(v), 31.0F);
      }
    }
    // Each descriptor identifies its keypoint, to show whether the columns stay in step.
    descriptors = cv::Mat::zeros(static_cast<int>(keypoints.size()), 32, CV_8UC1);
    for (int i = 0; i < descriptors.rows; ++i) {
      keypoints[static_cast<std::size_t>(i)].class_id = i;
      *descriptors.ptr<int>(i) = i;
    }
  }

  FrameView view(std::uint64_t id) const {
    FrameView frame;
    frame.id = id;
    frame.timestamp_s = timestamp_s;
    frame.image = image;
    frame.depth = depth;
    return frame;
  }
};

/// Filters a frame as an RGB-D host does.
inline FrameStatistics filter_rgbd(Plugin& plugin, HostFrame& frame) {
  return plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
}

/// Submits the frame's image, then filters it.
inline FrameStatistics submit_and_filter(Plugin& plugin, HostFrame& frame) {
  plugin.submit(frame.image, frame.timestamp_s);
  return filter_rgbd(plugin, frame);
}

inline bool in_step(const HostFrame& frame) {
  if (frame.descriptors.rows != static_cast<int>(frame.keypoints.size())) return false;
  for (int i = 0; i < frame.descriptors.rows; ++i) {
    if (*frame.descriptors.ptr<int>(i) != frame.keypoints[static_cast<std::size_t>(i)].class_id) {
      return false;
    }
  }
  return true;
}

/// Parts of a frame that a filter may change.
struct HostColumns {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;

  explicit HostColumns(const HostFrame& frame)
      : keypoints(frame.keypoints), descriptors(frame.descriptors.clone()) {}
};

inline void expect_equal(const HostColumns& got, const HostColumns& want) {
  ASSERT_EQ(got.keypoints.size(), want.keypoints.size());
  for (std::size_t i = 0; i < got.keypoints.size(); ++i) {
    ASSERT_EQ(got.keypoints[i].class_id, want.keypoints[i].class_id);
    ASSERT_EQ(got.keypoints[i].pt, want.keypoints[i].pt);
  }
  ASSERT_EQ(got.descriptors.size(), want.descriptors.size());
  EXPECT_EQ(cv::norm(got.descriptors, want.descriptors, cv::NORM_L1), 0);
}

/// Filters a frame; returns the class ids of the keypoints that are left.
inline std::vector<int> kept(Plugin& plugin, int index) {
  HostFrame frame(index);
  filter_rgbd(plugin, frame);
  EXPECT_TRUE(in_step(frame));
  std::vector<int> left;
  for (const cv::KeyPoint& keypoint : frame.keypoints) left.push_back(keypoint.class_id);
  return left;
}

inline void submit(Plugin& plugin, int index) {
  const HostFrame frame(index);
  plugin.submit(frame.image, frame.timestamp_s);
}

/// Submits and filters frames 0, 1, …; returns what is left of each.
inline std::vector<std::vector<int>> kept_in_frames(Plugin& plugin, int count) {
  std::vector<std::vector<int>> left;
  for (int i = 0; i < count; ++i) {
    submit(plugin, i);
    left.push_back(kept(plugin, i));
  }
  return left;
}

/// Masks of some frames on disk, and a settings file like ORB-SLAM's.
class PluginTest : public ::testing::Test {
 protected:
  static constexpr int frames = 6;

  PluginTest() {
    MaskFolderWriter writer(masks());
    for (int i = 0; i < frames; ++i) writer.add(HostFrame(i).segmentation);
    writer.finish();
  }

  std::filesystem::path masks() const { return folder_.path() / "masks"; }
  std::filesystem::path file() const { return folder_.path() / "TUM3.yaml"; }
  std::filesystem::path path(const char* name) const { return folder_.path() / name; }

  /// Writes a settings file with these lines and mask_folder; returns its path.
  std::string settings(const std::string& lines = {}) const {
    return raw_settings("dynfilter.mask_folder: \"" + masks().string() + "\"\n" + lines);
  }

  /// Lines that record frames in a folder, with an overlay of every so many.
  std::string recording(const char* folder = "out", int every = 1) const {
    return "dynfilter.output_folder: \"" + path(folder).string() +
           "\"\ndynfilter.overlay_every: " + std::to_string(every) + "\n";
  }

  std::string raw_settings(const std::string& lines) const {
    std::ofstream(file()) << "%YAML:1.0\n# Camera\nCamera.fx: 535.4\nDepthMapFactor: 5000.0\n"
                          << "ORBextractor.nFeatures: 500\n"
                          << lines;
    return file().string();
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace dynfilter::testing
