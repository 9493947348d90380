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
#include "io/file_error.hpp"
#include "io/frame_names.hpp"
#include "io/image_file.hpp"
#include "io/text_table.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;

/// An image as a list names it.
struct ListedImage {
  double time_s = 0;
  std::string file;  // as written; empty: no image
  fs::path path;
  fs::path list;         // or the folder, for an image that no list names
  std::size_t line = 0;  // 0: no list
};

struct ListedFrame {
  ListedImage image;
  ListedImage depth;  // without a file, if it is not listed beside the image
};

/// The lists of a folder, before images are paired.
struct ImageLists {
  bool are_pairs = false;  // of associations.txt
  std::vector<ListedFrame> frames;
  std::vector<ListedFrame> depths;  // images of depth.txt, to be paired with those of the frames

  bool has_depth() const { return are_pairs || !depths.empty(); }
};

/// Reads a list of times and files, two a row for pairs; the files lie in the folder. Refuses a
/// time that occurs twice, and times that are no seconds.
std::vector<ListedFrame> read_list(const fs::path& list, const fs::path& folder,
                                   bool of_pairs = false) {
  detail::require_regular_file(list);
  detail::TableReader table(list);
  const auto listed_image = [&](std::size_t column) {
    const std::string& file = table.text(column + 1);
    return ListedImage{table.time(column), file, folder / file, list, table.line()};
  };
  std::vector<ListedFrame> frames;
  std::map<std::int64_t, std::size_t> lines;  // by time
  std::vector<double> times;
  std::vector<std::string> cells;  // the times as they are written
  while (table.next()) {
    table.require_columns(of_pairs ? 4 : 2,
                          of_pairs
                              ? "4: time and file of the colour image, time and file of the depth"
                              : "2: time, file");
    ListedFrame& frame = frames.emplace_back();
    frame.image = listed_image(0);
    if (of_pairs) frame.depth = listed_image(2);
    times.push_back(frame.image.time_s);
    cells.push_back(table.text(0));
    const auto [found, is_new] = lines.emplace(detail::microseconds(times.back()), table.line());
    if (is_new) continue;
    table.fail(detail::concatenate("time ", detail::time_text(times.back()), " is in line ",
                                   found->second, " already"));
  }
  if (detail::are_too_far_apart(times)) detail::throw_file_error(list, detail::far_apart_text);
  if (detail::are_numbers(cells)) {
    detail::throw_file_error(list, "its times number the frames; want seconds, as 1.0 and 2.0");
  }
  if (frames.empty()) {
    detail::throw_file_error(list, of_pairs ? "lists no pair of images" : "lists no image");
  }
  return frames;
}

