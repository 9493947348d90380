// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Small patches of an image, and where they are in another image.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Patch of 8x15 pixels of a grey image, read once and then looked for in any number of images:
/// Lucas-Kanade in its inverse compositional form (S. Baker and I. Matthews, 2004). High and
/// narrow, because a row is one vector of 16-bit integers. The gradients are without their mean, so
/// that a change of exposure cancels in the steps.
class ImagePatch {
 public:
  /// Outcome of `look`.
  struct Look {
    float difference = -1;  ///< mean absolute difference, grey levels; below 0: outside the image
    cv::Point2f step;       ///< to a better place, pixels

    bool is_inside() const { return difference >= 0; }
  };

  /// Outcome of `follow`.
  struct Match {
    cv::Point2f place;         ///< of the patch's centre in the other image, pixels
    float difference = -1;     ///< difference at the place
    bool has_settled = false;  ///< whether the last step was small
  };

  /// Reads the patch around a pixel. One that reaches out of the image has no texture. O(1).
  void read(const cv::Mat1b& image, cv::Point centre);

  /// Centre, a pixel.
  cv::Point centre() const { return centre_; }
  /// Smaller eigenvalue of the matrix of gradients, over the number of pixels; 0: no patch, or one
  /// that cannot be followed.
  float texture() const { return texture_; }
  /// Mean absolute difference from the mean brightness, grey levels.
  float contrast() const { return contrast_; }

  /// Compares the patch with a place of another image, interpolated linearly. O(1).
  Look look(const cv::Mat1b& image, cv::Point2f place) const;

  /// Follows the patch from a place on, by at most so many steps. It has settled with a small step,
  /// or with a larger one where the difference is below `good`. A step to a worse place is halved
  /// and settles nothing: near a static place, what moves finds local minima.
  Match follow(const cv::Mat1b& image, cv::Point2f place, int steps, float good = 0) const;

 private:
  static constexpr int columns = 8, rows = 15, left = 4, up = 7;
  static constexpr std::size_t pixels = columns * rows;

  static constexpr std::size_t at(int row) { return static_cast<std::size_t>(row * columns); }

  cv::Point centre_;
  float texture_ = 0, contrast_ = 0;
  std::array<float, 3> inverse_{};                      // of the matrix of gradients: xx, xy, yy
  std::array<std::int16_t, pixels> brightness_;         // times 32
  std::array<std::int16_t, pixels> along_x_, along_y_;  // twice the gradients
};

}  // namespace dynfilter::detail
