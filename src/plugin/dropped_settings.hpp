// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_DROPPED_SETTINGS_HPP
#define DYNFILTER_SRC_PLUGIN_DROPPED_SETTINGS_HPP

#include <string>

namespace dynfilter::detail {

/// Returns what to do instead of a setting that earlier versions had; empty for other names.
inline std::string instead_of(const std::string& name) {
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

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_DROPPED_SETTINGS_HPP
