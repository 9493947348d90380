// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Puts a card of no class, which moves, into a rendered frame, by depth.

#ifndef DYNFILTER_BENCH_MOVING_CARD_HPP
#define DYNFILTER_BENCH_MOVING_CARD_HPP

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/core.hpp>
#include "lab/scenes/synthetic_scene.hpp"

/// Card of no class that moves, in the first camera's frame.
struct Mover {
  cv::Vec3d place_m{0.1, 0, 1.3}, speed_m_s{0, 0, 0};
  double half_side_m = 0.22;
  int start_index = 0;          ///< frame from which on it moves; it rests before
  bool is_there_before = true;  ///< whether it is seen while it rests
};

/// Texture of a card: blocks and stripes of several sizes.
inline double card_brightness(double x_m, double y_m) {
  const auto cell = [](double v, double size) { return static_cast<int>(std::floor(v / size)); };
  const int coarse = cell(x_m, 0.07) * 7 + cell(y_m, 0.06) * 13;
  const int fine = cell(x_m, 0.023) * 31 + cell(y_m, 0.019) * 17;
  return 60 + 25 * (coarse & 3) + 14 * (fine * fine % 5);
}

/// Puts the card into image and depth. Returns its visible pixels; none before it is there.
inline cv::Mat1b add_mover(const Mover& mover, const dynfilter::SyntheticScene& scene, int index,
                           dynfilter::SyntheticFrame& rendered) {
  const dynfilter::CameraParameters camera = scene.camera();
  const dynfilter::CameraPose first = scene.pose(0), now = scene.pose(index);
  const cv::Matx33d turn = first.rotation.t() * now.rotation;
  const cv::Vec3d origin = first.rotation.t() * (now.translation - first.translation);
  const double moved_s =
      std::max(scene.timestamp_s(index) - scene.timestamp_s(mover.start_index), 0.0);
  const cv::Vec3d centre = mover.place_m + mover.speed_m_s * moved_s;
  cv::Mat image = rendered.frame.image, depth = rendered.frame.depth;
  cv::Mat1b visible(image.size(), std::uint8_t{0});
  if (index < mover.start_index && !mover.is_there_before) return visible;
  cv::RNG noise(static_cast<std::uint64_t>(index) + 1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      double brightness = 0, depth_m = 0;
      int inside = 0;
      for (int sample = 0; sample < 4; ++sample) {  // smooths the edges of the texture
        const double px = x + 0.5 * (sample % 2) - 0.25, py = y + 0.5 * (sample / 2) - 0.25;
        const cv::Vec3d ray =
            turn * cv::Vec3d((px - camera.cx) / camera.fx, (py - camera.cy) / camera.fy, 1);
        depth_m = (centre[2] - origin[2]) / ray[2];
        const cv::Vec3d on_card = origin + ray * depth_m - centre;
        if (std::max(std::abs(on_card[0]), std::abs(on_card[1])) > mover.half_side_m) continue;
        brightness += card_brightness(on_card[0], on_card[1]);
        ++inside;
      }
      const double behind_m = double{rendered.exact_depth_m.at<float>(y, x)};
      if (inside < 4 || depth_m > behind_m) continue;
      visible(y, x) = 255;
      const double value = brightness / inside + noise.gaussian(1.5);
      image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(value));
      const double sensed_m = depth_m + noise.gaussian(0.0015 * depth_m * depth_m);
      depth.at<std::uint16_t>(y, x) = cv::saturate_cast<std::uint16_t>(sensed_m * 5000);
    }
  }
  return visible;
}

/// Paints the pixels of the instances.
inline cv::Mat1b painted(const dynfilter::Segmentation& segmentation, cv::Size size) {
  cv::Mat1b image(size, std::uint8_t{0});
  for (const dynfilter::Instance& instance : segmentation.instances) {
    const cv::Rect place(instance.mask_origin, instance.mask.size());
    image(place).setTo(255, instance.mask);
  }
  return image;
}

#endif  // DYNFILTER_BENCH_MOVING_CARD_HPP
