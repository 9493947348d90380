// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/recorder.hpp"

#include <string>
#include <system_error>

#include "dynfilter/overlay.hpp"
#include "io/file_writing.hpp"
#include "io/frame_table.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"

namespace dynfilter::detail {
namespace {

constexpr const char* writer = "plugin";
constexpr const char* table_name = "frames.csv";
constexpr const char* overlays_name = "overlays";
constexpr const char* time_columns = ",masks_made_ms,masks_ms,filter_ms";

/// Returns the cells of time_columns.
std::string time_cells(const FrameAnswer& answer) {
  const auto cell = [](double seconds) { return ',' + fixed_decimals(1e3 * seconds, 3); };
  return (answer.masks.made_s ? cell(*answer.masks.made_s) : ",") + cell(answer.masks_s) +
         cell(answer.filter_s);
}

}  // namespace

Recorder::Recorder(const fs::path& folder, int overlay_every)
    : folder_(canonical_folder(folder)), overlay_every_(static_cast<std::size_t>(overlay_every)) {
  const WrittenFiles earlier(folder_, writer);
  earlier.require_room(true);
  earlier.require_room_for(table_name);
  require_own_place(folder_, fs::path(overlays_name) / "");
  std::error_code failure;
  fs::create_directories(folder_ / overlays_name, failure);
  if (failure) throw_file_error(folder / overlays_name, "cannot be made: " + failure.message());
  for (const fs::path& name : earlier.names()) {
    fs::remove(folder_ / name, failure);
    if (failure) throw_file_error(folder_ / name, "cannot be removed: " + failure.message());
  }
  earlier.save({table_name});
  add_table_row(frame_columns() + time_columns);
}

void Recorder::record(const FrameView& frame, const FrameAnswer& answer) {
  const std::string time = time_text(frame.timestamp_s);
  const bool is_drawn = overlay_every_ > 0 && frames_ % overlay_every_ == 0 && !frame.image.empty();
  ++frames_;
  add_table_row(frame_cells(time, frame.timestamp_s, answer.labels.statistics()) +
                time_cells(answer));
  if (!is_drawn) return;
  const Segmentation masks = answer.masks.segmentation.value_or(Segmentation());
  write_overlay(time + ".png", draw_overlay(frame.image, masks, answer.points, answer.labels));
}

void Recorder::write_overlay(const std::string& name, const cv::Mat& overlay) {
  const fs::path file = folder_ / overlays_name / name;
  if (overlays_.count(name) == 0) {
    if (fs::exists(fs::symlink_status(file)))
      throw_file_error(file, "appeared while the plugin was recording");
    append_to_file(folder_ / list_name(writer), overlays_name + ('/' + name) + '\n');
    overlays_.insert(name);
  }
  write_image(file, overlay);
}

void Recorder::add_table_row(const std::string& row) const {
  append_to_file(folder_ / table_name, row + '\n');
}

}  // namespace dynfilter::detail
