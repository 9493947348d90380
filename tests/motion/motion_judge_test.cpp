// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_judge.hpp"

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/motion/motion_filter.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "motion/motion_frame.hpp"
#include "support/motion_rig.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

bool is_on_person(const Shot& shot, const cv::KeyPoint& keypoint, double distance_px) {
  const auto& persons = shot.rendered.true_segmentation.instances;
  return std::any_of(persons.begin(), persons.end(), [&](const Instance& person) {
    return detail::mask_within(person, nearest_pixel(keypoint.pt), distance_px);
  });
}

TEST(MotionJudge, KeepsTheFeaturesOfPeopleWhoStandStill) {
  Rig rig;
  std::size_t on_person = 0, kept = 0;
  for (int i = 0; i < frames; ++i) {
    const Shot& shot = shots(0)[static_cast<std::size_t>(i)];
    const FeatureLabels labels = rig.see(shot);
    if (i < 7) continue;
    EXPECT_EQ(labels.statistics().instances[0].verdict, InstanceVerdict::still) << i;
    EXPECT_EQ(labels.statistics().motion.kept_still, labels.statistics().restored);
    for (const FeatureLabel& label : labels) EXPECT_NE(label.reason, Reason::restored);
    for (std::size_t f = 0; f < labels.size(); ++f) {
      if (!is_on_person(shot, shot.keypoints[f], 0)) continue;
      ++on_person;
      kept += labels.is_removed(f) ? 0 : 1;
    }
  }
  EXPECT_GT(on_person, 100U);
  EXPECT_GE(static_cast<double>(kept), 0.92 * static_cast<double>(on_person));
}

TEST(FeaturePlace, IsApartOnlyByKnownDepths) {
  detail::FeaturePlace near, unknown;
  near.depth_m = 1;
  EXPECT_TRUE(near.is_apart_from(1.5F) && near.is_apart_from(0.5F));
  EXPECT_FALSE(near.is_apart_from(1) || near.is_apart_from(0) || unknown.is_apart_from(1));
  EXPECT_FALSE(unknown.has_ray());
}

/// Her body stands still, her arms do not: it is in doubt whether she rests, so little is kept.
TEST(MotionJudge, KeepsNoArmsOfAPersonWhoWorks) {
  const SyntheticScene scene(scene_level("working", 11));
  MotionFilter filter(scene.camera());
  FeatureLabels labels;
  Workspace workspace;
  std::size_t moving = 0, kept = 0;
  for (int i = 0; i < frames; ++i) {
    const Shot shot = shot_of(scene, i);
    filter.apply(shot.rendered.frame, shot.rendered.true_segmentation, shot.keypoints, labels,
                 workspace);
    for (std::size_t f = 0; f < labels.size(); ++f) {
      if (shot.rendered.moving_mask.at<std::uint8_t>(nearest_pixel(shot.keypoints[f].pt)) == 0) {
        continue;
      }
      ++moving;
      kept += labels.is_removed(f) ? 0 : 1;
    }
  }
  EXPECT_GT(moving, 200U);
  EXPECT_LE(static_cast<double>(kept), 0.15 * static_cast<double>(moving))
      << kept << " of " << moving;
}

TEST(MotionJudge, KeepsNothingOfPeopleWhoWalk) {
  Rig rig;
  for (const Shot& shot : shots(0.5)) {
    EXPECT_EQ(rig.see(shot).statistics().motion.kept_still, 0U);
  }
}

TEST(MotionJudge, FindsPeopleWithoutMasks) {
  Rig rig;
  std::size_t moving = 0, removed = 0, still = 0, lost = 0;
  for (int i = 0; i < frames; ++i) {
    const Shot& shot = shots(0.5)[static_cast<std::size_t>(i)];
    const FeatureLabels labels = rig.see_without_masks(shot);
    for (std::size_t f = 0; f < labels.size(); ++f) {
      const bool is_removed = labels.is_removed(f);
      if (is_removed) {
        EXPECT_EQ(labels[f].reason, Reason::moving);
        EXPECT_GE(labels[f].score, 0.5F);
      }
      if (i >= 3 && is_on_person(shot, shot.keypoints[f], 0)) {
        ++moving;
        removed += is_removed ? 1 : 0;
      } else if (!is_on_person(shot, shot.keypoints[f], 15)) {
        ++still;
        lost += is_removed ? 1 : 0;
      }
    }
  }
  EXPECT_GE(static_cast<double>(removed), 0.85 * static_cast<double>(moving));
  EXPECT_LE(static_cast<double>(lost), 0.002 * static_cast<double>(still));
}

