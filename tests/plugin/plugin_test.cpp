// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/plugin.hpp"

#include "dynfilter/dynfilter.hpp"
#include "support/filter_property.hpp"
#include "support/host_frame.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

TEST_F(PluginTest, LabelsMatchTheCore) {
  Plugin plugin(settings("dynfilter.margin_px: 1.5\n"));
  DynamicFilterOptions options;
  options.mask_culler.margin_px = 1.5;
  const DynamicFilter core(options);
  for (int i = 0; i < frames; ++i) {
    HostFrame frame(i);
    HostFrame expected(i);
    const FeatureLabels labels = core.apply(expected.view(static_cast<std::uint64_t>(i)),
                                            expected.segmentation, expected.keypoints);
    keep_static(labels, expected.keypoints, expected.descriptors);

    const FrameStatistics statistics = submit_and_filter(plugin, frame);
    EXPECT_EQ(statistics.masked, labels.statistics().masked);
    EXPECT_EQ(statistics.compensated, labels.statistics().compensated);
    EXPECT_GT(statistics.masked, 0U);
    EXPECT_GT(statistics.compensated, 0U);
    ASSERT_EQ(frame.keypoints.size(), expected.keypoints.size());
    for (std::size_t k = 0; k < frame.keypoints.size(); ++k) {
      ASSERT_EQ(frame.keypoints[k].class_id, expected.keypoints[k].class_id)
          << "the order must stay";
    }
    EXPECT_TRUE(in_step(frame));
  }
  EXPECT_EQ(plugin.counters().filtered, static_cast<std::size_t>(frames));
  EXPECT_EQ(plugin.counters().never_submitted, 0U);
}

TEST_F(PluginTest, AcceptsRawDepthInUnitsOfTheSettingsFile) {
  Plugin of_metres(settings()), of_units(settings());
  HostFrame metres(0), units(0);
  cv::Mat raw;
  units.depth.convertTo(raw, CV_16UC1, 5000);
  filter_rgbd(of_metres, metres);
  of_units.filter(units.timestamp_s, raw, units.keypoints, units.descriptors);
  EXPECT_EQ(metres.keypoints.size(), units.keypoints.size());
  EXPECT_LT(metres.keypoints.size(), HostFrame(0).keypoints.size());
}

/// ORB-SLAM3's mono features come in reverse order, which stays.
TEST_F(PluginTest, MonoUsesMasksOnly) {
  Plugin plugin(settings());
  HostFrame frame(0);
  std::reverse(frame.keypoints.begin(), frame.keypoints.end());
  cv::flip(frame.descriptors, frame.descriptors, 0);
  plugin.submit(frame.image, frame.timestamp_s);
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s, frame.keypoints, frame.descriptors);
  EXPECT_GT(statistics.masked, 0U);
  EXPECT_EQ(statistics.compensated, 0U);
  EXPECT_FALSE(statistics.has_depth);
  EXPECT_TRUE(in_step(frame));
  for (std::size_t i = 1; i < frame.keypoints.size(); ++i) {
    EXPECT_GT(frame.keypoints[i - 1].class_id, frame.keypoints[i].class_id);
  }
}

TEST_F(PluginTest, TwoCamerasAdjustTheirOwnPivots) {
  const std::string file = settings("dynfilter_right.mask_folder: \"" + masks().string() + "\"\n");
  Plugin left(file), right(file, "dynfilter_right");
  HostFrame frame(0), other(0);
  for (const int pivot : {0, 1, 100, static_cast<int>(frame.keypoints.size())}) {
    HostFrame at_left(0), at_right(0);
    left.submit(at_left.image, at_left.timestamp_s);
    right.submit(at_right.image, at_right.timestamp_s);
    int mono_left = pivot, mono_right = pivot;
    left.filter(at_left.timestamp_s, at_left.keypoints, at_left.descriptors, mono_left);
    right.filter(at_right.timestamp_s, at_right.keypoints, at_right.descriptors, mono_right);
    int expected = 0;
    for (const cv::KeyPoint& keypoint : at_left.keypoints) expected += keypoint.class_id < pivot;
    EXPECT_EQ(mono_left, expected);
    EXPECT_EQ(mono_right, expected);
  }
  int beyond = 100000;
  expect_error<std::invalid_argument>(
      [&] { left.filter(frame.timestamp_s, frame.keypoints, frame.descriptors, beyond); },
      "pivot 100000");
}

