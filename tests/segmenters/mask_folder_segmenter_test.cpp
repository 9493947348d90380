// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"

#include <thread>

#include "segmenters/mask_folder.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

/// Label map of 8x6 pixels: label 1 in a 2x2 block at (1,1), label 3 at (5,4).
cv::Mat some_labels(int type = CV_8UC1) {
  cv::Mat labels(6, 8, type, cv::Scalar(0));
  labels(cv::Rect(1, 1, 2, 2)).setTo(1);
  labels(cv::Rect(5, 4, 1, 1)).setTo(3);
  return labels;
}

// --- Label maps ----------------------------------------------------------------------------------

TEST(MaskFolderSegmenter, ReadsLabelMapsOf8And16Bits) {
  for (const int type : {CV_8UC1, CV_16UC1}) {
    const TemporaryFolder folder;
    write_mask(folder, "12.500000.png", some_labels(type));
    write_mask(folder, "13.png", cv::Mat(6, 8, CV_8UC1, cv::Scalar(0)));
    folder.write("instances.csv", table_header +
                                      "12.500000,1,0,0.909,0,0,4,5\r\n\r\n"
                                      "# label 2 is hidden by others\r\n"
                                      "12.5, 3, 56, 1, -2, 3, 100, 0\r\n"
                                      "12.500000,2,62,0.25,1,2,3,4\r\n"
                                      "12.500000,65535,2147483647,1,0,0,0,0\r\n");
    MaskFolderSegmenter people(folder.path().c_str());
    EXPECT_EQ(people.size(), 2U);
    EXPECT_TRUE(people.segment(frame_at(13)).instances.empty());  // no rows
    const Segmentation result = people.segment(frame_at(12.5));
    EXPECT_EQ(result.frame_id, 77U);
    EXPECT_EQ(result.timestamp_s, 12.5);
    EXPECT_EQ(result.image_size, cv::Size(8, 6));
    ASSERT_EQ(result.instances.size(), 4U);
    const Instance& first = result.instances[0];
    EXPECT_EQ(first.class_id, 0);
    EXPECT_EQ(first.score, 0.909F);
    EXPECT_EQ(first.box, cv::Rect(0, 0, 4, 5));
    EXPECT_EQ(cv::norm(full_mask(first, {8, 6}), some_labels() == 1, cv::NORM_INF), 0);
    EXPECT_FALSE(first.track_id);
    EXPECT_TRUE(result.instances[1].mask.empty());
    EXPECT_EQ(result.instances[1].class_id, 62);
    EXPECT_EQ(result.instances[1].box, cv::Rect(1, 2, 3, 4));
    EXPECT_EQ(result.instances[2].box, cv::Rect(-2, 3, 100, 0));
    EXPECT_TRUE(result.instances[2].covers({5, 4}));
  }
}

TEST(MaskFolderSegmenter, RefusesALabelWithoutARow) {
  const TemporaryFolder folder;
  write_mask(folder, "1.png", some_labels());
  folder.write("instances.csv", table_header + "1,1,0,0.9,0,0,4,5\n");
  MaskFolderSegmenter people(folder.path());
  expect_no_masks(people, 1, (folder / "1.png").string() + ": label 3 has no row in instances.csv");
}

TEST(MaskFolderSegmenter, RefusesMalformedTables) {
  const std::string good = "1.5,1,0,0.9,0,0,4,5\n";
  const struct {
    std::string text, message;
  } cases[] = {
      {"", ": is empty"},
      {good, ":1: got '1.5,1,0,0.9,0,0,4,5'; want the header frame,instance"},
      {"frame,instance\n", ":1: got 'frame,instance'; want the header"},
      {table_header + good + "1.5,2,0,0.9,0,0,4\n", ":3: got 7 columns; want frame,instance"},
      {table_header + "\r\nx,1,0,0.9,0,0,4,5\r\n", ":3: frame: got 'x'"},
      {table_header + "1.5,0,0,0.9,0,0,4,5\n",
       ":2: instance: got '0'; want a whole number from 1 to 65535"},
      {table_header + "1.5,1,person,0.9,0,0,4,5\n",
       ":2: class_id: got 'person'; want a whole number"},
      {table_header + "1.5,1,0,1.1,0,0,4,5\n", ":2: score: got '1.1'; want 0 to 1"},
      {table_header + "1.5,1,0,0.9,0,99999999999,4,5\n", ":2: y: got '99999999999'"},
      {table_header + "1.5,1,0,0.9,0,0,-4,5\n",
       ":2: width: got '-4'; want a whole number from 0 to"},
      {table_header + good + good, ":3: instance 1 of frame 1.5 is in an earlier line already"},
      {table_header + good + "1.6,1,0,0.9,0,0,4,5\n", ":3: frame 1.6 has no mask 1.6.png"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.text);
    const TemporaryFolder folder;
    write_mask(folder, "1.5.png", some_labels());
    const auto path = folder.write("instances.csv", c.text);
    expect_refused(folder.path(), path.string() + c.message);
  }
}

