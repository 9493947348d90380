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

/// Refuses a time that occurs twice in a list, and times that are no seconds.
class DistinctTimes {
 public:
  void add(const TableReader& table, double time_s) {
    const auto [found, is_new] = lines_.emplace(microseconds(time_s), table.line());
    if (!is_new) {
      table.fail("time " + time_text(time_s) + " is in line " + std::to_string(found->second) +
                 " already");
    }
    times_.push_back(time_s);
    cells_.push_back(table.text(0));
  }

  void finish(const TableReader& table) const {
    if (are_too_far_apart(times_)) throw_file_error(table.path(), far_apart_text);
    if (!are_numbers(cells_)) return;
    throw_file_error(table.path(), "its times number the frames; want seconds, as 1.0 and 2.0");
  }

 private:
  std::map<std::int64_t, std::size_t> lines_;
  std::vector<double> times_;
  std::vector<std::string> cells_;  // the times as they are written
};

ListedImage listed_image(const TableReader& table, std::size_t column, const fs::path& folder) {
  return {table.time(column), table.text(column + 1), folder / table.text(column + 1), table.path(),
          table.line()};
}

TableReader open_table(const fs::path& path) {
  require_regular_file(path);
  return TableReader(path);
}

/// Reads a list of times and files, which lie in the folder.
std::vector<ListedImage> read_list(const fs::path& list, const fs::path& folder) {
  TableReader table = open_table(list);
  std::vector<ListedImage> images;
  DistinctTimes times;
  while (table.next()) {
    table.require_columns(2, "2: time, file");
    images.push_back(listed_image(table, 0, folder));
    times.add(table, images.back().time_s);
  }
  times.finish(table);
  if (images.empty()) throw_file_error(table.path(), "lists no image");
  return images;
}

std::vector<ListedFrame> read_associations(const fs::path& folder) {
  TableReader table = open_table(folder / "associations.txt");
  std::vector<ListedFrame> frames;
  DistinctTimes times;
  while (table.next()) {
    table.require_columns(4, "4: time and file of the colour image, time and file of the depth");
    // Variables of their own: g++ 9 leaks an aggregate's first member when the second one's
    // initialiser throws.
    ListedImage image = listed_image(table, 0, folder);
    ListedImage depth = listed_image(table, 2, folder);
    frames.push_back({std::move(image), std::move(depth)});
    times.add(table, frames.back().image.time_s);
  }
  times.finish(table);
  if (frames.empty()) throw_file_error(table.path(), "lists no pair of images");
  return frames;
}

std::vector<ListedFrame> colour_only(std::vector<ListedImage> images) {
  std::vector<ListedFrame> frames;
  for (ListedImage& image : images) frames.push_back({std::move(image), {}});
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
std::vector<ListedImage> by_name(const std::vector<fs::path>& files, const fs::path& folder) {
  constexpr double frame_s = 1.0 / 30;
  std::vector<std::string> stems;
  std::map<std::int64_t, fs::path> times;
  for (const fs::path& file : files) {
    stems.push_back(file.stem().string());
    if (const auto time_s = time_of_name(stems.back())) times.emplace(microseconds(*time_s), file);
  }
  const bool are_times = times.size() == files.size() && !are_numbers(stems);
  std::vector<ListedImage> images;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const double time_s = are_times ? *time_of_name(stems[i]) : static_cast<double>(i) * frame_s;
    images.push_back({time_s, files[i].lexically_relative(folder).string(), files[i], folder, 0});
  }
  return images;
}

/// Returns the images of a sequence of KITTI's odometry, whose times are in a file of their own.
std::vector<ListedImage> read_kitti(const fs::path& folder) {
  fs::path images_folder = folder / "image_2";
  if (!detail::exists(images_folder)) images_folder = folder / "image_0";
  if (!detail::exists(images_folder)) {
    throw_file_error(folder, "holds times.txt, but neither image_2 nor image_0");
  }
  std::vector<ListedImage> images = by_name(image_files(images_folder), images_folder);
  TableReader table = open_table(folder / "times.txt");
  std::size_t i = 0;
  for (; table.next(); ++i) {
    if (i < images.size()) images[i].time_s = table.time(0);
  }
  if (i != images.size() || images.empty()) {
    throw_file_error(table.path(), concatenate("has ", i, " times for the ", images.size(),
                                               " images in ", images_folder.string()));
  }
  return images;
}

}  // namespace

ImageLists read_image_lists(const fs::path& folder) {
  ImageLists lists;
  lists.has_associations = detail::exists(folder / "associations.txt");
  if (lists.has_associations) {
    lists.frames = read_associations(folder);
    return lists;
  }
  if (detail::exists(folder / "rgb.txt")) {
    lists.images = read_list(folder / "rgb.txt", folder);
    if (detail::exists(folder / "depth.txt")) {
      lists.depths = read_list(folder / "depth.txt", folder);
    } else {
      lists.frames = colour_only(std::move(lists.images));
    }
    return lists;
  }
  for (const char* camera : {"mav0/cam0", "cam0", ""}) {
    const fs::path csv = folder / camera / "data.csv";
    if (!detail::exists(csv)) continue;
    lists.frames = colour_only(read_list(csv, folder / camera / "data"));
    return lists;
  }
  if (detail::exists(folder / "times.txt")) {
    lists.frames = colour_only(read_kitti(folder));
    return lists;
  }
  lists.frames = colour_only(by_name(image_files(folder), folder));
  if (lists.frames.empty()) {
    throw_file_error(folder,
                     "holds neither associations.txt nor rgb.txt, EuRoC's data.csv, KITTI's "
                     "times.txt or images");
  }
  return lists;
}

}  // namespace dynfilter::detail
