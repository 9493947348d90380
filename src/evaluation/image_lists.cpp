// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "image_lists.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"
#include "io/frame_names.hpp"
#include "io/text_table.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;

/// Reads a list of times and files, two a row for pairs; the files lie in the folder. Refuses a
/// time that occurs twice, and times that are no seconds.
std::vector<ListedFrame> read_list(const fs::path& list, const fs::path& folder,
                                   bool of_pairs = false) {
  require_regular_file(list);
  TableReader table(list);
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
    const auto [found, is_new] = lines.emplace(microseconds(times.back()), table.line());
    if (is_new) continue;
    table.fail(
        concatenate("time ", time_text(times.back()), " is in line ", found->second, " already"));
  }
  if (are_too_far_apart(times)) throw_file_error(list, far_apart_text);
  if (are_numbers(cells)) {
    throw_file_error(list, "its times number the frames; want seconds, as 1.0 and 2.0");
  }
  if (frames.empty()) {
    throw_file_error(list, of_pairs ? "lists no pair of images" : "lists no image");
  }
  return frames;
}

/// Returns the images of a folder, in the order of their names; without any, those of its folders,
/// but for depth and masks.
std::vector<fs::path> image_files(const fs::path& folder) {
  std::vector<fs::path> files, folders;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = lower_case(entry.path().filename().string());
    const bool is_other =
        name[0] == '.' || name.rfind("depth", 0) == 0 || name.rfind("mask", 0) == 0;
    if (entry.is_directory()) {
      if (!is_other) folders.push_back(entry.path());
    } else if (is_image_name(entry.path()) && entry.is_regular_file()) {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) {
    for (const fs::path& inner : folders) {
      for (fs::path& file : image_files(inner)) files.push_back(std::move(file));
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Returns images by the times in their names, or else as 30 a second.
std::vector<ListedFrame> by_name(const std::vector<fs::path>& files, const fs::path& folder) {
  constexpr double frame_s = 1.0 / 30;
  std::vector<std::string> stems;
  std::map<std::int64_t, fs::path> times;
  for (const fs::path& file : files) {
    stems.push_back(file.stem().string());
    if (const auto time_s = time_of_name(stems.back())) times.emplace(microseconds(*time_s), file);
  }
  const bool are_times = times.size() == files.size() && !are_numbers(stems);
  std::vector<ListedFrame> frames;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const double time_s = are_times ? *time_of_name(stems[i]) : static_cast<double>(i) * frame_s;
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
    throw_file_error(folder, "holds times.txt, but neither image_2 nor image_0");
  }
  std::vector<ListedFrame> frames = by_name(image_files(images), images);
  require_regular_file(folder / "times.txt");
  TableReader table(folder / "times.txt");
  std::size_t i = 0;
  for (; table.next(); ++i) {
    if (i < frames.size()) frames[i].image.time_s = table.time(0);
  }
  if (i != frames.size() || frames.empty()) {
    throw_file_error(table.path(), concatenate("has ", i, " times for the ", frames.size(),
                                               " images in ", images.string()));
  }
  return frames;
}

}  // namespace

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
    throw_file_error(folder,
                     "holds neither associations.txt nor rgb.txt, EuRoC's data.csv, KITTI's "
                     "times.txt or images");
  }
  return lists;
}

}  // namespace dynfilter::detail
