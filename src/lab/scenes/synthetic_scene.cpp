// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/scenes/synthetic_scene.hpp"

#include <algorithm>
#include <cmath>

#include "dynfilter/detail/errors.hpp"
#include "lab/scenes/depth_sensor.hpp"
#include "lab/scenes/detections.hpp"
#include "lab/scenes/masks.hpp"
#include "lab/scenes/moment.hpp"
#include "lab/scenes/motion.hpp"
#include "lab/scenes/noise.hpp"
#include "lab/scenes/renderer.hpp"
#include "lab/scenes/world.hpp"

namespace dynfilter {
namespace {

void require_range(const char* option, double value, double low, double high) {
  if (value >= low && value <= high) return;  // false for NaN
  detail::throw_misuse("SyntheticScene", detail::concatenate(option, " = ", value),
                       detail::concatenate("a number from ", low, " to ", high));
}

void require_valid(const SyntheticSceneOptions& options) {
  require_range("frames", options.frames, 1, 1e6);
  require_range("image_size.width", options.image_size.width, 16, 8192);
  require_range("image_size.height", options.image_size.height, 16, 8192);
  if (options.focal_px != 0) require_range("focal_px", options.focal_px, 16, 8192);
  require_range("frames_per_second", options.frames_per_second, 1e-3, 1e4);
  require_range("start_time_s", options.start_time_s, 0, 1e10);
  require_range("persons", options.persons, 0, 8);
  require_range("person_distance_m", options.person_distance_m, 1.0, 18.0);
  require_range("person_speed_m_s", options.person_speed_m_s, 0, 5);
  require_range("limb_swing", options.limb_swing, 0, 1.2);
  require_range("persons_spacing_m", options.persons_spacing_m, 0, 1);
  require_range("persons_gap_m", options.persons_gap_m, 0, 1);
  require_range("turn_distance_m", options.turn_distance_m, 0.2, 2.4);
  require_range("still_persons", options.still_persons, 0, options.persons);
  require_range("stop_s", options.stop_s, 0, 60);
  require_range("go_s", options.go_s, 1, 60);
  if (options.moving_box == MovingBox::carried) {
    require_range("persons, with a carried box,", options.persons, 1, 8);
  }
  require_range("box_speed_m_s", options.box_speed_m_s, 0, 2);
  if (options.furniture_at_persons) {
    require_range("person_distance_m", options.person_distance_m, 1.7, 18.0);
  }
  if (options.workplace_at_persons) {
    require_range("person_distance_m, with a workplace,", options.person_distance_m, 1.6, 18.0);
    require_range("limb_swing, with a workplace,", options.limb_swing, 0, 0.1);
    require_range("persons_sidestep, with a workplace,", options.persons_sidestep ? 1 : 0, 1, 1);
  }
  require_range("wall_distance_m", options.wall_distance_m,
                options.person_distance_m + std::max(1.5, options.persons_gap_m + 1.0), 20);
  require_range("background_contrast", options.background_contrast, 0, 1);
  require_range("camera_motion", options.camera_motion, 0, 1.5);
  require_range("camera_translation", options.camera_translation, 0, 2);
  require_range("camera_rate", options.camera_rate, 0.1, 5);
  require_range("camera_shift_m", options.camera_shift_m, -1, 1);
  require_range("light_drift", options.light_drift, 0, 0.5);
  require_range("reflection", options.reflection, 0, 0.5);
  require_range("depth_late_s", options.depth_late_s, -0.2, 0.2);
  require_range("max_depth_m", options.max_depth_m, 0.1, 13.1);
  require_range("depth_edge_shift_px", options.depth_edge_shift_px, 0, 10);
  require_range("depth_hole_slope", options.depth_hole_slope, 0, 1);
  require_range("depth_fringe_px", options.depth_fringe_px, 0, 30);
  require_range("hair_without_depth", options.hair_without_depth, 0, 1);
  require_range("depth_shift_px", options.depth_shift_px, -10, 10);
  require_range("depth_blind_top_px", options.depth_blind_top_px, 0, 200);
  require_range("exposure_s", options.exposure_s, 0, 0.1);
  require_range("exposure_change_stops", options.exposure_change_stops, 0, 2);
  require_range("min_missing_limbs", options.min_missing_limbs, 0, scene::limb_regions);
  require_range("max_missing_limbs", options.max_missing_limbs, options.min_missing_limbs,
                scene::limb_regions);
  require_range("torso_missing_share", options.torso_missing_share, 0, 1);
  require_range("empty_mask_share", options.empty_mask_share, 0, 1);
  require_range("mask_age_frames", options.mask_age_frames, 0, 1000);
  require_range("mask_rate_hz", options.mask_rate_hz, 0, 1000);
  if (options.mask_rate_hz > 0) {
    require_range("mask_age_frames, with a mask_rate_hz,", options.mask_age_frames, 0, 0);
  }
  require_range("missed_frames", options.missed_frames, 0, scene::missed_period_frames);
}

SyntheticSceneOptions checked(const SyntheticSceneOptions& options) {
  require_valid(options);
  return options;
}

void require_index(const SyntheticScene& scene, int index) {
  if (index >= 0 && index < scene.size()) return;
  detail::throw_misuse("SyntheticScene", detail::concatenate("frame ", index),
                       detail::concatenate("a frame from 0 to ", scene.size() - 1));
}

double elapsed_s(const SyntheticSceneOptions& options, int index) {
  return index / options.frames_per_second;
}

/// Returns the frame whose masks are the newest at frame `index`.
int masks_from(const SyntheticSceneOptions& options, int index) {
  if (options.mask_rate_hz == 0) return std::max(0, index - options.mask_age_frames);
  const double period = options.frames_per_second / options.mask_rate_hz;  // in frames
  constexpr double instant = 1e-9;  // masks finished at the very time of a frame count for it
  int done = 0, segmented = 0;
  for (double end = period; end <= index + instant;) {
    done = segmented;
    const int newest = static_cast<int>(end + instant);
    // A network that finishes early waits for the next frame.
    segmented = std::max(newest, segmented + 1);
    end = std::max<double>(end, segmented) + period;
  }
  return done;
}

}  // namespace

struct SyntheticScene::Content {
  explicit Content(const SyntheticSceneOptions& wanted)
      : options(checked(wanted)), world(options) {}

