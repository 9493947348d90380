// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/rgbd_sequence.hpp"

#include "dynfilter/evaluation/association.hpp"
#include "evaluation/sequence_folder.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

// --- Folders -------------------------------------------------------------------------------------

TEST(RgbdSequence, ReadsAssociations) {
  const TemporaryFolder folder;
  write_images(folder, 3);
  folder.write("associations.txt",
               "# any order; differences as they are\r\n"
               "3.5 rgb/3.5.png 3.51 depth/3.51.png\r\n\r\n"
               "1.5 rgb/1.5.png 9.25\tdepth/1.51.png\r\n");
  const RgbdSequence sequence(folder.path());
  ASSERT_EQ(sequence.size(), 2U);
  EXPECT_TRUE(sequence.has_depth());
  EXPECT_EQ(sequence.camera().fx, 5);
  EXPECT_EQ(sequence.folder(), folder.path());
  const RgbdSequenceEntry& first = sequence.entry(0);
  EXPECT_EQ(first.timestamp_s, 1.5);
  EXPECT_EQ(first.depth_timestamp_s, 9.25);
  EXPECT_EQ(first.image_path, folder / "rgb/1.5.png");
  EXPECT_EQ(first.depth_path, folder / "depth/1.51.png");
  EXPECT_EQ(first.stem, "1.5");

  const FrameView frame = sequence.read(1);
  EXPECT_EQ(frame.id, 1U);
  EXPECT_EQ(frame.timestamp_s, 3.5);
  EXPECT_EQ(frame.metres_per_unit, 1e-3);
  ASSERT_EQ(frame.image.type(), CV_8UC3);
  EXPECT_EQ(frame.image.at<cv::Vec3b>(3, 5), cv::Vec3b(30, 20, 30));
  ASSERT_EQ(frame.depth.type(), CV_16UC1);
  EXPECT_EQ(frame.depth_m({5, 3}), 3.0);
  EXPECT_NO_THROW(validate(frame, "test"));
}

TEST(RgbdSequence, AssociatesListsWithoutAnAssociationsFile) {
  const TemporaryFolder folder;
  write_images(folder, 3);
  folder.write("rgb.txt",
               "# color\n2.5 rgb/2.5.png\n1.5 rgb/1.5.png\n7 rgb/unpaired_and_missing.png\n");
  folder.write("depth.txt", "1.51 depth/1.51.png\n2.51 depth/2.51.png\n3.51 depth/3.51.png\n");
  const RgbdSequence sequence(folder.path());
  ASSERT_EQ(sequence.size(), 2U);
  EXPECT_EQ(sequence.entry(0).stem, "1.5");
  EXPECT_EQ(sequence.entry(0).depth_path.filename(), "1.51.png");
  EXPECT_EQ(sequence.entry(1).depth_timestamp_s, 2.51);

  RgbdSequenceOptions options;
  options.max_time_difference_s = 0.005;
  expect_failure([&] { RgbdSequence(folder.path(), options); },
                 "no image of rgb.txt and depth.txt lie 0.005 s apart");
}

TEST(RgbdSequence, ReadsColourWithoutDepth) {
  const TemporaryFolder folder;
  write_images(folder, 2);
  folder.write("rgb.txt", "2.5 rgb/2.5.png\n1.5 rgb/1.5.png\n");
  folder.write("camera.yaml", camera_yaml.substr(0, camera_yaml.find("DepthMapFactor")));
  expect_failure([&] { RgbdSequence{folder.path()}; }, "camera.yaml: DepthMapFactor is missing");
  fs::remove_all(folder / "depth");
  EXPECT_EQ(RgbdSequence(folder.path()).camera().fx, 5);
  fs::remove(folder / "camera.yaml");
  const RgbdSequence sequence(folder.path());
  ASSERT_EQ(sequence.size(), 2U);
  EXPECT_EQ(sequence.camera().fx, 0);
  EXPECT_FALSE(sequence.has_depth());
  EXPECT_TRUE(sequence.entry(0).depth_path.empty());
  EXPECT_EQ(sequence.entry(0).depth_timestamp_s, 1.5);
  EXPECT_FALSE(sequence.read(0).image.empty());
  EXPECT_TRUE(sequence.read(0).depth.empty());
}

