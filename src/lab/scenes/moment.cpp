// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "moment.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "noise.hpp"
#include "renderer.hpp"

namespace dynfilter::scene {
namespace {

constexpr double thigh_m = 0.44;
constexpr double shin_m = 0.42;
constexpr double ankle_m = 0.09;
constexpr double stride_m = 1.30;
constexpr double sharpness = 0.96;  // of the turns of what goes back and forth; 1 = no rounding

/// A person's state on the way, which leads back and forth along the world's x.
struct Walk {
  cv::Vec2d place;
  cv::Vec2d forward;  // unit
  double pace = 0;    // 0 standing to 1 at full speed
  double swing = 1;   // of limbs and shoulders; 1 = a brisk walk
  bool sits = false, works = false;
  double covered = 0;  // metres walked; they drive the legs, so that feet do not slide
};

/// How long a person has walked, and the speed now, from 0 to 1.
struct WalkingTime {
  double walked_s = 0;
  double speed = 1;
};

/// Walks for 2 s and stands for 2 s, again and again. Speeding up and slowing down take 0.3 s of
/// the time on the way.
WalkingTime walking_time(const SyntheticSceneOptions& options, int person, double elapsed_s) {
  if (options.walking != Walking::stop_and_go) return {elapsed_s, 1};
  constexpr double ramp_s = 0.3, go_s = 2, period_s = 4;
  const double start = unit(make_key(options.seed, Stream::walk, person));
  const double periods = std::floor(elapsed_s / period_s + start);
  const double now_s = elapsed_s - (periods - start) * period_s;  // since the last start
  const double walked_s = go_s - ramp_s;                          // in a period, at full speed
  const double before_s = periods * walked_s;
  if (now_s < ramp_s) return {now_s * now_s / (2 * ramp_s) + before_s, now_s / ramp_s};
  if (now_s < go_s - ramp_s) return {now_s - ramp_s / 2 + before_s, 1};
  const double left_s = std::max(go_s - now_s, 0.0);
  return {walked_s - left_s * left_s / (2 * ramp_s) + before_s, left_s / ramp_s};
}

cv::Vec2d middle_of_way(const SyntheticSceneOptions& options, int person) {
  const double rank = person - 0.5 * (options.persons - 1);
  return {options.persons_spacing_m * rank,
          options.person_distance_m + options.persons_gap_m * (person % 2) + 0.05 * (person / 2)};
}

/// Returns the state of a person who stays in the middle of the way.
Walk stay(const SyntheticSceneOptions& options, int person, double elapsed_s) {
  Walk walk;
  walk.place = middle_of_way(options, person);
  const double turn = between(make_key(options.seed, Stream::walk, person, 1), -0.4, 0.4);
  walk.forward = {std::sin(turn), -std::cos(turn)};
  walk.swing = options.limb_swing;
  walk.sits = options.walking == Walking::one_sits;
  walk.works = options.walking == Walking::one_works;
  if (walk.works) walk.covered = elapsed_s;  // an arm's round takes as long as a stride of 1 m/s
  return walk;
}

/// Follows a triangle wave with rounded corners: an even pace, and turns of a few tenths of a
/// second.
Walk walk_at(const SyntheticSceneOptions& options, int person, double elapsed_s) {
  if (options.walking >= Walking::one_stands && person == 0) {
    return stay(options, person, elapsed_s);
  }
  const WalkingTime time = walking_time(options, person, elapsed_s);
  const double slowest = std::sqrt(1 - sharpness * sharpness);
  const double peak = std::asin(sharpness);
  const double turn_m = options.turn_distance_m;
  const std::uint64_t key = make_key(options.seed, Stream::walk);
  double phase =
      time.walked_s * options.person_speed_m_s * peak / turn_m - between(key, 0.30, 0.42) * CV_PI;
  const bool together =
      options.walking == Walking::together || options.walking == Walking::stop_and_go;
  if (!together && person % 2 == 1) phase += CV_PI;
  const double x = turn_m * std::asin(sharpness * std::sin(phase)) / peak;
  const double speed =
      std::cos(phase) / std::sqrt(1 - sharpness * sharpness * std::sin(phase) * std::sin(phase));
  const double half_turns = std::floor(phase / CV_PI + 0.5);
  const bool rightward = std::fmod(std::abs(half_turns), 2.0) < 0.5;

  Walk walk;
  walk.place = middle_of_way(options, person);
  walk.place[0] += x;
  // A person who turns faces the camera half-way, and always looks a little towards it.
  walk.forward = {speed, -0.30 - slowest * (1 - std::abs(speed))};
  if (options.surroundings == Surroundings::workplace) walk.forward = {0, -1};
  walk.forward *= 1 / std::sqrt(walk.forward.dot(walk.forward));
  walk.pace = std::abs(speed) * time.speed;
  walk.swing = options.limb_swing;
  walk.covered = turn_m * (2 * half_turns + 1) + (rightward ? x : -x);
  return walk;
}

/// Joint angles of one side of the body in the walking plane: 0 hangs down, forward is positive.
struct Stride {
  double thigh = 0, shin = 0, upper_arm = 0, forearm = 0;
};

Stride stride_at(double phase, const Walk& walk) {
  if (walk.sits) return {1.45, 0.05, 0.35, 0.95};
  if (walk.works) return {0, 0, 0.5 + 0.4 * std::sin(phase), 1.0 + 0.5 * std::cos(phase)};
  const double reach = walk.swing * (0.10 + 0.90 * walk.pace);
  const double lift = std::max(0.0, std::cos(phase));  // the leg that swings forward is bent
  Stride stride;
  stride.thigh = reach * (0.43 * std::sin(phase) + 0.06);
  stride.shin = stride.thigh - reach * (0.10 + 0.75 * lift * lift);
  stride.upper_arm = -reach * 0.50 * std::sin(phase) - 0.05;
  stride.forearm = stride.upper_arm + 0.35 + reach * 0.25 * (1 - std::sin(phase));
  return stride;
}

/// Builds the parts of a body that is `scale` times as tall as a person of 1.75 m.
class Body {
 public:
  Body(const Walk& walk, double scale)
      : scale_(scale),
        forward_(walk.forward[0], walk.forward[1], 0),
        left_(-walk.forward[1], walk.forward[0], 0),
        ground_(walk.place[0], walk.place[1], 0) {
    const double phase = 2 * CV_PI * walk.covered / (stride_m * scale);
    const Stride left = stride_at(phase, walk);
    const Stride right = stride_at(phase + CV_PI, walk);
    hip_m_ = ankle_m + std::max(leg_height(left), leg_height(right));
    twist_ = 0.14 * walk.swing * walk.pace * std::sin(phase);
    add_trunk();
    add_head();
    add_arm(left, 1);
    add_arm(right, -1);
    add_leg(left, 1);
    add_leg(right, -1);
  }

