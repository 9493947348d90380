// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "geometry.hpp"

#include <algorithm>
#include <cmath>

namespace dynfilter::scene {
namespace {

cv::Vec3d unit_axis(int axis, double length) {
  cv::Vec3d vector(0, 0, 0);
  vector[axis] = length;
  return vector;
}

/// Sets the texture coordinates of a face, upright: u along the floor, v downwards.
void set_face_coordinates(SurfacePoint& surface, const cv::Vec3d& local, int axis) {
  surface.u = axis == 0 ? local[1] : local[0];
  surface.v = axis == 2 ? local[1] : -local[2];
}

/// Returns the first t at which |origin + t direction - (0, 0, z)| is the radius, or no_hit.
double sphere_hit(const cv::Vec3d& origin, const cv::Vec3d& direction, double z, double radius) {
  const cv::Vec3d from(origin[0], origin[1], origin[2] - z);
  const double a = direction.dot(direction);
  const double b = from.dot(direction);
  const double c = from.dot(from) - radius * radius;
  const double root = b * b - a * c;
  if (root < 0) return no_hit;
  const double t = (-b - std::sqrt(root)) / a;
  return t > 0 ? t : no_hit;
}

/// Returns the first hit of the cone x^2 + y^2 = (1 + slope z)^2 between z = 0 and `length`, or
/// no_hit.
double cone_hit(const cv::Vec3d& o, const cv::Vec3d& d, double slope, double length) {
  const double radius = 1 + slope * o[2];
  const double change = slope * d[2];
  const double a = d[0] * d[0] + d[1] * d[1] - change * change;
  const double b = o[0] * d[0] + o[1] * d[1] - change * radius;
  const double c = o[0] * o[0] + o[1] * o[1] - radius * radius;
  const double root = b * b - a * c;
  if (root < 0 || std::abs(a) < 1e-12) return no_hit;
  const double spread = std::sqrt(root);
  double nearest = no_hit;
  for (const double t : {(-b - spread) / a, (-b + spread) / a}) {
    const double z = o[2] + t * d[2];
    if (t > 0 && z >= 0 && z <= length) nearest = std::min(nearest, t);
  }
  return nearest;
}

}  // namespace

FaceHit RoomBox::hit(const Ray& ray) const {
  FaceHit hit;
  for (int axis = 0; axis < 3; ++axis) {
    const double direction = ray.direction[axis];
    if (direction == 0) continue;
    const double end = direction > 0 ? high[axis] : low[axis];
    const double t = (end - ray.origin[axis]) / direction;
    if (t < hit.t) hit = {t, 2 * axis + (direction > 0 ? 1 : 0)};
  }
  return hit;
}

SurfacePoint RoomBox::surface(const cv::Vec3d& point, int face) const {
  SurfacePoint surface;
  surface.normal = unit_axis(face / 2, face % 2 == 0 ? 1.0 : -1.0);
  const cv::Vec3d corner(low[0], low[1], high[2]);
  set_face_coordinates(surface, point - corner, face / 2);
  return surface;
}

cv::Vec3d Block::turned(const cv::Vec3d& vector) const {
  return {cosine * vector[0] + sine * vector[1], cosine * vector[1] - sine * vector[0], vector[2]};
}

cv::Vec3d Block::to_world(const cv::Vec3d& local) const {
  return centre + cv::Vec3d(cosine * local[0] - sine * local[1],
                            sine * local[0] + cosine * local[1], local[2]);
}

FaceHit Block::hit(const Ray& ray) const {
  const cv::Vec3d origin = turned(ray.origin - centre);
  const cv::Vec3d direction = turned(ray.direction);
  FaceHit entry{0, -1};
  double exit = no_hit;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) {
      if (std::abs(origin[axis]) > half_size[axis]) return {};
      continue;
    }
    const double facing = direction[axis] > 0 ? -half_size[axis] : half_size[axis];
    const double t_in = (facing - origin[axis]) / direction[axis];
    const double t_out = (-facing - origin[axis]) / direction[axis];
    if (t_in > entry.t) entry = {t_in, 2 * axis + (direction[axis] > 0 ? 0 : 1)};
    exit = std::min(exit, t_out);
  }
  return entry.face >= 0 && entry.t <= exit ? entry : FaceHit{};
}

SurfacePoint Block::surface(const cv::Vec3d& point, int face) const {
  const cv::Vec3d local = turned(point - centre);
  SurfacePoint surface;
  const cv::Vec3d normal = unit_axis(face / 2, face % 2 == 0 ? -1.0 : 1.0);
  surface.normal = {cosine * normal[0] - sine * normal[1], sine * normal[0] + cosine * normal[1],
                    normal[2]};
  set_face_coordinates(surface, local, face / 2);
  // An offset, so that the faces of a block look different.
  surface.u += 0.37 * face + texture_offset_m[0];
  surface.v += 0.23 * face + texture_offset_m[1];
  return surface;
}

Sphere Block::bounds() const { return {centre, std::sqrt(half_size.dot(half_size))}; }

Limb::Limb(const cv::Vec3d& base, const cv::Vec3d& tip, const cv::Vec3d& side,
           cv::Vec2d half_widths, double cap, double taper)
    : base_(base), tip_(tip), tip_radius_(taper), cap_m_(cap) {
  const cv::Vec3d span = tip - base;
  const double span_m = std::sqrt(span.dot(span));
  // A limb without an axis (a head) stands upright.
  const cv::Vec3d axis = span_m > 1e-9 ? span * (1 / span_m) : cv::Vec3d(0, 0, 1);
  cv::Vec3d across = side - axis * side.dot(axis);
  across *= 1 / std::sqrt(across.dot(across));
  const cv::Vec3d front = across.cross(axis);
  for (int i = 0; i < 3; ++i) {
    to_local_(0, i) = across[i] / half_widths[0];
    to_local_(1, i) = front[i] / half_widths[1];
    to_local_(2, i) = axis[i] / cap;
  }
  length_ = span_m / cap;
  slope_ = length_ > 1e-9 ? (taper - 1) / length_ : 0;
  mean_radius_m_ = (half_widths[0] + half_widths[1]) * 0.25 * (1 + taper);
  reach_m_ = span_m / 2 + std::max({half_widths[0], half_widths[1], cap}) * std::max(1.0, taper);
}

double Limb::hit(const Ray& ray) const {
  const cv::Vec3d origin = to_local_ * (ray.origin - base_);
  const cv::Vec3d direction = to_local_ * ray.direction;
  const double side = length_ > 1e-9 ? cone_hit(origin, direction, slope_, length_) : no_hit;
  const double start = sphere_hit(origin, direction, 0, 1);
  const double end = sphere_hit(origin, direction, length_, tip_radius_);
  return std::min({side, start, end});
}

SurfacePoint Limb::surface(const cv::Vec3d& point) const {
  const cv::Vec3d local = to_local_ * (point - base_);
  cv::Vec3d normal(local[0], local[1], 0);
  if (local[2] < 0)
    normal[2] = local[2];
  else if (local[2] > length_)
    normal[2] = local[2] - length_;
  else
    normal[2] = -slope_ * (1 + slope_ * local[2]);
  normal = to_local_.t() * normal;
  SurfacePoint surface;
  surface.normal = normal * (1 / std::sqrt(normal.dot(normal)));
  surface.u = std::atan2(local[0], local[1]) * mean_radius_m_;
  surface.v = local[2] * cap_m_;
  return surface;
}

Sphere Limb::bounds() const { return {(base_ + tip_) * 0.5, reach_m_}; }

}  // namespace dynfilter::scene
