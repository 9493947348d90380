// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/datasets/rgbd_sequence_writer.hpp"

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "../image_file.hpp"
#include "../output_folder.hpp"
#include "../text_table.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/evaluation/detail/trajectory_rows.hpp"

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

}  // namespace

/// All but the last are opened for the first frame, groundtruth.txt for the first pose.
struct RgbdSequenceWriter::Lists {
  std::optional<detail::TableWriter> rgb, depth, associations, groundtruth;

  Lists() = default;  // none yet
  Lists(const fs::path& folder, bool with_depth) {
    fs::create_directories(folder / "rgb");
    rgb.emplace(folder / "rgb.txt");
    write_heading(*rgb, "color images", "timestamp filename");
    if (!with_depth) return;
    fs::create_directories(folder / "depth");
    depth.emplace(folder / "depth.txt");
    write_heading(*depth, "depth maps", "timestamp filename");
    associations.emplace(folder / "associations.txt");  // ORB-SLAM takes no comment in this one
  }
};

RgbdSequenceWriter::RgbdSequenceWriter(const fs::path& folder, const CameraParameters& camera,
                                       const RgbdSequenceWriterOptions& options)
    : folder_(folder), camera_(camera), lists_(std::make_unique<Lists>()) {
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

RgbdSequenceWriter::RgbdSequenceWriter(RgbdSequenceWriter&&) noexcept = default;
RgbdSequenceWriter& RgbdSequenceWriter::operator=(RgbdSequenceWriter&&) noexcept = default;
RgbdSequenceWriter::~RgbdSequenceWriter() = default;

void RgbdSequenceWriter::require_frame(const FrameView& frame) const {
  validate(frame, name);
  const auto refuse = [](const std::string& got, const std::string& want) {
    detail::throw_misuse(name, got, want);
  };
  if (!lists_) refuse("a frame after finish()", "all frames before");
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
  if (frame.depth.empty() == lists_->depth.has_value()) {
    refuse(frame.depth.empty() ? "a frame without depth" : "a frame with depth",
           "depth in every frame or in none");
  }
}

void RgbdSequenceWriter::write_frame(const FrameView& frame) {
  // All or none: had rgb.txt been opened alone, the next frame would lose its depth.
  if (!lists_->rgb) *lists_ = Lists(folder_, !frame.depth.empty());
  const std::string time = detail::time_text(frame.timestamp_s);
  const std::string image_row = time + " rgb/" + time + ".png";
  const std::string depth_row = time + " depth/" + time + ".png";
  detail::write_png(folder_ / "rgb" / (time + ".png"), frame.image);
  if (lists_->depth) {
    detail::write_png(folder_ / "depth" / (time + ".png"),
                      depth_image(frame, camera_.depth_units_per_metre));
    lists_->depth->line(depth_row);
    lists_->depth->flush();
  }
  lists_->rgb->line(image_row);
  lists_->rgb->flush();
  if (lists_->associations) {
    lists_->associations->line(image_row + ' ' + depth_row);
    lists_->associations->flush();
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
  const std::string row =
      detail::trajectory_row_text(frame.timestamp_s, rotation, translation, name);
  write_frame(frame);
  std::optional<detail::TableWriter>& groundtruth = lists_->groundtruth;
  if (!groundtruth) {
    groundtruth.emplace(folder_ / "groundtruth.txt");
    write_heading(*groundtruth, "ground truth trajectory", "timestamp tx ty tz qx qy qz qw");
  }
  groundtruth->line(row);
  groundtruth->flush();
}

void RgbdSequenceWriter::finish() {
  const std::unique_ptr<Lists> lists = std::move(lists_);
  if (!lists) return;
  for (auto* table : {&lists->rgb, &lists->depth, &lists->associations, &lists->groundtruth}) {
    if (*table) (*table)->close();
  }
}

}  // namespace dynfilter
