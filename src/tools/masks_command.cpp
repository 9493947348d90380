// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
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
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "film.hpp"
#include "frame_source.hpp"
#include "inputs.hpp"
#include "io/file_error.hpp"
#include "io/frame_names.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "mask_names.hpp"
#include "progress_bar.hpp"
#include "recorded_masks.hpp"
#include "rule_run.hpp"
#include "shared_options.hpp"
#include "source_checks.hpp"
#include "still_objects.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* labels_format = "labels";

struct MasksOptions {
  fs::path sequence, camera, masks, out;
  std::optional<double> depth_offset_s;
  std::string format = labels_format;
  bool refines = false;        // let the rule depth correct the masks first
  bool keeps_still = false;    // leave out objects that stand still
  bool keeps_missing = false;  // images without a mask show nobody

  bool writes_depth() const { return format == "depth"; }
  bool uses_depth() const { return refines || keeps_still; }
  MaskCullerOptions mask_culler;
  std::vector<std::string> classes;  // for its dynamic_classes
  SegmenterSpec segmenter;
  bool overwrite = false;
};

/// The frames of a sequence, without its masks.
class SequenceFrames final : public FrameSource {
 public:
  explicit SequenceFrames(const RgbdSequence& sequence) : sequence_(sequence) {
    facts_.frames = sequence.size();
    facts_.camera = sequence.camera();
    facts_.has_depth = sequence.has_depth();
  }
  SourceFrame read(std::size_t i) override {
    const RgbdSequenceEntry& entry = sequence_.entry(i);
    return {entry.stem, sequence_.read(i), entry.depth_timestamp_s, {}, {}, {}, 0};
  }

 private:
  const RgbdSequence& sequence_;
};

/// Returns the folder that masks are read from; none if a segmenter makes them.
std::optional<fs::path> masks_folder_of(const MasksOptions& options, const RgbdSequence& sequence) {
  if (!options.segmenter.is_unset()) return {};
  return options.masks.empty() ? sequence.masks_folder() : options.masks;
}

/// Masks of the frames, but for those that are missing.
struct MaskSource : RecordedMasks {
  std::set<std::size_t> missing;
};

/// Returns the segmenter, or else the sequence's masks or those of --masks. Throws
/// std::runtime_error without any, and for frames without a mask unless they may be missing.
MaskSource make_source(const MasksOptions& options, const RgbdSequence* sequence) {
  MaskSource source;
  if (!options.segmenter.is_unset()) {
    source.segmenter = options.segmenter.make();
    source.values = [] { return std::vector<int>(); };
    return source;
  }
  const auto path = masks_folder_of(options, *sequence);
  if (!path) {
    detail::throw_file_error(sequence->folder() / "masks",
                             "there is no such folder; name masks (--masks) or a segmenter");
  }
  static_cast<RecordedMasks&>(source) = open_masks(*path, *sequence, options.keeps_missing);
  if (!source.note.empty()) std::fprintf(stderr, "%s\n", source.note.c_str());
  for (std::size_t i = 0; i < sequence->size(); ++i) {
    if (!source.has_mask(sequence->entry(i).timestamp_s)) source.missing.insert(i);
  }
  if (source.missing.empty() || options.keeps_missing) return source;
  detail::throw_file_error(
      *path / (sequence->entry(*source.missing.begin()).stem + ".png"),
      detail::concatenate("there is no such mask; ", source.missing.size(), " of ",
                          sequence->size(),
                          " images have none: make them, or let these images show nobody by "
                          "--missing-masks keep"));
}

