// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/idle_settings.hpp"

#include <initializer_list>

namespace dynfilter::detail {
namespace {

/// Settings that act only if another setting has some value.
struct Dependents {
  bool has_effect;
  std::string want;  // what they need
  std::initializer_list<const char*> names;
};

}  // namespace

std::vector<std::string> find_idle_settings(const SettingsFile& file,
                                            const PluginSettings& settings) {
  const CompensationRule rule = settings.filter.compensator.rule;
  const bool has_folder = !settings.mask_folder.empty();
  const bool has_thread = settings.hand_over.has_value();
  const bool has_policy = settings.filter.feature_floor.policy != FloorPolicy::report_only;
  const std::string output_folder = file.key_of("output_folder");
  const std::string with_folder = file.key_of("mask_folder");
  const std::string with_rule = file.key_of("rule");
#ifdef DYNFILTER_HAS_MOTION
  const bool has_motion = settings.motion_camera.has_value();
#else
  const bool has_motion = false;
#endif
  // The rule "paper" takes the depths of pairs around objects, as the rule "depth" does.
  const bool by_areas = rule == CompensationRule::depth ||
                        (rule == CompensationRule::paper && settings.matches_pairs);
  const Dependents all[] = {
      {has_motion, file.key_of("motion") + ": 1", {"wait_for_motion"}},
      {settings.overlay_every == 0 || !settings.output_folder.empty(),
       output_folder,
       {"overlay_every"}},
      {!has_policy || settings.filter.feature_floor.floor > 0,
       file.key_of("floor") + " above 0",
       {"policy"}},
      {settings.hand_over == HandOver::limited_wait,
       file.key_of("async") + ": \"limited_wait\"",
       {"max_wait_s"}},
      {!settings.remote.empty(), file.key_of("remote"), {"remote_timeout_s"}},
      {has_folder, with_folder, {"box_margin_px", "min_pixels"}},
      {has_folder && !has_thread, with_folder + " and no " + file.key_of("async"), {"read_ahead"}},
      {rule == CompensationRule::depth,
       with_rule + ": \"depth\"",
       {"object_depth.min_half_width_m", "object_depth.max_half_width_m", "min_nearness",
        "min_nearness_if_stale", "min_nearness_in_shadow", "mask_margin_px", "shadow_px",
        "max_beyond_range_m", "min_off_middle_m", "feature_doubt_px", "min_feature_share"}},
      {by_areas,
       with_rule + ": \"depth\", or \"paper\" with pairs",
       {"feature_reach_px", "motion_px_per_s"}},
      {by_areas || has_motion, with_rule + ": \"depth\", or motion", {"stale_age_s"}},
      {rule != CompensationRule::mask,
       with_rule + ": \"depth\" or \"paper\"",
       {"match_pairs", "min_depth_m"}},
      {settings.matches_pairs, file.key_of("match_pairs") + ": 1", {"min_depth_m"}},
      {rule == CompensationRule::paper,
       with_rule + ": \"paper\"",
       {"samples", "seed", "missing_depth", "depth.outlier_rule", "depth.outlier_factor",
        "depth.min_samples", "depth.expansion", "code.outlier_rule", "code.outlier_factor",
        "code.min_samples", "code.expansion", "depth_lbp.missing_neighbour"}}};
  std::vector<std::string> sentences;
  for (const Dependents& some : all) {
    if (some.has_effect) continue;
    for (const char* name : some.names) {
      if (!file.has(name)) continue;
      sentences.push_back("dynfilter: " + settings.file + ": " + file.key_of(name) +
                          " has no effect; it needs " + some.want);
    }
  }
  return sentences;
}

}  // namespace dynfilter::detail
