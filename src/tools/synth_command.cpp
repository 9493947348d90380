// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "frame_source.hpp"
#include "io/file_writing.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "lab/scenes/synthetic_scene.hpp"
#include "progress_bar.hpp"
#include "shared_options.hpp"

namespace dynfilter::tools {
namespace {

struct SynthOptions {
  std::filesystem::path folder;
  bool overwrite = false;
  SceneSpec scene;
  std::optional<int> persons;
};

/// Returns the text of a file from which read_camera reads every number exactly. Real numbers
/// have a decimal point: ORB-SLAM3 takes one without it for an integer and stops.
std::string camera_text(const SequenceCamera& camera) {
  std::string text = "%YAML:1.0\n---\n";
  const auto add = [&](const char* key, const auto value) {
    text += std::string(key) + ": " + nlohmann::json(value).dump() + '\n';
  };
  add("Camera.fx", camera.fx);
  add("Camera.fy", camera.fy);
  add("Camera.cx", camera.cx);
  add("Camera.cy", camera.cy);
  for (const char* key : {"Camera.k1", "Camera.k2", "Camera.p1", "Camera.p2", "Camera.k3"}) {
    add(key, 0.0);  // the scene's camera has no distortion
  }
  add("Camera.width", camera.image_size.width);
  add("Camera.height", camera.image_size.height);
  add("Camera.fps", camera.frames_per_second);
  add("DepthMapFactor", camera.depth_units_per_metre);
  return text;
}

/// Returns the three lines at the head of a list: ORB-SLAM and others skip as many.
std::string heading(const char* content, const char* columns) {
  return std::string("# ") + content + "\n# written by dynfilter\n# " + columns + '\n';
}

/// Writes frames in the layout of TUM RGB-D, which RgbdSequence reads.
class SequenceFiles {
 public:
  explicit SequenceFiles(const std::filesystem::path& folder) : folder_(folder) {
    std::filesystem::create_directories(folder / "rgb");
    std::filesystem::create_directories(folder / "depth");
  }

  void add(const FrameView& frame, const Pose& pose) {
    const std::string time = detail::time_text(frame.timestamp_s);
    const std::string image = "rgb/" + time + ".png", depth = "depth/" + time + ".png";
    detail::write_image(folder_ / image, frame.image);
    detail::write_image(folder_ / depth, frame.depth);
    images_ += time + ' ' + image + '\n';
    depths_ += time + ' ' + depth + '\n';
    pairs_ += time + ' ' + image + ' ' + time + ' ' + depth + '\n';
    poses_ += detail::trajectory_row({pose, frame.timestamp_s}, "dynfilter synth") + '\n';
  }

  void write_lists(const SequenceCamera& camera) const {
    detail::write_file(folder_ / "camera.yaml", camera_text(camera));
    detail::write_file(folder_ / "rgb.txt", images_);
    detail::write_file(folder_ / "depth.txt", depths_);
    detail::write_file(folder_ / "associations.txt", pairs_);
    detail::write_file(folder_ / "groundtruth.txt", poses_);
  }

 private:
  std::filesystem::path folder_;
  std::string images_ = heading("color images", "timestamp filename");
  std::string depths_ = heading("depth maps", "timestamp filename");
  std::string pairs_;  // ORB-SLAM allows no comment in this file
  std::string poses_ = heading("ground truth trajectory", "timestamp tx ty tz qx qy qz qw");
};

void synthesise(const SynthOptions& options) {
  SyntheticSceneOptions scene_options = options.scene.level_options();
  scene_options.persons = options.persons.value_or(scene_options.persons);
  const SyntheticScene scene(scene_options);
  detail::StagedFolder staged(options.folder, "synth", options.overwrite);
  SequenceFiles sequence(staged.path());
  MaskFolderWriter masks(staged.path() / "masks");
  MaskFolderWriter true_masks(staged.path() / "masks_true");
  const std::filesystem::path moving = staged.path() / "masks_moving";
  std::filesystem::create_directories(moving);
  {
    ProgressBar progress("rendering", static_cast<std::size_t>(scene.size()));
    for (int i = 0; i < scene.size(); ++i) {
      const SyntheticFrame rendered = scene.render(i);
      sequence.add(rendered.frame, rendered.pose);
      masks.add(rendered.poor_segmentation, detail::time_text(rendered.frame.timestamp_s),
                rendered.frame.timestamp_s);
      true_masks.add(rendered.true_segmentation);
      detail::write_image(moving / (detail::time_text(rendered.frame.timestamp_s) + ".png"),
                          rendered.moving_mask);
      progress.advance();
    }
  }
  sequence.write_lists(scene.camera());
  masks.finish();
  true_masks.finish();
  staged.commit();
  std::printf("%d frames of %dx%d in %s\n", scene.size(), scene_options.image_size.width,
              scene_options.image_size.height, options.folder.c_str());
}

std::string level_list() {
  std::string text = "levels:";
  for (const SceneLevel& level : scene_levels()) {
    text += "\n  " + level.name + std::string(16 - level.name.size(), ' ') + level.description;
  }
  return text;
}

}  // namespace

void add_synth_command(CLI::App& program) {
  const auto options = std::make_shared<SynthOptions>();
  CLI::App* command = program.add_subcommand(
      "synth",
      "Render a sequence with known truth: a room, a moving camera, walking persons.\n"
      "Write rgb/, depth/, their lists, groundtruth.txt, camera.yaml, the poor masks of a\n"
      "simulated network (masks/), the exact masks (masks_true/), and the pixels that move in\n"
      "each frame (masks_moving/).");
  command->add_option("FOLDER", options->folder, "folder for the sequence")->required();
  command
      ->add_option("--level", options->scene.level,
                   "a level of the list below [a scene of 90 frames]")
      ->type_name("LEVEL");
  command->add_option("--seed", options->scene.level_seed, "another seed is another scene")
      ->check(CLI::Range(0, 999999999))
      ->capture_default_str();
  add_level_size_options(*command, options->scene);
  command->add_option("--persons", options->persons, "number of persons, 0 to 8")
      ->check(CLI::Range(0, 8));
  command->add_flag("--overwrite", options->overwrite,
                    "replace an earlier scene in FOLDER when the new one is complete");
  command->footer(
      "example: dynfilter synth scene --frames 90 --seed 1\n"
      "         dynfilter synth medium_5 --level medium --seed 5\n" +
      level_list());
  command->callback([options] { synthesise(*options); });
}

}  // namespace dynfilter::tools
