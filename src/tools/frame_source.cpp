// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "frame_source.hpp"

#include <algorithm>
#include <cmath>
#include <regex>
#include <set>
#include <stdexcept>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "film.hpp"
#include "io/file_error.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "trajectory_note.hpp"

namespace dynfilter::tools {
namespace {

constexpr int erosion_px = 8;  // where no number is given
constexpr double cut_share = 0.2;
constexpr double disc_share = 0.25;
constexpr int late_frames = 3;

/// Distance beyond which features are surely static: a mask network's silhouette is off by some
/// pixels, and colour and depth of a moving person are up to 10 px apart.
constexpr double degraded_rim_px = 15;

void erode(cv::Mat& mask, int radius_px) {
  const cv::Size size(2 * radius_px + 1, 2 * radius_px + 1);
  // Pixels beyond the crop do not belong to the object.
  cv::erode(mask, mask, cv::getStructuringElement(cv::MORPH_ELLIPSE, size), {-1, -1}, 1,
            cv::BORDER_CONSTANT, cv::Scalar::all(0));
}

void cut(cv::Mat& mask) {
  const cv::Rect object = cv::boundingRect(mask);
  const int kept = static_cast<int>(std::lround((1 - cut_share) * object.height));
  mask.rowRange(object.y + kept, mask.rows).setTo(0);
}

void drop_disc(cv::Mat& mask, std::uint64_t key) {
  std::vector<cv::Point> pixels;
  cv::findNonZero(mask, pixels);
  if (pixels.empty()) return;
  cv::RNG random(key);
  const cv::Point centre =
      pixels[static_cast<std::size_t>(random.uniform(0, static_cast<int>(pixels.size())))];
  const double radius =
      std::sqrt(disc_share * static_cast<double>(pixels.size()) / 3.14159265358979);
  cv::circle(mask, centre, static_cast<int>(std::lround(radius)), cv::Scalar::all(0), cv::FILLED);
}

Segmentation degraded(Segmentation segmentation, const Degradation& degradation) {
  const std::string& how = degradation.name;
  std::uint64_t key = 1000003 * (segmentation.frame_id + 1);
  for (Instance& instance : segmentation.instances) {
    ++key;
    if (instance.mask.empty()) continue;
    instance.mask = instance.mask.clone();
    if (how == "eroded" || how == "poor") {
      erode(instance.mask, degradation.size.value_or(erosion_px));
    }
    if (how == "cut" || how == "poor") cut(instance.mask);
    if (how == "disc" || how == "poor") drop_disc(instance.mask, key);
    if (how == "boxes") {
      instance.mask = cv::Mat(instance.box.size(), CV_8UC1, cv::Scalar::all(255));
      instance.mask_origin = instance.box.tl();
    }
  }
  return segmentation;
}

/// Keeps the persons: other detections, such as chairs and monitors, are not moving objects.
Segmentation persons_of(Segmentation segmentation) {
  std::vector<Instance>& all = segmentation.instances;
  all.erase(std::remove_if(all.begin(), all.end(),
                           [](const Instance& instance) { return instance.class_id != 0; }),
            all.end());
  return segmentation;
}

/// Adds the files and folders that a sequence is read from, masks excepted.
void add_sequence_inputs(const RgbdSequence& sequence, Inputs& inputs) {
  inputs.add(sequence.folder());
  for (const auto& entry : std::filesystem::directory_iterator(sequence.folder())) {
    if (!entry.is_directory()) inputs.add(entry.path());  // lists, camera, truth
  }
  std::set<std::filesystem::path> folders;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    for (const auto& file : {sequence.entry(i).image_path, sequence.entry(i).depth_path}) {
      inputs.add(file);
      if (!file.empty()) folders.insert(file.parent_path());
    }
  }
  for (const std::filesystem::path& folder : folders) {
    // Masks and results may lie in the sequence's own folder.
    const bool is_own = std::filesystem::equivalent(folder, sequence.folder());
    if (!is_own) inputs.add_folder(folder);
  }
}

class Recording final : public FrameSource {
 public:
  Recording(const SceneSpec& spec, Truth truth)
      : spec_(spec),
        sequence_(spec.sequence, spec.reading),
        degraded_(Degradation::parse(spec.degraded)) {
    facts_.frames = sequence_.size();
    facts_.camera = sequence_.camera();
    facts_.has_depth = sequence_.has_depth();
    facts_.depth_offset_s = sequence_.depth_offset_s();
    const auto given = spec.masks.empty() ? sequence_.masks_folder() : spec.masks;
    if (given && spec.reads_masks) {
      masks_.emplace(open_masks(*given, sequence_.times_by_stem(), spec_.keeps_missing));
      masks_folder_ = *given;
      facts_.masks_name = given->string() + (spec.degraded.empty() ? "" : ", " + spec.degraded);
    }
    if (!degraded_.name.empty()) {
      if (!masks_) throw std::runtime_error("there are no masks to degrade");
      facts_.rim_px = degraded_rim_px;
    }
    add_note(sequence_.note());
    if (masks_) add_note(masks_->note);
    for (std::size_t i = 0; masks_ && i < sequence_.size(); ++i) {
      without_masks_ += masks_->has_mask(sequence_.entry(i).timestamp_s) ? 0 : 1;
    }
    if (without_masks_ > 0 && spec_.keeps_missing) {
      add_note(detail::concatenate(without_masks_, " of ", sequence_.size(),
                                   " frames have no mask, and masks remove nothing in them "
                                   "(--missing-masks keep)"));
    }
    if (sequence_.unpaired() > 0 && !spec.reading.keeps_unpaired) {
      add_note(detail::concatenate(sequence_.unpaired(), " of ",
                                   sequence_.unpaired() + sequence_.size(),
                                   " images have no depth at their time, and are left out"));
    }
    if (!spec_.is_for_masks) open_truth(truth);
  }

