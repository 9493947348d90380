// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Folders of masks with missing files, with other things in their place, or without permission;
// masks with a time of their own.

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "segmenters/mask_folder.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

const cv::Mat mask(6, 8, CV_8UC1, cv::Scalar(1));

void expect_always_refused(const fs::path& folder, const std::string& message) {
  expect_refused(folder, message);
  expect_refused(folder, message, allowing_missing());
}

TEST(MaskFolderFiles, RefusesWhatIsNotAFile) {
  for (const char* name : {"instances.csv", "2.png"}) {
    const TemporaryFolder folder;
    write_mask(folder, "1.png", mask);
    const fs::path file = folder / name;
    ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
    expect_always_refused(folder.path(), file.string() + ": is not a regular file");
    fs::remove(file);
    fs::create_directory(file);
    expect_always_refused(folder.path(), file.string() + ": is not a regular file");
  }
}

TEST(MaskFolderFiles, AcceptsSymbolicLinks) {
  const TemporaryFolder folder;
  write_mask(folder, "elsewhere/1.png", mask);
  folder.write("elsewhere/instances.csv", table_header + "1,1,7,0.5,0,0,4,5\n");
  fs::create_directory(folder / "masks");
  for (const char* file : {"1.png", "instances.csv"}) {
    fs::create_symlink(folder / "elsewhere" / file, folder / "masks" / file);
  }
  fs::create_symlink(folder / "nothing.png", folder / "masks" / "2.png");  // no mask
  EXPECT_EQ(MaskFolderSegmenter(folder / "masks").segment(frame_at(1)).instances.at(0).class_id, 7);
}

TEST(MaskFolderFiles, NamesAnUnreadableFolder) {
  const TemporaryFolder folder;
  const fs::path masks = folder / "masks";
  write_mask(folder, "masks/1.png", mask);
  fs::permissions(masks, fs::perms::none);
  {
    const OrdinaryUser user;
    ASSERT_TRUE(user.is_ordinary());
    expect_always_refused(
        masks,
        masks.string() + ": cannot be read: Permission denied; want a folder of masks (*.png)");
  }
  fs::permissions(masks, fs::perms::owner_all);
  fs::create_directory_symlink(folder / "loop", folder / "loop");
  expect_always_refused(folder / "loop", (folder / "loop").string() + ": cannot be read: ");
}

TEST(MaskFolderFiles, SkipsRowsOfMissingMasksOnRequest) {
  const TemporaryFolder folder;
  write_mask(folder, "1.png", mask);
  folder.write("instances.csv", table_header + "1,1,0,0.9,0,0,4,5\n2,1,0,0.9,0,0,4,5\n");
  expect_refused(folder.path(), "instances.csv:3: frame 2 has no mask 2.png");
  MaskFolderSegmenter people(folder.path(), allowing_missing());
  EXPECT_EQ(people.size(), 1U);
  EXPECT_TRUE(people.has_mask(1));
  EXPECT_FALSE(people.has_mask(2));
  EXPECT_EQ(people.segment(frame_at(1)).instances.size(), 1U);
  expect_no_masks(people, 2, "2.000000.png: there is no such mask; the nearest is 1.png");
}

TEST(MaskFolderFiles, AcceptsAnEmptyFolderOnRequest) {
  const TemporaryFolder folder;
  const auto expect_none = [&] {
    MaskFolderSegmenter people(folder.path(), allowing_missing());
    EXPECT_EQ(people.size(), 0U);
    EXPECT_FALSE(people.has_mask(1));
    expect_no_masks(people, 1, "there is no such mask; the folder holds none");
  };
  expect_none();
  folder.write("instances.csv", table_header + "1,1,0,0.9,0,0,4,5\n");
  expect_none();
}

// --- Masks with their own time: the last column of instances.csv ---------------------------------

const std::string timed_header = "frame,instance,class_id,score,x,y,width,height,mask_time\n";
constexpr std::uint64_t unknown = MaskFolderSegmenter::unknown_frame;

Segmentation timed_masks(double timestamp_s, int count = 1) {
  Segmentation segmentation;
  segmentation.timestamp_s = timestamp_s;
  segmentation.image_size = {8, 6};
  const cv::Mat block(3, 2, CV_8UC1, cv::Scalar(1));
  for (int i = 0; i < count; ++i) {
    segmentation.instances.push_back(Instance::from_box_mask(block, {3 * i, 1, 2, 3}, 0, 0.5F));
  }
  return segmentation;
}

