// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/scenes/synthetic_scene.hpp"

#include <algorithm>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <string>

#include "moment.hpp"
#include "noise.hpp"
#include "renderer.hpp"

namespace dynfilter {
namespace {

void require_range(const std::string& name, double value, double low, double high) {
  if (value >= low && value <= high) return;  // false for NaN
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "dynfilter::SyntheticScene: got " << name << " = " << value << "; want a number from "
       << low << " to " << high;
  throw std::invalid_argument(text.str());
}

SyntheticSceneOptions checked(const SyntheticSceneOptions& o) {
  require_range("frames", o.frames, 1, 1e6);
  require_range("image_size.width", o.image_size.width, 16, 8192);
  require_range("image_size.height", o.image_size.height, 16, 8192);
  require_range("persons", o.persons, 0, 8);
  return o;
}

double elapsed_s(int index) { return index / scene::frames_per_second; }

/// Returns the frame whose masks are the newest at frame `index`.
int masks_from(const SyntheticSceneOptions& options, int index) {
  if (options.mask_rate_hz == 0) return std::max(0, index - options.mask_age_frames);
  const double period = scene::frames_per_second / options.mask_rate_hz;  // in frames
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

  scene::Rendering render(const SequenceCamera& camera, double elapsed_s) const {
    return scene::render(world, scene::moment_at(options, elapsed_s), camera,
                         scene::camera_at(options, elapsed_s));
  }
  SyntheticSceneOptions options;
  scene::World world;
};

SyntheticScene::SyntheticScene(const SyntheticSceneOptions& options)
    : content_(std::make_shared<const Content>(options)) {}

const SyntheticSceneOptions& SyntheticScene::options() const { return content_->options; }

SequenceCamera SyntheticScene::camera() const {
  const cv::Size size = options().image_size;
  const double scale_x = size.width / 640.0;
  const double scale_y = size.height / 480.0;
  SequenceCamera camera;  // another shape shows less
  camera.fx = 535.4 * std::max(scale_x, scale_y);
  camera.fy = 539.2 * std::max(scale_x, scale_y);
  camera.cx = (320.1 + 0.5) * scale_x - 0.5;  // 0 is the centre of the first pixel
  camera.cy = (247.6 + 0.5) * scale_y - 0.5;
  camera.image_size = size;
  camera.frames_per_second = scene::frames_per_second;
  camera.depth_units_per_metre = scene::depth_units_per_metre;
  return camera;
}

double SyntheticScene::timestamp_s(int index) const {
  require_range("frame", index, 0, size() - 1);
  return 1.0 + elapsed_s(index);
}

Pose SyntheticScene::pose(int index) const {
  require_range("frame", index, 0, size() - 1);
  return scene::camera_at(options(), elapsed_s(index));
}

SyntheticFrame SyntheticScene::render(int index) const {
  SyntheticFrame out;
  out.pose = pose(index);
  const double elapsed = elapsed_s(index);
  const scene::Rendering rendering = content_->render(camera(), elapsed);
  const std::uint64_t seed = options().seed;

  out.frame.id = static_cast<std::uint64_t>(index);
  out.frame.timestamp_s = timestamp_s(index);
  out.frame.image =
      scene::expose(rendering.colour, scene::make_key(seed, scene::Stream::image_noise, index));
  out.frame.depth = scene::measure_depth(rendering, camera(), options(),
                                         scene::make_key(seed, scene::Stream::depth_noise, index));
  out.frame.metres_per_unit = 1 / scene::depth_units_per_metre;
  out.exact_depth_m = rendering.depth;
  out.moving_mask =
      scene::moving_pixels(content_->world, scene::moment_at(options(), elapsed),
                           scene::moment_at(options(), elapsed - 1 / scene::frames_per_second),
                           rendering, camera(), out.pose);

  out.true_segmentation = {out.frame.id, out.frame.timestamp_s, options().image_size,
                           scene::true_instances(rendering.surface, options().persons)};
  const int segmented = masks_from(options(), index);
  out.poor_segmentation = {
      static_cast<std::uint64_t>(segmented), timestamp_s(segmented), options().image_size,
      scene::detections(options(), segmented,
                        segmented == index
                            ? rendering.surface
                            : content_->render(camera(), elapsed_s(segmented)).surface)};
  return out;
}

}  // namespace dynfilter
