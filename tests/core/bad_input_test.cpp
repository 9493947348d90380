// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Every misuse of the core throws std::invalid_argument, which names the component, what it got and
// what it wants, and leaves the caller's data unchanged.

#include "dynfilter/dense_depth_lbp.hpp"
#include "support/filter_property.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

FilterCase good_case() {
  FilterCase input;
  input.frame.image = cv::Mat::zeros(20, 30, CV_8UC3);
  input.frame.depth = cv::Mat(20, 30, CV_16UC1, cv::Scalar(5000));
  input.frame.metres_per_unit = 1.0 / 5000;
  input.segmentation.image_size = {30, 20};
  for (int k = 0; k < 2; ++k) {
    input.segmentation.instances.push_back(
        Instance::from_box_mask(cv::Mat(5, 5, CV_8UC1, cv::Scalar(255)), {3, 3, 5, 5}));
  }
  input.keypoints = {{4, 4, 1}, {20, 10, 1}};
  return input;
}

struct BadInput {
  std::function<void(FilterCase&)> spoil;
  std::vector<std::string> parts;  // of the message
};

const cv::Mat float_image = cv::Mat::zeros(4, 4, CV_32FC1);

Instance& second_instance(FilterCase& input) { return input.segmentation.instances[1]; }

const std::vector<BadInput> bad_inputs = {
    {[](auto& c) { c.frame.depth = cv::Mat1b::zeros(20, 30); },
     {"CV_8UC1", "CV_16UC1", "CV_32FC1"}},
    {[](auto& c) { c.frame.depth = cv::Mat1d::zeros(20, 30); }, {"CV_64FC1"}},
    {[](auto& c) { c.frame.depth = cv::Mat1w::zeros(10, 15); }, {"30x20", "15x10"}},
    {[](auto& c) {
       c.frame.image = cv::Mat({2, 20, 30}, CV_8UC1);
     },
     {"CV_8UC1 with 3 dimensions"}},
    {[](auto& c) { c.frame.metres_per_unit = 0; }, {"metres_per_unit = 0"}},
    {[](auto& c) { c.frame.metres_per_unit = 5000; }, {"metres_per_unit = 5000", "at most 1"}},
    {[](auto& c) { c.frame.metres_per_unit = not_a_number; }, {"metres_per_unit = nan"}},
    {[](auto& c) { c.frame.metres_per_unit = infinite; }, {"metres_per_unit = inf"}},
    {[](auto& c) { c.frame.timestamp_s = not_a_number; }, {"timestamp_s = nan", "frame"}},
    {[](auto& c) { c.segmentation.timestamp_s = infinite; }, {"timestamp_s = inf", "segmentation"}},
    {[](auto& c) {
       c.segmentation.image_size = {640, 480};
     },
     {"640x480", "30x20"}},
    {[](auto& c) {
       c.frame.depth = cv::Mat();
       c.segmentation.image_size = {640, 480};
     },
     {"640x480", "an image of 30x20"}},
    {[](auto& c) { c.segmentation.image_size = {}; }, {"image_size 0x0", "2 instances"}},
    {[](auto& c) {
       c.segmentation = {0, 0, {640, -480}, {}};
     },
     {"image_size 640x-480", "sides of 0 to"}},
    {[](auto& c) { second_instance(c).mask = float_image; }, {"CV_32FC1", "instance 1", "CV_8UC1"}},
    {[](auto& c) { second_instance(c).box.width = -4; }, {"box of -4x5", "instance 1"}},
    {[](auto& c) { second_instance(c).score = 87.0F; }, {"score 87", "instance 1"}},
    {[](auto& c) { second_instance(c).score = std::nanf(""); }, {"score nan", "instance 1"}},
    {[](auto& c) { c.options.mask_culler.static_mask = cv::Mat1b::zeros(48, 64); },
     {"static_mask of 64x48", "30x20", "MaskCuller"}},
};

TEST(BadInput, FilterNamesItAndLeavesNoLabels) {
  ASSERT_EQ(check_filter(good_case()), "");
  for (const BadInput& bad : bad_inputs) {
    FilterCase input = good_case();
    bad.spoil(input);
    FeatureLabels labels(5, Segmentation());
    labels.remove(3, -1, Reason::custom, 0.5F);
    Workspace workspace;
    const std::vector<cv::KeyPoint> keypoints = input.keypoints;
    const auto apply = [&] {
      DynamicFilter(input.options)
          .apply(input.frame, input.segmentation, input.keypoints, labels, workspace);
    };
    for (const char* part : {"dynfilter::", "got ", "; want "}) {
      expect_misuse(apply, part);
    }
    for (const std::string& part : bad.parts) expect_misuse(apply, part);
    EXPECT_TRUE(labels.empty()) << bad.parts[0];
    EXPECT_EQ(labels.statistics().removed(), 0U) << bad.parts[0];
    EXPECT_TRUE(std::equal(keypoints.begin(), keypoints.end(), input.keypoints.begin(),
                           [](const auto& a, const auto& b) { return a.pt == b.pt; }));
  }
}

