// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/host_masks.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "frame_source.hpp"
#include "inputs.hpp"
#include "io/file_error.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "mask_feed.hpp"
#include "number_options.hpp"
#include "progress_bar.hpp"
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

fs::path image_path(const RgbdSequence& sequence, std::size_t i) {
  return fs::absolute(sequence.entry(i).image_path).lexically_normal();
}

/// Returns the segmentation with the masks of dynamic objects corrected by depth, as the rule depth
/// judges pixels.
Segmentation refined(const FrameView& frame, const Segmentation& masks, const MaskCuller& culler) {
  const DepthCompensator rule;
  Segmentation refined = masks;
  for (std::size_t k = 0; k < masks.instances.size(); ++k) {
    if (!culler.is_dynamic(masks.instances[k].class_id)) continue;
    refined.instances[k] = rule.refined(frame, masks, k);
  }
  return refined;
}

constexpr const char* labels_format = "labels";

struct MasksOptions {
  fs::path sequence, camera, masks, out;
  std::optional<double> depth_offset_s;
  std::string format = labels_format;
  bool refines = false;  // let the rule depth correct the masks first
  MaskCullerOptions mask_culler;
  SegmenterSpec segmenter;
  bool overwrite = false;
};

/// Returns the deepest folder that holds all images; the masks have the images' paths below it.
fs::path image_folder_of(const RgbdSequence& sequence) {
  fs::path folder = image_path(sequence, 0).parent_path();
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    folder = common_path(folder, image_path(sequence, i).parent_path());
  }
  return folder;
}

/// Returns the names of the mask images, by the index of their frames: "colmap" adds .png to the
/// image's whole name, the others put it in place of the extension. Refuses equal names.
std::vector<fs::path> mask_names(const RgbdSequence& sequence, const fs::path& image_folder,
                                 const std::string& format) {
  std::vector<fs::path> names;
  std::set<fs::path> used;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    fs::path name = image_path(sequence, i).lexically_relative(image_folder);
    if (format != "colmap") name.replace_extension();
    name += ".png";
    if (!used.insert(name).second) {
      detail::throw_file_error(
          sequence.entry(i).image_path,
          "the mask of another image would have the same name, " + name.string());
    }
    names.push_back(std::move(name));
  }
  return names;
}

/// Prints the files below the images' folder that look like images and are no frames.
void print_images_without_frame(const RgbdSequence& sequence, const fs::path& image_folder) {
  std::set<fs::path> images, extensions, others;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const fs::path image = image_path(sequence, i);
    images.insert(image);
    extensions.insert(image.extension());
  }
  constexpr auto options = fs::directory_options::skip_permission_denied;
  for (const auto& entry : fs::recursive_directory_iterator(image_folder, options)) {
    const bool looks_like_one = extensions.count(entry.path().extension()) > 0;
    if (!looks_like_one || images.count(entry.path()) > 0) continue;
    others.insert(entry.path().lexically_relative(image_folder));
  }
  if (others.empty()) return;
  std::printf("%zu other images are there without a mask: they are no frames of the sequence\n",
              others.size());
  for (const fs::path& image : others) std::printf("  %s\n", image.c_str());
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

/// Returns the masks of frame i. An error says that nothing of the frames before it is there.
Segmentation masks_of(Segmenter& source, const FrameView& frame, std::size_t i, std::size_t size) {
  try {
    return source.segment(frame);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(detail::concatenate(error.what(), " (nothing was written; ", i, " of ",
                                                 size, " frames had masks)"));
  }
}

/// Writes label maps with an instances.csv.
void write_label_maps(const MasksOptions& options, const RgbdSequence& sequence,
                      const Inputs& inputs) {
  inputs.require_harmless(options.out, "masks", options.overwrite);
  const std::unique_ptr<Segmenter> segmenter = options.segmenter.make();
  MaskFolderWriterOptions writer_options;
  writer_options.overwrite = options.overwrite;
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
  auto masks = std::make_unique<MaskFolderSegmenter>(*folder);
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (masks->has_mask(sequence.entry(i).timestamp_s)) continue;
    detail::throw_file_error(*folder / (sequence.entry(i).stem + ".png"), "there is no such mask");
  }
  return masks;
}

