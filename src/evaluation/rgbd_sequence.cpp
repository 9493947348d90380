// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/rgbd_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/evaluation/association.hpp"
#include "evaluation/image_lists.hpp"
#include "io/file_error.hpp"
#include "io/image_file.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;
using detail::by_name;
using detail::ImageLists;
using detail::ListedFrame;
using detail::ListedImage;

/// Returns the frames with depth: the pairs, if no offset moves them, or images paired by time;
/// or all, of colour only.
std::vector<ListedFrame> frames_of(const fs::path& folder, ImageLists lists,
                                   const RgbdSequenceOptions& options, double offset_s) {
  if (!lists.has_depth()) return std::move(lists.frames);
  std::vector<ListedFrame> pairs;
  std::vector<double> times, depth_times;
  for (const ListedFrame& frame : lists.frames) {
    times.push_back(frame.image.time_s + offset_s);
    if (!frame.depth.file.empty()) pairs.push_back(frame);
  }
  if (lists.are_pairs && offset_s == 0) return pairs;
  std::set<std::int64_t> seen;
  for (const ListedFrame& frame : pairs) {
    const bool is_new = seen.insert(detail::microseconds(frame.depth.time_s)).second;
    if (is_new) lists.depths.push_back({frame.depth, {}});
  }
  for (const ListedFrame& depth : lists.depths) depth_times.push_back(depth.image.time_s);
  std::vector<ListedFrame> frames;
  for (const auto& [i, j] : associate(times, depth_times, options.max_time_difference_s)) {
    frames.push_back({lists.frames[i].image, lists.depths[j].image});
  }
  if (!frames.empty()) return frames;
  const bool has_list = lists.depths.front().image.line > 0;
  const double begin_s = *std::min_element(times.begin(), times.end()) - offset_s,
               depth_begin_s = *std::min_element(depth_times.begin(), depth_times.end()),
               apart_s = depth_begin_s - begin_s;
  std::string why =
      offset_s == 0 ? "" : detail::concatenate(" with a depth offset of ", offset_s, " s");
  why += ": images begin at " + detail::time_text(begin_s) + ", depth at " +
         detail::time_text(depth_begin_s);
  if (std::abs(apart_s) > options.max_time_difference_s) {
    const std::string apart = detail::fixed_decimals(apart_s, 3);
    why += ", by another clock? " +
           (std::abs(apart_s) <= max_depth_offset_s
                ? "If so: --depth-offset " + apart + ", in code depth_offset_s"
            : has_list ? "If so, move its list: awk '!/^#/ {$1 = sprintf(\"%.6f\", $1 - (" + apart +
                             "))} 1' depth.txt >moved.txt"
                       : "Name both by one clock");
  }
  const std::string names = lists.are_pairs ? "associations.txt"
                            : has_list      ? "rgb.txt and depth.txt"
                                            : "the folder";
  detail::throw_file_error(
      folder, detail::concatenate("no image of ", names, " lie ", options.max_time_difference_s,
                                  " s apart or less", why));
}

/// Adds the images without depth: those of the lists, and those that lie beside the frames'.
void add_unpaired(std::vector<ListedFrame> others, std::vector<ListedFrame>& frames) {
  std::set<fs::path> files, folders;
  std::set<std::int64_t> times;
  const auto is_new = [&](const ListedImage& image) {
    return files.insert(image.path).second &&
           times.insert(detail::microseconds(image.time_s)).second;
  };
  for (const ListedFrame& frame : frames) {
    is_new(frame.image);
    folders.insert(frame.image.path.parent_path());
  }
  for (const fs::path& folder : folders) {
    for (ListedFrame& beside : by_name(detail::find_images(folder).colour, folder)) {
      others.push_back(beside);
    }
  }
  for (const ListedFrame& other : others) {
    const bool is_file = fs::is_regular_file(other.image.path);
    if (is_file && is_new(other.image)) frames.push_back({other.image, {}});
  }
}

[[noreturn]] void refuse(const ListedImage& image, const std::string& what) {
  const std::string line = image.line == 0 ? "" : detail::concatenate(":", image.line);
  throw std::runtime_error(
      detail::shown(image.list.string() + line + ": " + image.file + " " + what));
}

