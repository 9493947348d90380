// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "input_placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace dynfilter::detail {

InputPlacement::InputPlacement(const cv::Size& image_size, const cv::Size& input_size,
                               const cv::Size& placed, const cv::Point& corner)
    : image(image_size), input(input_size) {
  to_input = {{placed.width / static_cast<double>(image.width),
               placed.height / static_cast<double>(image.height)},
              cv::Point2d(corner)};
  const auto& [factor, shift] = to_input;
  to_image = {{1 / factor.x, 1 / factor.y}, {-shift.x / factor.x, -shift.y / factor.y}};
}

PlacedImage letterbox(const cv::Mat& image, const cv::Size& input, const cv::Scalar& border) {
  const double factor = std::min(input.width / static_cast<double>(image.cols),
                                 input.height / static_cast<double>(image.rows));
  const auto resized_side = [&](int length, int limit) {
    return std::clamp(cvRound(length * factor), 1, limit);
  };
  const cv::Size size(resized_side(image.cols, input.width),
                      resized_side(image.rows, input.height));
  const cv::Point corner((input.width - size.width) / 2, (input.height - size.height) / 2);
  PlacedImage result;
  result.pixels = cv::Mat(input, image.type(), border);
  cv::Mat middle = result.pixels(cv::Rect(corner, size));
  if (size == image.size()) {
    image.copyTo(middle);
  } else {
    cv::resize(image, middle, size, 0, 0, cv::INTER_LINEAR);
  }
  result.placement = {image.size(), input, size, corner};  // by the rounded sides, not `factor`
  return result;
}

PlacedImage stretch(const cv::Mat& image, const cv::Size& input) {
  PlacedImage result;
  cv::Mat floats;
  image.convertTo(floats, CV_32F);
  cv::resize(floats, result.pixels, input, 0, 0, cv::INTER_LINEAR);
  result.placement = {image.size(), input, input, {}};
  return result;
}

PlacedImage normalized_rgb(const PlacedImage& bgr, const cv::Scalar& mean,
                           const cv::Scalar& deviation) {
  std::array<cv::Mat, 3> channels;
  cv::split(bgr.pixels, channels.data());
  const std::array<int, 4> shape = {1, 3, bgr.pixels.rows, bgr.pixels.cols};
  cv::Mat tensor(4, shape.data(), CV_32F);
  for (int c = 0; c < 3; ++c) {
    cv::Mat plane(bgr.pixels.size(), CV_32F, tensor.ptr<float>(0, c));
    const std::size_t channel = static_cast<std::size_t>(2 - c);
    channels[channel].convertTo(plane, CV_32F, 1 / deviation[c], -mean[c] / deviation[c]);
  }
  return {tensor, bgr.placement};
}

cv::Rect box_in_image(const Box& box, const InputPlacement& placement) {
  const cv::Point2d first = placement.to_image({box.x1, box.y1});
  const cv::Point2d last = placement.to_image({box.x2, box.y2});
  // Tolerates the rounding error of the network's floats, which must not add a row of pixels.
  constexpr double tolerance = 1e-4;
  const auto side = [](double value, int limit) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(limit)));
  };
  const int left = side(std::floor(first.x + tolerance), placement.image.width);
  const int top = side(std::floor(first.y + tolerance), placement.image.height);
  const int right = side(std::ceil(last.x - tolerance), placement.image.width);
  const int bottom = side(std::ceil(last.y - tolerance), placement.image.height);
  return {left, top, std::max(right - left, 0), std::max(bottom - top, 0)};
}

}  // namespace dynfilter::detail
