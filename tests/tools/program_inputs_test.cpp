// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What users have: one small scene, changed into what their tools write. Each variant gives the
// scene's own result or a sentence that names what is wrong. The tests of the readers (camera, text
// tables, mask folders, images) try every form that a file may have.

#include <cstdio>

#include "dynfilter/detail/number_text.hpp"
#include "support/test.hpp"
#include "tools/changed_scene.hpp"
#include "tools/program.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

using Change = std::function<void(const fs::path&)>;

/// Changes the pixels of each image of a folder; those of floats become TIFF under the same name.
Change images(const char* folder, const std::function<cv::Mat(const cv::Mat&)>& pixels) {
  return [=](const fs::path& scene) {
    for (const fs::path& file : files_in(scene / folder)) {
      const cv::Mat image = pixels(read_unchanged(file));
      std::vector<unsigned char> bytes;
      ASSERT_TRUE(cv::imencode(image.depth() == CV_32F ? ".tiff" : ".png", image, bytes));
      std::ofstream(file, std::ios::binary) << std::string(bytes.begin(), bytes.end());
    }
  };
}

/// Changes the names of the images of a folder.
Change names(const char* folder, const std::function<std::string(const std::string& stem)>& name) {
  return [=](const fs::path& scene) {
    for (const fs::path& file : files_in(scene / folder)) {
      fs::rename(file, scene / folder / name(file.stem().string()));
    }
  };
}

/// Changes the text of a file.
Change text(const char* file, const std::function<std::string(const std::string&)>& changed) {
  return [=](const fs::path& scene) { change_text(scene / file, changed); };
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t i = 0; (i = text.find(what, i)) != std::string::npos; i += by.size()) {
    text.replace(i, what.size(), by);
  }
  return text;
}

std::string in_nanoseconds(const std::string& stem) {
  return detail::fixed_decimals(std::round(*detail::parse_number(stem) * 1e9), 0) + ".png";
}

/// A name that counts the scene's frames, whose stems begin with 1.000000.
std::string numbered(const std::string& stem) {
  char name[16];
  std::snprintf(name, sizeof name, "%06ld.png",
                std::lround((*detail::parse_number(stem) - 1) * 30));
  return name;
}

class ProgramInputs : public SmallSceneTest {
 protected:
  /// A copy of the scene with masks of persons only, and its result.
  static Outcome result(const fs::path& scene, const fs::path& to, const std::string& options) {
    return run("run " + quoted(scene) + " --overlays 0 --features 300 --out " + quoted(to) + " " +
               options);
  }

  static fs::path changed(const std::string& name, bool has_table, const Change& change) {
    const fs::path scene = out(("changed " + name).c_str());
    fs::copy(SmallSceneTest::scene(), scene, fs::copy_options::recursive);
    if (!has_table) fs::remove(scene / "masks" / "instances.csv");
    change(scene);
    return scene;
  }
};

enum class Expected { all, masks };  // which counts are those of the scene itself

