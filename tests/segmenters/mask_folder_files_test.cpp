// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Folders of masks with missing files, with other things in their place, or without permission.

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"

#include <filesystem>
#include <stdexcept>
#include <string>

#include <sys/stat.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "support/expect_error.hpp"
#include "support/mask_folder.hpp"
#include "support/ordinary_user.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

void write_mask(const fs::path& file) {
  fs::create_directories(file.parent_path());
  ASSERT_TRUE(cv::imwrite(file.string(), cv::Mat(6, 8, CV_8UC1, cv::Scalar(1))));
}

MaskFolderOptions allowing_missing() {
  MaskFolderOptions options;
  options.allow_missing = true;
  return options;
}

void expect_refused(const fs::path& folder, const std::string& message) {
  for (const MaskFolderOptions& options : {MaskFolderOptions(), allowing_missing()}) {
    expect_error<std::runtime_error>([&] { MaskFolderSegmenter(folder, options); }, message);
  }
}

TEST(MaskFolderFiles, RefusesWhatIsNotAFile) {
  for (const char* name : {"instances.csv", "2.png"}) {
    const TemporaryFolder folder;
    write_mask(folder / "1.png");
    const fs::path file = folder / name;
    ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
    expect_refused(folder.path(), file.string() + ": is not a regular file");
    fs::remove(file);
    fs::create_directory(file);
    expect_refused(folder.path(), file.string() + ": is not a regular file");
  }
}

TEST(MaskFolderFiles, AcceptsSymbolicLinks) {
  const TemporaryFolder folder;
  write_mask(folder / "elsewhere" / "1.png");
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
  write_mask(masks / "1.png");
  fs::permissions(masks, fs::perms::none);
  {
    const OrdinaryUser user;
    ASSERT_TRUE(user.is_ordinary());
    expect_refused(
        masks,
        masks.string() + ": cannot be read: Permission denied; want a folder of masks (*.png)");
  }
  fs::permissions(masks, fs::perms::owner_all);
  fs::create_directory_symlink(folder / "loop", folder / "loop");
  expect_refused(folder / "loop", (folder / "loop").string() + ": cannot be read: ");
}

TEST(MaskFolderFiles, SkipsRowsOfMissingMasksOnRequest) {
  const TemporaryFolder folder;
  write_mask(folder / "1.png");
  folder.write("instances.csv", table_header + "1,1,0,0.9,0,0,4,5\n2,1,0,0.9,0,0,4,5\n");
  expect_error<std::runtime_error>([&] { MaskFolderSegmenter{folder.path()}; },
                                   "instances.csv:3: frame 2 has no mask 2.png");
  MaskFolderSegmenter people(folder.path(), allowing_missing());
  EXPECT_EQ(people.size(), 1U);
  EXPECT_TRUE(people.has_mask(1));
  EXPECT_FALSE(people.has_mask(2));
  EXPECT_EQ(people.segment(frame_at(1)).instances.size(), 1U);
  expect_error<std::runtime_error>([&] { people.segment(frame_at(2)); },
                                   "2.000000.png: there is no such mask; the nearest is 1.png");
}

TEST(MaskFolderFiles, AcceptsAnEmptyFolderOnRequest) {
  const TemporaryFolder folder;
  const auto expect_no_masks = [&] {
    MaskFolderSegmenter people(folder.path(), allowing_missing());
    EXPECT_EQ(people.size(), 0U);
    EXPECT_FALSE(people.has_mask(1));
    expect_error<std::runtime_error>([&] { people.segment(frame_at(1)); },
                                     "there is no such mask; the folder holds none");
  };
  expect_no_masks();
  folder.write("instances.csv", table_header + "1,1,0,0.9,0,0,4,5\n");
  expect_no_masks();
}

}  // namespace
}  // namespace dynfilter::testing
