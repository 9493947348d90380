// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Runs the host on a sequence and compares each of its frames with the unfiltered output of its
// extractor. Exit code 0 if the filter did what the guide promises.
//
//   consumer <rgbd|mono|stereo|fisheye> <folder> <settings> [everything|nothing]
//
// The folder holds the sequence `left`, and for fisheye pairs `right`; the right image of a
// rectified pair is the left one, shifted. With "everything" the settings remove all features, with
// "nothing" none.

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "System.h"

using namespace ORB_SLAM_HOST;

namespace {

struct Totals {
  std::size_t frames = 0, extracted = 0, removed_on_masks = 0, removed_beside = 0;
};

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

/// Compares one image's features after the filter with those before it.
class Comparison {
 public:
  Comparison(const cv::FileStorage& settings, const cv::Mat& gray, const std::vector<int>& lapping,
             int budget) {
    ORBextractor extractor(budget * static_cast<int>(settings["ORBextractor.nFeatures"]),
                           settings["ORBextractor.scaleFactor"], settings["ORBextractor.nLevels"],
                           settings["ORBextractor.iniThFAST"]);
    pivot_ = extractor(gray, keypoints_, descriptors_, lapping);
  }

  /// Checks that kept features are a subsequence, in step with their descriptors and off the mask.
  void Check(const std::vector<cv::KeyPoint>& kept, const cv::Mat& descriptors, const cv::Mat& mask,
             Totals& totals) const {
    Require(descriptors.rows == static_cast<int>(kept.size()), "a row a keypoint");
    std::size_t next = 0;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      while (next < keypoints_.size() && keypoints_[next].class_id != kept[i].class_id) {
        Removed(keypoints_[next++], mask, totals);
      }
      Require(next < keypoints_.size(), "order is kept");
      Require(keypoints_[next++].pt == kept[i].pt, "keypoints are not changed");
      Require(cv::norm(descriptors.row(static_cast<int>(i)), DescriptorOf(kept[i]),
                       cv::NORM_HAMMING) == 0,
              "descriptors stay in step");
      Require(!OnMask(kept[i], mask), "no feature is left on a person");
    }
    while (next < keypoints_.size()) Removed(keypoints_[next++], mask, totals);
    totals.extracted += keypoints_.size();
  }

  void CheckPivot(const std::vector<cv::KeyPoint>& kept, int pivot) const {
    int below = 0;
    for (const cv::KeyPoint& keypoint : kept) below += keypoint.class_id < pivot_ ? 1 : 0;
    Require(pivot == below, "the pivot counts what is left of the first block");
    Require(0 < pivot && pivot < static_cast<int>(kept.size()), "the pair has both blocks");
  }

 private:
  static void Removed(const cv::KeyPoint& keypoint, const cv::Mat& mask, Totals& totals) {
    ++(OnMask(keypoint, mask) ? totals.removed_on_masks : totals.removed_beside);
  }

  std::vector<cv::KeyPoint> keypoints_;
  cv::Mat descriptors_;
  int pivot_ = 0;
};

class Run {
 public:
  Run(const std::string& sensor, const std::string& folder, const std::string& settings,
      const std::string& removed)
      : sensor_(sensor),
        folder_(folder),
        removed_(removed),
        settings_(settings, cv::FileStorage::READ),
        slam_(settings, sensor == "rgbd"   ? System::RGBD
                        : sensor == "mono" ? System::MONOCULAR
                                           : System::STEREO) {}

  void Frame(const std::string& time, const std::string& rgb, const std::string& depth) {
    const cv::Mat image = Read(folder_ + "/left/" + rgb);
    const double timestamp = std::atof(time.c_str());
    if (sensor_ == "rgbd") {
      slam_.TrackRGBD(image, Read(folder_ + "/left/" + depth), timestamp);
    } else if (sensor_ == "mono") {
      slam_.TrackMonocular(image, timestamp);
    } else {
      const bool pair = sensor_ == "fisheye";
      slam_.TrackStereo(image, pair ? Read(folder_ + "/right/" + rgb) : Moved(image), timestamp);
    }
    ++totals_.frames;
    if (removed_ == "everything") {
      const int images = sensor_ == "fisheye" ? 2 : 1;
      Require(slam_.GetTracker().mCurrentFrame.N == images, "a frame is not emptied");
    } else {
      Check(time, rgb);
    }
  }

  /// Checks an image without features, at which the host returns early.
  void FrameWithoutFeatures(const std::string& time) {
    const cv::Size size = slam_.GetTracker().mImGray.size();
    const cv::Mat blank(size, CV_8UC3, cv::Scalar::all(90));
    const double timestamp = std::atof(time.c_str());
    if (sensor_ == "rgbd") {
      slam_.TrackRGBD(blank, cv::Mat::zeros(size, CV_16UC1), timestamp);
    } else if (sensor_ == "mono") {
      slam_.TrackMonocular(blank, timestamp);
    } else {
      slam_.TrackStereo(blank, blank, timestamp);
    }
    Require(slam_.GetTracker().mCurrentFrame.N == 0, "nothing comes of nothing");
  }

