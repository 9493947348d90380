// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "html_report.hpp"

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "ablation_tables.hpp"
#include "health_text.hpp"
#include "html_page.hpp"
#include "html_pictures.hpp"
#include "html_plots.hpp"
#include "html_runs.hpp"
#include "html_style.hpp"
#include "output_file.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {
namespace {

/// Starts the page after its checksum; its policy keeps the browser from loading anything from
/// outside.
std::string head(const std::string& title, const RuleStyles& styles) {
  return " -->\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
         "img-src data:; style-src 'unsafe-inline'\">\n" +
         element("title", title) + "<style>" + styles.style_sheet() +
         "</style>\n</head>\n<body>\n" + element("h1", title);
}

std::string explanation(Truth truth) {
  const std::string dynamic =
      truth == Truth::by_motion
          ? "The truth is by motion: a feature is dynamic on the exact silhouette of what moves in "
            "this frame, person or not, "
          : "The truth is by class: a feature is dynamic on the exact silhouette of an object of "
            "the true masks, which may move or stand still, ";
  return element(
      "p",
      "Every rule gets the same features of the same frames and decides which of them to remove. " +
          dynamic +
          "static more than 3 px outside every silhouette (15 px with --degrade, by the original "
          "masks), and on the rim in between, where either verdict is right. "
          "\"Dynamic left\" counts the dynamic features that a rule keeps; "
          "\"static removed\" counts the static features that it removes. The reference odometry "
          "uses the kept features. The ATE (absolute trajectory error) is the distance of its "
          "positions from the true ones after alignment.");
}

std::string descriptions(const std::vector<std::string>& rules) {
  std::string html = "<dl>\n";
  for (const std::string& rule : rules) {
    html += element("dt", rule);
    std::string text = "unknown to this version of dynfilter";
    for (const RuleInfo& info : all_rules()) {
      if (info.name == rule) text = info.description;
    }
    html += element("dd", text);
  }
  return html + "</dl>\n";
}

std::string missing(const std::vector<RunResult>& results) {
  const std::vector<std::string> runs = missing_runs(results);
  if (runs.empty()) return "";
  return element("p", "Missing: " + counted(runs.size(), "run") +
                          " of scenes and rules that have other results.") +
         "<details>" + element("summary", "Which") + html_of(runs) + "</details>\n";
}

std::string trimmed(std::string text) {
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

std::string overview(const std::vector<RunResult>& results, const RuleStyles& styles) {
  return explanation(results.front().truth) +
         element("p", counted(scenes_of(results).size(), "scene") + " under " +
                          counted(styles.rules().size(), "rule") + ", " +
                          counted(results.size(), "run") +
                          ". All used the options: " + trimmed(results.front().options) + ".") +
         missing(results) + descriptions(styles.rules());
}

std::string anchor(std::size_t group) { return "group" + std::to_string(group); }

std::string navigation(const std::vector<GroupOfRuns>& groups) {
  std::string html = "<nav aria-label=\"Sections\">" + element("a", "Tables", "href=\"#tables\"");
  for (std::size_t k = 0; k < groups.size(); ++k) {
    html += element("a", groups[k].name, "href=\"#" + anchor(k) + "\"");
  }
  return html + "</nav>\n";
}

std::string tables(const std::vector<RunResult>& results) {
  std::string html =
      element("h2", "Tables", "id=\"tables\"") +
      element(
          "p",
          "Figures over several scenes are medians, with minimum and maximum in brackets; a dash "
          "means that there is no figure. In the table in the form of the paper's Table 4, Y is "
          "rule mask and Y+D is rule paper.");
  for (const Table& table : ablation_tables(results)) html += html_of(table);
  return html;
}

std::string scene_remark(const GroupOfRuns& group, const TypicalScene& scene) {
  const std::size_t scenes = scenes_of(group.runs).size();
  if (scenes == 1) return element("p", "Scene " + scene.name + ".");
  const std::string of_all = " of " + std::to_string(scenes) + " scenes";
  if (!scene.is_median)
    return element("p", "The plots show scene " + scene.name + ", the first" + of_all + ".");
  const std::string place =
      scenes % 2 == 1 ? ", the middle one" : ", the last one before the middle";
  return element("p", "The plots show scene " + scene.name + place + of_all +
                          ", ordered by their ATE under rule paper.");
}

/// Shows the health of the scene's run under rule depth, which measures most, or of the first run.
std::string health(const std::vector<RunResult>& runs, Notes& notes) {
  const auto by_depth = std::find_if(runs.begin(), runs.end(),
                                     [](const RunResult& run) { return run.rule == "depth"; });
  const RunResult& run = by_depth == runs.end() ? runs.front() : *by_depth;
  if (run.health.empty()) {
    notes.push_back((run.folder / "summary.json").string() +
                    ": is of an earlier version and holds no health");
    return "";
  }
  return html_of(health_table("Health of the input, under rule " + run.rule, run.health)) +
         html_of(health_advice(run.health));
}

std::string section(const GroupOfRuns& group, std::size_t number, const RuleStyles& styles) {
  const TypicalScene scene = typical_scene(group);
  Notes notes;
  const std::vector<RunResult> runs = runs_of(group, scene.name);
  const std::string input = health(runs, notes);
  const std::string plots = scene_plots(runs, styles, notes);
  const std::string pictures = worst_frames(group, notes);
  return "<section>\n" + element("h2", group.name, "id=\"" + anchor(number) + "\"") +
         scene_remark(group, scene) + input + plots + pictures + html_of(notes) + "</section>\n";
}

}  // namespace

void write_html_report(const std::vector<RunResult>& results, const std::filesystem::path& file) {
  const RuleStyles styles(rules_of(results));
  const std::vector<GroupOfRuns> groups = groups_of(results);
  OutputFile page(file);
  page << head("dynfilter: rules compared", styles) << navigation(groups)
       << overview(results, styles) << tables(results);
  for (std::size_t k = 0; k < groups.size(); ++k) page << section(groups[k], k, styles);
  page << "</body>\n</html>\n";
  write_replaceable(file, html_report_beginning, page.text());
}

}  // namespace dynfilter::tools