/// Where too few features would be left to track, the least certain movers are kept.
TEST(MotionJudge, KeepsTheLeastCertainMoversWhereFewAreLeft) {
  const SyntheticScene scene(small_scene(0.5));
  Rig rig;
  int cautious = 0;
  for (int frame = 0; frame < frames; ++frame) {
    Shot shot = shots(0.5)[static_cast<std::size_t>(frame)];
    auto& features = shot.keypoints;
    std::size_t n = 0;  // one of eight beside the person is left
    const auto is_left_out = [&](const auto& f) {
      return ++n % 8 != 0 && !is_on_person(shot, f, 0);
    };
    features.erase(std::remove_if(features.begin(), features.end(), is_left_out), features.end());
    if (frame > 0) rig.judge.expect_motion(exact_prior(scene, frame));
    const FeatureLabels labels = rig.see_without_masks(shot);
    const auto& moving = rig.workspace.get<detail::MotionScratch>().found.moving;
    std::vector<float> kept, removed;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (frame > 0 && moving[i])
        (labels.is_removed(i) ? removed : kept).push_back(labels[i].score);
    }
    EXPECT_EQ(labels.statistics().moving, removed.size());
    if (kept.empty() || removed.empty()) continue;
    EXPECT_EQ(labels.statistics().kept(), std::min<std::size_t>(250, labels.size() / 2)) << frame;
    EXPECT_LE(*std::max_element(kept.begin(), kept.end()),
              *std::min_element(removed.begin(), removed.end()));
    ++cautious;
  }
  EXPECT_GE(cautious, 3);
}

TEST(MotionJudge, DoesNotDependOnTheOrderOfTheFeatures) {
  Rig one, other;
  for (const Shot& shot : shots(0.5)) {
    Shot reversed = shot;
    std::reverse(reversed.keypoints.begin(), reversed.keypoints.end());
    const FeatureLabels labels = one.see_without_masks(shot);
    const FeatureLabels backwards = other.see_without_masks(reversed);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      ASSERT_EQ(labels.is_removed(i), backwards.is_removed(labels.size() - 1 - i));
    }
  }
}

TEST(MotionJudge, StartsAnewAfterACut) {
  Rig cut, fresh;
  for (std::size_t i = 0; i < 5; ++i) cut.see(shots(0)[i]);
  for (std::size_t i = 5; i < 10; ++i) {
    // Another room, in step with the time.
    Shot shot = shots(0.5)[i];
    cv::Mat other;
    cv::flip(shot.rendered.frame.image, other, 0);
    shot.rendered.frame.image = other;
    const FeatureLabels labels = cut.see(shot), want = fresh.see(shot);
    if (i == 5) {
      EXPECT_EQ(labels.statistics().motion.outcome, MotionOutcome::started);
    }
    EXPECT_TRUE(same_labels(labels, want)) << i;
  }
}

TEST(MotionJudge, StartsAnewWhereTimeJumps) {
  for (const double jump_s : {0.7, 0.0, -1.0}) {
    Rig rig, fresh;
    for (std::size_t i = 0; i < 5; ++i) rig.see(shots(0.5)[i]);
    for (std::size_t i = 5; i < 9; ++i) {
      Shot shot = shots(0.5)[i];
      shot.rendered.frame.timestamp_s += jump_s;
      if (jump_s == 0 && i == 5) {  // the time stands still, and the image moves
        shot.rendered.frame.timestamp_s = shots(0.5)[4].rendered.frame.timestamp_s;
      }
      const FeatureLabels labels = rig.see(shot), want = fresh.see(shot);
      if (i == 5) {
        EXPECT_EQ(labels.statistics().motion.outcome, MotionOutcome::started);
      }
      EXPECT_TRUE(same_labels(labels, want)) << jump_s << ' ' << i;
    }
  }
}

