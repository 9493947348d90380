// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "dynfilter/camera.hpp"
#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/segmenters/async_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"

namespace dynfilter::detail {

/// The contents of a settings file. The keys are the options' names; see
/// examples/orb_slam/README.md.
struct PluginSettings {
  std::string file;
  std::string prefix;          ///< of the keys, with its dot
  bool enabled = true;         ///< false: the filter is switched off, and nothing else was read
  std::string mask_folder;     ///< one of these three is set: the folder,
  std::string remote;          ///< the address of another process,
  std::string model;           ///< or the file of a network
  std::string device = "cpu";  ///< that the network runs on
  bool names_classes = false;  ///< dynamic_classes is in the file
  MaskFolderOptions mask_folder_options;
  std::optional<HandOver> hand_over;    ///< with a thread; none: masks are made on demand
  bool moves_masks = false;             ///< moves masks to the frame, see MaskPropagator
  bool takes_rgb = false;               ///< colour images come in RGB order, not in BGR
  std::string missing_masks = "error";  ///< or "keep": continue without masks, and count it
  double min_depth_m = 0.8;             ///< nearest depth of a pair that is looked for
  DynamicFilterOptions filter;
  std::optional<Camera> motion_camera;  ///< the host's; none: motion is not judged
  bool asks_for_motion = false;         ///< motion is in the file
  std::string output_folder;            ///< for frames.csv and overlays; empty: none
  int overlay_every = 0;                ///< draw every n-th frame; 0: none
  double depth_units_per_metre = 0;     ///< DepthMapFactor; 0: not in the file
  std::size_t orb_features = 0;         ///< ORBextractor.nFeatures; 0: not in the file

  /// Returns "<file>: <prefix><name>", for messages.
  std::string place_of(const std::string& name) const { return file + ": " + prefix + name; }
  /// Returns the name of the masks' source.
  std::string source() const {
    return !mask_folder.empty() ? "mask_folder" : !remote.empty() ? "remote" : "model";
  }
  /// Returns the name of a setting that does nothing without images; empty if none is set.
  std::string need_of_images() const;
};

/// Returns the message of an error without the class that refused an option: the settings file
/// takes its place.
inline std::string without_component(const std::string& message) {
  const std::size_t got = message.find(": got ");
  return got == std::string::npos ? message : message.substr(got + 2);
}

/// Reads the settings. Throws std::runtime_error that names file and key.
PluginSettings read_plugin_settings(const std::string& path, const std::string& prefix);

}  // namespace dynfilter::detail
