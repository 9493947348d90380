// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "ablation.hpp"

#include <cstddef>
#include <memory>
#include <set>

#include "dynfilter/detail/errors.hpp"
#include "parallel_for_each.hpp"
#include "progress_bar.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {
namespace {

std::filesystem::path folder_of(const AblationPlan& plan, const SceneSpec& scene,
                                const std::string& rule) {
  return plan.out / scene.name().name / rule;
}

std::vector<std::string> rules_for(const AblationPlan& plan, const FrameSource& source) {
  std::vector<std::string> rules;
  for (const std::string& rule : plan.rules) {
    if (!rule_info(rule).takes_true_masks || source.has_true_masks()) rules.push_back(rule);
  }
  return rules;
}

void run_scene(const AblationPlan& plan, const SceneSpec& scene, FrameSource& source,
               ProgressBar& progress) {
  std::vector<std::unique_ptr<RuleRun>> runs;
  for (const std::string& rule : rules_for(plan, source)) {
    runs.push_back(std::make_unique<RuleRun>(rule_info(rule), scene, source, plan.settings,
                                             folder_of(plan, scene, rule)));
  }
  const odometry::OrbExtractor extractor(plan.settings.features);
  for (std::size_t i = 0; i < source.size(); ++i) {
    const SourceFrame frame = source.read(i);
    const ExtractedFeatures features = extract_features(extractor, frame.frame.image);
    parallel_for_each(runs.size(), [&](std::size_t k) { runs[k]->process(frame, features); });
    progress.advance();
  }
  for (const std::unique_ptr<RuleRun>& run : runs) run->finish(source);
}

}  // namespace

void validate(const AblationPlan& plan) {
  std::set<std::string> names;
  for (const SceneSpec& scene : plan.scenes) {
    const std::string name = scene.name().name;
    if (names.insert(name).second) continue;
    detail::throw_misuse("ablate", "two scenes named " + name,
                         "one of each: results are told apart by that name");
  }
}

void run_all(const AblationPlan& plan) {
  validate(plan);
  // All at the beginning: an error in the last of them should not wait for the others' results.
  std::size_t frames = 0;
  for (const SceneSpec& scene : plan.scenes) frames += scene.open()->size();
  ProgressBar progress("filtering", frames);
  for (const SceneSpec& scene : plan.scenes) run_scene(plan, scene, *scene.open(), progress);
}

std::vector<std::string> job_lines(const AblationPlan& plan, const std::string& program) {
  validate(plan);
  const RunSettings& settings = plan.settings;
  std::string classes;
  for (const int id : settings.mask_culler.dynamic_classes) {
    classes += (classes.empty() ? "" : ",") + std::to_string(id);
  }
  std::vector<std::string> lines;
  for (const SceneSpec& scene : plan.scenes) {
    const std::unique_ptr<FrameSource> source = scene.open();
    for (const std::string& rule : rules_for(plan, *source)) {
      const auto out = std::filesystem::absolute(folder_of(plan, scene, rule)).lexically_normal();
      lines.push_back(shell_quoted(program) + " run " + scene.arguments() + " --rule " + rule +
                      " --features " + std::to_string(settings.features) + " --classes " + classes +
                      " --margin " + detail::concatenate(settings.mask_culler.margin_px) +
                      " --seed " + std::to_string(settings.seed) + " --overlays 0 --out " +
                      shell_quoted(out.string()));
    }
  }
  return lines;
}

}  // namespace dynfilter::tools
