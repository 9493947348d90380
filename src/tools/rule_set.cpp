// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "rule_set.hpp"

#include <memory>
#include <utility>

#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/edge_compensator.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "dynfilter/stage.hpp"
#include "lab/rules/epipolar_check.hpp"

namespace dynfilter::tools {
namespace {

/// What the stage of a rule is made of.
struct Parts {
  MaskCullerOptions masks;
  Camera camera;
};

template <class Stage>
AnyStage any_stage(Stage stage) {
  return [stage = std::move(stage)](const FilterInput& input, FeatureLabels& labels,
                                    Workspace& workspace) {
    run_stage(stage, input, labels, workspace);
  };
}

AnyStage nothing(const Parts&) {
  return [](const FilterInput&, FeatureLabels&, Workspace&) {};
}

AnyStage paper(const Parts&) { return EdgeCompensator(EdgeCompensatorOptions::paper()); }

AnyStage paper_depth(const Parts&) {
  EdgeCompensatorOptions options = EdgeCompensatorOptions::paper();
  options.uses_codes = false;
  return EdgeCompensator(options);
}

AnyStage depth(const Parts&) { return DepthCompensator(); }

/// Makes another system's rule that judges single frames.
template <class Rule>
AnyStage on_frame(const Parts& parts) {
  return any_stage(Rule(parts.masks.dynamic_classes));
}

AnyStage epipolar(const Parts& parts) {
  return
      [check = std::make_shared<peers::EpipolarCheck>(parts.masks.dynamic_classes)](
          const FilterInput& input, FeatureLabels& labels, Workspace&) { (*check)(input, labels); };
}

/// Makes a stage and, after it, a motion judge, which copies share.
template <AnyStage (*make_first)(const Parts&)>
AnyStage then_motion(const Parts& parts) {
  return [first = make_first(parts), judge = std::make_shared<MotionJudge>(parts.camera)](
             const FilterInput& input, FeatureLabels& labels, Workspace& workspace) {
    first(input, labels, workspace);
    (*judge)(input, labels, workspace);
  };
}

struct Entry {
  RuleInfo info;
  AnyStage (*make)(const Parts&);
};

const std::vector<Entry>& entries() {
  using M = RuleMasks;
  using S = RuleStage;
  static const std::vector<Entry> all = {
      {{"none", "nothing", M::absent, S::none}, nothing},
      {{"mask", "features on the masks", M::culled, S::none}, nothing},
      {{"dynaslam", "features on masks dilated by a 31x31 ellipse (DynaSLAM)", M::left, S::frame},
       on_frame<peers::DilatedMask>},
      {{"crowd_slam", "features in the box, grown by 5 px (Crowd-SLAM)", M::left, S::frame},
       on_frame<peers::WholeBox>},
      {{"ngd_slam", "features on a mask made from the box's depth (NGD-SLAM)", M::left, S::frame},
       on_frame<peers::BoxDepthMask>},
      {{"lk_epipolar", "dynaslam's, then features off their epipolar lines (DS-SLAM's check)",
        M::left, S::flow},
       epipolar},
      {{"mask_robust", "rule mask, and poses by the kernel of Geman and McClure", M::culled,
        S::none, odometry::Kernel::geman_mcclure},
       nothing},
      {{"paper_depth", "the same as paper without D-LBP", M::culled, S::frame}, paper_depth},
      {{"paper", "features on the masks, and in the box by depth and D-LBP (the paper)", M::culled,
        S::frame},
       paper},
      {{"depth", "features on the masks, and in the box at the object's depth", M::culled,
        S::frame},
       depth},
      {{"mask_moved", "rule mask on masks moved with the image", M::moved, S::none}, nothing},
      {{"depth_moved", "rule depth on masks moved with the image", M::moved, S::frame}, depth},
      {{"motion", "features that move, without masks", M::absent, S::motion}, then_motion<nothing>},
      {{"masks_motion", "rule mask, then what moves; features of still objects are kept", M::culled,
        S::motion},
       then_motion<nothing>},
      {{"depth_motion", "rule depth, then motion likewise (the default with depth)", M::culled,
        S::motion},
       then_motion<depth>},
      {{"perfect", "features on the true masks; with --truth motion, on what moves", M::exact,
        S::none},
       nothing},
  };
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

std::vector<std::string> all_rule_names() {
  std::vector<std::string> names;
  for (const Entry& entry : entries()) names.push_back(entry.info.name);
  return names;
}

std::vector<std::string> usual_rule_names() {
  std::vector<std::string> names;
  for (const Entry& entry : entries()) {
    if (!entry.info.needs_every_frame()) names.push_back(entry.info.name);
  }
  return names;
}

const RuleInfo& rule_info(const std::string& name) { return entry_of(name).info; }

std::string rule_list() {
  std::string text = "rules, and what each removes:";
  for (const Entry& entry : entries()) {
    const std::string& name = entry.info.name;
    text += "\n  " + name + std::string(22 - name.size(), ' ') + entry.info.description;
  }
  return text;
}

AnyStage mask_stage_of(const RuleInfo& rule, const MaskCullerOptions& masks) {
  return rule.takes_masks() ? any_stage(MaskCuller(masks)) : nothing({});
}

AnyStage stage_of(const RuleInfo& rule, const MaskCullerOptions& masks, const Camera& camera) {
  return entry_of(rule.name).make({masks, camera});
}

}  // namespace dynfilter::tools