  scene::Rendering render(const CameraParameters& camera, double elapsed_s) const {
    return scene::render(world, scene::moment_at(options, elapsed_s), camera,
                         scene::camera_at(options, elapsed_s));
  }
  cv::Mat1i surfaces(const CameraParameters& camera, int frame) const {
    const double elapsed = elapsed_s(options, frame);
    return scene::render_surfaces(world, scene::moment_at(options, elapsed), camera,
                                  scene::camera_at(options, elapsed));
  }
  cv::Mat3f blurred_colour(const CameraParameters& camera, double elapsed_s) const;

  SyntheticSceneOptions options;
  scene::World world;
};

/// Returns the mean of the colours during the exposure.
cv::Mat3f SyntheticScene::Content::blurred_colour(const CameraParameters& camera,
                                                  double elapsed_s) const {
  const int samples = 1 + static_cast<int>(std::ceil(options.exposure_s / 0.002));
  cv::Mat3f sum(camera.image_size, cv::Vec3f(0, 0, 0));
  for (int i = 0; i < samples; ++i) {
    const double off = (i + 0.5) / samples - 0.5;
    const cv::Mat3f colour = render(camera, elapsed_s + off * options.exposure_s).colour;
    std::transform(sum.begin(), sum.end(), colour.begin(), sum.begin(),
                   [](const cv::Vec3f& a, const cv::Vec3f& b) { return a + b; });
  }
  const float share = 1.0F / static_cast<float>(samples);
  for (cv::Vec3f& pixel : sum) pixel *= share;
  return sum;
}

SyntheticScene::SyntheticScene(const SyntheticSceneOptions& options)
    : content_(std::make_shared<const Content>(options)) {}

const SyntheticSceneOptions& SyntheticScene::options() const { return content_->options; }

CameraParameters SyntheticScene::camera() const {
  const cv::Size size = options().image_size;
  const double scale_x = size.width / 640.0;
  const double scale_y = size.height / 480.0;
  CameraParameters camera;
  camera.fx = 535.4 * scale_x;
  camera.fy = 539.2 * scale_y;
  camera.cx = (320.1 + 0.5) * scale_x - 0.5;  // 0 is the centre of the first pixel
  camera.cy = (247.6 + 0.5) * scale_y - 0.5;
  if (options().focal_px != 0) {
    camera.fx = camera.fy = options().focal_px;
    camera.cx = (size.width - 1) / 2.0;
    camera.cy = (size.height - 1) / 2.0;
  }
  camera.image_size = size;
  camera.frames_per_second = options().frames_per_second;
  camera.depth_units_per_metre = scene::depth_units_per_metre;
  return camera;
}

double SyntheticScene::timestamp_s(int index) const {
  require_index(*this, index);
  return options().start_time_s + elapsed_s(options(), index);
}

CameraPose SyntheticScene::pose(int index) const {
  require_index(*this, index);
  return scene::camera_at(options(), elapsed_s(options(), index));
}

SyntheticFrame SyntheticScene::render(int index) const {
  SyntheticFrame out;
  out.pose = pose(index);
  const double elapsed = elapsed_s(options(), index);
  const scene::Rendering rendering = content_->render(camera(), elapsed);
  const cv::Mat3f colour =
      options().exposure_s > 0 ? content_->blurred_colour(camera(), elapsed) : rendering.colour;
  const std::uint64_t seed = options().seed;

  out.frame.id = static_cast<std::uint64_t>(index);
  out.frame.timestamp_s = timestamp_s(index);
  out.frame.image = scene::expose(colour, scene::gain_at(options(), elapsed),
                                  scene::make_key(seed, scene::Stream::image_noise, index));
  const double late_s = options().depth_late_s;
  out.frame.depth = scene::measure_depth(
      late_s == 0 ? rendering : content_->render(camera(), elapsed - late_s), camera(), options(),
      scene::make_key(seed, scene::Stream::depth_noise, index));
  out.frame.metres_per_unit = 1 / scene::depth_units_per_metre;
  out.exact_depth_m = rendering.depth;
  out.moving_mask =
      scene::moving_pixels(content_->world, scene::moment_at(options(), elapsed),
                           scene::moment_at(options(), elapsed - 1 / options().frames_per_second),
                           rendering, camera(), out.pose);

  out.true_segmentation = {out.frame.id, out.frame.timestamp_s, options().image_size,
                           scene::true_instances(rendering.surface, options().persons)};
  const int segmented = masks_from(options(), index);
  out.poor_segmentation = {
      static_cast<std::uint64_t>(segmented), timestamp_s(segmented), options().image_size,
      scene::detections(
          options(), segmented,
          segmented == index ? rendering.surface : content_->surfaces(camera(), segmented))};
  return out;
}

}  // namespace dynfilter
