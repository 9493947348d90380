// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Runs the host on a sequence and compares each of its frames with the unfiltered output of its
// extractor. Exit code 0 if the filter did what the guide promises.
//
//   consumer <rgbd|mono|stereo|fisheye> <folder> <settings>
//
// The folder holds the sequence `left`, and for fisheye pairs `right`; the right image of a
// rectified pair is the left one, shifted.

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "Tracking.h"

using namespace ORB_SLAM_HOST;

namespace {

void Require(bool condition, const std::string& what) {
  if (!condition) throw std::runtime_error(what);
}

cv::Mat Read(const std::string& path) {
  const cv::Mat image = cv::imread(path, cv::IMREAD_UNCHANGED);
  Require(!image.empty(), "cannot read " + path);
  return image;
}

/// Image of the right camera of a rectified pair.
cv::Mat Moved(const cv::Mat& image) {
  const int disparity = 8;
  cv::Mat moved = cv::Mat::zeros(image.size(), image.type());
  image.colRange(disparity, image.cols).copyTo(moved.colRange(0, image.cols - disparity));
  return moved;
}

bool OnMask(const cv::KeyPoint& keypoint, const cv::Mat& mask) {
  const cv::Point pixel(std::floor(keypoint.pt.x + 0.5f), std::floor(keypoint.pt.y + 0.5f));
  return cv::Rect(0, 0, mask.cols, mask.rows).contains(pixel) && mask.at<uchar>(pixel) != 0;
}

class Run {
 public:
  Run(const std::string& sensor, const std::string& folder, const std::string& settings)
      : sensor_(sensor),
        folder_(folder),
        settings_(settings, cv::FileStorage::READ),
        tracker_(settings, sensor == "rgbd"   ? Tracking::RGBD
                           : sensor == "mono" ? Tracking::MONOCULAR
                                              : Tracking::STEREO) {}

  void Frame(const std::string& time, const std::string& rgb, const std::string& depth) {
    const cv::Mat left = Read(folder_ + "/left/" + rgb);
    const cv::Mat right = sensor_ == "fisheye" ? Read(folder_ + "/right/" + rgb) : Moved(left);
    Track(time, left, Read(folder_ + "/left/" + depth), right);
    ++frames;

    const ORB_SLAM_HOST::Frame& frame = tracker_.mCurrentFrame;
    const std::size_t columns = frame.mvKeys.size() + frame.mvKeysRight.size();
    if (sensor_ == "stereo") {
      CheckStereo(frame);
    } else {
      Require(columns == static_cast<std::size_t>(frame.N), "N is what is left");
    }
    if (sensor_ == "fisheye") {
      Check("left", "Camera", time, left, frame.mvKeys, frame.mDescriptors.rowRange(0, frame.Nleft),
            frame.monoLeft);
      Check("right", "Camera2", time, right, frame.mvKeysRight, frame.mDescriptorsRight,
            frame.monoRight);
    } else {
      Check("left", "", time, left, frame.mvKeys, frame.mDescriptors, -1);
    }
  }

  /// Checks an image without features, at which the host returns early.
  void FrameWithoutFeatures(const std::string& time) {
    const cv::Size size = tracker_.mImGray.size();
    const cv::Mat blank(size, CV_8UC3, cv::Scalar::all(90));
    Track(time, blank, cv::Mat::zeros(size, CV_16UC1), blank);
    Require(tracker_.mCurrentFrame.N == 0, "nothing comes of nothing");
  }

  std::size_t frames = 0, removed_on_masks = 0, removed_beside = 0;

 private:
  void Track(const std::string& time, const cv::Mat& left, const cv::Mat& depth,
             const cv::Mat& right) {
    const double timestamp = std::atof(time.c_str());
    if (sensor_ == "rgbd") {
      tracker_.GrabImageRGBD(left, depth, timestamp);
    } else if (sensor_ == "mono") {
      tracker_.GrabImageMonocular(left, timestamp);
    } else {
      tracker_.GrabImageStereo(left, right, timestamp);
    }
  }