TEST_F(PluginTest, KeepsAtLeastOneFeature) {
  Plugin plugin(settings());
  HostFrame frame(0);
  std::vector<cv::KeyPoint> on_person = {{30, 30, 31}, {31, 31, 31}};
  cv::Mat descriptors = frame.descriptors.rowRange(0, 2).clone();
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s, frame.depth, on_person, descriptors);
  ASSERT_EQ(on_person.size(), 1U);
  EXPECT_EQ(on_person[0].pt.x, 30) << "of equals, the first";
  EXPECT_EQ(descriptors.rows, 1);
  EXPECT_EQ(statistics.restored, 1U);
  std::vector<cv::KeyPoint> nothing;
  cv::Mat no_descriptors;
  EXPECT_EQ(plugin.filter(frame.timestamp_s, frame.depth, nothing, no_descriptors).features, 0U);
}

TEST_F(PluginTest, ReportsStarvation) {
  Plugin plugin(settings("dynfilter.floor: 350\n"));
  HostFrame frame(0);
  const FrameStatistics statistics = filter_rgbd(plugin, frame);
  EXPECT_TRUE(statistics.starved);
  EXPECT_GT(statistics.suggested_features, HostFrame(0).keypoints.size());
  EXPECT_LT(frame.keypoints.size(), 350U);
  EXPECT_EQ(plugin.counters().starved, 1U);
}

/// Filters features of a frame: so far apart on the half of the person that the mask misses, and
/// others, `background_step` apart, on the wall.
FrameStatistics filter_grids(Plugin& plugin, int index, int person_step, int background_step,
                             bool is_stereo = false) {
  const HostFrame frame(index);
  std::vector<cv::KeyPoint> keypoints;
  const auto add = [&](const cv::Rect& area, int step) {
    for (int y = area.y; y < area.br().y; y += step) {
      for (int x = area.x; x < area.br().x; x += step) {
        keypoints.emplace_back(cv::Point2f(cv::Point(x, y)), 31.0F);
      }
    }
  };
  add({22 + 3 * index, 64, 37, 35}, person_step);
  add({80, 2, 80, 116}, background_step);
  cv::Mat descriptors;
  plugin.submit(frame.image, frame.timestamp_s);
  if (!is_stereo) return plugin.filter(frame.timestamp_s, frame.depth, keypoints, descriptors);
  std::vector<float> depths_m, right_x;
  for (const cv::KeyPoint& keypoint : keypoints) {
    depths_m.push_back(frame.depth.at<float>(cv::Point(keypoint.pt)));
    right_x.push_back(keypoint.pt.x - 40 / depths_m.back());
  }
  std::vector<cv::KeyPoint> undistorted = keypoints;
  return plugin.filter(frame.timestamp_s, depths_m, keypoints, descriptors, undistorted, right_x);
}

TEST_F(PluginTest, KeepsAsManyFeaturesAsTheFirstMapNeeds) {
  Plugin plugin(settings("dynfilter.motion: 0\ndynfilter.floor: 501\n"));
  for (const char* begin : {"first", "time goes back", "the host resets"}) {
    SCOPED_TRACE(begin);
    EXPECT_LT(filter_grids(plugin, 0, 6, 5).kept(), 501U) << "masks alone leave too few";
    const FrameStatistics begun = filter_grids(plugin, 2, 2, 5);
    EXPECT_TRUE(begun.kept() == 501 && !begun.starved && begun.suggested_features == 0);
    EXPECT_LT(filter_grids(plugin, 3, 2, 5).kept(), 501U) << "the host has a map";
    if (std::string(begin) == "time goes back") plugin.reset();
  }
}