  std::vector<BodyPart> parts() && { return std::move(parts_); }

 private:
  static double leg_height(const Stride& stride) {
    return thigh_m * std::cos(stride.thigh) + shin_m * std::cos(stride.shin);
  }

  /// Returns the point at these distances forward, to the left and above the floor.
  cv::Vec3d point(double forward, double left, double up) const {
    return ground_ + (forward_ * forward + left_ * left + cv::Vec3d(0, 0, up)) * scale_;
  }

  cv::Vec3d swing(double angle, double outward) const {
    return (forward_ * std::sin(angle) + cv::Vec3d(0, 0, -std::cos(angle)) + left_ * outward) *
           scale_;
  }

  void add(Garment garment, BodyRegion region, const cv::Vec3d& base, const cv::Vec3d& tip,
           cv::Vec2d half_widths, double cap, double taper) {
    BodyPart part;
    part.limb = Limb(base, tip, shoulder_side(), half_widths * scale_, cap * scale_, taper);
    part.garment = garment;
    part.region = region;
    const auto index = static_cast<double>(parts_.size());
    if (region != BodyRegion::torso && region != BodyRegion::head) {
      part.texture_offset_m = {0.31 * index, 0.17 * index};
    }
    parts_.push_back(part);
  }

  cv::Vec3d shoulder_side() const { return left_ - forward_ * twist_; }

  void add_trunk() {
    const double hip = hip_m_;
    add(Garment::trousers, BodyRegion::torso, point(0, 0, hip - 0.02), point(0, 0, hip + 0.10),
        {0.165, 0.115}, 0.09, 0.93);
    add(Garment::shirt, BodyRegion::torso, point(0, 0, hip + 0.12), point(0.01, 0, hip + 0.45),
        {0.155, 0.110}, 0.095, 1.18);
  }

  void add_head() {
    const double neck = hip_m_ + 0.50;
    add(Garment::skin, BodyRegion::head, point(0.01, 0, neck), point(0.03, 0, neck + 0.12),
        {0.050, 0.053}, 0.05, 1.0);
    const cv::Vec3d centre = point(0.04, 0, neck + 0.205);
    add(Garment::skin, BodyRegion::head, centre, centre, {0.076, 0.094}, 0.125, 1.0);
    const cv::Vec3d crown = point(0.016, 0, neck + 0.242);
    add(Garment::hair, BodyRegion::head, crown, crown, {0.084, 0.098}, 0.108, 1.0);
  }

