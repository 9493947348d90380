// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "renderer.hpp"

#include <algorithm>
#include <cmath>

#include "noise.hpp"
#include "texture.hpp"

namespace dynfilter::scene {
namespace {

constexpr int tile_px = 16;
constexpr double light_drift = 0.18;  // strength of drifting shadows, relative to the light
constexpr double reflection = 0.40;   // share of the room that still surfaces mirror

/// Lists the bodies that may be visible in each tile of the image, so that a ray tests few of them.
class Tiles {
 public:
  Tiles(const SequenceCamera& camera, const Pose& pose)
      : camera_(camera),
        pose_(pose),
        columns_((camera.image_size.width + tile_px - 1) / tile_px),
        rows_((camera.image_size.height + tile_px - 1) / tile_px),
        tiles_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

  void add(int id, const Sphere& bounds) {
    const cv::Vec3d c = pose_.rotation.t() * (bounds.centre - pose_.translation);
    const double r = bounds.radius;
    if (c[2] + r <= 0) return;
    cv::Range x(0, columns_);
    cv::Range y(0, rows_);
    if (c[2] - r > 0.05) {
      x = span(c[0], c[2], r, camera_.fx, camera_.cx, columns_);
      y = span(c[1], c[2], r, camera_.fy, camera_.cy, rows_);
    }
    for (int row = y.start; row < y.end; ++row) {
      for (int column = x.start; column < x.end; ++column) {
        tiles_[static_cast<std::size_t>(row * columns_ + column)].push_back(id);
      }
    }
  }

  const std::vector<int>& at(int x, int y) const {
    const int column = std::clamp(x / tile_px, 0, columns_ - 1);
    const int row = std::clamp(y / tile_px, 0, rows_ - 1);
    return tiles_[static_cast<std::size_t>(row * columns_ + column)];
  }

 private:
  /// Returns the tiles that the cube around a sphere covers along one image axis, with a margin of
  /// one pixel.
  static cv::Range span(double centre, double depth, double radius, double focal, double principal,
                        int count) {
    const double low = centre - radius;
    const double high = centre + radius;
    const double first = std::min(low / (depth - radius), low / (depth + radius));
    const double last = std::max(high / (depth - radius), high / (depth + radius));
    const auto tile = [&](double slope, double margin) {
      const double pixel = std::floor((focal * slope + principal + margin) / tile_px);
      return static_cast<int>(std::clamp(pixel, -1.0, static_cast<double>(count)));
    };
    return {std::max(tile(first, -2), 0), std::min(tile(last, 2) + 1, count)};
  }

  const SequenceCamera& camera_;
  const Pose& pose_;
  int columns_, rows_;
  std::vector<std::vector<int>> tiles_;
};

struct Hit {
  double t = no_hit;
  int id = 0;
};

class View {
 public:
  View(const World& world, const Moment& moment, const SequenceCamera& camera, const Pose& pose)
      : world_(world), moment_(moment), camera_(camera), pose_(pose), tiles_(camera, pose) {
    const std::size_t blocks = world.blocks.size() + moment.boxes.size();
    for (std::size_t i = 0; i < blocks; ++i) {
      const int id = SurfaceId::block(static_cast<int>(i), 0);
      tiles_.add(id, block(id).bounds());
    }
    const Bodies& bodies = moment.bodies;
    for (std::size_t person = 0; person < bodies.size(); ++person) {
      for (std::size_t i = 0; i < bodies[person].size(); ++i) {
        tiles_.add(SurfaceId::part(static_cast<int>(person), static_cast<int>(i)),
                   bodies[person][i].limb.bounds());
      }
    }
  }

  Ray ray(double x, double y) const {
    const cv::Vec3d in_camera((x - camera_.cx) / camera_.fx, (y - camera_.cy) / camera_.fy, 1.0);
    return {pose_.translation, pose_.rotation * in_camera};
  }

