// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_PLUGIN_SETTINGS_HPP
#define DYNFILTER_SRC_PLUGIN_PLUGIN_SETTINGS_HPP

#include <optional>
#include <string>
#include <vector>

#include "dynfilter/dynamic_filter.hpp"
#ifdef DYNFILTER_HAS_MOTION
#include "dynfilter/motion/pinhole_camera.hpp"
#endif
#include "dynfilter/segmenters/async_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/stereo_depths.hpp"

namespace dynfilter::detail {

/// The contents of a settings file. The keys are the options' names; see
/// examples/orb_slam/README.md.
struct PluginSettings {
  std::string file;
  bool enabled = true;            ///< false: the filter is switched off, and nothing else was read
  std::string mask_folder;        ///< one of these three is set: the folder,
  std::string remote;             ///< the socket of another process,
  std::string model;              ///< or the file of a network
  std::string source_key;         ///< the key of the one that is set, for messages
  std::string image_key;          ///< a key that needs images, for messages; empty: none is set
  std::string motion_key;         ///< the key of `motion`, for messages
  std::string missing_masks_key;  ///< the key of `missing_masks`, for messages
  std::string max_time_difference_key;  ///< the key of `max_time_difference_s`, for messages
  MaskFolderOptions mask_folder_options;
  double remote_timeout_s = 1.0;
  std::optional<HandOver> hand_over;  ///< with a thread; none: masks are made on demand
  double max_wait_s = 0.03;
  bool reads_ahead = true;              ///< reads the folder's masks in a thread, from submit on
  bool moves_masks = false;             ///< moves masks to the frame, see MaskPropagator
  bool takes_rgb = false;               ///< colour images come in RGB order, not in BGR
  std::string missing_masks = "error";  ///< or "keep": continue without masks, and count it
  bool matches_pairs = true;            ///< finds depths in the pairs of a stereo host
  StereoDepthsOptions stereo;
  DynamicFilterOptions filter;
#ifdef DYNFILTER_HAS_MOTION
  std::optional<PinholeCamera> motion_camera;  ///< the host's; none: without motion evidence
#endif
  /// Features with which the host begins an RGB-D or stereo map; 0: not watched.
  std::size_t start_features = 501;
  /// Number of frames to keep the host from beginning its map while motion is not decided; 0: none.
  std::size_t wait_for_motion = 0;
  std::string wait_for_motion_key;       ///< the key of `wait_for_motion`, for messages
  std::string output_folder;             ///< for frames.csv and overlays; empty: none
  std::string output_folder_key;         ///< the key of `output_folder`, for messages
  std::size_t depth_check_frames = 150;  ///< frames to estimate the depth's offset from; 0: none
  double depth_frames_late = 0;          ///< move depth along the optical flow by this many frames
  std::string depth_frames_late_key;     ///< the key of `depth_frames_late`, for messages
  int overlay_every = 0;                 ///< draw every n-th frame; 0: none
  double depth_units_per_metre = 0;      ///< DepthMapFactor; 0: not in the file
  std::vector<std::string> idle;         ///< a sentence for each setting without effect
};

/// Reads the settings. Throws std::runtime_error that names file and key.
PluginSettings read_plugin_settings(const std::string& path, const std::string& prefix);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_PLUGIN_SETTINGS_HPP
