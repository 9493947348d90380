// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/plugin_settings.hpp"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/camera_keys.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "plugin/settings_file.hpp"

namespace dynfilter::detail {
namespace {

/// Reads the one segmenter: a folder, another process or a network.
void read_segmenter(SettingsFile& file, PluginSettings& settings) {
  file.read_text("mask_folder", settings.mask_folder);
  file.read_text("remote", settings.remote);
  file.read_text("model", settings.model);
  file.read_text("device", settings.device);
  if (settings.model.empty() && settings.device != "cpu") {
    file.refuse("device", settings.device + ", but no model", "it with a model");
  }
#ifndef DYNFILTER_HAS_REMOTE_SEGMENTER
  if (!settings.remote.empty()) {
    file.refuse("remote", "a socket, but this dynfilter was built without remote masks",
                "one built for Linux");
  }
#endif
#ifndef DYNFILTER_HAS_NETWORKS
  if (!settings.model.empty()) {
    file.refuse("model", settings.model + ", but this dynfilter was built without networks",
                "one built with -DDYNFILTER_BUILD_NETWORKS=ON, where OpenCV has its module dnn");
  }
#endif
}

void require_one_segmenter(const SettingsFile& file, const PluginSettings& settings) {
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
  if (given != settings.source()) file.refuse("mask_folder", given, "one source of masks");
}

void read_masks(SettingsFile& file, PluginSettings& settings) {
  read_segmenter(file, settings);
  std::string thread, moved = "no", order = "bgr";
  const std::vector<std::string> threads = {"wait", "limited_wait", "latest", "drop"};
  file.read_choice("async", threads, thread);
  const auto chosen = std::find(threads.begin(), threads.end(), thread) - threads.begin();
  if (!thread.empty()) settings.hand_over = static_cast<HandOver>(chosen);  // in that order
  file.read_choice("propagate", {"no", "yes"}, moved);
  settings.moves_masks = moved == "yes";
  file.read_choice("missing_masks", {"error", "keep"}, settings.missing_masks);
  file.read_choice("colour_order", {"bgr", "rgb"}, order);
  settings.takes_rgb = order == "rgb";
  double& reach_s = settings.mask_folder_options.max_time_difference_s;
  file.read_number("max_time_difference_s", reach_s);
  if (!(reach_s >= 0 && is_time_in_seconds(reach_s))) {
    file.refuse("max_time_difference_s", concatenate(reach_s), "at least 0 seconds");
  }
}

void read_mask_culler(SettingsFile& file, MaskCullerOptions& options) {
  file.read_integers("dynamic_classes", options.dynamic_classes);
  file.read_number("margin_px", options.margin_px);
  std::string static_mask;
  file.read_text("static_mask", static_mask);
  if (static_mask.empty()) return;
  try {
    options.static_mask = read_image(static_mask, cv::IMREAD_UNCHANGED);
  } catch (const std::runtime_error& error) {
    file.refuse("static_mask", error.what(), "an image file");
  }
  if (options.static_mask.type() != CV_8UC1) {
    file.refuse("static_mask", static_mask + " of type " + type_name(options.static_mask),
                "one channel of 8 bits");
  }
}

void read_rule(SettingsFile& file, PluginSettings& settings) {
  CompensatorOptions& options = settings.filter.compensator;
  std::string rule = "depth";
  file.read_choice("rule", {"depth", "paper", "mask"}, rule);
  if (rule == "paper") options.rule = CompensationRule::paper;
  if (rule == "mask") options.rule = CompensationRule::mask;
  file.read_number("half_width_m", options.depth.half_width_m);
  double& nearest_m = settings.stereo.min_depth_m;
  file.read_number("min_depth_m", nearest_m);
  if (!(nearest_m > 0 && nearest_m <= 1e6)) {
    file.refuse("min_depth_m", concatenate(nearest_m), "above 0 and at most 1000000 metres");
  }
}

#ifdef DYNFILTER_HAS_MOTION
/// Returns the factor by which ORB-SLAM3 resizes its images in one direction, 1 without its keys.
double resizing(const SettingsFile& file, const std::string& side, const std::string& new_side) {
  const std::optional<double> wanted = file.host().number("Camera." + new_side);
  if (!wanted) return 1;
  const double given = file.host().number("Camera." + side).value_or(0);
  if (!(given > 0 && *wanted > 0)) {
    file.refuse("motion", "1 with Camera." + new_side,
                "Camera." + side + " and Camera." + new_side + " above 0");
  }
  return *wanted / given;
}

/// Reads the camera from the host's own keys. ORB-SLAM3 keeps the camera of the images before it
/// resizes them.
Camera read_camera(const SettingsFile& file) {
  const YamlFile& host = file.host();
  const std::string prefix = camera_prefix(host);
  Camera camera = read_lens(host);
  const bool has_centre = host.has(prefix + "cx") && host.has(prefix + "cy");
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

/// Reads DepthMapFactor, or ORB-SLAM3's name for it; 0 without.
double read_depth_factor(const SettingsFile& file) {
  const std::string key = depth_factor_key(file.host());
  const double factor = file.host().number(key).value_or(0);
  if (factor < 0) file.host().refuse(key, concatenate(factor), "at least 0");
  return factor;
}

/// Motion is judged by default where it can be: for a pinhole RGB-D camera, after rule depth.
void read_motion(SettingsFile& file, PluginSettings& settings) {
  bool is_wanted = settings.filter.compensator.rule == CompensationRule::depth &&
                   settings.depth_units_per_metre > 0;
  const bool is_asked_for = file.host().has(file.key_of("motion"));
  file.read_flag("motion", is_wanted);
  if (!is_wanted) return;
#ifdef DYNFILTER_HAS_MOTION
  try {
    settings.motion_camera = read_camera(file);
    if (settings.orb_features == 0) return;
    // ORB-SLAM needs as many again after it lost the camera. Motion judges what caution leaves.
    double& share = settings.filter.compensator.depth.min_kept_share;
    share =
        std::clamp(1.0 * map_features / static_cast<double>(settings.orb_features), share, 0.501);
  } catch (const std::runtime_error&) {
    if (is_asked_for) throw;
  }
#else
  if (!is_asked_for) return;
  file.refuse("motion", "1, but this dynfilter was built without motion",
              "one built with -DDYNFILTER_BUILD_MOTION=ON");
#endif
}

}  // namespace

std::string PluginSettings::need_of_images() const {
#ifdef DYNFILTER_HAS_MOTION
  if (motion_camera) return "motion";
#endif
  if (moves_masks) return "propagate";
  return overlay_every > 0 && !output_folder.empty() ? "overlay_every" : "";
}

PluginSettings read_plugin_settings(const std::string& path, const std::string& prefix) {
  SettingsFile file(path, prefix);
  PluginSettings settings;
  settings.file = path;
  settings.prefix = prefix + ".";
  file.read_flag("enabled", settings.enabled);
  if (!settings.enabled) return settings;
  read_masks(file, settings);
  read_mask_culler(file, settings.filter.mask_culler);
  read_rule(file, settings);
  settings.depth_units_per_metre = read_depth_factor(file);
  const double features = file.host().number("ORBextractor.nFeatures").value_or(0);
  settings.orb_features = features > 0 ? static_cast<std::size_t>(features) : 0;
  read_motion(file, settings);
  std::size_t overlay_every = 0;
  file.read_count("floor", settings.filter.feature_floor.floor);
  file.read_text("output_folder", settings.output_folder);
  file.read_count("overlay_every", overlay_every);
  settings.overlay_every = static_cast<int>(overlay_every);
  file.finish();
  require_one_segmenter(file, settings);
  const std::string& read = settings.mask_folder;
  if (!read.empty() && !settings.output_folder.empty() &&
      is_within(canonical_folder(settings.output_folder), canonical_folder(read))) {
    file.refuse("output_folder", settings.output_folder,
                "a folder outside " + read + ", which is read");
  }
  return settings;
}

}  // namespace dynfilter::detail
