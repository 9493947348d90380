// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/observers.hpp"

#include <cstddef>
#include <exception>
#include <iostream>
#include <stdexcept>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"

namespace dynfilter::detail {
namespace {

/// Frames that are checked, and after how many of them findings are looked for. More frames find
/// rarer faults, and cost 1 to 3 ms each.
constexpr std::size_t checked_frames = 150, frames_to_findings = 30;

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
  return InputChecks(options);
}

}  // namespace

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
  for (const InputFinding& finding : checks_.findings()) say_once(finding.check, finding.sentence);
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
