// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "input_placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace dynfilter::detail {
namespace {

/// Composes two maps: `inner` first, then `outer`.
cv::Matx23d composed(const cv::Matx23d& outer, const cv::Matx23d& inner) {
  cv::Matx23d result;
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 3; ++column) {
      result(row, column) = outer(row, 0) * inner(0, column) + outer(row, 1) * inner(1, column);
    }
    result(row, 2) += outer(row, 2);
  }
  return result;
}

/// A map x' = factor_x x + shift_x, likewise in y, and its inverse.
struct ScaleAndShift {
  double factor_x, factor_y, shift_x, shift_y;

  cv::Matx23d forward() const { return {factor_x, 0, shift_x, 0, factor_y, shift_y}; }
  cv::Matx23d backward() const {
    return {1 / factor_x, 0, -shift_x / factor_x, 0, 1 / factor_y, -shift_y / factor_y};
  }
};

InputPlacement placed_further(const InputPlacement& upright, const cv::Size& input,
                              const ScaleAndShift& step) {
  return {upright.image, input, composed(step.forward(), upright.to_input),
          composed(upright.to_image, step.backward())};
}

/// Returns cosine and sine; exact for multiples of 90°.
cv::Point2d direction(double angle_rad) {
  const auto snapped = [](double value) {
    const double nearest = std::round(value);
    return std::abs(value - nearest) < 1e-9 ? nearest : value;
  };
  return {snapped(std::cos(angle_rad)), snapped(std::sin(angle_rad))};
}

}  // namespace

cv::Point2d transformed(const cv::Matx23d& transform, cv::Point2d point) {
  return {transform(0, 0) * point.x + transform(0, 1) * point.y + transform(0, 2),
          transform(1, 0) * point.x + transform(1, 1) * point.y + transform(1, 2)};
}

PlacedImage turn_upright(const cv::Mat& image, double roll_rad, const cv::Scalar& border) {
  const cv::Matx23d identity(1, 0, 0, 0, 1, 0);
  const cv::Point2d turn = direction(roll_rad);
  if (turn.x == 1) return {image, {image.size(), image.size(), identity, identity}};

  const double width = image.cols;
  const double height = image.rows;
  // A rounding error must not add a column of border.
  const auto side = [](double length) { return static_cast<int>(std::ceil(length - 1e-6)); };
  const cv::Size canvas(side(std::abs(width * turn.x) + std::abs(height * turn.y)),
                        side(std::abs(width * turn.y) + std::abs(height * turn.x)));
  const cv::Matx22d rotation(turn.x, -turn.y, turn.y, turn.x);
  const auto about_centres = [](const cv::Matx22d& turned, double from_x, double from_y,
                                double to_x, double to_y) {
    const double x = turned(0, 0) * from_x + turned(0, 1) * from_y;
    const double y = turned(1, 0) * from_x + turned(1, 1) * from_y;
    return cv::Matx23d(turned(0, 0), turned(0, 1), to_x - x, turned(1, 0), turned(1, 1), to_y - y);
  };
  PlacedImage upright;
  upright.placement.image = image.size();
  upright.placement.input = canvas;
  upright.placement.to_input =
      about_centres(rotation, width / 2, height / 2, canvas.width / 2.0, canvas.height / 2.0);
  upright.placement.to_image =
      about_centres(rotation.t(), canvas.width / 2.0, canvas.height / 2.0, width / 2, height / 2);
  // OpenCV measures from the centre of the first pixel.
  const cv::Matx23d to_centre(1, 0, -0.5, 0, 1, -0.5);
  const cv::Matx23d to_corner(1, 0, 0.5, 0, 1, 0.5);
  const cv::Matx23d back = composed(to_centre, composed(upright.placement.to_image, to_corner));
  cv::warpAffine(image, upright.pixels, back, canvas, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_CONSTANT, border);
  return upright;
}

PlacedImage letterbox(const PlacedImage& upright, const cv::Size& input, const cv::Scalar& border) {
  const cv::Size image = upright.pixels.size();
  const double factor = std::min(input.width / static_cast<double>(image.width),
                                 input.height / static_cast<double>(image.height));
  const auto resized_side = [&](int length, int limit) {
    return std::clamp(cvRound(length * factor), 1, limit);
  };
  const cv::Size size(resized_side(image.width, input.width),
                      resized_side(image.height, input.height));
  const int left = (input.width - size.width) / 2;
  const int top = (input.height - size.height) / 2;

  PlacedImage result;
  result.pixels = cv::Mat(input, upright.pixels.type(), border);
  cv::Mat middle = result.pixels(cv::Rect(cv::Point(left, top), size));
  if (size == image) {
    upright.pixels.copyTo(middle);
  } else {
    cv::resize(upright.pixels, middle, size, 0, 0, cv::INTER_LINEAR);
  }
  // Uses the rounded sides, not `factor`.
  result.placement =
      placed_further(upright.placement, input,
                     {size.width / static_cast<double>(image.width),
                      size.height / static_cast<double>(image.height), double(left), double(top)});
  return result;
}

PlacedImage stretch(const PlacedImage& upright, const cv::Size& input) {
  PlacedImage result;
  cv::Mat image;
  upright.pixels.convertTo(image, CV_32F);
  cv::resize(image, result.pixels, input, 0, 0, cv::INTER_LINEAR);
  result.placement = placed_further(upright.placement, input,
                                    {input.width / static_cast<double>(image.cols),
                                     input.height / static_cast<double>(image.rows), 0, 0});
  return result;
}

cv::Mat normalized_rgb(const cv::Mat& bgr, const cv::Scalar& mean, const cv::Scalar& deviation) {
  std::array<cv::Mat, 3> channels;
  cv::split(bgr, channels.data());
  const std::array<int, 4> shape = {1, 3, bgr.rows, bgr.cols};
  cv::Mat tensor(4, shape.data(), CV_32F);
  for (int c = 0; c < 3; ++c) {
    cv::Mat plane(bgr.size(), CV_32F, tensor.ptr<float>(0, c));
    const std::size_t channel = static_cast<std::size_t>(2 - c);
    channels[channel].convertTo(plane, CV_32F, 1 / deviation[c], -mean[c] / deviation[c]);
  }
  return tensor;
}

cv::Rect box_in_image(const Box& box, const InputPlacement& placement) {
  double x1 = placement.image.width, y1 = placement.image.height, x2 = 0, y2 = 0;
  for (const cv::Point2d corner : {cv::Point2d(box.x1, box.y1), cv::Point2d(box.x2, box.y1),
                                   cv::Point2d(box.x1, box.y2), cv::Point2d(box.x2, box.y2)}) {
    const cv::Point2d point = transformed(placement.to_image, corner);
    x1 = std::min(x1, point.x);
    y1 = std::min(y1, point.y);
    x2 = std::max(x2, point.x);
    y2 = std::max(y2, point.y);
  }
  // Tolerates the rounding error of the network's floats, which must not add a row of pixels.
  constexpr double tolerance = 1e-4;
  const auto side = [](double value, int limit) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(limit)));
  };
  const int left = side(std::floor(x1 + tolerance), placement.image.width);
  const int top = side(std::floor(y1 + tolerance), placement.image.height);
  const int right = side(std::ceil(x2 - tolerance), placement.image.width);
  const int bottom = side(std::ceil(y2 - tolerance), placement.image.height);
  return {left, top, std::max(right - left, 0), std::max(bottom - top, 0)};
}

}  // namespace dynfilter::detail
