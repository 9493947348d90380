// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// dynfilter masks --format colmap|static|dynamic: mask images for other systems.

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/host_masks.hpp"
#include "dynfilter/mask_refiner.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/neighbours.hpp"
#include "support/test.hpp"
#include "tools/program.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

class ProgramMaskImages : public SmallSceneTest {
 protected:
  /// Writes masks; returns what was printed.
  static Outcome masks(const std::string& options, const fs::path& to, const fs::path& of) {
    return run("masks " + quoted(of) + " --format " + options + " --out " + quoted(to));
  }

  static void expect_masks(const std::string& options, const fs::path& to,
                           const fs::path& of = scene()) {
    const Outcome outcome = masks(options, to, of);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  }

  /// Expects that the program refuses, says this and adds or changes no file.
  static void expect_refused(const std::string& options, const fs::path& to,
                             const std::string& part, const fs::path& of = scene()) {
    const FileTree before = file_tree(out("."));
    const Outcome outcome = masks(options, to, of);
    EXPECT_NE(outcome.exit_code, 0);
    expect_mentions(outcome, part);
    EXPECT_EQ(file_tree(out(".")), before);
  }

  static fs::path copy_of_scene(const char* name) {
    fs::copy(scene(), out(name), fs::copy_options::recursive);
    return out(name);
  }
};

/// Expects that a file has these pixels, 0 or 255, for Python and OpenCV.
void expect_pixels(const fs::path& file, const cv::Mat& want) {
  const int on = cv::countNonZero(want);
  EXPECT_EQ(read_by_others("pixels " + quoted(file)),
            detail::concatenate(want.cols, ' ', want.rows, " 8 ", on, ' ', 255 * on, '\n'));
  const cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  ASSERT_TRUE(image.type() == CV_8UC1 && image.size() == want.size()) << file;
  EXPECT_EQ(cv::countNonZero(image != want), 0) << file;
}

cv::Mat dynamic_pixels(const Segmentation& masks, int margin_px = 0) {
  MaskCullerOptions options;
  options.margin_px = margin_px;
  return mask_of_dynamic_pixels(masks, MaskCuller(options));
}

TEST_F(ProgramMaskImages, HaveTheNamesSizeAndPolarityOfTheirFormat) {
  const FileTree before = file_tree(scene());
  expect_masks("static", out("static"));
  expect_masks("dynamic", out("dynamic"));
  expect_masks("colmap", out("colmap"));
  expect_masks("dynamic --margin 3", out("grown"));
  EXPECT_EQ(file_tree(scene()), before);
  const RgbdSequence sequence(scene());
  MaskFolderSegmenter source(scene() / "masks");
  std::set<fs::path> names, colmap_names;
  int dynamic_pixels_count = 0;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const std::string name = sequence.entry(i).image_path.filename();  // <time>.png
    names.insert(name);
    colmap_names.insert(name + ".png");
    const Segmentation masks = source.segment(sequence.read(i));
    const cv::Mat dynamic = dynamic_pixels(masks);
    dynamic_pixels_count += cv::countNonZero(dynamic);
    expect_pixels(out("dynamic") / name, dynamic);
    expect_pixels(out("static") / name, 255 - dynamic);
    expect_pixels(out("colmap") / (name + ".png"), 255 - dynamic);
    expect_pixels(out("grown") / name, dynamic_pixels(masks, 3));
  }
  EXPECT_GT(dynamic_pixels_count, 1000) << "the test needs persons";
  const auto names_in = [](const fs::path& folder) {
    std::set<fs::path> found;
    for (const auto& [file, text] : visible_tree(folder)) found.insert(file);
    return found;
  };
  EXPECT_EQ(names_in(out("static")), names);
  EXPECT_EQ(names_in(out("dynamic")), names);
  EXPECT_EQ(names_in(out("colmap")), colmap_names);
}