// --- Binary masks --------------------------------------------------------------------------------

TEST(MaskFolderSegmenter, FindsConnectedObjectsInBinaryMasks) {
  for (const int on : {1, 255, 256}) {  // the low byte of 256 is 0
    const TemporaryFolder folder;
    cv::Mat mask(60, 80, on > 255 ? CV_16UC1 : CV_8UC1, cv::Scalar(0));
    mask(cv::Rect(30, 25, 10, 5)).setTo(on);
    mask(cv::Rect(70, 50, 2, 2)).setTo(on);
    write_mask(folder, "3.25.png", mask);
    MaskFolderSegmenter people(folder.path());
    const Segmentation all = people.segment(frame_at(3.25, mask.size()));
    EXPECT_EQ(people.values(), std::vector<int>{on});
    ASSERT_EQ(all.instances.size(), 2U);
    EXPECT_EQ(all.instances[0].class_id, 0);
    EXPECT_EQ(all.instances[0].score, 1);
    EXPECT_EQ(all.instances[0].box, cv::Rect(10, 5, 50, 45));
    EXPECT_EQ(all.instances[1].box, cv::Rect(50, 30, 30, 30));
    EXPECT_EQ(cv::countNonZero(all.instances[1].mask), 4);
  }
}

// --- Matching ------------------------------------------------------------------------------------

TEST(MaskFolderSegmenter, FindsTheNearestMaskWithinAMillisecond) {
  const TemporaryFolder folder;
  const auto mask_with = [](int pixels) {
    cv::Mat mask(6, 8, CV_8UC1, cv::Scalar(0));
    mask(cv::Rect(0, 0, pixels, 1)).setTo(255);
    return mask;
  };
  write_mask(folder, "1341846434.710184.png", mask_with(1));
  write_mask(folder, "1341846434.711384.png", mask_with(2));
  write_mask(folder, "1341846435.png", mask_with(3));
  folder.write("readme.txt", "not a mask");
  MaskFolderSegmenter people(folder.path());
  EXPECT_EQ(people.size(), 3U);
  const auto pixels_at = [&](double time_s) {
    return cv::countNonZero(people.segment(frame_at(time_s)).instances.at(0).mask);
  };
  EXPECT_EQ(pixels_at(1341846434.710184), 1);
  EXPECT_EQ(pixels_at(1341846434.709184), 1);
  EXPECT_EQ(pixels_at(1341846434.710784), 1);  // a tie goes to the earlier one
  EXPECT_EQ(pixels_at(1341846434.710785), 2);
  EXPECT_EQ(pixels_at(1341846435.001), 3);
  EXPECT_EQ(pixels_at(1341846434.999), 3);
  expect_no_masks(people, 1341846434.709183,
                  (folder / "1341846434.709183.png").string() +
                      ": there is no such mask; the nearest is 1341846434.710184.png");
  expect_no_masks(people, 1341846435.001001, "the nearest is 1341846435.png");
  expect_misuse([&] { people.segment(frame_at(1e18)); }, "want seconds");
  for (const double seconds : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    expect_misuse([&] { MaskFolderSegmenter(folder.path(), {seconds}); }, "want at least 0");
  }
}

/// One mask, 2x2 at (1,1), in every form and under every name that other tools write.
TEST(MaskFolderSegmenter, ReadsMasksOfOtherTools) {
  cv::Mat mask = some_labels() == 1;
  cv::Mat none(mask.size(), CV_8UC1, cv::Scalar(0)), all(mask.size(), CV_8UC1, cv::Scalar(255));
  const auto merged = [](const std::vector<cv::Mat>& channels) {
    cv::Mat image;
    cv::merge(channels, image);
    return image;
  };
  cv::Mat larger;
  cv::resize(mask, larger, {}, 3, 3, cv::INTER_NEAREST);
  const struct {
    const char* name;
    cv::Mat image;
  } cases[] = {
      {"1.5_mask.png", mask},
      {"mask_1.5.png", mask},
      {"1.5.png.png", mask},
      {"1.5.JPG.PNG", mask},
      {"1500000000500000000.png", mask},  // nanoseconds
      {"000007.png", mask},               // by the name of the frame
      {"left 7.png", mask},
      {"left_mask.png", mask},
      {"img.jpg.png", mask},
      {"1.5.png", larger},
      {"1.5.png", merged({mask, mask, mask})},
      {"1.5.png", merged({mask, mask, mask, all})},
      {"1.5.png", merged({all, all, all, mask})},
      {"1.5.png", merged({none, none, none, mask})},
      {"1.5.png", merged({mask, mask, mask, mask})},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const TemporaryFolder folder;
    std::vector<unsigned char> bytes;
    cv::imencode(".png", c.image, bytes);
    folder.write(c.name, std::string(bytes.begin(), bytes.end()));
    MaskFolderOptions options;
    options.frame_times = {{"000007", 1.5}, {"left 7", 1.5}, {"left_mask", 1.5}, {"img.jpg", 1.5}};
    MaskFolderSegmenter people(folder.path(), options);
    const double time_s = c.name[1] == '5' ? 1500000000.5 : 1.5;
    const Segmentation result = people.segment(frame_at(time_s, {8, 6}));
    ASSERT_EQ(result.instances.size(), 1U);
    EXPECT_EQ(cv::norm(full_mask(result.instances[0], {8, 6}), mask, cv::NORM_INF), 0);
  }
}