  void add_arm(const Stride& stride, int side) {
    const bool left = side > 0;
    const cv::Vec3d shoulder =
        point(0, 0, hip_m_ + 0.445) + shoulder_side() * (0.205 * side * scale_);
    const cv::Vec3d elbow = shoulder + swing(stride.upper_arm, 0.12 * side) * 0.28;
    const cv::Vec3d wrist = elbow + swing(stride.forearm, 0.02 * side) * 0.24;
    const cv::Vec3d fingers = wrist + swing(stride.forearm + 0.1, 0.0) * 0.10;
    add(Garment::shirt, left ? BodyRegion::left_upper_arm : BodyRegion::right_upper_arm, shoulder,
        elbow, {0.056, 0.060}, 0.055, 0.80);
    const BodyRegion forearm = left ? BodyRegion::left_forearm : BodyRegion::right_forearm;
    add(Garment::shirt, forearm, elbow, wrist, {0.045, 0.047}, 0.045, 0.78);
    add(Garment::skin, forearm, wrist + (fingers - wrist) * 0.4, fingers, {0.022, 0.042}, 0.045,
        0.85);
  }

  void add_leg(const Stride& stride, int side) {
    const bool left = side > 0;
    const cv::Vec3d hip = point(0, 0.09 * side, hip_m_);
    const cv::Vec3d knee = hip + swing(stride.thigh, 0.01 * side) * thigh_m;
    const cv::Vec3d ankle = knee + swing(stride.shin, 0.0) * shin_m;
    const cv::Vec3d heel = ankle + swing(stride.shin, 0.0) * 0.045;
    const cv::Vec3d toes = heel + swing(stride.shin + 1.45, 0.04 * side) * 0.16;
    add(Garment::trousers, left ? BodyRegion::left_thigh : BodyRegion::right_thigh, hip, knee,
        {0.082, 0.092}, 0.085, 0.75);
    const BodyRegion shin = left ? BodyRegion::left_shin : BodyRegion::right_shin;
    add(Garment::trousers, shin, knee, ankle, {0.063, 0.069}, 0.06, 0.80);
    add(Garment::shoe, shin, heel, toes, {0.042, 0.046}, 0.042, 0.85);
  }

  double scale_;
  cv::Vec3d forward_, left_, ground_;
  double hip_m_ = 0;
  double twist_ = 0;
  std::vector<BodyPart> parts_;
};

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
  const double peak = std::asin(sharpness);
  const double start = unit(make_key(options.seed, Stream::box)) - 0.5;
  const double phase = elapsed_s * pushed_m_s * peak / pushed_way_m + start;
  const double x = pushed_way_m * std::asin(sharpness * std::sin(phase)) / peak;
  return box({x, pushed_distance_m, 0.55}, {0.60, 0.40, 1.10});
}

/// Returns a box before a person's chest, turned as the person is.
Block carried_box(const SyntheticSceneOptions& options, double elapsed_s) {
  const Walk walk = walk_at(options, 0, elapsed_s);
  const cv::Vec2d& forward = walk.forward;
  Block made = box({walk.place[0] + 0.36 * forward[0], walk.place[1] + 0.36 * forward[1], 1.12},
                   {0.46, 0.30, 0.36});
  // The box's local y is the person's forward.
  made.cosine = forward[1];
  made.sine = -forward[0];
  return made;
}

}  // namespace

std::vector<BodyPart> body_at(const SyntheticSceneOptions& options, int person, double elapsed_s) {
  const double scale = between(make_key(options.seed, Stream::body, person), 0.95, 1.06);
  return Body(walk_at(options, person, elapsed_s), scale).parts();
}

cv::Vec2d place_at(const SyntheticSceneOptions& options, int person, double elapsed_s) {
  return walk_at(options, person, elapsed_s).place;
}

Moment moment_at(const SyntheticSceneOptions& options, double elapsed_s) {
  Moment moment{elapsed_s, {}, {}};
  for (int person = 0; person < options.persons; ++person) {
    moment.bodies.push_back(body_at(options, person, elapsed_s));
  }
  if (options.moving_box == MovingBox::pushed) {
    moment.boxes.push_back(pushed_box(options, elapsed_s));
  }
  if (options.moving_box == MovingBox::carried) {
    moment.boxes.push_back(carried_box(options, elapsed_s));
  }
  return moment;
}

cv::Mat1b moving_pixels(const World& world, const Moment& now, const Moment& before,
                        const Rendering& rendering, const SequenceCamera& camera,
                        const Pose& pose) {
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
