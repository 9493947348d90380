// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdio>
#include <memory>

#include "commands.hpp"
#include "progress_bar.hpp"
#include "run_report.hpp"
#include "sequence_run.hpp"

namespace dynfilter::tools {
namespace {

void run(const RunOptions& options) {
  SequenceRun work(options);
  {
    ProgressBar progress("filtering", work.size());
    for (std::size_t i = 0; i < work.size(); ++i) {
      work.process(i);
      progress.advance();
    }
  }
  const RunRecord record = work.finish();
  write_frames_csv(record, options.out / "frames.csv");
  write_instances_csv(record, options.out / "instances.csv");
  write_summary_json(record, options.out / "summary.json");
  print_report(record);
  std::printf("\nwritten to %s: frames.csv, instances.csv, summary.json%s\n", options.out.c_str(),
              options.overlays > 0 ? ", overlays/, contact_sheet.png" : "");
}

}  // namespace

void add_run_command(CLI::App& program) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* command = program.add_subcommand(
      "run",
      "Filter the ORB features of a sequence (TUM RGB-D or BONN layout) by its masks/ folder, and\n"
      "show what was removed: a table, overlays, a line a frame. Where there is masks_true/, the\n"
      "features are scored against it.");
  command->add_option("SEQUENCE", options->sequence, "folder of the sequence")->required();
  command->add_option("--out", options->out, "folder for the results")->capture_default_str();
  command->add_option("--masks", options->masks, "folder of the masks [SEQUENCE/masks]");
  command->add_option("--camera", options->camera, "camera file [SEQUENCE/camera.yaml]");
  command
      ->add_option("--rule", options->rule, "paper: masks and edge compensation; mask: masks only")
      ->check(CLI::IsMember(detail::rule_names()))
      ->capture_default_str();
  command->add_option("--features", options->features, "ORB features a frame")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command
      ->add_option("--classes", options->mask_culler.dynamic_classes,
                   "class ids that are dynamic, as 0,16")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  command
      ->add_option("--margin", options->mask_culler.margin_px,
                   "features that close to a mask go too, pixels")
      ->capture_default_str();
  command->add_option("--seed", options->seed, "of the sampled features")->capture_default_str();
  command->add_option("--overlays", options->overlays, "number of frames to draw")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  command->footer(
      "examples:\n"
      "  dynfilter run rgbd_dataset_freiburg3_walking_xyz --out result\n"
      "  dynfilter run scene --rule mask --masks scene/masks_true");
  command->callback([options] { run(*options); });
}

}  // namespace dynfilter::tools
