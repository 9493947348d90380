// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "moment.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "materials.hpp"
#include "noise.hpp"
#include "renderer.hpp"

namespace dynfilter::scene {
namespace {

constexpr double min_moving_m_s = 0.02;
constexpr double pushed_way_m = 0.6;  // to either side of the middle
constexpr double pushed_m_s = 0.3;
constexpr double pushed_distance_m = 1.5;  // of the box's middle, from the camera's mean place

/// Returns a box whose texture moves with it.
Block box(cv::Vec3d centre, cv::Vec3d size) {
  Block made;
  made.centre = centre;
  made.half_size = size * 0.5;
  made.material = static_cast<int>(Material::books);
  return made;
}

/// Returns a cart that goes back and forth before the camera, with rounded turns.
Block pushed_box(const SyntheticSceneOptions& options, double elapsed_s) {
  constexpr double sharpness = 0.96;
  const double peak = std::asin(sharpness);
  const double start = unit(make_key(options.seed, Stream::box)) - 0.5;
  const double phase = elapsed_s * pushed_m_s * peak / pushed_way_m + start;
  const double x = pushed_way_m * std::asin(sharpness * std::sin(phase)) / peak;
  return box({x, pushed_distance_m, 0.55}, {0.60, 0.40, 1.10});
}

/// Returns a box before a person's chest, turned as the person is.
Block carried_box(const SyntheticSceneOptions& options, double elapsed_s) {
  const cv::Vec2d place = place_at(options, 0, elapsed_s);
  const cv::Vec2d forward = forward_at(options, 0, elapsed_s);
  Block made =
      box({place[0] + 0.36 * forward[0], place[1] + 0.36 * forward[1], 1.12}, {0.46, 0.30, 0.36});
  // The box's local y is the person's forward.
  made.cosine = forward[1];
  made.sine = -forward[0];
  return made;
}

}  // namespace

Moment moment_at(const SyntheticSceneOptions& options, double elapsed_s) {
  Moment moment{elapsed_s, bodies_at(options, elapsed_s), {}};
  if (options.moving_box == MovingBox::pushed) {
    moment.boxes.push_back(pushed_box(options, elapsed_s));
  }
  if (options.moving_box == MovingBox::carried) {
    moment.boxes.push_back(carried_box(options, elapsed_s));
  }
  return moment;
}

cv::Mat1b moving_pixels(const World& world, const Moment& now, const Moment& before,
                        const Rendering& rendering, const CameraParameters& camera,
                        const CameraPose& pose) {
  const double min_moved_m = min_moving_m_s * (now.elapsed_s - before.elapsed_s);
  const int first_box = static_cast<int>(world.blocks.size());
  cv::Mat1b moving(rendering.surface.size(), std::uint8_t{0});
  for (int y = 0; y < moving.rows; ++y) {
    for (int x = 0; x < moving.cols; ++x) {
      const int id = rendering.surface(y, x);
      const bool on_box = SurfaceId::is_block(id) && SurfaceId::block_index(id) >= first_box;
      if (!on_box && !SurfaceId::is_part(id)) continue;
      const cv::Vec3d in_camera((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
      const cv::Vec3d point =
          pose.translation + pose.rotation * in_camera * static_cast<double>(rendering.depth(y, x));
      cv::Vec3d place;
      if (on_box) {
        const auto box = static_cast<std::size_t>(SurfaceId::block_index(id) - first_box);
        place = before.boxes[box].to_world(now.boxes[box].to_local(point));
      } else {
        const auto person = static_cast<std::size_t>(SurfaceId::person(id));
        const auto part = static_cast<std::size_t>(SurfaceId::part_index(id));
        place = before.bodies[person][part].limb.to_world(
            now.bodies[person][part].limb.to_local(point));
      }
      if (cv::norm(point - place) >= min_moved_m) moving(y, x) = 255;
    }
  }
  return moving;
}

}  // namespace dynfilter::scene