void require_files(const std::vector<ListedFrame>& frames) {
  const ListedImage* first_missing = nullptr;
  std::size_t missing = 0;
  std::size_t listed = 0;
  const auto look = [&](const ListedImage& image) {
    if (image.file.empty()) return;
    if (detail::has_control(image.file)) refuse(image, "has a control character in its name");
    ++listed;
    std::error_code failure;
    const fs::file_type type = fs::status(image.path, failure).type();
    if (type == fs::file_type::regular) return;
    if (type == fs::file_type::none) refuse(image, "cannot be read: " + failure.message());
    ++missing;
    if (first_missing == nullptr) first_missing = &image;
  };
  for (const ListedFrame& frame : frames) {
    look(frame.image);
    look(frame.depth);
  }
  if (first_missing == nullptr) return;
  refuse(*first_missing, detail::concatenate("is missing (", missing, " of the ", listed,
                                             " image files of the sequence are)"));
}

RgbdSequenceEntry entry_of(const ListedFrame& frame) {
  RgbdSequenceEntry entry;
  entry.timestamp_s = frame.image.time_s;
  entry.image_path = frame.image.path;
  entry.depth_timestamp_s = frame.depth.file.empty() ? frame.image.time_s : frame.depth.time_s;
  entry.depth_path = frame.depth.path;
  entry.stem = frame.image.path.stem().string();
  entry.has_time = frame.image.has_time;
  return entry;
}

/// Prints the file to write for a sequence without one: the data sets give the camera on a web
/// page.
[[noreturn]] void throw_no_camera(const fs::path& path) {
  throw std::runtime_error(
      detail::shown(path.string()) +
      ": there is no such camera file. Write it with these lines, or name another one or one of "
      "tum1, tum2, tum3 and bonn (--camera tum3; in code camera_file). The values are those of "
      "TUM's freiburg3 camera: replace them by those of the camera that recorded the sequence.\n"
      "%YAML:1.0\n---\nCamera.fx: 535.4\nCamera.fy: 539.2\nCamera.cx: 320.1\nCamera.cy: 247.6\n"
      "Camera.k1: 0.0\nCamera.k2: 0.0\nCamera.p1: 0.0\nCamera.p2: 0.0\nCamera.k3: 0.0\n"
      "Camera.width: 640\nCamera.height: 480\nCamera.fps: 30.0\nDepthMapFactor: 5000.0\n");
}

/// Returns the camera file of a folder: ours, or where depth needs it the one of Open3D or NeRF.
fs::path own_camera(const fs::path& folder, bool has_depth) {
  for (const char* name : {"camera_intrinsic.json", "intrinsic.json", "transforms.json"}) {
    const bool is_used = has_depth && !detail::exists(folder / "camera.yaml");
    if (is_used && detail::exists(folder / name)) return folder / name;
  }
  return folder / "camera.yaml";
}

}  // namespace

