// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/deformable_convolution.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "networks/tensors.hpp"
#include "random_tensors.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::detail {
namespace {

using testing::expect_error;
using testing::random_tensor;
using testing::tensor;

float at(const cv::Mat& data, int n, int c, int y, int x) {
  return data.at<float>(cv::Vec4i(n, c, y, x));
}

/// Input interpolated at a point between its pixels; 0 outside.
double sampled(const cv::Mat& input, int n, int c, double y, double x) {
  double sum = 0;
  for (int row = 0; row < input.size[2]; ++row) {
    for (int column = 0; column < input.size[3]; ++column) {
      const double weight_y = 1 - std::abs(y - row);
      const double weight_x = 1 - std::abs(x - column);
      if (weight_y > 0 && weight_x > 0)
        sum += weight_y * weight_x * double{at(input, n, c, row, column)};
    }
  }
  return sum;
}

/// Oracle: equation (1) of the paper, literally.
cv::Mat naive(const cv::Mat& input, const cv::Mat& offsets, const cv::Mat& mask,
              const cv::Mat& weights, const cv::Mat& bias, const DeformableConvolutionOptions& o,
              const cv::Size& size) {
  const int outputs = weights.size[0], inputs = input.size[1];
  const int taps_y = weights.size[2], taps_x = weights.size[3], taps = taps_y * taps_x;
  cv::Mat output = tensor({input.size[0], outputs, size.height, size.width});
  for (int n = 0; n < input.size[0]; ++n) {
    for (int f = 0; f < outputs; ++f) {
      const int group = f / (outputs / o.groups);
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          double sum = bias.empty() ? 0.0 : double{bias.ptr<float>()[f]};
          for (int i = 0; i < inputs / o.groups; ++i) {
            const int c = group * (inputs / o.groups) + i;
            const int offset_group = c / (inputs / o.offset_groups);
            for (int tap = 0; tap < taps; ++tap) {
              const int map = offset_group * taps + tap;
              const double at_y = y * o.stride.height - o.pad_top +
                                  tap / taps_x * o.dilation.height +
                                  double{at(offsets, n, 2 * map, y, x)};
              const double at_x = x * o.stride.width - o.pad_left +
                                  tap % taps_x * o.dilation.width +
                                  double{at(offsets, n, 2 * map + 1, y, x)};
              const double factor = mask.empty() ? 1.0 : double{at(mask, n, map, y, x)};
              sum += double{at(weights, f, i, tap / taps_x, tap % taps_x)} * factor *
                     sampled(input, n, c, at_y, at_x);
            }
          }
          output.at<float>(cv::Vec4i(n, f, y, x)) = float(sum);
        }
      }
    }
  }
  return output;
}

double largest_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a.reshape(1, 1), b.reshape(1, 1), cv::NORM_INF);
}

struct Case {
  const char* name;
  int batch, inputs, outputs, rows, columns, taps_y, taps_x;
  DeformableConvolutionOptions options;
  bool has_mask, has_bias;
  float reach;  // of the offsets
};

std::ostream& operator<<(std::ostream& stream, const Case& c) { return stream << c.name; }

class DeformableConvolutionCases : public ::testing::TestWithParam<Case> {};

TEST_P(DeformableConvolutionCases, MatchTheEquation) {
  const Case& c = GetParam();
  std::mt19937 random(7);
  const cv::Mat input = random_tensor(random, {c.batch, c.inputs, c.rows, c.columns}, -1, 1);
  const cv::Mat weights =
      random_tensor(random, {c.outputs, c.inputs / c.options.groups, c.taps_y, c.taps_x}, -1, 1);
  const cv::Mat bias = c.has_bias ? random_tensor(random, {1, c.outputs}, -1, 1) : cv::Mat();
  DeformableConvolution convolution(weights, bias, c.options);
  const cv::Size size = convolution.output_size({c.columns, c.rows});
  ASSERT_FALSE(size.empty());
  const int maps = c.options.offset_groups * c.taps_y * c.taps_x;
  const cv::Mat offsets =
      random_tensor(random, {c.batch, 2 * maps, size.height, size.width}, -c.reach, c.reach);
  const cv::Mat mask = c.has_mask
                           ? random_tensor(random, {c.batch, maps, size.height, size.width}, 0, 1)
                           : cv::Mat();
  const cv::Mat want = naive(input, offsets, mask, weights, bias, c.options, size);
  cv::Mat output;
  convolution.apply(input, offsets, mask, output);
  ASSERT_EQ(shape_of(output), shape_of(want));
  const double terms = c.inputs / c.options.groups * c.taps_y * c.taps_x;
  EXPECT_LT(largest_difference(output, want), 1e-6 * (terms + 2));
  EXPECT_GT(cv::norm(want.reshape(1, 1), cv::NORM_INF), 0.5);

  // The second call writes into the same memory.
  const uchar* memory = output.data;
  const cv::Mat first = output.clone();
  output = cv::Scalar(99);
  convolution.apply(input, offsets, mask, output);
  EXPECT_EQ(output.data, memory);
  EXPECT_EQ(largest_difference(output, first), 0);
}

