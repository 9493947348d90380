// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/host_masks.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/mask_refiner.hpp"
#include "dynfilter/motion/motion_filter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "frame_source.hpp"
#include "inputs.hpp"
#include "io/file_error.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "progress_bar.hpp"
#include "rule_run.hpp"
#include "shared_options.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;

/// Returns the beginning that two paths share.
fs::path common_path(const fs::path& a, const fs::path& b) {
  fs::path common;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end() && *i == *j; ++i, ++j) {
    common /= *i;
  }
  return common;
}

/// Returns the path of a frame's image, or of its depth.
fs::path image_path(const RgbdSequence& sequence, std::size_t i, bool of_depth = false) {
  const RgbdSequenceEntry& entry = sequence.entry(i);
  return fs::absolute(of_depth ? entry.depth_path : entry.image_path).lexically_normal();
}

constexpr const char* labels_format = "labels";

struct MasksOptions {
  fs::path sequence, camera, masks, out;
  std::optional<double> depth_offset_s;
  std::string format = labels_format;
  bool refines = false;      // let the rule depth correct the masks first
  bool keeps_still = false;  // leave out objects that stand still

  bool writes_depth() const { return format == "depth"; }
  MaskCullerOptions mask_culler;
  SegmenterSpec segmenter;
  bool overwrite = false;
};

/// Returns the deepest folder that holds all images; the results have the images' paths below it.
fs::path image_folder_of(const RgbdSequence& sequence, bool of_depth) {
  fs::path folder = image_path(sequence, 0, of_depth).parent_path();
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    folder = common_path(folder, image_path(sequence, i, of_depth).parent_path());
  }
  return folder;
}

/// Returns the names of the mask images, by the index of their frames: "colmap" adds .png to the
/// image's whole name, "depth" keeps the names of the depth images, the others put .png in place of
/// the extension. Refuses equal names.
std::vector<fs::path> mask_names(const RgbdSequence& sequence, const fs::path& image_folder,
                                 const std::string& format) {
  std::vector<fs::path> names;
  std::set<fs::path> used;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const bool is_depth = format == "depth";
    fs::path name = image_path(sequence, i, is_depth).lexically_relative(image_folder);
    if (!is_depth && format != "colmap") name.replace_extension();
    if (!is_depth) name += ".png";
    if (!used.insert(name).second && !is_depth) {
      detail::throw_file_error(
          sequence.entry(i).image_path,
          "the mask of another image would have the same name, " + name.string());
    }
    names.push_back(std::move(name));
  }
  return names;
}

/// Returns the folder that masks are read from; none if a segmenter makes them.
std::optional<fs::path> masks_folder_of(const MasksOptions& options, const RgbdSequence& sequence) {
  if (!options.segmenter.is_unset()) return {};
  return options.masks.empty() ? sequence.masks_folder() : options.masks;
}

Inputs inputs_of(const MasksOptions& options, const RgbdSequence& sequence) {
  Inputs inputs;
  add_sequence_inputs(sequence, inputs);
  inputs.add(options.camera);
  inputs.add(options.segmenter.model);
  if (const auto folder = masks_folder_of(options, sequence)) inputs.add_folder(*folder);
  return inputs;
}

/// Writes label maps with an instances.csv.
void write_label_maps(const MasksOptions& options, const RgbdSequence& sequence,
                      const Inputs& inputs) {
  inputs.require_harmless(options.out, "masks", options.overwrite);
  const std::unique_ptr<Segmenter> segmenter = options.segmenter.make();
  MaskFolderWriterOptions writer_options;
  writer_options.overwrite = options.overwrite;
  writer_options.any_names = true;
  MaskFolderWriter writer(options.out, writer_options);
  std::size_t instances = 0;
  {
    ProgressBar progress("segmenting", sequence.size());
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const FrameView frame = sequence.read(i);
      const Segmentation masks = masks_of(*segmenter, frame, i, sequence.size());
      writer.add(masks, sequence.entry(i).stem, frame.timestamp_s);
      instances += masks.instances.size();
      progress.advance();
    }
  }
  writer.finish();
  std::printf("%zu instances in %zu frames, written to %s\n", instances, sequence.size(),
              options.out.c_str());
}

