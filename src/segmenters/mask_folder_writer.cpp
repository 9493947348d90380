// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_folder_writer.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "io/file_writing.hpp"
#include "io/frame_names.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "mask_table.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;

constexpr const char* name = "MaskFolderWriter";
constexpr const char* writer = "masks";

/// Returns the part [first, last) of a mask's side that lies in the image. In 64 bits, because a
/// mask may lie anywhere.
cv::Range visible_part(std::int64_t origin, int length, int image_length) {
  const std::int64_t first = std::clamp<std::int64_t>(-origin, 0, length);
  const std::int64_t last = std::clamp<std::int64_t>(image_length - origin, first, length);
  return {static_cast<int>(first), static_cast<int>(last)};
}

void paint(const Instance& instance, std::size_t label, cv::Mat& label_map) {
  const cv::Point origin = instance.mask_origin;
  const cv::Range columns = visible_part(origin.x, instance.mask.cols, label_map.cols);
  const cv::Range rows = visible_part(origin.y, instance.mask.rows, label_map.rows);
  if (columns.empty() || rows.empty()) return;
  const cv::Rect place(origin.x + columns.start, origin.y + rows.start, columns.size(),
                       rows.size());
  label_map(place).setTo(static_cast<double>(label), instance.mask(rows, columns));
}

cv::Mat label_map_of(const Segmentation& segmentation) {
  const std::size_t count = segmentation.instances.size();
  cv::Mat label_map(segmentation.image_size, count > 255 ? CV_16UC1 : CV_8UC1, cv::Scalar(0));
  for (std::size_t i = count; i-- > 0;) paint(segmentation.instances[i], i + 1, label_map);
  return label_map;
}

/// Refuses what the reader of a table takes for no whole number.
void require_readable(const Instance& instance) {
  constexpr int least = -std::numeric_limits<int>::max();
  if (instance.class_id >= least && instance.box.x >= least && instance.box.y >= least) return;
  detail::throw_misuse(name,
                       detail::concatenate("class_id = ", instance.class_id, " in a box at ",
                                           instance.box.x, ", ", instance.box.y),
                       detail::concatenate("numbers of at least ", least));
}

/// Refuses a folder in which another mask would lie beside those that are written.
void require_no_other_mask(const fs::path& folder) {
  const detail::WrittenFiles earlier(detail::canonical_folder(folder), writer);
  std::error_code missing;
  for (fs::directory_iterator file(folder, missing), end; !missing && file != end; ++file) {
    const fs::path file_name = file->path().filename();
    const std::string extension = detail::lower_case(file_name.extension().string());
    if (extension != ".png" || earlier.names().count(file_name) > 0) continue;
    detail::throw_file_error(folder, "holds " + file_name.string() +
                                         ", which MaskFolderSegmenter would read as a mask; move "
                                         "it away");
  }
}

std::string table_row(const std::string& stem, std::size_t label, const Instance& instance) {
  std::string row = stem;
  const auto append = [&](const std::string& text) { row += ',' + text; };
  append(std::to_string(label));
  append(std::to_string(instance.class_id));
  append(detail::fixed_decimals(double{instance.score}, 6));
  for (const int side : {instance.box.x, instance.box.y, instance.box.width, instance.box.height}) {
    append(std::to_string(side));
  }
  return row;
}

void require_writable(const Segmentation& segmentation) {
  validate(segmentation, name);
  if (segmentation.image_size.width <= 0 || segmentation.image_size.height <= 0) {
    detail::throw_misuse(name, "image_size " + detail::size_name(segmentation.image_size),
                         "the size of the image that was segmented");
  }
  if (segmentation.instances.size() > detail::max_mask_label) {
    detail::throw_misuse(name, detail::concatenate(segmentation.instances.size(), " instances"),
                         detail::concatenate("at most ", detail::max_mask_label));
  }
}

