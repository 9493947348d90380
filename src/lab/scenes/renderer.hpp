// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "moment.hpp"
#include "texture.hpp"

namespace dynfilter::scene {

constexpr double frames_per_second = 30;

/// The static world, and the textures of everything that moves.
struct World {
  explicit World(const SyntheticSceneOptions& options);

  RoomBox room;
  std::vector<Block> blocks;
  std::vector<Texture> materials;  // by Material
  std::vector<Texture> garments;   // by person, then Garment
  bool changing_light;             // as in the options
};

/// Returns the camera's pose some seconds after frame 0: smooth sines with seeded phases.
Pose camera_at(const SyntheticSceneOptions& options, double elapsed_s);

/// The surface that a pixel's ray hits: a face of the room, a face of a block, or a part of a
/// person. Boxes that move have the numbers after the world's blocks.
class SurfaceId {
 public:
  static int room(int face) { return face; }
  static int block(int index, int face) { return 6 + 6 * index + face; }
  static int part(int person, int index) { return first_part + parts_a_person * person + index; }

  static bool is_part(int id) { return id >= first_part; }
  static bool is_block(int id) { return id >= block(0, 0) && id < first_part; }
  static int block_index(int id) { return (id - block(0, 0)) / 6; }
  static int person(int id) { return (id - first_part) / parts_a_person; }
  static int part_index(int id) { return (id - first_part) % parts_a_person; }

 private:
  static constexpr int first_part = 1 << 16;
  static constexpr int parts_a_person = 64;
};

/// The camera's view before any sensor.
struct Rendering {
  cv::Mat3f colour;   // BGR, 0 to 255, edges smoothed
  cv::Mat1f depth;    // metres along the optical axis, at the pixel's centre
  cv::Mat1f facing;   // cosine between the ray and the surface's normal
  cv::Mat1i surface;  // SurfaceId
};

Rendering render(const World& world, const Moment& moment, const SequenceCamera& camera,
                 const Pose& pose);

/// Adds the sensor's noise to the colour image and rounds to bytes.
cv::Mat3b expose(const cv::Mat3f& colour, std::uint64_t key);

/// Returns the exact silhouettes of all persons with a visible pixel, ordered by person. `surface`
/// holds the frame's SurfaceIds.
std::vector<Instance> true_instances(const cv::Mat1i& surface, int persons);

/// Returns the instances that the options let a network find in a frame, by falling score.
std::vector<Instance> detections(const SyntheticSceneOptions& options, int frame,
                                 const cv::Mat1i& surface);

constexpr double depth_units_per_metre = 5000;

/// Measures depth as the first Kinect does, registered to the colour image: CV_16UC1.
cv::Mat1w measure_depth(const Rendering& rendering, const SequenceCamera& camera,
                        const SyntheticSceneOptions& options, std::uint64_t key);

}  // namespace dynfilter::scene
