// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Readers, writers and measures after a call with a failed allocation: never a wrong number, never
// half a file.

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include <functional>
#include <string>
#include <vector>

#include "dynfilter/evaluation/association.hpp"
#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/answer.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

const char* const camera_text =
    "%YAML:1.0\n# a comment that is longer than a short string\nCamera.fx: 500.125\n"
    "Camera.fy: 600.25\nCamera.cx: 300.5\nCamera.cy: 200.5\nCamera.fps: 30.0\n"
    "DepthMapFactor: 1000.0\n";

Trajectory trajectory(int poses, double bend) {
  Trajectory made;
  for (int i = 0; i < poses; ++i) {
    TimedPose pose;
    pose.timestamp_s = 1341846434.5 + i;
    pose.translation = {0.1 * i, bend * i * i, 0};
    made.push_back(pose);
  }
  return made;
}

/// Folder with a sequence, masks and a trajectory.
class FilesWithoutMemory : public ::testing::Test {
 protected:
  FilesWithoutMemory() {
    for (const char* name : {"rgb", "depth", "masks"}) fs::create_directories(folder_ / name);
    std::string rows = "# time, image, time, depth image\n";
    for (int k = 1; k <= 3; ++k) {
      const std::string time = std::to_string(1341846434 + k) + ".710184";
      const std::string file = "/" + time + ".png";
      cv::imwrite((folder_ / ("rgb" + file)).string(), cv::Mat(6, 8, CV_8UC3, cv::Scalar(k, 2, 3)));
      cv::imwrite((folder_ / ("depth" + file)).string(), cv::Mat(6, 8, CV_16UC1, cv::Scalar(k)));
      cv::imwrite((folder_ / ("masks" + file)).string(), cv::Mat(6, 8, CV_8UC1, cv::Scalar(1)));
      rows += time + " rgb" + file + " " + time + " depth" + file + "\n";
    }
    folder_.write("associations.txt", rows);
    folder_.write("camera.yaml", camera_text);
    folder_.write("masks/instances.csv",
                  "frame,instance,class_id,score,x,y,width,height\n"
                  "1341846435.710184,1,0,0.875,1,1,4,4\n1341846436.710184,1,0,0.5,1,1,4,4\n");
    write_trajectory(folder_ / "groundtruth.txt", trajectory(12, 0.01));
  }
  void SetUp() override { cv::setNumThreads(1); }  // allocations fail only in this thread
  void TearDown() override { cv::setNumThreads(-1); }

  /// Lets a call that keeps nothing fail, see expect_right_answers.
  template <class Call>
  void expect_right(std::size_t min_failures, const Call& call) {
    EXPECT_GE(expect_right_answers([&] { return call; }), min_failures);
  }

  TemporaryFolder folder_;
};

Answer answer_of(const Trajectory& poses) {
  Answer answer;
  for (const TimedPose& pose : poses) {
    answer.add(pose.timestamp_s).add(pose.translation.sum()).add(pose.rotation.sum());
  }
  return answer.add(static_cast<double>(poses.size()));
}

TEST_F(FilesWithoutMemory, TrajectoriesAreReadWhole) {
  expect_right(20, [&] { return answer_of(read_trajectory(folder_ / "groundtruth.txt")); });
}

TEST_F(FilesWithoutMemory, CamerasAreReadWhole) {
  expect_right(20, [&] {
    const CameraParameters camera = read_camera(folder_ / "camera.yaml");
    return Answer().add(camera.fx).add(camera.fy).add(camera.cx).add(camera.cy).add(
        camera.frames_per_second);
  });
}

TEST_F(FilesWithoutMemory, SequencesAreReadWhole) {
  expect_right(50, [&] {
    const RgbdSequence sequence(folder_.path());
    Answer answer;
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const FrameView frame = sequence.read(i);
      answer.add(frame.timestamp_s).add(frame.image).add(frame.depth);
    }
    return answer;
  });
}

/// The folder is listed before: where a std::filesystem::directory_iterator runs out of memory,
/// libstdc++ ends the program.
TEST_F(FilesWithoutMemory, MasksAreReadWhole) {
  MaskFolderSegmenter masks(folder_ / "masks");
  expect_right(10, [&] {
    FrameView frame;
    frame.timestamp_s = 1341846436.710184;
    frame.image = cv::Mat(6, 8, CV_8UC3, cv::Scalar::all(0));
    const Segmentation segmentation = masks.segment(frame);
    return Answer().add(segmentation.timestamp_s).add(segmentation.instances);
  });
}

TEST_F(FilesWithoutMemory, ErrorsOfTrajectoriesAreRight) {
  const Trajectory truth = trajectory(12, 0.01), estimate = trajectory(12, 0.02);
  expect_right(5, [&] {
    const AbsoluteTrajectoryError error = absolute_trajectory_error(estimate, truth);
    return Answer().add(error.errors_m).add(error.timestamps_s).add(error.translation_m.rmse);
  });
  expect_right(3, [&] {
    const RelativePoseError error = relative_pose_error(estimate, truth);
    return Answer()
        .add(error.timestamps_s)
        .add(error.translation_m.rmse)
        .add(error.rotation_deg.rmse);
  });
  expect_right(5, [&] {
    Answer answer;
    for (const auto& [i, k] : associate({1, 2, 3, 4}, {4.01, 1.01, 2.99}, 0.1)) {
      answer.add(static_cast<double>(i)).add(static_cast<double>(k));
    }
    return answer;
  });
}

/// Lets a writer fail at each allocation. The file is the earlier one, or the new one if the writer
/// returned.
void expect_whole_file(const fs::path& file, const std::function<void()>& earlier,
                       const std::function<void()>& later) {
  later();
  const std::string new_text = file_text(file);
  earlier();
  const std::string old_text = file_text(file);
  ASSERT_NE(old_text, new_text);
  const std::size_t failures = for_each_failing_allocation([&](const std::size_t n) {
    earlier();
    bool has_returned = false;
    const bool has_failed = fails_at_allocation(n, [&] {
      try {
        later();
        has_returned = true;
      } catch (const std::runtime_error&) {
        if (!FailingAllocation::has_failed()) throw;
      }
    });
    EXPECT_EQ(file_text(file), has_returned ? new_text : old_text) << "allocation " << n;
    later();
    EXPECT_EQ(file_text(file), new_text) << "after allocation " << n << " failed";
    return has_failed && !::testing::Test::HasFailure();
  });
  EXPECT_GT(failures, 5U);
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(file.parent_path())) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  EXPECT_EQ(files, 1U) << "a temporary file is left";
}

TEST_F(FilesWithoutMemory, FilesAreWrittenWhole) {
  const fs::path file = folder_ / "written/file";
  fs::create_directories(file.parent_path());
  expect_whole_file(
      file, [&] { write_trajectory(file, trajectory(3, 0)); },
      [&] { write_trajectory(file, trajectory(4, 0.25)); });
  CameraParameters camera = read_camera(folder_ / "camera.yaml");
  CameraParameters other = camera;
  other.fx = 1.0 / 3;
  expect_whole_file(
      file, [&] { write_camera(file, camera); }, [&] { write_camera(file, other); });
}

}  // namespace
}  // namespace dynfilter::testing
