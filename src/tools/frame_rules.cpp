// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "frame_rules.hpp"

#include <functional>
#include <memory>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "lab/rules/cluster_votes.hpp"
#include "lab/rules/depth_consistency.hpp"
#include "lab/rules/epipolar_vote.hpp"
#include "lab/rules/flow_chi_square.hpp"
#include "lab/rules/flow_refined_mask.hpp"
#include "lab/rules/frame_memory.hpp"
#include "lab/rules/point_correlations.hpp"
#include "lab/rules/region_bayes.hpp"
#include "lab/rules/template_stillness.hpp"

namespace dynfilter::tools {
namespace {

using Classes = std::vector<int>;

/// Memory of a rule that has none besides the frames.
struct Nothing {};

struct Entry {
  RuleInfo info;
  std::function<AnyStage(const Classes&, const PinholeCamera&)> make;
};

/// Makes the entry of a rule. `make_rule(classes, extra)` makes the rule, with its own memory.
template <class Extra, class MakeRule>
Entry entry(const char* name, const char* description, MakeRule make_rule) {
  RuleInfo info;
  info.name = name;
  info.description = description;
  info.takes_masks = false;
  info.compares_frames = true;
  return {info, [make_rule](const Classes& classes, const PinholeCamera& camera) -> AnyStage {
            const auto extra = std::make_shared<Extra>();
            const auto rule = make_rule(classes, *extra);
            peers::FrameMemoryOptions options;
            options.dynamic_classes = classes;
            const auto frames =
                std::make_shared<peers::FrameMemory>(camera, rule.baseline_frames(), options);
            return [extra, frames, stage = peers::OnFrames(rule, *frames)](
                       const FilterInput& input, FeatureLabels& labels, Workspace& workspace) {
              stage(input, labels, workspace);
            };
          }};
}

/// Makes the entry of a rule that knows no classes.
template <class Rule>
Entry plain_entry(const char* name, const char* description) {
  return entry<Nothing>(name, description, [](const Classes&, Nothing&) { return Rule(); });
}

/// Makes the entry of a rule whose options name the dynamic classes.
template <class Rule, class Options>
Entry class_entry(const char* name, const char* description) {
  return entry<Nothing>(name, description, [](const Classes& classes, Nothing&) {
    Options options;
    options.dynamic_classes = classes;
    return Rule(options);
  });
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = {
      class_entry<peers::EpipolarVote, peers::EpipolarVoteOptions>(
          "ds_slam", "features on persons if one leaves its epipolar line (DS-SLAM)"),
      entry<peers::DepthKeyframes>("dynaslam_geometry",
                                   "features on regions nearer than in earlier frames (DynaSLAM)",
                                   [](const Classes&, peers::DepthKeyframes& memory) {
                                     return peers::DepthConsistency(memory);
                                   }),
      plain_entry<peers::FlowChiSquare>(
          "derome", "features whose flow depth and camera do not explain (Derome)"),
      plain_entry<peers::ClusterVotes>("eppenberger",
                                       "features on clusters faster than 0.45 m/s (Eppenberger)"),
      plain_entry<peers::PointCorrelations>(
          "dai", "features whose distances to the largest rigid part change (Dai)"),
      entry<peers::RegionBeliefs>(
          "smr", "features in regions that probably changed (SMR)",
          [](const Classes&, peers::RegionBeliefs& memory) { return peers::RegionBayes(memory); }),
      entry<peers::StillObjects>("dyna_tm",
                                 "features in boxes that look different than before (DynaTM-SLAM)",
                                 [](const Classes& classes, peers::StillObjects& memory) {
                                   peers::TemplateStillnessOptions options;
                                   options.dynamic_classes = classes;
                                   return peers::TemplateStillness(memory, options);
                                 }),
      class_entry<peers::FlowRefinedMask, peers::FlowRefinedMaskOptions>(
          "dn_slam", "features on masks that move, and what moves around them (DN-SLAM)"),
  };
  return all;
}

}  // namespace

const std::vector<RuleInfo>& frame_rules() {
  static const std::vector<RuleInfo> rules = [] {
    std::vector<RuleInfo> infos;
    for (const Entry& entry : entries()) infos.push_back(entry.info);
    return infos;
  }();
  return rules;
}

AnyStage frame_rule_stage(const std::string& name, const MaskCullerOptions& masks,
                          const CameraParameters& c) {
  for (const Entry& entry : entries()) {
    if (entry.info.name != name) continue;
    return entry.make(masks.dynamic_classes,
                      {c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3});
  }
  detail::throw_misuse("frame_rule_stage", "'" + name + "'", "a rule of frame_rules()");
}

}  // namespace dynfilter::tools