TEST(MotionJudge, DoesNotTakeARepeatedImageForRest) {
  Rig rig;
  for (std::size_t i = 0; i < 3; ++i) rig.see(shots(0.5)[i]);
  for (int repeat = 1; repeat < 8; ++repeat) {
    Shot shot = shots(0.5)[2];
    shot.rendered.frame.timestamp_s += 0.033 * repeat;
    const FeatureLabels labels = rig.see(shot);
    EXPECT_EQ(labels.statistics().motion.outcome, MotionOutcome::repeated);
    EXPECT_EQ(labels.statistics().motion.kept_still, 0U);
  }
  Shot shot = shots(0.5)[2];  // for longer than a gap
  shot.rendered.frame.timestamp_s += 0.6;
  EXPECT_EQ(rig.see(shot).statistics().motion.outcome, MotionOutcome::started);
}

TEST(MotionJudge, AbstainsWithoutAnImage) {
  Rig rig, fresh;
  for (std::size_t i = 0; i < 4; ++i) rig.see(shots(0.5)[i]);
  Shot blind = shots(0.5)[4];
  blind.rendered.frame.image.release();
  const FeatureLabels labels = rig.see(blind);
  EXPECT_EQ(labels.statistics().motion.outcome, MotionOutcome::no_image);
  EXPECT_EQ(labels.statistics().moving, 0U);
  EXPECT_EQ(rig.see(shots(0.5)[5]).statistics().motion.outcome, MotionOutcome::started);
}

TEST(MotionJudge, NeedsDepthOrAKnownPose) {
  const SyntheticScene scene(small_scene(0.5));
  Rig blind, guided;
  std::size_t moving = 0;
  for (int i = 0; i < 6; ++i) {
    Shot shot = shots(0.5)[static_cast<std::size_t>(i)];
    shot.rendered.frame.depth.release();
    if (i > 0) guided.judge.expect_motion(exact_prior(scene, i));
    const FeatureLabels without = blind.see_without_masks(shot);
    const FeatureLabels with = guided.see_without_masks(shot);
    const MotionOutcome first = MotionOutcome::started;
    EXPECT_EQ(without.statistics().motion.outcome, i == 0 ? first : MotionOutcome::too_few_tracks);
    EXPECT_EQ(with.statistics().motion.outcome, i == 0 ? first : MotionOutcome::applied);
    EXPECT_EQ(without.statistics().removed(), 0U);
    moving += with.statistics().moving;
  }
  EXPECT_GT(moving, 100U);
}

TEST(MotionJudge, PredictsAFeatureWithoutDepthByTheFarthestDepthAround) {
  FrameView frame = shots(0)[1].rendered.frame;
  frame.depth = cv::Mat(frame.image.size(), CV_16U, cv::Scalar(20000));  // 4 m
  frame.depth.colRange(0, 200).setTo(5000);
  frame.depth(cv::Rect(195, 95, 11, 11)).setTo(0);
  const std::vector<cv::KeyPoint> features = {{200, 100, 31}, {300, 100, 31}};
  Rig rig;
  rig.see(shots(0)[0]);
  rig.see(frame, {}, features);
  const auto& read = rig.workspace.get<detail::MotionScratch>().found.places;
  EXPECT_EQ(read[0].depth_m, 0);
  EXPECT_FLOAT_EQ(read[0].place_depth_m, 4);
  EXPECT_FLOAT_EQ(read[1].place_depth_m, 4);
}

TEST(MotionJudge, LeavesFeaturesOutsideTheImageAlone) {
  Rig rig;
  for (std::size_t i = 0; i < 5; ++i) {
    Shot shot = shots(0.5)[i];
    const std::size_t inside = shot.keypoints.size();
    for (const float x : {-1.0F, 1e9F, -1e9F, NAN}) shot.keypoints.emplace_back(x, 50.0F, 1.0F);
    const FeatureLabels labels = rig.see_without_masks(shot);
    for (std::size_t f = inside; f < labels.size(); ++f) EXPECT_FALSE(labels.is_removed(f));
  }
}