TEST(MaskFolderTimes, RoundTripKeepsTheTimeOfTheMasks) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path());
  writer.add(timed_masks(1341846434.710184), "1341846434.710184", 1341846434.710184);
  writer.add(timed_masks(1341846434.710184, 2), "1341846434.746225", 1341846434.746225);
  writer.add(timed_masks(1341846434.710184, 0), "1341846434.778203", 1341846434.778203);
  writer.add(timed_masks(1341846434.810024));
  writer.finish();
  EXPECT_EQ(file_text(folder / "instances.csv"),
            timed_header +
                "1341846434.710184,1,0,0.500000,0,1,2,3,1341846434.710184\n"
                "1341846434.746225,1,0,0.500000,0,1,2,3,1341846434.710184\n"
                "1341846434.746225,2,0,0.500000,3,1,2,3,1341846434.710184\n"
                "1341846434.810024,1,0,0.500000,0,1,2,3,1341846434.810024\n");
  MaskFolderSegmenter reader(folder.path());
  const auto read = [&](double time_s) { return reader.segment(frame_at(time_s)); };
  EXPECT_DOUBLE_EQ(*read(1341846434.710184).timestamp_s, 1341846434.710184);
  EXPECT_EQ(read(1341846434.710184).frame_id, 77U);
  EXPECT_DOUBLE_EQ(*read(1341846434.746225).timestamp_s, 1341846434.710184);
  EXPECT_EQ(read(1341846434.746225).frame_id, unknown);
  EXPECT_EQ(read(1341846434.746225).instances.size(), 2U);
  // Masks without instances have no row, so they count as the frame's own.
  EXPECT_DOUBLE_EQ(*read(1341846434.778203).timestamp_s, 1341846434.778203);
  EXPECT_DOUBLE_EQ(*read(1341846434.810024).timestamp_s, 1341846434.810024);
}

TEST(MaskFolderTimes, HoldWithinALongReach) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path());
  writer.add(timed_masks(1), "1.0", 1);
  writer.add(timed_masks(1, 2), "1.066", 1.066);
  writer.finish();
  MaskFolderOptions options;
  options.max_time_difference_s = 0.1;
  options.allow_missing = true;
  MaskFolderSegmenter reader(folder.path(), options);
  EXPECT_EQ(reader.segment(frame_at(1.16)).timestamp_s, 1);
  fs::remove(folder / "1.066.png");  // its rows are not those of another mask
  for (const char* table : {"there", "not there"}) {
    const Segmentation one = MaskFolderSegmenter(folder.path(), options).segment(frame_at(1.09));
    EXPECT_TRUE(one.instances.size() == 1 && one.timestamp_s == 1 && one.frame_id == unknown)
        << table;
    fs::remove(folder / "instances.csv");
  }
}

TEST(MaskFolderTimes, MasksOfTheirFramesGetNoColumn) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path());
  writer.add(timed_masks(1.5004), "1.5", 1.5);  // the same moment, to 1 ms
  writer.add(timed_masks(1.5, 0), "2.5", 2.5);  // without instances
  writer.finish();
  EXPECT_EQ(file_text(folder / "instances.csv"), table_header + "1.5,1,0,0.500000,0,1,2,3\n");
  MaskFolderSegmenter reader(folder.path());
  EXPECT_DOUBLE_EQ(*reader.segment(frame_at(1.5)).timestamp_s, 1.5);
  EXPECT_EQ(reader.segment(frame_at(1.5)).frame_id, 77U);
}

TEST(MaskFolderTimes, RefusesWrongTimesWithFileAndLine) {
  const std::string good = "1.5,1,0,0.9,0,0,4,5,1.25\n";
  const struct {
    std::string text, message;
  } cases[] = {
      {timed_header + "1.5,1,0,0.9,0,0,4,5\n",
       ":2: got 8 columns; want frame,instance,class_id,score,x,y,width,height,mask_time"},
      {timed_header + good + "1.5,2,0,0.9,0,0,4,5,soon\n",
       ":3: mask_time: got 'soon'; want a time in seconds"},
      {timed_header + good + "1.5,2,0,0.9,0,0,4,5,1.3\n",
       ":3: mask_time: got '1.3' for frame 1.5; want that of its earlier lines"},
      {"frame,instance,class_id,score,x,y,width,height,time\n" + good,
       ":1: got 'frame,instance,class_id,score,x,y,width,height,time'; want the header"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.text);
    const TemporaryFolder folder;
    write_mask(folder, "1.5.png", cv::Mat(6, 8, CV_8UC1, cv::Scalar(0)));
    const auto path = folder.write("instances.csv", c.text);
    expect_refused(folder.path(), path.string() + c.message);
  }
}

TEST(MaskFolderTimes, WriterRefusesTimesThatAreNone) {
  const TemporaryFolder folder;
  MaskFolderWriter writer(folder.path());
  expect_misuse([&] { writer.add(timed_masks(1e18), "1.5", 1.5); },
                "masks of time 1000000000000000000.000000");
  EXPECT_EQ(writer.size(), 0U);
}

}  // namespace
}  // namespace dynfilter::testing
