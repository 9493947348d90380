// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/scenes/synthetic_scene.hpp"

#include "lab/level_scenes.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using Options = SyntheticSceneOptions;

const SyntheticScene& small_scene() { return level_scene(""); }

Options small(const std::function<void(Options&)>& change) { return small_level("", change); }

bool same_masks(const Segmentation& a, const Segmentation& b) {
  return a.frame_id == b.frame_id && a.timestamp_s == b.timestamp_s &&
         std::equal(a.instances.begin(), a.instances.end(), b.instances.begin(), b.instances.end(),
                    [](const Instance& x, const Instance& y) {
                      return x.box == y.box && x.score == y.score && x.track_id == y.track_id &&
                             x.mask_origin == y.mask_origin &&
                             (x.mask.empty() ? y.mask.empty() : same(x.mask, y.mask));
                    });
}

bool same_frame(const SyntheticFrame& a, const SyntheticFrame& b) {
  return same(a.frame.image, b.frame.image) && same(a.frame.depth, b.frame.depth) &&
         same(a.exact_depth_m, b.exact_depth_m) && a.pose.rotation == b.pose.rotation &&
         a.pose.translation == b.pose.translation &&
         same_masks(a.true_segmentation, b.true_segmentation) &&
         same_masks(a.poor_segmentation, b.poor_segmentation);
}

TEST(SyntheticScene, RendersTheDocumentedFrame) {
  const SyntheticFrame& frame = level_frame("", 7);
  EXPECT_EQ(frame.frame.id, 7U);
  EXPECT_DOUBLE_EQ(frame.frame.timestamp_s, 1.0 + 7 / 30.0);
  EXPECT_EQ(frame.frame.image.type(), CV_8UC3);
  EXPECT_EQ(frame.frame.depth.type(), CV_16UC1);
  EXPECT_EQ(frame.exact_depth_m.type(), CV_32FC1);
  EXPECT_EQ(frame.frame.image.size(), cv::Size(160, 120));
  EXPECT_DOUBLE_EQ(frame.frame.metres_per_unit, 1.0 / 5000);
  EXPECT_NO_THROW(validate(frame.frame, "test"));
  EXPECT_NO_THROW(validate(frame.true_segmentation, "test"));
  EXPECT_NO_THROW(validate(frame.poor_segmentation, "test"));
  EXPECT_EQ(small_scene().pose(7).translation, frame.pose.translation);
  EXPECT_EQ(small_scene().pose(7).rotation, frame.pose.rotation);
}

TEST(SyntheticScene, CameraIsFr3ScaledToTheImage) {
  const SequenceCamera full = SyntheticScene().camera();
  EXPECT_DOUBLE_EQ(full.fx, 535.4);
  EXPECT_DOUBLE_EQ(full.fy, 539.2);
  EXPECT_DOUBLE_EQ(full.cx, 320.1);
  EXPECT_DOUBLE_EQ(full.cy, 247.6);
  EXPECT_DOUBLE_EQ(full.depth_units_per_metre, 5000);
  EXPECT_DOUBLE_EQ(full.frames_per_second, 30);
  EXPECT_DOUBLE_EQ(full.k1, 0);
  const SequenceCamera quarter = small_scene().camera();
  EXPECT_EQ(quarter.image_size, cv::Size(160, 120));
  EXPECT_DOUBLE_EQ(quarter.fx, 535.4 / 4);
  Options hd = small([](Options& o) { o.image_size = {192, 108}; });
  EXPECT_DOUBLE_EQ(SyntheticScene(hd).camera().fx / SyntheticScene(hd).camera().fy,
                   full.fx / full.fy);
  // The left edge of the image, half a pixel left of the first centre, stays in the same direction.
  EXPECT_NEAR((-0.5 - quarter.cx) / quarter.fx, (-0.5 - full.cx) / full.fx, 1e-12);
}

TEST(SyntheticScene, FrameDependsNeitherOnEarlierFramesNorOnThreads) {
  const int threads = cv::getNumThreads();
#ifndef __SANITIZE_THREAD__  // it does not see how OpenCV's threads wait for one another
  cv::setNumThreads(threads == 1 ? 2 : 1);
#endif
  const SyntheticScene again(small({}));
  for (const int i : {24, 12, 0}) EXPECT_TRUE(same_frame(again.render(i), level_frame("", i))) << i;
  cv::setNumThreads(threads);
}

