// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "renderer.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "noise.hpp"
#include "texture.hpp"

namespace dynfilter::scene {
namespace {

constexpr double camera_height_m = 1.30;
constexpr double ceiling_m = 2.70;

using Blocks = std::vector<Block>;

double radians(double degrees) { return degrees * CV_PI / 180.0; }

void add(Blocks& blocks, cv::Vec3d foot, cv::Vec3d size, double turn_deg, Material material) {
  Block& made = blocks.emplace_back();
  made.centre = {foot[0], foot[1], foot[2] + size[2] / 2};
  made.half_size = size * 0.5;
  made.texture_offset_m = {made.centre[0], made.centre[2]};
  made.cosine = std::cos(radians(turn_deg));
  made.sine = std::sin(radians(turn_deg));
  made.material = static_cast<int>(material);
}

/// Adds a table and the things on it; `foot` is the floor point below its middle.
void add_table(Blocks& blocks, cv::Vec3d foot) {
  const auto put = [&](cv::Vec3d at, cv::Vec3d size, double turn, Material material) {
    add(blocks, foot + at, size, turn, material);
  };
  put({0, 0, 0.71}, {1.30, 0.65, 0.04}, 0, Material::wood);
  for (const double x : {-0.6, 0.6}) {
    for (const double y : {-0.28, 0.28}) {
      put({x, y, 0}, {0.06, 0.06, 0.71}, 0, Material::wood);
    }
  }
  put({-0.15, 0.12, 0.75}, {0.16, 0.14, 0.10}, 0, Material::screen);
  put({-0.15, 0.10, 0.85}, {0.62, 0.05, 0.38}, 6, Material::screen);
  put({0.38, -0.02, 0.75}, {0.26, 0.22, 0.18}, 25, Material::cardboard);
  put({-0.5, -0.15, 0.75}, {0.22, 0.30, 0.05}, -12, Material::books);
}

/// Returns shelves at the wall, a table and boxes on the floor; their places vary a little with the
/// seed.
Blocks furniture(const SyntheticSceneOptions& options) {
  const double wall = options.wall_distance_m;
  const auto jitter = [&](int what) {
    return between(make_key(options.seed, Stream::layout, what), -0.12, 0.12);
  };
  Blocks blocks;
  const double shelf = -1.75 + jitter(1);
  add(blocks, {shelf, wall - 0.16, 0}, {0.95, 0.30, 1.52}, 0, Material::books);
  add(blocks, {shelf, wall - 0.17, 1.52}, {1.02, 0.34, 0.04}, 0, Material::wood);
  add(blocks, {shelf - 0.2, wall - 0.2, 1.56}, {0.3, 0.24, 0.22}, 15, Material::cardboard);
  add_table(blocks, {1.25 + jitter(2), wall - 0.75 + jitter(3), 0});
  const double pile = 0.05 + jitter(4);
  add(blocks, {pile, wall - 0.45, 0}, {0.55, 0.42, 0.46}, 12, Material::cardboard);
  add(blocks, {pile - 0.04, wall - 0.43, 0.46}, {0.38, 0.32, 0.30}, -18, Material::cardboard);
  // A chest of drawers on the right, nearer, so that the static scene itself has depth.
  add(blocks, {2.05 + jitter(5), 2.75, 0}, {0.55, 0.45, 0.86}, -20, Material::wood);
  add(blocks, {2.02 + jitter(5), 2.72, 0.86}, {0.24, 0.2, 0.3}, 10, Material::books);
  add(blocks, {-2.25 + jitter(6), 2.6, 0}, {0.5, 0.5, 0.55}, 30, Material::cloth);
  add(blocks, {-2.25 + jitter(6), 2.6, 0.55}, {0.3, 0.34, 0.26}, 8, Material::cardboard);
  return blocks;
}

/// Returns the distance of the path of the farthest person.
double farthest_path(const SyntheticSceneOptions& options) {
  const int persons = std::max(options.persons, 1);
  return options.person_distance_m + options.persons_gap_m * (persons > 1 ? 1 : 0) +
         0.05 * ((persons - 1) / 2);
}

/// Shelf or cupboard; `gap` is its distance from what stands before it.
struct Unit {
  double x, width, gap, height;
  Material material;
};

void add_units(Blocks& blocks, std::initializer_list<Unit> units, double behind) {
  constexpr double depth = 0.30;
  for (const Unit& unit : units) {
    add(blocks, {unit.x, behind + unit.gap + depth / 2, 0}, {unit.width, depth, unit.height}, 0,
        unit.material);
  }
}

/// Adds static things right behind and in front of the persons' path, out of reach of every limb: a
/// walking body reaches 0.40 m to either side of the path.
void add_shelves(Blocks& blocks, const SyntheticSceneOptions& options) {
  constexpr double reach_m = 0.40;
  const double before = options.person_distance_m - reach_m;
  add_units(blocks,
            {{-1.05, 0.72, 0.05, 1.62, Material::books},
             {-0.30, 0.58, 0.22, 1.18, Material::cardboard},
             {0.34, 0.62, 0.40, 1.86, Material::books},
             {1.05, 0.70, 0.12, 1.40, Material::wood}},
            farthest_path(options) + reach_m);
  const double desk = before - 0.28;
  add(blocks, {0.10, desk, 0.71}, {1.50, 0.52, 0.04}, 0, Material::wood);
  add(blocks, {0.22, desk + 0.06, 0.75}, {0.16, 0.14, 0.10}, 0, Material::screen);
  add(blocks, {0.22, desk + 0.06, 0.85}, {0.50, 0.05, 0.34}, 4, Material::screen);
  add(blocks, {-0.42, desk + 0.02, 0.75}, {0.26, 0.22, 0.28}, 20, Material::cardboard);
}

/// Adds a desk, a chair and cupboards that leave people who step sideways just room enough.
void add_workplace(Blocks& blocks, const SyntheticSceneOptions& options) {
  constexpr double reach_before_m = 0.25;  // of the hands
  constexpr double reach_behind_m = 0.15;  // of the heels
  const double before = options.person_distance_m - reach_before_m - 0.05;
  add_units(blocks,
            {{-1.20, 0.70, 0.15, 1.90, Material::books},
             {-0.48, 0.62, 0.05, 1.15, Material::cardboard},
             {0.18, 0.60, 0.40, 1.75, Material::books},
             {0.84, 0.62, 0.10, 1.30, Material::books},
             {1.52, 0.66, 0.25, 1.60, Material::wood}},
            farthest_path(options) + reach_behind_m);
  const double desk = before - 0.30;  // the middle of its top
  add(blocks, {-0.42, desk, 0.69}, {1.10, 0.60, 0.04}, 0, Material::wood);
  for (const double x : {-0.94, 0.10}) {
    add(blocks, {x, desk, 0}, {0.05, 0.56, 0.69}, 0, Material::wood);
  }
  add(blocks, {-0.66, desk + 0.20, 0.73}, {0.30, 0.16, 0.26}, 4, Material::books);
  add(blocks, {-0.20, desk + 0.23, 0.73}, {0.44, 0.05, 0.32}, 0, Material::screen);
  add(blocks, {-0.02, desk + 0.02, 0.73}, {0.20, 0.28, 0.05}, 15, Material::books);
  add(blocks, {-0.55, desk - 0.12, 0.73}, {0.34, 0.24, 0.02}, -8, Material::screen);
  add(blocks, {0.50, before - 0.03, 0.52}, {0.44, 0.05, 0.46}, 0, Material::books);
  add(blocks, {0.50, before - 0.28, 0.44}, {0.46, 0.46, 0.06}, 0, Material::cloth);
  for (const double x : {0.31, 0.69}) {
    add(blocks, {x, before - 0.03, 0}, {0.04, 0.04, 0.52}, 0, Material::wood);
    add(blocks, {x, before - 0.47, 0}, {0.04, 0.04, 0.44}, 0, Material::wood);
  }
}

/// Adds a chair under the first person.
void add_chair(Blocks& blocks, const SyntheticSceneOptions& options) {
  const cv::Vec2d place = place_at(options, 0, 0);
  add(blocks, {place[0], place[1], 0}, {0.44, 0.42, 0.40}, 0, Material::wood);
  add(blocks, {place[0], place[1] + 0.20, 0.40}, {0.44, 0.05, 0.50}, 0, Material::wood);
}

/// Returns one coordinate of the camera's motion, at most 1: a slow sway, a quicker one and a
/// hand's tremor.
double sway(std::uint64_t seed, int coordinate, double elapsed_s) {
  struct Wave {
    double hertz, share;
  };
  constexpr Wave waves[] = {{0.22, 0.78}, {0.55, 0.17}, {1.4, 0.05}};
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const std::uint64_t key = make_key(seed, Stream::camera, coordinate, i);
    const double hertz = waves[i].hertz * between(make_key(key, 1), 0.85, 1.15);
    sum += waves[i].share * std::sin(2 * CV_PI * (hertz * elapsed_s + unit(make_key(key, 2))));
  }
  return sum;
}

cv::Matx33d turn_about(int axis, double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  cv::Matx33d turn = cv::Matx33d::eye();
  const int first = (axis + 1) % 3;
  const int second = (axis + 2) % 3;
  turn(first, first) = c;
  turn(second, second) = c;
  turn(first, second) = -s;
  turn(second, first) = s;
  return turn;
}

}  // namespace

