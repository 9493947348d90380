// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DEPTH_LBP_HPP
#define DYNFILTER_DEPTH_LBP_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/block_rounding.hpp"
#include "dynfilter/detail/depth_lbp_dense.hpp"
#include "dynfilter/detail/depth_lbp_points.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/features.hpp"

namespace dynfilter {

/// What a neighbour without depth counts as in a comparison with a centre that has depth.
enum class MissingNeighbour {
  nearer,  ///< bit 0: taken literally, since 0 is not greater than the centre's depth
  farther  ///< bit 1: most missing depth is background in the projector's shadow
};

struct DepthLbpOptions {
  /// The bit (0 to 7) of each neighbour, clockwise from the top-left one.
  std::array<std::uint8_t, 8> bits = {0, 1, 2, 3, 4, 5, 6, 7};
  MissingNeighbour missing_neighbour = MissingNeighbour::nearer;
};

/// D-LBP, the local binary pattern of a depth image (paper section 3.2, Figure 2): bit k of a
/// pixel's code is 1 where neighbour k is farther away than the pixel; equal depth gives 0.
///
/// A pixel has no code if it lies on the border of the image or has no depth. Depth is CV_16UC1 or
/// CV_32FC1; 0, negative, NaN and infinite mean "no depth". Codes compare depths only, so the unit
/// is of no account.
class DepthLbp {
 public:
  /// Throws std::invalid_argument unless the bits are the numbers 0 to 7 in some order.
  explicit DepthLbp(const DepthLbpOptions& options = {})
      : options_(options), codes_(checked(options.bits)) {}

  /// The code of one pixel; nothing if it has none. Throws std::invalid_argument for a depth image
  /// of another type. O(1).
  std::optional<std::uint8_t> code(const cv::Mat& depth, cv::Point pixel) const {
    require_depth(depth);
    if (depth.type() == CV_16UC1) return points_of<std::uint16_t>(depth)(pixel.x, pixel.y);
    if (depth.type() == CV_32FC1) return points_of<float>(depth)(pixel.x, pixel.y);
    return {};  // it is empty
  }

  /// What gives the codes of many pixels of a depth image of this type, one by one. It refers to
  /// this operator and to the image's data.
  template <class Depth>
  detail::DepthLbpPoints<Depth> points_of(const cv::Mat& depth) const {
    return {depth, codes_, missing_is_farther()};
  }

  /// The codes of many features, one for each of them in their order. `codes` is resized, which
  /// reuses its memory. O(features).
  void codes(const cv::Mat& depth, FeaturesView features,
             std::vector<std::optional<std::uint8_t>>& codes) const {
    require_depth(depth);
    codes.resize(features.size());
    if (depth.type() == CV_16UC1) {
      codes_of<std::uint16_t>(depth, features, codes);
    } else {
      codes_of<float>(depth, features, codes);
    }
  }

  /// The codes of all pixels of a region, which may reach beyond the image: CV_8UC1 of the size of
  /// `depth`, 0 where a pixel has no code. A matrix of that type and size is written in the region
  /// only, so threads may share it and each do some rows; another one is made anew, with 0 outside
  /// the region. `codes` must not share data with `depth`. O(pixels of the region), by the widest
  /// registers that the processor has.
  void dense(const cv::Mat& depth, const cv::Rect& region, cv::Mat& codes) const {
    require_depth(depth);
    if (codes.type() != CV_8UC1 || codes.size() != depth.size()) {
      codes = cv::Mat::zeros(depth.size(), CV_8UC1);
    }
    const cv::Rect inside = detail::clip(region, depth.size());
    if (depth.type() == CV_16UC1) {
      dense_of<std::uint16_t>(depth, inside, codes);
    } else {
      dense_of<float>(depth, inside, codes);
    }
  }

  /// The codes of the whole image.
  cv::Mat dense(const cv::Mat& depth) const {
    cv::Mat codes;
    dense(depth, cv::Rect(0, 0, depth.cols, depth.rows), codes);
    return codes;
  }

 private:
  static const std::array<std::uint8_t, 8>& checked(const std::array<std::uint8_t, 8>& bits) {
    unsigned seen = 0;
    for (const std::uint8_t bit : bits) seen |= bit < 8 ? 1U << bit : 0U;
    if (seen != 0xFFU) {
      detail::throw_misuse("DepthLbp", "bits that are not a permutation",
                           "each of 0 to 7 once, clockwise from the top-left neighbour");
    }
    return bits;
  }

  static void require_depth(const cv::Mat& depth) {
    const bool known = depth.type() == CV_16UC1 || depth.type() == CV_32FC1;
    if ((!known && !depth.empty()) || depth.dims > 2) {
      detail::throw_misuse("DepthLbp",
                           detail::concatenate("a depth image of type ", detail::type_name(depth)),
                           "CV_16UC1 or CV_32FC1");
    }
  }

  bool missing_is_farther() const {
    return options_.missing_neighbour == MissingNeighbour::farther;
  }

  template <class Depth>
  void codes_of(const cv::Mat& depth, FeaturesView features,
                std::vector<std::optional<std::uint8_t>>& codes) const {
    const detail::DepthLbpPoints<Depth> code_at = points_of<Depth>(depth);
    const detail::Positions positions(features);
    std::array<cv::Point, detail::block_size> pixels;
    detail::NarrowBlock narrow;
    detail::NarrowBounds bounds;
    for (std::size_t first = 0; first < features.size(); first += detail::block_size) {
      const std::size_t count = std::min(features.size() - first, detail::block_size);
      detail::round_block(positions.from(first), count, instruction_set_, pixels.data(), narrow,
                          bounds);
      for (std::size_t i = 0; i < count; ++i) {
        codes[first + i] = code_at(pixels[i].x, pixels[i].y);
      }
    }
  }

  template <class Depth>
  void dense_of(const cv::Mat& depth, const cv::Rect& region, cv::Mat& codes) const {
    const detail::DepthLbpRule<Depth> rule = {options_.bits,
                                              detail::depth_bias<Depth>(missing_is_farther())};
    detail::dense_depth_lbp(depth, region, rule, instruction_set_, codes);
  }

  DepthLbpOptions options_;
  detail::InstructionSet instruction_set_ = detail::best_instruction_set();
  detail::NeighbourCodes codes_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_LBP_HPP