/// The pixels 0 1 2 / 3 0 3 with 2, 4 and 8 bits and a palette whose colours are all the same.
TEST(MaskFolderSegmenter, ReadsTheIndicesOfAPalette) {
  const std::string files[] = {
      "89504e470d0a1a0a0000000d4948445200000003000000020203000000e01a8e890000000c504c5445070707"
      "070707070707070707c70d4b4d0000000c4944415478da639060380300011800e5c255e60d0000000049454e"
      "44ae426082",
      "89504e470d0a1a0a0000000d49484452000000030000000204030000006f5a7b290000000c504c5445070707"
      "070707070707070707c70d4b4d0000000e4944415478da6360546030300000011b0082a0f26a730000000049"
      "454e44ae426082",
      "89504e470d0a1a0a0000000d4948445200000003000000020803000000aaaa96280000000c504c5445070707"
      "070707070707070707c70d4b4d000000104944415478da636060646260666006000024000a2acec2ba000000"
      "0049454e44ae426082",
  };
  for (const std::string& hex : files) {
    SCOPED_TRACE(hex);
    std::string bytes;
    for (std::size_t i = 0; i < hex.size(); i += 2) {
      bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
    }
    const TemporaryFolder folder;
    folder.write("1.png", bytes);
    MaskFolderSegmenter binary(folder.path());
    EXPECT_EQ(cv::countNonZero(binary.segment(frame_at(1, {3, 2})).instances.at(0).mask), 4);
    folder.write("instances.csv",
                 table_header + "1,1,0,1,0,0,9,9\n1,2,0,1,0,0,9,9\n1,3,0,1,0,0,9,9\n");
    const Segmentation result = MaskFolderSegmenter(folder.path()).segment(frame_at(1, {3, 2}));
    ASSERT_EQ(result.instances.size(), 3U);
    EXPECT_EQ(result.instances[1].mask_origin, cv::Point(2, 0));
    EXPECT_EQ(cv::countNonZero(full_mask(result.instances[2], {3, 2})), 2);
    folder.write("1.png", bytes.substr(0, bytes.size() - 12));
    expect_failure([&] { MaskFolderSegmenter(folder.path()).segment(frame_at(1)); },
                   "1.png: cannot be decoded");
  }
}

TEST(MaskFolderSegmenter, RefusesNumbersForTimes) {
  for (const auto& names : {std::vector<const char*>{"000000", "000005"},
                            {"1", "2", "3", "4"},
                            {"00_mask"},
                            {"7.png", "8.png", "6.png"}}) {
    const TemporaryFolder folder;
    for (const char* name : names) write_mask(folder, std::string(name) + ".png", some_labels());
    expect_refused(folder.path(), "look numbered; want names by the frames' times",
                   allowing_missing());
  }
}

TEST(MaskFolderSegmenter, SaysWhatAFolderHoldsInPlaceOfMasks) {
  const TemporaryFolder folder;
  for (const char* name : {"1.jpg", "2.JPG", "3.npy"}) folder.write(name, "");
  fs::create_directory(folder / "person");
  expect_refused(folder.path(), "directly in it, but 2 .jpg files and 1 .npy file and 1 folder",
                 allowing_missing());
}

TEST(MaskFolderSegmenter, RefusesFoldersWithoutMasks) {
  const TemporaryFolder folder;
  expect_refused(folder / "none", "none: there is no such folder");
  expect_refused(folder.path(), folder.path().string() + ": holds no mask; want <time>.png");
  write_mask(folder, "1.5.png", some_labels());
  write_mask(folder, "1.50.png", some_labels());
  expect_refused(folder.path(), "has the same time as");
  fs::remove(folder / "1.50.png");
  write_mask(folder, "preview.png", some_labels());
  expect_refused(folder.path(), (folder / "preview.png").string() + ": the name of a mask");
}

