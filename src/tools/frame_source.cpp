// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "frame_source.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"
#include "lab/odometry/orb_extractor.hpp"
#include "trajectory_note.hpp"

namespace dynfilter::tools {
namespace {

/// Refuses images whose names cannot name their results.
void require_plain_names(const RgbdSequence& sequence) {
  std::map<std::string, std::filesystem::path> images;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const RgbdSequenceEntry& entry = sequence.entry(i);
    if (entry.stem.find_first_of(",\"") != std::string::npos) {
      detail::throw_file_error(entry.image_path,
                               "has a comma or a quote in its name, which frames.csv cannot hold; "
                               "rename it");
    }
    const auto& image = images.emplace(entry.stem, entry.image_path).first->second;
    if (image != entry.image_path) {
      detail::throw_file_error(entry.image_path, "is called like " + image.string() +
                                                     ", and results are named by their image; "
                                                     "rename one of them");
    }
  }
}

/// Refuses an image that no ORB features can be looked for in.
void require_pyramid(const std::filesystem::path& image, cv::Size size) {
  constexpr int side = odometry::OrbExtractor::min_side_px;
  if (std::min(size.width, size.height) >= side) return;
  detail::throw_file_error(image, detail::size_name(size) +
                                      " pixels, too few to look for ORB features; want at least " +
                                      detail::size_name(cv::Size(side, side)));
}

constexpr int erosion_px = 8;
constexpr double cut_share = 0.2;
constexpr double disc_share = 0.25;
constexpr std::size_t late_frames = 3;

/// Distance beyond which features are surely static: a mask network's silhouette is off by some
/// pixels, and colour and depth of a moving person are up to 10 px apart.
constexpr double degraded_rim_px = 15;

void erode(cv::Mat& mask) {
  const cv::Size size(2 * erosion_px + 1, 2 * erosion_px + 1);
  // Pixels beyond the crop do not belong to the object.
  cv::erode(mask, mask, cv::getStructuringElement(cv::MORPH_ELLIPSE, size), {-1, -1}, 1,
            cv::BORDER_CONSTANT, cv::Scalar::all(0));
}

std::vector<cv::Point> pixels_of(const cv::Mat& mask) {
  std::vector<cv::Point> pixels;
  cv::findNonZero(mask, pixels);
  return pixels;
}

void cut(cv::Mat& mask) {
  const std::vector<cv::Point> pixels = pixels_of(mask);
  if (pixels.empty()) return;
  // The pixels come row by row.
  const int top = pixels.front().y, height = pixels.back().y + 1 - top;
  mask.rowRange(top + static_cast<int>(std::lround((1 - cut_share) * height)), mask.rows).setTo(0);
}

void drop_disc(cv::Mat& mask, std::uint64_t key) {
  const std::vector<cv::Point> pixels = pixels_of(mask);
  if (pixels.empty()) return;
  cv::RNG random(key);
  const cv::Point centre =
      pixels[static_cast<std::size_t>(random.uniform(0, static_cast<int>(pixels.size())))];
  const double radius =
      std::sqrt(disc_share * static_cast<double>(pixels.size()) / 3.14159265358979);
  cv::circle(mask, centre, static_cast<int>(std::lround(radius)), cv::Scalar::all(0), cv::FILLED);
}

Segmentation degraded(Segmentation segmentation, const std::string& how) {
  std::uint64_t key = 1000003 * (segmentation.frame_id + 1);
  for (Instance& instance : segmentation.instances) {
    ++key;
    if (instance.mask.empty()) continue;
    instance.mask = instance.mask.clone();
    if (how == "eroded" || how == "poor") erode(instance.mask);
    if (how == "cut" || how == "poor") cut(instance.mask);
    if (how == "disc" || how == "poor") drop_disc(instance.mask, key);
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

class Recording final : public FrameSource {
 public:
  explicit Recording(const SequenceSpec& spec)
      : sequence_(spec.sequence, {0.02, spec.camera, spec.depth_offset_s}),
        camera_file_(spec.camera),
        degraded_(spec.degraded) {
    const auto given = spec.masks.empty() ? sequence_.masks_folder() : spec.masks;
    if (given && spec.reads_masks) {
      masks_.emplace(*given, mask_options(sequence_));
      masks_folder_ = *given;
      masks_name_ = given->string() + (degraded_.empty() ? "" : ", " + degraded_);
    }
    if (!degraded_.empty() && !masks_) throw std::runtime_error("there are no masks to degrade");
    require_plain_names(sequence_);
    if (const auto truth = sequence_.true_masks_folder()) {
      true_masks_.emplace(*truth, mask_options(sequence_));
    }
    if (const auto truth = sequence_.groundtruth_file()) {
      TrajectoryFile file = read_trajectory_file(*truth);
      note_ = trajectory_note(*truth, file.flaws);
      true_trajectory_ = std::move(file.trajectory);
    }
  }

  std::size_t size() const override { return sequence_.size(); }
  CameraParameters camera() const override { return sequence_.camera(); }
  bool has_depth() const override { return sequence_.has_depth(); }
  double depth_offset_s() const override { return sequence_.depth_offset_s(); }
  bool has_true_masks() const override { return !degraded_.empty() || true_masks_.has_value(); }
  std::string masks_name() const override { return masks_name_; }
  double rim_px() const override { return degraded_.empty() ? exact_rim_px : degraded_rim_px; }

  void pass_moving_masks() override {
    const auto folder = sequence_.moving_masks_folder();
    if (!folder) {
      detail::throw_file_error(sequence_.folder() / "masks_moving",
                               "there is no such folder; truth by motion needs the masks of what "
                               "moves, as dynfilter synth writes them");
    }
    MaskFolderOptions options = mask_options(sequence_);
    options.box_margin_px = 0;  // the masks are exact
    moving_masks_.emplace(*folder, options);
  }

  SourceFrame read(std::size_t i) override {
    const RgbdSequenceEntry& entry = sequence_.entry(i);
    SourceFrame frame{entry.stem, sequence_.read(i), entry.depth_timestamp_s, {}, {}, {}};
    const cv::Size size = frame.frame.image.size();
    require_pyramid(entry.image_path, size);
    if (image_size_.empty()) image_size_ = size;
    if (size != image_size_) {
      detail::throw_file_error(entry.image_path, detail::size_name(size) +
                                                     " pixels, but earlier images have " +
                                                     detail::size_name(image_size_));
    }
    if (masks_) frame.masks = masks_->segment(frame.frame);
    if (true_masks_) frame.true_masks = true_masks_->segment(frame.frame);
    if (!degraded_.empty()) degrade(frame, i);
    if (moving_masks_) frame.moving_masks = moving_masks_->segment(frame.frame);
    return frame;
  }

  void require_masks(std::size_t i) const override {
    if (masks_) require_mask(*masks_, masks_folder_, i);
    if (degraded_ == "late") require_mask(*masks_, masks_folder_, earlier(i));
    if (true_masks_) require_mask(*true_masks_, *sequence_.true_masks_folder(), i);
    if (moving_masks_) require_mask(*moving_masks_, *sequence_.moving_masks_folder(), i);
  }

  std::optional<Trajectory> true_trajectory() const override { return true_trajectory_; }
  std::string note() const override { return note_; }
  std::vector<int> mask_values() const override {
    return masks_ ? masks_->values() : std::vector<int>();
  }

  void add_inputs(Inputs& inputs) const override {
    add_sequence_inputs(sequence_, inputs);
    inputs.add(camera_file_);
    inputs.add_folder(masks_folder_);
    for (const auto& masks : {sequence_.masks_folder(), sequence_.true_masks_folder(),
                              sequence_.moving_masks_folder()}) {
      if (masks) inputs.add_folder(*masks);
    }
  }

 private:
  void require_mask(const MaskFolderSegmenter& masks, const std::filesystem::path& folder,
                    std::size_t i) const {
    const RgbdSequenceEntry& entry = sequence_.entry(i);
    if (masks.has_mask(entry.timestamp_s)) return;
    detail::throw_file_error(folder / (detail::time_text(entry.timestamp_s) + ".png"),
                             "there is no such mask; frame " + entry.stem + " needs it");
  }

  static std::size_t earlier(std::size_t i) { return i - std::min(i, late_frames); }

  /// Makes the masks worse. The good masks of persons (class 0) serve as the truth. The same frame
  /// gets the same masks at every call.
  void degrade(SourceFrame& frame, std::size_t i) {
    frame.true_masks = persons_of(*frame.masks);
    if (degraded_ == "late") {
      FrameView late = frame.frame;
      late.id = earlier(i);
      late.timestamp_s = sequence_.entry(earlier(i)).timestamp_s;
      frame.masks = masks_->segment(late);
    } else {
      frame.masks = degraded(std::move(*frame.masks), degraded_);
    }
  }

  RgbdSequence sequence_;
  std::filesystem::path camera_file_, masks_folder_;  // empty if the sequence has none
  std::string degraded_;                              // how; empty: not at all
  std::string masks_name_;
  std::optional<MaskFolderSegmenter> masks_;
  std::optional<MaskFolderSegmenter> true_masks_;
  std::optional<MaskFolderSegmenter> moving_masks_;  // if they are passed
  std::optional<Trajectory> true_trajectory_;
  std::string note_;
  cv::Size image_size_;  // of all images; empty before the first
};

TimedPose timed(double timestamp_s, const CameraPose& pose) {
  TimedPose timed;
  timed.timestamp_s = timestamp_s;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      timed.rotation(row, column) = pose.rotation(row, column);
    }
    timed.translation(row) = pose.translation(row);
  }
  return timed;
}

class Rendering final : public FrameSource {
 public:
  explicit Rendering(const SyntheticSceneOptions& options) : scene_(options) {}

