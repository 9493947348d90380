// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::scene {

/// A repeating texture with its smaller copies (mipmaps). Distant surfaces read from a smaller
/// copy, so that they do not flicker from frame to frame.
class Texture {
 public:
  /// Takes BGR values from 0 to 255; both sides must be powers of two. `texel_m` is the side of a
  /// texel.
  Texture(const cv::Mat3f& pixels, double texel_m);

  /// Returns the colour at (u, v) metres, averaged over about `footprint_m`.
  cv::Vec3f sample(double u, double v, double footprint_m) const;

 private:
  std::vector<cv::Mat3b> levels_;
  double texel_m_;
};

/// A canvas for painting textures: BGR values, coordinates in texels, wrapping at the borders.
class Canvas {
 public:
  Canvas(cv::Size size, cv::Vec3f colour);

  cv::Mat3f& pixels() { return pixels_; }

  /// Adds noise of equal strength in every octave from `coarsest` texels down to 2 (about 1/f).
  /// `tint` says how strongly each channel follows it.
  void noise(int coarsest, float amplitude, cv::Vec3f tint, std::uint64_t key);
  void rectangle(cv::Rect area, cv::Vec3f colour, float opacity = 1.0F);
  void disc(cv::Point centre, int radius, cv::Vec3f colour, float opacity = 1.0F);
  /// Paints square cells, each a random mixture of two colours.
  void mosaic(cv::Rect area, int cell, cv::Vec3f first, cv::Vec3f second, std::uint64_t key);
  /// Paints rows of short strokes that look like a printed page.
  void writing(cv::Rect area, int line_height, cv::Vec3f colour, std::uint64_t key);
  /// Scales the differences from the mean colour.
  void contrast(double factor);

 private:
  void blend(int x, int y, const cv::Vec3f& colour, float opacity);

  cv::Mat3f pixels_;
};

/// The garments of a person; each is one texture.
enum class Garment : std::uint8_t { shirt, trousers, skin, hair, shoe };
constexpr int garments = 5;

/// The materials of the room and its furniture; each is one texture.
enum class Material : std::uint8_t { wall, floor, ceiling, wood, cardboard, books, screen, cloth };
constexpr int materials = 8;

/// Paints the texture of a material; `contrast` scales the differences from its mean colour.
Texture paint_material(Material material, double contrast, std::uint64_t seed);

/// Paints the texture of a person's garment.
Texture paint_garment(Garment garment, int person, std::uint64_t seed);

}  // namespace dynfilter::scene
