// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Masks of other tools. The scene's people are written as those tools write them, and the program
// must write the same masks of them as of the scene's own.

#include "support/test.hpp"
#include "tools/changed_scene.hpp"
#include "tools/program.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

using nlohmann::json;

/// A frame's people, 0 or 255 each, of the image's size.
struct People {
  std::string stem;
  std::vector<cv::Mat> masks;
};

/// Counts pixels down the columns: off, on, off …
std::vector<std::uint32_t> runs_of(const cv::Mat& mask) {
  std::vector<std::uint32_t> runs(1, 0);
  bool is_on = false;
  for (int x = 0; x < mask.cols; ++x) {
    for (int y = 0; y < mask.rows; ++y) {
      if ((mask.at<std::uint8_t>(y, x) != 0) != is_on) {
        runs.push_back(0);
        is_on = !is_on;
      }
      ++runs.back();
    }
  }
  return runs;
}

/// Writes runs as COCO's tools do: each run from the fourth on less the last but one, in groups of
/// five bits, lowest first; bit 6 tells that more follow, bit 5 of the last group is the sign.
std::string compressed(const std::vector<std::uint32_t>& runs) {
  std::string text;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    long value = runs[i];
    if (i > 2) value -= runs[i - 2];
    for (bool more = true; more;) {
      long group = value & 0x1f;
      value >>= 5;
      more = (group & 0x10) != 0 ? value != -1 : value != 0;
      text += static_cast<char>((more ? group | 0x20 : group) + 48);
    }
  }
  return text;
}

std::vector<std::vector<cv::Point>> contours_of(const cv::Mat& mask) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask.clone(), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  return contours;
}

json polygons_of(const cv::Mat& mask) {
  json polygons = json::array();
  for (const auto& contour : contours_of(mask)) {
    json flat = json::array();
    for (const cv::Point& point : contour) {
      flat.push_back(point.x + 0.5);
      flat.push_back(point.y + 0.5);
    }
    if (contour.size() > 2) polygons.push_back(flat);
  }
  return polygons;
}

class OtherMasks : public SmallSceneTest {
 protected:
  static void SetUpTestSuite() {
    SmallSceneTest::SetUpTestSuite();
    std::map<std::string, std::vector<int>> labels;
    for (const auto& row : read_csv(scene() / "masks/instances.csv")) {
      if (row.at(2) == "0") labels[row.at(0)].push_back(std::stoi(row.at(1)));
    }
    people().clear();
    for (const fs::path& file : files_in(scene() / "masks")) {
      const cv::Mat map = read_unchanged(file);
      People& frame = people().emplace_back();
      frame.stem = file.stem().string();
      for (const int label : labels[frame.stem]) frame.masks.push_back(map == label);
    }
  }

  static std::vector<People>& people() {
    static std::vector<People> all;
    return all;
  }

  /// COCO's annotations with what `shape` makes of a mask; a chair everywhere must not count.
  static std::string coco(const std::function<json(const cv::Mat&)>& shape) {
    json root = {
        {"images", json::array()},
        {"annotations", json::array()},
        {"categories", {{{"id", 1}, {"name", "person"}}, {{"id", 62}, {"name", "chair"}}}}};
    int id = 0;
    for (const People& frame : people()) {
      const cv::Size size = image_size();
      root["images"].push_back({{"id", id},
                                {"file_name", "rgb/" + frame.stem + ".png"},
                                {"width", size.width},
                                {"height", size.height}});
      for (const cv::Mat& mask : frame.masks) {
        const cv::Rect box = cv::boundingRect(mask);
        root["annotations"].push_back({{"image_id", id},
                                       {"category_id", 1},
                                       {"iscrowd", 0},
                                       {"segmentation", shape(mask)},
                                       {"bbox", {box.x, box.y, box.width, box.height}}});
      }
      root["annotations"].push_back({{"image_id", id++},
                                     {"category_id", 62},
                                     {"segmentation", {{0, 0, 50, 0, 50, 50, 0, 50}}}});
    }
    return root.dump(1);
  }

  static cv::Size image_size() { return people().front().masks.at(0).size(); }

