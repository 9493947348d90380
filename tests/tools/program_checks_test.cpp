// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What dynfilter run, ablate and doctor say about input that is wrong, as the readers give it to
// the checks, which segmenters/input_checks_test.cpp tests one by one.

#include <regex>

#include "support/test.hpp"
#include "tools/changed_scene.hpp"
#include "tools/program.hpp"

namespace dynfilter::testing {
namespace {

/// A rendered sequence, made once.
const fs::path& base() {
  static const TemporaryFolder folder;
  static const fs::path scene = folder.path() / "base";
  if (!fs::exists(scene)) {
    succeed("synth " + quoted(scene) +
            " --level medium --seed 5 --frames 16 --width 320 --height 240");
  }
  return scene;
}

void make_masks(const fs::path& scene, const ImageChange& of_binary_mask) {
  fs::remove(scene / "masks" / "instances.csv");
  change_images(scene / "masks", [&](const cv::Mat& labels) { return of_binary_mask(labels > 0); });
}

ImageChange bits(int count) {
  return [count](const cv::Mat& image) {
    cv::Mat grey, deep;
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    grey.convertTo(deep, CV_16UC1, 1 << (count - 8));
    return deep;
  };
}

void add_line(const fs::path& scene, const std::string& line) {
  std::ofstream(scene / "camera.yaml", std::ios::app) << line << '\n';
}

void set_depth(const fs::path& scene, const std::function<void(cv::Mat&)>& change) {
  change_images(scene / "depth", [&](cv::Mat depth) {
    change(depth);
    return depth;
  });
}

void set_factor(const fs::path& scene, double factor) {
  set_camera(scene, "DepthMapFactor", "DepthMapFactor: " + std::to_string(factor));
}

struct Variant {
  const char* name;
  const char* check;  // that speaks
  std::function<void(const fs::path&)> make;
  bool is_hopeless = false;  // nothing can come of it
};

const Variant scene_variants[] = {
    {"masks inverted", "masks_everywhere",
     [](const fs::path& s) { make_masks(s, [](const cv::Mat& m) { return 255 - m; }); }},
    {"masks flipped", "masks_elsewhere",
     [](const fs::path& s) {
       make_masks(s, [](cv::Mat m) {
         cv::flip(m, m, 1);
         return m;
       });
     }},
    {"masks black", "masks_empty",
     [](const fs::path& s) {
       make_masks(s, [](const cv::Mat& m) { return m * 0; });
       fs::remove_all(s / "masks_true");
     }},
    {"masks soft", "masks_soft",
     [](const fs::path& s) {
       make_masks(s, [](cv::Mat m) {
         cv::GaussianBlur(m, m, {9, 9}, 0);
         return m;
       });
     }},
    {"masks with a rim to ignore", "masks_values",
     [](const fs::path& s) {
       make_masks(s, [](const cv::Mat& m) {
         cv::Mat wide;
         cv::dilate(m, wide, cv::Mat::ones(3, 3, CV_8UC1));
         return wide - m / 17 * 16;  // 255 around 15
       });
     }},
    {"classes that count from 1", "masks_classes",
     [](const fs::path& s) {
       change_text(s / "masks" / "instances.csv", [](const std::string& text) {
         return std::regex_replace(text, std::regex("\n([^,]*,[^,]*),0,"), "\n$1,1,");
       });
     }},
    {"factor 1", "depth_unit", [](const fs::path& s) { set_factor(s, 1); }, true},
    {"depth of the frame before", "depth_late",
     [](const fs::path& s) {
       cv::Mat last;
       set_depth(s, [&](cv::Mat& d) {
         const cv::Mat now = d.clone();
         if (!last.empty()) d = last;
         last = now;
       });
     }},
    {"depth not registered", "depth_shift",
     [](const fs::path& s) {
       set_depth(s, [](cv::Mat& d) {
         const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, 14, 0, 1, 2);
         cv::warpAffine(d.clone(), d, shift, d.size(), cv::INTER_NEAREST);
       });
     }},
    {"images of 10 bits in 16", "image_range",
     [](const fs::path& s) { change_images(s / "rgb", bits(10)); }, true},
    {"images of 12 bits in 16", "image_range",
     [](const fs::path& s) { change_images(s / "rgb", bits(12)); }},
    {"a fisheye camera", "Camera.type",
     [](const fs::path& s) { add_line(s, "Camera.type: \"KannalaBrandt8\""); }, true},
    {"a rational camera", "Camera.k4",
     [](const fs::path& s) { add_line(s, "Camera.k4: 0.3\nCamera.k5: -0.1\nCamera.k6: 0.02"); },
     true},
    {"a camera of another size", "camera_size",
     [](const fs::path& s) { set_camera(s, "Camera.cx", "Camera.cx: 318.6"); }},
};

TEST(ProgramChecks, SayOfEachVariantWhatIsWrong) {
  const TemporaryFolder folder;
  for (const Variant& variant : scene_variants) {
    const fs::path scene = folder.path() / "variant";
    fs::remove_all(scene);
    fs::copy(base(), scene, fs::copy_options::recursive);
    variant.make(scene);
    const Outcome outcome = run("doctor " + quoted(scene));
    EXPECT_TRUE(outcome.mentions(std::string(variant.check) + ": ")) << variant.name << '\n'
                                                                     << outcome.printed;
    EXPECT_EQ(outcome.exit_code, variant.is_hopeless ? 1 : 0) << variant.name << '\n'
                                                              << outcome.printed;
    EXPECT_FALSE(outcome.mentions("--features to")) << variant.name << '\n' << outcome.printed;
  }
}

TEST(ProgramChecks, SpeakInRunAndAblateToo) {
  const TemporaryFolder folder;
  const fs::path scene = folder.path() / "inverted", out = folder.path() / "out";
  fs::copy(base(), scene, fs::copy_options::recursive);
  scene_variants[0].make(scene);
  const std::string options = " --features 300 --out " + quoted(out);
  const Outcome ran = succeed("run " + quoted(scene) + options);
  expect_mentions(ran, "\nchecks of the input\n* masks_everywhere: ");
  fs::remove_all(out);
  const Outcome ablated = succeed("ablate " + quoted(scene) + " --rules none,mask" + options);
  expect_mentions(ablated, "checks of the input of inverted\n* masks_everywhere: ");
  EXPECT_LT(ablated.printed.find("checks of the input"), ablated.printed.find("all: "))
      << "before what rests on it";
  const auto summary = read_json(out / "inverted" / "mask" / "summary.json");
  EXPECT_TRUE(summary.at("checks").contains("masks_everywhere"));
}

TEST(ProgramChecks, SpeakWhereMasksAreWrittenToo) {
  const TemporaryFolder folder;
  const auto said_of_masks = [&](const fs::path& scene, bool uses_depth) {
    return succeed("masks " + quoted(scene) + (uses_depth ? " --refine" : "") +
                   " --overwrite --format static --out " + quoted(folder / "out"));
  };
  for (const Variant& variant : scene_variants) {
    const std::string check = variant.check;
    if (check.rfind("masks_", 0) != 0 && check != "depth_shift") continue;
    const fs::path scene = folder / "variant";
    fs::remove_all(scene);
    fs::copy(base(), scene, fs::copy_options::recursive);
    variant.make(scene);
    const bool needs_depth = check == "masks_elsewhere" || check == "depth_shift";
    expect_mentions(said_of_masks(scene, needs_depth), check + ": ");
  }
  for (const bool uses_depth : {false, true}) {
    const Outcome outcome = said_of_masks(base(), uses_depth);
    for (const char* word : {"masks_", "depth_", "unchecked"}) EXPECT_FALSE(outcome.mentions(word));
  }
}

TEST(ProgramChecks, StopARunAfterThirtyFramesIfNothingCanComeOfIt) {
  const TemporaryFolder folder;
  const fs::path scene = folder.path() / "scene", out = folder.path() / "out";
  succeed("synth " + quoted(scene) + " --frames 31 --width 160 --height 120");
  set_factor(scene, 1);
  for (const std::string command :
       {"run --features 200 ", "ablate --features 200 --rules none,mask ",
        "masks --format colmap --refine "}) {
    const Outcome outcome = run(command + quoted(scene) + " --out " + quoted(out));
    EXPECT_EQ(outcome.exit_code, 1) << outcome.printed;
    expect_mentions(outcome, "depth_unit: ");
    expect_mentions(outcome, "(stopped after 30 frames; nothing was written)");
    EXPECT_FALSE(fs::exists(out / "summary.json"));
  }
  expect_mentions(succeed("run " + quoted(scene) + " --every 2 --out " + quoted(out)),
                  "depth_unit: ");
}

/// Returns what a run says of its input.
std::string said(const std::string& arguments) {
  const TemporaryFolder folder;
  const Outcome outcome =
      succeed("run " + arguments + " --overlays 0 --out " + quoted(folder / "out"));
  const std::size_t at = outcome.printed.find("\nchecks of the input");
  if (at == std::string::npos) return outcome.printed;
  const std::string rest = outcome.printed.substr(at);
  return rest.substr(0, rest.find("\n\nwritten to"));
}

std::string said_of_level(const std::string& level, const std::string& more = "") {
  return said("--level " + level + " --scene-seed 11 --frames 16 --width 320 --height 240 " + more);
}

constexpr const char* silence = "\nchecks of the input: nothing to mend";

TEST(ProgramChecks, AreSilentAboutGoodLevels) {
  for (const char* level : {"static", "medium"}) EXPECT_EQ(said_of_level(level), silence);
}

TEST(ProgramChecks, AreSilentAboutOtherLevelsSlow) {
  for (const char* level : {"cross", "together", "hard", "furniture", "two_in_one", "desk",
                            "near_crowd", "sitting", "crowd", "working", "stop_and_go", "pushed",
                            "carried", "still_camera", "rotation", "fast"}) {
    EXPECT_EQ(said("--frames 40 --scene-seed 5 --level " + std::string(level)), silence) << level;
  }
}

/// Edges of hair look as if depth were early.
TEST(ProgramChecks, AreSilentAboutHair) {
  EXPECT_EQ(said("--frames 24 --scene-seed 5 --level hair"), silence);
}

TEST(ProgramChecks, NameStaleMasksUnlessTheyAreMoved) {
  EXPECT_NE(said_of_level("stale_3").find("* masks_age: masks are 0.1 s old"), std::string::npos);
  EXPECT_EQ(said_of_level("stale_3", "--rule depth_moved"), silence);
}

TEST(ProgramChecks, AdviceOnFeaturesHelps) {
  const std::string starved = said_of_level("medium", "--features 300");
  const std::size_t at = starved.find("set --features to ");
  ASSERT_NE(at, std::string::npos) << starved;
  const std::string more = std::to_string(std::stoi(starved.substr(at + 18)));
  EXPECT_GT(std::stoi(more), 300);
  EXPECT_EQ(said_of_level("medium", "--features " + more), silence);
}

TEST(ProgramChecks, NameMasksOfOtherClasses) {
  EXPECT_NE(said_of_level("medium", "--classes 1,57")
                .find("no instance is of a dynamic class (1, 57); the masks hold class 0"),
            std::string::npos);
}

class RecordedChecks : public RecordedData {
 protected:
  std::string said_of(const char* name, const std::string& more = "") const {
    return said(quoted(data(name)) + ' ' + more);
  }
};

TEST_F(RecordedChecks, AreSilentInStep) {
  EXPECT_EQ(said_of("tum_fr3_walking_halfsphere_50", "--depth-offset 0.033"), silence);
  EXPECT_EQ(said_of("composite_person_in_step_48"), silence);
  EXPECT_EQ(said_of("boxes_25"), silence);
  EXPECT_EQ(said_of("classroom_one_38"), silence);
}

TEST_F(RecordedChecks, AreSilentInLongerOnesSlow) {
  EXPECT_EQ(said_of("tum_fr1_xyz_120", "--depth-offset 0.033"), silence);
  for (const char* name : {"man_on_fr1_120", "crowd_on_fr1_120"}) {
    EXPECT_EQ(said_of(name), silence) << name;
  }
}

TEST_F(RecordedChecks, NameLateDepth) {
  for (const char* name : {"tum_fr3_walking_halfsphere_50", "composite_person_depth_late_48"}) {
    const std::string text = said_of(name);
    EXPECT_NE(text.find("* depth_late: depth is late by "), std::string::npos) << text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '*'), 1) << text;
  }
}

TEST_F(RecordedChecks, SeeThatMasksAreErodedByEightPixels) {
  const TemporaryFolder eroded;
  const char* const name = "tum_fr3_walking_halfsphere_50";
  const fs::path masks = eroded.path() / "masks";
  fs::copy(data(name) / "masks", masks);
  change_images(masks, [](const cv::Mat& labels) {
    cv::Mat smaller;
    cv::erode(labels, smaller, cv::getStructuringElement(cv::MORPH_ELLIPSE, {17, 17}));
    return smaller;
  });
  const std::string text = said_of(name, "--depth-offset 0.033 --masks " + quoted(masks));
  EXPECT_NE(text.find("* masks_small: people reach "), std::string::npos) << text;
}

}  // namespace
}  // namespace dynfilter::testing
