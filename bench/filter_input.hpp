// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Frames of any size with any number of features and persons, for the filter's benchmarks.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/dynfilter.hpp"

namespace dynfilter::benchmarks {

/// One frame with a tracker's data of it.
struct FilterInputData {
  FrameView frame;
  Segmentation segmentation;
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;  // CV_8UC1, 32 bytes a feature, like ORB's
};

/// Box of a person, which is the ellipse in it; a crowd stands farther away.
inline cv::Rect person_box(const cv::Size& image, int index, int persons, std::mt19937& random) {
  const double share = persons > 10 ? 0.7 : 1.0;
  const int width = static_cast<int>(image.width / 5 * share);
  const int height = static_cast<int>(image.height * 3 / 5 * share);
  // The first three persons stand side by side, others in front of or behind them.
  const int x = persons <= 3
                    ? (2 * index + 1) * image.width / 6 - width / 2
                    : static_cast<int>(random() % static_cast<unsigned>(image.width - width));
  return {x, image.height / 5 + index % 3 * image.height / 20, width, height};
}

inline void paint_ellipse(cv::Mat& image, const cv::Rect& box, double share, double value) {
  const cv::Size half(static_cast<int>(box.width * share / 2),
                      static_cast<int>(box.height * share / 2));
  cv::ellipse(image, (box.tl() + box.br()) / 2, half, 0, 0, 360, cv::Scalar(value), cv::FILLED);
}

/// Depth of a floor that rises to a wall, 5000 units a metre.
inline cv::Mat background_depth(const cv::Size& image) {
  cv::Mat depth(image, CV_16UC1);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int slope = 25000 - 8000 * y / image.height;
      depth.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(slope + 2000 * x / image.width);
    }
  }
  return depth;
}

/// Adds persons whose masks end inside their silhouettes, like those of networks.
inline void place_persons(FilterInputData& input, int persons, std::mt19937& random) {
  const cv::Size image = input.frame.depth.size();
  for (int k = 0; k < persons; ++k) {
    const cv::Rect box = person_box(image, k, persons, random);
    const double metres = 1.8 + 0.3 * (k % 4);
    for (int layer = 0; layer < 6; ++layer) {  // the chest is nearer than the sides
      paint_ellipse(input.frame.depth, box, 1.0 - 0.15 * layer, 5000 * (metres - 0.05 * layer));
    }
    cv::Mat mask = cv::Mat::zeros(box.size(), CV_8UC1);
    paint_ellipse(mask, {0, 0, box.width, box.height}, 0.85, 255);
    input.segmentation.instances.push_back(Instance::from_box_mask(mask, box));
  }
}

/// Adds a sensor's noise and holes.
inline void spoil_depth(cv::Mat& depth, std::mt19937& random) {
  cv::Mat noise(depth.size(), CV_16SC1);
  cv::RNG(random()).fill(noise, cv::RNG::NORMAL, 0, 60);
  cv::add(depth, noise, depth, cv::noArray(), CV_16U);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      if (random() % 16 == 0) depth.at<std::uint16_t>(y, x) = 0;
    }
  }
}

inline std::vector<cv::KeyPoint> spread_keypoints(const cv::Size& image, std::size_t count,
                                                  std::mt19937& random) {
  constexpr float border = 16;  // ORB's
  const auto within = [&](int length) {
    const float span = static_cast<float>(length) - 2 * border;
    return border + span * static_cast<float>(random() % 65536) / 65536;
  };
  std::vector<cv::KeyPoint> keypoints;
  for (std::size_t i = 0; i < count; ++i) {
    const float x = within(image.width), y = within(image.height);
    keypoints.emplace_back(x, y, 31.0F);
  }
  return keypoints;
}

inline FilterInputData make_filter_input(const cv::Size& image, std::size_t features, int persons,
                                         unsigned seed = 1) {
  std::mt19937 random(seed);
  FilterInputData input;
  input.frame.id = seed;
  input.frame.depth = background_depth(image);
  input.frame.metres_per_unit = 1.0 / 5000;
  input.segmentation.image_size = image;
  place_persons(input, persons, random);
  spoil_depth(input.frame.depth, random);
  input.keypoints = spread_keypoints(image, features, random);
  input.descriptors.create(static_cast<int>(features), 32, CV_8UC1);
  cv::RNG(seed).fill(input.descriptors, cv::RNG::UNIFORM, 0, 256);
  return input;
}

}  // namespace dynfilter::benchmarks
