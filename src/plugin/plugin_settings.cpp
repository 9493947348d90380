// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/plugin_settings.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/hand_over_names.hpp"
#include "io/image_file.hpp"
#include "plugin/idle_settings.hpp"
#include "plugin/settings_file.hpp"

namespace dynfilter::detail {
namespace {

/// Reads a choice; `choices` names the enumeration's values in their order.
template <class Enumeration>
void read_enumeration(SettingsFile& file, const std::string& name,
                      const std::vector<std::string>& names, Enumeration& value) {
  std::string chosen = names.at(static_cast<std::size_t>(value));
  file.read_choice(name, names, chosen);
  value = static_cast<Enumeration>(std::find(names.begin(), names.end(), chosen) - names.begin());
}

/// Reads the one segmenter: a folder, another process or a network.
void read_segmenter(SettingsFile& file, PluginSettings& settings) {
  file.read_text("mask_folder", settings.mask_folder);
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  file.read_text("remote", settings.remote);
  file.read_number("remote_timeout_s", settings.remote_timeout_s);
#else
  if (file.has("remote")) {
    file.refuse("remote", "a socket, but this dynfilter was built without remote masks",
                "one built for Linux");
  }
#endif
  file.read_text("model", settings.model);
#ifndef DYNFILTER_HAS_NETWORKS
  if (settings.model.empty()) return;
  file.refuse("model", settings.model + ", but this dynfilter was built without networks",
              "one built with -DDYNFILTER_BUILD_NETWORKS=ON, where OpenCV has its module dnn");
#endif
}

/// Returns the key of the masks' source.
std::string require_one_segmenter(const SettingsFile& file, const PluginSettings& settings) {
  std::string given;
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) given += (given.empty() ? "" : " and ") + std::string(name);
  };
  add("mask_folder", settings.mask_folder);
  add("remote", settings.remote);
  add("model", settings.model);
  if (given.empty()) {
    file.refuse("mask_folder", "nothing",
                "the folder of the masks; to run without the filter, set " +
                    file.key_of("enabled") + ": 0");
  }
  if (given.find(' ') != std::string::npos) {
    file.refuse("mask_folder", given, "one source of masks");
  }
  return file.key_of(given);
}

void read_thread(SettingsFile& file, PluginSettings& settings) {
  std::string chosen;
  file.read_choice("async", hand_over_names(), chosen);
  file.read_number("max_wait_s", settings.max_wait_s);
  if (!chosen.empty()) settings.hand_over = hand_over_of(chosen);
}

void read_colour_order(SettingsFile& file, bool& takes_rgb) {
  std::string order = "bgr";
  file.read_choice("colour_order", {"bgr", "rgb"}, order);
  takes_rgb = order == "rgb";
}

void read_masks(SettingsFile& file, PluginSettings& settings) {
  read_segmenter(file, settings);
  file.read_flag("read_ahead", settings.reads_ahead);
  read_thread(file, settings);
  std::string moved = "no";
  file.read_choice("propagate", {"no", "yes"}, moved);
  settings.moves_masks = moved == "yes";
  file.read_number("max_time_difference_s", settings.mask_folder_options.max_time_difference_s);
  file.read_count("box_margin_px", settings.mask_folder_options.box_margin_px);
  file.read_count("min_pixels", settings.mask_folder_options.min_pixels);
  file.read_choice("missing_masks", {"error", "keep"}, settings.missing_masks);
}

void read_mask_culler(SettingsFile& file, MaskCullerOptions& options) {
  file.read_integers("dynamic_classes", options.dynamic_classes);
  file.read_number("margin_px", options.margin_px);
  file.read_number("margin_per_diameter", options.margin_per_diameter);
  std::string static_mask;
  file.read_text("static_mask", static_mask);
  if (static_mask.empty()) return;
  try {
    options.static_mask = read_image(static_mask, cv::IMREAD_UNCHANGED);
  } catch (const std::runtime_error& error) {
    file.refuse("static_mask", error.what(), "an image file");
  }
}

void read_range(SettingsFile& file, const std::string& name, RangeEstimatorOptions& options) {
  read_enumeration(file, name + ".outlier_rule",
                   {"median_absolute_deviation", "interquartile_range"}, options.outlier_rule);
  file.read_number(name + ".outlier_factor", options.outlier_factor);
  file.read_count(name + ".min_samples", options.min_samples);
  file.read_number(name + ".expansion", options.expansion);
}