TEST(BadInput, StageCalledAloneNamesIt) {
  const FilterCase input = good_case();
  const FilterInput stage_input = {input.frame, input.segmentation, input.keypoints};
  FeatureLabels too_few(1, input.segmentation);
  FeatureLabels other_instances(2, Segmentation());
  const MaskCuller culler;
  const EdgeCompensator compensator;
  expect_misuse([&] { culler(stage_input, too_few); }, "MaskCuller: got 1 labels and 2 features");
  expect_misuse([&] { compensator(stage_input, too_few); },
                "EdgeCompensator: got 1 labels and 2 features");
  expect_misuse([&] { compensator(stage_input, other_instances); },
                "0 instances in the labels and 2 in the segmentation");
}

struct BadCall {
  std::function<void()> call;
  std::string message;
};

template <class Change>
std::function<void()> with_culler_options(const Change& change) {
  return [change] {
    MaskCullerOptions options;
    change(options);
    MaskCuller culler(options);
  };
}

const std::vector<BadCall> bad_calls = {
    {with_culler_options([](auto& o) { o.margin_px = -1; }), "MaskCuller: got margin_px = -1"},
    {with_culler_options([](auto& o) { o.margin_px = not_a_number; }), "margin_px = nan"},
    {with_culler_options([](auto& o) { o.static_mask = float_image; }),
     "static_mask of type CV_32FC1"},
    {with_culler_options([](auto& o) {
       o.static_mask = cv::Mat({2, 3, 4}, CV_8UC1);
     }),
     "static_mask of type CV_8UC1 with 3 dimensions"},
    {[] { RangeEstimator estimator({-0.1}); }, "RangeEstimator: got expansion = -0.1"},
    {[] {
       std::vector<double> values = {1, 2, not_a_number, 3, 4};
       RangeEstimator().estimate(values);
     },
     "RangeEstimator: got the value nan"},
    {[] {
       EdgeCompensatorOptions options;
       options.samples = 4;
       EdgeCompensator compensator(options);
     },
     "EdgeCompensator: got samples = 4"},
    {[] {
       MaskCullerOptions options;
       options.static_mask = cv::Mat::zeros(5, 5, CV_8UC1);
       Segmentation segmentation;
       segmentation.image_size = {30, 20};
       mask_of_static_pixels(segmentation, MaskCuller(options));
     },
     "a static_mask of 5x5 and an image of 30x20"},
    {[] {
       std::vector<int> ids(2);
       keep_static(FeatureLabels(2, Segmentation()), ids, ids);
     },
     "keep_static: got column 1 that is column 0 again"},
    {[] {
       Segmentation segmentation;
       segmentation.image_size = {64, 48};
       draw_overlay(cv::Mat::zeros(4, 4, CV_8UC1), segmentation, FeaturesView(), FeatureLabels());
     },
     "64x48"},
    {[] { FeatureSampler sampler(0); }, "FeatureSampler: got samples = 0"},
    {[] {
       DepthLbp().code(cv::Mat1b::zeros(4, 4), {1, 1});
     },
     "CV_8UC1"},
    {[] { dense_depth_lbp(cv::Mat::zeros(4, 4, CV_16SC1)); }, "CV_16SC1"},
    {[] {
       std::vector<std::optional<std::uint8_t>> codes;
       DepthLbp().codes(cv::Mat::zeros(4, 4, CV_64FC1), FeaturesView(), codes);
     },
     "CV_64FC1"},
    {[] { Instance::from_image_mask(cv::Mat()); }, "Instance::from_image_mask: got an empty mask"},
    {[] {
       Instance::from_image_mask(float_image, {0, 0, 4, 4});
     },
     "mask of type CV_32FC1"},
    {[] { Instance::from_static_mask(float_image); }, "Instance::from_static_mask"},
    {[] {
       Instance::from_box_mask(cv::Mat::zeros(4, 5, CV_8UC1), {0, 0, 4, 5});
     },
     "a mask of 5x4 and a box of 4x5"},
    {[] { instances_from_label_map(float_image); }, "instances_from_label_map"},
    {[] { instances_from_binary_mask(float_image); }, "instances_from_binary_mask"},
    {[] { instances_from_binary_mask(cv::Mat::zeros(4, 4, CV_8UC1), -1); }, "box_margin_px = -1"},
    {[] { instances_from_binary_mask(cv::Mat::zeros(4, 4, CV_8UC1), 0, 0); }, "min_pixels = 0"},
    {[] { CallbackSegmenter segmenter(nullptr); }, "CallbackSegmenter: got an empty callback"},
    {[] {
       CallbackSegmenter segmenter([](const cv::Mat&) { return std::vector<Instance>(); });
       segmenter.segment({0, 0, {}, cv::Mat1f::ones(4, 4), 0});
     },
     "CallbackSegmenter: got a frame without an image"},
    {[] { draw_features(float_image, FeaturesView()); },
     "draw_overlay: got an image of type CV_32FC1"},
    {[] {
       draw_overlay(cv::Mat::zeros(4, 4, CV_8UC1), Segmentation(), FeaturesView(),
                    FeatureLabels(3, Segmentation()));
     },
     "3 labels and 0 features"},
};

TEST(BadInput, EveryOtherCallNamesIt) {
  for (const BadCall& bad : bad_calls) {
    expect_misuse(bad.call, bad.message);
    expect_misuse(bad.call, "; want ");
  }
}

}  // namespace
}  // namespace dynfilter::testing
