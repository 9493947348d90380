// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// OpenCV's own odometry of RGB-D images, frame to frame, with masks. Nothing of ours takes part.
// bench/hosts.sh compiles and calls it.
//
//   rgbd_odometry SEQUENCE MASKS Rgbd|RgbdICP FX FY CX CY UNITS_PER_METRE
//
// Reads SEQUENCE/associations.txt and MASKS/<image>.png (0 = do not look here; MASKS "-": no
// masks), and prints the camera's poses in TUM's format. A frame without a pose repeats the last.

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/rgbd.hpp>

namespace {

cv::Mat read(const std::string& file, int flags) {
  cv::Mat image = cv::imread(file, flags);
  if (image.empty()) throw std::runtime_error(file + ": no image");
  return image;
}

void print_pose(const std::string& time, const cv::Matx44d& pose) {
  cv::Vec3d turn;
  cv::Rodrigues(pose.get_minor<3, 3>(0, 0), turn);
  const double angle = cv::norm(turn);
  const cv::Vec3d axis = angle > 0 ? turn * (std::sin(angle / 2) / angle) : cv::Vec3d();
  std::printf("%s %.6f %.6f %.6f %.8f %.8f %.8f %.8f\n", time.c_str(), pose(0, 3), pose(1, 3),
              pose(2, 3), axis[0], axis[1], axis[2], std::cos(angle / 2));
}

void track(const std::string& sequence, const std::string& masks, const std::string& method,
           const cv::Matx33d& camera, double units_per_metre) {
  cv::setNumThreads(1);
  const cv::Ptr<cv::rgbd::Odometry> odometry = cv::rgbd::Odometry::create(method + "Odometry");
  if (!odometry) throw std::runtime_error(method + ": want Rgbd or RgbdICP");
  odometry->setCameraMatrix(cv::Mat(camera));
  std::ifstream list(sequence + "/associations.txt");
  cv::Matx44d pose = cv::Matx44d::eye();
  cv::Ptr<cv::rgbd::OdometryFrame> last;
  std::string line, time, image, depth_time, depth;
  while (std::getline(list, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream(line) >> time >> image >> depth_time >> depth;
    cv::Mat metres, mask;
    read(sequence + "/" + depth, cv::IMREAD_UNCHANGED)
        .convertTo(metres, CV_32F, 1 / units_per_metre);
    metres.setTo(cv::Scalar::all(std::numeric_limits<double>::quiet_NaN()), metres == 0);
    if (masks != "-") {
      const std::string name = image.substr(image.find('/') + 1);
      mask = read(masks + "/" + name + ".png", cv::IMREAD_GRAYSCALE);
    }
    const cv::Mat grey = read(sequence + "/" + image, cv::IMREAD_GRAYSCALE);
    auto frame = cv::rgbd::OdometryFrame::create(grey, metres, mask);
    cv::Mat from_last;  // moves points of the last frame into this one
    if (last && odometry->compute(last, frame, from_last)) {
      pose = pose * cv::Matx44d(from_last).inv();
    }
    last = frame;
    print_pose(time, pose);
  }
}

}  // namespace

int main(int count, char** words) {
  try {
    if (count != 9) throw std::runtime_error("want SEQUENCE MASKS METHOD FX FY CX CY UNITS");
    const auto number = [&](int i) { return std::stod(words[i]); };
    const cv::Matx33d camera(number(4), 0, number(6), 0, number(5), number(7), 0, 0, 1);
    track(words[1], words[2], words[3], camera, number(8));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "rgbd_odometry: %s\n", error.what());
    return 1;
  }
}
