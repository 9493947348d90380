// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "number_options.hpp"
#include "output_file.hpp"

namespace dynfilter::tools {
namespace {

struct EvalOptions {
  std::filesystem::path estimate;
  std::filesystem::path truth;
  std::filesystem::path baseline;  // empty: none
  std::filesystem::path json;      // empty: none
  AbsoluteErrorOptions absolute;
  RelativeErrorOptions relative;
};

/// Name and value, in the order in which they are printed.
using Figures = std::vector<std::pair<std::string, double>>;

void add(Figures& figures, const std::string& name, const std::string& unit,
         const ErrorSummary& errors) {
  const std::pair<const char*, double> values[] = {
      {"rmse", errors.rmse},     {"mean", errors.mean},
      {"median", errors.median}, {"standard_deviation", errors.standard_deviation},
      {"least", errors.least},   {"greatest", errors.greatest}};
  for (const auto& [which, value] : values) {
    figures.emplace_back(name + "_" + which + "_" + unit, value);
  }
}

Figures evaluate(const EvalOptions& options) {
  const Trajectory estimate = read_trajectory(options.estimate);
  const Trajectory truth = read_trajectory(options.truth);
  const auto ate = absolute_trajectory_error(estimate, truth, options.absolute);
  RelativeErrorOptions relative = options.relative;
  relative.max_time_difference_s = options.absolute.max_time_difference_s;
  relative.scale = ate.alignment.scale;
  const auto rpe = relative_pose_error(estimate, truth, relative);

  Figures figures;
  figures.emplace_back("pairs", static_cast<double>(ate.translation_m.count));
  figures.emplace_back("scale", ate.alignment.scale);
  add(figures, "ate", "m", ate.translation_m);
  figures.emplace_back("rpe_intervals", static_cast<double>(rpe.translation_m.count));
  add(figures, "rpe_translation", "m", rpe.translation_m);
  add(figures, "rpe_rotation", "deg", rpe.rotation_deg);
  if (!options.baseline.empty()) {
    const auto baseline =
        absolute_trajectory_error(read_trajectory(options.baseline), truth, options.absolute);
    figures.emplace_back("ate_baseline_rmse_m", baseline.translation_m.rmse);
    figures.emplace_back("ate_improvement_percent",
                         improvement_percent(baseline.translation_m.rmse, ate.translation_m.rmse));
  }
  return figures;
}

void report(const EvalOptions& options) {
  const Figures figures = evaluate(options);
  nlohmann::ordered_json json;
  for (const auto& [name, value] : figures) {
    const bool is_count = name == "pairs" || name == "rpe_intervals";
    std::printf(is_count ? "%-36s %.0f\n" : "%-36s %.6f\n", name.c_str(), value);
    if (is_count) {
      json[name] = static_cast<std::size_t>(value);
    } else {
      json[name] = value;
    }
  }
  if (options.json.empty()) return;
  OutputFile file(options.json);
  file << json.dump(2) << '\n';
  file.close();
}

}  // namespace

void add_eval_command(CLI::App& program) {
  const auto options = std::make_shared<EvalOptions>();
  CLI::App* command = program.add_subcommand(
      "eval",
      "Compare an estimated trajectory with the true one, as the TUM RGB-D benchmark does: the\n"
      "absolute error after a rigid alignment, the relative error over an interval. Both files "
      "are\n"
      "in TUM's format (timestamp tx ty tz qx qy qz qw). Prints a line a figure: name, value.");
  command->add_option("ESTIMATE", options->estimate, "the estimated trajectory")->required();
  command->add_option("TRUTH", options->truth, "the true trajectory")->required();
  command
      ->add_option("--max-difference", options->absolute.max_time_difference_s,
                   "between the times of an estimated pose and its true one, seconds")
      ->check(real_number(0, 1e9))
      ->capture_default_str();
  command->add_flag("--scale", options->absolute.with_scale, "align the scale too (mono)");
  command->add_option("--interval", options->relative.interval_s, "of the relative error, seconds")
      ->check(real_number(1e-6, 1e9))
      ->capture_default_str();
  command
      ->add_option("--frames", options->relative.interval_frames,
                   "of the relative error, in poses instead of seconds; 1 = frame to frame")
      ->transform(whole_number(1, 1000000));
  command->add_option("--baseline", options->baseline,
                      "another estimate, to print by how much the error is smaller");
  command->add_option("--json", options->json, "write the figures to this file, too");
  command->footer(
      "examples:\n"
      "  dynfilter eval CameraTrajectory.txt groundtruth.txt\n"
      "  dynfilter eval with.txt groundtruth.txt --baseline without.txt --json errors.json");
  command->callback([options] { report(*options); });
}

}  // namespace dynfilter::tools
