// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands.hpp"
#include "dynfilter/datasets/rgbd_sequence_writer.hpp"
#include "dynfilter/datasets/synthetic_scene.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "progress_bar.hpp"

namespace dynfilter::tools {
namespace {

struct SynthOptions {
  std::filesystem::path folder;
  bool overwrite = false;
  SyntheticSceneOptions scene;
};

void synthesise(const SynthOptions& options) {
  const SyntheticScene scene(options.scene);
  RgbdSequenceWriterOptions sequence_options;
  sequence_options.overwrite = options.overwrite;
  MaskFolderWriterOptions mask_options;
  mask_options.overwrite = options.overwrite;
  RgbdSequenceWriter sequence(options.folder, scene.camera(), sequence_options);
  MaskFolderWriter masks(options.folder / "masks", mask_options);
  MaskFolderWriter true_masks(options.folder / "masks_true", mask_options);
  {
    ProgressBar progress("rendering", static_cast<std::size_t>(scene.size()));
    for (int i = 0; i < scene.size(); ++i) {
      const SyntheticFrame rendered = scene.render(i);
      sequence.add(rendered.frame, rendered.pose.rotation, rendered.pose.translation);
      masks.add(rendered.poor_segmentation);
      true_masks.add(rendered.true_segmentation);
      progress.advance();
    }
  }
  sequence.finish();
  masks.finish();
  true_masks.finish();
  std::printf("%d frames of %dx%d in %s\n", scene.size(), options.scene.image_size.width,
              options.scene.image_size.height, options.folder.c_str());
}

}  // namespace

void add_synth_command(CLI::App& program) {
  const auto options = std::make_shared<SynthOptions>();
  CLI::App* command = program.add_subcommand(
      "synth",
      "Render a sequence with known truth: a room, a moving camera, walking persons.\n"
      "Writes rgb/, depth/, their lists, groundtruth.txt, camera.yaml, the poor masks of an\n"
      "imagined network (masks/) and the exact ones (masks_true/).");
  SyntheticSceneOptions& scene = options->scene;
  command->add_option("FOLDER", options->folder, "where to write the sequence")->required();
  command->add_option("--frames", scene.frames, "number of frames")->capture_default_str();
  command->add_option("--seed", scene.seed, "another seed is another scene")->capture_default_str();
  command->add_option("--persons", scene.persons, "number of persons, 0 to 8")
      ->capture_default_str();
  command->add_option("--width", scene.image_size.width, "of the images, pixels")
      ->capture_default_str();
  command->add_option("--height", scene.image_size.height, "of the images, pixels")
      ->capture_default_str();
  command->add_flag("--overwrite", options->overwrite, "replace an earlier sequence in FOLDER");
  command->footer("example: dynfilter synth scene --frames 90 --seed 1");
  command->callback([options] { synthesise(*options); });
}

}  // namespace dynfilter::tools
