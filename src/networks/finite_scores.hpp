// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_NETWORKS_FINITE_SCORES_HPP
#define DYNFILTER_SRC_NETWORKS_FINITE_SCORES_HPP

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail {

/// Watches the scores of one image: a network that overflowed, for example in half precision, must
/// not pass for one that saw no objects.
class FiniteScores {
 public:
  /// Returns the score as a probability without rounding errors; NaN if it is not finite. Throws
  /// std::runtime_error for a finite number that is no probability.
  float probability(float score) {
    if (!std::isfinite(score)) return std::numeric_limits<float>::quiet_NaN();
    constexpr float tolerance = 1e-3F;
    if (score < -tolerance || score > 1 + tolerance) {
      throw std::runtime_error(
          concatenate("its outputs hold the score ", score, "; want probabilities from 0 to 1"));
    }
    has_any_ = true;
    return std::clamp(score, 0.0F, 1.0F);
  }

  /// Throws std::runtime_error if there were rows but no finite score.
  void require_some(int rows) const {
    if (rows > 0 && !has_any_) {
      throw std::runtime_error(
          "none of its scores is a finite number (NaN or infinity); its weights may be damaged");
    }
  }

 private:
  bool has_any_ = false;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_FINITE_SCORES_HPP
