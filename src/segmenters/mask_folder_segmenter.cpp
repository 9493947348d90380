// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"
#include "io/frame_names.hpp"
#include "io/image_file.hpp"
#include "io/text_table.hpp"
#include "mask_image.hpp"
#include "mask_table.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;

/// One row of instances.csv.
struct TableRow {
  int label = 0;
  Instance instance;
  std::optional<double> mask_time_s;  // unknown without the column, or if its cell is empty
};

constexpr std::size_t mask_time_column = 8;
constexpr double same_time_s = 0.001;  // A larger one gives a frame its neighbour's mask and rows.

TableRow read_row(const detail::TableReader& table, bool has_mask_time) {
  table.require_columns(
      mask_time_column + (has_mask_time ? 1 : 0),
      has_mask_time ? detail::mask_table_header_with_time : detail::mask_table_header);
  TableRow row;
  row.label = table.integer(1, "instance", 1, detail::max_mask_label);
  row.instance.class_id = table.integer(2, "class_id");
  row.instance.score = static_cast<float>(table.number(3, "score"));
  row.instance.box = {table.integer(4, "x"), table.integer(5, "y"), table.integer(6, "width", 0),
                      table.integer(7, "height", 0)};
  if (!(row.instance.score >= 0 && row.instance.score <= 1)) {
    table.fail("score: got '" + table.text(3) + "'; want 0 to 1");
  }
  if (has_mask_time && !table.text(mask_time_column).empty()) {
    row.mask_time_s = detail::time_of_name(table.text(mask_time_column));
    if (row.mask_time_s) return row;
    table.fail("mask_time: got '" + table.text(mask_time_column) +
               "'; want a time in seconds, or nothing for the frame's own");
  }
  return row;
}

/// Reads the header; tells whether it has the column of the masks' own times.
bool read_header(detail::TableReader& table) {
  if (!table.next()) detail::throw_file_error(table.path(), "is empty");
  std::string header = table.text(0);
  for (std::size_t i = 1; i < table.columns(); ++i) header += ',' + table.text(i);
  const bool has_mask_time = header == detail::mask_table_header_with_time;
  if (has_mask_time || header == detail::mask_table_header) return has_mask_time;
  table.fail("got '" + header + "'; want the header " + detail::mask_table_header +
             ", with or without a last column mask_time");
}

/// Returns the PNG files of a folder. Throws std::runtime_error for a folder that holds none, and
/// says what it holds.
std::vector<fs::path> mask_files(const fs::path& folder, bool may_be_empty) {
  const fs::file_type type = detail::type_of(folder);
  if (type != fs::file_type::directory) {
    std::string what =
        type == fs::file_type::not_found ? "there is no such folder" : "is no folder";
    if (folder.is_relative()) what += ", that is, " + fs::absolute(folder).string();
    if (folder.native().rfind('~', 0) == 0) what += "; ~ is not replaced here";
    detail::throw_file_error(folder, what);
  }
  std::vector<fs::path> files;
  std::map<std::string, std::size_t> others;  // by what they are
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const fs::path& file = entry->path();
    const fs::file_type kind = detail::type_of(file);
    if (kind == fs::file_type::not_found) continue;  // a dangling symbolic link is no mask
    const std::string extension = detail::lower_case(file.extension().string());
    if (extension == ".png") {
      files.push_back(file);
    } else if (kind == fs::file_type::directory) {
      ++others["folder"];
    } else if (detail::is_image_name(file) || extension == ".npy" || extension == ".npz") {
      ++others[extension + " file"];
    }
  }
  if (error) {
    detail::throw_file_error(
        folder, "cannot be read: " + error.message() + "; want a folder of masks (*.png)");
  }
  if (!files.empty() || (may_be_empty && others.empty())) return files;
  std::string found;
  for (const auto& [kind, count] : others) {
    found += detail::concatenate(found.empty() ? ", but " : " and ", count, ' ', kind,
                                 count > 1 ? "s" : "");
  }
  detail::throw_file_error(folder, "holds no mask; want <time>.png files directly in it" + found);
}

/// Returns the name of a mask's frame: the file's, if a frame is called so.
std::string frame_of(const fs::path& mask, const std::map<std::string, double>& frame_times) {
  const std::string whole = mask.stem().string();
  return frame_times.count(whole) > 0 ? whole : detail::frame_stem(mask);
}