  SourceFrame read(std::size_t i) override {
    const RgbdSequenceEntry& entry = sequence_.entry(i);
    SourceFrame frame{entry.stem, sequence_.read(i), entry.depth_timestamp_s, {}, {}, {}, 0};
    const cv::Size size = frame.frame.image.size();
    if (image_size_.empty() || spec_.is_for_masks) image_size_ = size;
    if (size != image_size_) {
      detail::throw_file_error(entry.image_path, detail::size_name(size) +
                                                     " pixels, but earlier images have " +
                                                     detail::size_name(image_size_));
    }
    if (masks_) frame.masks = masks_->of(frame.frame);
    if (true_masks_) frame.true_masks = true_masks_->segment(frame.frame);
    if (frame.masks && !degraded_.name.empty()) degrade(frame, i);
    if (moving_masks_) frame.moving_masks = moving_masks_->segment(frame.frame);
    return frame;
  }

  void require_masks(std::size_t i) const override {
    const RgbdSequenceEntry& entry = sequence_.entry(i);
    const auto require = [&](bool has_mask, const std::optional<std::filesystem::path>& folder,
                             const std::string& mend = {}) {
      if (has_mask) return;
      detail::throw_file_error(*folder / (entry.stem + ".png"),
                               "there is no such mask; frame " + entry.stem + " needs it" + mend);
    };
    const double time_s = entry.timestamp_s;
    const double used_s = sequence_.entry(degraded_.name == "late" ? earlier(i) : i).timestamp_s;
    if (masks_ && !spec_.keeps_missing && !(masks_->has_mask(time_s) && masks_->has_mask(used_s))) {
      require(false, masks_folder_,
              detail::concatenate(
                  "; ", without_masks_, " of ", sequence_.size(), " frames have none: ",
                  without_masks_ == sequence_.size()
                      ? "are they another recording's, or named by another clock?"
                      : "make them, or let masks remove nothing there by --missing-masks keep"));
    }
    if (true_masks_) require(true_masks_->has_mask(time_s), sequence_.true_masks_folder());
    if (moving_masks_) require(moving_masks_->has_mask(time_s), sequence_.moving_masks_folder());
  }

  const RgbdSequence* sequence() const override { return &sequence_; }

  void add_inputs(Inputs& inputs) const override {
    add_sequence_inputs(sequence_, inputs);
    inputs.add(spec_.reading.camera_file);
    inputs.add(masks_folder_);
    inputs.add_folder(masks_folder_);
    if (spec_.is_for_masks) return;  // which may replace the sequence's own
    for (const auto& masks : {sequence_.masks_folder(), sequence_.true_masks_folder(),
                              sequence_.moving_masks_folder()}) {
      if (masks) inputs.add_folder(*masks);
    }
  }

 private:
  void add_note(const std::string& text) {
    facts_.note += (facts_.note.empty() || text.empty() ? "" : "\n") + text;
  }

  void open_truth(Truth truth) {
    if (const auto folder = sequence_.true_masks_folder()) {
      MaskFolderOptions options;
      options.frame_times = sequence_.times_by_stem();
      true_masks_.emplace(*folder, options);
    }
    facts_.has_true_masks = true_masks_ || !degraded_.name.empty();
    if (truth == Truth::by_motion) open_moving_masks();
    if (!facts_.has_depth) add_note("no depth images, so masks act alone");
    if (const auto file = sequence_.groundtruth_file()) {
      TrajectoryFile read = read_trajectory_file(*file);
      add_note(trajectory_note(*file, read.flaws));
      if (!read.has_times) return add_note(file->string() + ": has no times, and is not used");
      facts_.trajectory = std::move(read.trajectory);
    }
  }

