// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "run_results.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <map>
#include <tuple>

#include <nlohmann/json.hpp>

#include "dynfilter/detail/errors.hpp"
#include "io/file_error.hpp"
#include "io/hidden_names.hpp"
#include "io/regular_file.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::vector<fs::path> summaries_in(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;
  for (fs::recursive_directory_iterator entry(folder), end; entry != end; ++entry) {
    const fs::path name = entry->path().filename();
    // The files of an unfinished run are no results, nor is a folder in which earlier and new ones
    // are mixed, because a run was stopped there.
    if (detail::is_hidden_name(name) && entry->is_directory()) entry.disable_recursion_pending();
    const bool is_mixed = fs::exists(entry->path().parent_path() / detail::commit_mark_name);
    if (name == "summary.json" && !is_mixed) files.push_back(entry->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::optional<double> number(const Json& json, const char* name) {
  if (!json.contains(name)) return {};
  return json.at(name).get<double>();
}

std::optional<FeatureScores> scores_of(const Json& json) {
  if (!json.contains("dynamic_left")) return {};
  FeatureScores scores;
  json.at("dynamic_left").get_to(scores.dynamic_left);
  json.at("dynamic_removed").get_to(scores.dynamic_removed);
  json.at("static_left").get_to(scores.static_left);
  json.at("static_removed").get_to(scores.static_removed);
  json.at("static_removed_with_depth").get_to(scores.static_removed_with_depth);
  json.at("rim_left").get_to(scores.rim_left);
  json.at("rim_removed").get_to(scores.rim_removed);
  return scores;
}

RunResult result_of(const Json& json) {
  RunResult result;
  json.at("group").get_to(result.scene.group);
  json.at("scene").get_to(result.scene.name);
  json.at("rule").get_to(result.rule);
  std::map<std::string, std::string> options;
  json.at("options").get_to(options);
  options.emplace("truth", name_of(Truth::by_class));  // earlier versions had no other
  result.truth = truth_of_name(options.at("truth"));
  result.options = options_text(options);
  result.input = json.value("input", "");
  if (json.contains("image_size")) {
    result.image_size = {json.at("image_size").at(0).get<int>(),
                         json.at("image_size").at(1).get<int>()};
  }
  if (json.contains("has_masks")) {
    result.masks =
        masks_origin(result.rule, json.at("has_masks").get<bool>(), json.value("segmenter", ""));
  }
  json.at("frames").get_to(result.frames);
  json.at("features").get_to(result.features);
  json.at("kept").get_to(result.kept);
  result.scores = scores_of(json);
  if (json.contains("lost_frames")) result.lost_frames = json.at("lost_frames").get<std::size_t>();
  result.ate_rmse_m = number(json, "ate_rmse_m");
  result.rpe_translation_rmse_m = number(json, "rpe_translation_rmse_m");
  result.rpe_rotation_rmse_deg = number(json, "rpe_rotation_rmse_deg");
  if (json.contains("health")) result.health = health_rows_of(json.at("health"));
  return result;
}

RunResult read_result(const fs::path& file) {
  detail::require_regular_file(file);
  try {
    std::ifstream stream(file);
    RunResult result = result_of(Json::parse(stream));
    constexpr std::size_t max_frames = 1'000'000'000;
    if (result.frames == 0 || result.frames > max_frames || result.kept > result.features) {
      detail::throw_file_error(file, "has counts that no run gives");
    }
    result.folder = file.parent_path();
    return result;
  } catch (const nlohmann::json::exception& error) {
    detail::throw_file_error(file, std::string("is no summary of dynfilter run: ") + error.what());
  }
}

/// Returns all figures of the tables, to tell whether two runs agree.
auto figures(const RunResult& r) {
  const FeatureScores s = r.scores.value_or(FeatureScores());
  return std::make_tuple(r.frames, r.features, r.kept, s.dynamic_left, s.static_removed,
                         s.static_removed_with_depth, s.rim_removed, r.lost_frames, r.ate_rmse_m,
                         r.rpe_translation_rmse_m, r.rpe_rotation_rmse_deg);
}

/// Ranks levels and rules in their own order; unknown names come last, by name.
template <class Names>
std::size_t rank(const Names& names, const std::string& name) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

void sort_for_tables(std::vector<RunResult>& results) {
  std::vector<std::string> levels;
  for (const SceneLevel& level : scene_levels()) levels.push_back(level.name);
  const std::vector<std::string> rules = all_rule_names();
  const auto key = [&](const RunResult& r) {
    // Sorts medium_2 before medium_10.
    return std::make_tuple(rank(levels, r.scene.group), r.scene.group, r.scene.name.size(),
                           r.scene.name, rank(rules, r.rule), r.rule);
  };
  std::sort(results.begin(), results.end(),
            [&](const RunResult& a, const RunResult& b) { return key(a) < key(b); });
}

void add_name(std::vector<std::string>& names, const std::string& name) {
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

/// Refuses a run that differs from an earlier one in something that tables must not mix.
void require_equal(const RunResult& run, const std::string& value, const RunResult& earlier,
                   const std::string& earlier_value) {
  if (value == earlier_value) return;
  detail::throw_file_error(run.folder / "summary.json",
                           "was made with " + value + ", and " + earlier.folder.string() +
                               " with " + earlier_value + "; keep them in different folders");
}

std::string images_of(const RunResult& run) {
  return detail::concatenate(run.frames, " frames of ", run.image_size.width, "x",
                             run.image_size.height);
}

}  // namespace

std::string options_text(const std::map<std::string, std::string>& options) {
  std::string text;
  for (const auto& [name, value] : options) {
    if (name != "rule") text += (text.empty() ? "" : " ") + name + " " + value;
  }
  return text;
}

std::string masks_origin(const std::string& rule, bool has_masks, const std::string& segmenter) {
  const std::vector<std::string> known = all_rule_names();
  const bool is_known = std::find(known.begin(), known.end(), rule) != known.end();
  if (is_known && rule_info(rule).takes_true_masks) return {};
  if (!has_masks) return "no masks";
  return segmenter.empty() ? "the scene's own masks" : "the masks of " + segmenter;
}

std::vector<RunResult> find_results(const fs::path& folder) {
  std::vector<RunResult> results;
  for (const fs::path& file : summaries_in(folder)) results.push_back(read_result(file));
  return results;
}

void require_comparable(const std::vector<RunResult>& results) {
  std::map<std::string, const RunResult*> by_group, by_scene, with_masks;
  for (const RunResult& run : results) {
    const RunResult& any = results.front();
    require_equal(run, run.options, any, any.options);
    const RunResult& of_scene = *by_scene.emplace(run.scene.name, &run).first->second;
    require_equal(run, "input " + run.input, of_scene, "input " + of_scene.input);
    const RunResult& of_group = *by_group.emplace(run.scene.group, &run).first->second;
    require_equal(run, images_of(run), of_group, images_of(of_group));
    if (run.masks.empty()) continue;
    const RunResult& masked = *with_masks.emplace(run.scene.name, &run).first->second;
    require_equal(run, run.masks, masked, masked.masks);
  }
}

std::vector<RunResult> read_results(const fs::path& folder) {
  if (!fs::is_directory(folder)) detail::throw_file_error(folder, "is not a folder");
  std::vector<RunResult> found = find_results(folder);
  if (found.empty()) {
    detail::throw_file_error(folder,
                             "holds no results: there is no summary.json in it, at any depth");
  }
  require_comparable(found);
  std::vector<RunResult> results;
  std::map<std::pair<std::string, std::string>, std::size_t> seen;  // scene and rule to result
  for (RunResult& result : found) {
    const auto [earlier, is_new] =
        seen.emplace(std::make_pair(result.scene.name, result.rule), results.size());
    if (is_new) {
      results.push_back(std::move(result));
    } else if (figures(results[earlier->second]) != figures(result)) {
      detail::throw_file_error(result.folder / "summary.json",
                               "differs from the result of scene " + result.scene.name +
                                   " under rule " + result.rule + " in " +
                                   results[earlier->second].folder.string());
    }
  }
  sort_for_tables(results);
  return results;
}

std::vector<GroupOfRuns> groups_of(const std::vector<RunResult>& results) {
  std::vector<GroupOfRuns> groups;
  for (const RunResult& result : results) {
    auto group = std::find_if(groups.begin(), groups.end(), [&](const GroupOfRuns& candidate) {
      return candidate.name == result.scene.group;
    });
    if (group == groups.end()) group = groups.insert(group, {result.scene.group, {}});
    group->runs.push_back(result);
  }
  return groups;
}

std::vector<std::string> rules_of(const std::vector<RunResult>& results) {
  std::vector<std::string> present, rules;
  for (const RunResult& result : results) add_name(present, result.rule);
  for (const std::string& rule : all_rule_names()) {
    if (std::find(present.begin(), present.end(), rule) != present.end()) rules.push_back(rule);
  }
  for (const std::string& rule : present) add_name(rules, rule);  // of another version, perhaps
  return rules;
}

std::vector<std::string> scenes_of(const std::vector<RunResult>& results) {
  std::vector<std::string> scenes;
  for (const RunResult& result : results) add_name(scenes, result.scene.name);
  return scenes;
}

}  // namespace dynfilter::tools
