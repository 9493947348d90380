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
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "frame_source.hpp"
#include "inputs.hpp"
#include "io/file_error.hpp"
#include "io/frame_names.hpp"
#include "io/image_file.hpp"
#include "io/staged_folder.hpp"
#include "progress_bar.hpp"
#include "rule_run.hpp"
#include "shared_options.hpp"
#include "source_checks.hpp"
#include "still_objects.hpp"

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
  bool refines = false;                 // let the rule depth correct the masks first
  bool keeps_still = false;             // leave out objects that stand still
  std::string missing_masks = "error";  // or keep: images without a mask show nobody

  bool writes_depth() const { return format == "depth"; }
  bool uses_depth() const { return refines || keeps_still; }
  MaskCullerOptions mask_culler;
  SegmenterSpec segmenter;
  bool overwrite = false;
};

/// Returns the folder below which the results have the images' paths: a plain folder of images
/// itself, or else, as other things lie beside the images, the first one inside that holds them
/// all.
fs::path image_folder_of(const RgbdSequence& sequence, bool of_depth) {
  fs::path folder = image_path(sequence, 0, of_depth).parent_path();
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    folder = common_path(folder, image_path(sequence, i, of_depth).parent_path());
  }
  const fs::path base = fs::absolute(sequence.folder() / "").lexically_normal().parent_path();
  const auto has_any = [&](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(),
                       [&](const char* name) { return fs::exists(base / name); });
  };
  const fs::path inside = folder.lexically_relative(base);
  const bool is_outside = inside.empty() || *inside.begin() == "..";
  if (is_outside || has_any({"mav0", "cam0", "data.csv", "times.txt"})) return folder;
  const bool is_plain = !has_any({"associations.txt", "rgb.txt", "depth"}) || inside == ".";
  return is_plain ? base : base / *inside.begin();
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
  MaskChecks checks(sequence.camera(), options.mask_culler, false, false);
  std::size_t instances = 0;
  {
    ProgressBar progress("segmenting", sequence.size());
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const FrameView frame = sequence.read(i);
      const Segmentation masks = masks_of(*segmenter, frame, i, sequence.size());
      checks.add({"", frame, sequence.entry(i).depth_timestamp_s, masks, {}, {}, 0});
      writer.add(masks, sequence.entry(i).stem, frame.timestamp_s);
      instances += masks.instances.size();
      progress.advance();
    }
  }
  writer.finish();
  checks.print({});
  std::printf("%zu instances in %zu frames, written to %s\n", instances, sequence.size(),
              options.out.c_str());
}

/// Where the masks of frames come from.
struct MaskSource {
  std::unique_ptr<Segmenter> segmenter;
  std::vector<int> values;        // of masks without a table
  std::set<std::size_t> missing;  // frames without a mask
};

/// Returns the segmenter, or else the sequence's masks or those of --masks. Throws
/// std::runtime_error without any, and for frames without a mask unless they may be missing.
MaskSource make_source(const MasksOptions& options, const RgbdSequence& sequence) {
  if (!options.segmenter.is_unset()) return {options.segmenter.make(), {}, {}};
  const auto folder = masks_folder_of(options, sequence);
  if (!folder) {
    detail::throw_file_error(sequence.folder() / "masks",
                             "there is no such folder; name masks (--masks) or a segmenter");
  }
  MaskFolderOptions folder_options = mask_options(sequence);
  folder_options.allow_missing = options.missing_masks == "keep";
  auto masks = std::make_unique<MaskFolderSegmenter>(*folder, folder_options);
  std::set<std::size_t> missing;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (!masks->has_mask(sequence.entry(i).timestamp_s)) missing.insert(i);
  }
  if (!missing.empty() && !folder_options.allow_missing) {
    detail::throw_file_error(
        *folder / (sequence.entry(*missing.begin()).stem + ".png"),
        detail::concatenate("there is no such mask; ", missing.size(), " of ", sequence.size(),
                            " images have none: make them, or let these images show nobody by "
                            "--missing-masks keep"));
  }
  std::vector<int> values = masks->values();
  return {std::move(masks), std::move(values), std::move(missing)};
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

/// Throws std::runtime_error if an option needs the depth that a sequence lacks.
void require_depth(const MasksOptions& options, const RgbdSequence& sequence) {
  const bool needs_depth = options.uses_depth() || options.writes_depth();
  if (sequence.has_depth() || !needs_depth) return;
  const std::string option = options.refines       ? "--refine"
                             : options.keeps_still ? "--motion"
                                                   : "--format depth";
  detail::throw_file_error(sequence.folder(), "has no depth, which " + option + " needs");
}

