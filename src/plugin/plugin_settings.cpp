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
#include "io/yaml_file.hpp"
#include "plugin/map_start.hpp"

namespace dynfilter::detail {
namespace {

std::string join(const std::vector<std::string>& words, const std::string& prefix = {}) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : ", ").append(prefix + word);
  return text;
}

/// The settings "<prefix>.*" in a host's file. Each function that reads declares its name, and
/// returns `otherwise` if the file lacks it. All errors are std::runtime_error that name file and
/// key.
class Keys {
 public:
  Keys(const std::string& path, const std::string& prefix) : host(path), prefix_(prefix + ".") {}

  const YamlFile host;  // the whole file

  std::string name(const std::string& name) const { return prefix_ + name; }

  std::string text(const std::string& name, const std::string& otherwise = {}) {
    return host.text(declare(name)).value_or(otherwise);
  }

  double number(const std::string& name, double otherwise) {
    return host.number(declare(name)).value_or(otherwise);
  }

  std::size_t count(const std::string& name) {
    return static_cast<std::size_t>(host.integer(declare(name), 0).value_or(0));
  }

  std::string choice(const std::string& name, const std::vector<std::string>& choices,
                     const std::string& otherwise) {
    const std::string want = "one of " + join(choices);
    const std::optional<std::string> chosen = host.text(declare(name), want);
    if (!chosen) return otherwise;
    if (std::find(choices.begin(), choices.end(), *chosen) != choices.end()) return *chosen;
    refuse(name, "\"" + *chosen + "\"", want);
  }

  bool flag(const std::string& name, bool otherwise) {
    const std::string key = declare(name);
    if (!host.has(key)) return otherwise;
    const std::string shown = host.shown(key);
    for (const bool value : {false, true}) {
      if (shown == (value ? "1" : "0") || shown == (value ? "\"yes\"" : "\"no\"")) return value;
    }
    refuse(name, shown, "0 or 1, or \"no\" or \"yes\"");
  }

  std::vector<int> integers(const std::string& name, const std::vector<int>& otherwise) {
    return host.integers(declare(name)).value_or(otherwise);
  }

  [[noreturn]] void refuse(const std::string& name, const std::string& got,
                           const std::string& want) const {
    host.refuse(prefix_ + name, got, want);
  }

  /// Refuses a setting that would be ignored, because it needs another.
  void require_use(const std::string& name, bool is_used, const std::string& other) const {
    const std::string key = prefix_ + name;
    if (!is_used && host.has(key))
      refuse(name, host.shown(key) + ", but no " + other, "both, or neither");
  }

  /// Refuses a file without any setting, a name that was not declared, and a block "<prefix>:",
  /// which would be ignored.
  void finish() const {
    const std::string block = prefix_.substr(0, prefix_.size() - 1);
    if (host.has(block)) {
      host.refuse(block, "settings in a block",
                  "each in a line of its own, as " + name("mask_folder") + ": \"masks\"");
    }
    bool has_any = false;
    for (const std::string& key : host.keys()) {
      if (key.compare(0, prefix_.size(), prefix_) != 0) continue;
      has_any = true;
      const std::string name = key.substr(prefix_.size());
      if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
      host.refuse("there is no setting " + key + ". The settings are: " + join(known_, prefix_));
    }
    if (has_any) return;
    host.refuse("has no setting of dynfilter. Add at least\n  " + name("mask_folder") +
                ": \"masks\"\nor, to run without the filter,\n  " + name("enabled") +
                ": 0\nThe settings are: " + join(known_, prefix_));
  }

 private:
  std::string declare(const std::string& name) {
    known_.push_back(name);
    return prefix_ + name;
  }

  std::string prefix_;  // with its dot
  std::vector<std::string> known_;
};

/// Reads the one segmenter: a folder, another process or a network.
void read_segmenter(Keys& keys, PluginSettings& settings) {
  settings.mask_folder = keys.text("mask_folder");
  settings.remote = keys.text("remote");
  settings.model = keys.text("model");
  settings.device = keys.text("device", settings.device);
#ifndef DYNFILTER_HAS_REMOTE_SEGMENTER
  if (!settings.remote.empty()) {
    keys.refuse("remote", settings.remote + ", but this dynfilter was built without remote masks",
                "one built with -DDYNFILTER_BUILD_REMOTE=ON, where ZeroMQ is (cppzmq-dev)");
  }
#endif
#ifndef DYNFILTER_HAS_NETWORKS
  if (!settings.model.empty()) {
    keys.refuse("model", settings.model + ", but this dynfilter was built without networks",
                "one built with -DDYNFILTER_BUILD_NETWORKS=ON, where OpenCV has its module dnn");
  }
#endif
}

