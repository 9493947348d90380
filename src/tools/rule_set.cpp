// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "rule_set.hpp"

#include <functional>
#include <iterator>
#include <memory>
#include <utility>

#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/edge_compensator.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "dynfilter/stage.hpp"
#include "frame_rules.hpp"
#include "lab/rules/single_frame.hpp"

namespace dynfilter::tools {
namespace {

template <class Stage>
AnyStage any_stage(Stage stage) {
  return [stage = std::move(stage)](const FilterInput& input, FeatureLabels& labels,
                                    Workspace& workspace) {
    check_stage(stage, input);
    run_stage(stage, input, labels, workspace);
  };
}

AnyStage empty_stage() {
  return [](const FilterInput&, FeatureLabels&, Workspace&) {};
}

/// Makes the motion judge of a rule with a state of its own.
AnyStage motion_stage(const RuleInfo& rule, const CameraParameters& c) {
  const auto state = std::make_shared<MotionState>();
  const PinholeCamera camera{c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3};
  MotionJudgeOptions options;
  options.uses_kept_frames = rule.keeps_frames;
  return [state, judge = MotionJudge(camera, *state, options)](
             const FilterInput& input, FeatureLabels& labels, Workspace& workspace) {
    judge(input, labels, workspace);
  };
}

AnyStage paper(const MaskCullerOptions&, std::uint64_t seed) {
  EdgeCompensatorOptions options = EdgeCompensatorOptions::paper();
  options.seed = seed;
  return EdgeCompensator(options);
}

AnyStage depth(const MaskCullerOptions&, std::uint64_t) { return DepthCompensator(); }

struct Entry {
  RuleInfo info;
  std::function<AnyStage(const MaskCullerOptions&, std::uint64_t)> make;
};

/// Makes the entry of another system's rule; it uses the same dynamic classes as ours.
template <class Stage>
Entry peer_entry(const char* name, const char* description) {
  return {{name, description, false, false, true},
          [](const MaskCullerOptions& masks, std::uint64_t) {
            return any_stage(Stage(masks.dynamic_classes));
          }};
}

/// Makes the entry of a rule that judges motion over kept frames, too.
Entry keeping_entry(RuleInfo info) {
  info.keeps_frames = true;
  return {info, depth};
}

/// Makes the entry of a rule whose map begins when motion is decided.
Entry waiting_entry(RuleInfo info) {
  info.waits_for_motion = true;
  return {info, depth};
}

std::vector<Entry> make_entries() {
  using Masks = MaskCullerOptions;
  std::vector<Entry> all = {
      {{"none", "nothing", false, false, false},
       [](const Masks&, std::uint64_t) { return empty_stage(); }},
      {{"mask", "features on the masks", true, false, false},
       [](const Masks&, std::uint64_t) { return empty_stage(); }},
      peer_entry<peers::DilatedMask>("dynaslam",
                                     "features on masks dilated by a 31x31 ellipse (DynaSLAM)"),
      peer_entry<peers::WholeBox>("crowd_slam", "features in the box, grown by 5 px (Crowd-SLAM)"),
      peer_entry<peers::BoxDepthMask>("ngd_slam",
                                      "features on a mask made from the box's depth (NGD-SLAM)"),
      {{"paper", "features on the masks, and in the box by depth and D-LBP (the paper)"}, paper},
      {{"depth", "features on the masks, and in the box at the object's depth (the default)"},
       depth},
      {{"mask_moved", "rule mask on masks moved with the image", true, false, false, true, true},
       [](const Masks&, std::uint64_t) { return empty_stage(); }},
      {{"depth_moved", "rule depth on masks moved with the image", true, false, true, true, true},
       depth},
      {{"depth_waited", "rule depth on the true masks, as if the camera waited for them", true,
        true, true, false, true},
       depth},
      {{"motion", "features that move, without masks", false, false, true, false, false, true},
       [](const Masks&, std::uint64_t) { return empty_stage(); }},
      {{"masks_motion", "rule mask, then what moves; still objects get their features back", true,
        false, true, false, false, true},
       [](const Masks&, std::uint64_t) { return empty_stage(); }},
      {{"depth_motion", "rule depth, then what moves; still objects get their features back", true,
        false, true, false, false, true},
       depth},
      keeping_entry({"depth_motion_kept", "as depth_motion, with frames kept for what moves slowly",
                     true, false, true, false, false, true}),
      waiting_entry({"depth_motion_waits", "as depth_motion; the map begins when motion is decided",
                     true, false, true, false, false, true}),
      {{"perfect", "features on the true masks; with --truth motion, on what moves", true, true,
        false},
       [](const Masks&, std::uint64_t) { return empty_stage(); }},
  };
  for (const RuleInfo& rule : frame_rules()) {  // before the bound, which comes last
    all.insert(std::prev(all.end()),
               {rule, [](const Masks&, std::uint64_t) { return empty_stage(); }});
  }
  return all;
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = make_entries();
  return all;
}

const Entry& entry_of(const std::string& name) {
  std::string names;
  for (const Entry& entry : entries()) {
    if (entry.info.name == name) return entry;
    names += (names.empty() ? "" : ", ") + entry.info.name;
  }
  detail::throw_misuse("rule", "'" + name + "'", "one of " + names);
}

}  // namespace

const std::vector<RuleInfo>& all_rules() {
  static const std::vector<RuleInfo> rules = [] {
    std::vector<RuleInfo> infos;
    for (const Entry& entry : entries()) infos.push_back(entry.info);
    return infos;
  }();
  return rules;
}

std::vector<std::string> all_rule_names() {
  std::vector<std::string> names;
  for (const RuleInfo& rule : all_rules()) names.push_back(rule.name);
  return names;
}

std::vector<std::string> usual_rule_names() {
  std::vector<std::string> names;
  for (const RuleInfo& rule : all_rules()) {
    const bool is_on_request = rule.about_late_masks || rule.follows_motion || rule.compares_frames;
    if (!is_on_request) names.push_back(rule.name);
  }
  return names;
}

const RuleInfo& rule_info(const std::string& name) { return entry_of(name).info; }

std::string rule_list() {
  std::string text = "rules, and what each removes:";
  for (const RuleInfo& rule : all_rules()) {
    text += "\n  " + rule.name + std::string(22 - rule.name.size(), ' ') + rule.description;
  }
  return text;
}

AnyStage mask_stage_of(const RuleInfo& rule, const MaskCullerOptions& masks) {
  return rule.takes_masks ? any_stage(MaskCuller(masks)) : empty_stage();
}

const RuleInfo& with_motion(const RuleInfo& rule) {
  if (rule.name == "none") return rule_info("motion");
  if (rule.name == "mask") return rule_info("masks_motion");
  if (rule.name == "depth") return rule_info("depth_motion");
  if (rule.follows_motion) return rule;
  detail::throw_misuse("rule", "--motion with rule " + rule.name, "rule none, mask or depth");
}

AnyStage stage_of(const RuleInfo& rule, const MaskCullerOptions& masks, std::uint64_t seed,
                  const CameraParameters& camera) {
  if (rule.compares_frames) return frame_rule_stage(rule.name, masks, camera);
  AnyStage stage = entry_of(rule.name).make(masks, seed);
  if (!rule.follows_motion) return stage;
  return [stage = std::move(stage), motion = motion_stage(rule, camera)](
             const FilterInput& input, FeatureLabels& labels, Workspace& workspace) {
    stage(input, labels, workspace);
    motion(input, labels, workspace);
  };
}

}  // namespace dynfilter::tools
