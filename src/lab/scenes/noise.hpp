// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Random numbers as pure functions of (seed, use, place). Nothing here has a state, so results
// depend neither on the order of calls nor on the number of threads.

#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace dynfilter::scene {

/// Returns a 64-bit hash of the bits, the finaliser of splitmix64 (G. Steele, D. Lea, C. Flood,
/// "Fast splittable pseudorandom number generators", OOPSLA 2014).
inline std::uint64_t mixed_bits(std::uint64_t bits) {
  bits += 0x9E3779B97F4A7C15U;
  bits = (bits ^ (bits >> 30U)) * 0xBF58476D1CE4E5B9U;
  bits = (bits ^ (bits >> 27U)) * 0x94D049BB133111EBU;
  return bits ^ (bits >> 31U);
}

/// The uses of random numbers; no two uses share a number.
enum class Stream : std::uint64_t {
  wall = 1,
  floor,
  furniture = 4,
  layout,
  garment,
  body,
  walk,
  camera,
  image_noise,
  depth_noise,
  mask_limbs = 14,
  mask_noise,
  detection,
  box = 19
};

/// Makes one key from a seed and any number of integers.
template <class... Numbers>
std::uint64_t make_key(std::uint64_t seed, Numbers... numbers) {
  std::uint64_t key = mixed_bits(seed);
  ((key = mixed_bits(key ^ static_cast<std::uint64_t>(numbers))), ...);
  return key;
}

/// Returns the number in [0, 1) that belongs to a key.
inline double unit(std::uint64_t key) {
  return static_cast<double>(mixed_bits(key) >> 11U) * 0x1.0p-53;
}

/// Returns the number in [low, high) that belongs to a key.
inline double between(std::uint64_t key, double low, double high) {
  return low + (high - low) * unit(key);
}

/// Adds smooth value noise in [-amplitude, amplitude]; its grid has a node every `cell` pixels.
/// Seamless at the borders if `cell` divides the size. O(pixels).
void add_noise(cv::Mat1f& field, int cell, float amplitude, std::uint64_t key);

/// Makes a field of smooth noise in [-1, 1].
cv::Mat1f noise_field(cv::Size size, int cell, std::uint64_t key);

}  // namespace dynfilter::scene