void require_one_segmenter(const Keys& keys, const PluginSettings& settings) {
  std::string given;
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) given += (given.empty() ? "" : " and ") + std::string(name);
  };
  add("mask_folder", settings.mask_folder);
  add("remote", settings.remote);
  add("model", settings.model);
  if (given.empty()) {
    keys.refuse(
        "mask_folder", "nothing",
        "the folder of the masks; to run without the filter, set " + keys.name("enabled") + ": 0");
  }
  if (given != settings.source()) keys.refuse("mask_folder", given, "one source of masks");
}

void read_masks(Keys& keys, PluginSettings& settings) {
  read_segmenter(keys, settings);
  const std::string thread = keys.choice("async", {"wait", "latest"}, "");
  if (!thread.empty()) settings.hand_over = thread == "wait" ? HandOver::wait : HandOver::latest;
  settings.moves_masks = keys.flag("propagate", false);
  settings.missing_masks = keys.choice("missing_masks", {"error", "keep"}, settings.missing_masks);
  settings.takes_rgb = keys.choice("colour_order", {"bgr", "rgb"}, "bgr") == "rgb";
  double& reach_s = settings.mask_folder_options.max_time_difference_s;
  reach_s = keys.number("max_time_difference_s", reach_s);
  if (!(reach_s >= 0 && is_time_in_seconds(reach_s))) {
    keys.refuse("max_time_difference_s", concatenate(reach_s), "at least 0 seconds");
  }
}

void read_mask_culler(Keys& keys, MaskCullerOptions& options) {
  options.dynamic_classes = keys.integers("dynamic_classes", options.dynamic_classes);
  options.margin_px = keys.number("margin_px", options.margin_px);
  const std::string static_mask = keys.text("static_mask");
  if (static_mask.empty()) return;
  try {
    options.static_mask = read_image(static_mask, cv::IMREAD_UNCHANGED);
  } catch (const std::runtime_error& error) {
    keys.refuse("static_mask", error.what(), "an image file");
  }
  if (options.static_mask.type() != CV_8UC1) {
    keys.refuse("static_mask", static_mask + " of type " + type_name(options.static_mask),
                "one channel of 8 bits");
  }
}

void read_rule(Keys& keys, PluginSettings& settings) {
  CompensatorOptions& options = settings.filter.compensator;
  const std::string rule = keys.choice("rule", {"depth", "paper", "mask"}, "depth");
  if (rule == "paper") options.rule = CompensationRule::paper;
  if (rule == "mask") options.rule = CompensationRule::mask;
  options.depth.half_width_m = keys.number("half_width_m", options.depth.half_width_m);
  double& nearest_m = settings.min_depth_m;
  nearest_m = keys.number("min_depth_m", nearest_m);
  if (!(nearest_m > 0 && nearest_m <= 1e6)) {
    keys.refuse("min_depth_m", concatenate(nearest_m), "above 0 and at most 1000000 metres");
  }
}

/// Returns the factor by which ORB-SLAM3 resizes its images in one direction, 1 without its keys.
double resizing(const Keys& keys, const std::string& side, const std::string& new_side) {
  const std::optional<double> wanted = keys.host.number("Camera." + new_side);
  if (!wanted) return 1;
  const double given = keys.host.number("Camera." + side).value_or(0);
  if (!(given > 0 && *wanted > 0)) {
    keys.refuse("motion", "1 with Camera." + new_side,
                "Camera." + side + " and Camera." + new_side + " above 0");
  }
  return *wanted / given;
}

/// Reads the camera from the host's own keys. ORB-SLAM3 keeps the camera of the images before it
/// resizes them.
Camera read_camera(const Keys& keys) {
  const YamlFile& host = keys.host;
  const std::string prefix = camera_prefix(host);
  Camera camera = read_lens(host);
  const bool has_centre = host.has(prefix + "cx") && host.has(prefix + "cy");
  if (!(camera.fx > 0 && camera.fy > 0 && has_centre)) {
    keys.refuse("motion",
                "1 without " + prefix + "fx and " + prefix + "fy above 0, " + prefix + "cx and " +
                    prefix + "cy",
                "the host's camera in this file");
  }
  const bool is_new = prefix == "Camera1.";
  const double scale = host.number("Camera.imageScale").value_or(1);  // of the older files
  const double wider = is_new ? resizing(keys, "width", "newWidth") : scale;
  const double higher = is_new ? resizing(keys, "height", "newHeight") : scale;
  camera.fx *= wider;
  camera.cx *= wider;
  camera.fy *= higher;
  camera.cy *= higher;
  return camera;
}