TEST(RgbdSequence, FindsGroundTruthAndMasks) {
  const TemporaryFolder folder;
  write_images(folder, 1);
  folder.write("rgb.txt", "1.5 rgb/1.5.png\n");
  const RgbdSequence sequence(folder.path());
  EXPECT_FALSE(sequence.groundtruth_file());
  EXPECT_FALSE(sequence.masks_folder());
  EXPECT_FALSE(sequence.true_masks_folder());
  EXPECT_FALSE(sequence.moving_masks_folder());
  folder.write("groundtruth.txt", "");
  folder.write("masks/a", "");
  folder.write("masks_true/a", "");
  folder.write("masks_moving/a", "");
  EXPECT_EQ(sequence.groundtruth_file(), folder / "groundtruth.txt");
  EXPECT_EQ(sequence.masks_folder(), folder / "masks");
  EXPECT_EQ(sequence.true_masks_folder(), folder / "masks_true");
  EXPECT_EQ(sequence.moving_masks_folder(), folder / "masks_moving");
}

TEST(RgbdSequence, PrintsATemplateForAMissingCameraFile) {
  const TemporaryFolder folder;
  write_images(folder, 1);
  folder.write("associations.txt", "1.5 rgb/1.5.png 1.51 depth/1.51.png\n");
  fs::remove(folder / "camera.yaml");
  std::string message;
  try {
    RgbdSequence{folder.path()};
  } catch (const std::runtime_error& error) {
    message = error.what();
  }
  EXPECT_EQ(message.find((folder / "camera.yaml").string() + ": there is no such camera file"), 0U);
  EXPECT_NE(message.find("freiburg3"), std::string::npos);
  EXPECT_NE(message.find("--camera tum3"), std::string::npos);
  EXPECT_NE(message.find("replace them"), std::string::npos);
  // The printed template is a valid file.
  folder.write("other.yaml", message.substr(message.find("%YAML")));
  RgbdSequenceOptions options;
  options.camera_file = folder / "other.yaml";
  const SequenceCamera camera = RgbdSequence(folder.path(), options).camera();
  EXPECT_EQ(camera.fx, 535.4);
  EXPECT_EQ(camera.fy, 539.2);
  EXPECT_EQ(camera.cx, 320.1);
  EXPECT_EQ(camera.cy, 247.6);
  EXPECT_EQ(camera.depth_units_per_metre, 5000);
}

TEST(RgbdSequence, RefusesMalformedLists) {
  const std::string good = "1.5 rgb/1.5.png 1.51 depth/1.51.png\n";
  const struct {
    std::string file, text, message;
  } cases[] = {
      {"associations.txt", "# only\n\n", ": lists no pair"},
      {"associations.txt", good + "\r\n2.5 rgb/2.5.png 2.51\r\n", ":3: got 3 columns; want 4"},
      {"associations.txt", good + "x rgb/2.5.png 2 depth/2.51.png\n", ":2: time: got 'x'"},
      {"associations.txt", good + good, ":2: time 1.500000 is in line 1 already"},
      {"associations.txt", good + "2.5 rgb/9.png 2.5 depth/2.51.png\n3 rgb/3.png 3 depth/3.png\n",
       ":2: rgb/9.png is missing (3 of the 6 image files of the sequence are)"},
      {"associations.txt", good + "2.5 rgb/2.5.png 2.5 depth\n", ":2: depth is missing (1 of"},
      {"rgb.txt", "", ": lists no image"},
      {"rgb.txt", "1.5 rgb/1.5.png\n1.5\n", ":2: got 1 columns; want 2"},
      {"rgb.txt", "1.5 rgb/1.5.png\n2.5 rgb/a.png\n", ":2: rgb/a.png is missing (1 of the 4"},
      {"depth.txt", "", ": lists no image"},
      {"depth.txt", "1.51 depth/1.51.png\n1.51 depth/2.51.png\n", ":2: time 1.510000 is in line 1"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.file + " with " + c.text);
    const TemporaryFolder folder;
    write_images(folder, 2);
    if (c.file == "depth.txt") folder.write("rgb.txt", "1.5 rgb/1.5.png\n");
    const auto path = folder.write(c.file, c.text);
    expect_failure([&] { RgbdSequence{folder.path()}; }, path.string() + c.message);
  }
}

