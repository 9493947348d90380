// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion.hpp"

#include <cstddef>
#include <cstdint>

namespace dynfilter::scene {

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
        place = place_before(point, now.boxes[box], before.boxes[box]);
      } else {
        const auto person = static_cast<std::size_t>(SurfaceId::person(id));
        const auto part = static_cast<std::size_t>(SurfaceId::part_index(id));
        place = place_before(point, now.bodies[person][part], before.bodies[person][part]);
      }
      if (cv::norm(point - place) >= min_moved_m) moving(y, x) = 255;
    }
  }
  return moving;
}

}  // namespace dynfilter::scene