/// Reads DepthMapFactor, or ORB-SLAM3's name for it; 0 without.
double read_depth_factor(const Keys& keys) {
  const std::string key = depth_factor_key(keys.host);
  const double factor = keys.host.number(key).value_or(0);
  if (factor < 0) keys.host.refuse(key, concatenate(factor), "at least 0");
  return factor;
}

/// Reads ORBextractor.nFeatures; 0 without.
std::size_t read_features(const Keys& keys) {
  constexpr double most = 1e6;  // a host would extract for minutes
  const char* const key = "ORBextractor.nFeatures";
  const double features = keys.host.number(key).value_or(0);
  if (features >= 0 && features <= most) return static_cast<std::size_t>(features);
  keys.host.refuse(key, keys.host.shown(key), "0 to 1000000 features");
}

/// Motion is judged by default where it can be: for a pinhole RGB-D camera, after rule depth.
void read_motion(Keys& keys, PluginSettings& settings) {
  const bool is_possible = settings.filter.compensator.rule == CompensationRule::depth &&
                           settings.depth_units_per_metre > 0;
  settings.asks_for_motion = keys.host.has(keys.name("motion"));
  if (!keys.flag("motion", is_possible)) return;
#ifndef DYNFILTER_HAS_MOTION
  if (!settings.asks_for_motion) return;
  keys.refuse("motion", "1, but this dynfilter was built without motion",
              "one built with -DDYNFILTER_BUILD_MOTION=ON");
#endif
  try {
    settings.motion_camera = read_camera(keys);
  } catch (const std::runtime_error&) {
    if (settings.asks_for_motion) throw;
    return;
  }
  if (settings.orb_features == 0) return;
  // ORB-SLAM needs as many again after it lost the camera. Motion judges what caution keeps.
  double& share = settings.filter.compensator.depth.min_kept_share;
  share = std::clamp(1.0 * map_features / static_cast<double>(settings.orb_features), share, 0.501);
}

/// Reads what is recorded, and where.
void read_recording(Keys& keys, PluginSettings& settings) {
  settings.output_folder = keys.text("output_folder");
  settings.overlay_every = static_cast<int>(keys.count("overlay_every"));
  const std::string& read = settings.mask_folder;
  if (!read.empty() && !settings.output_folder.empty() &&
      is_within(canonical_folder(settings.output_folder), canonical_folder(read))) {
    keys.refuse("output_folder", settings.output_folder,
                "a folder outside " + read + ", which is read");
  }
}

/// Refuses settings that would be ignored. A folder's masks are always waited for.
void require_use_of_all(const Keys& keys, const PluginSettings& settings) {
  const bool has_folder = !settings.mask_folder.empty();
  const bool waits = settings.hand_over.value_or(HandOver::wait) == HandOver::wait;
  const CompensationRule rule = settings.filter.compensator.rule;
  const bool is_recorded = settings.overlay_every == 0 || !settings.output_folder.empty();
  keys.require_use("device", !settings.model.empty(), "model");
  keys.require_use("max_time_difference_s", has_folder, "mask_folder");
  keys.require_use("async", !has_folder || waits, "remote or model");
  keys.require_use("half_width_m", rule == CompensationRule::depth, "rule: \"depth\"");
  keys.require_use("min_depth_m", rule != CompensationRule::mask, "rule: \"depth\" or \"paper\"");
  keys.require_use("overlay_every", is_recorded, "output_folder");
}

}  // namespace

std::string PluginSettings::need_of_images() const {
  if (motion_camera) return "motion";
  if (moves_masks) return "propagate";
  return overlay_every > 0 ? "overlay_every" : "";
}

PluginSettings read_plugin_settings(const std::string& path, const std::string& prefix) {
  Keys keys(path, prefix);
  PluginSettings settings;
  settings.file = path;
  settings.prefix = prefix + ".";
  settings.enabled = keys.flag("enabled", true);
  if (!settings.enabled) return settings;
  read_masks(keys, settings);
  read_mask_culler(keys, settings.filter.mask_culler);
  settings.names_classes = keys.host.has(keys.name("dynamic_classes"));
  read_rule(keys, settings);
  settings.depth_units_per_metre = read_depth_factor(keys);
  settings.orb_features = read_features(keys);
  read_motion(keys, settings);
  settings.filter.feature_floor = keys.count("floor");
  read_recording(keys, settings);
  keys.finish();
  require_one_segmenter(keys, settings);
  require_use_of_all(keys, settings);
  return settings;
}

}  // namespace dynfilter::detail
