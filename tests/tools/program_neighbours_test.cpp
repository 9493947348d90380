// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What the program writes is read by those it is for, or by a plain retelling of what they do.

#include <Eigen/Geometry>

#include "dynfilter/evaluation/trajectory_errors.hpp"
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

/// Reads the centres of the cameras from images.txt of COLMAP, where images are named by time: two
/// lines an image, of which the first has the rotation (w first) and translation from the world.
Trajectory centres_in(const fs::path& images) {
  Trajectory centres;
  std::ifstream file(images);
  for (std::string line; std::getline(file, line);) {
    if (line[0] == '#') continue;
    std::istringstream row(line);
    double id, w, x, y, z, camera, time_s;
    Eigen::Vector3d moved;
    row >> id >> w >> x >> y >> z >> moved[0] >> moved[1] >> moved[2] >> camera >> time_s;
    const Eigen::Vector3d centre = -(Eigen::Quaterniond(w, x, y, z).conjugate() * moved);
    centres.push_back({{cv::Matx33d::eye(), {centre[0], centre[1], centre[2]}}, time_s});
    std::getline(file, line);  // the points in the image
  }
  std::sort(centres.begin(), centres.end(),
            [](const TimedPose& a, const TimedPose& b) { return a.timestamp_s < b.timestamp_s; });
  return centres;
}

/// Runs the lines of the page, with changes, in a folder of its own. One thread leaves less to
/// chance.
class ColmapPage {
 public:
  explicit ColmapPage(const fs::path& sequence) {
    const std::string page = file_text(DYNFILTER_SOURCE_DIR "/examples/other_hosts/README.md");
    const std::size_t begin = page.find("sequence=SEQUENCE");
    lines_ = page.substr(begin, page.find("\n```", begin) - begin);
    replace("SEQUENCE", quoted(sequence));
    replace("\ndynfilter", "\n" + quoted(DYNFILTER_PROGRAM));
    replace("SiftExtraction.use_gpu 0", "SiftExtraction.use_gpu 0 --SiftExtraction.num_threads 1");
    replace("SiftMatching.use_gpu 0", "SiftMatching.use_gpu 0 --SiftMatching.num_threads 1");
    replace("colmap mapper", "colmap mapper --Mapper.num_threads 1");
  }

  void replace(const std::string& text, const std::string& by) {
    ASSERT_NE(lines_.find(text), std::string::npos) << text << " is not on the page";
    lines_.replace(lines_.find(text), text.size(), by);
  }

  /// Returns the error of the cameras' centres after a similarity, millimetres, and the number of
  /// images that COLMAP registered.
  std::pair<double, std::size_t> error_mm(const Trajectory& truth) const {
    const TemporaryFolder folder;
    const Outcome outcome = run_in_shell("export QT_QPA_PLATFORM=offscreen; set -e; cd " +
                                         quoted(folder.path()) + "\n" + lines_);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
    const Trajectory centres = centres_in(folder / "sparse/0/images.txt");
    if (centres.size() < 3) return {1e9, centres.size()};
    return {1000 * absolute_trajectory_error(centres, truth, {0.02, true}).translation_m.rmse,
            centres.size()};
  }

  /// Expects ten images and an error in the range: at once, or else as the median of three runs,
  /// because COLMAP's first pair is its own chance.
  void expect_error(const Trajectory& truth, double min_mm, double max_mm) const {
    std::vector<std::pair<double, std::size_t>> runs;
    const auto is_right = [&](const auto& one) {
      return one.second == 10 && one.first > min_mm && one.first < max_mm;
    };
    do {
      runs.push_back(error_mm(truth));
      std::sort(runs.begin(), runs.end());
    } while (runs.size() < 3 && !(runs.size() == 1 && is_right(runs[0])));
    EXPECT_TRUE(is_right(runs[runs.size() / 2]))
        << ::testing::PrintToString(runs) << " for " << min_mm << " to " << max_mm << " mm";
  }

 private:
  std::string lines_;
};

TEST(NeighboursOfACrowd, SlowColmapFindsTheCameraByRefinedMasks) {
  if (run_in_shell("colmap help").exit_code != 0) GTEST_SKIP() << "there is no colmap";
  const TemporaryFolder folder;
  const fs::path scene = folder / "a crowd";
  succeed("synth " + quoted(scene) +
          " --level near_crowd --seed 302 --frames 80 --width 320 --height 240");
  const Trajectory truth = read_trajectory(scene / "groundtruth.txt");
  ColmapPage page(scene);
  page.expect_error(truth, 0, 5);
  page.replace("--refine ", "");
  page.expect_error(truth, 8, 1000);
}

}  // namespace
}  // namespace dynfilter::testing