TEST(SyntheticScene, TrueMasksAreTheSilhouettes) {
  const SyntheticScene without(small([](Options& o) { o.persons = 0; }));
  for (const int i : {0, 24, 48}) {
    const SyntheticFrame& frame = level_frame("", i);
    const SyntheticFrame room = without.render(i);
    EXPECT_TRUE(room.true_segmentation.instances.empty());
    EXPECT_TRUE(room.poor_segmentation.instances.empty());
    EXPECT_EQ(room.true_segmentation.image_size, cv::Size(160, 120));
    // A pixel is a person's if and only if the depth changes without the persons.
    const cv::Mat changed = frame.exact_depth_m != room.exact_depth_m;
    EXPECT_TRUE(same(changed, painted(frame.true_segmentation))) << i;
    for (const Instance& instance : frame.true_segmentation.instances) {
      EXPECT_EQ(instance.box, cv::boundingRect(instance.mask) + instance.mask_origin);
      EXPECT_EQ(instance.score, 1.0F);
      EXPECT_EQ(instance.class_id, 0);
      EXPECT_TRUE(instance.track_id.has_value());
    }
  }
}

TEST(StaleMasks, AreThoseOfAnEarlierFrame) {
  const SyntheticFrame stale =
      SyntheticScene(small([](Options& o) { o.mask_age_frames = 12; })).render(24);
  EXPECT_EQ(stale.true_segmentation.frame_id, 24U);
  EXPECT_TRUE(same_masks(stale.poor_segmentation, level_frame("", 12).poor_segmentation));
  const SyntheticFrame exact =
      SyntheticScene(small([](Options& o) { o.mask_faults = MaskFaults::none; })).render(24);
  EXPECT_TRUE(same_masks(exact.poor_segmentation, exact.true_segmentation));
}

TEST(LateMasks, AreTheNewestFinishedByASlowNetwork) {
  const auto masks_of = [](double rate_hz) {
    const SyntheticScene scene(small([&](Options& o) {
      o.image_size = {32, 24};
      o.mask_rate_hz = rate_hz;
    }));
    std::vector<std::uint64_t> frames;
    for (int i = 0; i < 13; ++i) {
      const Segmentation masks = scene.render(i).poor_segmentation;
      EXPECT_DOUBLE_EQ(masks.timestamp_s.value(),
                       scene.timestamp_s(static_cast<int>(masks.frame_id)));
      frames.push_back(masks.frame_id);
    }
    return frames;
  };
  using Frames = std::vector<std::uint64_t>;
  EXPECT_EQ(masks_of(10), (Frames{0, 0, 0, 0, 0, 0, 3, 3, 3, 6, 6, 6, 9}));
  // The network takes 2.5 frames: it finishes frames 0, 2, 5, 7, 10 at 2.5, 5, 7.5, 10, 12.5.
  EXPECT_EQ(masks_of(12), (Frames{0, 0, 0, 0, 0, 2, 2, 2, 5, 5, 7, 7, 7}));
  EXPECT_EQ(masks_of(60), (Frames{0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
}

TEST(SyntheticScene, RefusesOptionsOutOfRangeByName) {
  struct Case {
    const char* named;
    std::function<void(Options&)> spoil;
  };
  const Case cases[] = {
      {"frames = 0; want a number from 1 to 1e+06", [](Options& o) { o.frames = 0; }},
      {"image_size.width = 8", [](Options& o) { o.image_size.width = 8; }},
      {"image_size.height", [](Options& o) { o.image_size.height = -1; }},
      {"persons = 9", [](Options& o) { o.persons = 9; }},
  };
  for (const Case& one : cases) {
    expect_misuse([&] { const SyntheticScene scene(small(one.spoil)); },
                  std::string("SyntheticScene: got ") + one.named);
  }
}

TEST(SyntheticScene, RefusesFrameIndicesOutOfRange) {
  EXPECT_THROW(small_scene().render(-1), std::invalid_argument);
  EXPECT_THROW(small_scene().render(90), std::invalid_argument);
  EXPECT_THROW(small_scene().pose(90), std::invalid_argument);
  EXPECT_THROW(small_scene().timestamp_s(-1), std::invalid_argument);
}

}  // namespace
}  // namespace dynfilter::testing
