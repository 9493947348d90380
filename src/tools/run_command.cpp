// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include <opencv2/core/utility.hpp>

#include "commands.hpp"
#include "inputs.hpp"
#include "io/file_error.hpp"
#include "progress_bar.hpp"
#include "rule_run.hpp"
#include "shared_options.hpp"
#include "source_checks.hpp"

namespace dynfilter::tools {
namespace {

struct RunOptions {
  SceneSpec scene;
  std::string rule;  // empty: the default
  std::filesystem::path out = "dynfilter_out";
  RunSettings settings;
  SegmenterSpec segmenter;
};

/// Returns the chosen rule, or the default: motion is judged where depth and every frame are there.
const RuleInfo& rule_of(const RunOptions& options, const FrameSource& source) {
  const bool can_follow = source.facts().has_depth && options.settings.every == 1;
  return rule_info(!options.rule.empty() ? options.rule : can_follow ? "depth_motion" : "depth");
}

void run(const RunOptions& options) {
  SceneSpec scene = options.scene;
  const bool takes_none =
      !options.rule.empty() && rule_info(options.rule).masks == RuleMasks::absent;
  scene.reads_masks = options.segmenter.is_unset() && !takes_none;
  const std::unique_ptr<FrameSource> source = scene.open(options.settings.truth);
  if (!source->facts().note.empty()) std::fprintf(stderr, "%s\n", source->facts().note.c_str());
  Inputs inputs;
  source->add_inputs(inputs);
  inputs.add(options.segmenter.model);
  inputs.require_harmless(options.out, run_writer, true);
  const std::unique_ptr<Segmenter> segmenter =
      options.segmenter.is_unset() ? nullptr : options.segmenter.make();
  RunSettings settings = options.settings;
  settings.mask_culler.dynamic_classes = class_ids(settings.classes, segmenter.get());
  settings.masks = segmenter ? options.segmenter.name() : source->facts().masks_name;
  const RuleInfo& rule = rule_of(options, *source);
  const bool has_own_masks = !scene.masks.empty() || segmenter;
  if (has_own_masks && (takes_none || rule.is_bound())) {
    throw std::runtime_error("rule " + rule.name +
                             " takes no masks: got --masks or a segmenter; want neither");
  }
  RuleRun work(rule, scene, *source, settings, options.out);
  const odometry::OrbExtractor extractor(options.settings.features);
  SourceChecks checks(source->facts(), settings.mask_culler, settings.features, rule.moves_masks());
  {
    ProgressBar progress("filtering", source->size());
    for (std::size_t i = 0; source->has(i); i += options.settings.every) {
      SourceFrame frame = source->read(i);
      const ExtractedFeatures features = extract_features(extractor, frame.frame.image);
      if (segmenter) {
        cv::TickMeter timer;
        timer.start();
        frame.masks = masks_of(*segmenter, frame.frame, i, source->size());
        timer.stop();
        frame.masks_ms = timer.getTimeMilli();
      }
      const FrameStatistics& statistics = work.process(frame, features);
      checks.add(frame, features.keypoints, &statistics);
      checks.require_hope();
      progress.advance(options.settings.every);
    }
  }
  print_report(work.finish(*source, checks.findings(source->mask_values())));
  std::printf("\nwritten to %s: summary.json, frames.csv%s%s%s\n", options.out.c_str(),
              source->facts().has_depth && settings.every == 1 ? ", trajectory.txt" : "",
              std::filesystem::exists(options.out / "groundtruth.txt") ? ", groundtruth.txt" : "",
              options.settings.overlays > 0 ? ", overlays/" : "");
}

constexpr char run_description[] =
    "Filter the ORB features of a sequence (TUM RGB-D or BONN layout) by its masks/ folder. Show\n"
    "what was removed (a table, overlays, one line a frame), and track the camera on the other\n"
    "features with the reference odometry. Say what is wrong with the sequence, such as late\n"
    "depth or old masks, and what mends it. If the sequence has masks_true/, the features are\n"
    "scored against it; if it has groundtruth.txt, so is the trajectory.";

constexpr char run_notes[] =
    "\n\nrows of the report:\n"
    "  removed by mask          on the mask of a dynamic object\n"
    "  removed by compensation  off the masks, taken for the object by the rule\n"
    "  restored                 removed first, and kept in the end: motion sees it at rest\n"
    "  kept at the fewest       features kept in the worst frame\n"
    "  cautious frames          too few features were left, so only sure ones went\n"
    "  dynamic left             should have gone, by the true masks or --truth\n"
    "  static removed           should have stayed\n"
    "  frames lost              the odometry found no pose\n\n"
    "examples:\n"
    "  dynfilter run rgbd_dataset_freiburg3_walking_xyz --camera tum3 --out result\n"
    "  dynfilter run scene --rule mask --masks scene/masks_true\n"
    "  dynfilter run --level medium --scene-seed 5 --rule crowd_slam\n"
    "  dynfilter run scene --model FILE.onnx";

}  // namespace

void add_run_command(CLI::App& program) {
  const auto options = std::make_shared<RunOptions>();
  options->settings.overlays = 6;
  CLI::App* command = program.add_subcommand("run", run_description);
  CLI::Option* sequence = command->add_option(
      "SEQUENCE", options->scene.sequence,
      "folder of the sequence; or a film, or a camera's number, for 300 frames");
  CLI::Option* level = command
                           ->add_option("--level", options->scene.level,
                                        "level of dynfilter synth to render and filter, "
                                        "instead of SEQUENCE")
                           ->type_name("LEVEL");
  sequence->excludes(level);
  command->add_option("--scene-seed", options->scene.level_seed, "seed of the level")
      ->check(CLI::Range(0, 999999999))
      ->capture_default_str()
      ->needs(level);
  add_level_size_options(*command, options->scene, level);
  command
      ->add_option("--out", options->out,
                   "folder for the results; replaces those of an earlier run and nothing else")
      ->capture_default_str();
  add_recording_options(*command, options->scene, sequence);
  command
      ->add_option("--rule", options->rule,
                   "rule that removes features, see below; without depth, or with --every, the "
                   "default is depth")
      ->check(CLI::IsMember(all_rule_names()));
  add_segmenter_options(*command, options->segmenter);
  for (const char* name : {"--remote", "--model"}) {  // which have no use for other masks
    CLI::Option* segmenter = command->get_option_no_throw(name);  // none: built without it
    if (segmenter != nullptr) command->get_option("--masks")->excludes(segmenter);
  }
  command->add_option("--features", options->settings.features, "ORB features a frame")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  add_setting_options(*command, options->settings);
  command->add_option("--overlays", options->settings.overlays, "number of frames to draw")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  command->footer(rule_list() + run_notes);
  command->callback([options] {
    if (options->scene.sequence.empty() && options->scene.level.empty()) {
      throw CLI::RequiredError("SEQUENCE or --level");
    }
    run(*options);
  });
}

}  // namespace dynfilter::tools
