// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "scene_spec.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "lab/scenes/scene_levels.hpp"

namespace dynfilter::tools {
namespace {

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

/// Degrades a source's masks. The good masks of persons (class 0) serve as the truth. The same
/// frame gets the same masks at every call.
class DegradedMasks final : public FrameSource {
 public:
  DegradedMasks(std::unique_ptr<FrameSource> source, std::string how)
      : source_(std::move(source)), how_(std::move(how)) {
    if (source_->masks_name().empty()) {
      throw std::runtime_error("there are no masks to degrade");
    }
  }

  std::size_t size() const override { return source_->size(); }
  CameraParameters camera() const override { return source_->camera(); }
  bool has_depth() const override { return source_->has_depth(); }
  double depth_offset_s() const override { return source_->depth_offset_s(); }
  bool has_true_masks() const override { return true; }
  double rim_px() const override { return degraded_rim_px; }
  std::string masks_name() const override { return source_->masks_name() + ", " + how_; }
  std::optional<Trajectory> true_trajectory() const override { return source_->true_trajectory(); }
  std::string note() const override { return source_->note(); }
  std::vector<int> mask_values() const override { return source_->mask_values(); }

  void require_masks(std::size_t i) const override {
    source_->require_masks(i);
    if (how_ == "late") source_->require_masks(i - std::min(i, late_frames));
  }

  void pass_moving_masks() override { source_->pass_moving_masks(); }

  void add_inputs(Inputs& inputs) const override { source_->add_inputs(inputs); }

  SourceFrame read(std::size_t i) override {
    SourceFrame frame = source_->read(i);
    frame.true_masks = persons_of(*frame.masks);
    if (how_ == "late") {
      frame.masks = source_->read(i - std::min(i, late_frames)).masks;
    } else {
      frame.masks = degraded(std::move(*frame.masks), how_);
    }
    return frame;
  }

 private:
  std::unique_ptr<FrameSource> source_;
  std::string how_;
};

/// Returns the last part of a path, which may end in a slash or in dots.
std::string folder_name(const std::filesystem::path& folder) {
  const auto full_path = std::filesystem::absolute(folder).lexically_normal();
  return (full_path.has_filename() ? full_path : full_path.parent_path()).filename().string();
}

}  // namespace

std::vector<std::string> degradation_names() { return {"eroded", "cut", "disc", "poor", "late"}; }

SceneName SceneSpec::name() const {
  if (level.empty()) {
    const std::string name = folder_name(sequence) + (degraded.empty() ? "" : "_" + degraded);
    return {name, name};
  }
  return {level, level + "_" + std::to_string(level_seed)};
}

std::unique_ptr<FrameSource> SceneSpec::open(Truth truth) const {
  std::unique_ptr<FrameSource> source;
  if (level.empty()) {
    source = open_sequence(sequence, masks, camera, depth_offset_s, reads_masks);
    if (!degraded.empty()) {
      source = std::make_unique<DegradedMasks>(std::move(source), degraded);
    }
  } else {
    SyntheticSceneOptions options = scene_level(level, level_seed);
    options.frames = frames.value_or(options.frames);
    options.image_size.width = width.value_or(options.image_size.width);
    options.image_size.height = height.value_or(options.image_size.height);
    source = render_scene(options);
  }
  if (truth == Truth::by_motion) source->pass_moving_masks();
  return source;
}

}  // namespace dynfilter::tools
