// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Options shared by several sub-commands.

#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "dynfilter/evaluation/sequence_camera.hpp"
#include "dynfilter/segmenter.hpp"
#include "frame_source.hpp"
#include "rule_run.hpp"

namespace dynfilter::tools {

/// Adds options that change a level, for the option `level` that names one, if it is needed.
inline void add_level_size_options(CLI::App& command, SceneSpec& scene,
                                   CLI::Option* level = nullptr) {
  CLI::Option* const options[] = {
      command.add_option("--frames", scene.frames, "frames of a level [300]")
          ->check(CLI::Range(1, 1000000)),
      command.add_option("--width", scene.width, "width of a level's images, pixels [640]")
          ->check(CLI::Range(16, 8192)),
      command.add_option("--height", scene.height, "height of a level's images, pixels [480]")
          ->check(CLI::Range(16, 8192))};
  for (CLI::Option* option : options) {
    if (level != nullptr) option->needs(level);
  }
}

inline CLI::Option* add_depth_offset_option(CLI::App& command, std::optional<double>& offset_s) {
  return command
      .add_option("--depth-offset", offset_s,
                  "pair colour images with the depth images whose stamps are this many seconds\n"
                  "later; above 0 where depth is late, as TUM's, 0.033; see dynfilter sync\n"
                  "[dynfilter.depth_offset_s of the camera file, or 0]")
      ->check(CLI::Range(-max_depth_offset_s, max_depth_offset_s));
}

inline CLI::Option* add_classes_option(CLI::App& command, std::vector<std::string>& classes) {
  return command
      .add_option("--classes", classes,
                  "dynamic classes: ids, or names that the --model knows, such as person,dog\n"
                  "[person, or 0 where that has no name]")
      ->delimiter(',')
      ->allow_extra_args(false);
}

/// Returns the ids of such classes. Throws std::runtime_error that lists the names that the
/// segmenter knows; without one, person is 0.
std::vector<int> class_ids(std::vector<std::string> classes, const Segmenter* segmenter);

/// Adds what a recording may need beside its folder: --masks, --missing-masks, --camera and
/// --depth-offset, which need the option that names the folder.
void add_recording_options(CLI::App& command, SceneSpec& scene, CLI::Option* sequence);

inline void add_setting_options(CLI::App& command, RunSettings& settings) {
  command
      .add_option("--every", settings.every,
                  "use every n-th frame only, without odometry, which needs all frames")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  add_classes_option(command, settings.classes);
  command
      .add_option("--margin", settings.mask_culler.margin_px,
                  "also remove features this near to a mask, pixels")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command
      .add_option_function<std::string>(
          "--truth",
          [&settings](const std::string& name) {
            settings.truth = name == "motion" ? Truth::by_motion : Truth::by_class;
          },
          "what is dynamic, for the scores and the rule perfect: a class, persons whether they\n"
          "move or not, by masks_true/; or motion, what moves in the frame, by masks_moving/")
      ->check(CLI::IsMember({"class", "motion"}))
      ->default_str(name_of(settings.truth));
}

/// Chooses a segmenter that works on images.
struct SegmenterSpec {
  std::string remote;  ///< address of another process
  double remote_timeout_s = 1.0;
  std::filesystem::path model;  ///< ONNX file of a network
  std::string device = "cpu";   ///< that it runs on

  bool is_unset() const { return remote.empty() && model.empty(); }

  /// Returns the segmenter's name for results and messages.
  std::string name() const;

  /// Makes the segmenter. Throws what the segmenters' constructors throw.
  std::unique_ptr<Segmenter> make() const;
};

/// Returns the masks of the image of frame i of so many. An error says that nothing was written.
Segmentation masks_of(Segmenter& segmenter, FrameView frame, std::size_t i, std::size_t frames);

/// Adds --remote and --remote-timeout and, if this build has networks, --model and --device.
void add_segmenter_options(CLI::App& command, SegmenterSpec& segmenter);

}  // namespace dynfilter::tools