/// A chair, whose class is static, and a person without a mask change nothing.
TEST(MotionJudge, LeavesOtherInstancesAlone) {
  Rig rig, alone;
  for (std::size_t i = 0; i < 6; ++i) {
    const Shot& shot = shots(0.5)[i];
    Segmentation more = shot.rendered.true_segmentation;
    constexpr int chair = 56;
    more.instances.push_back(Instance::from_box({20, 20, 90, 120}, chair, 0.9F));
    more.instances.back().mask_origin = {20, 20};
    more.instances.back().mask = cv::Mat(120, 90, CV_8UC1, cv::Scalar(255));
    more.instances.push_back(Instance::from_box({300, 20, 50, 60}, 0, 0.9F));
    const FeatureLabels labels = rig.see(shot.rendered.frame, more, shot.keypoints);
    EXPECT_TRUE(same_labels(labels, alone.see(shot))) << i;
    EXPECT_EQ(labels.statistics().instances.size(), more.instances.size());
  }
}

TEST(MotionJudge, LeavesTheStaticMaskAlone) {
  MaskCullerOptions options;
  options.static_mask = cv::Mat::zeros(360, 480, CV_8UC1);
  options.static_mask.colRange(0, 240).setTo(255);
  Rig rig;
  std::size_t on_static_mask = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const Shot& shot = shots(0.5)[i];
    const Segmentation& masks = shot.rendered.true_segmentation;
    FeatureLabels labels =
        Pipeline<MaskCuller>(MaskCuller(options)).apply(shot.rendered.frame, masks, shot.keypoints);
    const FeatureLabels before = labels;
    rig.judge({shot.rendered.frame, masks, shot.keypoints}, labels, rig.workspace);
    for (std::size_t f = 0; f < labels.size(); ++f) {
      if (!before.is_removed(f) || before[f].instance >= 0) continue;
      EXPECT_TRUE(labels.is_removed(f));
      EXPECT_EQ(labels[f].reason, before[f].reason);
      ++on_static_mask;
    }
  }
  EXPECT_GT(on_static_mask, 500U);
}

TEST(MotionJudge, WhoseFeaturesCannotBeTrackedIsNotStill) {
  Rig rig;
  for (int i = 0; i < frames; ++i) {
    Shot shot = shots(0)[static_cast<std::size_t>(i)];
    shot.rendered.frame.image = shot.rendered.frame.image.clone();
    for (const Instance& person : shot.rendered.true_segmentation.instances) {
      cv::Mat noise(shot.rendered.frame.image.size(), CV_8UC3);
      cv::RNG(static_cast<std::uint64_t>(i + 1)).fill(noise, cv::RNG::UNIFORM, 0, 256);
      const cv::Rect area(person.mask_origin, person.mask.size());
      noise(area).copyTo(shot.rendered.frame.image(area), person.mask);
    }
    const FrameStatistics statistics = rig.see(shot).statistics();
    EXPECT_NE(statistics.instances[0].verdict, InstanceVerdict::still) << i;
    EXPECT_EQ(statistics.motion.kept_still, 0U) << i;
  }
}

TEST(MotionJudge, SeesByHandWhatItSeesInAPipeline) {
  const SyntheticScene scene(scene_level("stale_3", 11));
  MotionJudge piped(scene.camera()), judge(scene.camera());
  const Pipeline<MaskCuller, std::reference_wrapper<MotionJudge>> pipeline(MaskCuller(), piped);
  Workspace workspace;
  for (int i = 0; i < 12; ++i) {
    const Shot shot = shot_of(scene, i);
    const FrameView& frame = shot.rendered.frame;
    const Segmentation& masks = shot.rendered.poor_segmentation;
    const FeatureLabels wanted = pipeline.apply(frame, masks, shot.keypoints);
    FeatureLabels labels(shot.keypoints.size(), masks);
    MaskCuller()({frame, masks, shot.keypoints}, labels);
    judge({frame, masks, shot.keypoints}, labels, workspace);
    EXPECT_EQ(labels.statistics().is_motion_decided(), wanted.statistics().is_motion_decided());
    for (std::size_t f = 0; f < labels.size(); ++f) {
      ASSERT_EQ(std::tie(labels[f].reason, labels[f].score),
                std::tie(wanted[f].reason, wanted[f].score))
          << i << ' ' << f;
    }
  }
}

