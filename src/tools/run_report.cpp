// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "run_report.hpp"

#include <cstdio>
#include <string>

#include <nlohmann/json.hpp>

#include "frame_table.hpp"
#include "output_file.hpp"

namespace dynfilter::tools {
namespace {

/// "lower,upper", or two empty cells.
std::string cells_of(const ValueRange& range) {
  if (range.empty()) return ",";
  char text[64];
  std::snprintf(text, sizeof text, "%.4f,%.4f", range.lower, range.upper);
  return text;
}

/// Two cells of a pair of scores, empty where the truth is not known.
std::string cells_of(const FrameRecord& frame, std::size_t FeatureScores::*score) {
  if (!frame.scores || !frame.mask_only_scores) return ",";
  return std::to_string((*frame.mask_only_scores).*score) + "," +
         std::to_string((*frame.scores).*score);
}

const char* name_of(Compensation compensation) {
  switch (compensation) {
    case Compensation::not_run:
      return "not_run";
    case Compensation::no_depth_image:
      return "no_depth_image";
    case Compensation::too_few_samples:
      return "too_few_samples";
    case Compensation::applied:
      return "applied";
  }
  return "";
}

void print_count(const char* name, std::size_t count, std::size_t frames) {
  std::printf("  %-38s %9zu %11.1f\n", name, count,
              static_cast<double>(count) / static_cast<double>(frames));
}

/// One row with masks only, and one with compensation where the rule compensates.
void print_score(const RunRecord& run, const std::string& name, std::size_t FeatureScores::*score) {
  const auto total = [&](auto which) { return run.total_scores(which).*score; };
  print_count((name + ", masks only").c_str(), total(&FrameRecord::mask_only_scores),
              run.frames.size());
  if (run.rule == "mask") return;
  print_count((name + ", with compensation").c_str(), total(&FrameRecord::scores),
              run.frames.size());
}

void print_scores(const RunRecord& run) {
  const FeatureScores all = run.total_scores(&FrameRecord::scores);
  std::printf("against the true masks                        total   per frame\n");
  print_count("dynamic ones, nothing removed", all.dynamic_left + all.dynamic_removed,
              run.frames.size());
  print_score(run, "dynamic left", &FeatureScores::dynamic_left);
  print_score(run, "static removed", &FeatureScores::static_removed);
  print_score(run, "removed on the rim", &FeatureScores::rim_removed);
}

}  // namespace

void print_report(const RunRecord& run) {
  const FrameStatistics totals = run.totals();
  const std::size_t frames = run.frames.size();
  std::printf("\n%s: %zu frames, rule %s, %s\n\n", run.sequence.c_str(), frames, run.rule.c_str(),
              run.masks.empty() ? "no masks: there is no masks/ folder, so nothing can be removed"
                                : ("masks from " + run.masks).c_str());
  std::printf("features                                      total   per frame\n");
  print_count("extracted", totals.features, frames);
  print_count("removed by mask", totals.masked, frames);
  print_count("removed by compensation", totals.compensated, frames);
  print_count("kept", totals.kept(), frames);
  if (!run.true_masks.empty()) print_scores(run);
  std::printf("time a frame                                 median        95 %%\n");
  for (const auto& [name, times] : run.stages) {
    std::printf("  %-38s %6.3f ms %8.3f ms\n", name.c_str(), times.quantile_ms(0.5),
                times.quantile_ms(0.95));
  }
}

void write_frames_csv(const RunRecord& run, const std::filesystem::path& file) {
  OutputFile csv(file);
  csv << detail::frame_columns()
      << ",dynamic_left_mask_only,dynamic_left,static_removed_mask_only,static_removed,"
         "rim_removed_mask_only,rim_removed\n";
  for (const FrameRecord& frame : run.frames) {
    csv << detail::frame_cells(frame.stem, frame.timestamp_s, frame.statistics) << ','
        << cells_of(frame, &FeatureScores::dynamic_left) << ','
        << cells_of(frame, &FeatureScores::static_removed) << ','
        << cells_of(frame, &FeatureScores::rim_removed) << '\n';
  }
  csv.close();
}

void write_instances_csv(const RunRecord& run, const std::filesystem::path& file) {
  OutputFile csv(file);
  csv << "frame,instance,class_id,dynamic,masked,sampled,candidates,passed_depth,passed_code,"
         "compensated,compensation,depth_lower_m,depth_upper_m,code_lower,code_upper\n";
  for (const FrameRecord& frame : run.frames) {
    std::size_t k = 0;
    for (const InstanceStatistics& s : frame.statistics.instances) {
      csv << frame.stem << ',' << k++ << ',' << s.class_id << ',' << (s.dynamic ? 1 : 0) << ','
          << s.masked << ',' << s.sampled << ',' << s.candidates << ',' << s.passed_depth << ','
          << s.passed_code << ',' << s.compensated << ',' << name_of(s.compensation) << ','
          << cells_of(s.depth_range_m) << ',' << cells_of(s.code_range) << '\n';
    }
  }
  csv.close();
}

void write_summary_json(const RunRecord& run, const std::filesystem::path& file) {
  const FrameStatistics totals = run.totals();
  nlohmann::ordered_json summary;
  summary["sequence"] = run.sequence;
  summary["rule"] = run.rule;
  summary["has_masks"] = !run.masks.empty();
  summary["frames"] = run.frames.size();
  summary["features"] = totals.features;
  summary["masked"] = totals.masked;
  summary["compensated"] = totals.compensated;
  summary["kept"] = totals.kept();
  if (!run.true_masks.empty()) {
    const FeatureScores masks = run.total_scores(&FrameRecord::mask_only_scores);
    const FeatureScores all = run.total_scores(&FrameRecord::scores);
    summary["dynamic_left"] = all.dynamic_left;
    summary["dynamic_left_mask_only"] = masks.dynamic_left;
    summary["static_removed"] = all.static_removed;
    summary["static_removed_mask_only"] = masks.static_removed;
    summary["rim_removed"] = all.rim_removed;
    summary["rim_removed_mask_only"] = masks.rim_removed;
  }
  for (const auto& [name, value] : run.options) summary["options"][name] = value;
  for (const auto& [name, times] : run.stages) {
    summary["times_ms"][name] = {{"median", times.quantile_ms(0.5)},
                                 {"p95", times.quantile_ms(0.95)}};
  }
  OutputFile json(file);
  json << summary.dump(2) << '\n';
  json.close();
}

}  // namespace dynfilter::tools
