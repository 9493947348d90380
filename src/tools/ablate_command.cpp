// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <future>
#include <memory>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "dynfilter/detail/errors.hpp"
#include "inputs.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "progress_bar.hpp"
#include "rule_run.hpp"
#include "rule_set.hpp"
#include "shared_options.hpp"
#include "source_checks.hpp"

namespace dynfilter::tools {
namespace {

/// Scenes under rules. The results of a scene under a rule go to <out>/<scene>/<rule>.
struct AblationPlan {
  std::vector<SceneSpec> scenes;
  std::vector<std::string> rules;  ///< rules that need true masks skip scenes without them
  RunSettings settings;
  std::filesystem::path out;
};

std::filesystem::path folder_of(const AblationPlan& plan, const SceneSpec& scene,
                                const std::string& rule) {
  return plan.out / scene.name().name / rule;
}

/// Returns the rules that run on a scene: without true masks none that need them. Throws
/// std::runtime_error if one cannot run, or none does.
std::vector<RuleInfo> rules_of(const AblationPlan& plan, const SceneSpec& scene,
                               const FrameSource& source) {
  std::vector<RuleInfo> rules;
  for (const std::string& name : plan.rules) {
    const RuleInfo& rule = rule_info(name);
    const bool is_left_out = !source.facts().has_true_masks && plan.rules.size() > 1 &&
                             needs_true_masks(rule, plan.settings.truth);
    if (!is_left_out) rules.push_back(checked_rule(rule, scene, source, plan.settings));
  }
  return rules;
}

/// Refuses what would fail in the midst of the work: scenes of one name, files that cannot be read,
/// and folders of results that would touch a scene's input. Prints notes about the scenes. Returns
/// the number of their frames.
std::size_t checked_frame_count(const AblationPlan& plan) {
  Inputs inputs;
  std::size_t frames = 0;
  std::set<std::string> names, notes;  // a sequence in several degradations has one note
  for (const SceneSpec& scene : plan.scenes) {
    const std::string name = scene.name().name;
    if (!names.insert(name).second) {
      detail::throw_misuse("ablate", "two scenes named " + name,
                           "different names: they identify the results");
    }
    if (!scene.level.empty()) {
      frames += static_cast<std::size_t>(scene.level_options().frames);
      continue;
    }
    const std::unique_ptr<FrameSource> source = scene.open(plan.settings.truth);
    rules_of(plan, scene, *source);
    source->read(0);
    source->add_inputs(inputs);
    frames += source->size();
    if (!source->facts().note.empty()) notes.insert(source->facts().note);
  }
  for (const SceneSpec& scene : plan.scenes) {
    for (const std::string& rule : plan.rules) {
      detail::require_own_place(detail::canonical_folder(plan.out),
                                std::filesystem::path(scene.name().name) / rule / "");
      inputs.require_harmless(folder_of(plan, scene, rule), run_writer, true);
    }
  }
  for (const std::string& note : notes) std::fprintf(stderr, "%s\n", note.c_str());
  return frames;
}

std::vector<RunRecord> run_scene(const AblationPlan& plan, const SceneSpec& scene,
                                 FrameSource& source, ProgressBar& progress) {
  RunSettings settings = plan.settings;
  settings.features = scene.features.value_or(settings.features);
  std::vector<std::unique_ptr<RuleRun>> runs;
  for (const RuleInfo& rule : rules_of(plan, scene, source)) {
    runs.push_back(std::make_unique<RuleRun>(rule, scene, source, settings,
                                             folder_of(plan, scene, rule.name)));
  }
  const odometry::OrbExtractor extractor(settings.features);
  SourceChecks checks(source.facts(), settings.mask_culler, settings.features);
  for (std::size_t i = 0; source.has(i); i += plan.settings.every) {
    const SourceFrame frame = source.read(i);
    const ExtractedFeatures features = extract_features(extractor, frame.frame.image);
    checks.add(frame, features.keypoints);
    checks.require_hope();
    std::vector<std::future<void>> works;
    works.reserve(runs.size());
    for (const std::unique_ptr<RuleRun>& run : runs) {
      works.push_back(std::async(std::launch::async,
                                 [&, rule = run.get()] { rule->process(frame, features); }));
    }
    for (std::future<void>& work : works) work.get();
    progress.advance(plan.settings.every);
  }
  std::vector<RunRecord> results;
  results.reserve(runs.size());
  for (const std::unique_ptr<RuleRun>& run : runs) {
    results.push_back(run->finish(source, checks.findings(source.mask_values())));
  }
  return results;
}

/// Runs every scene under every rule, and returns the results in this order. Reads each scene's
/// frames and extracts their features once for all rules, which run side by side.
std::vector<RunRecord> run_all(const AblationPlan& plan) {
  ProgressBar progress("filtering", checked_frame_count(plan));
  std::vector<RunRecord> results;
  for (const SceneSpec& scene : plan.scenes) {
    for (RunRecord& result : run_scene(plan, scene, *scene.open(plan.settings.truth), progress)) {
      results.push_back(std::move(result));
    }
  }
  return results;
}

struct AblateOptions {
  std::vector<std::filesystem::path> sequences;
  std::vector<std::string> degradations;  // of the sequences' masks; none: unchanged
  SceneSpec recording;                    // options that all sequences share
  std::vector<int> features = {1000};
  std::vector<std::string> levels;
  std::string seeds = "1-5";
  SceneSpec level_options;  // options that all levels share
  AblationPlan plan;
};

/// Parses numbers and ascending ranges, at most 10000 seeds.
std::vector<std::uint64_t> seeds_of(const std::string& text) {
  static const std::regex range("(\\d{1,9})(-(\\d{1,9}))?");
  std::vector<std::uint64_t> seeds;
  std::istringstream ranges(text);
  for (std::string one; std::getline(ranges, one, ',');) {
    std::smatch match;
    const bool is_range = std::regex_match(one, match, range);
    const std::uint64_t first = is_range ? std::stoull(match[1]) : 1;
    const std::uint64_t last = is_range && match[3].matched ? std::stoull(match[3]) : first;
    if (!is_range || last < first || last - first >= 10000 - seeds.size()) {
      detail::throw_misuse(
          "ablate", "--seeds " + text,
          "numbers and ascending ranges, at most 10000 seeds, such as 1-5 or 1,3,8-10");
    }
    for (std::uint64_t seed = first; seed <= last; ++seed) seeds.push_back(seed);
  }
  return seeds;
}

AblationPlan plan_of(const AblateOptions& options) {
  AblationPlan plan = options.plan;
  plan.settings.mask_culler.dynamic_classes = class_ids(plan.settings.classes, nullptr);
  if (!options.recording.masks.empty() && options.sequences.size() != 1) {
    throw CLI::ValidationError("--masks needs one SEQUENCE, whose masks it replaces");
  }
  plan.settings.features = options.features[0];
  const auto add = [&](SceneSpec scene) {
    for (const int features : options.features) {
      if (options.features.size() > 1) scene.features = features;
      plan.scenes.push_back(scene);
    }
  };
  for (const std::filesystem::path& sequence : options.sequences) {
    SceneSpec scene = options.recording;
    scene.sequence = sequence;
    if (options.degradations.empty()) add(scene);
    for (const std::string& how : options.degradations) {
      scene.degraded = how;
      add(scene);
    }
  }
  for (const std::string& level : options.levels) {
    for (const std::uint64_t seed : seeds_of(options.seeds)) {
      SceneSpec scene = options.level_options;
      scene.level = level;
      scene.level_seed = seed;
      add(scene);
    }
  }
  if (plan.scenes.empty()) throw CLI::RequiredError("SEQUENCE or --levels");
  if (plan.rules.empty()) plan.rules = usual_rule_names();
  return plan;
}

void ablate(const AblateOptions& options) {
  const AblationPlan plan = plan_of(options);
  const std::vector<RunRecord> results = run_all(plan);
  std::set<std::string> scenes, without_masks;
  for (const RunRecord& result : results) {  // what tables rest on stands before them
    const std::string& name = result.scene.source;
    if (result.rule.takes_masks() && result.masks.empty() && without_masks.insert(name).second) {
      std::printf(
          "\n%s has no masks/ folder, so no mask removes anything; dynfilter masks --model "
          "FILE.onnx makes them\n",
          name.c_str());
    }
    if (scenes.insert(name).second && !result.findings.empty()) {
      print_findings(result.findings, name);
    }
  }
  std::printf("\n%swritten to %s/<scene>/<rule>\n",
              ablation_tables(results, plan.settings.truth).c_str(), plan.out.c_str());
}

/// Accepts the names that a function accepts.
template <class Function>
CLI::Validator some_name(const char* what, const Function& accept) {
  const auto error_of = [accept](const std::string& name) {
    try {
      accept(name);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  return CLI::Validator(error_of, what);
}

constexpr char ablate_description[] =
    "Compare rules on sequences, or on levels and seeds: features left and removed, and\n"
    "the errors of the reference odometry. The results of a scene under a rule go to\n"
    "OUT/<scene>/<rule>.";

constexpr char ablate_notes[] =
    "\n\nexamples:\n"
    "  dynfilter ablate --levels medium,hard --seeds 1-5 --out sweep\n"
    "  dynfilter ablate rgbd_dataset_freiburg3_walking_xyz --camera tum3 --rules none,mask,paper";

}  // namespace

void add_ablate_command(CLI::App& program) {
  const auto options = std::make_shared<AblateOptions>();
  options->plan.out = "dynfilter_ablation";
  CLI::App* command = program.add_subcommand("ablate", ablate_description);
  CLI::Option* sequences =
      command->add_option("SEQUENCES", options->sequences, "folders of sequences");
  add_recording_options(*command, options->recording, sequences);
  command
      ->add_option("--degrade", options->degradations,
                   "make the sequences' masks worse, and use the original ones as the truth:\n"
                   "eroded_N (px), cut, disc, poor, boxes, late_N (frames), missing_N (every\n"
                   "N-th frame); the rim is then 15 px wide")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(some_name("DEGRADATION", Degradation::parse))
      ->needs(sequences);
  CLI::Option* levels =
      command
          ->add_option("--levels", options->levels,
                       "levels of dynfilter synth, such as medium,hard")
          ->delimiter(',')
          ->allow_extra_args(false)
          ->check(some_name("LEVEL", [](const std::string& name) { scene_level(name); }));
  command
      ->add_option("--seeds", options->seeds,
                   "seeds of the levels, such as 1-5 or 1,3,8-10; at most 10000")
      ->capture_default_str()
      ->needs(levels);
  add_level_size_options(*command, options->level_options, levels);
  command
      ->add_option(
          "--rules", options->plan.rules,
          "such as mask,paper; default: all rules but those about late masks, about motion,\n"
          "and those that compare frames, see below")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(all_rule_names()));
  command
      ->add_option("--features", options->features,
                   "ORB features a frame; several numbers give medians with a spread")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  add_setting_options(*command, options->plan.settings);
  command->add_option("--out", options->plan.out, "folder for the results")->capture_default_str();
  command->footer(rule_list() + ablate_notes);
  command->callback([options] { ablate(*options); });
}

}  // namespace dynfilter::tools