  void open_moving_masks() {
    const auto folder = sequence_.moving_masks_folder();
    if (!folder) {
      detail::throw_file_error(sequence_.folder() / "masks_moving",
                               "there is no such folder; truth by motion needs the masks of what "
                               "moves, as dynfilter synth writes them");
    }
    MaskFolderOptions options;
    options.frame_times = sequence_.times_by_stem();
    options.box_margin_px = 0;  // the masks are exact
    moving_masks_.emplace(*folder, options);
  }

  std::size_t earlier(std::size_t i) const {
    return i - std::min(i, static_cast<std::size_t>(degraded_.size.value_or(late_frames)));
  }

  /// Makes the masks worse. The good masks of persons (class 0) serve as the truth. The same frame
  /// gets the same masks at every call.
  void degrade(SourceFrame& frame, std::size_t i) {
    frame.true_masks = persons_of(*frame.masks);
    if (degraded_.name == "late") {
      FrameView late = frame.frame;
      late.id = earlier(i);
      late.timestamp_s = sequence_.entry(earlier(i)).timestamp_s;
      frame.masks = masks_->of(late);
    } else if (degraded_.name == "missing") {
      const auto nth = static_cast<std::size_t>(*degraded_.size);
      if (i % nth == nth - 1) frame.masks->instances.clear();
    } else {
      frame.masks = degraded(std::move(*frame.masks), degraded_);
    }
  }

  SceneSpec spec_;
  std::size_t without_masks_ = 0;  // frames
  RgbdSequence sequence_;
  Degradation degraded_;
  std::optional<MaskFolderSegmenter> true_masks_, moving_masks_;
  cv::Size image_size_;  // of all images; empty before the first
};

/// Returns the last part of a path, which may end in a slash or in dots.
std::string folder_name(const std::filesystem::path& folder) {
  const auto full_path = std::filesystem::absolute(folder).lexically_normal();
  return (full_path.has_filename() ? full_path : full_path.parent_path()).filename().string();
}

class SceneSource final : public FrameSource {
 public:
  SceneSource(const SyntheticSceneOptions& options, Truth truth) : scene_(options), truth_(truth) {
    facts_.frames = static_cast<std::size_t>(scene_.size());
    facts_.camera = scene_.camera();
    facts_.masks_name = "rendered";
    facts_.trajectory.emplace();
    for (int i = 0; i < scene_.size(); ++i) {
      facts_.trajectory->push_back({scene_.pose(i), scene_.timestamp_s(i)});
    }
  }

  SourceFrame read(std::size_t i) override {
    SyntheticFrame rendered = scene_.render(static_cast<int>(i));
    const FrameView& image = rendered.frame;
    SourceFrame frame{
        detail::time_text(image.timestamp_s), image, image.timestamp_s, {}, {}, {}, 0};
    frame.masks = std::move(rendered.poor_segmentation);
    frame.true_masks = std::move(rendered.true_segmentation);
    if (truth_ == Truth::by_motion) {
      frame.moving_masks = Segmentation{image.id, image.timestamp_s, image.image.size(),
                                        instances_from_binary_mask(rendered.moving_mask)};
    }
    return frame;
  }

 private:
  SyntheticScene scene_;
  Truth truth_;
};

}  // namespace

Degradation Degradation::parse(const std::string& text) {
  static const std::regex form(
      "(|cut|disc|poor|boxes|eroded|late)|(eroded|late|missing)_(\\d{1,4})");
  std::smatch match;
  const bool is_known = std::regex_match(text, match, form);
  if (is_known && !match[2].matched) return {text, {}};
  const int size = is_known ? std::stoi(match[3]) : 0;
  if (!is_known || text == "missing_0") {
    detail::throw_misuse("degrade", text, "cut, disc, poor, boxes, eroded_8, late_3 or missing_5");
  }
  return {match[2], size};
}

SceneName SceneSpec::name() const {
  SceneName scene = {level, level + '_' + std::to_string(level_seed), {}};
  if (level.empty()) {
    scene.source = folder_name(sequence) + (degraded.empty() ? "" : '_' + degraded);
    scene.group = scene.source;
  }
  scene.name = scene.source + (features ? '_' + std::to_string(*features) : "");
  return scene;
}

SyntheticSceneOptions SceneSpec::level_options() const {
  SyntheticSceneOptions options;
  if (!level.empty()) options = scene_level(level);
  options.seed = level_seed;
  options.frames = frames.value_or(options.frames);
  options.image_size.width = width.value_or(options.image_size.width);
  options.image_size.height = height.value_or(options.image_size.height);
  return options;
}

std::unique_ptr<FrameSource> SceneSpec::open(Truth truth) const {
  if (level.empty() && is_film(sequence)) {
    if (degraded.empty() && truth == Truth::by_class) return open_film(*this);
    detail::throw_file_error(sequence, "a film has no truth; --degrade and --truth want a folder");
  }
  if (level.empty()) return std::make_unique<Recording>(*this, truth);
  return std::make_unique<SceneSource>(level_options(), truth);
}

}  // namespace dynfilter::tools
