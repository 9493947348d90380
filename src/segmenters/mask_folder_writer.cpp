// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_folder_writer.hpp"

#include <cstdlib>
#include <optional>
#include <string>
#include <system_error>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "io/file_error.hpp"
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

void paint(const Instance& instance, std::size_t label, cv::Mat& label_map) {
  const cv::Rect visible =
      detail::clip({instance.mask_origin, instance.mask.size()}, label_map.size());
  if (visible.empty()) return;
  const cv::Point offset = detail::wrapping_difference(visible.tl(), instance.mask_origin);
  label_map(visible).setTo(static_cast<double>(label),
                           instance.mask(cv::Rect(offset, visible.size())));
}

cv::Mat label_map_of(const Segmentation& segmentation) {
  const std::size_t count = segmentation.instances.size();
  cv::Mat label_map(segmentation.image_size, count > 255 ? CV_16UC1 : CV_8UC1, cv::Scalar(0));
  for (std::size_t i = count; i-- > 0;) paint(segmentation.instances[i], i + 1, label_map);
  return label_map;
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
  const cv::Rect& box = instance.box;
  return detail::concatenate(stem, ',', label, ',', instance.class_id, ',',
                             detail::fixed_decimals(double{instance.score}, 6), ',', box.x, ',',
                             box.y, ',', box.width, ',', box.height);
}

void require_writable(const Segmentation& segmentation) {
  validate(segmentation, name);
  if (segmentation.image_size.empty()) {
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
  if (!segmentation.timestamp_s) {
    detail::throw_misuse(name, "masks without a time", "a time in seconds");
  }
  add(segmentation, detail::time_text(*segmentation.timestamp_s));
}

void MaskFolderWriter::add(const Segmentation& segmentation, const std::string& stem,
                           std::optional<double> frame_timestamp_s) {
  require_writable(segmentation);
  if (!staged_)
    detail::throw_misuse(name, "a segmentation after finish()", "every segmentation before it");
  const std::optional<double> known_s =
      frame_timestamp_s ? frame_timestamp_s : segmentation.timestamp_s;
  if (any_names_ && !known_s)
    detail::throw_misuse(name, "'" + stem + "' without a time", "that of the masks or the frame");
  const std::optional<double> time_s = any_names_ ? known_s : detail::time_of_name(stem);
  if (!time_s || stem.empty() || stem.find_first_of(",\"/") != std::string::npos ||
      detail::has_control(stem)) {
    detail::throw_misuse(name, "the stem '" + stem + "'",
                         any_names_ ? "a name without comma, quote, slash and control character"
                                    : "a time in seconds");
  }
  const double frame_time_s = known_s.value_or(*time_s);
  if (!is_found(*time_s, frame_time_s)) {
    detail::throw_misuse(
        name,
        "the stem '" + stem + "' for a segmentation of time " + detail::time_text(frame_time_s),
        "the frame's time, to 1 ms");
  }
  const double mask_time_s = segmentation.timestamp_s.value_or(frame_time_s);
  const std::string mask_time = detail::time_text(mask_time_s);
  if (!detail::is_time_in_seconds(mask_time_s)) {
    detail::throw_misuse(name, "masks of time " + mask_time, "a time in seconds");
  }
  const std::int64_t time = detail::microseconds(*time_s);
  const fs::path file = staged_->path() / (stem + ".png");
  if (fs::exists(file) || !times_.insert(time).second) {
    detail::throw_misuse(
        name, "'" + stem + "', of time " + detail::time_text(*time_s) + ", a second time",
        "one segmentation for a name and a time");
  }
  const std::size_t before = rows_.size();
  try {
    for (std::size_t i = 0; i < segmentation.instances.size(); ++i) {
      rows_.push_back({table_row(stem, i + 1, segmentation.instances[i]), mask_time});
    }
    detail::write_image(file, label_map_of(segmentation));
  } catch (...) {
    times_.erase(time);
    rows_.erase(rows_.begin() + static_cast<std::ptrdiff_t>(before), rows_.end());
    throw;
  }
  const bool is_own_time = is_found(mask_time_s, *time_s);
  has_own_times_ = has_own_times_ || (!is_own_time && !segmentation.instances.empty());
}

void MaskFolderWriter::finish() {
  if (!staged_) return;
  if (times_.empty()) detail::throw_misuse(name, "no segmentation", "one at least");
  std::string table =
      has_own_times_ ? detail::mask_table_header_with_time : detail::mask_table_header;
  table += '\n';
  for (const Row& row : rows_) {
    table += row.text + (has_own_times_ ? ',' + row.mask_time : "") + '\n';
  }
  detail::write_file(staged_->path() / detail::mask_table_name, table);
  staged_->commit();
  staged_.reset();
}

}  // namespace dynfilter