/// An image is that of its frame; a mask file may be further away.
TEST_F(PluginTest, HasOneRuleForTheTimesOfImagesAndOneForThoseOfMasks) {
  const auto filtered = [&](const char* difference_s, double image_s, int index) {
    Plugin plugin(settings("dynfilter.max_time_difference_s: " + std::string(difference_s) + "\n"));
    HostFrame frame(index);
    plugin.submit(frame.image, image_s);
    EXPECT_GT(filter_rgbd(plugin, frame).masked, 0U);
    return plugin.counters().never_submitted;
  };
  EXPECT_EQ(filtered("0.15", 100, 1), 1U) << "it is the last frame's image";
  EXPECT_EQ(filtered("0.15", 100.5, frames), 1U) << "the last mask is near enough";
  EXPECT_EQ(filtered("0", 100.0005, 0), 0U);
}

TEST_F(PluginTest, IsMoreCautiousWhereMotionIsJudged) {
  const std::string camera = "Camera.fy: 535.4\nCamera.cx: 80\nCamera.cy: 60\n";
  for (const bool is_judged : {false, true}) {
    Plugin plugin(settings(camera + (is_judged ? "" : "dynfilter.motion: 0\n")));
    const FrameStatistics few = filter_grids(plugin, 0, 1, 4),
                          enough = filter_grids(plugin, 1, 2, 4);
    EXPECT_EQ(few.was_cautious(), is_judged);
    EXPECT_FALSE(enough.was_cautious());
    EXPECT_LT(enough.kept(), enough.features);
    // A pair has no depth image to judge motion with, whatever the host's file has.
    EXPECT_EQ(filter_grids(plugin, 2, 1, 4, true).motion.outcome, MotionOutcome::not_run);
  }
}

TEST_F(PluginTest, SaysOnceThatItIsCautiousAndCountsSuchFrames) {
  Plugin plugin(settings());
  ::testing::internal::CaptureStderr();
  for (const int index : {0, 1}) {
    const HostFrame frame(index);
    std::vector<cv::KeyPoint> on_person;
    cv::Mat descriptors;
    for (const cv::KeyPoint& keypoint : frame.keypoints) {
      if (!frame.segmentation.instances[0].box.contains(keypoint.pt)) continue;
      on_person.push_back(keypoint);
      descriptors.push_back(frame.descriptors.row(keypoint.class_id));
    }
    EXPECT_TRUE(
        plugin.filter(frame.timestamp_s, frame.depth, on_person, descriptors).was_cautious());
  }
  const std::string said = ::testing::internal::GetCapturedStderr();
  const std::size_t place = said.find("it keeps the least certain ones");
  EXPECT_NE(place, std::string::npos) << said;
  EXPECT_EQ(said.rfind("it keeps the least certain ones"), place);
  EXPECT_EQ(plugin.counters().cautious, 2U);
}

TEST_F(PluginTest, SaysOnceWhatIsOddAboutTheFirstFrames) {
  const auto said = [&](const std::string& lines, double depth_scale) {
    Plugin plugin(settings(lines));
    ::testing::internal::CaptureStderr();
    for (int i = 0; i < 100; ++i) {
      HostFrame frame(i % frames);
      plugin.filter(frame.timestamp_s, frame.depth * depth_scale, frame.keypoints,
                    frame.descriptors);
    }
    return ::testing::internal::GetCapturedStderr();
  };
  const std::string map = said("", 1);
  EXPECT_NE(map.find("set ORBextractor.nFeatures in " + file().string() + " to 2000\n"),
            std::string::npos);
  EXPECT_NE(map.find("masks are filled boxes"), std::string::npos) << map;  // as a HostFrame's are
  EXPECT_EQ(std::count(map.begin(), map.end(), '\n'), 2);
  const std::string unit = said("", 5000);
  EXPECT_NE(unit.find("set DepthMapFactor in " + file().string() + " to the units in a metre"),
            std::string::npos);
  EXPECT_EQ(std::count(unit.begin(), unit.end(), '\n'), 3);
  const std::string images = said("dynfilter.propagate: \"yes\"\n", 1);
  EXPECT_NE(images.find("which dynfilter.propagate in " + file().string() + " needs"),
            std::string::npos);
}

