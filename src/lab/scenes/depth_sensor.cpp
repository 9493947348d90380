// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "renderer.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "noise.hpp"

namespace dynfilter::scene {
namespace {

// The sensor: a projector 7.5 cm to the right of a camera of 580 px, with disparity in eighths of a
// pixel. One step of disparity is 2.9e-3 z^2 metres.
constexpr double baseline_m = 0.075;
constexpr double sensor_focal_px = 580;
constexpr double steps_a_pixel = 8;

constexpr double noise_px = 0.10;    // standard deviation of the disparity, in patches
constexpr double step_share = 0.06;  // a relative change of 1/z that makes a depth step
constexpr double max_depth_m = 9;
constexpr double edge_shift_px = 2.2;  // of depth against colour at edges, at a width of 640
// With noise above it, the sensor's window bridges the shadow.
constexpr float filled_shadow = -0.10F;
constexpr float lost_step = 0.55F;  // with noise above it, nothing is measured at a depth step
constexpr float hole = 0.49F;       // with noise above it, a pixel at 2 m is a hole

/// What DepthFaults stands for; lengths in pixels of an image of 640x480.
struct Faults {
  double hole_slope;        // growth of holes with distance, a metre
  double fringe_px = 0;     // reach of the patches along near edges that lose depth
  double blind_top_px = 0;  // rows without depth, as if the colour camera saw more
  double bald_share = 0;    // of the hair that has no depth, in patches
  double shift_px = 0;      // of the depth image to the right, as from a poor registration
};

Faults faults_of(DepthFaults faults) {
  if (faults == DepthFaults::few) return {0.16};
  if (faults == DepthFaults::many) return {0.45, 12, 20};
  return {0.45, 12, 20, 0.8, 6};
}

/// Makes noise with patches of this size, given for an image 640 pixels wide.
cv::Mat1f patches(cv::Size size, double cell_px, std::uint64_t key) {
  return noise_field(size, std::max(1, static_cast<int>(std::lround(cell_px * size.width / 640.0))),
                     key);
}

/// Holds the noise that disturbs one frame.
struct Disturbance {
  Disturbance(cv::Size size, bool with_fringe, bool with_hair, std::uint64_t key)
      : disparity(patches(size, 4, make_key(key, 1))),
        shift_x(patches(size, 14, make_key(key, 2))),
        shift_y(patches(size, 14, make_key(key, 3))),
        edges(patches(size, 9, make_key(key, 4))),
        shadow(patches(size, 16, make_key(key, 5))),
        holes(patches(size, 20, make_key(key, 6))) {
    add_noise(holes, std::max(1, 6 * size.width / 640), 0.35F, make_key(key, 7));
    if (with_fringe) fringe = patches(size, 12, make_key(key, 8));
    if (with_hair) hair = patches(size, 6, make_key(key, 9));
  }

