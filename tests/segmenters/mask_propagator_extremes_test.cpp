// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Masks and boxes anywhere, at arbitrary times. The sanitizers (with float-cast-overflow) find
// undefined behaviour; the results are also checked without them.

#include "dynfilter/segmenters/mask_propagator.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace dynfilter {
namespace {

const cv::Size extreme_size(96, 72);

template <class Value, std::size_t count>
Value one_of(const Value (&values)[count], cv::RNG& random) {
  return values[random.uniform(0, static_cast<int>(count))];
}

int wild_position(cv::RNG& random) {
  constexpr int least = std::numeric_limits<int>::min(), most = std::numeric_limits<int>::max();
  if (random.uniform(0, 3) != 0) return random.uniform(-20, 90);
  return one_of({least, least + 20, -1000000, -30, 0, 5, 40, 95, 1000000, most - 50, most}, random);
}

Instance wild_instance(cv::RNG& random) {
  Instance instance;
  instance.box = {wild_position(random), wild_position(random),
                  one_of({0, 1, 30, 1000000, std::numeric_limits<int>::max()}, random),
                  one_of({0, 1, 30, 1000000, std::numeric_limits<int>::max()}, random)};
  if (random.uniform(0, 4) == 0) instance.box = {10, 10, 40, 40};
  instance.mask = cv::Mat(random.uniform(0, 40), random.uniform(0, 40), CV_8UC1, cv::Scalar(255));
  instance.mask_origin = {wild_position(random), wild_position(random)};
  if (random.uniform(0, 3) != 0) instance.track_id = random.uniform(0, 3);
  return instance;
}

/// Expects that a moved instance lies in the image.
void expect_in_image(const Instance& instance) {
  const cv::Rect image({}, extreme_size), mask(instance.mask_origin, instance.mask.size());
  EXPECT_EQ(instance.box & image, instance.box);
  EXPECT_TRUE(mask.empty() || (mask & image) == mask);
}

TEST(MaskPropagatorExtremes, MovedInstancesLieInTheImage) {
  cv::Mat1b image(extreme_size);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, cv::Size(), 1.5);
  int moved_count = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    cv::RNG random(seed);
    MaskPropagatorOptions options;
    options.max_age_s = 1e6;
    MaskPropagator propagator(options);
    FrameView frame;
    frame.timestamp_s = one_of({-1e308, -1e9, 0.0, 5.0}, random);
    for (int i = 0; i < 8 && std::isfinite(frame.timestamp_s); ++i) {
      frame.id = static_cast<std::uint64_t>(i);
      frame.image = random.uniform(0, 2) == 0 ? cv::Mat() : cv::Mat(image);
      Segmentation result{frame.id, frame.timestamp_s, extreme_size, {}};
      for (int k = 0; k < 3; ++k) result.instances.push_back(wild_instance(random));
      const bool is_new = random.uniform(0, 2) == 0;
      const auto masks =
          propagator.propagate(frame, is_new ? std::optional<Segmentation>(result) : std::nullopt);
      const auto& counts = propagator.statistics().instances;
      for (std::size_t k = 0; masks && k < masks->instances.size(); ++k) {
        if (counts[k].by_flow + counts[k].by_velocity + counts[k].left == 0) continue;
        expect_in_image(masks->instances[k]);
        ++moved_count;
      }
      frame.timestamp_s +=
          one_of({5e-324, 1e-300, 1e-9, 0.03, 0.03, 10.0, 1e5, 1e30, 1.5e308}, random);
    }
  }
  EXPECT_GT(moved_count, 150);
}

}  // namespace
}  // namespace dynfilter