TEST_F(PluginTest, SaysThatMasksWithoutATableAreSoft) {
  fs::create_directories(path("soft"));
  for (int i = 0; i < frames; ++i) {
    const HostFrame frame(i);
    const Instance& person = frame.segmentation.instances[0];
    cv::Mat mask(frame.image.size(), CV_8UC1, cv::Scalar(0));
    for (int y = 0; y < person.mask.rows; ++y) {
      mask(cv::Rect(person.mask_origin + cv::Point(0, y), cv::Size(40 - y, 1))).setTo(255 - 3 * y);
    }
    cv::imwrite((path("soft") / (std::to_string(frame.timestamp_s) + ".png")).string(), mask);
  }
  Plugin plugin(raw_settings("dynfilter.mask_folder: \"" + path("soft").string() + "\"\n"));
  ::testing::internal::CaptureStderr();
  for (int i = 0; i < 100; ++i) kept(plugin, i % frames);
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("masks hold 40 shades of grey"), std::string::npos) << said;
}

TEST_F(PluginTest, NamesOneNumberOfFeatures) {
  Plugin plugin(settings());
  ::testing::internal::CaptureStderr();
  for (int i = 0; i < 100; ++i) {
    HostFrame frame(i % frames);
    std::vector<cv::KeyPoint>& points = frame.keypoints;
    const cv::Rect mask(frame.segmentation.instances[0].mask_origin, cv::Size(40, 40));
    std::partition(points.begin(), points.end(),
                   [&](const cv::KeyPoint& one) { return mask.contains(one.pt); });
    for (std::size_t k = 0; k < 300; ++k) points[k] = points[k % 25];  // fewer than 100 are left
    filter_rgbd(plugin, frame);
  }
  const std::string said = ::testing::internal::GetCapturedStderr();
  const std::size_t place = said.find("set ORBextractor.nFeatures");
  EXPECT_NE(place, std::string::npos) << said;
  EXPECT_EQ(said.rfind("set ORBextractor.nFeatures"), place) << said;
}

TEST_F(PluginTest, NamesTheFactorThatDepthInWholeNumbersLacks) {
  const std::string without = path("without.yaml").string();
  std::ofstream(without) << "%YAML:1.0\ndynfilter.mask_folder: \"" << masks().string() << "\"\n";
  Plugin plugin(without);
  HostFrame frame(0);
  cv::Mat depth;
  frame.depth.convertTo(depth, CV_16UC1, 5000);
  expect_error<std::invalid_argument>(
      [&] { plugin.filter(frame.timestamp_s, depth, frame.keypoints, frame.descriptors); },
      "no DepthMapFactor above 0 in " + without);
}

TEST_F(PluginTest, CountsUnpairedCalls) {
  Plugin plugin(settings());
  HostFrame first(0), second(1);
  plugin.submit(first.image, first.timestamp_s);
  plugin.submit(second.image, second.timestamp_s);  // the first is never filtered
  filter_rgbd(plugin, first);
  EXPECT_EQ(plugin.counters().submitted, 2U);
  EXPECT_EQ(plugin.counters().never_filtered, 1U);
  EXPECT_EQ(plugin.counters().never_submitted, 1U) << "the submitted image has another time";
  filter_rgbd(plugin, second);
  EXPECT_EQ(plugin.counters().never_submitted, 1U);
  EXPECT_EQ(plugin.counters().filtered, 2U);
}

