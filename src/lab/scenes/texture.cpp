// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "texture.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "noise.hpp"

namespace dynfilter::scene {
namespace {

/// Returns each pixel's position between two nodes, eased so that the noise has no creases.
std::vector<float> eased_fractions(int cell) {
  std::vector<float> eased(static_cast<std::size_t>(cell));
  for (int i = 0; i < cell; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(cell);
    eased[static_cast<std::size_t>(i)] = t * t * (3.0F - 2.0F * t);
  }
  return eased;
}

float node(std::uint64_t key, int x, int y) {
  return static_cast<float>(unit(make_key(key, x, y)) * 2.0 - 1.0);
}

cv::Mat3b to_bytes(const cv::Mat3f& pixels) {
  cv::Mat3b bytes(pixels.size());
  for (int y = 0; y < pixels.rows; ++y) {
    const cv::Vec3f* from = pixels.ptr<cv::Vec3f>(y);
    cv::Vec3b* to = bytes.ptr<cv::Vec3b>(y);
    for (int x = 0; x < pixels.cols; ++x) {
      for (int c = 0; c < 3; ++c) {
        to[x][c] = static_cast<std::uint8_t>(std::clamp(from[x][c], 0.0F, 255.0F) + 0.5F);
      }
    }
  }
  return bytes;
}

/// Halves both sides of the image: each pixel is the rounded mean of four.
cv::Mat3b halved(const cv::Mat3b& image) {
  cv::Mat3b half;
  cv::resize(image, half, image.size() / 2, 0, 0, cv::INTER_AREA);
  return half;
}

cv::Vec3f bilinear(const cv::Mat3b& image, double u, double v) {
  const double column = std::floor(u);
  const double row = std::floor(v);
  const auto right = static_cast<float>(u - column);
  const auto down = static_cast<float>(v - row);
  const int mask_x = image.cols - 1;
  const int mask_y = image.rows - 1;
  const int x = static_cast<int>(column);
  const int y = static_cast<int>(row);
  const cv::Vec3b* upper = image.ptr<cv::Vec3b>(y & mask_y);
  const cv::Vec3b* lower = image.ptr<cv::Vec3b>((y + 1) & mask_y);
  const cv::Vec3b& a = upper[x & mask_x];
  const cv::Vec3b& b = upper[(x + 1) & mask_x];
  const cv::Vec3b& c = lower[x & mask_x];
  const cv::Vec3b& d = lower[(x + 1) & mask_x];
  cv::Vec3f colour;
  for (int i = 0; i < 3; ++i) {
    const auto first = static_cast<float>(a[i]);
    const auto third = static_cast<float>(c[i]);
    const float above = first + (static_cast<float>(b[i]) - first) * right;
    const float below = third + (static_cast<float>(d[i]) - third) * right;
    colour[i] = above + (below - above) * down;
  }
  return colour;
}

int wrapped(int value, int size) { return ((value % size) + size) % size; }

}  // namespace

void add_noise(cv::Mat1f& field, int cell, float amplitude, std::uint64_t key) {
  cell = std::max(cell, 1);
  const std::vector<float> eased = eased_fractions(cell);
  const int columns = (field.cols + cell - 1) / cell;
  const int rows = (field.rows + cell - 1) / cell;
  // A range is a band of node rows, so each node is hashed at most about twice.
  cv::parallel_for_(cv::Range(0, rows), [&](const cv::Range& bands) {
    std::vector<float> upper(static_cast<std::size_t>(columns) + 1);
    std::vector<float> lower(upper.size());
    for (int band = bands.start; band < bands.end; ++band) {
      for (int i = 0; i <= columns; ++i) {
        upper[static_cast<std::size_t>(i)] = node(key, i % columns, band);
        lower[static_cast<std::size_t>(i)] = node(key, i % columns, (band + 1) % rows);
      }
      for (int y = band * cell; y < std::min((band + 1) * cell, field.rows); ++y) {
        const float down = eased[static_cast<std::size_t>(y - band * cell)];
        float* row = field.ptr<float>(y);
        for (int i = 0; i < columns; ++i) {
          const auto at = static_cast<std::size_t>(i);
          const float left = upper[at] + (lower[at] - upper[at]) * down;
          const float right = upper[at + 1] + (lower[at + 1] - upper[at + 1]) * down;
          const int first = i * cell;
          const int count = std::min(cell, field.cols - first);
          for (int k = 0; k < count; ++k) {
            row[first + k] +=
                amplitude * (left + (right - left) * eased[static_cast<std::size_t>(k)]);
          }
        }
      }
    }
  });
}

cv::Mat1f noise_field(cv::Size size, int cell, std::uint64_t key) {
  cv::Mat1f field(size, 0.0F);
  add_noise(field, cell, 1.0F, key);
  return field;
}

Texture::Texture(const cv::Mat3f& pixels, double texel_m) : texel_m_(texel_m) {
  levels_.push_back(to_bytes(pixels));
  while (levels_.back().cols > 1 && levels_.back().rows > 1) {
    levels_.push_back(halved(levels_.back()));
  }
}

cv::Vec3f Texture::sample(double u, double v, double footprint_m) const {
  const double finest = std::max(footprint_m / texel_m_, 1.0);
  const double last = static_cast<double>(levels_.size() - 1);
  const double level = std::min(std::log2(finest), last);
  const auto fine = static_cast<std::size_t>(level);
  const std::size_t coarse = std::min(fine + 1, levels_.size() - 1);
  const auto blend = static_cast<float>(level - static_cast<double>(fine));
  const double fine_m = texel_m_ * static_cast<double>(1U << fine);
  const double coarse_m = texel_m_ * static_cast<double>(1U << coarse);
  const cv::Vec3f near_colour = bilinear(levels_[fine], u / fine_m - 0.5, v / fine_m - 0.5);
  if (blend == 0.0F) return near_colour;
  const cv::Vec3f far_colour = bilinear(levels_[coarse], u / coarse_m - 0.5, v / coarse_m - 0.5);
  return near_colour + (far_colour - near_colour) * blend;
}

Canvas::Canvas(cv::Size size, cv::Vec3f colour) : pixels_(size, colour) {}

void Canvas::blend(int x, int y, const cv::Vec3f& colour, float opacity) {
  cv::Vec3f& pixel = pixels_(wrapped(y, pixels_.rows), wrapped(x, pixels_.cols));
  pixel += (colour - pixel) * opacity;
}

void Canvas::noise(int coarsest, float amplitude, cv::Vec3f tint, std::uint64_t key) {
  cv::Mat1f field(pixels_.size(), 0.0F);
  for (int cell = coarsest; cell >= 2; cell /= 2) {
    add_noise(field, cell, amplitude, make_key(key, cell));
  }
  cv::parallel_for_(cv::Range(0, pixels_.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      const float* value = field.ptr<float>(y);
      cv::Vec3f* pixel = pixels_.ptr<cv::Vec3f>(y);
      for (int x = 0; x < pixels_.cols; ++x) {
        for (int c = 0; c < 3; ++c) pixel[x][c] += value[x] * tint[c];
      }
    }
  });
}

