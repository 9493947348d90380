// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_folder_writer.hpp"

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "segmenters/mask_folder.hpp"
#include "support/neighbours.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

/// Segmentation without instances.
Segmentation nobody_at(double timestamp_s) {
  Segmentation segmentation;
  segmentation.timestamp_s = timestamp_s;
  segmentation.image_size = {8, 6};
  return segmentation;
}

/// Disjoint instances with random pixels, so that a label map can hold them.
Segmentation random_segmentation(std::mt19937& random, int count, double timestamp_s) {
  Segmentation segmentation;
  segmentation.timestamp_s = timestamp_s;
  segmentation.image_size = {40, 30};
  cv::Mat owner(segmentation.image_size, CV_32SC1);
  for (int y = 0; y < owner.rows; ++y) {
    for (int x = 0; x < owner.cols; ++x) {
      owner.at<int>(y, x) = static_cast<int>(random() % static_cast<unsigned>(count + 1));
    }
  }
  for (int k = 1; k <= count; ++k) {
    const cv::Mat mask = owner == k;
    const int x = static_cast<int>(random() % 40) - 5;
    Instance instance =
        Instance::from_image_mask(mask, {x, 3, 50, k}, static_cast<int>(random() % 80),
                                  static_cast<float>(random() % 1001) / 1000);
    if (k % 7 == 3) {
      instance.mask_origin = {0, 0};  // a mask of the whole image
      instance.mask = mask;
    }
    segmentation.instances.push_back(instance);
  }
  return segmentation;
}

/// Returns what another reader must find of a segmentation, see neighbours.py.
void describe(const Segmentation& segmentation, std::ostream& lines) {
  lines << std::fixed;
  for (std::size_t i = 0; i < segmentation.instances.size(); ++i) {
    const Instance& instance = segmentation.instances[i];
    std::vector<cv::Point> pixels;
    cv::findNonZero(full_mask(instance, segmentation.image_size), pixels);
    cv::Point sum;
    for (const cv::Point& pixel : pixels) sum += pixel;
    const cv::Rect& box = instance.box;
    lines << *segmentation.timestamp_s << '|' << i + 1 << '|' << instance.class_id << '|'
          << instance.score << '|' << box.x << '|' << box.y << '|' << box.width << '|' << box.height
          << '|' << pixels.size() << '|' << sum.x << '|' << sum.y << '\n';
  }
}

TEST(MaskFolderWriter, OthersReadEveryInstance) {
  std::mt19937 random(23);
  const TemporaryFolder folder;
  std::ostringstream want;
  MaskFolderWriter writer(folder / "new/masks");
  double time_s = 1341846434.710184;
  for (const int count : {3, 0, 1, 12, 255, 256, 700}) {
    const Segmentation segmentation = random_segmentation(random, count, time_s += 0.033);
    describe(segmentation, want);
    writer.add(segmentation);
  }
  EXPECT_EQ(writer.size(), 7U);
  writer.finish();
  writer.finish();
  EXPECT_EQ(read_by_others("masks " + (folder / "new/masks").string()), want.str());
}

TEST(MaskFolderWriter, WritesTheDocumentedFormat) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path());
  Segmentation segmentation = nobody_at(12.5);
  const cv::Mat block(3, 3, CV_8UC1, cv::Scalar(1));
  segmentation.instances = {Instance::from_box_mask(block, {1, 1, 3, 3}, 0, 0.909F),
                            Instance::from_box_mask(block, {2, 2, 3, 3}, 56, 0.5F),
                            Instance::from_box({-3, 0, 900, 2}, 7)};
  writer.add(segmentation);
  segmentation.instances.clear();
  segmentation.timestamp_s = 13;
  writer.add(segmentation, "13");
  writer.finish();
  EXPECT_EQ(file_text(folder / "instances.csv"), table_header +
                                                     "12.500000,1,0,0.909000,1,1,3,3\n"
                                                     "12.500000,2,56,0.500000,2,2,3,3\n"
                                                     "12.500000,3,7,1.000000,-3,0,900,2\n");
  cv::Mat want(6, 8, CV_8UC1, cv::Scalar(0));
  want(cv::Rect(2, 2, 3, 3)).setTo(2);
  want(cv::Rect(1, 1, 3, 3)).setTo(1);  // the overlap goes to the lower index
  const cv::Mat labels = cv::imread((folder / "12.500000.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(labels.type(), CV_8UC1);
  EXPECT_EQ(cv::norm(labels, want, cv::NORM_INF), 0);
  const cv::Mat empty = cv::imread((folder / "13.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(empty.size(), cv::Size(8, 6));
  EXPECT_EQ(cv::countNonZero(empty), 0);
}

TEST(MaskFolderWriter, ClipsMasksToTheImage) {
  constexpr int int_max = std::numeric_limits<int>::max();
  constexpr int int_min = std::numeric_limits<int>::min();
  const struct {
    cv::Point origin;
    cv::Rect visible;
  } cases[] = {
      {{-1, -2}, {0, 0, 2, 1}}, {{6, 4}, {6, 4, 2, 2}}, {{-3, 0}, {}}, {{0, 6}, {}},
      {{int_min, 0}, {}},       {{0, int_max}, {}},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.origin);
    const TemporaryFolder folder;
    Segmentation segmentation = nobody_at(0);
    Instance instance;
    instance.mask_origin = c.origin;
    instance.mask = cv::Mat(3, 3, CV_8UC1, cv::Scalar(255));
    segmentation.instances = {instance};
    MaskFolderWriter writer(folder.path());
    writer.add(segmentation);
    writer.finish();
    cv::Mat want(6, 8, CV_8UC1, cv::Scalar(0));
    want(c.visible).setTo(1);
    const cv::Mat labels = cv::imread((folder / "0.000000.png").string(), cv::IMREAD_UNCHANGED);
    EXPECT_EQ(cv::norm(labels, want, cv::NORM_INF), 0);
  }
}

TEST(MaskFolderWriter, RefusesInvalidSegmentations) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path());
  Segmentation segmentation;
  segmentation.timestamp_s = 1;
  const auto expect_refused = [&](const std::string& stem, const std::string& part) {
    expect_misuse([&] { writer.add(segmentation, stem); }, part);
  };
  expect_refused("1", "image_size 0x0");
  segmentation.image_size = {5, 0};
  expect_refused("1", "image_size 5x0");
  segmentation.image_size = {8, 6};
  expect_refused("frame1", "the stem 'frame1'; want a time");
  expect_refused("../1", "the stem '../1'");
  segmentation.instances.resize(65536);
  expect_refused("1", "65536 instances; want at most 65535");
  segmentation.instances.resize(1);
  segmentation.instances[0].score = 2;
  expect_refused("1", "score 2");
  segmentation.instances.clear();
  writer.add(segmentation, "1");
  expect_refused("1.0", "'1.0', of time 1.000000, a second time");
  writer.finish();
  expect_refused("2", "after finish()");
  EXPECT_EQ(file_text(folder / "instances.csv"), table_header);
}

