// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/datasets/rgbd_sequence_writer.hpp"

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "../image_file.hpp"
#include "../output_folder.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/evaluation/trajectory.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;

constexpr const char* name = "RgbdSequenceWriter";

/// ORB-SLAM and others skip the first three lines of rgb.txt and groundtruth.txt unread.
void write_heading(detail::TableWriter& table, const char* content, const char* columns) {
  table.line(std::string("# ") + content);
  table.line("# written by dynfilter");
  table.line(std::string("# ") + columns);
}

/// Depth in the units of the file, 0 = none.
cv::Mat depth_image(const FrameView& frame, double units_per_metre) {
  const double factor = frame.depth_scale() * units_per_metre;
  if (frame.depth.type() == CV_16UC1 && std::abs(factor - 1) < 1e-9) return frame.depth;
  cv::Mat units(frame.depth.size(), CV_16UC1);
  for (int y = 0; y < units.rows; ++y) {
    for (int x = 0; x < units.cols; ++x) {
      const double value = std::floor(frame.depth_m({x, y}).value_or(0) * units_per_metre + 0.5);
      units.ptr<std::uint16_t>(y)[x] =
          value <= 65535 ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
    }
  }
  return units;
}

std::string groundtruth_row(double time_s, const cv::Matx33d& rotation,
                            const cv::Vec3d& translation) {
  TimedPose pose;
  pose.timestamp_s = time_s;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.rotation(i, j) = rotation(i, j);
    pose.translation(i) = translation(i);
  }
  return detail::pose_text(pose, name);
}

}  // namespace

RgbdSequenceWriter::RgbdSequenceWriter(const fs::path& folder, const CameraParameters& camera,
                                       const RgbdSequenceWriterOptions& options)
    : folder_(folder), camera_(camera) {
  camera_file_text(camera);  // refuses a camera before anything is removed
  std::vector<fs::path> earlier;
  for (const char* file :
       {"camera.yaml", "rgb.txt", "depth.txt", "associations.txt", "groundtruth.txt"}) {
    earlier.push_back(folder / file);
  }
  for (const char* images : {"rgb", "depth"}) {
    const std::vector<fs::path> files = detail::timed_png_files(folder / images);
    earlier.insert(earlier.end(), files.begin(), files.end());
  }
  detail::make_room(folder, earlier, options.overwrite);
  fs::create_directories(folder);
  write_camera(folder / "camera.yaml", camera);
}

void RgbdSequenceWriter::require_frame(const FrameView& frame) const {
  validate(frame, name);
  const auto refuse = [](const std::string& got, const std::string& want) {
    detail::throw_misuse(name, got, want);
  };
  if (finished_) refuse("a frame after finish()", "all frames before");
  const int type = frame.image.type();
  if (frame.image.empty() || frame.image.dims > 2 || (type != CV_8UC1 && type != CV_8UC3)) {
    refuse(frame.image.empty() ? "no image" : "an image of type " + detail::type_name(frame.image),
           "a CV_8UC1 or CV_8UC3 image");
  }
  const cv::Size size = frame.image.size();
  if (!camera_.image_size.empty() && size != camera_.image_size) {
    refuse("an image of " + detail::size_name(size),
           "that of the camera, " + detail::size_name(camera_.image_size));
  }
  if (!detail::is_time_in_seconds(frame.timestamp_s)) {
    refuse(detail::concatenate("timestamp_s = ", frame.timestamp_s), "a time in seconds");
  }
  if (size_ == 0) return;
  if (detail::microseconds(frame.timestamp_s) <= last_time_) {
    refuse("a frame at " + detail::time_text(frame.timestamp_s),
           "a time after the last frame's, " +
               detail::time_text(static_cast<double>(last_time_) * 1e-6));
  }
  if (frame.depth.empty() == depth_.has_value()) {
    refuse(frame.depth.empty() ? "a frame without depth" : "a frame with depth",
           "depth in every frame or in none");
  }
}

void RgbdSequenceWriter::open_lists(bool with_depth) {
  fs::create_directories(folder_ / "rgb");
  rgb_.emplace(folder_ / "rgb.txt");
  write_heading(*rgb_, "color images", "timestamp filename");
  if (!with_depth) return;
  fs::create_directories(folder_ / "depth");
  depth_.emplace(folder_ / "depth.txt");
  write_heading(*depth_, "depth maps", "timestamp filename");
  associations_.emplace(folder_ / "associations.txt");  // ORB-SLAM takes no comment in this one
}

void RgbdSequenceWriter::write_frame(const FrameView& frame) {
  if (!rgb_) open_lists(!frame.depth.empty());
  const std::string time = detail::time_text(frame.timestamp_s);
  const std::string image_row = time + " rgb/" + time + ".png";
  const std::string depth_row = time + " depth/" + time + ".png";
  detail::write_png(folder_ / "rgb" / (time + ".png"), frame.image);
  if (depth_) {
    detail::write_png(folder_ / "depth" / (time + ".png"),
                      depth_image(frame, camera_.depth_units_per_metre));
    depth_->line(depth_row);
    depth_->flush();
  }
  rgb_->line(image_row);
  rgb_->flush();
  if (associations_) {
    associations_->line(image_row + ' ' + depth_row);
    associations_->flush();
  }
  last_time_ = detail::microseconds(frame.timestamp_s);
  ++size_;
}

void RgbdSequenceWriter::add(const FrameView& frame) {
  require_frame(frame);
  write_frame(frame);
}

void RgbdSequenceWriter::add(const FrameView& frame, const cv::Matx33d& rotation,
                             const cv::Vec3d& translation) {
  require_frame(frame);
  const std::string row = groundtruth_row(frame.timestamp_s, rotation, translation);
  write_frame(frame);
  if (!groundtruth_) {
    groundtruth_.emplace(folder_ / "groundtruth.txt");
    write_heading(*groundtruth_, "ground truth trajectory", "timestamp tx ty tz qx qy qz qw");
  }
  groundtruth_->line(row);
  groundtruth_->flush();
}

void RgbdSequenceWriter::finish() {
  if (finished_) return;
  finished_ = true;
  for (auto* table : {&rgb_, &depth_, &associations_, &groundtruth_}) {
    if (*table) (*table)->close();
  }
}

}  // namespace dynfilter