void Canvas::rectangle(cv::Rect area, cv::Vec3f colour, float opacity) {
  for (int y = area.y; y < area.br().y; ++y) {
    for (int x = area.x; x < area.br().x; ++x) blend(x, y, colour, opacity);
  }
}

void Canvas::disc(cv::Point centre, int radius, cv::Vec3f colour, float opacity) {
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) {
      if (x * x + y * y <= radius * radius) blend(centre.x + x, centre.y + y, colour, opacity);
    }
  }
}

void Canvas::mosaic(cv::Rect area, int cell, cv::Vec3f first, cv::Vec3f second, std::uint64_t key) {
  for (int y = 0; y < area.height; ++y) {
    for (int x = 0; x < area.width; ++x) {
      const auto share = static_cast<float>(unit(make_key(key, x / cell, y / cell)));
      blend(area.x + x, area.y + y, first + (second - first) * share, 1.0F);
    }
  }
}

void Canvas::writing(cv::Rect area, int line_height, cv::Vec3f colour, std::uint64_t key) {
  const int stroke = std::max(line_height / 2, 1);
  for (int y = area.y; y + stroke <= area.br().y; y += line_height) {
    int x = area.x;
    for (int word = 0; x < area.br().x; ++word) {
      const auto width = static_cast<int>(between(make_key(key, y, word), 1.0, 5.0) * stroke);
      const int end = std::min(x + width, area.br().x);
      rectangle({x, y, end - x, stroke}, colour);
      x = end + stroke;
    }
  }
}

void Canvas::contrast(double factor) {
  cv::Vec3d sum(0, 0, 0);
  for (int y = 0; y < pixels_.rows; ++y) {
    const cv::Vec3f* row = pixels_.ptr<cv::Vec3f>(y);
    for (int x = 0; x < pixels_.cols; ++x) sum += cv::Vec3d(row[x]);
  }
  const cv::Vec3f mean(sum * (1.0 / static_cast<double>(pixels_.total())));
  const auto scale = static_cast<float>(factor);
  for (int y = 0; y < pixels_.rows; ++y) {
    cv::Vec3f* row = pixels_.ptr<cv::Vec3f>(y);
    for (int x = 0; x < pixels_.cols; ++x) row[x] = mean + (row[x] - mean) * scale;
  }
}

}  // namespace dynfilter::scene
