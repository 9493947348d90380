// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "run_record.hpp"

#include <sys/resource.h>

#include <cstdio>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/version.hpp"
#include "io/file_writing.hpp"
#include "io/frame_table.hpp"

namespace dynfilter::tools {
namespace {

constexpr std::pair<const char*, double FrameRecord::*> times_of_frames[] = {
    {"waiting for masks", &FrameRecord::masks_ms},
    {"filter", &FrameRecord::filter_ms},
    {"pose, by the reference odometry", &FrameRecord::pose_ms}};

/// Returns the most memory that the program had so far, in megabytes.
double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// Formats two cells of a pair of scores; they are empty if the truth is unknown.
std::string cells_of(const FrameRecord& frame, std::size_t FeatureScores::*score) {
  if (!frame.scores || !frame.mask_only_scores) return ",";
  return std::to_string((*frame.mask_only_scores).*score) + "," +
         std::to_string((*frame.scores).*score);
}

void print_count(const char* name, std::size_t count, std::size_t frames) {
  std::printf("  %-38s %9zu %11.1f\n", name, count,
              static_cast<double>(count) / static_cast<double>(frames));
}

/// Prints a row for the masks alone and one for the whole rule, or only one of them.
void print_score(const RunRecord& run, const std::string& name, std::size_t FeatureScores::*score) {
  const auto total = [&](auto which) { return run.total_scores(which).*score; };
  if (run.rule.takes_masks()) {
    print_count((name + ", masks only").c_str(), total(&FrameRecord::mask_only_scores),
                run.frames.size());
  }
  if (run.rule.takes_masks() && !run.rule.compensates()) return;
  const char* how = run.rule.takes_masks() ? ", with compensation" : "";
  print_count((name + how).c_str(), total(&FrameRecord::scores), run.frames.size());
}

void print_scores(const RunRecord& run) {
  const FeatureScores all = run.total_scores(&FrameRecord::scores);
  const char* against =
      run.settings.truth == Truth::by_motion ? "against what moves" : "against the true masks";
  std::printf("%-38s        total   per frame\n", against);
  print_count("dynamic, nothing removed", all.dynamic_left + all.dynamic_removed,
              run.frames.size());
  print_score(run, "dynamic left", &FeatureScores::dynamic_left);
  print_score(run, "static removed", &FeatureScores::static_removed);
}

void print_trajectory(const RunRecord& run) {
  std::printf("the reference odometry\n");
  print_count("frames lost", run.lost_frames(), run.frames.size());
  const auto print = [](const char* name, const std::optional<ErrorSummary>& errors,
                        const char* unit) {
    if (errors) std::printf("  %-38s %9.4f %s\n", name, errors->rmse, unit);
  };
  print("ATE, RMSE", run.trajectory->ate_m, "m");
  print("RPE over 1 s, translation, RMSE", run.trajectory->rpe_translation_m, "m");
  print("RPE over 1 s, rotation, RMSE", run.trajectory->rpe_rotation_deg, "deg");
  const auto say_why = [](const char* name, const std::string& reason) {
    if (!reason.empty()) std::printf("  no %s: %s\n", name, reason.c_str());
  };
  say_why("ATE", run.trajectory->why_no_ate);
  say_why("RPE over 1 s", run.trajectory->why_no_rpe);
  if (!run.trajectory->has_truth) say_why("errors", "the true trajectory is unknown");
}

/// Prints in how many frames motion was judged, and why it was not in the others.
void print_motion(const RunRecord& run) {
  std::map<std::string, std::size_t> frames;
  for (const FrameRecord& frame : run.frames) {
    ++frames[detail::name_of(frame.statistics.motion.outcome)];
  }
  std::printf("frames in which motion was judged\n");
  for (const auto& [outcome, count] : frames) {
    std::printf("  %-38s %10zu\n", outcome.c_str(), count);
  }
}

std::string masks_text(const RunRecord& run) {
  if (run.rule.masks == RuleMasks::absent) return "without masks";
  if (run.masks.empty()) {
    return std::string("no masks: there is no masks/ folder, --masks or --model, so ") +
           (run.rule.follows_motion() ? "motion decides alone" : "nothing is removed") +
           "; dynfilter masks --model FILE.onnx makes them";
  }
  return "masks: " + run.masks;
}

/// Names the offset that depth was paired with; empty without one.
std::string offset_text(const RunRecord& run) {
  if (run.depth_offset_s == 0) return "";
  return ", depth paired with an offset of " + detail::fixed_decimals(run.depth_offset_s, 3) + " s";
}

void add_scores(nlohmann::ordered_json& summary, const RunRecord& run) {
  const FeatureScores masks = run.total_scores(&FrameRecord::mask_only_scores);
  const FeatureScores all = run.total_scores(&FrameRecord::scores);
  summary["dynamic_left"] = all.dynamic_left;
  summary["dynamic_left_mask_only"] = masks.dynamic_left;
  summary["dynamic_removed"] = all.dynamic_removed;
  summary["static_left"] = all.static_left;
  summary["static_removed"] = all.static_removed;
  summary["static_removed_mask_only"] = masks.static_removed;
}

void add_trajectory(nlohmann::ordered_json& summary, const RunRecord& run) {
  const TrajectoryRecord& trajectory = *run.trajectory;
  summary["lost_frames"] = run.lost_frames();
  summary["pairs"] = trajectory.pairs;
  const auto add = [&](const char* name, const std::optional<ErrorSummary>& errors) {
    if (errors) summary[name] = errors->rmse;
  };
  add("ate_rmse_m", trajectory.ate_m);
  add("rpe_translation_rmse_m", trajectory.rpe_translation_m);
  add("rpe_rotation_rmse_deg", trajectory.rpe_rotation_deg);
  const auto add_reason = [&](const char* name, const std::string& reason) {
    if (!reason.empty()) summary["missing"][name] = reason;
  };
  add_reason("ate", trajectory.why_no_ate);
  add_reason("rpe", trajectory.why_no_rpe);
}

}  // namespace

void print_report(const RunRecord& run) {
  const FrameStatistics totals = run.totals();
  const std::size_t frames = run.frames.size();
  std::printf("\n%s: %zu frames, rule %s, %s%s\n\n", run.scene.name.c_str(), frames,
              run.rule.name.c_str(), masks_text(run).c_str(), offset_text(run).c_str());
  std::printf("features                                      total   per frame\n");
  print_count("extracted", totals.features, frames);
  if (run.rule.takes_masks()) {
    print_count("removed by mask", totals.masked, frames);
    print_count("removed by compensation", totals.compensated, frames);
    if (run.rule.follows_motion()) print_count("removed because they move", totals.moving, frames);
    if (totals.restored > 0) print_count("restored", totals.restored, frames);
  } else {
    print_count("removed", totals.removed(), frames);
  }
  print_count("kept", totals.kept(), frames);
  std::printf("  %-38s %9zu\n", "kept at the fewest", run.fewest_kept());
  if (run.cautious_frames() > 0) {
    std::printf("  %-38s %9zu\n", "cautious frames", run.cautious_frames());
  }
  if (run.has_truth) print_scores(run);
  if (run.rule.follows_motion()) print_motion(run);
  if (run.trajectory) print_trajectory(run);
  std::printf("time a frame                                 median        95 %%\n");
  for (const auto& [name, time_ms] : times_of_frames) {
    if (run.quantile_ms(time_ms, 1) == 0) continue;  // masks of files, or no odometry
    std::printf("  %-38s %6.3f ms %8.3f ms\n", name, run.quantile_ms(time_ms, 0.5),
                run.quantile_ms(time_ms, 0.95));
  }
  std::printf("  %-38s %6.0f MB\n", "memory at the most", peak_memory_mb());
  print_findings(run.findings);
}

void print_findings(const std::vector<InputFinding>& findings, const std::string& scene) {
  const std::string of_scene = scene.empty() ? "" : " of " + scene;
  std::printf("\nchecks of the input%s%s\n", of_scene.c_str(),
              findings.empty() ? ": nothing to mend" : "");
  for (const auto& [check, sentence, is_hopeless] : findings) {
    std::printf("* %s: %s\n", check.c_str(), sentence.c_str());
  }
}

void write_frames_csv(const RunRecord& run, const std::filesystem::path& file) {
  std::ostringstream csv;
  csv << detail::frame_columns()
      << ",dynamic_left_mask_only,dynamic_left,static_removed_mask_only,static_removed\n";
  for (const FrameRecord& frame : run.frames) {
    csv << detail::frame_cells(frame.stem, frame.timestamp_s, frame.statistics) << ','
        << cells_of(frame, &FeatureScores::dynamic_left) << ','
        << cells_of(frame, &FeatureScores::static_removed) << '\n';
  }
  detail::write_file(file, csv.str());
}

void write_summary_json(const RunRecord& run, const std::filesystem::path& file) {
  const FrameStatistics totals = run.totals();
  nlohmann::ordered_json summary;
  summary["version"] = DYNFILTER_VERSION_STRING;
  summary["group"] = run.scene.group;
  summary["scene"] = run.scene.name;
  summary["rule"] = run.rule.name;
  summary["has_masks"] = !run.masks.empty();
  summary["depth_offset_s"] = run.depth_offset_s;
  summary["frames"] = run.frames.size();
  summary["features"] = totals.features;
  summary["masked"] = totals.masked;
  summary["compensated"] = totals.compensated;
  summary["moving"] = totals.moving;
  summary["custom"] = totals.custom;
  summary["kept_still"] = totals.motion.kept_still;
  summary["kept"] = totals.kept();
  summary["fewest_kept"] = run.fewest_kept();
  summary["cautious_frames"] = run.cautious_frames();
  if (run.has_truth) add_scores(summary, run);
  if (run.trajectory) add_trajectory(summary, run);
  summary["checks"] = nlohmann::ordered_json::object();
  for (const InputFinding& finding : run.findings) {
    summary["checks"][finding.check] = finding.sentence;
  }
  summary["options"] = {{"features", run.settings.features},
                        {"classes", run.settings.mask_culler.dynamic_classes},
                        {"every", run.settings.every},
                        {"margin", run.settings.mask_culler.margin_px},
                        {"truth", name_of(run.settings.truth)}};
  for (const auto& [name, time_ms] : times_of_frames) {
    summary["times_ms"][name] = {{"median", run.quantile_ms(time_ms, 0.5)},
                                 {"p95", run.quantile_ms(time_ms, 0.95)}};
  }
  detail::write_file(
      file, summary.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n');
}

}  // namespace dynfilter::tools
