// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/instance_motion.hpp"

#include <ctime>

#include "support/test.hpp"

namespace dynfilter::detail {
namespace {

Segmentation at(std::vector<cv::Rect> boxes, std::vector<std::optional<int>> ids = {}) {
  Segmentation segmentation;
  segmentation.image_size = {640, 480};
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    Instance instance;
    instance.box = boxes[k];
    if (k < ids.size()) instance.track_id = ids[k];
    segmentation.instances.push_back(instance);
  }
  return segmentation;
}

constexpr int still_frames = 4;
const InstanceVotes quiet_votes{20, 0, true, true};
const InstanceVotes restless_votes{20, 3, false, true};
const InstanceVotes moving_votes{20, 7, false, true};
const cv::Rect here_box(100, 100, 80, 200), there_box(400, 100, 80, 200);

InstanceVerdict next(InstanceMotion& instances, const std::optional<InstanceVotes>& votes) {
  instances.begin_frame(at({here_box}));
  return instances.judge(0, votes);
}

/// Returns instances of which the one in `here_box` has just become still.
InstanceMotion with_still_one() {
  InstanceMotion instances(still_frames);
  for (int i = 0; i < still_frames; ++i) next(instances, quiet_votes);
  return instances;
}

TEST(InstanceMotion, MovesAtOnce) {
  InstanceMotion instances = with_still_one();
  EXPECT_EQ(next(instances, moving_votes), InstanceVerdict::moving);
  EXPECT_EQ(next(instances, quiet_votes), InstanceVerdict::undecided);
}

/// A single frame may be wrong about a person who stays.
TEST(InstanceMotion, IsSettledWhereItStaysOrKeepsMoving) {
  InstanceMotion instances(still_frames);
  for (const bool is_settled : {false, false, true, true}) {
    next(instances, moving_votes);
    EXPECT_EQ(instances.is_settled(0), is_settled);
  }
  // Once it is still, one restless_votes frame must not change that.
  instances = with_still_one();
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(instances.is_settled(0));
    EXPECT_EQ(next(instances, quiet_votes), InstanceVerdict::still);
  }
  EXPECT_TRUE(instances.is_settled(0));
  EXPECT_EQ(next(instances, restless_votes), InstanceVerdict::still);
  EXPECT_FALSE(instances.is_settled(0));
  instances.begin_frame(at({there_box}));
  EXPECT_FALSE(instances.is_settled(0)) << "it is another one";
}

/// Two thousand took 40 s when each pair was sought among all that were left.
TEST(InstanceMotion, MatchesThousandsOfInstancesInTime) {
  std::vector<cv::Rect> boxes;
  for (int k = 0; k < 2000; ++k) boxes.emplace_back(10 * (k % 50), 10 * (k / 50), 12, 12);
  InstanceMotion instances(1);
  const std::clock_t begin = std::clock();
  for (int frame = 0; frame < 2; ++frame) {
    instances.begin_frame(at(boxes));
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      EXPECT_EQ(instances.was_still(k), frame == 1 && k % 2 == 0);
      instances.judge(k, k % 2 == 0 ? quiet_votes : moving_votes);
    }
  }
  EXPECT_LT((std::clock() - begin) / CLOCKS_PER_SEC, 5);
}

/// A neighbour that is gone, whose box overlaps, does not pass its motion on.
TEST(InstanceMotion, IsMatchedToOneOfTheLastFrame) {
  InstanceMotion instances(still_frames);
  for (int i = 0; i < still_frames; ++i) {
    instances.begin_frame(at({here_box, here_box + cv::Point(10, 0)}));
    instances.judge(0, quiet_votes);
    instances.judge(1, moving_votes);
  }
  EXPECT_EQ(next(instances, quiet_votes), InstanceVerdict::still);
}

TEST(InstanceMotion, ForgivesOneRestlessFrameOfALongRest) {
  InstanceMotion instances = with_still_one();
  EXPECT_EQ(next(instances, restless_votes), InstanceVerdict::undecided);
  instances = with_still_one();
  for (int i = 0; i < 10; ++i) next(instances, quiet_votes);
  EXPECT_EQ(next(instances, restless_votes), InstanceVerdict::still);
  EXPECT_EQ(next(instances, restless_votes), InstanceVerdict::undecided);
}

TEST(InstanceMotion, SaysNothingWhereNothingWasJudged) {
  InstanceMotion instances = with_still_one();
  EXPECT_EQ(next(instances, std::nullopt), InstanceVerdict::undecided);
  // An incomplete frame neither helps nor harms.
  instances = with_still_one();
  InstanceVotes incomplete = quiet_votes;
  incomplete.is_complete = false;
  EXPECT_EQ(next(instances, incomplete), InstanceVerdict::still);
  instances.clear();
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(next(instances, incomplete), InstanceVerdict::undecided);
  }
}

TEST(InstanceMotion, FollowsObjectsInAnyOrder) {
  InstanceMotion instances = with_still_one();
  instances.begin_frame(at({there_box, here_box + cv::Point(8, 3)}));
  EXPECT_EQ(instances.judge(0, quiet_votes), InstanceVerdict::undecided);
  EXPECT_EQ(instances.judge(1, quiet_votes), InstanceVerdict::still);
  // Of two that overlap the old box, the nearer one is the object.
  instances.begin_frame(at({here_box + cv::Point(40, 0), here_box + cv::Point(10, 3)}));
  EXPECT_EQ(instances.judge(0, quiet_votes), InstanceVerdict::undecided);
  EXPECT_EQ(instances.judge(1, quiet_votes), InstanceVerdict::still);
}

TEST(InstanceMotion, FollowsIdsBeforeBoxes) {
  InstanceMotion instances(still_frames);
  for (int i = 0; i < 8; ++i) {
    instances.begin_frame(at({here_box}, {7}));
    instances.judge(0, quiet_votes);
  }
  instances.begin_frame(at({here_box, there_box}, {8, 7}));
  EXPECT_EQ(instances.judge(0, quiet_votes), InstanceVerdict::undecided);
  EXPECT_EQ(instances.judge(1, quiet_votes), InstanceVerdict::still);
}

TEST(InstanceMotion, ForgetsWhatIsMissing) {
  InstanceMotion instances = with_still_one();
  instances.begin_frame(at({}));
  EXPECT_EQ(next(instances, quiet_votes), InstanceVerdict::undecided);
}

}  // namespace
}  // namespace dynfilter::detail
