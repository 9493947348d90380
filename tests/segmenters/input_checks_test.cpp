// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/diagnosis/input_checks.hpp"

#include "dynfilter/dynamic_filter.hpp"
#include "lab/odometry/orb_extractor.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "lab/scenes/synthetic_scene.hpp"
#include "support/test.hpp"

namespace dynfilter {
namespace {

/// A frame and what is known of it.
struct CheckedFrame {
  FrameView view;
  std::optional<Segmentation> masks;
  std::vector<cv::KeyPoint> features;
  std::optional<FrameStatistics> statistics;

  Instance& person() { return masks->instances.at(0); }
};

using CheckedFrames = std::vector<CheckedFrame>;

/// Nine frames of a level, rendered once.
const CheckedFrames& sound_frames() {
  static const CheckedFrames frames = [] {
    SyntheticSceneOptions options = scene_level("medium", 5);
    options.image_size = {320, 240};
    options.frames = 9;
    const SyntheticScene scene(options);
    const odometry::OrbExtractor extractor(500);
    CheckedFrames result;
    for (int i = 0; i < options.frames; ++i) {
      const SyntheticFrame rendered = scene.render(i);
      CheckedFrame frame{rendered.frame, rendered.poor_segmentation, {}, {}};
      cv::Mat grey, descriptors;
      cv::cvtColor(frame.view.image, grey, cv::COLOR_BGR2GRAY);
      extractor.extract(grey, frame.features, descriptors);
      frame.statistics =
          DynamicFilter().apply(frame.view, frame.masks, frame.features).statistics();
      result.push_back(frame);
    }
    return result;
  }();
  return frames;
}

InputChecksOptions usual_options() {
  InputChecksOptions options;
  options.wanted_features = 500;
  options.masks_setting = "mask_folder";
  options.depth_setting = "DepthMapFactor";
  options.features_setting = "nFeatures";
  return options;
}

Camera camera_of(double fx, double fy, double cx, double cy) {
  Camera camera;
  camera.fx = fx, camera.fy = fy, camera.cx = cx, camera.cy = cy;
  return camera;
}

const Camera usual_camera = camera_of(267.7, 269.6, 160.05, 123.8);

using Change = std::function<void(CheckedFrame&, int)>;

/// Checks the sound frames after a change; copies the pixels first.
InputChecks checked(const Change& change, const InputChecksOptions& options = usual_options()) {
  InputChecks checks(options);
  checks.note_camera(usual_camera);
  int i = 0;
  for (CheckedFrame frame : sound_frames()) {
    frame.view.image = frame.view.image.clone();
    frame.view.depth = frame.view.depth.clone();
    for (Instance& instance : frame.masks->instances) instance.mask = instance.mask.clone();
    change(frame, i++);
    checks.add(frame.view, frame.masks, frame.features,
               frame.statistics ? &*frame.statistics : nullptr);
  }
  return checks;
}

std::string names(const InputChecks& checks) {
  std::string text;
  for (const InputFinding& finding : checks.findings()) text += finding.check + ' ';
  return text;
}

std::string all_sentences(const InputChecks& checks) {
  std::string text;
  for (const InputFinding& finding : checks.findings()) text += finding.sentence + '\n';
  return text;
}

Change depth_times(double factor) {
  return [factor](CheckedFrame& frame, int) { frame.view.metres_per_unit *= factor; };
}

/// Puts a value where depth is missing.
Change none_means(int value) {
  return
      [value](CheckedFrame& frame, int) { frame.view.depth.setTo(value, frame.view.depth == 0); };
}

void set_whole_mask(CheckedFrame& frame, const cv::Mat& mask) {
  frame.masks->instances = instances_from_binary_mask(mask, 20);
}

cv::Mat whole_mask(const CheckedFrame& frame) {
  cv::Mat mask(frame.view.depth.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      for (const Instance& one : frame.masks->instances) {
        if (one.covers({x, y})) mask.at<std::uint8_t>(y, x) = 255;
      }
    }
  }
  return mask;
}

/// Shifts depth to the right and down; nothing is known of what comes in.
Change shifted(int right, int down) {
  return [=](CheckedFrame& frame, int) {
    const cv::Mat to_there = (cv::Mat_<double>(2, 3) << 1, 0, right, 0, 1, down);
    cv::Mat moved;
    cv::warpAffine(frame.view.depth, moved, to_there, frame.view.depth.size(), cv::INTER_NEAREST);
    frame.view.depth = moved;
  };
}

TEST(InputChecks, NameTheUnitOfDepthAsItIsSet) {
  InputChecksOptions options = usual_options();
  const auto said = [&] { return all_sentences(checked(depth_times(1000), options)); };
  EXPECT_NE(said().find("set DepthMapFactor to the units in a metre: 1000"), std::string::npos);
  options.depth_setting = InputChecksOptions().depth_setting;
  EXPECT_NE(said().find("set metres_per_unit to 1/1000 for millimetres"), std::string::npos);
}

TEST(InputChecks, AreSilentAboutSoundFrames) {
  const InputChecks checks = checked([](CheckedFrame&, int) {});
  EXPECT_EQ(all_sentences(checks), "");
  EXPECT_EQ(checks.frames(), sound_frames().size());
  const Change seconds_apart = [](CheckedFrame& f, int) {
    f.view.timestamp_s *= 60, *f.masks->timestamp_s *= 60;
  };
  EXPECT_EQ(all_sentences(checked(seconds_apart)), "");
  const Change one_second_apart = [](CheckedFrame& f, int i) {
    f.view.timestamp_s = 100.25 + i, f.masks->timestamp_s = 100.25 + i;
  };
  EXPECT_EQ(all_sentences(checked(one_second_apart)), "");
  const Change with_an_empty_mask = [](CheckedFrame& f, int) {
    const cv::Mat nobody(f.view.depth.size(), CV_8UC1, cv::Scalar(0));
    f.masks->instances.push_back(Instance::from_image_mask(nobody));
  };
  EXPECT_EQ(all_sentences(checked(with_an_empty_mask)), "");
  const Change few_features = [](CheckedFrame& f, int) {
    f.features.resize(15), f.statistics.reset();
    for (cv::KeyPoint& one : f.features) one.pt *= 0.3F;
  };
  EXPECT_EQ(names(checked(few_features)), "features_few ");
}

/// Makes another box of each instance's; gives each a mask that fits the box first.
template <class Read>
Change with_boxes(const Read& read) {
  return [read](CheckedFrame& f, int) {
    for (Instance& one : f.masks->instances)
      one.box = read(cv::Rect(one.mask_origin, one.mask.size()));
  };
}

Change with_features(float x, float y, bool is_turned = false) {
  return [=](CheckedFrame& f, int) {
    for (cv::KeyPoint& one : f.features) {
      if (is_turned) std::swap(one.pt.x, one.pt.y);
      one.pt.x *= x, one.pt.y *= y;
    }
  };
}

struct Variant {
  const char* check;  // that speaks, alone
  const char* part;   // of its sentence
  Change change;
  bool is_hopeless = false;
};

TEST(InputChecks, EachSpeaksAlone) {
  const Variant variants[] = {
      {"times", "nanoseconds",
       [](CheckedFrame& f, int) { f.view.timestamp_s *= 1e9, *f.masks->timestamp_s *= 1e9; }},
      {"times", "milliseconds",
       [](CheckedFrame& f, int) { f.view.timestamp_s *= 1e3, *f.masks->timestamp_s *= 1e3; }},
      {"times", "indices",
       [](CheckedFrame& f, int i) { f.view.timestamp_s = i, f.masks->timestamp_s = i; }},
      {"times", "give each its own",
       [](CheckedFrame& f, int) { f.view.timestamp_s = 5, f.masks->timestamp_s = 5; }},
      {"image_range", "of 255 greys", [](CheckedFrame& f, int) { f.view.image /= 16; }},
      {"image_range", "of 255 greys", [](CheckedFrame& f, int) { f.view.image /= 64; }, true},
      {"image_frozen", "100 %",
       [](CheckedFrame& f, int) {
         f.view.image.setTo(cv::Scalar(9, 99, 200)), f.view.image(cv::Rect(0, 0, 90, 240)).setTo(0);
       },
       true},
      {"depth_frozen", "of the depth images",
       [](CheckedFrame& f, int) {
         f.view.depth = sound_frames()[0].view.depth;
         f.statistics.reset();
       }},
      {"masks_frozen", "100 %",
       [](CheckedFrame& f, int) { f.masks->instances = sound_frames()[3].masks->instances; }},
      {"depth_one_value", "15000", [](CheckedFrame& f, int) { f.view.depth.setTo(15000); }},
      {"depth_empty", "100 %", [](CheckedFrame& f, int) { f.view.depth.setTo(0); }},
      {"depth_unit", "too small", depth_times(0.2)},
      {"depth_unit", "too small", depth_times(0.25)},
      {"depth_unit", "too small", depth_times(0.001), true},
      {"depth_unit", "too large", depth_times(4)},
      {"depth_unit", "too large", depth_times(5)},
      {"depth_unit", "too large", depth_times(1000), true},
      {"depth_steps", "whole metres",
       [](CheckedFrame& f, int) {
         f.view.depth.forEach<std::uint16_t>([](std::uint16_t& z, const int*) {
           z = static_cast<std::uint16_t>((z + 2500) / 5000);
         });
         f.view.metres_per_unit = 1;
       },
       false},
      {"depth_one_value", "65535", none_means(65535)},
      {"depth_one_value", "10000", none_means(10000)},
      {"depth_one_value", "1 ", none_means(1)},
      {"depth_shift", "to the right", shifted(12, 0)},
      {"depth_shift", "to the left", shifted(-16, 4)},
      {"masks_elsewhere", "mirrored",
       [](CheckedFrame& f, int) {
         cv::Mat mirrored;
         cv::flip(whole_mask(f), mirrored, 1);
         set_whole_mask(f, mirrored);
       }},
      {"depth_inverted", "disparity",
       [](CheckedFrame& f, int) {
         f.view.depth.forEach<std::uint16_t>([](std::uint16_t& z, const int*) {
           if (z != 0) z = cv::saturate_cast<std::uint16_t>(8e7 / z);
         });
       }},
      {"depth_rim", "34 %",
       [](CheckedFrame& f, int) {
         f.view.depth.colRange(0, 53).setTo(0), f.view.depth.colRange(267, 320).setTo(0);
       }},
      {"people_without_depth", "features on people",
       [](CheckedFrame& f, int) { f.view.depth.setTo(0, whole_mask(f)); }},
      {"features_without_depth", "registered",
       [](CheckedFrame& f, int) { f.view.depth.rowRange(16, 224).setTo(0); }},
      {"masks_missing", "mask_folder",
       [](CheckedFrame& f, int) { f.masks.reset(), f.statistics.reset(); }},
      {"masks_empty", "mark nobody", [](CheckedFrame& f, int) { f.masks->instances.clear(); }},
      {"masks_everywhere", "inverted",
       [](CheckedFrame& f, int) { set_whole_mask(f, whole_mask(f) == 0); }},
      {"masks_everywhere", "100 % of the image",
       [](CheckedFrame& f, int) { set_whole_mask(f, whole_mask(f) + 1); }, true},
      {"masks_boxes", "filled boxes",
       [](CheckedFrame& f, int) {
         for (Instance& one : f.masks->instances) one.mask.setTo(255);
       }},
      {"masks_classes", "classes 1, 57",
       [](CheckedFrame& f, int i) {
         for (Instance& one : f.masks->instances) one.class_id = i % 2 == 0 ? 1 : 57;
       }},
      {"boxes_alone", "need depth",
       [](CheckedFrame& f, int) {
         for (Instance& one : f.masks->instances) one.mask.release();
         f.view.depth.release();
       }},
      {"masks_age", "0.1 s old", [](CheckedFrame& f, int) { *f.masks->timestamp_s -= 0.1; }},
      {"masks_age", "mask_time", [](CheckedFrame& f, int) { f.masks->timestamp_s = 1e6; }},
      {"masks_small", "px beyond",
       [](CheckedFrame& f, int) {
         for (auto& one : f.statistics->instances) one.mask_gap_px = 5, one.mask_gap_places = 9;
       }},
      {"image_size", "160x120",
       [](CheckedFrame& f, int i) {
         if (i == 5)
           cv::resize(f.view.image, f.view.image, {160, 120}), f.view.depth.release(),
               f.masks.reset();
       }},
      {"image_size", "depth or mask of 160x120",
       [](CheckedFrame& f, int) {
         cv::Mat small;
         cv::resize(whole_mask(f), small, {160, 120});
         set_whole_mask(f, small), f.masks->image_size = small.size();
       }},
      {"features_few", "of 500",
       [](CheckedFrame& f, int) { f.features.resize(100), f.statistics.reset(); }},
      {"features_left", "nFeatures to ",
       [](CheckedFrame& f, int) { f.statistics->masked = 400, f.statistics->compensated = 0; }},
      {"features_outside", "(row, column)", with_features(1, 1, true)},
      {"features_quarter", "normalised", with_features(1 / 320.F, 1 / 240.F)},
      {"features_outside", "the same image", with_features(2, 2)},
      {"features_quarter", "only 45 %", with_features(0.5F, 0.5F)},
      {"boxes", "y comes before x",
       with_boxes([](const cv::Rect& b) { return cv::Rect(b.y, b.x, b.height, b.width); })},
      {"boxes", "sizes are corners",
       with_boxes([](const cv::Rect& b) { return cv::Rect(b.x, b.y, b.br().x, b.br().y); })},
      {"boxes", "corners are sizes",
       with_boxes([](const cv::Rect& b) { return cv::Rect(b.tl(), cv::Point(b.size())); })},
      {"boxes", "another order",
       [](CheckedFrame& f, int) {
         auto& all = f.masks->instances;
         for (std::size_t k = 1; k < all.size(); ++k) std::swap(all[k].box, all[k - 1].box);
       }},
      {"boxes", "normalised", with_boxes([](const cv::Rect&) { return cv::Rect(0, 0, 1, 1); })},
      {"boxes", "give both in pixels",
       with_boxes([](const cv::Rect& b) { return cv::Rect(b.x - 400, b.y, b.width, b.height); })},
      {"boxes", "another size",
       with_boxes([](const cv::Rect& b) { return cv::Rect(b.tl() * 2, b.size() * 2); })},
      {"motion", "pose_not_trusted",
       [](CheckedFrame& f, int) {
         f.statistics->motion.outcome = MotionOutcome::pose_not_trusted;
       }},
  };
  for (const Variant& variant : variants) {
    const InputChecks checks = checked(variant.change);
    EXPECT_EQ(names(checks), std::string(variant.check) + ' ') << all_sentences(checks);
    EXPECT_NE(all_sentences(checks).find(variant.part), std::string::npos) << all_sentences(checks);
    const auto findings = checks.findings();
    EXPECT_EQ(
        std::any_of(findings.begin(), findings.end(), [](auto& one) { return one.is_hopeless; }),
        variant.is_hopeless)
        << variant.check;
  }
}

/// A street's median is 14 m, and a car is wider than a person.
TEST(InputChecks, AreSilentAboutStreets) {
  InputChecksOptions options = usual_options();
  options.dynamic_classes = {0, 2};
  const InputChecks checks = checked(
      [](CheckedFrame& frame, int) {
        frame.view.metres_per_unit *= 5;
        for (Instance& one : frame.masks->instances) one.class_id = 2;
      },
      options);
  EXPECT_EQ(all_sentences(checks), "");
}

TEST(InputChecks, JudgeMasksOrImagesAlone) {
  const Change inverted = [](CheckedFrame& frame, int) {
    set_whole_mask(frame, whole_mask(frame) == 0);
  };
  const auto alone = [&](bool has_image, const Change& change) {
    return checked([&](CheckedFrame& frame, int i) {
      change(frame, i);
      if (!has_image) frame.view.image.release();
      if (has_image) frame.masks.reset();
      frame.view.depth.release();
      frame.statistics.reset();
    });
  };
  const InputChecks masks = alone(false, inverted), images = alone(true, [](auto&, int) {});
  EXPECT_EQ(names(masks), "masks_everywhere ");
  for (const char* other : {"depth", "camera"}) {
    EXPECT_EQ(all_sentences(masks).find(other), std::string::npos) << all_sentences(masks);
  }
  EXPECT_EQ(masks.unchecked(), "images or depth");
  EXPECT_EQ(names(images), "masks_missing ");
  EXPECT_EQ(images.unchecked(), "depth or masks");
  EXPECT_EQ(checked([](CheckedFrame&, int) {}).unchecked(), "");
}

TEST(InputChecks, TheCameraMayBeAnother) {
  InputChecks checks = checked([](CheckedFrame&, int) {});
  const auto said_of = [&](const Camera& camera) {
    checks.note_camera(camera);
    return names(checks);
  };
  EXPECT_EQ(said_of(usual_camera), "");
  EXPECT_EQ(said_of(Camera()), "");
  EXPECT_EQ(said_of(camera_of(535.4, 539.2, 320.1, 247.6)), "camera_size ");
}

TEST(InputChecks, ValuesOfMasksMayBeClassesOrShades) {
  InputChecks checks = checked([](CheckedFrame&, int) {});
  const auto said_of = [&](const std::vector<int>& values) {
    checks.note_mask_values(values);
    return names(checks);
  };
  std::vector<int> labels(40), shades(200);
  std::iota(labels.begin(), labels.end(), 1);
  std::iota(shades.begin(), shades.end(), 20);
  std::vector<int> all_shades(255);
  std::iota(all_shades.begin(), all_shades.end(), 1);
  for (const auto& sound : {std::vector<int>{}, {1}, {255}, {15}, {1, 2, 3}, labels})
    EXPECT_EQ(said_of(sound), "");
  for (const auto& odd : {std::vector<int>{1, 255}, {9, 15}, {128, 255}})
    EXPECT_EQ(said_of(odd), "masks_values ");
  EXPECT_EQ(said_of(shades), "masks_soft ");
  EXPECT_EQ(said_of(all_shades), "masks_soft ");
}

TEST(InputChecks, SpeakOfLateDepth) {
  const CheckedFrames& frames = sound_frames();
  InputChecks in_step(usual_options()), late(usual_options());
  SyntheticSceneOptions options = scene_level("medium", 11);
  options.image_size = {320, 240};
  options.frames = 25;
  const SyntheticScene scene(options);
  cv::Mat before;
  for (int i = 0; i < options.frames; ++i) {
    SyntheticFrame rendered = scene.render(i);
    in_step.add(rendered.frame, rendered.poor_segmentation, frames[0].features);
    const cv::Mat now = rendered.frame.depth;
    if (!before.empty()) rendered.frame.depth = before;
    before = now;
    late.add(rendered.frame, rendered.poor_segmentation, frames[0].features);
  }
  EXPECT_EQ(names(in_step), "");
  EXPECT_EQ(names(late), "depth_late ");
  EXPECT_NE(all_sentences(late).find("--depth-offset 0.03"), std::string::npos)
      << all_sentences(late);
}

/// Nobody is told to extract fewer features than he asked for, nor more where that is no help.
TEST(InputChecks, AdviseMoreFeaturesOnly) {
  for (const std::size_t wanted : {500U, 2000U, 5000U}) {
    InputChecksOptions options = usual_options();
    options.wanted_features = wanted;
    options.map_features = 501;
    const InputChecks checks = checked(
        [&](CheckedFrame& frame, int) {
          const std::vector<cv::KeyPoint> found = frame.features;
          frame.features.clear();
          for (std::size_t k = 0; k < wanted; ++k)
            frame.features.push_back(found[k % found.size()]);
          frame.statistics->features = wanted;
          frame.statistics->masked = wanted - 150;
          frame.statistics->compensated = 0;
        },
        options);
    EXPECT_EQ(names(checks), "map_start features_left ");
    const std::string text = all_sentences(checks);
    const std::string before = "set nFeatures to ";
    // 501 are left of so many, if as large a share stays.
    EXPECT_GE(std::stoul(text.substr(text.find(before) + before.size())), 501 * wanted / 150)
        << text;
  }
  const InputChecks inverted = checked([](CheckedFrame& frame, int) {
    set_whole_mask(frame, whole_mask(frame) == 0);
    frame.statistics = DynamicFilter().apply(frame.view, frame.masks, frame.features).statistics();
  });
  EXPECT_EQ(names(inverted), "masks_everywhere ");
}

TEST(InputChecks, AskForImagesAndMapsOnlyWhereTheyAreNeeded) {
  InputChecksOptions options = usual_options();
  const Change no_image = [](CheckedFrame& frame, int) { frame.view.image.release(); };
  EXPECT_EQ(names(checked(no_image, options)), "");
  options.images_setting = "propagate";
  EXPECT_EQ(names(checked(no_image, options)), "images_missing ");
  options.masks_setting.clear();
  options.images_setting.clear();
  const Change no_masks = [](CheckedFrame& f, int) { f.masks.reset(), f.statistics.reset(); };
  EXPECT_EQ(names(checked(no_masks, options)), "");
  options.map_features = 501;
  EXPECT_EQ(names(checked([](CheckedFrame&, int) {}, options)), "map_start ");
  const Change mono = [](CheckedFrame& frame, int) { frame.view.depth.release(); };
  EXPECT_EQ(names(checked(mono, options)), "") << "a mono map begins with fewer";
  options = usual_options();
  options.moves_masks = true;
  EXPECT_EQ(names(checked([](CheckedFrame& f, int) { *f.masks->timestamp_s -= 0.1; }, options)),
            "");
}

TEST(InputChecks, NeedEightFramesAndWellFormedOnes) {
  InputChecks checks(usual_options());
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(names(checks), "");
    CheckedFrame frame = sound_frames()[static_cast<std::size_t>(i)];
    frame.view.metres_per_unit *= 100;
    frame.features.resize(100);
    checks.add(frame.view, {}, frame.features);
  }
  EXPECT_EQ(names(checks), "depth_unit masks_missing features_few ");
  FrameView frame = sound_frames()[0].view;
  frame.metres_per_unit = 0;
  testing::expect_misuse([&] { checks.add(frame, {}, {}); }, "InputChecks");
  EXPECT_EQ(checks.frames(), 8U);
}

}  // namespace
}  // namespace dynfilter