  /// Returns the first surface on a ray through pixel (x, y) or near it.
  Hit trace(const Ray& ray, int x, int y) const {
    const FaceHit room = world_.room.hit(ray);
    Hit nearest{room.t, SurfaceId::room(room.face)};
    for (const int id : tiles_.at(x, y)) {
      if (SurfaceId::is_part(id)) {
        const double t = part(id).limb.hit(ray);
        if (t < nearest.t) nearest = {t, id};
      } else {
        const FaceHit hit = block(id).hit(ray);
        if (hit.t < nearest.t) nearest = {hit.t, id + hit.face};
      }
    }
    return nearest;
  }

  /// Returns the colour at a hit and the cosine of the angle of incidence.
  cv::Vec3f shade(const Ray& ray, const Hit& hit, double* facing) const {
    const cv::Vec3d point = ray.at(hit.t);
    SurfacePoint surface;
    const Texture* texture = nullptr;
    double light_share = 0.45;
    if (SurfaceId::is_part(hit.id)) {
      const BodyPart& hit_part = part(hit.id);
      surface = hit_part.limb.surface(point);
      surface.u += hit_part.texture_offset_m[0];
      surface.v += hit_part.texture_offset_m[1];
      texture = &world_.garments[static_cast<std::size_t>(SurfaceId::person(hit.id) * garments +
                                                          static_cast<int>(hit_part.garment))];
    } else if (hit.id >= SurfaceId::block(0, 0)) {
      const Block& hit_block = block(hit.id);
      surface = hit_block.surface(point, hit.id % 6);
      texture = &world_.materials[static_cast<std::size_t>(hit_block.material)];
    } else {
      surface = world_.room.surface(point, hit.id);
      texture = &world_.materials[static_cast<std::size_t>(room_material(hit.id))];
      light_share = 0.25;
    }
    const double length = std::sqrt(ray.direction.dot(ray.direction));
    *facing = std::abs(surface.normal.dot(ray.direction)) / length;
    // The width of a pixel on the surface: the mean of along and across the slant, roughly.
    const double footprint = hit.t / camera_.fx / std::sqrt(std::max(*facing, 0.05));
    const double lit = std::max(0.0, surface.normal.dot({-0.48, -0.60, 0.64}));  // by the lamp
    double light = (1 - light_share) + 1.35 * light_share * lit;
    if (world_.changing_light) light *= 1 + light_drift * drifting_light(point);
    const double corner = hit.id < SurfaceId::block(0, 0) ? corner_shade(point) : 1.0;
    const cv::Vec3f colour =
        texture->sample(surface.u, surface.v, footprint) * static_cast<float>(light * corner);
    if (!world_.changing_light || !is_still(hit.id)) return colour;
    return colour + mirrored(ray, point, surface.normal) * static_cast<float>(reflection);
  }

 private:
  const BodyPart& part(int id) const {
    return moment_.bodies[static_cast<std::size_t>(SurfaceId::person(id))]
                         [static_cast<std::size_t>(SurfaceId::part_index(id))];
  }
  const Block& block(int id) const {
    const auto index = static_cast<std::size_t>(SurfaceId::block_index(id));
    const std::size_t still = world_.blocks.size();
    return index < still ? world_.blocks[index] : moment_.boxes[index - still];
  }

  static int room_material(int face) {
    if (face == 4) return static_cast<int>(Material::floor);
    return static_cast<int>(face == 5 ? Material::ceiling : Material::wall);
  }

  bool is_still(int id) const {
    return id < SurfaceId::block(static_cast<int>(world_.blocks.size()), 0);
  }

  /// Returns the change of light at a point, in [-1, 1]: soft shadows that drift through the room.
  double drifting_light(const cv::Vec3d& point) const {
    const auto wave = [&](const cv::Vec3d& waves_a_metre, double hertz) {
      return std::sin(2 * CV_PI * (waves_a_metre.dot(point) + hertz * moment_.elapsed_s));
    };
    return 0.5 * wave({2.6, 1.4, 1.8}, 2.0) + 0.5 * wave({-4.2, 3.2, 5.8}, 3.1);
  }