  const Totals& totals() const { return totals_; }

 private:
  cv::Mat Gray(const std::string& camera, const std::string& rgb) const {
    cv::Mat gray;
    cv::cvtColor(Read(folder_ + "/" + camera + "/" + rgb), gray, cv::COLOR_BGR2GRAY);
    return gray;
  }

  /// Mask of an image; empty if features on persons stay.
  cv::Mat Mask(const std::string& camera, const std::string& time) const {
    if (removed_ == "nothing") return cv::Mat();
    return Read(folder_ + "/" + camera + "/masks/" + time + ".png");
  }

  std::vector<int> LappingArea(const std::string& camera) const {
    return {settings_[camera + ".lappingBegin"], settings_[camera + ".lappingEnd"]};
  }

  /// Checks that keypoints, right coordinates and depths are of the same features.
  static void CheckStereo(const ORB_SLAM_HOST::Frame& frame) {
    std::size_t matched = 0;
    for (int i = 0; i < frame.N; ++i) {
      Require(frame.mvKeysUn.at(i).class_id == frame.mvKeys[i].class_id, "keypoints are in step");
      if (frame.mvuRight[i] < 0) continue;
      const float disparity = frame.mvKeys[i].pt.x - frame.mvuRight[i];
      Require(std::abs(frame.mbf / disparity - frame.mvDepth[i]) < 1e-4f * frame.mvDepth[i],
              "depths are in step");
      ++matched;
    }
    Require(matched > 0, "there are matches");
  }

  void Check(const std::string& time, const std::string& rgb) {
    const ORB_SLAM_HOST::Frame& frame = slam_.GetTracker().mCurrentFrame;
    const std::size_t columns = frame.N;
    Require(columns == frame.mvKeys.size() + (sensor_ == "fisheye" ? frame.mvKeysRight.size() : 0),
            "N is what is left");
    Require(frame.mvDepth.size() == columns && frame.mvuRight.size() == columns &&
                frame.mvpMapPoints.size() == columns && frame.mvbOutlier.size() == columns,
            "all columns have N elements");
    if (sensor_ == "stereo") CheckStereo(frame);

    if (sensor_ == "fisheye") {
      const Comparison left(settings_, Gray("left", rgb), LappingArea("Camera"), 1);
      const Comparison right(settings_, Gray("right", rgb), LappingArea("Camera2"), 1);
      left.Check(frame.mvKeys, frame.mDescriptors.rowRange(0, frame.Nleft), Mask("left", time),
                 totals_);
      right.Check(frame.mvKeysRight, frame.mDescriptorsRight, Mask("right", time), totals_);
      left.CheckPivot(frame.mvKeys, frame.monoLeft);
      right.CheckPivot(frame.mvKeysRight, frame.monoRight);
      return;
    }
    const bool mono = sensor_ == "mono";
    const int budget = mono && totals_.frames <= 5 ? 2 : 1;
    const Comparison features(settings_, Gray("left", rgb), {0, mono ? 1000 : 0}, budget);
    features.Check(frame.mvKeys, frame.mDescriptors, Mask("left", time), totals_);
  }

  std::string sensor_, folder_, removed_;
  cv::FileStorage settings_;
  System slam_;
  Totals totals_;
};

}  // namespace

int main(int argc, char** argv) try {
  Require(argc == 4 || argc == 5, "usage: consumer SENSOR SEQUENCE SETTINGS [everything|nothing]");
  const std::string sensor = argv[1], folder = argv[2];
  const std::string removed = argc == 5 ? argv[4] : "";
  Run run(sensor, folder, argv[3], removed);

  std::ifstream associations(folder + "/left/associations.txt");
  std::string line, time, rgb, depth_time, depth;
  while (std::getline(associations, line)) {
    if (std::istringstream(line) >> time >> rgb >> depth_time >> depth) run.Frame(time, rgb, depth);
  }
  run.FrameWithoutFeatures(time);

  const Totals& totals = run.totals();
  std::cout << sensor << ": " << totals.frames << " frames, " << totals.extracted << " features, "
            << totals.removed_on_masks << " removed on masks, " << totals.removed_beside
            << " beside them" << std::endl;
  Require(totals.frames > 0, "the sequence has frames");
  if (removed == "nothing") {
    Require(totals.extracted > 0 && totals.removed_beside == 0, "every feature is kept");
  } else if (removed.empty()) {
    Require(totals.removed_on_masks > 0, "there are features on persons");
    Require((totals.removed_beside > 0) == (sensor == "rgbd" || sensor == "stereo"),
            "compensation acts with depth, and with depth only");
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << std::endl;
  return 1;
}