DeformableConvolutionOptions make_options(cv::Size stride, cv::Size dilation, std::vector<int> pads,
                                          int groups = 1, int offset_groups = 1) {
  DeformableConvolutionOptions o;
  o.stride = stride;
  o.dilation = dilation;
  o.pad_top = pads[0];
  o.pad_left = pads[1];
  o.pad_bottom = pads[2];
  o.pad_right = pads[3];
  o.groups = groups;
  o.offset_groups = offset_groups;
  return o;
}

INSTANTIATE_TEST_SUITE_P(
    All, DeformableConvolutionCases,
    ::testing::Values(Case{"as_in_yolact", 1, 8, 6, 9, 11, 3, 3,
                           make_options({1, 1}, {1, 1}, {1, 1, 1, 1}), true, true, 2},
                      Case{"no_mask", 1, 4, 3, 7, 8, 3, 3,
                           make_options({1, 1}, {1, 1}, {1, 1, 1, 1}), false, true, 2},
                      Case{"no_bias", 1, 4, 3, 7, 8, 3, 3,
                           make_options({1, 1}, {1, 1}, {1, 1, 1, 1}), true, false, 2},
                      Case{"uneven_padding", 1, 4, 3, 7, 8, 3, 3,
                           make_options({1, 1}, {1, 1}, {0, 1, 2, 3}), true, true, 1},
                      Case{"uneven_stride", 1, 4, 3, 9, 12, 3, 3,
                           make_options({3, 2}, {1, 1}, {1, 1, 1, 1}), true, true, 2},
                      Case{"uneven_dilation", 1, 4, 3, 9, 12, 3, 3,
                           make_options({1, 1}, {1, 3}, {1, 1, 1, 1}), true, true, 2},
                      Case{"uneven_kernel", 1, 4, 3, 9, 12, 2, 5,
                           make_options({1, 1}, {1, 1}, {1, 2, 0, 2}), true, true, 2},
                      Case{"both_groups", 1, 12, 6, 7, 8, 3, 3,
                           make_options({2, 1}, {1, 2}, {1, 2, 1, 2}, 3, 2), true, true, 2},
                      Case{"as_many_groups_as_channels", 1, 5, 5, 7, 8, 3, 3,
                           make_options({1, 1}, {1, 1}, {1, 1, 1, 1}, 5, 5), true, true, 2},
                      Case{"batch", 3, 4, 3, 7, 8, 3, 3,
                           make_options({1, 1}, {1, 1}, {1, 1, 1, 1}, 1, 2), true, true, 2},
                      Case{"far_outside", 1, 4, 3, 7, 8, 3, 3,
                           make_options({1, 1}, {1, 1}, {1, 1, 1, 1}), true, true, 12},
                      Case{"one_tap", 1, 4, 3, 5, 5, 1, 1,
                           make_options({1, 1}, {1, 1}, {0, 0, 0, 0}), true, true, 1},
                      Case{"many_channels", 1, 40, 37, 8, 9, 3, 3,
                           make_options({1, 1}, {1, 1}, {1, 1, 1, 1}), true, true, 2}),
    [](const auto& chosen) { return std::string(chosen.param.name); });

