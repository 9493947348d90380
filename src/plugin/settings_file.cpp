// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/settings_file.hpp"

#include <algorithm>

namespace dynfilter::detail {
namespace {

/// Returns what to do instead of a setting that earlier versions had; empty for other names.
std::string instead_of(const std::string& name) {
  constexpr struct {
    const char *instead, *names;
  } dropped[] = {
      {"its value is a constant now: remove the line",
       " remote_timeout_s read_ahead max_wait_s box_margin_px min_pixels start_features "
       "min_nearness mask_margin_px shadow_px feature_reach_px feature_doubt_px min_feature_share "
       "stale_age_s motion_px_per_s samples seed missing_depth depth.outlier_rule "
       "depth.outlier_factor depth.min_samples depth.expansion code.outlier_rule "
       "code.outlier_factor code.min_samples code.expansion depth_lbp.missing_neighbour "
       "depth_check_frames "},
      {"remove the line",
       " min_nearness_if_stale min_nearness_in_shadow max_beyond_range_m min_off_middle_m "},
      {"set half_width_m", " object_depth.min_half_width_m object_depth.max_half_width_m "},
      {"set margin_px", " margin_per_diameter "},
      {"raise the number of features that the host extracts", " policy "},
      {"hand over the left image alone to leave pairs unmatched", " match_pairs "},
      {"begin the map when is_motion_decided() of the statistics that filter() returns",
       " wait_for_motion "},
      {"set overlay_every, and make a film of overlays/ with ffmpeg", " video "},
      {"pair the images anew by dynfilter sync --write", " depth_offset_s depth_frames_late "}};
  for (const auto& some : dropped) {
    if (std::string(some.names).find(' ' + name + ' ') != std::string::npos) return some.instead;
  }
  return {};
}

std::string join(const std::vector<std::string>& words, const std::string& prefix = {}) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + prefix + word;
  return text;
}

}  // namespace

SettingsFile::SettingsFile(const std::string& path, const std::string& prefix)
    : file_(path), prefix_(prefix + ".") {}

std::string SettingsFile::declare(const std::string& name) {
  known_.push_back(name);
  return key_of(name);
}

void SettingsFile::read_text(const std::string& name, std::string& value) {
  value = file_.text(declare(name)).value_or(value);
}

void SettingsFile::read_choice(const std::string& name, const std::vector<std::string>& choices,
                               std::string& value) {
  const std::string want = "one of " + join(choices);
  const std::optional<std::string> text = file_.text(declare(name), want);
  if (!text) return;
  if (std::find(choices.begin(), choices.end(), *text) == choices.end()) {
    refuse(name, "\"" + *text + "\"", want);
  }
  value = *text;
}

void SettingsFile::read_flag(const std::string& name, bool& value) {
  if (!file_.has(declare(name))) return;
  const std::string shown = file_.shown(key_of(name));
  if (shown != "0" && shown != "1") refuse(name, shown, "0 or 1");
  value = shown == "1";
}

void SettingsFile::read_number(const std::string& name, double& value) {
  value = file_.number(declare(name)).value_or(value);
}

void SettingsFile::read_count(const std::string& name, std::size_t& value) {
  const std::optional<int> number = file_.integer(declare(name), 0);
  if (number) value = static_cast<std::size_t>(*number);
}

void SettingsFile::read_integers(const std::string& name, std::vector<int>& values) {
  values = file_.integers(declare(name)).value_or(values);
}

void SettingsFile::finish() const {
  const std::string block = prefix_.substr(0, prefix_.size() - 1);
  if (file_.has(block)) {
    file_.refuse(block, "settings in a block",
                 "each in a line of its own, as " + key_of("mask_folder") + ": \"masks\"");
  }
  bool has_any = false;
  for (const std::string& key : file_.keys()) {
    if (key.compare(0, prefix_.size(), prefix_) != 0) continue;
    has_any = true;
    require_known(key.substr(prefix_.size()));
  }
  if (has_any) return;
  file_.refuse("has no setting of dynfilter. Add at least\n  " + key_of("mask_folder") +
               ": \"masks\"\nor, to run without the filter,\n  " + key_of("enabled") +
               ": 0\nThe settings are: " + join(known_, prefix_));
}

void SettingsFile::require_known(const std::string& name) const {
  if (std::find(known_.begin(), known_.end(), name) != known_.end()) return;
  const std::string instead = instead_of(name);
  if (!instead.empty()) file_.refuse(key_of(name) + " is no setting any more; " + instead);
  file_.refuse("there is no setting " + key_of(name) +
               ". The settings are: " + join(known_, prefix_));
}

}  // namespace dynfilter::detail