/// Returns the images of a folder, in the order of their names; without any, those of its folders,
/// but for depth and masks.
std::vector<fs::path> image_files(const fs::path& folder, std::set<fs::path>& seen) {
  std::vector<fs::path> files, folders;
  if (!seen.insert(fs::canonical(folder)).second) return files;  // a link to a folder around it
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = detail::lower_case(entry.path().filename().string());
    const bool is_other =
        name[0] == '.' || name.rfind("depth", 0) == 0 || name.rfind("mask", 0) == 0;
    if (entry.is_directory()) {
      if (!is_other) folders.push_back(entry.path());
    } else if (detail::is_image_name(entry.path()) && entry.is_regular_file()) {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) {
    std::sort(folders.begin(), folders.end());
    std::stable_partition(folders.begin(), folders.end(),
                          [](const fs::path& inner) { return !fs::is_symlink(inner); });
    for (const fs::path& inner : folders) {
      for (fs::path& file : image_files(inner, seen)) files.push_back(std::move(file));
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<fs::path> image_files(const fs::path& folder) {
  std::set<fs::path> seen;
  return image_files(folder, seen);
}

/// Returns images by the times in their names, or else as 30 a second.
std::vector<ListedFrame> by_name(const std::vector<fs::path>& files, const fs::path& folder) {
  constexpr double frame_s = 1.0 / 30;
  std::vector<std::string> stems;
  std::map<std::int64_t, fs::path> times;
  for (const fs::path& file : files) {
    stems.push_back(file.stem().string());
    if (const auto time_s = detail::time_of_name(stems.back()))
      times.emplace(detail::microseconds(*time_s), file);
  }
  const bool are_times = times.size() == files.size() && !detail::are_numbers(stems);
  std::vector<ListedFrame> frames;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const double time_s =
        are_times ? *detail::time_of_name(stems[i]) : static_cast<double>(i) * frame_s;
    const std::string file = files[i].lexically_relative(folder).string();
    frames.push_back({{time_s, file, files[i], folder, 0}, {}});
  }
  return frames;
}

/// Returns the images of a sequence of KITTI's odometry, whose times are in a file of their own.
std::vector<ListedFrame> read_kitti(const fs::path& folder) {
  fs::path images = folder / "image_2";
  if (!detail::exists(images)) images = folder / "image_0";
  if (!detail::exists(images)) {
    detail::throw_file_error(folder, "holds times.txt, but neither image_2 nor image_0");
  }
  std::vector<ListedFrame> frames = by_name(image_files(images), images);
  detail::require_regular_file(folder / "times.txt");
  detail::TableReader table(folder / "times.txt");
  std::size_t i = 0;
  for (; table.next(); ++i) {
    if (i < frames.size()) frames[i].image.time_s = table.time(0);
  }
  if (i != frames.size() || frames.empty()) {
    detail::throw_file_error(table.path(),
                             detail::concatenate("has ", i, " times for the ", frames.size(),
                                                 " images in ", images.string()));
  }
  return frames;
}

/// Reads the lists of TUM, EuRoC's csv or KITTI's times, or takes the images of a plain folder by
/// their names.
ImageLists read_image_lists(const fs::path& folder) {
  const auto has = [&](const fs::path& file) { return detail::exists(folder / file); };
  if (has("associations.txt")) {
    return {true, read_list(folder / "associations.txt", folder, true), {}};
  }
  if (has("rgb.txt")) {
    ImageLists lists{false, read_list(folder / "rgb.txt", folder), {}};
    if (has("depth.txt")) lists.depths = read_list(folder / "depth.txt", folder);
    return lists;
  }
  for (const fs::path camera : {"mav0/cam0", "cam0", ""}) {
    if (!has(camera / "data.csv")) continue;
    return {false, read_list(folder / camera / "data.csv", folder / camera / "data"), {}};
  }
  if (has("times.txt")) return {false, read_kitti(folder), {}};
  ImageLists lists{false, by_name(image_files(folder), folder), {}};
  if (lists.frames.empty()) {
    detail::throw_file_error(
        folder,
        "holds neither associations.txt nor rgb.txt, EuRoC's data.csv, KITTI's "
        "times.txt or images");
  }
  return lists;
}

/// Pairs the images by time, unless they are pairs that no offset moves, or of colour only.
std::vector<ListedFrame> frames_of(const fs::path& folder, ImageLists lists,
                                   const RgbdSequenceOptions& options, double offset_s) {
  if (lists.are_pairs ? offset_s == 0 : lists.depths.empty()) return std::move(lists.frames);
  std::vector<double> times, depth_times;
  for (const ListedFrame& frame : lists.frames) times.push_back(frame.image.time_s + offset_s);
  if (lists.are_pairs) {
    std::set<std::int64_t> seen;
    for (const ListedFrame& frame : lists.frames) {
      const bool is_new = seen.insert(detail::microseconds(frame.depth.time_s)).second;
      if (is_new) lists.depths.push_back({frame.depth, {}});
    }
  }
  for (const ListedFrame& depth : lists.depths) depth_times.push_back(depth.image.time_s);
  std::vector<ListedFrame> frames;
  for (const auto& [i, j] : associate(times, depth_times, options.max_time_difference_s)) {
    frames.push_back({lists.frames[i].image, lists.depths[j].image});
  }
  if (!frames.empty()) return frames;
  const std::string names = lists.are_pairs ? "associations.txt" : "rgb.txt and depth.txt";
  const std::string moved =
      offset_s == 0 ? "" : detail::concatenate(" with a depth offset of ", offset_s, " s");
  detail::throw_file_error(
      folder, detail::concatenate("no image of ", names, " lie ", options.max_time_difference_s,
                                  " s apart or less", moved));
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
    for (ListedFrame& beside : by_name(image_files(folder), folder)) others.push_back(beside);
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
  return entry;
}

/// Prints the file to write for a sequence without one: the data sets give the camera on a web
/// page.
[[noreturn]] void throw_no_camera(const fs::path& path) {
  throw std::runtime_error(
      detail::shown(path.string()) +
      ": there is no such camera file. Write it with these lines, or name another one or one of "
      "tum1, tum2, tum3 and bonn. The values "
      "are those of TUM's freiburg3 camera: replace them by those of the camera that recorded the "
      "sequence.\n"
      "%YAML:1.0\n---\nCamera.fx: 535.4\nCamera.fy: 539.2\nCamera.cx: 320.1\nCamera.cy: 247.6\n"
      "Camera.k1: 0.0\nCamera.k2: 0.0\nCamera.p1: 0.0\nCamera.p2: 0.0\nCamera.k3: 0.0\n"
      "Camera.width: 640\nCamera.height: 480\nCamera.fps: 30.0\nDepthMapFactor: 5000.0\n");
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
  if (detail::type_of(folder) != fs::file_type::directory) {
    detail::throw_file_error(folder, "there is no such folder");
  }

  ImageLists lists = read_image_lists(folder);
  camera_file_ = options.camera_file.empty() ? folder / "camera.yaml" : options.camera_file;
  const bool is_name = known_camera(camera_file_.string()).has_value();
  if (is_name || detail::exists(camera_file_)) {
    camera_ = read_camera(camera_file_);
  } else if ((options.needs_camera && lists.has_depth()) || !options.camera_file.empty()) {
    throw_no_camera(camera_file_);
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