/// Returns the segmenter, or else the sequence's masks or those of --masks. Throws
/// std::runtime_error without any, and for a frame without a mask.
std::unique_ptr<Segmenter> make_source(const MasksOptions& options, const RgbdSequence& sequence) {
  if (!options.segmenter.is_unset()) return options.segmenter.make();
  const auto folder = masks_folder_of(options, sequence);
  if (!folder) {
    detail::throw_file_error(sequence.folder() / "masks",
                             "there is no such folder; name masks (--masks) or a segmenter");
  }
  auto masks = std::make_unique<MaskFolderSegmenter>(*folder, mask_options(sequence));
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (masks->has_mask(sequence.entry(i).timestamp_s)) continue;
    detail::throw_file_error(*folder / (sequence.entry(i).stem + ".png"), "there is no such mask");
  }
  return masks;
}

/// Leaves out the objects that stand still, by the motion of ORB features.
class StillObjects {
 public:
  StillObjects(const Camera& camera, const MaskCullerOptions& mask_culler)
      : filter_(camera, options_of(mask_culler)) {}

  /// Takes every frame, in order.
  void leave_out(const FrameView& frame, Segmentation& masks) {
    const ExtractedFeatures features = extract_features(extractor_, frame.image);
    filter_.apply(frame, masks, features.keypoints, labels_, workspace_);
    const auto& verdicts = labels_.statistics().instances;
    std::size_t k = 0;
    const auto is_still = [&](const Instance&) {
      return verdicts[k++].verdict == InstanceVerdict::still;
    };
    auto& instances = masks.instances;
    std::vector<Instance> rest;
    std::remove_copy_if(instances.begin(), instances.end(), std::back_inserter(rest), is_still);
    instances = std::move(rest);
  }

 private:
  static MotionFilterOptions options_of(const MaskCullerOptions& mask_culler) {
    MotionFilterOptions options;
    options.filter.mask_culler = mask_culler;
    return options;
  }

  odometry::OrbExtractor extractor_{1000};
  MotionFilter filter_;
  FeatureLabels labels_;
  Workspace workspace_;
};

/// Returns what the format wants of a frame.
cv::Mat result_of(const MasksOptions& options, const FrameView& frame, const Segmentation& masks,
                  const MaskCuller& culler) {
  if (options.writes_depth()) return depth_with_holes(frame.depth, masks, culler);
  return options.format == "dynamic" ? mask_of_dynamic_pixels(masks, culler)
                                     : mask_of_static_pixels(masks, culler);
}

/// Writes a mask image for each image, or its depth with holes, for other systems.
void write_mask_images(const MasksOptions& options, const RgbdSequence& sequence, Inputs inputs) {
  const auto need_depth = [&](bool is_needed, const char* option) {
    if (!is_needed || sequence.has_depth()) return;
    detail::throw_file_error(sequence.folder(),
                             std::string("has no depth, which ") + option + " needs");
  };
  need_depth(options.refines, "--refine");
  need_depth(options.keeps_still, "--motion");
  need_depth(options.writes_depth(), "--format depth");
  const fs::path image_folder = image_folder_of(sequence, options.writes_depth());
  const std::vector<fs::path> names = mask_names(sequence, image_folder, options.format);
  const MaskCuller culler(options.mask_culler);
  inputs.add_folder(image_folder);  // where masks would be taken for images
  inputs.require_harmless(options.out, "masks", options.overwrite);
  const std::unique_ptr<Segmenter> source = make_source(options, sequence);
  std::optional<StillObjects> still;
  if (options.keeps_still) still.emplace(sequence.camera(), options.mask_culler);
  detail::StagedFolder staged(options.out, "masks", options.overwrite);
  {
    ProgressBar progress("masking", sequence.size());
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const FrameView frame = sequence.read(i);
      Segmentation masks = masks_of(*source, frame, i, sequence.size());
      if (still) still->leave_out(frame, masks);
      if (options.refines) masks = refined(frame, masks, culler);
      const fs::path file = staged.path() / names[i];
      fs::create_directories(file.parent_path());
      detail::write_image(file, result_of(options, frame, masks, culler));
      progress.advance();
    }
  }
  staged.commit();
  std::printf("%zu %s the images in %s, written to %s\n", sequence.size(),
              options.writes_depth() ? "times depth with holes, of" : "masks of",
              image_folder.c_str(), options.out.c_str());
  if (options.format != "colmap") return;
  std::printf("colmap feature_extractor --image_path %s --ImageReader.mask_path %s …\n",
              image_folder.c_str(), options.out.c_str());
}

