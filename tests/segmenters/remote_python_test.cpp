// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// RemoteSegmenter with the Python peer in examples/remote_masks, and the peer's own tests.

#include "dynfilter/segmenters/remote_segmenter.hpp"

#include <unistd.h>

#include <iostream>

#include "dynfilter/dynamic_filter.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

const std::string python = DYNFILTER_PYTHON;
const std::string sources = DYNFILTER_SOURCE_DIR;
const std::string file = sources + "/examples/remote_masks/threshold.py";

/// The example, which runs while this object lives.
class Script : public ChildProcess {
 public:
  explicit Script(const fs::path& socket)
      : ChildProcess([&] {
          signal(SIGINT, SIG_DFL);  // a shell ignores it in what runs in the background
          execl(python.c_str(), python.c_str(), "-B", file.c_str(), socket.c_str(),
                static_cast<char*>(nullptr));
          _exit(127);
        }) {}
};

class RemotePython : public ::testing::Test {
 protected:
  void SetUp() override {
    if (python.empty()) GTEST_SKIP() << "CMake found no python3 with NumPy";
  }

  /// Options that wait until Python listens.
  static RemoteSegmenterOptions patient() {
    RemoteSegmenterOptions options;
    options.timeout_s = 60;
    options.retry_interval_s = 0.01;
    return options;
  }

  static FrameView frame_of(int first_pixel) {
    FrameView frame;
    frame.id = 1ULL << 63U;
    frame.timestamp_s = 12.5;
    frame.image = cv::Mat(20, 30, CV_8UC3, cv::Scalar::all(first_pixel));
    return frame;
  }

  TemporaryFolder folder;
  fs::path path = folder / "masks.sock";
};

/// Tells whether a pixel is brighter than 128, on average over the channels: the example's rule.
bool is_bright(const cv::Mat& image, int y, int x) {
  const std::uint8_t* pixel = image.ptr(y, x);
  int sum = 0;
  for (int channel = 0; channel < image.channels(); ++channel) sum += pixel[channel];
  return sum > 128 * image.channels();
}

TEST_F(RemotePython, ExampleFindsBrightObjects) {
  const Script script(path);
  RemoteSegmenter people(path, patient());
  for (const int type : {CV_8UC1, CV_8UC3}) {
    FrameView frame;
    frame.image = cv::Mat(48, 64, type, cv::Scalar::all(0));
    cv::Mat object = frame.image({20, 10, 17, 23});
    cv::randu(object, 0, 256);
    const Segmentation found = people.segment(frame);
    ASSERT_EQ(found.instances.size(), 1U);
    const Instance& instance = found.instances[0];
    EXPECT_EQ(instance.class_id, 0);
    EXPECT_EQ(instance.score, 1.0F);
    EXPECT_EQ(instance.box, cv::Rect(instance.mask_origin, instance.mask.size()));
    for (int y = 0; y < frame.image.rows; ++y) {
      for (int x = 0; x < frame.image.cols; ++x) {
        ASSERT_EQ(instance.covers({x, y}), is_bright(frame.image, y, x)) << x << "," << y;
      }
    }
  }
  EXPECT_TRUE(people.segment(frame_of(0)).instances.empty());
}

TEST_F(RemotePython, RemovesItsSocketWhenInterrupted) {
  Script script(path);
  RemoteSegmenter people(path, patient());
  people.segment(frame_of(9));
  script.stop(SIGINT);
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(RemotePython, TheHostOfThePageGoesOnWithoutAServer) {
  const DynamicFilter filter;
  const std::vector<cv::KeyPoint> keypoints(3, cv::KeyPoint(5, 5, 7));
  RemoteSegmenter people(path);
  const FrameView frame = frame_of(1);
  // The page prints what follows; remote_masks_test.py compares it.
  std::optional<dynfilter::Segmentation> masks;  // none: the features of this frame stay
  try {
    masks = people.segment(frame);
  } catch (const std::runtime_error& error) {  // the server is gone, late, or failed
    std::cerr << error.what() << '\n';
  }
  const auto labels = filter.apply(frame, masks, keypoints);
  // The page prints what stands above.
  EXPECT_FALSE(masks);
  EXPECT_EQ(labels.statistics().kept(), 3U);
}

TEST_F(RemotePython, PythonTestsPass) {
  const std::string tests = sources + "/tests/segmenters/remote_masks_test.py";
  EXPECT_EQ(std::system(("'" + python + "' -B '" + tests + "'").c_str()), 0);
}

}  // namespace
}  // namespace dynfilter::testing