  /// Returns what a surface mirrors: the room's walls, blurred, less a mean grey.
  cv::Vec3f mirrored(const Ray& ray, const cv::Vec3d& point, const cv::Vec3d& normal) const {
    constexpr double blur_m = 0.012;
    const Ray back{point + normal * 1e-6, ray.direction - normal * (2 * normal.dot(ray.direction))};
    const FaceHit hit = world_.room.hit(back);
    const cv::Vec3d seen = back.at(hit.t);
    const SurfacePoint surface = world_.room.surface(seen, hit.face);
    const Texture& texture = world_.materials[static_cast<std::size_t>(room_material(hit.face))];
    return texture.sample(surface.u, surface.v, blur_m) - cv::Vec3f(150, 150, 150);
  }

  /// Returns the share of light that reaches a point: the room's corners get less.
  double corner_shade(const cv::Vec3d& point) const {
    double shade = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double gap =
          std::min(point[axis] - world_.room.low[axis], world_.room.high[axis] - point[axis]);
      if (gap > 1e-6) shade *= 1 - 0.22 * 0.04 / (0.04 + gap * gap);
    }
    return shade;
  }

  const World& world_;
  const Moment& moment_;
  const SequenceCamera& camera_;
  const Pose& pose_;
  Tiles tiles_;
};

void trace_row(const View& view, int y, Rendering& out) {
  for (int x = 0; x < out.colour.cols; ++x) {
    const Ray ray = view.ray(x, y);
    const Hit hit = view.trace(ray, x, y);
    double facing = 0;
    out.colour(y, x) = view.shade(ray, hit, &facing);
    out.depth(y, x) = static_cast<float>(hit.t);
    out.facing(y, x) = static_cast<float>(facing);
    out.surface(y, x) = hit.id;
  }
}

bool on_edge(const cv::Mat1i& surface, int x, int y) {
  const int id = surface(y, x);
  return (x > 0 && surface(y, x - 1) != id) || (y > 0 && surface(y - 1, x) != id) ||
         (x + 1 < surface.cols && surface(y, x + 1) != id) ||
         (y + 1 < surface.rows && surface(y + 1, x) != id);
}

/// Replaces pixels where two surfaces meet by the mean of 2x2 rays.
void smooth_row(const View& view, int y, Rendering& out) {
  for (int x = 0; x < out.colour.cols; ++x) {
    if (!on_edge(out.surface, x, y)) continue;
    cv::Vec3f sum(0, 0, 0);
    for (const double dy : {-0.25, 0.25}) {
      for (const double dx : {-0.25, 0.25}) {
        const Ray ray = view.ray(x + dx, y + dy);
        double facing = 0;
        sum += view.shade(ray, view.trace(ray, x, y), &facing);
      }
    }
    out.colour(y, x) = sum * 0.25F;
  }
}

}  // namespace

Rendering render(const World& world, const Moment& moment, const SequenceCamera& camera,
                 const Pose& pose) {
  const cv::Size size = camera.image_size;
  Rendering out{cv::Mat3f(size), cv::Mat1f(size), cv::Mat1f(size), cv::Mat1i(size)};
  const View view(world, moment, camera, pose);
  for (const auto& pass : {trace_row, smooth_row}) {
    cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& rows) {
      for (int y = rows.start; y < rows.end; ++y) pass(view, y, out);
    });
  }
  return out;
}

cv::Mat3b expose(const cv::Mat3f& colour, std::uint64_t key) {
  cv::Mat3b image(colour.size());
  cv::parallel_for_(cv::Range(0, image.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      const cv::Vec3f* from = colour.ptr<cv::Vec3f>(y);
      cv::Vec3b* to = image.ptr<cv::Vec3b>(y);
      for (int x = 0; x < image.cols; ++x) {
        std::uint64_t bits = make_key(key, y, x);
        for (int c = 0; c < 3; ++c) {
          // The sum of two bytes: a triangle of standard deviation 104, scaled to 1.5 grey levels.
          const int sum = static_cast<int>(bits & 255U) + static_cast<int>((bits >> 8U) & 255U);
          const float noise = static_cast<float>(sum - 255) * (1.5F / 104.5F);
          bits >>= 16U;
          to[x][c] = static_cast<std::uint8_t>(std::clamp(from[x][c] + noise, 0.0F, 255.0F) + 0.5F);
        }
      }
    }
  });
  return image;
}

}  // namespace dynfilter::scene
