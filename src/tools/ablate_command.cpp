// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "ablation.hpp"
#include "ablation_tables.hpp"
#include "commands.hpp"
#include "degraded_masks.hpp"
#include "dynfilter/detail/errors.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "number_options.hpp"
#include "shared_options.hpp"

namespace dynfilter::tools {
namespace {

struct AblateOptions {
  std::vector<std::filesystem::path> sequences;
  std::vector<std::string> degradations;  // of the sequences' masks; none: unchanged
  std::filesystem::path masks, camera;    // of the only sequence; empty: its own
  std::optional<double> depth_offset_s;
  std::vector<std::string> levels;
  std::string seeds = "1-5";
  SceneSpec level_options;  // options that all levels share
  AblationPlan plan;
};

constexpr std::size_t max_seeds = 10000;

std::vector<std::uint64_t> seeds_of(const std::string& text) {
  const auto seeds = parse_number_list(text, max_seeds);
  if (seeds) return *seeds;
  detail::throw_misuse("ablate", "--seeds " + text,
                       detail::concatenate("numbers and ascending ranges, at most ", max_seeds,
                                           " seeds, such as 1-5 or 1,3,8-10"));
}

AblationPlan plan_of(const AblateOptions& options) {
  AblationPlan plan = options.plan;
  const bool has_files = !options.masks.empty() || !options.camera.empty();
  if (has_files && options.sequences.size() != 1) {
    throw CLI::ValidationError("--masks and --camera need one SEQUENCE, whose files they replace");
  }
  for (const std::filesystem::path& sequence : options.sequences) {
    SceneSpec scene;
    scene.sequence = sequence;
    scene.masks = options.masks;
    scene.camera = options.camera;
    scene.depth_offset_s = options.depth_offset_s;
    if (options.degradations.empty()) plan.scenes.push_back(scene);
    for (const std::string& how : options.degradations) {
      scene.degraded = how;
      plan.scenes.push_back(scene);
    }
  }
  for (const std::string& level : options.levels) {
    for (const std::uint64_t seed : seeds_of(options.seeds)) {
      SceneSpec scene = options.level_options;
      scene.level = level;
      scene.level_seed = seed;
      plan.scenes.push_back(scene);
    }
  }
  if (plan.scenes.empty()) throw CLI::RequiredError("SEQUENCE or --levels");
  if (plan.rules.empty()) plan.rules = usual_rule_names();
  return plan;
}

void ablate(const AblateOptions& options) {
  const AblationPlan plan = plan_of(options);
  const std::vector<RunResult> results = run_all(plan);
  for (const Table& table : ablation_tables(results, plan.settings.truth)) {
    std::printf("%s\n", text_of(table).c_str());
  }
}

/// Accepts the names that scene_level accepts.
CLI::Validator some_level() {
  const auto error_of = [](const std::string& name) {
    try {
      scene_level(name);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  return CLI::Validator(error_of, "LEVEL");
}

}  // namespace

void add_ablate_command(CLI::App& program) {
  const auto options = std::make_shared<AblateOptions>();
  options->plan.out = "dynfilter_ablation";
  CLI::App* command = program.add_subcommand(
      "ablate",
      "Compare rules on sequences, or on levels and seeds: features left and removed, and\n"
      "the errors of the reference odometry. The results of a scene under a rule go to\n"
      "OUT/<scene>/<rule>.");
  CLI::Option* sequences =
      command->add_option("SEQUENCES", options->sequences, "folders of sequences");
  command->add_option("--masks", options->masks,
                      "folder of the masks of one SEQUENCE [SEQUENCE/masks]; dynfilter masks makes "
                      "them\nwith --model or --remote");
  command->add_option("--camera", options->camera,
                      "camera file of one SEQUENCE [SEQUENCE/camera.yaml]");
  command
      ->add_option("--degrade", options->degradations,
                   "make the sequences' masks worse, and use the original ones as the truth: for\n"
                   "example eroded,cut,disc,poor,late; the rim is then 15 px wide")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(degradation_names()))
      ->needs(sequences);
  add_depth_offset_option(*command, options->depth_offset_s)->needs(sequences);
  CLI::Option* levels = command
                            ->add_option("--levels", options->levels,
                                         "levels of dynfilter synth, such as medium,hard")
                            ->delimiter(',')
                            ->allow_extra_args(false)
                            ->check(some_level());
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
  add_setting_options(*command, options->plan.settings);
  command->add_option("--out", options->plan.out, "folder for the results")->capture_default_str();
  command->footer(rule_list() +
                  "\n\nexamples:\n"
                  "  dynfilter ablate --levels medium,hard --seeds 1-5 --out sweep\n"
                  "  dynfilter ablate rgbd_dataset_freiburg3_walking_xyz --rules none,mask,paper");
  command->callback([options] { ablate(*options); });
}

}  // namespace dynfilter::tools