  std::size_t size() const override { return static_cast<std::size_t>(scene_.size()); }
  CameraParameters camera() const override { return scene_.camera(); }
  bool has_depth() const override { return true; }
  double depth_offset_s() const override { return 0; }
  bool has_true_masks() const override { return true; }
  std::string masks_name() const override { return "rendered"; }
  void require_masks(std::size_t) const override {}
  void pass_moving_masks() override { passes_moving_masks_ = true; }

  SourceFrame read(std::size_t i) override {
    SyntheticFrame rendered = scene_.render(static_cast<int>(i));
    const FrameView& image = rendered.frame;
    SourceFrame frame{detail::time_text(image.timestamp_s), image, image.timestamp_s, {}, {}, {}};
    frame.masks = std::move(rendered.poor_segmentation);
    frame.true_masks = std::move(rendered.true_segmentation);
    if (passes_moving_masks_) {
      frame.moving_masks = Segmentation{image.id, image.timestamp_s, image.image.size(),
                                        instances_from_binary_mask(rendered.moving_mask)};
    }
    return frame;
  }

  std::optional<Trajectory> true_trajectory() const override {
    Trajectory trajectory;
    for (int i = 0; i < scene_.size(); ++i) {
      trajectory.push_back(timed(scene_.timestamp_s(i), scene_.pose(i)));
    }
    return trajectory;
  }

  void add_inputs(Inputs&) const override {}

 private:
  SyntheticScene scene_;
  bool passes_moving_masks_ = false;
};

}  // namespace

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

std::vector<std::string> degradation_names() { return {"eroded", "cut", "disc", "poor", "late"}; }

std::unique_ptr<FrameSource> open_sequence(const SequenceSpec& spec) {
  return std::make_unique<Recording>(spec);
}

std::unique_ptr<FrameSource> render_scene(const SyntheticSceneOptions& options) {
  return std::make_unique<Rendering>(options);
}

}  // namespace dynfilter::tools
