// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "io/file_error.hpp"
#include "trajectory_note.hpp"

namespace dynfilter::tools {
namespace {

struct EvalOptions {
  std::filesystem::path estimate;
  std::filesystem::path truth;
  AbsoluteErrorOptions absolute;
  RelativeErrorOptions relative;
};

/// The figures of an estimate, and why some are missing.
struct Evaluation {
  std::vector<std::pair<std::string, double>> figures;       // in the order of printing
  std::vector<std::pair<std::string, std::string>> missing;  // name and reason

  void add(const std::string& name, const std::string& unit, const ErrorSummary& errors) {
    const std::pair<const char*, double> values[] = {
        {"rmse", errors.rmse},     {"mean", errors.mean},
        {"median", errors.median}, {"standard_deviation", errors.standard_deviation},
        {"min", errors.min_error}, {"max", errors.max_error}};
    for (const auto& [which, value] : values) {
      figures.emplace_back(detail::concatenate(name, '_', which, '_', unit), value);
    }
  }

  /// Runs work that adds figures. If it fails, notes the reason under this name.
  template <class Work>
  void attempt(const char* name, const Work& work) {
    try {
      work();
    } catch (const std::runtime_error& error) {
      missing.emplace_back(name, error.what());
    } catch (const std::invalid_argument& error) {  // an error that is no finite number
      missing.emplace_back(name, error.what());
    }
  }
};

/// Throws std::runtime_error if the errors have no mean square.
const ErrorSummary& finite(const ErrorSummary& errors) {
  if (std::isfinite(errors.rmse) && std::isfinite(errors.standard_deviation)) return errors;
  throw std::runtime_error(detail::concatenate("the largest error, ", errors.max_error,
                                               " m, is too large for a mean square"));
}

/// Reads a trajectory and reports flaws of its file on standard error.
TrajectoryFile read_and_note(const std::filesystem::path& path) {
  TrajectoryFile file = read_trajectory_file(path);
  const std::string note = trajectory_note(path, file.flaws);
  if (!note.empty()) std::fprintf(stderr, "%s\n", note.c_str());
  return file;
}

void add_relative_error(Evaluation& evaluation, const EvalOptions& options,
                        const Trajectory& estimate, const Trajectory& truth,
                        const std::optional<AbsoluteTrajectoryError>& ate) {
  if (options.absolute.with_scale && !ate) {
    throw std::runtime_error("--scale needs the scale of the absolute error, which is missing");
  }
  RelativeErrorOptions relative = options.relative;
  relative.max_time_difference_s = options.absolute.max_time_difference_s;
  if (ate) relative.scale = ate->alignment.scale;
  const auto rpe = relative_pose_error(estimate, truth, relative);
  finite(rpe.translation_m);
  evaluation.figures.emplace_back("rpe_intervals", static_cast<double>(rpe.translation_m.count));
  evaluation.add("rpe_translation", "m", rpe.translation_m);
  evaluation.add("rpe_rotation", "deg", rpe.rotation_deg);
}

/// Says on standard error what an estimate's poses hint at: a camera that was lost, or a mono one.
void note_estimate(const Trajectory& estimate, const Trajectory& truth, const EvalOptions& options,
                   const AbsoluteTrajectoryError& ate) {
  const auto repeated = std::count_if(estimate.begin() + 1, estimate.end(),
                                      [&, last = estimate.begin()](const TimedPose& pose) mutable {
                                        const TimedPose& before = *last++;
                                        return pose.translation == before.translation &&
                                               pose.rotation == before.rotation;
                                      });
  if (static_cast<std::size_t>(20 * repeated) > estimate.size()) {
    std::fprintf(stderr,
                 "%zu of %zu estimated poses repeat the one before: was the camera lost there? If "
                 "so, leave them out, because they count as tracked\n",
                 static_cast<std::size_t>(repeated), estimate.size());
  }
  AbsoluteErrorOptions with_scale = options.absolute;
  with_scale.with_scale = true;
  try {
    const auto scaled = absolute_trajectory_error(estimate, truth, with_scale);
    const double scale = scaled.alignment.scale, rmse = scaled.translation_m.rmse;
    if (!(std::abs(std::log(scale)) > 0.1 && 2 * rmse < ate.translation_m.rmse)) return;
    std::fprintf(stderr,
                 "the truth is %.3g times as large as the estimate: a mono camera's? --scale would "
                 "give an ate_rmse_m of %.6f\n",
                 scale, rmse);
  } catch (const std::runtime_error&) {
    // A camera that stands has no scale.
  }
}

Evaluation evaluate(const EvalOptions& options) {
  const TrajectoryFile estimate_file = read_and_note(options.estimate);
  const TrajectoryFile truth_file = read_and_note(options.truth);
  if (estimate_file.has_times != truth_file.has_times) {
    detail::throw_file_error(estimate_file.has_times ? options.truth : options.estimate,
                             "has KITTI's 12 columns, without times, and the other file has "
                             "times; want both alike");
  }
  const Trajectory& estimate = estimate_file.trajectory;
  const Trajectory& truth = truth_file.trajectory;
  Evaluation evaluation;
  std::optional<AbsoluteTrajectoryError> ate;
  evaluation.attempt("ate", [&] {
    auto found = absolute_trajectory_error(estimate, truth, options.absolute);
    finite(found.translation_m);
    ate = std::move(found);
    evaluation.figures.emplace_back("pairs", static_cast<double>(ate->translation_m.count));
    evaluation.figures.emplace_back("scale", ate->alignment.scale);
    evaluation.add("ate", "m", ate->translation_m);
  });
  if (ate && ate->translation_m.count > 10) {
    note_estimate(estimate, truth, options, *ate);
  }
  evaluation.attempt("rpe", [&] { add_relative_error(evaluation, options, estimate, truth, ate); });
  return evaluation;
}

void report(const EvalOptions& options) {
  const Evaluation evaluation = evaluate(options);
  for (const auto& [name, value] : evaluation.figures) {
    const bool is_count = name == "pairs" || name == "rpe_intervals";
    std::printf(is_count ? "%-36s %.0f\n" : "%-36s %.6f\n", name.c_str(), value);
  }
  for (const auto& [name, reason] : evaluation.missing) {
    std::fprintf(stderr, "no %s: %s\n", name.c_str(), reason.c_str());
  }
  if (evaluation.figures.empty()) throw std::runtime_error("eval: there is no figure to print");
}

}  // namespace

void add_eval_command(CLI::App& program) {
  const auto options = std::make_shared<EvalOptions>();
  CLI::App* command = program.add_subcommand(
      "eval",
      "Compare an estimated trajectory with the true one, as the TUM RGB-D benchmark does: the\n"
      "absolute error after a rigid alignment, and the relative error over 1 s. The files are\n"
      "TUM's (timestamp tx ty tz qx qy qz qw), EuRoC's csv or, both of them, KITTI's 12 columns,\n"
      "0.1 s a row; seconds or nanoseconds. As in TUM's benchmark, rows with NaN\n"
      "or a zero quaternion are skipped, and the last row with a repeated time counts. Prints one\n"
      "figure a line, name and value. Standard error says which rows were skipped, and which\n"
      "figures are missing and why. Both files may be pipes, such as <(...) of a shell.");
  command->add_option("ESTIMATE", options->estimate, "the estimated trajectory")->required();
  command->add_option("TRUTH", options->truth, "the true trajectory")->required();
  command
      ->add_option("--max-difference", options->absolute.max_time_difference_s,
                   "largest difference in time of an estimated and a true pose, seconds")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command->add_flag("--scale", options->absolute.with_scale, "align the scale too (mono)");
  command
      ->add_option("--frames", options->relative.interval_frames,
                   "interval of the relative error in poses, instead of 1 s; 1 = frame to frame")
      ->check(CLI::Range(1, 1000000));
  command->footer("example: dynfilter eval CameraTrajectory.txt groundtruth.txt");
  command->callback([options] { report(*options); });
}

}  // namespace dynfilter::tools
