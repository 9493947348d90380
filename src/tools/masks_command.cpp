// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/host_masks.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/mask_refiner.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "frame_source.hpp"
#include "inputs.hpp"
#include "io/file_error.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "mask_names.hpp"
#include "progress_bar.hpp"
#include "rule_run.hpp"
#include "shared_options.hpp"
#include "source_checks.hpp"
#include "still_objects.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;

struct MasksOptions {
  SceneSpec scene;
  fs::path out;
  std::string format = labels_format;
  bool refines = false;      // let the rule depth correct the masks first
  bool keeps_still = false;  // leave out objects that stand still

  bool writes_depth() const { return format == "depth"; }
  bool uses_depth() const { return refines || keeps_still; }
  MaskCullerOptions mask_culler;
  std::vector<std::string> classes;  // for its dynamic_classes
  SegmenterSpec segmenter;
  bool overwrite = false;
};

/// The frames, with the masks of a segmenter or else their own.
struct MaskedFrames {
  std::unique_ptr<FrameSource> source;
  std::unique_ptr<Segmenter> segmenter;

  SourceFrame read(std::size_t i) const {
    SourceFrame frame = source->read(i);
    if (segmenter) frame.masks = masks_of(*segmenter, frame.frame, i, source->size());
    return frame;
  }
};

/// Throws std::runtime_error if the source lacks what an option needs.
void require_suitable(const MasksOptions& options, const FrameSource& source) {
  const fs::path& name = options.scene.sequence;
  const bool needs_depth = options.uses_depth() || options.writes_depth();
  if (options.segmenter.is_unset() && source.facts().masks_name.empty()) {
    detail::throw_file_error(
        name, "has no masks: name them by --masks, or a segmenter by --model or --remote");
  }
  if (source.sequence() == nullptr && options.format == "colmap") {
    detail::throw_file_error(name,
                             "COLMAP takes images: write them, as by ffmpeg -i FILM "
                             "PHOTOS/%06d.png, and name their folder");
  }
  if (source.facts().has_depth || !needs_depth) return;
  const std::string option = options.refines       ? "--refine"
                             : options.keeps_still ? "--motion"
                                                   : "--format depth";
  detail::throw_file_error(name, "has no depth, which " + option + " needs");
}

/// Opens the frames, and refuses what would fail later.
MaskedFrames open_frames(const MasksOptions& options) {
  SceneSpec scene = options.scene;
  scene.is_for_masks = true;
  scene.reads_masks = options.segmenter.is_unset();
  scene.reading.needs_camera = options.uses_depth();
  scene.reading.keeps_unpaired = !options.writes_depth();
  MaskedFrames frames{scene.open(Truth::by_class), nullptr};
  const std::string& note = frames.source->facts().note;
  if (!note.empty()) std::fprintf(stderr, "%s\n", note.c_str());
  require_suitable(options, *frames.source);
  Inputs inputs;
  frames.source->add_inputs(inputs);
  inputs.add(options.segmenter.model);
  const RgbdSequence* const sequence = frames.source->sequence();
  if (sequence != nullptr && options.format != labels_format) {  // masks would be taken for images
    inputs.add_folder(image_folder_of(*sequence, options.writes_depth()));
  }
  inputs.require_harmless(options.out, "masks", options.overwrite);
  require_masks(*frames.source, 1);
  if (!scene.reads_masks) frames.segmenter = options.segmenter.make();
  return frames;
}

/// Writes label maps with an instances.csv.
void write_label_maps(MasksOptions options) {
  const MaskedFrames frames = open_frames(options);
  FrameSource& source = *frames.source;
  options.mask_culler.dynamic_classes = class_ids({}, frames.segmenter.get());
  std::vector<fs::path> names;  // none of a film
  if (source.sequence() != nullptr) names = mask_names(*source.sequence(), {}, labels_format);
  MaskFolderWriterOptions writer_options;
  writer_options.overwrite = options.overwrite;
  writer_options.any_names = true;
  MaskFolderWriter writer(options.out, writer_options);
  MaskChecks checks(source.facts(), options.mask_culler, false, false);
  std::size_t instances = 0, written = 0;
  {
    ProgressBar progress("segmenting", source.size());
    for (std::size_t i = 0; source.has(i); ++i) {
      SourceFrame frame = frames.read(i);
      progress.advance();
      if (!frame.masks) continue;
      writer.add(*frame.masks, i < names.size() ? names[i].stem().string() : frame.stem,
                 frame.frame.timestamp_s);
      instances += frame.masks->instances.size();
      ++written;
      checks.add(std::move(frame));
    }
  }
  writer.finish();
  checks.print(source.mask_values());
  std::printf("%zu instances in %zu frames, written to %s\n", instances, written,
              options.out.c_str());
}

/// Returns what the format wants of a frame.
cv::Mat result_of(const MasksOptions& options, const FrameView& frame, const Segmentation& masks,
                  const MaskCuller& culler) {
  if (options.writes_depth()) return depth_with_holes(frame.depth, masks, culler);
  return options.format == "dynamic" ? mask_of_dynamic_pixels(masks, culler)
                                     : mask_of_static_pixels(masks, culler);
}

/// Refines masks by depth. A box that depth tells nothing of is masked whole.
Segmentation refined_or_whole(const FrameView& frame, const Segmentation& masks,
                              const MaskCuller& culler) {
  Segmentation result = refined(frame, masks, culler);
  for (Instance& one : result.instances) {
    const cv::Rect box = one.box & cv::Rect({0, 0}, frame.image.size());
    if (!one.mask.empty() || box.empty()) continue;
    one.mask = cv::Mat(box.size(), CV_8UC1, cv::Scalar(255));
    one.mask_origin = box.tl();
  }
  return result;
}