TEST_F(ProgramInputs, GiveTheScenesResultOrASentence) {
  const auto in_metres = [](const cv::Mat& depth) {
    cv::Mat metres;
    depth.convertTo(metres, CV_32F, 1.0 / 5000);
    metres.setTo(NAN, depth == 0);
    return metres;
  };
  const auto with_alpha = [](const cv::Mat& mask) {
    const cv::Mat white(mask.size(), CV_8UC1, cv::Scalar(255));
    cv::Mat image;
    cv::merge(std::vector<cv::Mat>{white, white, white, mask}, image);
    return image;
  };
  const auto enlarged = [](const cv::Mat& mask) {
    cv::Mat image;
    cv::resize(mask, image, {640, 480}, 0, 0, cv::INTER_NEAREST);
    return image;
  };
  const struct {
    const char* name;
    Change change;
    const char* sentence = "";  // empty: the scene's result
    Expected expected = Expected::all;
    bool has_table = true;  // masks with instances.csv
    const char* options = "";
  } variants[] = {
      {"a known camera", [](auto&) {}, "but tum3 says 640x480", {}, true, "--camera tum3"},
      {"float metres", images("depth", in_metres), "", Expected::masks},
      {"commas", text("associations.txt", [](auto& s) { return replaced(s, " ", ","); })},
      {"white with alpha", images("masks", with_alpha)},
      {"a_mask.png", names("masks", [](const std::string& s) { return s + "_mask.png"; })},
      {"masks of another size", images("masks", enlarged), "", {}, false},
      {"masks by number", names("masks", numbered), "look numbered", {}, false},
      {"images and masks by number",
       [](const fs::path& scene) {
         names("rgb", numbered)(scene);
         names("masks", numbered)(scene);
         std::string rows;
         for (const char* time : {"1.000000", "1.033333", "1.066667", "1.100000"}) {
           rows += std::string(time) + " rgb/" + numbered(time) + " " + time + " depth/" + time +
                   ".png\n";
         }
         std::ofstream(scene / "associations.txt") << rows;
       },
       "",
       {},
       false,
       "--frames-of-baseline"},
  };
  for (const bool has_table : {true, false}) {
    const Outcome own = result(changed(has_table ? "own" : "own binary", has_table, [](auto&) {}),
                               out(has_table ? "with table" : "binary"), "");
    ASSERT_EQ(own.exit_code, 0) << own.printed;
  }
  for (const auto& variant : variants) {
    SCOPED_TRACE(variant.name);
    const fs::path scene = changed(variant.name, variant.has_table, variant.change);
    const bool is_shorter = std::string(variant.options) == "--frames-of-baseline";
    const FileTree before = file_tree(scene);
    const fs::path to = out((std::string("result ") + variant.name).c_str());
    const Outcome outcome = result(scene, to, is_shorter ? "" : variant.options);
    EXPECT_EQ(file_tree(scene), before);
    if (*variant.sentence != '\0') {
      EXPECT_NE(outcome.exit_code, 0);
      expect_mentions(outcome, variant.sentence);
      EXPECT_FALSE(fs::exists(to / "frames.csv"));
      continue;
    }
    ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
    auto rows = read_csv(out(variant.has_table ? "with table" : "binary") / "frames.csv");
    if (is_shorter) rows.resize(5);
    const auto found = read_csv(to / "frames.csv");
    for (const char* count : {"features", "masked", "kept"}) {
      if (variant.expected == Expected::masks && std::string(count) == "kept") continue;
      EXPECT_EQ(sum_of(found, count), sum_of(rows, count)) << count;
    }
    EXPECT_GT(sum_of(found, "masked"), 0U);
    EXPECT_GT(sum_of(found, "compensated"), 0U);
  }
}

// --- dynfilter masks and run, where neither lists nor a camera are needed ------------------------

/// Lays the scene's colour images out as other data sets do. Names are those of the images.
struct Layout {
  const char* name;
  Change change;
};