TEST_F(ProgramMaskImages, RefinedMasksFollowTheRuleDepth) {
  expect_masks("dynamic --refine", out("refined"));
  const RgbdSequence sequence(scene());
  MaskFolderSegmenter source(scene() / "masks");
  bool differs = false;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const FrameView frame = sequence.read(i);
    const Segmentation masks = source.segment(frame);
    const cv::Mat want = dynamic_pixels(refined(frame, masks));
    expect_pixels(out("refined") / (sequence.entry(i).stem + ".png"), want);
    differs = differs || cv::countNonZero(want != dynamic_pixels(masks)) > 0;
  }
  EXPECT_TRUE(differs) << "the test needs masks that depth corrects";
}

TEST_F(ProgramMaskImages, KeepTheImagesFolders) {
  const fs::path folder = copy_of_scene("nested");
  std::string rows;
  const RgbdSequence sequence(folder);
  const char* const below[] = {"a", "a", "b", ""};  // rgb/
  for (std::size_t i = 0; i < 4; ++i) {
    const RgbdSequenceEntry& entry = sequence.entry(i);
    const fs::path name = fs::path("rgb") / below[i] / entry.image_path.filename();
    fs::create_directories((folder / name).parent_path());
    if (entry.image_path != folder / name) fs::rename(entry.image_path, folder / name);
    rows += entry.stem + " " + name.string() + " " + entry.stem + " depth/" +
            entry.depth_path.filename().string() + "\n";
  }
  std::ofstream(folder / "associations.txt") << rows;
  const Outcome outcome = masks("colmap", out("nested masks"), folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  expect_mentions(outcome, "--image_path " + quoted(folder / "rgb") + " ");
  for (std::size_t i = 0; i < 4; ++i) {
    const fs::path name = fs::path(below[i]) / (sequence.entry(i).stem + ".png.png");
    EXPECT_TRUE(fs::exists(out("nested masks") / name)) << name;
  }
}

TEST_F(ProgramMaskImages, KeepThePlainFoldersOfOneImageAndPrintACallToPaste) {
  const fs::path folder = out("it's plain"), inside = fs::path("sub") / "a" / "b";
  fs::create_directories(folder / inside);
  const fs::path image = RgbdSequence(scene()).entry(0).image_path;
  fs::copy(image, folder / inside / image.filename());
  const std::string given = "colmap --masks " + quoted(scene() / "masks");
  const Outcome outcome =
      run("masks \"" + folder.string() + "\" --format " + given + " --out " + quoted(out("of it")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(fs::exists(out("of it") / inside / (image.filename().string() + ".png")));
  std::string call = outcome.printed.substr(outcome.printed.find("colmap feature_extractor"));
  call.pop_back();  // the end of the line
  EXPECT_EQ(run_in_shell("colmap() { printf '<%s>' \"$@\"; }; " + call).printed,
            "<feature_extractor><--database_path><" + out("of it.db").string() +
                "><--image_path><" + folder.string() + "><--ImageReader.mask_path><" +
                out("of it").string() + ">");
}

TEST_F(ProgramMaskImages, AreMadeForEveryImage) {
  const fs::path folder = copy_of_scene("some depth");
  const RgbdSequence sequence(folder);
  std::string rows;
  for (std::size_t i = 0; i < 4; ++i) {
    const RgbdSequenceEntry& entry = sequence.entry(i);
    rows += entry.stem + " rgb/" + entry.stem + ".png " + entry.stem + " depth/" +
            entry.depth_path.filename().string() + "\n";
  }
  std::ofstream(folder / "associations.txt") << rows;
  const Outcome outcome = masks("colmap --refine", out("of every"), folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  expect_mentions(outcome,
                  "4 of 6 refined; the others, without depth, have the masks as they are\n");
  EXPECT_FALSE(outcome.mentions("further images"));
  MaskFolderSegmenter source(folder / "masks");
  for (std::size_t i = 4; i < 6; ++i) {
    expect_pixels(out("of every") / (sequence.entry(i).stem + ".png.png"),
                  255 - dynamic_pixels(source.segment(sequence.read(i))));
  }
  fs::create_directories(folder / "rgb" / "old");
  fs::copy(sequence.entry(0).image_path, folder / "rgb" / "old" / "unlisted.png");
  const Outcome plain = masks("colmap", out("of all but one"), folder);
  expect_mentions(plain, "1 further images in ");
  EXPECT_FALSE(plain.mentions("refined"));
  fs::rename(folder / "rgb" / "old" / "unlisted.png", folder / "rgb" / "unlisted.png");
  expect_refused("colmap", out("nothing"), "1 of 7 frames have none", folder);
}

TEST_F(ProgramMaskImages, OfBoxesAloneNeedDepth) {
  const fs::path folder = copy_of_scene("boxes");
  for (const auto& file : fs::directory_iterator(folder / "masks")) {
    if (file.path().extension() == ".png") {
      cv::imwrite(file.path().string(), cv::Mat(240, 320, CV_8UC1, cv::Scalar(0)));
    }
  }
  for (const char* format : {"colmap", "static", "dynamic", "depth"}) {
    expect_refused(format, out("boxes alone"), "--refine", folder);
  }
  expect_masks("dynamic --refine", out("from boxes"), folder);
  EXPECT_GT(cv::countNonZero(cv::imread(
                (out("from boxes") / (RgbdSequence(folder).entry(3).stem + ".png")).string(), 0)),
            500);
}

TEST_F(ProgramMaskImages, OfOneNameAreRefused) {
  const fs::path folder = copy_of_scene("names");
  const RgbdSequence sequence(folder);
  const RgbdSequenceEntry& first = sequence.entry(0);
  const RgbdSequenceEntry& second = sequence.entry(1);
  fs::path other = first.image_path;
  other.replace_extension(".jpg");
  fs::rename(second.image_path, other);
  std::ofstream(folder / "associations.txt")
      << first.stem << " rgb/" << first.image_path.filename().string() << ' ' << first.stem
      << " depth/" << first.depth_path.filename().string() << '\n'
      << second.stem << " rgb/" << other.filename().string() << ' ' << second.stem << " depth/"
      << second.depth_path.filename().string() << '\n';
  expect_refused("static", out("names masks"), "the mask of another image would have the same name",
                 folder);
  const fs::path photos = out("photos");
  for (const char* day : {"1", "2"}) {
    fs::create_directories(photos / day);
    fs::copy(other, photos / day / "a.jpg");
  }
  expect_refused("labels --remote nobody", out("names labels"),
                 "the mask of another image would have the same name, a.png", photos);
  fs::rename(photos / "2" / "a.jpg", photos / "2" / "a, b.jpg");
  expect_refused("labels --remote nobody", out("comma labels"),
                 "2/a, b.jpg: has a comma or quote in its name", photos);
}

TEST_F(ProgramMaskImages, NameWhatIsMissing) {
  // Label maps of a segmenter's masks; which segmenters there are depends on the build.
  expect_refused("labels", out("nothing"), "a segmenter, --");
  const fs::path folder = copy_of_scene("incomplete");
  const std::string stem = RgbdSequence(folder).entry(3).stem;
  fs::remove(folder / "masks" / (stem + ".png"));
  fs::remove(folder / "masks" / "instances.csv");  // it would miss the mask itself
  expect_refused("static", out("nothing"),
                 stem + ".png: there is no such mask; frame " + stem + " needs it; 1 of 6 frames",
                 folder);
  expect_refused("static", out("nothing"), "--missing-masks keep", folder);
  expect_mentions(masks("static --missing-masks keep", out("kept"), folder),
                  "1 of 6 frames have no mask, and masks remove nothing");
  expect_pixels(out("kept") / (stem + ".png"), cv::Mat(240, 320, CV_8UC1, cv::Scalar(255)));
  fs::remove_all(folder / "masks");
  expect_refused("static", out("nothing"), "has no masks: name them by --masks, or a segmenter",
                 folder);
  for (const char* file : {"depth", "depth.txt", "associations.txt"}) fs::remove_all(folder / file);
  const std::string masks = " --masks " + quoted(scene() / "masks");
  expect_refused("static --refine" + masks, out("nothing"), "has no depth", folder);
  expect_masks("static" + masks, out("without depth"), folder);
  expect_refused("labels --refine --remote nobody", out("nothing"), "--refine needs --format");
  expect_refused("static --remote nobody" + masks, out("nothing"), "one source of masks");
  expect_refused("black", out("nothing"), "--format");
}

}  // namespace
}  // namespace dynfilter::testing