/// Quotes a path for a shell.
std::string shell_word(const fs::path& path) {
  std::string text;
  for (const char c : path.string()) text += c == '\'' ? "'\\''" : std::string(1, c);
  return "'" + text + "'";
}

/// Prints the call that reads the masks. COLMAP uses an image without a mask whole, silently.
void print_colmap(const fs::path& images, std::size_t masks, const fs::path& out) {
  std::size_t all = 0;
  for (const auto& entry : fs::recursive_directory_iterator(images)) {
    all += entry.is_regular_file() && detail::is_image_name(entry.path()) ? 1 : 0;
  }
  if (all > masks) {
    std::fprintf(stderr,
                 "%zu further images in %s are no frames of the sequence and have no mask, so that "
                 "COLMAP uses them whole: move them away, or name the others by "
                 "--image_list_path\n",
                 all - masks, images.c_str());
  }
  const fs::path folder = detail::canonical_folder(out);
  std::printf(
      "colmap feature_extractor --database_path %s --image_path %s --ImageReader.mask_path %s\n",
      shell_word(folder.string() + ".db").c_str(), shell_word(images).c_str(),
      shell_word(folder).c_str());
}

/// Says what was written for how many images, and for which of them nothing was known.
void print_written(const MasksOptions& options, std::size_t images, std::size_t with_depth,
                   std::size_t without_mask, const fs::path& image_folder) {
  std::printf("%zu %s the images in %s, written to %s\n", images,
              options.writes_depth() ? "times depth with holes, of" : "masks of",
              image_folder.c_str(), options.out.c_str());
  if (options.uses_depth() && with_depth < images) {
    std::printf("%zu of %zu %s; %zu without depth have the masks as they are\n", with_depth, images,
                options.refines ? "refined" : "judged by motion", images - with_depth);
  }
  if (without_mask > 0) {
    std::printf("%zu of %zu images have no mask, and show nobody (--missing-masks keep)\n",
                without_mask, images);
  }
  if (options.format == "colmap") print_colmap(image_folder, images, options.out);
}

/// Writes a mask image for each image, or its depth with holes, for other systems.
void write_mask_images(const MasksOptions& options, const RgbdSequence& sequence, Inputs inputs) {
  require_depth(options, sequence);
  const fs::path image_folder = image_folder_of(sequence, options.writes_depth());
  const std::vector<fs::path> names = mask_names(sequence, image_folder, options.format);
  const MaskCuller culler(options.mask_culler);
  inputs.add_folder(image_folder);  // where masks would be taken for images
  inputs.require_harmless(options.out, "masks", options.overwrite);
  const MaskSource source = make_source(options, sequence);
  std::optional<StillObjects> still;
  if (options.keeps_still) still.emplace(sequence.camera(), options.mask_culler);
  MaskChecks checks(sequence.camera(), options.mask_culler, options.uses_depth(), !options.refines);
  std::size_t with_depth = 0;
  detail::StagedFolder staged(options.out, "masks", options.overwrite);
  {
    ProgressBar progress("masking", sequence.size());
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const FrameView frame = sequence.read(i);
      std::optional<Segmentation> known;
      if (source.missing.count(i) == 0) {
        known = masks_of(*source.segmenter, frame, i, sequence.size());
      }
      checks.add({"", frame, sequence.entry(i).depth_timestamp_s, known, {}, {}, 0});
      Segmentation masks =
          known.value_or(Segmentation{i, frame.timestamp_s, frame.image.size(), {}});
      with_depth += frame.depth.empty() ? 0 : 1;
      if (still) still->leave_out(frame, masks);
      if (options.refines) masks = refined_or_whole(frame, masks, culler);
      const fs::path file = staged.path() / names[i];
      fs::create_directories(file.parent_path());
      detail::write_image(file, result_of(options, frame, masks, culler));
      progress.advance();
    }
  }
  checks.require_outlines();
  staged.commit();
  checks.print(source.values);
  print_written(options, sequence.size(), with_depth, source.missing.size(), image_folder);
}

void make_masks(const MasksOptions& options) {
  const RgbdSequence sequence(options.sequence, {0.02, options.camera, options.depth_offset_s,
                                                 options.uses_depth(), !options.writes_depth()});
  if (!sequence.note().empty()) std::fprintf(stderr, "%s\n", sequence.note().c_str());
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
  of_images.push_back(
      command
          ->add_option("--missing-masks", options->missing_masks,
                       "of images without a mask: error; or keep, so that they show nobody")
          ->check(CLI::IsMember({"error", "keep"}))
          ->capture_default_str());
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
