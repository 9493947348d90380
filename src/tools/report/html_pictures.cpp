// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "html_pictures.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/number_text.hpp"
#include "io/image_file.hpp"

namespace dynfilter::tools {
namespace {

constexpr int picture_width = 480;
constexpr int jpeg_quality = 75;

struct WorstRun {
  RunResult run;
  double dynamic_left = 0;  ///< in its worst frame
};

/// Finds the worst run of a rule; std::nullopt if no run has readable scores.
std::optional<WorstRun> worst_of(const GroupOfRuns& group, const std::string& rule, Notes& notes) {
  std::optional<WorstRun> worst;
  for (const RunResult& run : group.runs) {
    if (run.rule != rule || !run.scores) continue;
    try {
      const std::vector<double> left = read_frame_series(run.folder / "frames.csv").dynamic_left;
      if (left.empty())
        throw std::runtime_error((run.folder / "frames.csv").string() + ": has no scores");
      const double dynamic_left = *std::max_element(left.begin(), left.end());
      if (!worst || dynamic_left > worst->dynamic_left) worst = {run, dynamic_left};
    } catch (const std::runtime_error& error) {
      notes.push_back("Scene " + run.scene.name + " under rule " + rule +
                      " was left out of the search for the worst frame: " + error.what() + ".");
    }
  }
  return worst;
}

/// Returns an <img> that contains the picture.
std::string image_of(const std::filesystem::path& file, const std::string& description) {
  cv::Mat image = detail::read_image(file, cv::IMREAD_COLOR);
  if (image.cols > picture_width) {
    const int height = std::max(1, image.rows * picture_width / image.cols);
    cv::resize(image, image, {picture_width, height}, 0, 0, cv::INTER_AREA);
  }
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality});
  return "<img loading=\"lazy\" width=\"" + std::to_string(image.cols) + "\" height=\"" +
         std::to_string(image.rows) + "\" alt=\"" + escaped(description) +
         "\" src=\"data:image/jpeg;base64," + base64(jpeg) + "\">\n";
}

std::string picture_of(const WorstRun& worst) {
  const std::string count = detail::fixed_decimals(worst.dynamic_left, 0);
  const std::string& scene = worst.run.scene.name;
  const std::string description = "A frame of scene " + scene + " with the features that rule " +
                                  worst.run.rule + " keeps and removes; " + count +
                                  " dynamic features are left";
  return "<figure>" + image_of(worst.run.folder / "worst_frame.jpg", description) +
         "<figcaption><strong>" + escaped(worst.run.rule) + "</strong>, scene " + escaped(scene) +
         ": " + count + " left</figcaption></figure>\n";
}

}  // namespace

std::string worst_frames(const GroupOfRuns& group, Notes& notes) {
  std::string pictures;
  std::size_t count = 0;
  std::vector<std::string> perfect, unscored;
  for (const std::string& rule : rules_of(group.runs)) {
    const std::optional<WorstRun> worst = worst_of(group, rule, notes);
    if (!worst || worst->dynamic_left <= 0) {
      (worst ? perfect : unscored).push_back(rule);
      continue;
    }
    try {
      pictures += picture_of(*worst);
      ++count;
    } catch (const std::runtime_error& error) {
      notes.push_back("No picture of rule " + rule + ": " + error.what() + ".");
    }
  }
  if (!perfect.empty()) {
    notes.push_back("No picture of " + rules_text(perfect) + ": no dynamic features are left.");
  }
  if (!unscored.empty()) {
    notes.push_back("No picture of " + rules_text(unscored) + ": true masks are unknown.");
  }
  if (count == 0) return "";
  return "<details>" + element("summary", "Worst frames: " + counted(count, "picture")) +
         element("p",
                 "For every rule, the frame of the group's scenes in which most dynamic features "
                 "are left. A ring is a kept feature, any other mark a removed one.") +
         "<div class=\"pictures\">\n" + pictures + "</div></details>\n";
}

}  // namespace dynfilter::tools