/// Scales a box from a mask to its frame.
cv::Rect scaled(const cv::Rect& box, cv::Size mask, cv::Size frame) {
  constexpr double least = std::numeric_limits<int>::min(), most = std::numeric_limits<int>::max();
  const auto scale = [&](int pixels, int from, int to) {
    return static_cast<int>(std::clamp(std::round(double{1} * pixels * to / from), least, most));
  };
  return {scale(box.x, mask.width, frame.width), scale(box.y, mask.height, frame.height),
          scale(box.width, mask.width, frame.width), scale(box.height, mask.height, frame.height)};
}

/// Returns the instances of a label map, with their rows of the table.
std::vector<Instance> labelled_instances(const cv::Mat& label_map,
                                         const std::map<int, Instance>& table,
                                         const fs::path& file) {
  std::vector<Instance> labels = instances_from_label_map(label_map);
  for (std::size_t k = 0; k < labels.size(); ++k) {
    if (!labels[k].mask.empty() && table.count(static_cast<int>(k + 1)) == 0) {
      detail::throw_file_error(
          file, detail::concatenate("label ", k + 1,
                                    " has no row in instances.csv: is the table "
                                    "of other masks? Without one, each label is a person"));
    }
  }
  std::vector<Instance> instances;
  instances.reserve(table.size());
  for (const auto& [label, row] : table) {
    Instance instance = row;
    const std::size_t k = static_cast<std::size_t>(label) - 1;
    if (k < labels.size()) {
      instance.mask = labels[k].mask;
      instance.mask_origin = labels[k].mask_origin;
    }
    instances.push_back(std::move(instance));
  }
  return instances;
}

}  // namespace

MaskFolderSegmenter::MaskFolderSegmenter(const fs::path& folder, const MaskFolderOptions& options)
    : folder_(folder), options_(options) {
  const double reach = options.max_time_difference_s;
  constexpr detail::OptionCheck require("MaskFolderSegmenter");
  require(reach >= 0 && detail::is_time_in_seconds(reach), "max_time_difference_s", reach,
          "at least 0");
  require(options.box_margin_px >= 0, "box_margin_px", options.box_margin_px, "at least 0");
  index_masks();
  const fs::path table = folder / detail::mask_table_name;
  has_table_ = detail::exists(table);
  if (has_table_) read_table(table);
}

std::optional<double> MaskFolderSegmenter::time_of(const std::string& stem) const {
  const auto frame = options_.frame_times.find(stem);
  return frame == options_.frame_times.end() ? detail::time_of_name(stem) : frame->second;
}

void MaskFolderSegmenter::index_masks() {
  std::vector<std::string> unknown;  // names that are no frame's
  for (const fs::path& file : mask_files(folder_, options_.allow_missing)) {
    detail::require_regular_file(file);
    const std::string stem = frame_of(file, options_.frame_times);
    const std::optional<double> time_s = time_of(stem);
    if (!time_s) {
      detail::throw_file_error(
          file, "the name of a mask must be its frame's time, such as 1341846434.710184.png");
    }
    if (options_.frame_times.count(stem) == 0) unknown.push_back(stem);
    const auto [found, is_new] =
        masks_.emplace(detail::microseconds(*time_s), Mask{fs::absolute(file), {}, {}});
    if (!is_new) {
      detail::throw_file_error(file, "has the same time as " + found->second.path.string());
    }
  }
  std::vector<double> times;
  times.reserve(unknown.size());
  for (const std::string& stem : unknown) times.push_back(*detail::time_of_name(stem));
  std::sort(times.begin(), times.end());
  if (detail::are_too_far_apart(times)) {
    detail::throw_file_error(folder_, std::string("by their names, ") + detail::far_apart_text);
  }
  if (!detail::are_numbers(unknown)) return;
  if (unknown.size() < masks_.size()) {  // masks of images that are no frames
    for (const double time_s : times) masks_.erase(detail::microseconds(time_s));
    return;
  }
  detail::throw_file_error(
      folder_, "its masks, such as " + masks_.begin()->second.path.filename().string() +
                   ", look numbered; want names by the frames' times, as 1341846434.710184.png");
}