World::World(const SyntheticSceneOptions& options)
    : blocks(furniture(options)), changing_light(options.changing_light) {
  room.low = {-3.1, -2.0, 0};
  room.high = {3.1, options.wall_distance_m, ceiling_m};
  if (options.surroundings == Surroundings::shelves) add_shelves(blocks, options);
  if (options.surroundings == Surroundings::workplace) add_workplace(blocks, options);
  if (options.walking == Walking::one_sits) add_chair(blocks, options);
  for (int i = 0; i < scene::materials; ++i) {
    materials.push_back(
        paint_material(static_cast<Material>(i), options.background_contrast, options.seed));
  }
  for (int person = 0; person < options.persons; ++person) {
    for (int i = 0; i < scene::garments; ++i) {
      garments.push_back(paint_garment(static_cast<Garment>(i), person, options.seed));
    }
  }
}

Pose camera_at(const SyntheticSceneOptions& options, double elapsed_s) {
  const double strength = options.camera == CameraMotion::none ? 0 : 1;
  const double rate = options.camera == CameraMotion::three_times_as_fast ? 3 : 1;
  const double shift = options.camera == CameraMotion::turns_only ? 0 : 1;
  const auto coordinate = [&](int index, double amplitude) {
    return strength * amplitude * sway(options.seed, index, rate * elapsed_s);
  };
  // A level camera that looks along the world's y; the columns are its right, down and forward.
  const cv::Matx33d level(1, 0, 0, 0, 0, 1, 0, -1, 0);
  const double yaw = radians(coordinate(3, 4.5));
  const double pitch = radians(coordinate(4, 3.0) - 4.0);
  const double roll = radians(coordinate(5, 1.8));
  Pose pose;
  pose.rotation = level * turn_about(1, yaw) * turn_about(0, pitch) * turn_about(2, roll);
  pose.translation = {shift * coordinate(0, 0.36), shift * coordinate(1, 0.24),
                      camera_height_m + shift * coordinate(2, 0.20)};
  pose.translation += cv::Vec3d(0, 0, 0);  // no negative zeros
  return pose;
}

}  // namespace dynfilter::scene