TEST(MaskFolderWriter, WritesAnyNameOnce) {
  const TemporaryFolder folder;
  MaskFolderWriterOptions options;
  options.any_names = true;
  MaskFolderWriter writer(folder.path(), options);
  Segmentation segmentation = nobody_at(0);
  writer.add(segmentation, "a", 0);
  expect_misuse([&] { writer.add(segmentation, "", 1); }, "the stem ''; want a name without");
  expect_misuse([&] { writer.add(segmentation, "a", 1); }, "'a', of time 1.000000, a second time");
  expect_misuse([&] { writer.add(segmentation, "b", 0); }, "'b', of time 0.000000, a second time");
  segmentation.timestamp_s.reset();
  expect_misuse([&] { writer.add(segmentation, "b"); }, "'b' without a time");
  EXPECT_EQ(writer.size(), 1U);
}

TEST(MaskFolderWriter, RefusesAStemThatIsNotTheTime) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path());
  Segmentation segmentation = nobody_at(0);
  const auto expect_refused = [&](double timestamp_s, const std::string& stem) {
    segmentation.timestamp_s = timestamp_s;
    expect_misuse([&] { writer.add(segmentation, stem); },
                  "the stem '" + stem + "' for a segmentation of time");
    EXPECT_FALSE(fs::exists(folder / (stem + ".png")));
  };
  expect_refused(12.5, "13");
  expect_refused(1341846434.710184, "1341846434.711185");
  expect_refused(1341846434.710184, "1341846434");  // cut off
  expect_refused(1e18, "13");
  expect_misuse([&] { writer.add(segmentation, "13"); }, "of time 1000000000000000000.000000");
  EXPECT_EQ(writer.size(), 0U);

  for (const char* stem : {"1341846434.711184", "1341846434.709184", "1341846434.71"}) {
    const TemporaryFolder found;
    segmentation.timestamp_s = 1341846434.710184;
    MaskFolderWriter finds(found.path());
    finds.add(segmentation, stem);
    finds.finish();
    EXPECT_TRUE(MaskFolderSegmenter(found.path()).has_mask(*segmentation.timestamp_s)) << stem;
  }
}

TEST(MaskFolderWriter, RefusesWhatTheReaderWould) {
  const TemporaryFolder folder;
  expect_misuse([&] { MaskFolderWriter(folder.path()).finish(); }, "no segmentation");
  folder.write("floor_plan.png", "mine");
  folder.write(".dynfilter-masks.txt",
               "# What dynfilter masks wrote here and may replace: names\n");
  expect_failure([&] { MaskFolderWriter(folder.path(), {true}); }, "holds floor_plan.png");
}

TEST(MaskFolderWriter, IsTheParentsInAChild) {
  const TemporaryFolder folder;
  auto writer = std::make_unique<MaskFolderWriter>(folder.path());
  writer->add(nobody_at(1));
  EXPECT_EQ(exit_code_of_child([&] {
              expect_failure([&] { writer->finish(); }, "");
              writer.reset();
              return ::testing::Test::HasFailure() ? 1 : 5;
            }),
            5);
  writer->finish();
  EXPECT_TRUE(fs::exists(folder / "1.000000.png"));
}

}  // namespace
}  // namespace dynfilter::testing
