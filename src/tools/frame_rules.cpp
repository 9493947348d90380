// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "frame_rules.hpp"

#include <type_traits>

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

struct Entry {
  RuleInfo info;
  AnyStage (*make)(const peers::Classes&, const PinholeCamera&);
};

/// Makes the stage of a rule; some rules know classes.
template <class Rule>
AnyStage make_stage(const peers::Classes& classes, const PinholeCamera& camera) {
  if constexpr (std::is_constructible_v<Rule, peers::Classes>) {
    return peers::OnFrames(Rule(classes), camera, classes);
  } else {
    return peers::OnFrames(Rule(), camera, classes);
  }
}

template <class Rule>
Entry entry(const char* name, const char* description) {
  RuleInfo info;
  info.name = name;
  info.description = description;
  info.takes_masks = false;
  info.compares_frames = true;
  return {info, make_stage<Rule>};
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = {
      entry<peers::EpipolarVote>("ds_slam",
                                 "features on persons if one leaves its epipolar line (DS-SLAM)"),
      entry<peers::DepthConsistency>(
          "dynaslam_geometry", "features on regions nearer than in earlier frames (DynaSLAM)"),
      entry<peers::FlowChiSquare>("derome",
                                  "features whose flow depth and camera do not explain (Derome)"),
      entry<peers::ClusterVotes>("eppenberger",
                                 "features on clusters faster than 0.45 m/s (Eppenberger)"),
      entry<peers::PointCorrelations>(
          "dai", "features whose distances to the largest rigid part change (Dai)"),
      entry<peers::RegionBayes>("smr", "features in regions that probably changed (SMR)"),
      entry<peers::TemplateStillness>(
          "dyna_tm", "features in boxes that look different than before (DynaTM-SLAM)"),
      entry<peers::FlowRefinedMask>(
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