RgbdSequence::RgbdSequence(const fs::path& folder, const RgbdSequenceOptions& options)
    : folder_(folder) {
  constexpr detail::OptionCheck require("RgbdSequence");
  const double reach_s = options.max_time_difference_s,
               offset_s = options.depth_offset_s.value_or(0);
  require(reach_s >= 0 && detail::is_time_in_seconds(reach_s), "max_time_difference_s", reach_s,
          "seconds, at least 0");
  require(std::abs(offset_s) <= max_depth_offset_s, "depth_offset_s", offset_s,
          "seconds within ±10");
  if (!detail::exists(folder)) detail::throw_file_error(folder, "there is no such folder");
  if (detail::type_of(folder) != fs::file_type::directory) {
    const std::string advice = detail::advice_for(folder);
    detail::throw_file_error(folder, "is a file; want a folder of images" +
                                         (advice.empty() ? advice : ". It is " + advice));
  }

  ImageLists lists = detail::read_image_lists(folder);
  note_ = lists.note;
  if (options.depth_offset_s && !lists.has_depth()) {
    detail::throw_file_error(folder, "has no depth images for a depth offset to pair");
  }
  camera_file_ =
      options.camera_file.empty() ? own_camera(folder, lists.has_depth()) : options.camera_file;
  const bool is_name = known_camera(camera_file_.string()).has_value();
  if (is_name || detail::exists(camera_file_)) {
    camera_ = read_camera(camera_file_);
  } else if ((options.needs_camera && lists.has_depth()) || !options.camera_file.empty()) {
    throw_no_camera(camera_file_);
  }
  if (options.needs_camera && lists.has_depth() && camera_.depth_units_per_metre == 0) {
    detail::throw_file_error(camera_file_, "DepthMapFactor is missing");
  }
  depth_offset_s_ = options.depth_offset_s.value_or(camera_.depth_offset_s);
  has_depth_ = lists.has_depth();

  std::vector<ListedFrame> frames = frames_of(folder, lists, options, depth_offset_s_);
  if (has_depth_) unpaired_ = lists.frames.size() - frames.size();
  if (options.keeps_unpaired) add_unpaired(lists.frames, frames);
  require_files(frames);
  std::stable_sort(frames.begin(), frames.end(), [](const ListedFrame& a, const ListedFrame& b) {
    return a.image.time_s < b.image.time_s;
  });
  for (const ListedFrame& frame : frames) entries_.push_back(entry_of(frame));
  std::map<std::string, std::set<double>> times;
  for (const auto* images : {&frames, &lists.frames}) {
    for (const auto& [image, depth] : *images) times[image.path.stem()].insert(image.time_s);
  }
  for (const auto& [stem, of_stem] : times) {
    if (of_stem.size() == 1) times_by_stem_.emplace(stem, *of_stem.begin());
  }
}

const RgbdSequenceEntry& RgbdSequence::entry(std::size_t i) const {
  if (i >= entries_.size()) {
    detail::throw_misuse("RgbdSequence", detail::concatenate("frame ", i),
                         detail::concatenate("a frame below ", entries_.size()));
  }
  return entries_[i];
}

FrameView RgbdSequence::read(std::size_t i) const {
  const RgbdSequenceEntry& listed = entry(i);
  FrameView frame;
  frame.id = i;
  frame.timestamp_s = listed.timestamp_s;
  const double units = camera_.depth_units_per_metre;
  frame.metres_per_unit = units > 0 ? 1.0 / units : 0;
  // Depth images ignore an orientation tag, so colour images must ignore it too.
  frame.image = detail::read_image(
      listed.image_path, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION, camera_.image_size);
  const cv::Size size = frame.image.size();
  if (!camera_.image_size.empty() && size != camera_.image_size) {
    detail::throw_file_error(listed.image_path, detail::size_name(size) + " pixels, but " +
                                                    camera_file_.string() + " says " +
                                                    detail::size_name(camera_.image_size) +
                                                    "; is the camera file another camera's?");
  }
  if (listed.depth_path.empty()) return frame;

  cv::Mat depth = detail::read_image(listed.depth_path, cv::IMREAD_UNCHANGED, size);
  if (depth.type() == CV_64FC1) depth.convertTo(depth, CV_32F);
  if (depth.type() != CV_16UC1 && depth.type() != CV_32FC1) {
    detail::throw_file_error(listed.depth_path,
                             "a depth image of type " + detail::type_name(depth) +
                                 "; want CV_16UC1 (a 16-bit grey PNG) or CV_32FC1 in metres");
  }
  if (depth.type() == CV_32FC1) {
    frame.metres_per_unit = 1;
  } else {
    constexpr double no_depth = 65535;  // of simulators, and of floats that were converted
    depth.setTo(0, depth == no_depth);
  }
  frame.depth = detail::fitted(depth, size, listed.depth_path, listed.image_path.string(),
                               "; register depth to the images");
  return frame;
}

std::optional<fs::path> RgbdSequence::groundtruth_file() const {
  const fs::path path = folder_ / "groundtruth.txt";
  if (!detail::exists(path)) return {};
  detail::require_regular_file(path);
  return path;
}

std::optional<fs::path> RgbdSequence::subfolder(const char* name) const {
  const fs::path path = folder_ / name;
  const fs::file_type type = detail::type_of(path);
  if (type == fs::file_type::not_found) return {};
  if (type != fs::file_type::directory) detail::throw_file_error(path, "is not a folder");
  return path;
}

}  // namespace dynfilter
