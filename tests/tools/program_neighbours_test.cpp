// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What the program writes is read by those it is for, or by a plain retelling of what they do.

#include "support/neighbours.hpp"
#include "support/test.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

class Neighbours : public SmallSceneTest {
 protected:
  static std::string read(const std::string& what, const fs::path& file) {
    return read_by_others(what + ' ' + quoted(file));
  }
};

TEST_F(Neighbours, ReadTheListsOfAScene) {
  const auto pairs = load_images(scene() / "associations.txt");
  const auto images = load_images(scene() / "rgb.txt", 3);
  ASSERT_EQ(pairs.size(), 6U);
  ASSERT_EQ(images.size(), 6U);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(pairs[i].image, images[i].image);
    EXPECT_EQ(pairs[i].time_s, images[i].time_s);
    for (const std::string& file : {pairs[i].image, pairs[i].depth}) {
      EXPECT_TRUE(fs::is_regular_file(scene().string() + "/" + file)) << file;
    }
  }
  for (const char* list : {"rgb.txt", "depth.txt"}) {
    EXPECT_EQ(read("csv", scene() / list).find('|'), std::string::npos) << "blanks divide, alone";
  }
  EXPECT_EQ(read("tum", scene() / "groundtruth.txt"), "6 {8}\n");
  const cv::FileStorage settings((scene() / "camera.yaml").string(), cv::FileStorage::READ);
  EXPECT_EQ(static_cast<float>(settings["Camera.fx"]), 535.4F / 2);
  EXPECT_EQ(static_cast<int>(settings["Camera.width"]), 320);
  EXPECT_TRUE(settings["DepthMapFactor"].isReal()) << "ORB-SLAM3 stops at an integer";
}

TEST_F(Neighbours, ReadTheResultsOfARun) {
  const fs::path photos = out("photos");
  for (const char* name : {"a,b.png", "c\"d\".png", "e f.png"}) {
    fs::create_directories(photos);
    fs::copy(scene() / "rgb/1.000000.png", photos / name);
  }
  const std::string options = " --rule none --features 200 --overlays 0 --out ";
  succeed("run " + quoted(photos) + options + quoted(out("of photos")));
  const std::string rows = read("csv", out("of photos") / "frames.csv");
  for (const char* begin :
       {"frame|timestamp_s|", "\na,b|0.000000|", "\nc\"d\"|0.033333|", "\ne f|"}) {
    EXPECT_NE(rows.find(begin), std::string::npos) << begin << '\n' << rows;
  }
  std::ptrdiff_t columns = 0;
  std::istringstream lines(rows);
  for (std::string line; std::getline(lines, line);) {
    const auto count = std::count(line.begin(), line.end(), '|');
    if (columns == 0) columns = count;
    EXPECT_EQ(count, columns) << line;
  }
  succeed("run " + quoted(scene()) + options + quoted(out("of scene")));
  for (const char* file : {"trajectory.txt", "groundtruth.txt"}) {
    EXPECT_EQ(read("tum", out("of scene") / file), "6 {8}\n") << file;
  }
}

/// COLMAP takes no keypoint from a mask, and would without it.
TEST_F(Neighbours, SlowColmapTakesNoFeatureOnAMask) {
  if (run_in_shell("colmap help").exit_code != 0) GTEST_SKIP() << "there is no colmap";
  succeed("masks " + quoted(scene()) + " --format colmap --margin 4 --out " +
          quoted(out("colmap")));
  const auto judge = [&](const char* database, const std::string& options) {
    const Outcome outcome = run_in_shell(
        "QT_QPA_PLATFORM=offscreen colmap feature_extractor --SiftExtraction.use_gpu 0 "
        "--database_path " +
        quoted(out(database)) + " --image_path " + quoted(scene() / "rgb") + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
    std::size_t keypoints = 0, on_masks = 0;
    std::istringstream(read_by_others("colmap " + quoted(out(database)) + ' ' +
                                      quoted(scene() / "rgb") + ' ' + quoted(out("colmap")))) >>
        keypoints >> on_masks;
    EXPECT_GT(keypoints, 500U);
    return on_masks;
  };
  EXPECT_GT(judge("without.db", ""), 100U) << "the test needs features on persons";
  EXPECT_EQ(judge("with.db", " --ImageReader.mask_path " + quoted(out("colmap"))), 0U);
}

}  // namespace
}  // namespace dynfilter::testing
