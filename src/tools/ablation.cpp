// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "ablation.hpp"

#include <cstddef>
#include <cstdio>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"
#include "inputs.hpp"
#include "progress_bar.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {
namespace {

std::filesystem::path folder_of(const AblationPlan& plan, const SceneSpec& scene,
                                const std::string& rule) {
  return plan.out / scene.name().name / rule;
}

/// Facts about a scene that are needed before its turn.
struct Outline {
  std::size_t frames = 0;
  bool has_true_masks = false;
  std::string note;
};

/// Outlines every scene, in order, and notes what all of them read. Opens one scene of each group,
/// because scenes of a level differ only in their seed. So an error in the last scene shows before
/// the first one starts.
std::vector<Outline> outlines_of(const AblationPlan& plan, Inputs& inputs) {
  std::map<std::string, Outline> outline_by_group;
  std::vector<Outline> outlines;
  for (const SceneSpec& scene : plan.scenes) {
    const auto [outline, is_new] = outline_by_group.emplace(scene.name().group, Outline());
    if (is_new) {
      const std::unique_ptr<FrameSource> source = scene.open(plan.settings.truth);
      require_masks(*source, plan.settings.every);
      source->read(0);
      outline->second = {source->size(), source->has_true_masks(), source->note()};
      source->add_inputs(inputs);
    }
    outlines.push_back(outline->second);
  }
  return outlines;
}

std::vector<std::string> rules_for(const AblationPlan& plan, bool has_true_masks) {
  std::vector<std::string> rules;
  for (const std::string& rule : plan.rules) {
    const bool needs_them = needs_true_masks(rule_info(rule), plan.settings.truth);
    if (!needs_them || has_true_masks) rules.push_back(rule);
  }
  return rules;
}

/// Refuses folders of results in which a job would touch what it reads.
void require_harmless_jobs(const AblationPlan& plan, const std::vector<Outline>& outlines,
                           const Inputs& inputs) {
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    for (const std::string& rule : rules_for(plan, outlines[i].has_true_masks)) {
      inputs.require_harmless(folder_of(plan, plan.scenes[i], rule), run_writer, true);
    }
  }
}

std::vector<RunResult> run_scene(const AblationPlan& plan, const SceneSpec& scene,
                                 FrameSource& source, ProgressBar& progress) {
  std::vector<std::unique_ptr<RuleRun>> runs;
  for (const std::string& rule : rules_for(plan, source.has_true_masks())) {
    runs.push_back(std::make_unique<RuleRun>(rule_info(rule), scene, source, plan.settings,
                                             folder_of(plan, scene, rule)));
  }
  const odometry::OrbExtractor extractor(plan.settings.features);
  std::optional<DepthOffsetEstimator> offset;  // it compares successive frames
  if (source.has_depth() && plan.settings.every == 1) offset.emplace();
  for (std::size_t i = 0; i < source.size(); i += plan.settings.every) {
    const SourceFrame frame = source.read(i);
    if (offset) offset->add(frame.frame, frame.depth_timestamp_s);
    const ExtractedFeatures features = extract_features(extractor, frame.frame.image);
    std::vector<std::future<void>> works;
    for (const std::unique_ptr<RuleRun>& run : runs) {
      works.push_back(std::async(std::launch::async,
                                 [&, rule = run.get()] { rule->process(frame, features); }));
    }
    for (std::future<void>& work : works) work.get();
    progress.advance(plan.settings.every);
  }
  std::vector<RunResult> results;
  for (const std::unique_ptr<RuleRun>& run : runs) {
    if (offset) run->note_depth_offset(offset->estimate());
    results.push_back(result_of(run->finish(source)));
  }
  return results;
}

void require_different_names(const AblationPlan& plan) {
  std::set<std::string> names;
  for (const SceneSpec& scene : plan.scenes) {
    const std::string name = scene.name().name;
    if (names.insert(name).second) continue;
    detail::throw_misuse("ablate", "two scenes named " + name,
                         "different names: they identify the results");
  }
}

}  // namespace

std::vector<RunResult> run_all(const AblationPlan& plan) {
  require_different_names(plan);
  Inputs inputs;
  const std::vector<Outline> outlines = outlines_of(plan, inputs);
  require_harmless_jobs(plan, outlines, inputs);
  std::size_t frames = 0;
  std::set<std::string> notes;  // a sequence in several degradations has one note
  for (const Outline& outline : outlines) {
    frames += outline.frames;
    if (!outline.note.empty()) notes.insert(outline.note);
  }
  for (const std::string& note : notes) std::fprintf(stderr, "%s\n", note.c_str());
  ProgressBar progress("filtering", frames);
  std::vector<RunResult> results;
  for (const SceneSpec& scene : plan.scenes) {
    for (RunResult& result : run_scene(plan, scene, *scene.open(plan.settings.truth), progress)) {
      results.push_back(std::move(result));
    }
  }
  return results;
}

}  // namespace dynfilter::tools
