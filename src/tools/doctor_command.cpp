// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/core/version.hpp>

#include "commands.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/kernels/instruction_set.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/diagnosis/input_checks.hpp"
#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/version.hpp"
#include "frame_source.hpp"
#include "io/file_error.hpp"
#include "plugin/plugin_settings.hpp"
#include "rule_run.hpp"
#include "shared_options.hpp"
#include "source_checks.hpp"

namespace dynfilter::tools {
namespace {

constexpr std::size_t checked_frames = 150;  // the first ones
constexpr std::size_t checked_masks = 30;    // of a folder without a sequence

struct DoctorOptions {
  SceneSpec scene;
  std::filesystem::path settings;
};

enum class Condition {
  fine,
  note,   // what was taken, or left out
  odd,    // usable, but look at it
  broken  // not usable before it is mended
};

/// Findings about one sequence or one settings file.
struct Findings {
  /// Adds what was found, once, and what to do about it.
  void add(Condition condition, const std::string& what, const std::string& mend = {}) {
    if (text.find(what) != std::string::npos) return;
    const char* const names[] = {"fine  ", "note  ", "odd   ", "broken"};
    text += std::string(names[static_cast<int>(condition)]) + "  " + what + '\n';
    if (!mend.empty()) text += "        -> " + mend + '\n';
    is_broken = is_broken || condition == Condition::broken;
  }