/// Writes a mask image beside each image, for other systems.
void write_mask_images(const MasksOptions& options, const RgbdSequence& sequence, Inputs inputs) {
  if (options.refines && !sequence.has_depth()) {
    detail::throw_file_error(sequence.folder(), "has no depth, which --refine needs");
  }
  const fs::path image_folder = image_folder_of(sequence);
  const std::vector<fs::path> names = mask_names(sequence, image_folder, options.format);
  const MaskCuller culler(options.mask_culler);
  inputs.add_folder(image_folder);  // where masks would be taken for images
  inputs.require_harmless(options.out, "masks", options.overwrite);
  const std::unique_ptr<Segmenter> source = make_source(options, sequence);
  detail::StagedFolder staged(options.out, "masks", options.overwrite);
  {
    ProgressBar progress("masking", sequence.size());
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const FrameView frame = sequence.read(i);
      Segmentation masks = masks_of(*source, frame, i, sequence.size());
      if (options.refines) masks = refined(frame, masks, culler);
      const fs::path file = staged.path() / names[i];
      fs::create_directories(file.parent_path());
      detail::write_image(file, options.format == "dynamic" ? mask_of_dynamic_pixels(masks, culler)
                                                            : mask_of_static_pixels(masks, culler));
      progress.advance();
    }
  }
  staged.commit();
  std::printf("%zu masks of the images in %s, written to %s\n", sequence.size(),
              image_folder.c_str(), options.out.c_str());
  print_images_without_frame(sequence, image_folder);
  if (options.format != "colmap") return;
  std::printf("colmap feature_extractor --image_path %s --ImageReader.mask_path %s …\n",
              image_folder.c_str(), options.out.c_str());
}

void make_masks(const MasksOptions& options) {
  const RgbdSequence sequence(options.sequence, {0.02, options.camera, options.depth_offset_s});
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
      "for COLMAP and other systems, of a segmenter's masks or of the sequence's own.");
  command->add_option("SEQUENCE", options->sequence, "folder of the sequence")->required();
  command->add_option("--out", options->out, "folder for the masks")->required();
  command->add_option("--format", options->format, "what to write, see below")
      ->check(CLI::IsMember({labels_format, "colmap", "static", "dynamic"}))
      ->capture_default_str();
  std::vector<const CLI::Option*> of_images;  // options that suit mask images only
  of_images.push_back(command->add_option(
      "--masks", options->masks, "folder of the masks to write as images [SEQUENCE/masks]"));
  of_images.push_back(command->add_flag(
      "--refine", options->refines,
      "correct the masks by depth first, pixel by pixel, as the rule depth judges features"));
  of_images.push_back(command
                          ->add_option("--margin", options->mask_culler.margin_px,
                                       "grow the masks of dynamic objects by this much, pixels")
                          ->check(real_number(0, 1e6))
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
      "All but labels have one channel of 8 bits and the image's size.\n\n"
      "examples:\n"
      "  dynfilter masks rgbd_dataset_freiburg3_walking_xyz --remote /run/user/1000/masks\n"
      "           --out rgbd_dataset_freiburg3_walking_xyz/masks\n"
      "  dynfilter masks scene --format colmap --refine --margin 4 --out colmap_masks");
  command->callback([options, of_images] {
    const bool is_labels = options->format == labels_format;
    if (is_labels && options->segmenter.is_unset()) {
      throw CLI::RequiredError("a segmenter, " + segmenter_options() + ",");
    }
    for (const CLI::Option* option : of_images) {
      if (!is_labels || option->empty()) continue;
      throw CLI::ValidationError(option->get_name() + " needs --format colmap, static or dynamic");
    }
    if (!options->masks.empty() && !options->segmenter.is_unset()) {
      throw CLI::ValidationError("--masks and a segmenter: want one source of masks");
    }
    make_masks(*options);
  });
}

}  // namespace dynfilter::tools