void read_depth_compensator(SettingsFile& file, DepthCompensatorOptions& options) {
  file.read_number("object_depth.min_half_width_m", options.object_depth.min_half_width_m);
  file.read_number("object_depth.max_half_width_m", options.object_depth.max_half_width_m);
  file.read_number("min_nearness", options.min_nearness);
  file.read_number("min_nearness_if_stale", options.min_nearness_if_stale);
  file.read_number("min_nearness_in_shadow", options.min_nearness_in_shadow);
  file.read_number("mask_margin_px", options.mask_margin_px);
  file.read_number("shadow_px", options.shadow_px);
  file.read_number("max_beyond_range_m", options.max_beyond_range_m);
  file.read_number("min_off_middle_m", options.min_off_middle_m);
  file.read_number("feature_reach_px", options.feature_reach_px);
  file.read_number("feature_doubt_px", options.feature_doubt_px);
  file.read_number("min_feature_share", options.min_feature_share);
  file.read_number("stale_age_s", options.stale_age_s);
  file.read_number("motion_px_per_s", options.motion_px_per_s);
}

void read_edge_compensator(SettingsFile& file, EdgeCompensatorOptions& options) {
  std::size_t seed = 0;
  file.read_count("samples", options.samples);
  file.read_count("seed", seed);
  options.seed = seed;
  read_range(file, "depth", options.depth);
  read_range(file, "code", options.code);
  read_enumeration(file, "depth_lbp.missing_neighbour", {"nearer", "farther"},
                   options.depth_lbp.missing_neighbour);
  read_enumeration(file, "missing_depth", {"keep", "remove"}, options.missing_depth);
}

/// The host hands over a frame's image, features and depth before it has the next frame's, and
/// goes on with the features at once. So nothing can be held back until later depth is there.
void refuse_depth_offset(SettingsFile& file) {
  double offset_s = 0;
  file.read_number("depth_offset_s", offset_s);
  if (offset_s == 0) return;
  file.refuse("depth_offset_s", concatenate(offset_s),
              "0: the host hands over image and depth together and waits for no later one; give "
              "it images that are paired in step, see dynfilter sync --write");
}

#ifdef DYNFILTER_HAS_MOTION
/// Reads for how many frames the host waits until motion is decided. A longer wait than some
/// seconds decides nothing more, and a recording that ends in it leaves the host without a map.
void read_wait_for_motion(SettingsFile& file, std::size_t& frames) {
  constexpr std::size_t max_frames = 300;
  file.read_count("wait_for_motion", frames);
  if (frames <= max_frames) return;
  file.refuse("wait_for_motion", concatenate(frames), "0 to 300 frames");
}
#endif

void read_depth_frames_late(SettingsFile& file, double& frames_late) {
  constexpr double max_frames = 3;  // farther, surfaces do not move on as they did
  file.read_number("depth_frames_late", frames_late);
  if (std::abs(frames_late) <= max_frames) return;
  file.refuse("depth_frames_late", concatenate(frames_late), "frames within ±3");
}

void read_feature_floor(SettingsFile& file, FeatureFloorOptions& options) {
  file.read_count("floor", options.floor);
  read_enumeration(file, "policy", {"report_only", "restore_best_scored", "restore_balanced"},
                   options.policy);
}

#ifdef DYNFILTER_HAS_MOTION
/// Returns the factor by which ORB-SLAM3 resizes its images in one direction, 1 without its keys.
double resizing(const SettingsFile& file, const std::string& side, const std::string& new_side) {
  const std::optional<double> wanted = file.host_real("Camera." + new_side);
  if (!wanted) return 1;
  const double given = file.host_real("Camera." + side).value_or(0);
  if (!(given > 0 && *wanted > 0)) {
    file.refuse("motion", "1 with Camera." + new_side,
                "Camera." + side + " and Camera." + new_side + " above 0");
  }
  return *wanted / given;
}

/// Reads the camera from the host's own keys, those of ORB-SLAM2 or of ORB-SLAM3. The latter keeps
/// the camera of the images before it resizes them.
PinholeCamera read_camera(const SettingsFile& file) {
  const std::string prefix = file.host_real("Camera1.fx") ? "Camera1." : "Camera.";
  const std::string type = file.host_text("Camera.type");
  if (type != "" && type != "PinHole" && type != "Rectified") {
    file.refuse("motion", "1 with Camera.type " + type, "a pinhole camera");
  }
  const auto number = [&](const char* name) { return file.host_real(prefix + name).value_or(0); };
  PinholeCamera camera{number("fx"), number("fy"), number("cx"), number("cy"), number("k1"),
                       number("k2"), number("p1"), number("p2"), number("k3")};
  // ORB-SLAM3 does not read the distortion of images that are rectified already.
  if (type == "Rectified") camera = {camera.fx, camera.fy, camera.cx, camera.cy};
  const bool has_centre = file.host_real(prefix + "cx") && file.host_real(prefix + "cy");
  if (!(camera.fx > 0 && camera.fy > 0 && has_centre)) {
    file.refuse("motion",
                "1 without " + prefix + "fx and " + prefix + "fy above 0, " + prefix + "cx and " +
                    prefix + "cy",
                "the host's camera in this file");
  }
  if (prefix == "Camera1.") {
    const double wider = resizing(file, "width", "newWidth");
    const double higher = resizing(file, "height", "newHeight");
    camera.fx *= wider;
    camera.cx *= wider;
    camera.fy *= higher;
    camera.cy *= higher;
  }
  return camera;
}
#endif