TEST(MaskFolderSegmenter, RefusesMasksThatDoNotFit) {
  const TemporaryFolder folder;
  write_mask(folder, "1.png", some_labels());
  MaskFolderSegmenter people(folder.path());
  expect_failure(
      [&] {
        people.segment(frame_at(1, {12, 6}));
      },
      (folder / "1.png").string() + ": 8x6 pixels, but the frame has 12x6");
  write_mask(folder, "1.png", cv::Mat(6, 8, CV_8UC3, cv::Scalar(255, 255, 254)));
  expect_no_masks(people, 1, "1.png: a mask in colours; want one channel");
  const std::string bytes = file_text(folder / "1.png");
  folder.write("1.png", bytes.substr(0, bytes.size() / 2));
  expect_no_masks(people, 1, "cannot be decoded");
  fs::remove(folder / "1.png");
  expect_no_masks(people, 1, "1.png: there is no such file");
}

TEST(MaskFolderSegmenter, ScalesTheBoxesOfATableWithItsMasks) {
  const TemporaryFolder folder;
  write_mask(folder, "1.png", some_labels());
  folder.write("instances.csv", table_header +
                                    "1,1,0,0.9,1,1,2,2\n1,2,0,0.9,-3,0,2147483647,3\n"
                                    "1,3,0,0.9,5,4,1,1\n");
  MaskFolderSegmenter people(folder.path());
  const Segmentation result = people.segment(frame_at(1, {24, 18}));
  EXPECT_EQ(result.image_size, cv::Size(24, 18));
  EXPECT_EQ(result.instances.at(0).box, cv::Rect(3, 3, 6, 6));
  EXPECT_EQ(result.instances.at(0).mask.size(), cv::Size(6, 6));
  EXPECT_EQ(result.instances.at(1).box, cv::Rect(-9, 0, 2147483647, 9));
  EXPECT_EQ(people.segment(frame_at(1, {4, 3})).instances.at(2).box, cv::Rect(3, 2, 1, 1));
}

TEST(MaskFolderSegmenter, RefusesALargeMaskBeforeItIsDecoded) {
  const TemporaryFolder folder;
  write_mask(folder, "1.png", cv::Mat(24576 / 8, 32768 / 8, CV_8UC1, cv::Scalar(1)));
  MaskFolderSegmenter people(folder.path());
  expect_no_masks(people, 1, "1.png: 4096x3072 pixels; want at most 4 times the frame's 8x6");
}

/// The thread sanitizer sees a reader that writes.
TEST(MaskFolderSegmenter, SeveralThreadsReadAtOnce) {
  const TemporaryFolder folder;
  for (int k = 0; k < 8; ++k) {
    write_mask(folder, std::to_string(1.5 + k) + ".png", cv::Mat(6, 8, CV_8UC1, cv::Scalar(k + 1)));
  }
  MaskFolderSegmenter people(folder.path());
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int k = 0; k < 8; ++k) {
        EXPECT_EQ(people.segment(frame_at(1.5 + k)).instances.size(), 1U);
      }
    });
  }
  EXPECT_EQ(people.values(), (std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8}));
  for (std::thread& thread : threads) thread.join();
}

// --- Recorded masks ------------------------------------------------------------------------------

class MaskFolderData : public testing::RecordedData {};

TEST_F(MaskFolderData, ReadsTheMasksOfWalkingHalfsphere) {
  const fs::path masks = data("tum_fr3_walking_halfsphere_50") / "masks";
  MaskFolderSegmenter people(masks);
  EXPECT_EQ(people.size(), 49U);
  std::size_t instances = 0, persons = 0, without_pixels = 0;
  for (const auto& file : fs::directory_iterator(masks)) {
    if (file.path().extension() != ".png") continue;
    const double time_s = std::stod(file.path().stem().string());
    const Segmentation result = people.segment(frame_at(time_s, {640, 480}));
    for (const Instance& instance : result.instances) {
      ++instances;
      persons += instance.class_id == 0 ? 1 : 0;
      without_pixels += instance.mask.empty() ? 1 : 0;
      const cv::Rect mask(instance.mask_origin, instance.mask.size());
      EXPECT_EQ(mask & instance.box, mask);
    }
  }
  EXPECT_EQ(instances, 299U);
  EXPECT_EQ(persons, 93U);
  EXPECT_EQ(without_pixels, 1U);
  const Segmentation first = people.segment(frame_at(1341846434.710184, {640, 480}));
  EXPECT_EQ(first.instances.at(0).box, cv::Rect(42, 204, 200, 273));
  EXPECT_EQ(first.instances.at(0).score, 0.909F);
}

}  // namespace
}  // namespace dynfilter::testing