  /// Checks that keypoints, right coordinates and depths are of the same features.
  static void CheckStereo(const ORB_SLAM_HOST::Frame& frame) {
    std::size_t matched = 0;
    Require(frame.mvKeysUn.size() == frame.mvKeys.size() &&
                frame.mvDepth.size() == frame.mvKeys.size() && frame.N == int(frame.mvKeys.size()),
            "all columns have N elements");
    for (int i = 0; i < frame.N; ++i) {
      Require(frame.mvKeysUn[i].class_id == frame.mvKeys[i].class_id, "keypoints are in step");
      if (frame.mvuRight.at(i) < 0) continue;
      const float disparity = frame.mvKeys[i].pt.x - frame.mvuRight[i];
      Require(std::abs(frame.mbf / disparity - frame.mvDepth[i]) < 1e-4f * frame.mvDepth[i],
              "depths are in step");
      ++matched;
    }
    Require(matched > 0, "there are matches");
  }

  /// Checks that kept features are a subsequence of the extracted ones, in step with their
  /// descriptors and off the mask, and that the pivot of a fisheye image counts what is left of the
  /// first block.
  void Check(const std::string& side, const std::string& camera, const std::string& time,
             const cv::Mat& image, const std::vector<cv::KeyPoint>& kept,
             const cv::Mat& descriptors, int pivot) {
    const bool is_mono = sensor_ == "mono";
    const int budget = is_mono && frames <= 5 ? 2 : 1;
    ORBextractor extractor(budget * static_cast<int>(settings_["ORBextractor.nFeatures"]),
                           settings_["ORBextractor.scaleFactor"], settings_["ORBextractor.nLevels"],
                           settings_["ORBextractor.iniThFAST"]);
    std::vector<int> lapping = {0, is_mono ? 1000 : 0};
    if (!camera.empty())
      lapping = {settings_[camera + ".lappingBegin"], settings_[camera + ".lappingEnd"]};
    cv::Mat gray, extracted_descriptors;
    std::vector<cv::KeyPoint> extracted;
    cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
    const int first_block = extractor(gray, extracted, extracted_descriptors, lapping);

    const cv::Mat mask = Read(folder_ + "/" + side + "/masks/" + time + ".png");
    Require(descriptors.rows == static_cast<int>(kept.size()), "a row a keypoint");
    std::size_t next = 0;
    int below = 0;
    for (const cv::KeyPoint& keypoint : extracted) {
      const bool is_kept = next < kept.size() && kept[next].class_id == keypoint.class_id;
      if (!is_kept) {
        ++(OnMask(keypoint, mask) ? removed_on_masks : removed_beside);
        continue;
      }
      Require(kept[next].pt == keypoint.pt, "keypoints are not changed");
      Require(cv::norm(descriptors.row(static_cast<int>(next)), DescriptorOf(keypoint),
                       cv::NORM_HAMMING) == 0,
              "descriptors stay in step");
      Require(!OnMask(keypoint, mask), "no feature is left on a person");
      below += keypoint.class_id < first_block ? 1 : 0;
      ++next;
    }
    Require(next == kept.size(), "order is kept");
    if (pivot >= 0) Require(pivot == below && 0 < pivot && pivot < int(next), "the pivot is right");
  }

  std::string sensor_, folder_;
  cv::FileStorage settings_;
  Tracking tracker_;
};

}  // namespace

int main(int argc, char** argv) try {
  Require(argc == 4, "usage: consumer SENSOR FOLDER SETTINGS");
  const std::string sensor = argv[1], folder = argv[2];
  Run run(sensor, folder, argv[3]);

  std::ifstream associations(folder + "/left/associations.txt");
  std::string line, time, rgb, depth_time, depth;
  while (std::getline(associations, line)) {
    if (std::istringstream(line) >> time >> rgb >> depth_time >> depth) run.Frame(time, rgb, depth);
  }
  run.FrameWithoutFeatures(time);

  std::cout << sensor << ": " << run.frames << " frames, " << run.removed_on_masks
            << " features removed on masks, " << run.removed_beside << " beside them" << std::endl;
  Require(run.frames > 0, "the sequence has frames");
  Require(run.removed_on_masks > 0, "there are features on persons");
  Require((run.removed_beside > 0) == (sensor == "rgbd" || sensor == "stereo"),
          "compensation acts with depth, and with depth only");
} catch (const std::exception& error) {
  std::cerr << error.what() << std::endl;
  return 1;
}