TEST_F(ProgramInputs, MasksAndRunNeedImagesOnly) {
  const auto without_lists = [](const fs::path& scene) {
    for (const char* file : {"rgb.txt", "depth.txt", "associations.txt", "camera.yaml"}) {
      fs::remove(scene / file);
    }
    for (const char* folder : {"depth", "masks_true"}) fs::remove_all(scene / folder);
  };
  const auto move_images = [](const fs::path& scene, const fs::path& to, auto&& name) {
    fs::create_directories(scene / to);
    for (const fs::path& file : files_in(scene / "rgb")) {
      const std::string stem = file.stem().string();
      fs::rename(file, scene / to / name(stem));
      fs::rename(scene / "masks" / (stem + ".png"), scene / "masks" / ("new " + name(stem)));
    }
    for (const fs::path& file : files_in(scene / "masks")) {
      fs::rename(file, scene / "masks" / file.filename().string().substr(4));
    }
  };
  const std::string epoch = "1403636579";  // so that nanoseconds are seen to be some
  const auto photo = [](const std::string& stem) { return "IMG_" + numbered(stem); };
  const Layout layouts[] = {
      {"TUM without a camera", [](const fs::path& scene) { fs::remove(scene / "camera.yaml"); }},
      {"plain", [&](const fs::path& scene) { move_images(scene, ".", photo); }},
      {"plain, numbered", [&](const fs::path& scene) { move_images(scene, ".", numbered); }},
      {"folders", [&](const fs::path& scene) { move_images(scene, "left", photo); }},
      {"KITTI",
       [&](const fs::path& scene) {
         move_images(scene, "image_2", numbered);
         std::ofstream(scene / "times.txt") << "0.000000e+00\n1.037e-01\n2e-1\n3e-1\n4e-1\n5e-1\n";
       }},
      {"EuRoC",
       [&](const fs::path& scene) {
         std::string rows = "#timestamp [ns],filename\r\n";
         const auto name = [&](const std::string& stem) {
           return epoch + in_nanoseconds(stem).substr(1);
         };
         for (const fs::path& file : files_in(scene / "rgb")) {
           const std::string image = name(file.stem().string());
           rows += fs::path(image).stem().string() + "," + image + "\r\n";
         }
         move_images(scene, "mav0/cam0/data", name);
         std::ofstream(scene / "mav0/cam0/data.csv") << rows;
       }},
  };
  const Outcome own =
      succeed("masks " + quoted(scene()) + " --format colmap --out " + quoted(out("own masks")));
  const std::vector<fs::path> want = files_in(out("own masks"));
  for (const Layout& layout : layouts) {
    SCOPED_TRACE(layout.name);
    const bool is_tum = layout.name[0] == 'T';
    const fs::path scene = changed(layout.name, is_tum, layout.change);
    if (!is_tum) without_lists(scene);
    const FileTree before = file_tree(scene);
    const fs::path to = out((layout.name + std::string(" masks")).c_str());
    succeed("masks " + quoted(scene) + " --format colmap --masks " + quoted(scene / "masks") +
            " --out " + quoted(to));
    const std::vector<fs::path> found = files_in(fs::exists(to / "left") ? to / "left" : to);
    ASSERT_EQ(found.size(), want.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(cv::norm(read_unchanged(found[i]), read_unchanged(want[i]), cv::NORM_INF), 0);
      EXPECT_EQ(found[i].stem().extension(), ".png") << found[i];
    }
    const fs::path labels = out((layout.name + std::string(" labels")).c_str());
    succeed("masks " + quoted(scene) + " --masks " + quoted(scene / "masks") + " --out " +
            quoted(labels));
    const bool is_kitti = layout.name == std::string("KITTI");
    EXPECT_EQ(fs::exists(labels / "0.000000.png"), is_kitti) << "the plugin needs times";
    EXPECT_EQ(fs::exists(labels / "0.103700.png"), is_kitti);
    EXPECT_EQ(file_tree(scene), before);
    if (is_tum) continue;  // its depth needs a camera
    const fs::path run_out = out((layout.name + std::string(" run")).c_str());
    succeed("run " + quoted(scene) + " --overlays 0 --out " + quoted(run_out));
    EXPECT_GT(read_json(run_out / "summary.json")["masked"], 0);
    expect_refused("run " + quoted(scene) + " --rule motion --out " + quoted(out("motion")),
                   "rule motion needs depth");
  }
}

TEST_F(ProgramInputs, DepthGetsHoles) {
  for (const std::string options : {"", " --motion --refine"}) {
    const fs::path to = out(("holes" + options).c_str());
    succeed("masks " + quoted(scene()) + " --format depth" + options + " --out " + quoted(to));
    int holes = 0;
    for (const fs::path& file : files_in(scene() / "depth")) {
      const cv::Mat depth = read_unchanged(file);
      const cv::Mat found = read_unchanged(to / file.filename());
      ASSERT_EQ(found.type(), CV_16UC1);
      EXPECT_EQ(cv::countNonZero((found != depth) & (found != 0)), 0);
      const cv::Mat mask = read_unchanged(scene() / "masks" / file.filename());
      if (options.empty()) {
        EXPECT_EQ(cv::countNonZero((found != 0) & (mask != 0)), 0);
      }
      holes += cv::countNonZero((found == 0) & (depth != 0));
    }
    EXPECT_GT(holes, 1000);
  }
  const fs::path colour = changed("colour only", true, [](const fs::path& scene) {
    fs::remove(scene / "associations.txt");
    fs::remove(scene / "depth.txt");
    fs::remove_all(scene / "depth");
  });
  expect_refused("masks " + quoted(colour) + " --format depth --out " + quoted(out("no depth")),
                 "has no depth, which --format depth needs");
}

}  // namespace
}  // namespace dynfilter::testing