/// Writes label maps with an instances.csv.
void write_label_maps(MasksOptions options, FrameSource& frames, const RgbdSequence* sequence,
                      const Inputs& inputs) {
  inputs.require_harmless(options.out, "masks", options.overwrite);
  const MaskSource source = make_source(options, sequence);
  options.mask_culler.dynamic_classes = class_ids({}, source.segmenter.get());
  MaskFolderWriterOptions writer_options;
  writer_options.overwrite = options.overwrite;
  writer_options.any_names = true;
  MaskFolderWriter writer(options.out, writer_options);
  MaskChecks checks(frames.facts().camera, options.mask_culler, false, false);
  std::size_t instances = 0, images = 0;
  {
    ProgressBar progress("segmenting", frames.size());
    for (; frames.has(images); ++images) {
      if (source.missing.count(images) > 0) continue;
      SourceFrame frame = frames.read(images);
      frame.masks = masks_of(*source.segmenter, frame.frame, images, frames.size());
      writer.add(*frame.masks, frame.stem, frame.frame.timestamp_s);
      instances += frame.masks->instances.size();
      checks.add(std::move(frame));
      progress.advance();
    }
  }
  writer.finish();
  checks.print(source.values());
  std::printf("%zu instances in %zu frames, written to %s\n", instances,
              images - source.missing.size(), options.out.c_str());
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

/// Throws std::runtime_error if an option needs the depth that a source lacks.
void require_depth(const MasksOptions& options, const FrameSource& source) {
  const bool needs_depth = options.uses_depth() || options.writes_depth();
  if (source.facts().has_depth || !needs_depth) return;
  const std::string option = options.refines       ? "--refine"
                             : options.keeps_still ? "--motion"
                                                   : "--format depth";
  detail::throw_file_error(options.sequence, "has no depth, which " + option + " needs");
}

/// Numbers of images: all, those with depth, judged by motion, without a mask, and left out.
struct Written {
  std::size_t images = 0, with_depth = 0, judged = 0, without_mask = 0, left_out = 0;
};

/// Says what was written for how many images, and for which of them nothing was known.
void print_written(const MasksOptions& options, const Written& count,
                   const fs::path& image_folder) {
  std::printf("%zu %s the images in %s, written to %s\n", count.images,
              options.writes_depth() ? "times depth with holes, of" : "masks of",
              image_folder.c_str(), options.out.c_str());
  const auto print_some = [&](bool is_said, std::size_t some, const char* what) {
    if (is_said) std::printf("%zu of %zu %s\n", some, count.images + count.left_out, what);
  };
  print_some(options.refines && count.with_depth < count.images, count.with_depth,
             "refined; the others, without depth, have the masks as they are");
  print_some(options.keeps_still && count.judged < count.images, count.judged,
             "judged by motion; the others, without depth or pose, have the masks as they are");
  print_some(count.without_mask > 0, count.without_mask,
             "images have no mask, and show nobody (--missing-masks keep)");
  print_some(count.left_out > 0, count.left_out, "images have no depth, and are left out");
  if (options.format == "colmap") print_colmap(image_folder, count.images, options.out);
}

/// Writes a mask image for each frame, or its depth with holes, for other systems. A film has no
/// sequence.
void write_mask_images(MasksOptions options, FrameSource& frames, const RgbdSequence* sequence,
                       Inputs inputs) {
  require_depth(options, frames);
  fs::path image_folder = options.sequence;
  std::vector<fs::path> names;
  if (sequence != nullptr) {
    image_folder = image_folder_of(*sequence, options.writes_depth());
    names = mask_names(*sequence, image_folder, options.format);
    inputs.add_folder(image_folder);  // where masks would be taken for images
  }
  inputs.require_harmless(options.out, "masks", options.overwrite);
  const MaskSource source = make_source(options, sequence);
  options.mask_culler.dynamic_classes = class_ids(options.classes, source.segmenter.get());
  const MaskCuller culler(options.mask_culler);
  const SequenceCamera& camera = frames.facts().camera;
  std::optional<StillObjects> still;
  if (options.keeps_still) still.emplace(camera, options.mask_culler);
  MaskChecks checks(camera, options.mask_culler, options.uses_depth(), !options.refines);
  Written count{0, 0, 0, source.missing.size(), 0};
  if (options.writes_depth()) count.left_out = sequence->unpaired();
  detail::StagedFolder staged(options.out, "masks", options.overwrite);
  {
    ProgressBar progress("masking", frames.size());
    for (std::size_t& i = count.images; frames.has(i); ++i) {
      SourceFrame read = frames.read(i);
      const FrameView frame = read.frame;
      const fs::path file =
          staged.path() / (sequence != nullptr ? names[i].string() : read.stem + ".png");
      if (source.missing.count(i) == 0) {
        read.masks = masks_of(*source.segmenter, frame, i, frames.size());
      }
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
  checks.print(source.values());
  if (still) count.judged = still->judged();
  print_written(options, count, image_folder);
}

/// Opens a film whose masks can be made.
std::unique_ptr<FrameSource> open_film(const MasksOptions& options) {
  SceneSpec scene;
  scene.sequence = options.sequence;
  scene.camera = options.camera;
  std::unique_ptr<FrameSource> film = open_film(scene);
  if (options.format == "colmap") {
    detail::throw_file_error(options.sequence,
                             "COLMAP takes images: write them, as by ffmpeg -i FILM "
                             "PHOTOS/%06d.png, and name their folder");
  }
  if (options.segmenter.is_unset()) {
    detail::throw_file_error(options.sequence, "a film's masks are made: name --model or --remote");
  }
  return film;
}

void make_masks(const MasksOptions& options) {
  std::optional<RgbdSequence> sequence;
  std::unique_ptr<FrameSource> frames;
  Inputs inputs;
  if (is_film(options.sequence)) {
    frames = open_film(options);
    frames->add_inputs(inputs);
  } else {
    const bool is_of_depth = options.writes_depth();
    sequence.emplace(options.sequence,
                     RgbdSequenceOptions{0.02, options.camera, options.depth_offset_s,
                                         options.uses_depth(), !is_of_depth});
    if (!sequence->note().empty()) std::fprintf(stderr, "%s\n", sequence->note().c_str());
    frames = std::make_unique<SequenceFrames>(*sequence);
    add_sequence_inputs(*sequence, inputs);
    if (const auto masks = masks_folder_of(options, *sequence)) {
      inputs.add(*masks);  // which may be a file
      inputs.add_folder(*masks);
    }
  }
  inputs.add(options.camera);
  inputs.add(options.segmenter.model);
  if (options.format == labels_format) {
    write_label_maps(options, *frames, sequence ? &*sequence : nullptr, inputs);
  } else {
    write_mask_images(options, *frames, sequence ? &*sequence : nullptr, inputs);
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
      ->add_option(
          "SEQUENCE", options->sequence,
          "folder of the sequence: TUM's, EuRoC's, KITTI's or just images; or a film, or a\n"
          "camera's number, for 300 frames")
      ->required();
  command->add_option("--out", options->out, "folder for the masks")->required();
  command->add_option("--format", options->format, "what to write, see below")
      ->check(CLI::IsMember({labels_format, "colmap", "static", "dynamic", "depth"}))
      ->capture_default_str();
  std::vector<const CLI::Option*> of_images;  // options that suit mask images only
  command->add_option("--masks", options->masks,
                      "masks to write: a folder, or those of other tools: COCO's .json, YOLO's "
                      ".txt, CVAT's\nor MOTS' [SEQUENCE/masks]");
  add_missing_masks_option(*command, options->keeps_missing);
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
  command->add_option("--camera", options->camera,
                      "camera file, or tum1, tum2, tum3 or bonn [SEQUENCE/camera.yaml]");
  add_depth_offset_option(*command, options->depth_offset_s);
  command->add_flag("--overwrite", options->overwrite,
                    "replace the masks of an earlier call when all new ones are made");
  add_segmenter_options(*command, options->segmenter);
  command->footer(
      "formats:\n"
      "  labels   label maps named by time, with an instances.csv, of a segmenter's or other "
      "tools'\n"
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
      "  dynfilter masks scene --format colmap --refine --margin 4 --out colmap_masks");
  command->callback([options, of_images] {
    const bool is_labels = options->format == labels_format;
    if (is_labels && options->segmenter.is_unset() && options->masks.empty()) {
      throw CLI::RequiredError("a segmenter, --remote ADDRESS or --model FILE, or --masks");
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
