// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <limits>

#include <opencv2/core.hpp>

namespace dynfilter::scene {

constexpr double no_hit = std::numeric_limits<double>::infinity();

/// A ray: points origin + t * direction. A camera's rays have a direction of depth 1, so t is the
/// depth.
struct Ray {
  cv::Vec3d origin;
  cv::Vec3d direction;

  cv::Vec3d at(double t) const { return origin + direction * t; }
};

struct Sphere {
  cv::Vec3d centre;
  double radius = 0;
};

/// A point of a surface: its normal, and its texture coordinates in metres.
struct SurfacePoint {
  cv::Vec3d normal;
  double u = 0;
  double v = 0;
};

/// A hit on a body with flat faces: face 2k is at the low end of axis k, 2k+1 at the high end.
struct FaceHit {
  double t = no_hit;
  int face = 0;
};

/// The inside of the axis-aligned room.
struct RoomBox {
  cv::Vec3d low;
  cv::Vec3d high;

  /// Returns the face through which a ray that starts inside leaves.
  FaceHit hit(const Ray& ray) const;
  SurfacePoint surface(const cv::Vec3d& point, int face) const;
};

/// A block that stands upright, turned about the vertical.
struct Block {
  cv::Vec3d centre;
  cv::Vec2d texture_offset_m;  // so that equal blocks look different
  cv::Vec3d half_size;
  double cosine = 1;
  double sine = 0;
  int material = 0;

  FaceHit hit(const Ray& ray) const;
  SurfacePoint surface(const cv::Vec3d& point, int face) const;
  Sphere bounds() const;

  /// Convert a point from the world to the block's axes and back.
  cv::Vec3d to_local(const cv::Vec3d& point) const { return turned(point - centre); }
  cv::Vec3d to_world(const cv::Vec3d& local) const;

 private:
  cv::Vec3d turned(const cv::Vec3d& vector) const;
};

/// A part of a body: a capsule of elliptic section that may taper. Its axis starts at `base`.
class Limb {
 public:
  Limb() = default;
  /// Takes the half widths along `side` and across it at the base, and the height `cap` of the
  /// rounded ends. `taper` is the section at the tip relative to the base.
  Limb(const cv::Vec3d& base, const cv::Vec3d& tip, const cv::Vec3d& side, cv::Vec2d half_widths,
       double cap, double taper);

  /// Returns the first t of a ray that starts outside, or no_hit.
  double hit(const Ray& ray) const;
  /// Returns the surface at a point: u runs around the limb from its front, v from base to tip.
  SurfacePoint surface(const cv::Vec3d& point) const;
  Sphere bounds() const;

  /// Convert a point from the world to the limb's own coordinates and back. A point of the body
  /// keeps its own coordinates when the limb moves.
  cv::Vec3d to_local(const cv::Vec3d& point) const { return to_local_ * (point - base_); }
  cv::Vec3d to_world(const cv::Vec3d& local) const { return base_ + to_local_.inv() * local; }

 private:
  cv::Matx33d to_local_;  // in units of the half widths and of the cap
  cv::Vec3d base_;
  cv::Vec3d tip_;
  double length_ = 0;  // of the axis, in units of the cap
  double slope_ = 0;   // of the radius along the axis, both local
  double tip_radius_ = 1;
  double mean_radius_m_ = 0;
  double cap_m_ = 1;
  double reach_m_ = 0;
};

}  // namespace dynfilter::scene
