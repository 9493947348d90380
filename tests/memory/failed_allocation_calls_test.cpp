// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Every call of the core, apart from the whole filter (failed_allocation_test.cpp): a failed
// allocation never gives a wrong answer, then or later, and leaves the caller's data unchanged.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dynfilter/dense_depth_lbp.hpp"
#include "dynfilter/host_masks.hpp"
#include "dynfilter/overlay.hpp"
#include "dynfilter/stereo_depths.hpp"
#include "support/answer.hpp"
#include "support/filter_case.hpp"

namespace dynfilter::testing {
namespace {

const cv::Size size(60, 45);

/// Frame with depth, three instances and a hundred features, some with known depths.
const FilterCase& input() {
  static const FilterCase made = [] {
    ByteSource source(21);
    FilterCase drawn = arbitrary_case(source, size);
    drawn.frame.image = cv::Mat(size, CV_8UC3, cv::Scalar(40, 80, 120));
    drawn.frame.depth = arbitrary_depth(source, size, false);
    drawn.frame.metres_per_unit = 1.0 / 5000;
    drawn.segmentation.instances.clear();
    for (int k = 0; k < 3; ++k) {
      Instance person = Instance::from_box({15 * k, 5, 25, 35}, k % 2);
      person.mask = cv::Mat(25, 15, CV_8UC1, cv::Scalar(255));
      person.mask_origin = {15 * k + 3, 10};
      drawn.segmentation.instances.push_back(person);
    }
    for (int i = 0; i < 100; ++i) {
      drawn.keypoints.emplace_back(static_cast<float>(source.between(0, 59)),
                                   static_cast<float>(source.between(0, 44)), 9.0F);
    }
    drawn.depths_m.emplace(drawn.keypoints.size(), 1.0F);
    return drawn;
  }();
  return made;
}

/// Everything that the calls read.
Answer all_input() {
  Answer answer;
  answer.add(input().frame.image).add(input().frame.depth).add(input().segmentation.instances);
  for (const cv::KeyPoint& keypoint : input().keypoints) {
    answer.add(double{keypoint.pt.x}).add(double{keypoint.pt.y});
  }
  return answer;
}

const FeatureLabels& labels() {
  static const FeatureLabels made =
      DynamicFilter().apply(input().frame, input().segmentation, input().features());
  return made;
}

cv::Mat label_map() {
  cv::Mat map(size, CV_8UC1, cv::Scalar(0));
  map(cv::Rect(3, 4, 20, 20)).setTo(1);
  map(cv::Rect(30, 10, 20, 30)).setTo(2);
  return map;
}

using Call = std::function<Answer()>;

struct PublicCall {
  std::string name;
  std::function<Call()> make;
  std::size_t min_failures;
};

/// Call that keeps nothing.
template <class Function>
std::function<Call()> plain(const Function& function) {
  return [function] { return Call([function] { return Answer().add(function()); }); };
}

/// Stage that keeps its labels and its workspace.
template <class Stage>
std::function<Call()> stage(const Stage& filter) {
  return [filter]() -> Call {
    struct Kept {
      FeatureLabels labels;
      Workspace workspace;
    };
    return [filter, kept = std::make_shared<Kept>()] {
      const FilterCase& made = input();
      filter.apply(made.frame, made.segmentation, made.features(), kept->labels, kept->workspace);
      return Answer().add(kept->labels);
    };
  };
}

MaskCullerOptions culler_options() {
  MaskCullerOptions options;
  options.margin_px = 3;
  options.static_mask = cv::Mat(size, CV_8UC1, cv::Scalar(0));
  return options;
}

FilterCase without_depth() {
  FilterCase made = input();
  made.frame.depth.release();
  return made;
}

const std::vector<PublicCall>& calls() {
  static const std::vector<PublicCall> all = {
      {"MaskCuller", stage(Pipeline(MaskCuller(culler_options()))), 2},
      {"DepthCompensator", stage(Pipeline(MaskCuller(), DepthCompensator())), 5},
      {"EdgeCompensator", stage(Pipeline(MaskCuller(), EdgeCompensator())), 5},
      {"FeatureFloor",
       stage(Pipeline(MaskCuller(), FeatureFloor({90, FloorPolicy::restore_balanced}))), 3},
      {"FeatureDepthCompensator",
       [] {
         return Call([kept = std::make_shared<std::pair<FeatureLabels, Workspace>>()] {
           const FilterCase made = without_depth();
           DynamicFilter().apply(made.frame, made.segmentation, made.features(), kept->first,
                                 kept->second);
           return Answer().add(kept->first);
         });
       },
       5},
      {"DepthLbp::codes",
       [] {
         using Codes = std::vector<std::optional<std::uint8_t>>;
         return Call([codes = std::make_shared<Codes>()] {
           DepthLbp().codes(input().frame.depth, input().features(), *codes);
           Answer answer;
           for (const auto& code : *codes) answer.add(code ? *code : -1);
           return answer;
         });
       },
       1},
      {"dense_depth_lbp", plain([] { return dense_depth_lbp(input().frame.depth); }), 1},
      {"DepthCompensator::refined",
       plain([] { return DepthCompensator().refined(input().frame, input().segmentation, 1); }), 5},
      {"StereoDepths",
       [] {
         struct Kept {
           std::vector<cv::Rect> areas;
           Workspace workspace;
         };
         return Call([kept = std::make_shared<Kept>()] {
           const FilterCase& made = input();
           stereo_areas({made.frame, made.segmentation, made.keypoints}, MaskCuller(), {},
                        kept->areas);
           std::vector<float> depths_m(made.keypoints.size(), 0.F);
           const cv::Mat image = label_map();
           StereoDepths().find({image, image, 5}, made.keypoints, kept->areas, depths_m,
                               kept->workspace);
           return Answer().add(depths_m);
         });
       },
       8},
      {"new_indices", plain([] { return new_indices(labels()); }), 1},
      {"mask_of_dynamic_pixels",
       plain([] { return mask_of_dynamic_pixels(input().segmentation, MaskCuller()); }), 1},
      {"mask_of_static_pixels",
       plain([] { return mask_of_static_pixels(input().segmentation, MaskCuller()); }), 1},
      {"depth_with_holes", plain([] {
         return depth_with_holes(input().frame.depth, input().segmentation, MaskCuller());
       }),
       2},
      {"DetectionMask", plain([] {
         return DetectionMask(input().segmentation).allows({20, 20}) ? 1.0 : 0.0;
       }),
       1},
      {"draw_overlay", plain([] {
         // Few features, because OpenCV allocates hundreds of times to draw one.
         static const std::vector<cv::KeyPoint> some(input().keypoints.begin(),
                                                     input().keypoints.begin() + 2);
         const FeatureLabels kept(some.size(), input().segmentation);
         OverlayOptions options;
         options.boxes = false;
         return draw_overlay(input().frame.image, input().segmentation, some, kept, options);
       }),
       5},
      {"instances_from_label_map", plain([] { return instances_from_label_map(label_map()); }), 3},
      {"instances_from_binary_mask",
       plain([] { return instances_from_binary_mask(label_map() != 0, 5, 1); }), 3},
      {"Instance::from_image_mask", plain([] {
         return Instance::from_image_mask(label_map(), {3, 4, 20, 20});
       }),
       1},
      {"Instance::from_static_mask",
       plain([] { return Instance::from_static_mask(label_map() == 0); }), 1},
      {"FrameFeatures", plain([] {
         Workspace workspace;
         double sum = 0;
         for (const std::size_t i :
              frame_features(input().features(), workspace).inside(cv::Rect(5, 5, 30, 30))) {
           sum += static_cast<double>(i * i);
         }
         return sum;
       }),
       3},
  };
  return all;
}

class FailedAllocationOfCall : public ::testing::TestWithParam<std::size_t> {
 protected:
  void SetUp() override { cv::setNumThreads(1); }  // allocations fail only in this thread
  void TearDown() override { cv::setNumThreads(-1); }
};

TEST_P(FailedAllocationOfCall, GivesNoWrongAnswer) {
  const PublicCall& call = calls()[GetParam()];
  const Answer before = all_input();
  EXPECT_GE(expect_right_answers(call.make), call.min_failures);
  EXPECT_TRUE(all_input() == before);
}

INSTANTIATE_TEST_SUITE_P(Core, FailedAllocationOfCall, ::testing::Range<std::size_t>(0, 22),
                         [](const auto& test) {
                           std::string name = calls()[test.param].name;
                           for (char& c : name) c = c == ':' ? '_' : c;
                           return name;
                         });

TEST(FailedAllocationOfCalls, AreAllTested) { EXPECT_EQ(calls().size(), 22U); }

TEST(FailedAllocationOfCalls, OfTheRangeEstimatorDoNotExist) {
  std::vector<double> values = {3, 1, 2, 5, 4, 100};
  EXPECT_FALSE(fails_at_allocation(1, [&] { RangeEstimator().estimate(values); }));
}

/// Each column is moved or none, and a pivot is where it was.
TEST(FailedAllocationOfCalls, KeepStaticKeepsColumnsOfAllKindsInStep) {
  const FeatureLabels& of = labels();
  ASSERT_GT(of.statistics().removed(), 0U);
  const std::size_t failed = for_each_failing_allocation([&](std::size_t n) {
    std::vector<cv::KeyPoint> keypoints = input().keypoints;
    std::vector<std::string> names(of.size(), "a name too long to be stored in the object itself");
    cv::Mat descriptors(static_cast<int>(of.size()), 32, CV_8UC1, cv::Scalar(5));
    const cv::Mat shared = descriptors;
    const bool did_fail =
        fails_at_allocation(n, [&] { keep_static(of, keypoints, names, descriptors); });
    const std::size_t left = did_fail ? of.size() : of.statistics().kept();
    EXPECT_EQ(keypoints.size(), left);
    EXPECT_EQ(names.size(), left);
    EXPECT_EQ(descriptors.rows, static_cast<int>(left));
    return did_fail;
  });
  EXPECT_GT(failed, 0U);
}

}  // namespace
}  // namespace dynfilter::testing