void MaskFolderSegmenter::read_table(const fs::path& path) {
  detail::require_regular_file(path);
  detail::TableReader table(path, ",");
  const bool has_mask_time = read_header(table);
  while (table.next()) {
    const TableRow row = read_row(table, has_mask_time);
    const std::optional<double> time_s =
        time_of(frame_of(table.text(0) + ".png", options_.frame_times));
    if (!time_s) table.fail("frame: got '" + table.text(0) + "'; want a time in seconds");
    const auto mask = nearest(*time_s);
    if (!is_near(mask, *time_s, same_time_s)) {
      if (options_.allow_missing) continue;
      table.fail("frame " + table.text(0) + " has no mask " + table.text(0) + ".png");
    }
    Mask& entry = masks_.at(mask->first);
    if (!entry.instances.empty() && entry.time_s != row.mask_time_s) {
      table.fail("mask_time: got '" + table.text(mask_time_column) + "' for frame " +
                 table.text(0) + "; want that of its earlier lines");
    }
    entry.time_s = row.mask_time_s;
    if (!entry.instances.emplace(row.label, row.instance).second) {
      table.fail("instance " + table.text(1) + " of frame " + table.text(0) +
                 " is in an earlier line already");
    }
  }
}

bool MaskFolderSegmenter::has_mask(double timestamp_s) const {
  return detail::is_time_in_seconds(timestamp_s) &&
         is_near(nearest(timestamp_s), timestamp_s, options_.max_time_difference_s);
}

MaskFolderSegmenter::Masks::const_iterator MaskFolderSegmenter::nearest(double time_s) const {
  const std::int64_t time = detail::microseconds(time_s);
  const auto later = masks_.lower_bound(time);
  if (later == masks_.begin()) return later;  // also if there is none
  const auto earlier = std::prev(later);
  if (later == masks_.end() || time - earlier->first <= later->first - time) return earlier;
  return later;
}

bool MaskFolderSegmenter::is_near(Masks::const_iterator mask, double time_s, double reach_s) const {
  return mask != masks_.end() &&
         std::abs(mask->first - detail::microseconds(time_s)) <= detail::microseconds(reach_s);
}

std::vector<int> MaskFolderSegmenter::values() const {
  std::vector<fs::path> files;
  for (const auto& [time, mask] : masks_) files.push_back(mask.path);
  return has_table_ ? std::vector<int>() : detail::mask_values(files);
}

Segmentation MaskFolderSegmenter::read(const FrameView& frame) const {
  const std::string time = detail::time_text(frame.timestamp_s);
  if (!detail::is_time_in_seconds(frame.timestamp_s)) {
    detail::throw_misuse("MaskFolderSegmenter", "timestamp_s = " + time, "seconds");
  }
  const auto mask = nearest(frame.timestamp_s);
  if (!is_near(mask, frame.timestamp_s, options_.max_time_difference_s)) {
    detail::throw_file_error(
        folder_ / (time + ".png"),
        "there is no such mask; " +
            (masks_.empty() ? "the folder holds none"
                            : "the nearest is " + mask->second.path.filename().string()));
  }
  const fs::path& file = mask->second.path;
  detail::require_regular_file(file);
  Segmentation result = empty_segmentation(frame);
  cv::Mat pixels = detail::read_mask(file, result.image_size);
  const cv::Size own_size = pixels.size();
  if (result.image_size.empty()) result.image_size = pixels.size();
  if (frame.image.empty() && pixels.size() != result.image_size) {
    // The features are pixels of an image whose size is not known: nothing can be scaled to it.
    detail::throw_file_error(file, detail::size_name(pixels.size()) +
                                       " pixels, but the depth has " +
                                       detail::size_name(result.image_size) +
                                       "; hand over the image, too, or give both its size");
  }
  pixels = detail::fitted(pixels, result.image_size, file, "the frame", detail::if_letterboxed);
  const double made_s = mask->second.time_s.value_or(static_cast<double>(mask->first) / 1e6);
  const std::int64_t age = detail::microseconds(frame.timestamp_s) - detail::microseconds(made_s);
  if (std::abs(age) > detail::microseconds(same_time_s)) {
    result.timestamp_s = made_s;
    result.frame_id = unknown_frame;
  }
  try {
    if (has_table_) {
      result.instances = labelled_instances(pixels, mask->second.instances, file);
      for (Instance& instance : result.instances) {
        instance.box = scaled(instance.box, own_size, result.image_size);
      }
    } else {
      result.instances = instances_from_binary_mask(cv::Mat(pixels != 0), options_.box_margin_px);
    }
  } catch (const std::invalid_argument& error) {  // its objects are no objects
    detail::throw_file_error(file, error.what());
  }
  return result;
}

}  // namespace dynfilter
