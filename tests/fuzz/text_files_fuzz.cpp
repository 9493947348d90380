// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Reads arbitrary text as each kind of file: a trajectory, a camera, a sequence's lists, a table of
// masks, a host's settings. It is refused with an error that names the file, or what was read is as
// promised and survives being written.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/evaluation/sequence_camera.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "fuzz/report.hpp"
#include "plugin/plugin_settings.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

const TemporaryFolder& folder() {
  static const TemporaryFolder made;
  return made;
}

std::string check_trajectory(const std::string& text) {
  const Trajectory read = read_trajectory(folder().write("trajectory.txt", text));
  if (read.empty()) return "a trajectory without poses";
  for (std::size_t i = 0; i < read.size(); ++i) {
    const TimedPose& pose = read[i];
    if (!detail::is_time_in_seconds(pose.timestamp_s)) return "a time that is no time";
    if (!std::isfinite(cv::norm(pose.translation))) return "a place that is not finite";
    const cv::Matx33d product = pose.rotation * pose.rotation.t();
    if (cv::norm(product - cv::Matx33d::eye()) > 1e-9) return "a rotation that is none";
    if (i > 0 &&
        detail::microseconds(pose.timestamp_s) < detail::microseconds(read[i - 1].timestamp_s)) {
      return "times that fall";
    }
  }
  return {};
}

std::string check_camera(const std::string& text) {
  const SequenceCamera read =
      read_camera(folder().write(text[0] == '{' ? "camera.json" : "camera.yaml", text));
  if (!(read.fx > 0 && read.fy > 0 && std::isfinite(read.fx) && std::isfinite(read.fy))) {
    return "a focal length that is none";
  }
  if (!(read.depth_units_per_metre >= 0)) return "a depth factor that is none";
  return {};
}

/// A folder whose lists are right; what they name is never decoded here.
fs::path make_scene(const fs::path& name) {
  for (const char* image : {"rgb/1.5.png", "rgb/2.5.png", "depth/1.5.png", "depth/2.51.png"}) {
    folder().write(name / image, "no image");
  }
  folder().write(name / "camera.yaml",
                 "%YAML:1.0\nCamera.fx: 5.0\nCamera.fy: 6.0\nCamera.cx: 3.0\nCamera.cy: 2.0\n"
                 "DepthMapFactor: 1000.0\n");
  folder().write(name / "depth.txt", "1.5 depth/1.5.png\n2.51 depth/2.51.png\n");
  folder().write(name / "rgb.txt", "1.5 rgb/1.5.png\n2.5 rgb/2.5.png\n");
  return folder() / name;
}

std::string check_sequence(const std::string& text, bool is_associated) {
  static const fs::path scenes[] = {make_scene("listed"), make_scene("associated")};
  const fs::path& scene = scenes[is_associated ? 1 : 0];
  folder().write(scene / (is_associated ? "associations.txt" : "rgb.txt"), text);
  const RgbdSequence sequence(scene);
  if (sequence.size() == 0) return "a sequence without frames";
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const RgbdSequenceEntry& entry = sequence.entry(i);
    if (!detail::is_time_in_seconds(entry.timestamp_s)) return "a time that is no time";
    if (!fs::exists(entry.image_path)) return "an image that is missing";
    if (sequence.has_depth() == entry.depth_path.empty()) return "a depth image that is missing";
    if (i > 0 && entry.timestamp_s < sequence.entry(i - 1).timestamp_s) return "times that fall";
  }
  return {};
}

std::string check_masks(const std::string& text) {
  static const bool has_mask = cv::imwrite(
      [] {
        fs::create_directories(folder() / "masks");
        return (folder() / "masks/1.5.png").string();
      }(),
      cv::Mat(6, 8, CV_8UC1, cv::Scalar(1)));
  if (!has_mask) return "the mask cannot be written";
  folder().write("masks/instances.csv", text);
  MaskFolderSegmenter segmenter(folder() / "masks");
  FrameView frame;
  frame.timestamp_s = 1.5;
  frame.image = cv::Mat(6, 8, CV_8UC3, cv::Scalar::all(0));
  const Segmentation read = segmenter.segment(frame);  // which validates it
  return read.image_size == frame.image.size() ? "" : "masks of another size";
}

/// Reads settings as the plugin does, which opens no folder that they name.
std::string check_settings(const std::string& text) {
  const std::string file = folder().write("settings.yaml", text).string();
  const detail::PluginSettings settings = detail::read_plugin_settings(file, "dynfilter");
  const bool is_finite = std::isfinite(settings.filter.mask_culler.margin_px) &&
                         std::isfinite(settings.depth_units_per_metre);
  return is_finite ? "" : "a number that is none";
}

std::string check_file(const std::string& text) {
  if (text.empty()) return {};
  const std::string content = text.substr(1);
  try {
    switch (static_cast<unsigned char>(text[0]) % 6) {
      case 0:
        return check_trajectory(content);
      case 1:
        return check_camera(content);
      case 2:
        return check_sequence(content, false);
      case 3:
        return check_sequence(content, true);
      case 4:
        return check_masks(content);
      default:
        return check_settings(content);
    }
  } catch (const cv::Exception& error) {
    return std::string("an error of OpenCV: ") + error.what();
  } catch (const std::runtime_error& error) {
    const bool names_file =
        std::string(error.what()).find(folder().path().string()) != std::string::npos;
    return names_file ? "" : std::string("the error names no file: ") + error.what();
  }
}

}  // namespace
}  // namespace dynfilter::testing

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dynfilter::testing;
  return report(check_file({reinterpret_cast<const char*>(data), size}));
}
