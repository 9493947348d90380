// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "moment.hpp"

#include <cmath>

#include "materials.hpp"
#include "noise.hpp"

namespace dynfilter::scene {
namespace {

constexpr double pushed_way_m = 0.6;       // to either side of the middle
constexpr double pushed_distance_m = 1.5;  // of the box's middle, from the camera's mean place

Material box_material(const SyntheticSceneOptions& options) {
  return options.box_plain ? Material::cloth : Material::books;
}

/// Returns a box whose texture moves with it.
Block box(const SyntheticSceneOptions& options, cv::Vec3d centre, cv::Vec3d size) {
  Block made;
  made.centre = centre;
  made.half_size = size * 0.5;
  made.material = static_cast<int>(box_material(options));
  return made;
}

/// Returns a cart that goes back and forth before the camera, with rounded turns.
Block pushed_box(const SyntheticSceneOptions& options, double elapsed_s) {
  constexpr double sharpness = 0.96;
  const double peak = std::asin(sharpness);
  const double start = unit(make_key(options.seed, Stream::box)) - 0.5;
  const double phase = elapsed_s * options.box_speed_m_s * peak / pushed_way_m + start;
  const double x = pushed_way_m * std::asin(sharpness * std::sin(phase)) / peak;
  return box(options, {x, pushed_distance_m, 0.55}, {0.60, 0.40, 1.10});
}

/// Returns a box before a person's chest, turned as the person is.
Block carried_box(const SyntheticSceneOptions& options, double elapsed_s) {
  const cv::Vec2d place = place_at(options, 0, elapsed_s);
  const cv::Vec2d forward = forward_at(options, 0, elapsed_s);
  Block made = box(options, {place[0] + 0.36 * forward[0], place[1] + 0.36 * forward[1], 1.12},
                   {0.46, 0.30, 0.36});
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

cv::Vec3d place_before(const cv::Vec3d& point, const BodyPart& now, const BodyPart& before) {
  return before.limb.to_world(now.limb.to_local(point));
}

cv::Vec3d place_before(const cv::Vec3d& point, const Block& now, const Block& before) {
  return before.to_world(now.to_local(point));
}

}  // namespace dynfilter::scene
