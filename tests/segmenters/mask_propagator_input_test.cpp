// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Odd input, options, and ownership of pixels.

#include "dynfilter/segmenters/mask_propagator.hpp"

#include "dynfilter/host_masks.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "segmenters/propagator_scene.hpp"
#include "support/scene_images.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

// --- Odd input -----------------------------------------------------------------------------------

TEST(MaskPropagator, AcceptsImagesOfAnySizeAndColour) {
  for (const cv::Size small : {cv::Size(1, 1), {2, 40}, {17, 18}, {2000, 20}}) {
    for (const int channels : {1, 3, 4}) {
      cv::Mat image = texture(small, 1);
      cv::merge(std::vector<cv::Mat>(static_cast<std::size_t>(channels), image), image);
      MaskPropagator propagator;
      const cv::Mat mask(small, CV_8UC1, cv::Scalar(1));
      const Segmentation result =
          result_of(frame_of(image, 0), {Instance::from_image_mask(mask)}, small);
      for (int i = 0; i < 3; ++i) {
        const auto moved = propagator.propagate(frame_of(image, i), result);
        ASSERT_EQ(moved->instances.size(), 1U);
        EXPECT_TRUE(same(painted(*moved), mask * 255)) << small << channels;
      }
    }
  }
}

TEST(MaskPropagator, AcceptsMasksAndBoxesAnywhere) {
  constexpr int least = std::numeric_limits<int>::min(), most = std::numeric_limits<int>::max();
  const cv::Mat image = texture(scene_size, 1);
  MaskPropagator propagator;
  Instance away = ring({100, 120}, 40), vast = away, nothing = away, blank = away;
  away.mask_origin = {most - 3, least};
  away.box = {most - 3, least, 50, 50};
  vast.box = {least, least, most, most};
  nothing.mask.release();
  nothing.box = {};
  blank.mask = cv::Mat(80, 80, CV_8UC1, cv::Scalar(0));
  const Segmentation result = result_of(frame_of(image, 0), {away, vast, nothing, blank});
  EXPECT_EQ(propagator.propagate(frame_of(image, 0), result)->instances.size(), 4U);
  const auto moved = propagator.propagate(frame_of(image, 1), result);
  ASSERT_EQ(moved->instances.size(), 2U);  // vast and blank
  EXPECT_TRUE(same(painted(moved->instances[0]), painted(vast)));
  EXPECT_EQ(moved->instances[1].box, blank.box);
}

TEST(MaskPropagator, RefusesOptionsOutOfRange) {
  for (const double wrong : {-1.0, 2e6, std::nan("")}) {
    expect_misuse([&] { MaskPropagator({wrong}); }, "MaskPropagator: got max_age_s");
  }
}

TEST(MaskPropagator, RefusesBadInputWithoutChange) {
  const Pan pan({4, 0});
  const Segmentation result = result_of(pan.frame(0), {ring({100, 120}, 40)});
  MaskPropagator propagator, twin;
  for (int i = 0; i < 3; ++i) {
    propagator.propagate(pan.frame(i), result);
    twin.propagate(pan.frame(i), result);
  }
  const auto refuses = [&](const FrameView& frame, const Segmentation& newest, const char* text) {
    expect_misuse([&] { propagator.propagate(frame, newest); }, text);
  };
  FrameView bad = pan.frame(3);
  bad.image = cv::Mat(scene_size, CV_16UC1, cv::Scalar(1));
  refuses(bad, result, "an image of type CV_16UC1; want CV_8UC1");
  bad.image = cv::Mat(scene_size, CV_8UC2, cv::Scalar::all(1));
  refuses(bad, result, "an image of type CV_8UC2");
  bad = pan.frame(3);
  bad.timestamp_s = std::numeric_limits<double>::infinity();
  refuses(bad, result, "timestamp_s");
  Segmentation wrong = result_of(pan.frame(2), {ring({100, 120}, 40)}, {640, 480});
  refuses(pan.frame(3), wrong, "masks of an image of 640x480; want those of the frames, 320x240");
  wrong = result_of(pan.frame(2), {ring({100, 120}, 40)});
  wrong.instances[0].score = 2;
  refuses(pan.frame(3), wrong, "score 2");
  const auto moved = propagator.propagate(pan.frame(3), result),
             want = twin.propagate(pan.frame(3), result);
  EXPECT_TRUE(same(painted(*moved), painted(*want)));
}

// --- Ownership of data ---------------------------------------------------------------------------

TEST(MaskPropagator, SharesNoPixelsWithTheCaller) {
  const Pan pan({4, 2});
  const auto run = [&](bool spoils) {
    MaskPropagator propagator;
    std::uint64_t hash = 0;
    std::optional<Segmentation> newest;
    for (int i = 0; i < 8; ++i) {
      FrameView frame = pan.frame(i);
      frame.image = frame.image.clone();
      if (i % 4 == 0) newest = result_of(frame, {ring({100 + 4 * i, 100 + 2 * i}, 40)});
      const cv::Mat image = frame.image.clone(), mask = newest->instances[0].mask.clone();
      auto moved = propagator.propagate(frame, newest);
      EXPECT_TRUE(same(frame.image, image));
      EXPECT_TRUE(same(newest->instances[0].mask, mask));
      hash = pixel_hash(painted(*moved), hash);
      if (!spoils) continue;
      frame.image.setTo(0);
      moved->instances[0].mask.setTo(0);
      newest->instances[0].mask = cv::Mat(mask.size(), CV_8UC1, cv::Scalar(0));
    }
    return hash;
  };
  EXPECT_EQ(run(false), run(true));
}

// --- Impossible sizes are refused before memory is allocated for them ----------------------------

Segmentation segmentation_of(const cv::Size& size) {
  const cv::Mat mask(4, 4, CV_8UC1, cv::Scalar(255));
  const cv::Rect corner(cv::Point(size) - cv::Point(4, 4), mask.size());
  return {1, 1.0, size, {Instance::from_box_mask(mask, corner)}};
}

TEST(ImageSize, ImpossibleSizesAreRefused) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path() / "masks");
  const std::function<void(const Segmentation&)> consumers[] = {
      [](const auto& masks) { mask_of_static_pixels(masks); },
      [](const auto& masks) { mask_of_dynamic_pixels(masks); },
      [](const auto& masks) { MaskPropagator().propagate({}, masks); },
      [&](const auto& masks) { writer.add(masks); },
  };
  constexpr int int_max = std::numeric_limits<int>::max();
  for (const cv::Size& size :
       {cv::Size(int_max, int_max), cv::Size(int_max, 1), cv::Size(1, int_max),
        cv::Size(1048577, 4), cv::Size(32769, 32768)}) {
    for (const auto& take : consumers) {
      expect_misuse([&] { take(segmentation_of(size)); },
                    "got image_size " + detail::size_name(size) +
                        "; want sides of 0 to 1048576 pixels and at most 1073741824 pixels in all");
    }
  }
}

TEST(ImageSize, LargestSizesAreAccepted) {
  for (const cv::Size& size : {cv::Size(1048576, 1024), cv::Size(32768, 32768)}) {
    EXPECT_NO_THROW(validate(segmentation_of(size), "test")) << size;
    EXPECT_NO_THROW(MaskPropagator().propagate({}, segmentation_of(size))) << size;
  }
}

}  // namespace
}  // namespace dynfilter::testing
