// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A front end that tracks points from frame to frame (KLT, like VINS and OpenVINS) on a synthetic
// scene. Moving objects harm it twice: it detects corners on them, and a person who walks in front
// of the background carries background points away.
// Prints a line for each frame; returns 1 if a kept point lies on a mask.

#include <cstddef>
#include <cstdio>
#include <vector>

#include <dynfilter/dynfilter.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include "lab/scenes/synthetic_scene.hpp"

/// Points of the last frame, in parallel arrays.
struct Tracks {
  std::vector<cv::Point2f> points;
  std::vector<int> ids;
  std::vector<int> frames_seen;
};

struct Counts {
  std::size_t tracked, in_mask, compensated, lost, detected;
};

class FrontEnd {
 public:
  explicit FrontEnd(const dynfilter::DynamicFilterOptions& options)
      : filter_(options), culler_(options.mask_culler) {}

  Counts track(const dynfilter::FrameView& frame, const dynfilter::Segmentation& people) {
    cv::Mat grey;
    cv::cvtColor(frame.image, grey, cv::COLOR_BGR2GRAY);
    Counts counts{};
    follow(grey, frame, people, counts);
    detect(grey, people, counts);
    previous_ = grey;
    return counts;
  }

  const Tracks& tracks() const { return tracks_; }

 private:
  /// Moves the points to the new frame and drops those that are lost or on a dynamic object now.
  void follow(const cv::Mat& grey, const dynfilter::FrameView& frame,
              const dynfilter::Segmentation& people, Counts& counts) {
    if (tracks_.points.empty()) return;
    std::vector<cv::Point2f> points;
    std::vector<unsigned char> found;
    cv::calcOpticalFlowPyrLK(previous_, grey, tracks_.points, points, found, cv::noArray());
    tracks_.points = points;

    auto labels = filter_.apply(frame, people, tracks_.points);
    counts.in_mask = labels.statistics().masked;
    counts.compensated = labels.statistics().compensated;
    const cv::Rect inside({}, grey.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool lost = found[i] == 0 || !inside.contains(dynfilter::nearest_pixel(points[i]));
      if (lost && labels.remove(i, -1, dynfilter::Reason::custom, 0.0F)) ++counts.lost;
    }
    counts.tracked =
        dynfilter::keep_static(labels, tracks_.points, tracks_.ids, tracks_.frames_seen);
    for (int& frames : tracks_.frames_seen) ++frames;
  }

  /// Adds corners that lie neither on a dynamic object nor next to a point.
  void detect(const cv::Mat& grey, const dynfilter::Segmentation& people, Counts& counts) {
    cv::Mat mask = dynfilter::mask_of_static_pixels(people, culler_);
    for (const cv::Point2f& point : tracks_.points) {
      cv::circle(mask, dynfilter::nearest_pixel(point), spacing_px, cv::Scalar(0), cv::FILLED);
    }
    const int wanted = max_points - static_cast<int>(tracks_.points.size());
    if (wanted <= 0) return;
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(grey, corners, wanted, 0.01, spacing_px, mask);
    for (const cv::Point2f& corner : corners) {
      tracks_.points.push_back(corner);
      tracks_.ids.push_back(next_id_++);
      tracks_.frames_seen.push_back(1);
    }
    counts.detected = corners.size();
  }

  static constexpr int max_points = 200;
  static constexpr int spacing_px = 8;

  dynfilter::DynamicFilter filter_;
  dynfilter::MaskCuller culler_;  // with the filter's options: detector and filter must agree
  cv::Mat previous_;
  Tracks tracks_;
  int next_id_ = 0;
};

int main() {
  dynfilter::SyntheticSceneOptions scene_options;
  scene_options.image_size = {320, 240};
  scene_options.frames = 15;
  const dynfilter::SyntheticScene scene(scene_options);

  dynfilter::DynamicFilterOptions options;
  options.mask_culler.margin_px =
      3;  // the window around a point next to a mask contains the person
  FrontEnd front_end(options);

  std::size_t in_mask = 0, kept_on_mask = 0;
  for (int i = 0; i < scene.size(); ++i) {
    const dynfilter::SyntheticFrame rendered = scene.render(i);
    const dynfilter::Segmentation& people = rendered.poor_segmentation;
    const Counts counts = front_end.track(rendered.frame, people);
    std::printf("frame %2d: %3zu tracked, %2zu in a mask, %2zu at its edge, %2zu lost, %3zu new\n",
                i, counts.tracked, counts.in_mask, counts.compensated, counts.lost,
                counts.detected);
    in_mask += counts.in_mask;
    const dynfilter::MaskCuller culler(options.mask_culler);
    for (const cv::Point2f& point : front_end.tracks().points) {
      if (culler.instance_at(people, point)) ++kept_on_mask;
    }
  }
  std::printf("%zu points were tracked into a mask and culled; %zu kept points lie on a mask\n",
              in_mask, kept_on_mask);
  return kept_on_mask == 0 ? 0 : 1;
}
