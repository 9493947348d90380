// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Common properties of the rules in src/lab/rules that compare frames, as stages with a memory.

#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "lab/rules/frames.hpp"
#include "lab/rules/person_rules.hpp"
#include "lab/rules/point_rules.hpp"
#include "lab/rules/region_rules.hpp"
#include "support/expect_error.hpp"
#include "support/filter_case.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

using Stage = std::function<void(const FilterInput&, FeatureLabels&, Workspace&)>;
const cv::Size frame_size(97, 73);

/// Makes the stage of every rule, with memories of their own.
std::vector<Stage> all_stages() {
  const PinholeCamera camera{80, 80, 48, 36};
  return {peers::OnFrames(peers::EpipolarVote(), camera),
          peers::OnFrames(peers::DepthConsistency(), camera),
          peers::OnFrames(peers::FlowChiSquare(), camera),
          peers::OnFrames(peers::ClusterVotes(), camera),
          peers::OnFrames(peers::PointCorrelations(), camera),
          peers::OnFrames(peers::RegionBayes(), camera),
          peers::OnFrames(peers::TemplateStillness(), camera),
          peers::OnFrames(peers::FlowRefinedMask(), camera)};
}

/// Sequence of hostile frames: depths, boxes, masks and features anywhere; at times without depth,
/// without image or of another size.
struct HostileFrame {
  FrameView frame;
  Segmentation segmentation;
  std::vector<cv::KeyPoint> keypoints;
};

std::vector<HostileFrame> hostile_frames(std::uint64_t seed) {
  ByteSource source(seed);
  std::vector<HostileFrame> frames(7);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    HostileFrame& one = frames[k];
    const cv::Size size =
        source.chance(10) ? cv::Size(source.between(1, 60), source.between(1, 60)) : frame_size;
    one.frame.timestamp_s = 0.1 * static_cast<double>(k);
    if (source.chance(95)) {
      const cv::Mat1b picture = texture({140, 100}, seed);
      one.frame.image =
          picture(cv::Rect({source.between(0, 9), source.between(0, 9)}, size)).clone();
    }
    const bool is_float = source.chance(50);
    if (source.chance(90)) one.frame.depth = arbitrary_depth(source, size, is_float);
    one.frame.metres_per_unit = 1.0 / 5000;
    if (is_float) one.frame.metres_per_unit = 0;
    one.segmentation.image_size = size;
    for (int i = source.between(0, 3); i > 0; --i) {
      one.segmentation.instances.push_back(arbitrary_instance(source, size));
    }
    one.keypoints = arbitrary_keypoints(source, size);
  }
  return frames;
}

TEST(PeersOfFrames, AcceptHostileSequencesAndKeepWhatIsOutside) {
  std::vector<std::size_t> removed(all_stages().size());
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const std::vector<Stage> stages = all_stages(), again = all_stages();
    Workspace workspace, other_workspace;
    for (const HostileFrame& one : hostile_frames(seed)) {
      const FilterInput input{one.frame, one.segmentation, one.keypoints};
      for (std::size_t k = 0; k < stages.size(); ++k) {
        FeatureLabels labels(one.keypoints.size(), one.segmentation), second = labels;
        ASSERT_NO_THROW(stages[k](input, labels, workspace)) << "seed " << seed << " rule " << k;
        again[k](input, second, other_workspace);
        const cv::Rect image({0, 0}, one.segmentation.image_size);
        for (std::size_t i = 0; i < labels.size(); ++i) {
          const bool is_outside = !image.contains(input.features.pixel(i));
          ASSERT_FALSE(is_outside && labels.is_removed(i)) << "seed " << seed << " rule " << k;
          ASSERT_EQ(labels.is_removed(i), second.is_removed(i)) << "seed " << seed << " rule " << k;
        }
        removed[k] += labels.statistics().removed();
      }
    }
  }
  EXPECT_GT(removed[6], 0U) << "boxes need no motion";
}

TEST(PeersOfFrames, RefuseLabelsOfAnotherLength) {
  const HostileFrame one = hostile_frames(1)[0];
  for (const Stage& stage : all_stages()) {
    FeatureLabels labels(one.keypoints.size() + 1, one.segmentation);
    Workspace workspace;
    expect_error<std::invalid_argument>(
        [&] {
          stage({one.frame, one.segmentation, one.keypoints}, labels, workspace);
        },
        "labels made or reset for these features");
  }
}

}  // namespace
}  // namespace dynfilter::testing