  static json rle(const cv::Mat& mask, bool is_compressed) {
    json counts = runs_of(mask);
    if (is_compressed) counts = compressed(runs_of(mask));
    return {{"size", {mask.rows, mask.cols}}, {"counts", counts}};
  }

  /// Writes the masks of people with `other` as --masks. Returns what was printed.
  static Outcome masks(const fs::path& other, const fs::path& to, const std::string& options = "") {
    return run("masks " + quoted(scene()) + " --format dynamic --masks " + quoted(other) +
               " --out " + quoted(to) + " " + options);
  }

  /// Expects the pixels of the scene's people, but for so small a share of them.
  static void expect_people(const fs::path& other, double share = 0) {
    const fs::path to = other.parent_path() / (other.filename().string() + " out");
    const Outcome outcome = masks(other, to);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
    int wrong = 0, all = 0;
    for (const People& frame : people()) {
      cv::Mat want(image_size(), CV_8UC1, cv::Scalar(0));
      for (const cv::Mat& mask : frame.masks) want |= mask;
      const cv::Mat found = read_unchanged(to / (frame.stem + ".png"));
      ASSERT_EQ(found.size(), want.size());
      wrong += cv::countNonZero(found != want);
      all += cv::countNonZero(want);
    }
    EXPECT_GT(all, 1000);
    EXPECT_LE(wrong, share * all);
  }

  TemporaryFolder folder_;
};

TEST_F(OtherMasks, OfCocoMayBePolygonsOrRuns) {
  expect_people(folder_.write("polygons.json", coco(polygons_of)), 0.01);
  for (const bool is_compressed : {false, true}) {
    expect_people(folder_.write(is_compressed ? "c.json" : "r.json", coco([&](const cv::Mat& mask) {
                                  return rle(mask, is_compressed);
                                })));
  }
}

/// Results are a list without names of classes or images, whose ids are names or numbers.
TEST_F(OtherMasks, OfCocosResultsNameImages) {
  json results = json::array();
  for (const People& frame : people()) {
    for (const cv::Mat& mask : frame.masks) {
      results.push_back({{"image_id", frame.stem},
                         {"category_id", 1},
                         {"score", 0.8},
                         {"segmentation", rle(mask, true)}});
    }
    results.push_back({{"image_id", frame.stem}, {"category_id", 62}, {"bbox", {0, 0, 9, 9}}});
  }
  expect_people(folder_.write("results.json", results.dump()));
}

TEST_F(OtherMasks, OfYoloAreSharesOfTheImage) {
  for (const char* score : {"", " 0.75"}) {
    const fs::path labels = folder_ / (*score == 0 ? "labels" : "scored");
    for (const People& frame : people()) {
      std::string rows = "56 0.1 0.1 0.2 0.1 0.2 0.2\n";
      for (const cv::Mat& mask : frame.masks) {
        for (const auto& contour : contours_of(mask)) {
          if (contour.size() < 3) continue;
          rows += "0";
          for (const cv::Point& point : contour) {
            rows += " " + std::to_string((point.x + 0.5) / mask.cols) + " " +
                    std::to_string((point.y + 0.5) / mask.rows);
          }
          rows += std::string(score) + "\n";
        }
      }
      folder_.write(labels / (frame.stem + ".txt"), rows);
    }
    folder_.write(labels / "classes.txt", "person\nbicycle\n");
    expect_people(labels, 0.01);
  }
}

TEST_F(OtherMasks, OfYoloMayBeBoxesThatDepthFills) {
  for (const People& frame : people()) {
    std::string rows;
    for (const cv::Mat& mask : frame.masks) {
      const cv::Rect box = cv::boundingRect(mask);
      const cv::Point2d centre = cv::Point2d(box.tl() + box.br()) / 2;
      rows += "0 " + std::to_string(centre.x / mask.cols) + " " +
              std::to_string(centre.y / mask.rows) + " " +
              std::to_string(double{1} * box.width / mask.cols) + " " +
              std::to_string(double{1} * box.height / mask.rows) + " 0.9\n";
    }
    folder_.write("boxes/" + frame.stem + ".txt", rows);
  }
  const Outcome alone = masks(folder_ / "boxes", folder_ / "alone");
  EXPECT_NE(alone.exit_code, 0);
  expect_mentions(alone, "--refine");
  EXPECT_EQ(masks(folder_ / "boxes", folder_ / "filled", "--refine").exit_code, 0);
}

