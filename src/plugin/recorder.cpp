// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/recorder.hpp"

#include <string>
#include <vector>

#include "dynfilter/overlay.hpp"
#include "io/file_writing.hpp"
#include "io/frame_table.hpp"
#include "io/image_file.hpp"
#include "io/output_folder.hpp"
#include "io/staged_folder.hpp"

namespace dynfilter::detail {
namespace {

constexpr const char* writer = "plugin";
constexpr const char* table_name = "frames.csv";
constexpr const char* time_columns = ",masks_made_ms,masks_ms,filter_ms";

/// Returns the cells of time_columns.
std::string time_cells(const FrameTimes& times) {
  const auto cell = [](double seconds) { return ',' + fixed_decimals(1e3 * seconds, 3); };
  return (times.masks_made_s ? cell(*times.masks_made_s) : ",") + cell(times.masks_s) +
         cell(times.filter_s);
}

}  // namespace

Recorder::Recorder(const std::filesystem::path& folder, int overlay_every)
    : folder_(folder), overlay_every_(static_cast<std::size_t>(overlay_every)) {
  require_room();
  std::error_code failure;
  std::filesystem::create_directories(folder_ / "overlays", failure);
  if (failure) throw_file_error(folder_ / "overlays", "cannot be made: " + failure.message());
  lock_.emplace(folder_, writer);
  require_room();  // another recorder may have worked here until now
}

void Recorder::begin() {
  remove_earlier_files();
  write_file(folder_ / manifest_name(writer),
             manifest_title(writer) + '\n' + manifest_row(written_, table_name) + '\n');
  manifest_.emplace(folder_ / manifest_name(writer));
  table_.emplace(folder_ / table_name);
  add_table_row(frame_columns() + time_columns);
}

void Recorder::record(const FrameView& frame, const Segmentation& segmentation,
                      FeaturesView features, const FeatureLabels& labels, const FrameTimes& times) {
  const std::string time = time_text(frame.timestamp_s);
  if (overlay_every_ > 0 && frames_ % overlay_every_ == 0 && !frame.image.empty()) {
    write_overlay(time + ".png", draw_overlay(frame.image, segmentation, features, labels));
  }
  add_table_row(frame_cells(time, frame.timestamp_s, labels.statistics()) + time_cells(times));
  ++frames_;
}

void Recorder::require_room() const {
  namespace fs = std::filesystem;
  const fs::path manifest = folder_ / manifest_name(writer);
  const fs::file_status status = fs::symlink_status(manifest);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw_file_error(manifest, "is not a regular file; name another folder");
  }
  std::vector<fs::path> names = {table_name, "overlays/"};
  for (const fs::path& overlay : timed_png_files(folder_ / "overlays")) {
    names.push_back("overlays" / overlay.filename());
  }
  EarlierFiles(folder_, writer).require_room(names, true);
}

void Recorder::remove_earlier_files() const {
  const EarlierFiles earlier(folder_, writer);
  for (const auto& [name, written] : earlier.files()) {
    std::error_code failure;
    std::filesystem::remove(folder_ / name, failure);
    if (failure) throw_file_error(folder_ / name, "cannot be removed: " + failure.message());
  }
}

/// Lists a file before it is written: whenever the host ends, every file is listed.
void Recorder::list(const Fingerprint& fingerprint, const std::filesystem::path& name) {
  manifest_->append(manifest_row(fingerprint, name) + '\n');
}

void Recorder::write_overlay(const std::string& name, const cv::Mat& overlay) {
  namespace fs = std::filesystem;
  const fs::path file = folder_ / "overlays" / name;
  if (fs::exists(fs::symlink_status(file)) && overlays_.count(name) == 0) {
    throw_file_error(file, "appeared while the plugin was recording");
  }
  const std::vector<std::uint8_t> bytes = encoded_image(file, ".png", overlay);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  list(fingerprint_of(text), fs::path("overlays") / name);
  overlays_.insert(name);
  write_file(file, text);
}

void Recorder::add_table_row(const std::string& row) {
  Fingerprint longer = written_;
  longer.add(row + '\n');
  list(longer, table_name);
  table_->append(row + '\n');
  written_ = longer;
}

}  // namespace dynfilter::detail