TEST(MotionJudge, RefusesNonsense) {
  using Bad = std::invalid_argument;
  MotionJudgeOptions options;
  options.min_speed_m_s = -1;
  expect_error<Bad>([&] { MotionJudge(camera(), options); }, "min_speed_m_s = -1");
  options = {};
  options.still_frames = 0;
  expect_error<Bad>([&] { MotionJudge(camera(), options); }, "still_frames = 0");
  options = {};
  options.fringe_px = 1001;
  expect_error<Bad>([&] { MotionJudge(camera(), options); }, "fringe_px = 1001");
  options = {};
  options.max_gap_s = std::nan("");
  expect_error<Bad>([&] { MotionJudge(camera(), options); }, "max_gap_s = nan");
  expect_error<Bad>([&] { (void)MotionJudge{Camera()}; }, "MotionJudge: got fx = 0");
  expect_error<Bad>([&] { (void)MotionJudge{Camera{5, 0, 1, 1}}; }, "fy = 0");
  expect_error<Bad>([&] { (void)MotionJudge{Camera{0, 5, 1, 1}}; }, "fx = 0");
  MotionJudge state(camera());
  PosePrior prior;
  prior.pose.rotation(1, 1) = std::nan("");
  expect_error<Bad>([&] { state.expect_motion(prior); }, "a pose that is not finite");
  for (double PosePrior::*limit : {&PosePrior::max_rotation_rad, &PosePrior::max_translation_m}) {
    prior = {};
    prior.*limit = 0;
    expect_error<Bad>([&] { state.expect_motion(prior); }, "limits above 0");
  }
  prior = {};
  prior.pose.rotation = prior.pose.rotation * 1.01;
  expect_error<Bad>([&] { state.expect_motion(prior); }, "an orthonormal matrix");
  prior.pose.rotation = {1, 0, 0, 0, 1, 0, 0, 0, -1};
  expect_error<Bad>([&] { state.expect_motion(prior); }, "determinant 1");

  Rig rig;
  Shot shot = shots(0.5)[0];
  shot.rendered.frame.image = cv::Mat(360, 480, CV_8UC4, cv::Scalar::all(9));
  EXPECT_NO_THROW(rig.see(shot));
  shot.rendered.frame.image = cv::Mat(360, 480, CV_8UC2, cv::Scalar::all(9));
  expect_error<Bad>([&] { rig.see(shot); }, "MotionJudge: got an image of type CV_");
}

constexpr std::size_t seen_frames = 6;

/// Calls a function once for each scene, in two threads at once.
void in_two_threads(const std::function<void(std::size_t)>& call) {
  std::thread other(call, 1);
  call(0);
  other.join();
}

const std::vector<Shot>& scene(std::size_t camera) { return shots(camera == 0 ? 0 : 0.5); }

std::vector<FeatureLabels> judged(const std::vector<Shot>& shots) {
  Rig rig;
  std::vector<FeatureLabels> labels;
  for (std::size_t i = 0; i < seen_frames; ++i) labels.push_back(rig.see(shots[i]));
  return labels;
}

TEST(TwoCameras, AreJudgedInTwoThreadsAsAlone) {
  const std::vector<FeatureLabels> want[] = {judged(scene(0)), judged(scene(1))};
  std::vector<FeatureLabels> got[2];
  in_two_threads([&](std::size_t camera) { got[camera] = judged(scene(camera)); });
  for (std::size_t camera = 0; camera < 2; ++camera) {
    for (std::size_t i = 0; i < seen_frames; ++i) {
      EXPECT_TRUE(same_labels(got[camera][i], want[camera][i])) << camera << ", frame " << i;
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