TEST_F(OtherMasks, OfCvatHaveColoursByATable) {
  for (const People& frame : people()) {
    cv::Mat image(image_size(), CV_8UC3, cv::Scalar(0, 0, 0));
    image(cv::Rect(0, 0, 40, 40)).setTo(cv::Scalar(125, 183, 250));
    for (const cv::Mat& mask : frame.masks) image.setTo(cv::Scalar(64, 64, 192), mask);
    fs::create_directories(folder_ / "cvat/SegmentationClass");
    cv::imwrite((folder_ / "cvat/SegmentationClass" / (frame.stem + ".png")).string(), image);
  }
  folder_.write("cvat/labelmap.txt",
                "# label:color_rgb:parts:actions\nbackground:0,0,0::\nchair:250,183,125::\n"
                "person:192,64,64::\n");
  expect_people(folder_ / "cvat");
  expect_people(folder_ / "cvat/SegmentationClass");
}

TEST_F(OtherMasks, MayBeSeveralFilesAnImage) {
  for (const People& frame : people()) {
    int k = 0;
    for (const cv::Mat& mask : frame.masks) {
      const std::string number = std::to_string(k++);
      for (const std::string& file : {"flat/" + frame.stem + "_" + number + ".png",
                                      "folders/" + frame.stem + "/" + people()[k - 1].stem + ".png",
                                      "objects/" + number + "/" + frame.stem + ".png"}) {
        fs::create_directories((folder_ / file).parent_path());
        cv::imwrite((folder_ / file).string(), mask);
      }
    }
  }
  for (const char* layout : {"flat", "folders", "objects"}) expect_people(folder_ / layout);
}

TEST_F(OtherMasks, OfMotsAndCityscapesHaveAThousandIdsAClass) {
  const struct {
    const char* name;
    int person, car;
  } sets[] = {{"mots", 2001, 1001}, {"cityscapes", 24000, 26000}};
  for (const auto& [name, person, car] : sets) {
    fs::create_directories(folder_ / name);
    for (const People& frame : people()) {
      cv::Mat ids(image_size(), CV_16UC1, cv::Scalar(person < 24000 ? 0 : 7));
      ids(cv::Rect(0, 0, 40, 40)).setTo(car);
      if (person < 24000) ids(cv::Rect(0, 200, 40, 40)).setTo(10000);
      int id = person;
      for (const cv::Mat& mask : frame.masks) ids.setTo(id++, mask);
      cv::imwrite((folder_ / name / (frame.stem + ".png")).string(), ids);
    }
    expect_people(folder_ / name);
    succeed("masks " + quoted(scene()) + " --masks " + quoted(folder_ / name) + " --out " +
            quoted(folder_ / "labels") + " --overwrite");
    EXPECT_LT(read_csv(folder_ / "labels/instances.csv").size(), 8 * people().size());
  }
}

TEST_F(OtherMasks, BecomeTheHousesForThePlugin) {
  const fs::path file =
      folder_.write("r.json", coco([](const cv::Mat& mask) { return rle(mask, true); }));
  succeed("masks " + quoted(scene()) + " --masks " + quoted(file) + " --out " +
          quoted(folder_ / "labels"));
  EXPECT_TRUE(fs::exists(folder_ / "labels/instances.csv"));
  expect_people(folder_ / "labels");
  const Outcome outcome = succeed("run " + quoted(scene()) + " --rule mask --overlays 0 --masks " +
                                  quoted(file) + " --out " + quoted(folder_ / "run"));
  EXPECT_GT(read_json(folder_ / "run/summary.json")["masked"], 0) << outcome.printed;
}