TEST(RgbdSequence, RefusesFoldersWithoutASequence) {
  const TemporaryFolder folder;
  expect_failure([&] { RgbdSequence(folder / "none"); }, "none: there is no such folder");
  expect_failure([&] { RgbdSequence{folder.path()}; }, "neither associations.txt nor rgb.txt");
  RgbdSequenceOptions options;
  options.max_time_difference_s = -1;
  expect_misuse([&] { RgbdSequence(folder.path(), options); }, "max_time_difference_s = -1");
}

// --- Association ---------------------------------------------------------------------------------

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Oracle: repeatedly takes the best pair of unused times until none is within the limit.
Pairs associate_by_search(const std::vector<double>& a, const std::vector<double>& b,
                          double max_difference_s) {
  const auto micro = [](double s) { return std::llround(s * 1e6); };
  std::vector<bool> a_used(a.size()), b_used(b.size());
  Pairs pairs;
  while (true) {
    auto best = std::make_tuple(micro(max_difference_s) + 1, 0LL, 0LL);
    std::pair<std::size_t, std::size_t> found(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j < b.size(); ++j) {
        if (a_used[i] || b_used[j]) continue;
        const auto candidate =
            std::make_tuple(std::abs(micro(a[i]) - micro(b[j])), micro(a[i]), micro(b[j]));
        if (candidate < best) {
          best = candidate;
          found = {i, j};
        }
      }
    }
    if (found.first == a.size()) break;
    a_used[found.first] = b_used[found.second] = true;
    pairs.push_back(found);
  }
  std::sort(pairs.begin(), pairs.end(), [&](const auto& p, const auto& q) {
    return std::pair(a[p.first], p.first) < std::pair(a[q.first], q.first);
  });
  return pairs;
}

std::vector<double> random_times(std::mt19937& random, int count, double step) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {  // on a coarse grid, so that there are ties and equal times
    times.push_back(1341846434 + step * static_cast<double>(random() % 200));
  }
  return times;
}

TEST(Associate, MatchesBruteForce) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 300; ++trial) {
    const double step = trial % 2 == 0 ? 0.005 : 0.000733;
    const auto a = random_times(random, static_cast<int>(random() % 30), step);
    const auto b = random_times(random, static_cast<int>(random() % 30), step);
    const double limit = trial % 5 == 0 ? 0 : 0.02;
    EXPECT_EQ(associate(a, b, limit), associate_by_search(a, b, limit)) << "trial " << trial;
  }
}

/// All of them are within the limit of each other; or all are equal.
TEST(Associate, MemoryGrowsWithTheTimesAndNotWithThePairs) {
  constexpr std::size_t count = 300000;
  for (const double step_s : {1e-6, 0.0}) {
    std::vector<double> times_s;
    for (std::size_t i = 0; i < count; ++i) {
      times_s.push_back(1700000000 + step_s * static_cast<double>(i));
    }
    const long before = peak_memory_mb();
    EXPECT_EQ(associate(times_s, times_s, 0.02).size(), count);
    EXPECT_LT(peak_memory_mb() - before, 500);
  }
}

TEST(Associate, PicksTheBestPairFirst) {
  // 1.010 is nearer to the depth than 1.000 is, which then gets no partner.
  EXPECT_EQ(associate({1.000, 1.010}, {1.011}, 0.02), (Pairs{{1, 0}}));
  // A tie goes to the earlier time of the first list, then of the second.
  EXPECT_EQ(associate({1.02, 1.00}, {1.01}, 0.02), (Pairs{{1, 0}}));
  EXPECT_EQ(associate({1.01}, {1.02, 1.00}, 0.02), (Pairs{{0, 1}}));
}

TEST(Associate, RefusesInvalidTimesAndLimits) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_misuse([&] { associate({nan}, {1}, 0.02); }, "finite times");
  expect_misuse([&] { associate({1}, {1.4e18}, 0.02); }, "in seconds");
  expect_misuse([&] { associate({1}, {1}, -1); }, "max_difference_s = -1");
  expect_misuse([&] { associate({1}, {1}, nan); }, "max_difference_s = nan");
  EXPECT_TRUE(associate({}, {}, 0.02).empty());
}

}  // namespace
}  // namespace dynfilter::testing