  cv::Mat1f disparity, shift_x, shift_y, edges, shadow, holes, fringe, hair;
};

/// Marks the pixels that the projector does not light. It stands right of the camera, so a near
/// surface hides what lies left of its left edge: along a row, from right to left, the projector's
/// column of visible points falls.
void cast_shadow(const cv::Mat1f& depth, double focal_baseline, int y, cv::Mat1b& shadow) {
  double leftmost = no_hit;
  for (int x = depth.cols - 1; x >= 0; --x) {
    const double column = x - focal_baseline / static_cast<double>(depth(y, x));
    shadow(y, x) = column > leftmost + 0.75 ? 1 : 0;
    leftmost = std::min(leftmost, column);
  }
}

/// Tells whether depth jumps within two pixels (at 640 pixels' width) of this one.
bool at_step(const cv::Mat1f& depth, int reach, int x, int y) {
  const float here = depth(y, x);
  const auto jumps = [&](int column, int row) {
    if (column < 0 || row < 0 || column >= depth.cols || row >= depth.rows) return false;
    const float there = depth(row, column);
    return std::abs(there - here) > static_cast<float>(step_share) * std::min(there, here);
  };
  return jumps(x - reach, y) || jumps(x + reach, y) || jumps(x, y - reach) || jumps(x, y + reach);
}

/// Tells whether this surface ends within `reach` pixels, before a farther one.
bool ends_within(const cv::Mat1f& depth, int reach, int x, int y) {
  const float farther = depth(y, x) * static_cast<float>(1 + 2 * step_share);
  for (int step = 1; step <= reach; ++step) {
    if (depth(y, std::max(x - step, 0)) > farther) return true;
    if (depth(y, std::min(x + step, depth.cols - 1)) > farther) return true;
    if (depth(std::max(y - step, 0), x) > farther) return true;
    if (depth(std::min(y + step, depth.rows - 1), x) > farther) return true;
  }
  return false;
}

/// Returns the index of the hair among the parts of every body.
int hair_index(const SyntheticSceneOptions& options) {
  const std::vector<BodyPart> body = body_at(options, 0, 0);
  const auto hair = std::find_if(
      body.begin(), body.end(), [](const BodyPart& part) { return part.garment == Garment::hair; });
  return static_cast<int>(hair - body.begin());
}

bool is_lost(const Rendering& seen, const Disturbance& disturbance, int reach, float slope, int x,
             int y) {
  const float z = seen.depth(y, x);
  const float edge = disturbance.edges(y, x);
  // The projector's dots smear out on a surface seen at a grazing angle.
  if (seen.facing(y, x) < 0.12F + 0.25F * edge) return true;
  if (edge > lost_step && at_step(seen.depth, reach, x, y)) return true;
  // Less light comes back from far away.
  return disturbance.holes(y, x) > hole + slope * (3.5F - z);
}

std::uint16_t quantised(double depth_m, double noise) {
  const double disparity = sensor_focal_px * baseline_m / depth_m + noise;
  const double steps = std::max(std::round(disparity * steps_a_pixel), 1.0);
  const double measured = sensor_focal_px * baseline_m * steps_a_pixel / steps;
  return static_cast<std::uint16_t>(std::min(measured * depth_units_per_metre + 0.5, 65535.0));
}

}  // namespace

cv::Mat1w measure_depth(const Rendering& rendering, const SequenceCamera& camera,
                        const SyntheticSceneOptions& options, std::uint64_t key) {
  const cv::Size size = rendering.depth.size();
  const Faults faults = faults_of(options.depth_faults);
  const Disturbance disturbance(size, faults.fringe_px > 0, faults.bald_share > 0, key);
  const double scale = size.width / 640.0;
  const auto fringe_px = static_cast<float>(faults.fringe_px * scale);
  const int reach = std::max(1, static_cast<int>(std::lround(2 * scale)));
  const auto shift_px = static_cast<float>(edge_shift_px * scale);
  const int constant_shift = static_cast<int>(std::lround(faults.shift_px * scale));
  const auto slope = static_cast<float>(faults.hole_slope);
  // Noise below this bound takes its share of the hair: it is about uniform in [-0.75, 0.75].
  const auto bald = static_cast<float>(1.5 * faults.bald_share - 0.75);
  const int hair = hair_index(options);
  cv::Mat1b shadow(size);
  cv::Mat1w raw(size);
  cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      cast_shadow(rendering.depth, camera.fx * baseline_m, y, shadow);
      for (int x = 0; x < size.width; ++x) {
        const double z = static_cast<double>(rendering.depth(y, x));
        const bool dark = shadow(y, x) != 0 && disturbance.shadow(y, x) <= filled_shadow;
        const double noise = noise_px * static_cast<double>(disturbance.disparity(y, x));
        const int fringe =
            fringe_px > 0 ? static_cast<int>(fringe_px * disturbance.fringe(y, x)) : 0;
        const int id = rendering.surface(y, x);
        const bool hairy = faults.bald_share > 0 && SurfaceId::is_part(id) &&
                           SurfaceId::part_index(id) == hair && disturbance.hair(y, x) < bald;
        const bool lost = z > max_depth_m || dark || hairy ||
                          is_lost(rendering, disturbance, reach, slope, x, y) ||
                          ends_within(rendering.depth, fringe, x, y);
        raw(y, x) = lost ? std::uint16_t{0} : quantised(z, noise);
      }
    }
  });
  cv::Mat1w registered(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const auto dx = static_cast<int>(std::lround(shift_px * disturbance.shift_x(y, x)));
      const auto dy = static_cast<int>(std::lround(shift_px * disturbance.shift_y(y, x)));
      registered(y, x) = raw(std::clamp(y + dy, 0, size.height - 1),
                             std::clamp(x + dx - constant_shift, 0, size.width - 1));
    }
  }
  const double blind = faults.blind_top_px * size.height / 480.0;
  registered.rowRange(0, std::min(static_cast<int>(std::lround(blind)), size.height)).setTo(0);
  return registered;
}

}  // namespace dynfilter::scene
