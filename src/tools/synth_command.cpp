// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "commands.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/evaluation/rgbd_sequence_writer.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "lab/scenes/synthetic_scene.hpp"
#include "number_options.hpp"
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
  detail::StagedFolder staged(options.folder, "synth", options.overwrite);
  RgbdSequenceWriter sequence(staged.path(), scene.camera());
  MaskFolderWriter masks(staged.path() / "masks");
  MaskFolderWriter true_masks(staged.path() / "masks_true");
  const std::filesystem::path moving = staged.path() / "masks_moving";
  std::filesystem::create_directories(moving);
  {
    ProgressBar progress("rendering", static_cast<std::size_t>(scene.size()));
    for (int i = 0; i < scene.size(); ++i) {
      const SyntheticFrame rendered = scene.render(i);
      sequence.add(rendered.frame, rendered.pose.rotation, rendered.pose.translation);
      masks.add(rendered.poor_segmentation, detail::time_text(rendered.frame.timestamp_s),
                rendered.frame.timestamp_s);
      true_masks.add(rendered.true_segmentation);
      detail::write_image(moving / (detail::time_text(rendered.frame.timestamp_s) + ".png"),
                          rendered.moving_mask);
      progress.advance();
    }
  }
  sequence.finish();
  masks.finish();
  true_masks.finish();
  staged.commit();
  std::printf("%d frames of %dx%d in %s\n", scene.size(), options.scene.image_size.width,
              options.scene.image_size.height, options.folder.c_str());
}

std::string level_list() {
  std::string text = "levels:";
  for (const SceneLevel& level : scene_levels()) {
    text += "\n  " + level.name +
            std::string(16 - std::min<std::size_t>(level.name.size(), 15), ' ') + level.description;
  }
  return text;
}

/// Options that a level sets and that the command line overrides.
struct Given {
  std::string level;
  std::uint64_t seed = 1;
  std::optional<int> frames, persons, width, height;
};

SyntheticSceneOptions scene_options(const Given& given) {
  SyntheticSceneOptions scene =
      given.level.empty() ? SyntheticSceneOptions{} : scene_level(given.level);
  scene.seed = given.seed;
  scene.frames = given.frames.value_or(scene.frames);
  scene.persons = given.persons.value_or(scene.persons);
  scene.image_size.width = given.width.value_or(scene.image_size.width);
  scene.image_size.height = given.height.value_or(scene.image_size.height);
  return scene;
}

}  // namespace

void add_synth_command(CLI::App& program) {
  const auto options = std::make_shared<SynthOptions>();
  const auto given = std::make_shared<Given>();
  CLI::App* command = program.add_subcommand(
      "synth",
      "Render a sequence with known truth: a room, a moving camera, walking persons.\n"
      "Write rgb/, depth/, their lists, groundtruth.txt, camera.yaml, the poor masks of a\n"
      "simulated network (masks/), the exact masks (masks_true/), and the pixels that move in\n"
      "each frame (masks_moving/).");
  command->add_option("FOLDER", options->folder, "folder for the sequence")->required();
  command->add_option("--level", given->level, "a level of the list below [a scene of 90 frames]")
      ->type_name("LEVEL");
  command->add_option("--seed", given->seed, "another seed is another scene")
      ->transform(whole_number(0, std::numeric_limits<std::uint64_t>::max()))
      ->capture_default_str();
  command->add_option("--frames", given->frames, "number of frames [90, or 300 for a level]")
      ->transform(whole_number(1, 1000000));
  command->add_option("--persons", given->persons, "number of persons, 0 to 8")
      ->transform(whole_number(0, 8));
  command->add_option("--width", given->width, "width of the images, pixels [640]")
      ->transform(whole_number(16, 8192));
  command->add_option("--height", given->height, "height of the images, pixels [480]")
      ->transform(whole_number(16, 8192));
  command->add_flag("--overwrite", options->overwrite,
                    "replace an earlier scene in FOLDER when the new one is complete");
  command->footer(
      "example: dynfilter synth scene --frames 90 --seed 1\n"
      "         dynfilter synth medium_5 --level medium --seed 5\n" +
      level_list());
  command->callback([options, given] {
    options->scene = scene_options(*given);
    synthesise(*options);
  });
}

}  // namespace dynfilter::tools