TEST_F(PluginTest, NamesMalformedInput) {
  Plugin plugin(settings());
  HostFrame frame(0);
  const auto filter = [&](const cv::Mat& depth, cv::Mat descriptors) {
    plugin.filter(frame.timestamp_s, depth, frame.keypoints, descriptors);
  };
  expect_error<std::invalid_argument>(
      [&] { filter(frame.depth, frame.descriptors.rowRange(0, 5)); }, "5 descriptors");
  expect_error<std::invalid_argument>(
      [&] { filter(cv::Mat::zeros(image_size, CV_8UC1), frame.descriptors); }, "CV_8UC1");
  expect_error<std::runtime_error>(
      [&] { filter(cv::Mat(60, 80, CV_32FC1, cv::Scalar(1)), frame.descriptors); }, "80x60");
  expect_error<std::invalid_argument>([&] { plugin.submit(cv::Mat(), 1.0); }, "Plugin::submit");
  expect_error<std::invalid_argument>([&] { plugin.submit(cv::Mat::zeros(4, 4, CV_32FC1), 1.0); },
                                      "CV_32FC1");
  expect_error<std::invalid_argument>([&] { plugin.submit(frame.image, std::nan("")); }, "nan");
  plugin.submit(cv::Mat::zeros(60, 80, CV_8UC3), frame.timestamp_s);
  expect_error<std::invalid_argument>([&] { filter(frame.depth, frame.descriptors); }, "80x60");
  EXPECT_TRUE(in_step(frame));
  EXPECT_EQ(frame.keypoints.size(), HostFrame(0).keypoints.size());
}

TEST_F(PluginTest, RecordsFramesAndOverlaysOnRequest) {
  Plugin plugin(settings(recording("out", 3)));
  for (int i = 0; i < frames; ++i) {
    HostFrame frame(i);
    submit_and_filter(plugin, frame);
    std::ifstream table(path("out") / "frames.csv");
    int lines = 0;
    for (std::string line; std::getline(table, line);) ++lines;
    EXPECT_EQ(lines, i + 2) << "the file is complete while the host runs";
  }
  EXPECT_TRUE(fs::exists(path("out") / "overlays" / "100.000000.png"));
  EXPECT_TRUE(fs::exists(path("out") / "overlays" / "100.300000.png"));
  EXPECT_FALSE(fs::exists(path("out") / "overlays" / "100.100000.png"));
}

TEST_F(PluginTest, TakesImagesOfEveryOrderOfColours) {
  const HostFrame shown(0);
  cv::Mat four, rgb, rgba, grey;
  cv::cvtColor(shown.image, four, cv::COLOR_BGR2BGRA);
  four.forEach<cv::Vec4b>([](cv::Vec4b& pixel, const int*) { pixel[3] = 77; });
  cv::cvtColor(shown.image, rgb, cv::COLOR_BGR2RGB);
  cv::cvtColor(four, rgba, cv::COLOR_BGRA2RGBA);
  cv::cvtColor(shown.image, grey, cv::COLOR_BGR2GRAY);
  const std::string is_rgb = "dynfilter.colour_order: \"rgb\"\n";
  const std::tuple<const char*, cv::Mat, std::string> images[] = {
      {"bgr", shown.image, ""}, {"bgra", four, ""},    {"rgb", rgb, is_rgb},
      {"rgba", rgba, is_rgb},   {"not told", rgb, ""}, {"grey", grey, ""}};
  std::vector<std::vector<uchar>> overlays;
  for (const auto& [name, image, lines] : images) {
    Plugin plugin(settings(recording(name, 1) + lines));
    HostFrame frame(0);
    const cv::Mat before = image.clone();
    plugin.submit(image, frame.timestamp_s);
    filter_rgbd(plugin, frame);
    EXPECT_EQ(cv::norm(image, before, cv::NORM_L1), 0) << name;
    const cv::Mat overlay = cv::imread((path(name) / "overlays" / "100.000000.png").string());
    ASSERT_FALSE(overlay.empty());
    overlays.emplace_back(overlay.datastart, overlay.dataend);
  }
  for (const std::size_t i : {1U, 2U, 3U}) EXPECT_EQ(overlays[i], overlays[0]) << i;
  EXPECT_NE(overlays[4], overlays[0]) << "the test needs colours";
}

}  // namespace
}  // namespace dynfilter::testing
