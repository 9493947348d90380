// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/observers.hpp"

#include <cstddef>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <system_error>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/overlay.hpp"
#include "io/file_writing.hpp"
#include "io/frame_table.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "plugin/map_start.hpp"

namespace dynfilter::detail {
namespace {

/// Frames that are checked, and after how many of them findings are looked for. More frames find
/// rarer faults, and cost 1 to 3 ms each.
constexpr std::size_t checked_frames = 150, frames_to_findings = 30;

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

/// Makes the checks of the input, which name settings as the file does.
InputChecks checks_of(const PluginSettings& settings) {
  const auto key = [&](const std::string& name) {
    return settings.prefix + name + " in " + settings.file;
  };
  InputChecksOptions options;
  options.dynamic_classes = settings.filter.mask_culler.dynamic_classes;
  options.wanted_features = settings.orb_features;
  options.map_features = settings.orb_features > 0 ? map_features : 0;
  options.moves_masks = settings.moves_masks;
  options.depth_setting = "DepthMapFactor in " + settings.file;
  options.features_setting = "ORBextractor.nFeatures in " + settings.file;
  options.masks_setting = key(settings.source());
  if (!settings.need_of_images().empty()) options.images_setting = key(settings.need_of_images());
  InputChecks checks(options);
  if (settings.motion_camera) checks.note_camera(*settings.motion_camera);
  return checks;
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

Observers::Observers(const PluginSettings& settings) : checks_(checks_of(settings)) {
  if (settings.output_folder.empty()) return;
  try {
    recorder_.emplace(settings.output_folder, settings.overlay_every);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(settings.place_of("output_folder") + ": " + error.what());
  }
}

bool Observers::see(const FrameView& frame, const FrameAnswer& answer) noexcept {
  const bool is_recorded = attempt("this frame, and others that fail, are not recorded", [&] {
    if (recorder_) recorder_->record(frame, answer);
  });
  attempt("the checks of the input may miss what is wrong", [&] { check(frame, answer); });
  attempt("a message is missing", [&] { report(answer); });
  return is_recorded;
}

template <class Action>
bool Observers::attempt(const char* consequence, const Action& action) noexcept {
  try {
    try {
      action();
      return true;
    } catch (const std::exception& error) {
      say_once(consequence, concatenate(error.what(), " (", consequence, ')'));
    }
  } catch (...) {  // memory is short, or standard error is closed: nobody can be told
  }
  return false;
}

/// Checks the first frames.
void Observers::check(const FrameView& frame, const FrameAnswer& answer) {
  if (checks_.frames() == checked_frames) return;
  // Depths of a mono host's map points do not begin a map, which the checks would take them to do.
  const FeaturesView features = answer.has_measured_depth ? answer.features() : answer.points;
  checks_.add(frame, answer.masks.segmentation, features, &answer.labels.statistics());
  if (checks_.frames() % frames_to_findings != 0) return;
  for (const InputFinding& finding : checks_.findings()) {
    // Either names a number of features, which may grow from one call to the next.
    const bool is_for_features = finding.check == "map_start" || finding.check == "features_left";
    say_once(is_for_features ? "features" : finding.check, finding.sentence);
  }
}

/// Says what happened to the frame, if that is worth a message.
void Observers::report(const FrameAnswer& answer) {
  const FrameStatistics& statistics = answer.labels.statistics();
  if (!answer.masks.failure.empty()) {
    say_once("masks",
             answer.masks.failure + " (this frame, and others that fail, go on without masks)");
  }
  if (statistics.was_cautious()) {
    say_once("caution",
             concatenate("in the frame at ", time_text(*answer.timestamp_s),
                         " s, compensation would have kept too few of ", statistics.features,
                         " features to track, so it keeps the least certain ones too; "
                         "Plugin::counters() counts such frames"));
  }
}

void Observers::say_once(const std::string& subject, const std::string& sentence) {
  if (said_.insert(subject).second) std::cerr << "dynfilter: " << sentence << std::endl;
}

}  // namespace dynfilter::detail