/// Input 1, 2, 3, … and a kernel of one tap that copies it.
struct Copy {
  cv::Mat input = tensor({1, 1, 4, 5});
  cv::Mat offsets = tensor({1, 2, 4, 5});
  cv::Mat output;
  DeformableConvolution convolution{tensor({1, 1, 1, 1}, 1), cv::Mat()};

  Copy() {
    for (int i = 0; i < 20; ++i) input.ptr<float>()[i] = float(i + 1);
  }
  float sample(float y, float x) {
    offsets.at<float>(cv::Vec4i(0, 0, 0, 0)) = y;
    offsets.at<float>(cv::Vec4i(0, 1, 0, 0)) = x;
    convolution.apply(input, offsets, cv::Mat(), output);
    return at(output, 0, 0, 0, 0);
  }
};

TEST(DeformableConvolution, SamplesOutsideTheImageFadeToZero) {
  Copy copy;
  EXPECT_FLOAT_EQ(copy.sample(0, 0), 1);
  EXPECT_FLOAT_EQ(copy.sample(1, 2), 8);
  EXPECT_FLOAT_EQ(copy.sample(0.5F, 0.25F), 0.75F * 3.5F + 0.25F * 4.5F);
  EXPECT_FLOAT_EQ(copy.sample(-0.5F, 0), 0.5F);
  EXPECT_FLOAT_EQ(copy.sample(-0.5F, -0.5F), 0.25F);
  EXPECT_FLOAT_EQ(copy.sample(3.75F, 4.5F), 20 * 0.25F * 0.5F);
  EXPECT_EQ(copy.sample(-1, 0), 0);
  EXPECT_EQ(copy.sample(4, 0), 0);
  EXPECT_EQ(copy.sample(0, 5), 0);
  EXPECT_EQ(copy.sample(-1e30F, 1e30F), 0);
}

TEST(DeformableConvolution, NonFiniteOffsetsReadZero) {
  Copy copy;
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), infinity, -infinity}) {
    EXPECT_EQ(copy.sample(bad, 0), 0);
    EXPECT_EQ(copy.sample(0, bad), 0);
    EXPECT_EQ(at(copy.output, 0, 0, 3, 4), 20);
  }
}

TEST(DeformableConvolution, RefusesMisuse) {
  const auto refused = [](auto&& call, const char* part) {
    expect_error<std::invalid_argument>(call, part);
  };
  const cv::Mat weights = tensor({4, 3, 3, 3});
  DeformableConvolutionOptions options;
  refused([&] { DeformableConvolution(cv::Mat(), cv::Mat()); }, "weights");
  refused([&] { DeformableConvolution(weights, tensor({1, 3})); }, "bias CV_32FC1 [1, 3]");
  options.groups = 3;
  refused([&] { DeformableConvolution(weights, cv::Mat(), options); }, "groups of one size");
  options = {};
  options.stride = {0, 1};
  refused([&] { DeformableConvolution(weights, cv::Mat(), options); }, "stride 0x1");
  options = {};
  options.pad_right = -1;
  refused([&] { DeformableConvolution(weights, cv::Mat(), options); }, "a padding of -1");

  DeformableConvolution convolution(weights, cv::Mat());
  const cv::Mat input = tensor({1, 3, 5, 6});
  const cv::Mat offsets = tensor({1, 18, 3, 4});
  cv::Mat output = tensor({1, 1}, 5);
  refused(
      [&] {
        convolution.apply(tensor({1, 4, 5, 6}), offsets, cv::Mat(), output);
      },
      "3 channels");
  refused(
      [&] {
        convolution.apply(input, tensor({1, 18, 4, 3}), cv::Mat(), output);
      },
      "[1, 18, 3, 4]");
  refused(
      [&] {
        convolution.apply(input, offsets, tensor({1, 18, 3, 4}), output);
      },
      "[1, 9, 3, 4]");
  EXPECT_EQ(output.at<float>(0), 5);
  convolution.apply(input, offsets, cv::Mat(), output);
  EXPECT_EQ(shape_of(output), (std::vector<int>{1, 4, 3, 4}));
  convolution.apply(tensor({1, 3, 3, 3}), tensor({1, 18, 1, 1}), cv::Mat(), output);
  EXPECT_EQ(shape_of(output), (std::vector<int>{1, 4, 1, 1}));  // of another size
}

}  // namespace
}  // namespace dynfilter::detail