/// Numbers of images: all, those with depth, and those that motion judged.
struct Written {
  std::size_t images = 0, with_depth = 0, judged = 0;
};

/// Says what was written for how many images, and for which of them nothing was known.
void print_written(const MasksOptions& options, const Written& count,
                   const fs::path& image_folder) {
  std::printf("%zu %s the images in %s, written to %s\n", count.images,
              options.writes_depth() ? "times depth with holes, of" : "masks of",
              image_folder.c_str(), options.out.c_str());
  const auto print_some = [&](bool is_used, std::size_t some, const char* what) {
    if (!is_used || some == count.images) return;
    std::printf("%zu of %zu %s, have the masks as they are\n", some, count.images, what);
  };
  print_some(options.refines, count.with_depth, "refined; the others, without depth");
  print_some(options.keeps_still, count.judged,
             "judged by motion; the others, without depth or pose");
  if (options.format == "colmap") print_colmap(image_folder, count.images, options.out);
}

/// Writes a mask image for each frame, or its depth with holes, for other systems.
void write_mask_images(MasksOptions options) {
  const MaskedFrames frames = open_frames(options);
  FrameSource& source = *frames.source;
  fs::path image_folder = options.scene.sequence;
  std::vector<fs::path> names;  // none of a film
  if (const RgbdSequence* const sequence = source.sequence()) {
    image_folder = image_folder_of(*sequence, options.writes_depth());
    names = mask_names(*sequence, image_folder, options.format);
  }
  options.mask_culler.dynamic_classes = class_ids(options.classes, frames.segmenter.get());
  const MaskCuller culler(options.mask_culler);
  std::optional<StillObjects> still;
  if (options.keeps_still) still.emplace(source.facts().camera, options.mask_culler);
  MaskChecks checks(source.facts(), options.mask_culler, options.uses_depth(), !options.refines);
  Written count;
  detail::StagedFolder staged(options.out, "masks", options.overwrite);
  {
    ProgressBar progress("masking", source.size());
    for (std::size_t& i = count.images; source.has(i); ++i) {
      SourceFrame read = frames.read(i);
      const FrameView frame = read.frame;
      const fs::path file =
          staged.path() / (i < names.size() ? names[i].string() : read.stem + ".png");
      Segmentation masks =
          read.masks.value_or(Segmentation{i, frame.timestamp_s, frame.image.size(), {}});
      checks.add(std::move(read));
      count.with_depth += frame.depth.empty() ? 0 : 1;
      if (still) still->leave_out(frame, masks);
      if (options.refines) masks = refined_or_whole(frame, masks, culler);
      fs::create_directories(file.parent_path());
      detail::write_image(file, result_of(options, frame, masks, culler));
      progress.advance();
    }
  }
  checks.require_outlines();
  staged.commit();
  checks.print(source.mask_values());
  if (still) count.judged = still->judged();
  print_written(options, count, image_folder);
}

constexpr char masks_description[] =
    "Run a segmenter over a sequence once and write its masks, label maps with an instances.csv,\n"
    "for dynfilter run --masks, for MaskFolderSegmenter and for the plugin; or write mask images\n"
    "for COLMAP and other systems, or depth without what is dynamic, of a segmenter's masks or\n"
    "of the sequence's own.";

constexpr char masks_notes[] =
    "formats:\n"
    "  labels   label maps named by time, with an instances.csv, of a segmenter's or other tools'\n"
    "           masks: what MaskFolderSegmenter and the plugin read\n"
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
    "  dynfilter masks scene --format colmap --refine --margin 4 --out colmap_masks";

}  // namespace

void add_masks_command(CLI::App& program) {
  const auto options = std::make_shared<MasksOptions>();
  CLI::App* command = program.add_subcommand("masks", masks_description);
  CLI::Option* sequence =
      command
          ->add_option(
              "SEQUENCE", options->scene.sequence,
              "folder of the sequence: TUM's, EuRoC's, KITTI's or just images; or a film, or a\n"
              "camera's number, for 300 frames")
          ->required();
  command->add_option("--out", options->out, "folder for the masks")->required();
  command->add_option("--format", options->format, "what to write, see below")
      ->check(CLI::IsMember({labels_format, "colmap", "static", "dynamic", "depth"}))
      ->capture_default_str();
  std::vector<const CLI::Option*> of_images;  // options that suit mask images only
  add_recording_options(*command, options->scene, sequence);
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
  of_images.push_back(add_classes_option(*command, options->classes));
  command->add_flag("--overwrite", options->overwrite,
                    "replace the masks of an earlier call when all new ones are made");
  add_segmenter_options(*command, options->segmenter);
  command->footer(masks_notes);
  command->callback([options, of_images] {
    const bool is_labels = options->format == labels_format;
    if (is_labels && options->segmenter.is_unset() && options->scene.masks.empty()) {
      throw CLI::RequiredError("a segmenter, --remote ADDRESS or --model FILE, or --masks");
    }
    for (const CLI::Option* option : of_images) {
      if (!is_labels || option->empty()) continue;
      throw CLI::ValidationError(option->get_name() +
                                 " needs --format colmap, static, dynamic or depth");
    }
    if (!options->scene.masks.empty() && !options->segmenter.is_unset()) {
      throw CLI::ValidationError("--masks and a segmenter: want one source of masks");
    }
    is_labels ? write_label_maps(*options) : write_mask_images(*options);
  });
}

}  // namespace dynfilter::tools
