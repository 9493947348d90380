// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "image_patch.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core/hal/intrin.hpp>

namespace dynfilter::detail {
namespace {

// A patch has settled after a small step, or a larger one where the difference is small. Larger
// steps settle at a less exact place.
constexpr float small_step_px = 0.12F, good_step_px = 0.5F;
/// A longer step leaves the slope that it was computed for.
constexpr float max_step_px = 3;
// Brightness has so many bits of fraction; squares of differences are computed with fewer.
constexpr int fraction_bits = 5, coarse_bits = 2;

// Functions of OpenCV's universal intrinsics that all of its versions from 4.2 on have; operators
// are not among them.
using Row = cv::v_int16x8;
using Sums = cv::v_int32x4;

Row load_row(const std::uint8_t* p) { return cv::v_reinterpret_as_s16(cv::v_load_expand(p)); }

float sum_of(const Sums& sums) { return static_cast<float>(cv::v_reduce_sum(sums)); }

/// Returns the standard deviation of numbers from their sum and the sum of their squares.
float deviation(float sum, float squares, float count) {
  const float mean = sum / count;
  return std::sqrt(std::max(squares / count - mean * mean, 0.0F));
}

/// Returns a share of the way from brightnesses (times 32) to others; `share` counts 2^-15.
Row between(const Row& from, const Row& to, const Row& share) {
  return cv::v_add_wrap(from, cv::v_mul_hi(cv::v_shl<1>(cv::v_sub_wrap(to, from)), share));
}

}  // namespace

void ImagePatch::read(const cv::Mat1b& image, cv::Point centre) {
  centre_ = centre;
  texture_ = 0;
  contrast_ = 0;
  const bool is_inside = centre.x > left && centre.x < image.cols - (columns - left) &&
                         centre.y > up && centre.y < image.rows - (rows - up);
  if (!is_inside) return;
  const int first_x = centre.x - left, first_y = centre.y - up;
  const auto step = static_cast<std::ptrdiff_t>(image.step[0]);
  const Row ones = cv::v_setall_s16(1);
  const Sums zero = cv::v_setzero_s32();
  Sums sum = zero, squares = zero, sum_x = zero, sum_y = zero;
  for (int row = 0; row < rows; ++row) {
    const std::uint8_t* const p = image.ptr(first_y + row) + first_x;
    const Row x = cv::v_sub_wrap(load_row(p + 1), load_row(p - 1));
    const Row y = cv::v_sub_wrap(load_row(p + step), load_row(p - step));
    const Row brightness = load_row(p);
    cv::v_store(&brightness_[at(row)], cv::v_shl<fraction_bits>(brightness));
    cv::v_store(&along_x_[at(row)], x);
    cv::v_store(&along_y_[at(row)], y);
    sum = cv::v_dotprod(brightness, ones, sum);
    squares = cv::v_dotprod(brightness, brightness, squares);
    sum_x = cv::v_dotprod(x, ones, sum_x);
    sum_y = cv::v_dotprod(y, ones, sum_y);
  }
  const auto mean = [](const Sums& total) {
    return cv::v_setall_s16(static_cast<std::int16_t>(std::lround(sum_of(total) / pixels)));
  };
  const Row mean_x = mean(sum_x), mean_y = mean(sum_y);
  Sums xx = zero, xy = zero, yy = zero;
  for (int row = 0; row < rows; ++row) {
    const Row x = cv::v_sub_wrap(cv::v_load(&along_x_[at(row)]), mean_x);
    const Row y = cv::v_sub_wrap(cv::v_load(&along_y_[at(row)]), mean_y);
    cv::v_store(&along_x_[at(row)], x);
    cv::v_store(&along_y_[at(row)], y);
    xx = cv::v_dotprod(x, x, xx);
    xy = cv::v_dotprod(x, y, xy);
    yy = cv::v_dotprod(y, y, yy);
  }
  contrast_ = deviation(sum_of(sum), sum_of(squares), pixels);
  const float a = sum_of(xx), b = sum_of(xy), c = sum_of(yy);
  const float determinant = a * c - b * b;
  if (!(determinant > 0)) return;
  // The gradients count twice, so that their squares count four times.
  texture_ = (a + c - std::sqrt((a - c) * (a - c) + 4 * b * b)) / (8.0F * pixels);
  // (2 gradient)(32 difference) / (2 gradient)^2 = 16 difference / gradient.
  inverse_ = {c / determinant / 16, -b / determinant / 16, a / determinant / 16};
}

ImagePatch::Look ImagePatch::look(const cv::Mat1b& image, cv::Point2f place) const {
  const float x = std::floor(place.x), y = std::floor(place.y);
  const bool is_inside = x >= left && y >= up && x + left + 1 < static_cast<float>(image.cols) &&
                         y + rows - up + 1 < static_cast<float>(image.rows);
  if (!is_inside) return {};
  const Row share_x = cv::v_setall_s16(static_cast<std::int16_t>((place.x - x) * 32767));
  const Row share_y = cv::v_setall_s16(static_cast<std::int16_t>((place.y - y) * 32767));
  const Row ones = cv::v_setall_s16(1);
  const std::uint8_t* p = image.ptr(static_cast<int>(y) - up) + static_cast<int>(x) - left;
  const auto along_x = [&] {
    return between(cv::v_shl<fraction_bits>(load_row(p)), cv::v_shl<fraction_bits>(load_row(p + 1)),
                   share_x);
  };
  Sums sum = cv::v_setzero_s32(), squares = sum, sum_x = sum, sum_y = sum;
  Row upper = along_x();
  for (int row = 0; row < rows; ++row) {
    p += image.step[0];
    const Row lower = along_x();
    const Row off =
        cv::v_sub_wrap(between(upper, lower, share_y), cv::v_load(&brightness_[at(row)]));
    const Row coarse = cv::v_shr<coarse_bits>(off);  // whose squares do not overflow
    sum = cv::v_dotprod(coarse, ones, sum);
    squares = cv::v_dotprod(coarse, coarse, squares);
    sum_x = cv::v_dotprod(off, cv::v_load(&along_x_[at(row)]), sum_x);
    sum_y = cv::v_dotprod(off, cv::v_load(&along_y_[at(row)]), sum_y);
    upper = lower;
  }
  const float right_x = sum_of(sum_x), right_y = sum_of(sum_y);
  constexpr auto units = static_cast<float>(1 << (fraction_bits - coarse_bits));
  return {deviation(sum_of(sum), sum_of(squares), pixels) / units,
          {-(inverse_[0] * right_x + inverse_[1] * right_y),
           -(inverse_[1] * right_x + inverse_[2] * right_y)}};
}

ImagePatch::Match ImagePatch::follow(const cv::Mat1b& image, cv::Point2f place, int steps,
                                     float good) const {
  Match match{place};
  cv::Point2f step;
  for (int i = 0; i <= steps; ++i) {
    const Look here = look(image, match.place + step);
    if (!here.is_inside()) {
      match.difference = -1;
      match.has_settled = false;
      return match;
    }
    const bool is_worse = i > 0 && here.difference > match.difference;
    if (is_worse) {
      step *= 0.5F;
      if (step.dot(step) < small_step_px * small_step_px) break;
      continue;
    }
    match.place += step;
    match.difference = here.difference;
    step = here.step;
    const float square = step.dot(step);
    match.has_settled = square < small_step_px * small_step_px ||
                        (here.difference < good && square < good_step_px * good_step_px);
    if (match.has_settled) {
      match.place += step;
      break;
    }
    if (square > max_step_px * max_step_px) step *= max_step_px / std::sqrt(square);
  }
  return match;
}

}  // namespace dynfilter::detail
