// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/core/utility.hpp>
#include <opencv2/core/version.hpp>

#include "commands.hpp"
#include "dynfilter/detail/kernels/instruction_set.hpp"
#include "dynfilter/version.hpp"
#include "sequence_checks.hpp"
#include "settings_checks.hpp"

namespace dynfilter::tools {
namespace {

struct DoctorOptions {
  std::filesystem::path sequence, camera, settings;
  bool has_sequence = false, has_settings = false;
};

/// Returns the names of OpenCV's modules, as its build information lists them.
std::string opencv_modules() {
  const std::string text = cv::getBuildInformation(), title = "To be built:";
  const std::size_t at = text.find(title);
  if (at == std::string::npos) return "not known";
  const std::size_t first = text.find_first_not_of(' ', at + title.size());
  return text.substr(first, text.find('\n', first) - first);
}

void print_build() {
  std::printf("dynfilter %s, OpenCV %s (compiled with %s), %d processors\n",
              DYNFILTER_VERSION_STRING, cv::getVersionString().c_str(), CV_VERSION,
              cv::getNumberOfCPUs());
  std::printf("dense D-LBP uses: %s\n", detail::best_instruction_set_name());
#if defined(DYNFILTER_HAS_NETWORKS)
  std::printf("networks: built in\n");
#else
  std::printf(
      "networks: left out, because OpenCV's module dnn was not there or "
      "DYNFILTER_BUILD_NETWORKS was off\n");
#endif
#if defined(DYNFILTER_HAS_REMOTE_SEGMENTER)
  std::printf("masks of another process: built in\n");
#else
  std::printf("masks of another process: left out, because this is not Linux\n");
#endif
}

void print_findings(const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    const char* const verdict = finding.verdict == Verdict::fine  ? "fine  "
                                : finding.verdict == Verdict::odd ? "odd   "
                                                                  : "broken";
    std::printf("%s  %s\n", verdict, finding.what.c_str());
    if (!finding.mend.empty()) std::printf("        -> %s\n", finding.mend.c_str());
  }
}

/// Prints the findings about a path, and adds it to the unusable ones if one of them is broken.
void report(const std::filesystem::path& path, const std::vector<Finding>& findings,
            std::string& unusable) {
  std::printf("\n%s\n", path.c_str());
  print_findings(findings);
  const bool is_broken = std::any_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.verdict == Verdict::broken;
  });
  if (is_broken) unusable += (unusable.empty() ? "" : " and ") + path.string();
}

void doctor(const DoctorOptions& options) {
  print_build();
  if (!options.has_sequence && !options.has_settings) {
    std::printf("OpenCV's modules: %s\n", opencv_modules().c_str());
    return;
  }
  std::string unusable;
  if (options.has_sequence) {
    report(options.sequence, examine_sequence(options.sequence, options.camera), unusable);
  }
  if (options.has_settings) {
    report(options.settings, examine_settings(options.settings), unusable);
  }
  std::fflush(stdout);  // before the error that refers to it
  if (!unusable.empty()) throw std::runtime_error(unusable + " cannot be used as it is, see above");
}

}  // namespace

void add_doctor_command(CLI::App& program) {
  const auto options = std::make_shared<DoctorOptions>();
  CLI::App* command = program.add_subcommand(
      "doctor",
      "Say what this program can do here, and what is odd about a sequence, or about the settings "
      "of\nthe plugin for ORB-SLAM. Changes nothing.");
  CLI::Option* sequence =
      command->add_option("SEQUENCE", options->sequence, "folder of the sequence to examine");
  command->add_option("--camera", options->camera, "camera file [SEQUENCE/camera.yaml]")
      ->needs(sequence);
  command->add_option(
      "--settings", options->settings,
      "the host's settings file, whose keys dynfilter.* the plugin reads; relative\n"
      "paths in it start at the folder in which this runs, as in the host");
  command->footer(
      "examples:\n"
      "  dynfilter doctor\n"
      "  dynfilter doctor rgbd_dataset_freiburg3_walking_xyz\n"
      "  dynfilter doctor --settings TUM3.yaml");
  command->callback([options, command] {
    options->has_sequence = command->count("SEQUENCE") > 0;  // though it may be an empty text
    options->has_settings = command->count("--settings") > 0;
    doctor(*options);
  });
}

}  // namespace dynfilter::tools
