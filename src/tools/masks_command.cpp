// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "commands.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "frame_source.hpp"
#include "inputs.hpp"
#include "number_options.hpp"
#include "progress_bar.hpp"
#include "segmenter_spec.hpp"
#include "segmenters/mask_table.hpp"
#include "shared_options.hpp"

namespace dynfilter::tools {
namespace {

struct MasksOptions {
  std::filesystem::path sequence, camera, out;
  std::optional<double> depth_offset_s;
  SegmenterSpec segmenter;
  bool overwrite = false;
};

void make_masks(const MasksOptions& options) {
  const RgbdSequence sequence(options.sequence, {0.02, options.camera, options.depth_offset_s});
  Inputs inputs;
  add_sequence_inputs(sequence, inputs);
  inputs.add(options.camera);
  inputs.add(options.segmenter.model);
  require_harmless(inputs, options.out, "masks", detail::mask_names(options.out),
                   options.overwrite);
  const std::unique_ptr<Segmenter> segmenter = options.segmenter.make();
  MaskFolderWriterOptions writer_options;
  writer_options.overwrite = options.overwrite;
  MaskFolderWriter writer(options.out, writer_options);
  std::size_t instances = 0;
  {
    ProgressBar progress("segmenting", sequence.size());
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const FrameView frame = sequence.read(i);
      const Segmentation masks = segmenter->segment(frame);
      writer.add(masks, sequence.entry(i).stem, frame.timestamp_s);
      instances += masks.instances.size();
      progress.advance();
    }
  }
  writer.finish();
  std::printf("%zu instances in %zu frames, written to %s\n", instances, sequence.size(),
              options.out.c_str());
}

}  // namespace

void add_masks_command(CLI::App& program) {
  const auto options = std::make_shared<MasksOptions>();
  CLI::App* command = program.add_subcommand(
      "masks",
      "Run a segmenter over a sequence once and write its masks, label maps with an "
      "instances.csv,\n"
      "for dynfilter run --masks, for MaskFolderSegmenter and for the plugin.");
  command->add_option("SEQUENCE", options->sequence, "folder of the sequence")->required();
  command->add_option("--out", options->out, "folder for the masks")
      ->check(some_path())
      ->required();
  command->add_option("--camera", options->camera, "camera file [SEQUENCE/camera.yaml]");
  add_depth_offset_option(*command, options->depth_offset_s);
  command->add_flag("--overwrite", options->overwrite,
                    "replace the masks of an earlier call when all new ones are made");
  add_segmenter_options(*command, options->segmenter);
  command->footer(
      "example: dynfilter masks rgbd_dataset_freiburg3_walking_xyz --remote /run/user/1000/masks\n"
      "           --out rgbd_dataset_freiburg3_walking_xyz/masks");
  command->callback([options] {
    if (options->segmenter.is_unset()) throw CLI::RequiredError("a segmenter, such as --remote");
    make_masks(*options);
  });
}

}  // namespace dynfilter::tools