  std::string text;
  bool is_broken = false;
};

void add_findings(const std::vector<InputFinding>& findings, Findings& found) {
  for (const auto& [check, sentence, is_hopeless] : findings) {
    found.add(is_hopeless ? Condition::broken : Condition::odd,
              detail::concatenate(check, ": ", sentence));
  }
}

/// Runs the checks over the first frames that can be read and have masks.
void check_frames(FrameSource& source, Findings& found) {
  const RunSettings settings;
  SourceChecks checks(source.facts(), settings.mask_culler, settings.features);
  const odometry::OrbExtractor extractor(settings.features);
  std::vector<std::string> errors, missing;
  std::size_t looked_at = 0;
  for (std::size_t i = 0; source.has(i); ++i) {
    try {
      source.require_masks(i);
    } catch (const std::exception& error) {
      missing.emplace_back(error.what());
      continue;
    }
    if (looked_at == checked_frames) continue;
    ++looked_at;
    try {
      const SourceFrame frame = source.read(i);
      checks.add(frame, extract_features(extractor, frame.frame.image).keypoints);
    } catch (const std::exception& error) {
      errors.emplace_back(error.what());
    }
  }
  if (!errors.empty() && errors.size() == looked_at) {
    found.add(Condition::broken, errors.front() + "; so it is with every frame that was looked at");
    return;
  }
  for (const std::string& error : errors) {
    found.add(Condition::broken, error, "replace the file, or leave its row out of the lists");
  }
  if (!missing.empty()) {
    found.add(Condition::broken,
              detail::concatenate(missing.size(), " of ", source.size(), " frames have no mask"),
              missing.front());
  }
  found.add(Condition::fine, detail::concatenate(looked_at - errors.size(), " of ", source.size(),
                                                 " frames were checked"));
  add_findings(checks.findings(source.mask_values()), found);
}

/// Runs a check. An exception is its last finding.
template <class Check>
void run_check(Findings& found, const Check& check) {
  try {
    check();
  } catch (const std::exception& error) {
    found.add(Condition::broken, error.what());
  }
}

Findings examine_sequence(const DoctorOptions& options) {
  Findings found;
  run_check(found, [&] {
    const auto source = options.scene.open(Truth::by_class);
    std::istringstream notes(source->facts().note);
    for (std::string note; std::getline(notes, note);) found.add(Condition::note, note);
    if (source->facts().masks_name.empty()) {
      found.add(Condition::odd, "no masks/", "make masks, see `dynfilter masks --help`");
    }
    check_frames(*source, found);
  });
  return found;
}

/// Runs the checks over the masks of a folder, without their frames.
void check_mask_files(const detail::PluginSettings& settings, MaskFolderSegmenter& masks,
                      Findings& found) {
  InputChecksOptions options;
  options.dynamic_classes = settings.filter.mask_culler.dynamic_classes;
  InputChecks checks(options);
  for (const auto& entry : std::filesystem::directory_iterator(settings.mask_folder)) {
    FrameView frame;
    const auto time_s = detail::parse_number(entry.path().stem().string());
    if (checks.frames() == checked_masks || !time_s || !masks.has_mask(*time_s)) continue;
    frame.timestamp_s = *time_s;
    checks.add(frame, masks.segment(frame), {});
  }
  checks.note_mask_values(masks.values());
  for (const InputFinding& finding : checks.findings()) {
    // A folder is listed in no order.
    if (finding.check != "times") add_findings({finding}, found);
  }
}

void check_settings(const std::string& file, const std::string& prefix, Findings& found) {
  const detail::PluginSettings settings = detail::read_plugin_settings(file, prefix);
  if (!settings.enabled) {
    found.add(Condition::odd, "the filter is switched off, and nothing else is read",
              "remove " + prefix + ".enabled, or set it to 1");
    return;
  }
  const DynamicFilter filter(settings.filter);  // refuses values out of range
  found.add(Condition::fine, "every key of " + prefix + " is known, with its value");
  if (!settings.remote.empty()) {
    found.add(Condition::fine, "masks come from the process at " + settings.remote);
  } else if (!settings.model.empty()) {
    detail::require_regular_file(settings.model);
    found.add(Condition::fine, "masks come from the network " + settings.model);
  } else {
    const bool keeps = settings.missing_masks == "keep";
    MaskFolderOptions options = settings.mask_folder_options;
    options.allow_missing = keeps;
    MaskFolderSegmenter masks(settings.mask_folder, options);
    found.add(Condition::fine,
              detail::concatenate(masks.size(), " masks in ", settings.mask_folder,
                                  keeps ? "; in a frame without one, masks remove nothing"
                                        : "; a frame without one is an error"));
    check_mask_files(settings, masks, found);
  }
}

/// Examines the plugin's settings as the plugin reads them, and those of a fisheye pair's right
/// camera, if there are any. Asks no other process.
Findings examine_settings(const std::filesystem::path& file) {
  Findings found;
  run_check(found, [&] {
    check_settings(file.string(), "dynfilter", found);
    bool has_right = false;
    std::ifstream lines(file);
    for (std::string line; std::getline(lines, line);) {
      has_right = has_right || line.rfind("dynfilter_right.", 0) == 0;
    }
    if (has_right) check_settings(file.string(), "dynfilter_right", found);
  });
  return found;
}

void print_build() {
  std::printf("dynfilter %s, OpenCV %s (compiled with %s), %d processors\n",
              DYNFILTER_VERSION_STRING, cv::getVersionString().c_str(), CV_VERSION,
              cv::getNumberOfCPUs());
  std::printf("dense D-LBP uses: %s\n", detail::best_instruction_set_name());
#if defined(DYNFILTER_HAS_NETWORKS)
  std::printf("networks: built in\n");
#else
  std::printf("networks: left out (they need OpenCV's module dnn and DYNFILTER_BUILD_NETWORKS)\n");
#endif
}

void doctor(const DoctorOptions& options) {
  print_build();
  std::string unusable;
  const auto report = [&](const std::filesystem::path& path, const Findings& found) {
    std::printf("\n%s\n%s", path.c_str(), found.text.c_str());
    if (found.is_broken) unusable += (unusable.empty() ? "" : " and ") + path.string();
  };
  const std::filesystem::path& sequence = options.scene.sequence;
  if (!sequence.empty()) report(sequence, examine_sequence(options));
  if (!options.settings.empty()) report(options.settings, examine_settings(options.settings));
  std::fflush(stdout);  // before the error that refers to it
  if (!unusable.empty()) throw std::runtime_error(unusable + " cannot be used as it is, see above");
}

}  // namespace

void add_doctor_command(CLI::App& program) {
  const auto options = std::make_shared<DoctorOptions>();
  CLI::App* command = program.add_subcommand(
      "doctor",
      "Say what this program can do here, and what is odd about a sequence, or about the settings "
      "of\nthe plugin for ORB-SLAM. Changes nothing.");
  CLI::Option* sequence =
      command->add_option("SEQUENCE", options->scene.sequence, "folder of the sequence to examine");
  add_recording_options(*command, options->scene, sequence);
  command->add_option(
      "--settings", options->settings,
      "the host's settings file, whose keys dynfilter.* the plugin reads; relative\n"
      "paths in it start at the folder in which this runs, as in the host");
  command->footer(
      "examples:\n"
      "  dynfilter doctor\n"
      "  dynfilter doctor rgbd_dataset_freiburg3_walking_xyz --camera tum3\n"
      "  dynfilter doctor --settings TUM3.yaml");
  command->callback([options] { doctor(*options); });
}

}  // namespace dynfilter::tools
