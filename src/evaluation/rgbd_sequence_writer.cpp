// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/rgbd_sequence_writer.hpp"

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <system_error>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/evaluation/trajectory_rows.hpp"
#include "io/file_writing.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;

constexpr const char* name = "RgbdSequenceWriter";

/// Writes three lines, because ORB-SLAM and others skip the first three of rgb.txt and
/// groundtruth.txt.
std::string heading(const char* content, const char* columns) {
  return std::string("# ") + content + "\n# written by dynfilter\n# " + columns + '\n';
}

/// Converts depth to the units of the file; 0 means no depth, and so does 65535 to readers.
cv::Mat depth_image(const FrameView& frame, double units_per_metre) {
  const double factor = frame.depth_scale() * units_per_metre;
  if (frame.depth.type() == CV_16UC1 && std::abs(factor - 1) < 1e-9) return frame.depth;
  cv::Mat1w units(frame.depth.size());
  for (int y = 0; y < units.rows; ++y) {
    for (int x = 0; x < units.cols; ++x) {
      const double value = std::floor(frame.depth_m({x, y}).value_or(0) * units_per_metre + 0.5);
      units(y, x) = value < 65535 ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
    }
  }
  return units;
}

}  // namespace

RgbdSequenceWriter::RgbdSequenceWriter(const fs::path& folder, const CameraParameters& camera,
                                       const RgbdSequenceWriterOptions& options)
    : camera_(camera), camera_text_(camera_file_text(camera)) {
  staged_ = std::make_unique<detail::StagedFolder>(folder, "sequence", options.overwrite);
}

RgbdSequenceWriter::RgbdSequenceWriter(RgbdSequenceWriter&&) noexcept = default;
RgbdSequenceWriter& RgbdSequenceWriter::operator=(RgbdSequenceWriter&&) noexcept = default;
RgbdSequenceWriter::~RgbdSequenceWriter() = default;

void RgbdSequenceWriter::require_frame(const FrameView& frame) const {
  validate(frame, name);
  const auto refuse = [](const std::string& got, const std::string& want) {
    detail::throw_misuse(name, got, want);
  };
  if (!staged_) refuse("a frame after finish()", "every frame before it");
  const int type = frame.image.type();
  if (frame.image.empty() || (type != CV_8UC1 && type != CV_8UC3)) {
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
  if (rows_.empty()) return;
  if (detail::microseconds(frame.timestamp_s) <= last_time_) {
    refuse("a frame at " + detail::time_text(frame.timestamp_s),
           "a time after the last frame's, " +
               detail::time_text(static_cast<double>(last_time_) * 1e-6));
  }
  if (frame.depth.empty() == has_depth_) {
    refuse(frame.depth.empty() ? "a frame without depth" : "a frame with depth",
           "depth in every frame or in none");
  }
}

void RgbdSequenceWriter::write_frame(const FrameView& frame, const std::string& pose_row) {
  const std::string time = detail::time_text(frame.timestamp_s), file = time + ".png";
  const fs::path image = staged_->path() / "rgb" / file, depth = staged_->path() / "depth" / file;
  rows_.push_back({time, pose_row});
  try {
    fs::create_directories(image.parent_path());
    detail::write_image(image, frame.image);
    if (!frame.depth.empty()) {
      fs::create_directories(depth.parent_path());
      detail::write_image(depth, depth_image(frame, camera_.depth_units_per_metre));
    }
  } catch (...) {
    rows_.pop_back();
    std::error_code ignored;
    fs::remove(image, ignored);
    throw;
  }
  has_depth_ = !frame.depth.empty();
  last_time_ = detail::microseconds(frame.timestamp_s);
}

void RgbdSequenceWriter::add(const FrameView& frame) {
  require_frame(frame);
  write_frame(frame, {});
}

void RgbdSequenceWriter::add(const FrameView& frame, const cv::Matx33d& rotation,
                             const cv::Vec3d& translation) {
  require_frame(frame);
  write_frame(frame,
              detail::trajectory_row_text({frame.timestamp_s, rotation, translation}, name) + '\n');
}

void RgbdSequenceWriter::write_lists() const {
  const char* columns = "timestamp filename";
  std::string rgb = heading("color images", columns), depth = heading("depth maps", columns);
  std::string associations;  // ORB-SLAM allows no comment in this file
  std::string poses;
  for (const Row& row : rows_) {
    const std::string rgb_row = row.time + " rgb/" + row.time + ".png";
    const std::string depth_row = row.time + " depth/" + row.time + ".png";
    rgb += rgb_row + '\n';
    depth += depth_row + '\n';
    associations += rgb_row + ' ' + depth_row + '\n';
    poses += row.pose_row;
  }
  const fs::path& folder = staged_->path();
  detail::write_file(folder / "camera.yaml", camera_text_);
  if (rows_.empty()) return;
  detail::write_file(folder / "rgb.txt", rgb);
  if (has_depth_) detail::write_file(folder / "depth.txt", depth);
  if (has_depth_) detail::write_file(folder / "associations.txt", associations);
  if (poses.empty()) return;
  detail::write_file(folder / "groundtruth.txt",
                     heading("ground truth trajectory", "timestamp tx ty tz qx qy qz qw") + poses);
}

void RgbdSequenceWriter::finish() {
  if (!staged_) return;
  write_lists();
  staged_->commit();
  staged_.reset();
}

}  // namespace dynfilter
