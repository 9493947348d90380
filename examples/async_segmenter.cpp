// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A network of 10 Hz beside a tracker of 30 Hz that never waits for it. Prints a line for each
// frame with the age of the masks; returns 1 if masks came for a frame that was not submitted yet,
// or a frame got lost.

#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/segmenters/async_segmenter.hpp>
#include <opencv2/features2d.hpp>
#include "lab/scenes/synthetic_scene.hpp"

class Tracker {
 public:
  explicit Tracker(std::unique_ptr<dynfilter::Segmenter> network) : people_(std::move(network)) {}

  dynfilter::FrameStatistics track(const dynfilter::FrameView& frame) {
    people_.submit(frame);  // the network begins with it, or takes it next

    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    orb_->detectAndCompute(frame.image, cv::noArray(), keypoints, descriptors);

    const std::optional<dynfilter::Segmentation> masks = people_.collect(frame.id);
    const auto labels = filter_.apply(frame, masks, keypoints);
    dynfilter::keep_static(labels, keypoints, descriptors);

    // … matching and pose estimation on what is left
    return labels.statistics();
  }

  dynfilter::AsyncSegmenterStatistics network() const { return people_.statistics(); }

 private:
  dynfilter::AsyncSegmenter people_;
  cv::Ptr<cv::ORB> orb_ = cv::ORB::create(1000);
  dynfilter::DynamicFilter filter_;
};

/// Simulates a network: knows the masks, but takes its time.
class SlowNetwork final : public dynfilter::Segmenter {
 public:
  explicit SlowNetwork(std::vector<dynfilter::Segmentation> masks) : masks_(std::move(masks)) {}

 private:
  dynfilter::Segmentation do_segment(const dynfilter::FrameView& frame) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return masks_.at(frame.id);
  }

  std::vector<dynfilter::Segmentation> masks_;
};

int main() {
  dynfilter::SyntheticSceneOptions options;
  options.image_size = {320, 240};
  options.frames = 20;
  const dynfilter::SyntheticScene scene(options);
  std::vector<dynfilter::FrameView> frames;
  std::vector<dynfilter::Segmentation> masks;
  for (int i = 0; i < scene.size(); ++i) {
    dynfilter::SyntheticFrame rendered = scene.render(i);
    frames.push_back(rendered.frame);
    masks.push_back(rendered.poor_segmentation);
  }

  Tracker tracker(std::make_unique<SlowNetwork>(masks));
  bool sound = true;
  auto next_frame = std::chrono::steady_clock::now();
  for (const dynfilter::FrameView& frame : frames) {
    const dynfilter::FrameStatistics counts = tracker.track(frame);
    if (counts.has_segmentation) {
      const double age_ms = 1000 * counts.segmentation_age_s;
      std::printf("frame %2d: masks %3.0f ms old, %3zu of %zu features kept\n",
                  static_cast<int>(frame.id), age_ms, counts.kept(), counts.features);
      sound = sound && age_ms >= 0;
    } else {
      std::printf("frame %2d: no masks yet\n", static_cast<int>(frame.id));
    }
    next_frame += std::chrono::milliseconds(33);
    std::this_thread::sleep_until(next_frame);
  }

  const dynfilter::AsyncSegmenterStatistics network = tracker.network();
  std::printf("%d frames: %d segmented in %.0f ms each, %d replaced by newer ones\n",
              static_cast<int>(network.submitted), static_cast<int>(network.segmented),
              1000 * network.mean_inference_s(), static_cast<int>(network.replaced));
  sound = sound && network.submitted == frames.size() && network.failed == 0 &&
          network.segmented + network.replaced + network.pending == frames.size();
  return sound ? 0 : 1;
}