/// Tells whether MaskFolderSegmenter, by default, finds a mask of this time for the frame.
bool is_found(double mask_time_s, double frame_time_s) {
  return detail::is_time_in_seconds(frame_time_s) &&
         std::abs(detail::microseconds(mask_time_s) - detail::microseconds(frame_time_s)) <=
             detail::microseconds(MaskFolderOptions().max_time_difference_s);
}

}  // namespace

MaskFolderWriter::MaskFolderWriter(const fs::path& folder, const MaskFolderWriterOptions& options)
    : staged_(std::make_unique<detail::StagedFolder>(folder, writer, options.overwrite)),
      any_names_(options.any_names) {
  require_no_other_mask(folder);
}

MaskFolderWriter::MaskFolderWriter(MaskFolderWriter&&) noexcept = default;
MaskFolderWriter& MaskFolderWriter::operator=(MaskFolderWriter&&) noexcept = default;
MaskFolderWriter::~MaskFolderWriter() = default;

void MaskFolderWriter::add(const Segmentation& segmentation) {
  add(segmentation, detail::time_text(segmentation.timestamp_s));
}

void MaskFolderWriter::add(const Segmentation& segmentation, const std::string& stem) {
  add(segmentation, stem, segmentation.timestamp_s);
}

void MaskFolderWriter::add(const Segmentation& segmentation, const std::string& stem,
                           double frame_timestamp_s) {
  require_writable(segmentation);
  if (!staged_)
    detail::throw_misuse(name, "a segmentation after finish()", "every segmentation before it");
  const std::optional<double> time_s = any_names_ ? frame_timestamp_s : detail::time_of_name(stem);
  if (!time_s || stem.find_first_of(",\"/\n") != std::string::npos) {
    detail::throw_misuse(name, "the stem '" + stem + "'",
                         any_names_ ? "no comma, quote or slash" : "a time in seconds");
  }
  if (!is_found(*time_s, frame_timestamp_s)) {
    detail::throw_misuse(name,
                         "the stem '" + stem + "' for a segmentation of time " +
                             detail::time_text(frame_timestamp_s),
                         "the frame's time, to 1 ms");
  }
  const std::string mask_time = detail::time_text(segmentation.timestamp_s);
  if (!detail::is_time_in_seconds(segmentation.timestamp_s)) {
    detail::throw_misuse(name, "masks of time " + mask_time, "a time in seconds");
  }
  if (times_.count(detail::microseconds(*time_s)) > 0) {
    detail::throw_misuse(name, "time " + stem + " a second time", "one segmentation a frame");
  }
  // Everything that can fail comes before the first change.
  const bool is_own_time = !is_found(segmentation.timestamp_s, *time_s);
  std::list<Rows> rows(1);
  for (std::size_t i = 0; i < segmentation.instances.size(); ++i) {
    require_readable(segmentation.instances[i]);
    const std::string row = table_row(stem, i + 1, segmentation.instances[i]);
    rows.front().without_time += row + '\n';
    rows.front().with_time += row + ',' + mask_time + '\n';
  }
  std::set<std::int64_t> time = {detail::microseconds(*time_s)};
  detail::write_image(staged_->path() / (stem + ".png"), label_map_of(segmentation));
  rows_.splice(rows_.end(), rows);
  times_.merge(time);
  has_own_times_ = has_own_times_ || (is_own_time && !segmentation.instances.empty());
}

void MaskFolderWriter::finish() {
  if (!staged_) return;
  if (times_.empty()) detail::throw_misuse(name, "no segmentation", "one at least");
  std::string table =
      has_own_times_ ? detail::mask_table_header_with_time : detail::mask_table_header;
  table += '\n';
  for (const Rows& rows : rows_) table += has_own_times_ ? rows.with_time : rows.without_time;
  detail::write_file(staged_->path() / detail::mask_table_name, table);
  staged_->commit();
  staged_.reset();
}

}  // namespace dynfilter