void make_masks(const MasksOptions& options) {
  const bool needs_camera = options.refines || options.keeps_still;
  const RgbdSequence sequence(options.sequence,
                              {0.02, options.camera, options.depth_offset_s, needs_camera});
  const Inputs inputs = inputs_of(options, sequence);
  if (options.format == labels_format) {
    write_label_maps(options, sequence, inputs);
  } else {
    write_mask_images(options, sequence, inputs);
  }
}

}  // namespace

void add_masks_command(CLI::App& program) {
  const auto options = std::make_shared<MasksOptions>();
  CLI::App* command = program.add_subcommand(
      "masks",
      "Run a segmenter over a sequence once and write its masks, label maps with an "
      "instances.csv,\n"
      "for dynfilter run --masks, for MaskFolderSegmenter and for the plugin; or write mask "
      "images\n"
      "for COLMAP and other systems, or depth without what is dynamic, of a segmenter's masks or\n"
      "of the sequence's own.");
  command
      ->add_option("SEQUENCE", options->sequence,
                   "folder of the sequence: TUM's, EuRoC's, KITTI's or just images")
      ->required();
  command->add_option("--out", options->out, "folder for the masks")->required();
  command->add_option("--format", options->format, "what to write, see below")
      ->check(CLI::IsMember({labels_format, "colmap", "static", "dynamic", "depth"}))
      ->capture_default_str();
  std::vector<const CLI::Option*> of_images;  // options that suit mask images only
  of_images.push_back(command->add_option(
      "--masks", options->masks, "folder of the masks to write as images [SEQUENCE/masks]"));
  of_images.push_back(command->add_flag(
      "--refine", options->refines,
      "correct the masks by depth first, pixel by pixel, as the rule depth judges features"));
  of_images.push_back(command->add_flag(
      "--motion", options->keeps_still,
      "leave out objects that stand still, so that they stay in the map; needs the camera"));
  of_images.push_back(command
                          ->add_option("--margin", options->mask_culler.margin_px,
                                       "grow the masks of dynamic objects by this much, pixels")
                          ->check(CLI::Range(0.0, 1e6))
                          ->capture_default_str());
  of_images.push_back(add_classes_option(*command, options->mask_culler));
  command->add_option("--camera", options->camera,
                      "camera file, or tum1, tum2, tum3 or bonn [SEQUENCE/camera.yaml]");
  add_depth_offset_option(*command, options->depth_offset_s);
  command->add_flag("--overwrite", options->overwrite,
                    "replace the masks of an earlier call when all new ones are made");
  add_segmenter_options(*command, options->segmenter);
  command->footer(
      "formats:\n"
      "  labels   label maps named by time, with an instances.csv; needs a segmenter\n"
      "  colmap   for an image a/b.png the mask a/b.png.png: 0 = take no features here, else 255\n"
      "  static   for an image a/b.png the mask a/b.png: 255 = static, 0 = dynamic\n"
      "  dynamic  the same names: 255 = dynamic, 0 = static\n"
      "  depth    the depth images, of the image's size: 0 = no depth where it is dynamic\n"
      "Masks but labels have one channel of 8 bits and the image's size. Only --refine and "
      "--motion\nneed a camera file.\n\n"
      "examples:\n"
      "  dynfilter masks rgbd_dataset_freiburg3_walking_xyz --remote /run/user/1000/masks\n"
      "           --out rgbd_dataset_freiburg3_walking_xyz/masks\n"
      "  dynfilter masks photos --model yolo11n-seg.onnx --format colmap --out colmap_masks\n"
      "  dynfilter masks scene --format depth --margin 8 --out scene/depth_static\n"
      "  dynfilter masks scene --format colmap --refine --margin 4 --out colmap_masks");
  command->callback([options, of_images] {
    const bool is_labels = options->format == labels_format;
    if (is_labels && options->segmenter.is_unset()) {
      throw CLI::RequiredError("a segmenter, --remote ADDRESS or --model FILE,");
    }
    for (const CLI::Option* option : of_images) {
      if (!is_labels || option->empty()) continue;
      throw CLI::ValidationError(option->get_name() +
                                 " needs --format colmap, static, dynamic or depth");
    }
    if (!options->masks.empty() && !options->segmenter.is_unset()) {
      throw CLI::ValidationError("--masks and a segmenter: want one source of masks");
    }
    make_masks(*options);
  });
}

}  // namespace dynfilter::tools
