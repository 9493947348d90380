// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/recorder.hpp"

#include <string>

#include "dynfilter/overlay.hpp"
#include "io/frame_table.hpp"
#include "io/image_file.hpp"
#include "io/output_folder.hpp"

namespace dynfilter::detail {

Recorder::Recorder(const std::filesystem::path& folder, int overlay_every)
    : folder_(folder), overlay_every_(static_cast<std::size_t>(overlay_every)) {
  std::error_code failure;
  std::filesystem::create_directories(folder_ / "overlays", failure);
  if (failure) throw_file_error(folder_ / "overlays", "cannot be made: " + failure.message());
  for (const auto& earlier : timed_png_files(folder_ / "overlays")) {
    std::filesystem::remove(earlier);
  }
  table_.open(folder_ / "frames.csv");
  table_ << frame_columns() << std::endl;
  if (!table_) throw_file_error(folder_ / "frames.csv", "cannot be written");
}

void Recorder::record(const FrameView& frame, const Segmentation& segmentation,
                      FeaturesView features, const FeatureLabels& labels) {
  const std::string time = time_text(frame.timestamp_s);
  if (overlay_every_ > 0 && frames_ % overlay_every_ == 0 && !frame.image.empty()) {
    write_png(folder_ / "overlays" / (time + ".png"),
              draw_overlay(frame.image, segmentation, features, labels));
  }
  table_ << frame_cells(time, frame.timestamp_s, labels.statistics()) << std::endl;
  if (!table_) throw_file_error(folder_ / "frames.csv", "cannot be written");
  ++frames_;
}

}  // namespace dynfilter::detail