/// Refuses numbers out of range that the filter's own options do not hold. Their users would refuse
/// them, too, but later, and `dynfilter doctor` makes no user.
void require_ranges(const SettingsFile& file, const PluginSettings& settings) {
  const auto require = [&](bool is_right, const char* name, double value, const char* want) {
    if (!is_right) file.refuse(name, concatenate(value), want);
  };
  const double reach_s = settings.mask_folder_options.max_time_difference_s;
  require(reach_s >= 0 && is_time_in_seconds(reach_s), "max_time_difference_s", reach_s,
          "at least 0 seconds");
  require(settings.max_wait_s >= 0 && settings.max_wait_s <= 3600, "max_wait_s",
          settings.max_wait_s, "0 to 3600 seconds");
  require(settings.remote_timeout_s > 0 && settings.remote_timeout_s <= 3600, "remote_timeout_s",
          settings.remote_timeout_s, "above 0 and at most 3600 seconds");
  require(settings.stereo.min_depth_m > 0 && settings.stereo.min_depth_m <= 1e6, "min_depth_m",
          settings.stereo.min_depth_m, "above 0 and at most 1000000 metres");
}

/// Returns the key of a setting that does nothing without images; empty if none is set.
std::string find_image_key(const SettingsFile& file, const PluginSettings& settings) {
#ifdef DYNFILTER_HAS_MOTION
  if (settings.motion_camera) return file.key_of("motion");
#endif
  if (settings.moves_masks) return file.key_of("propagate");
  if (settings.depth_frames_late != 0) return file.key_of("depth_frames_late");
  const bool draws = settings.overlay_every > 0 && !settings.output_folder.empty();
  return draws ? file.key_of("overlay_every") : "";
}

}  // namespace

PluginSettings read_plugin_settings(const std::string& path, const std::string& prefix) {
  SettingsFile file(path, prefix);
  PluginSettings settings;
  settings.file = path;
  file.read_flag("enabled", settings.enabled);
  if (!settings.enabled) return settings;
  read_colour_order(file, settings.takes_rgb);
  read_masks(file, settings);
  read_enumeration(file, "rule", {"depth", "paper", "mask"}, settings.filter.compensator.rule);
  read_mask_culler(file, settings.filter.mask_culler);
  read_depth_compensator(file, settings.filter.compensator.depth);
  file.read_flag("match_pairs", settings.matches_pairs);
  file.read_number("min_depth_m", settings.stereo.min_depth_m);
  read_edge_compensator(file, settings.filter.compensator.paper);
  read_feature_floor(file, settings.filter.feature_floor);
  file.read_count("start_features", settings.start_features);
  refuse_depth_offset(file);
  file.read_count("depth_check_frames", settings.depth_check_frames);
#ifdef DYNFILTER_HAS_MOTION
  bool with_motion = false;
  file.read_flag("motion", with_motion);
  if (with_motion) settings.motion_camera = read_camera(file);
  read_wait_for_motion(file, settings.wait_for_motion);
  if (!with_motion) settings.wait_for_motion = 0;
#else
  for (const char* name : {"motion", "wait_for_motion"}) {
    if (!file.has(name)) continue;
    file.refuse(name, "a value, but this dynfilter was built without motion",
                "one built with -DDYNFILTER_BUILD_MOTION=ON");
  }
#endif
  read_depth_frames_late(file, settings.depth_frames_late);
  file.read_text("output_folder", settings.output_folder);
  file.read_count("overlay_every", settings.overlay_every);
  file.finish();
  require_ranges(file, settings);
  settings.source_key = require_one_segmenter(file, settings);
  settings.image_key = find_image_key(file, settings);
  settings.motion_key = file.key_of("motion");
  settings.wait_for_motion_key = file.key_of("wait_for_motion");
  settings.depth_frames_late_key = file.key_of("depth_frames_late");
  settings.output_folder_key = file.key_of("output_folder");
  settings.missing_masks_key = file.key_of("missing_masks");
  settings.max_time_difference_key = file.key_of("max_time_difference_s");
  settings.idle = find_idle_settings(file, settings);
  settings.depth_units_per_metre =
      file.host_number("DepthMapFactor", file.host_number("RGBD.DepthMapFactor", 0));
  return settings;
}

}  // namespace dynfilter::detail
