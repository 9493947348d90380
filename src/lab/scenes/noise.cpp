// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "noise.hpp"

#include <algorithm>
#include <vector>

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

}  // namespace dynfilter::scene