TEST_F(OtherMasks, MayBeMissingIfTheUserSaysSo) {
  json root = json::parse(coco(polygons_of));
  root["images"].erase(0);
  const std::string of = quoted(scene()) + " --masks " +
                         quoted(folder_.write("some.json", root.dump())) + " --out " +
                         quoted(folder_ / "out");
  const std::string count = "1 of " + std::to_string(people().size());
  for (const char* command : {"run ", "ablate ", "masks "}) {
    expect_refused(command + of, count + " frames have none");
    expect_refused(command + of, "--missing-masks keep");
  }
  expect_mentions(succeed("run " + of + " --missing-masks keep"),
                  count + " frames have no mask, and masks remove nothing in them");
  const auto rows = read_csv(folder_ / "out/frames.csv");
  EXPECT_EQ(rows.at(1).at(2), "0") << "has_masks";
  EXPECT_EQ(rows.at(2).at(2), "1");
}

TEST_F(OtherMasks, OrOneSentenceNamesTheFile) {
  const std::string size = std::to_string(image_size().height);
  const auto annotated = [&](const std::string& segmentation) {
    return "[{\"image_id\": \"" + people()[0].stem +
           "\", \"category_id\": 1, \"segmentation\": " + segmentation + "}]";
  };
  std::string many = "[[0,0,320,0,320,240]";
  for (int i = 0; i < 300; ++i) many += ",[0,0,320,0,320,240]";
  std::string objects = annotated(many + "]");
  objects.pop_back();
  const std::string one = objects.substr(1);
  for (int i = 0; i < 300; ++i)
    objects += "," + annotated("[[0,0,320,0,320,240]]").substr(1), objects.pop_back();
  const struct {
    std::string text;
    const char* sentence;
  } cases[] = {
      {"", "a.json: holds no masks in COCO's form"},
      {"{\"images\": [], \"annotations\": []}",
       "a.json: is of no frame of the sequence; frames are called as 1.000000"},
      {"{\"images\": [{\"id\": 1, \"file_name\": \"1.000000.png\", \"width\": 240, "
       "\"height\": 320}], \"annotations\": [{\"image_id\": 1, \"category_id\": 1}]}",
       "240x320 pixels, but the frame has 320x240; is one of them turned"},
      {"{\"images\": [{\"id\": 1}]}", "key 'file_name' not found"},
      {std::string(300000, '['), "nests too deeply"},
      {annotated("{\"size\": [240, 320], \"counts\": [5, 5]}"),
       "runs of 10 pixels in an image of 320x240"},
      {annotated("{\"size\": [1000000000, 1000000000], \"counts\": [4000000000]}"), "a.json: "},
      {annotated("{\"size\": [-1, -1], \"counts\": [1]}"), "a.json: "},
      {annotated("{\"size\": [240, 320], \"counts\": \"~~~~~~~~~~~~~~~\"}"), "counts: "},
      {annotated("{\"size\": [240, 320], \"counts\": \"oooooooooooo\"}"), "counts: "},
      {annotated("{\"counts\": 5}"), "a.json: "},
      {annotated("[[\"x\", 1, 2, 3, 4, 5]]"), "a.json: "},
      {objects + "]", "64 times the pixels"},
  };
  for (const auto& [text, sentence] : cases) {
    SCOPED_TRACE(text.substr(0, 200));
    const Outcome outcome =
        masks(folder_.write("a.json", text), folder_ / "out", "--missing-masks keep");
    EXPECT_NE(outcome.exit_code, 0);
    expect_mentions(outcome, sentence);
    EXPECT_LT(outcome.printed.size(), 3000U);
  }
  for (const auto& [row, sentence] :
       {std::pair("0 5 5 9 5 9 9", "want 0 to 1, shares of the image"),
        std::pair("0 0.5 0.5", "got 3 columns"),
        std::pair("person 0 0 1 1", "class: got 'person'")}) {
    folder_.write("labels/" + people()[0].stem + ".txt", row);
    const Outcome outcome = masks(folder_ / "labels", folder_ / "out", "--missing-masks keep");
    EXPECT_NE(outcome.exit_code, 0);
    expect_mentions(outcome, sentence);
  }
}

}  // namespace
}  // namespace dynfilter::testing
