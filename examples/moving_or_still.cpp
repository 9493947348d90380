// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Filters a recorded sequence (TUM RGB-D or BONN layout) by masks, depth and motion: features that
// move go, with or without a mask, and those of people who stand still are kept. Masks come from
// SEQUENCE/masks; without that folder, motion decides alone.
//
//     moving_or_still SEQUENCE [DEPTH_OFFSET_S]
//
// Prints what was removed and kept in all, and with which frame a map should begin.

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <vector>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/evaluation/rgbd_sequence.hpp>
#include <dynfilter/motion/motion_filter.hpp>
#include <dynfilter/segmenters/mask_folder_segmenter.hpp>
#include <opencv2/features2d.hpp>

namespace {

int run(const char* folder, std::optional<double> depth_offset_s) {
  dynfilter::RgbdSequenceOptions options;
  options.depth_offset_s = depth_offset_s;  // see `dynfilter sync`
  const dynfilter::RgbdSequence sequence(folder, options);
  std::optional<dynfilter::MaskFolderSegmenter> people;
  if (const auto masks = sequence.masks_folder()) people.emplace(*masks);

  dynfilter::MotionFilter filter(sequence.camera());  // one for each camera, every frame in order
  dynfilter::FeatureLabels labels;
  dynfilter::Workspace workspace;
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(1000);
  std::size_t kept = 0, moving = 0, kept_still = 0, judged = 0;
  std::optional<std::size_t> map_begin;  // frame
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const dynfilter::FrameView frame = sequence.read(i);
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    orb->detectAndCompute(frame.image, cv::noArray(), keypoints, descriptors);
    std::optional<dynfilter::Segmentation> masks;  // nothing: no masks are known
    if (people) masks = people->segment(frame);
    filter.apply(frame, masks, keypoints, labels, workspace);
    kept += dynfilter::keep_static(labels, keypoints, descriptors);

    const dynfilter::MotionStatistics& motion = labels.statistics().motion;
    moving += labels.statistics().moving;
    kept_still += motion.kept_still;
    judged += motion.outcome == dynfilter::MotionOutcome::applied ? 1 : 0;
    // A host without a map waits here, for 15 frames at most: until motion is decided, the features
    // of people who stand still are missing. Nothing decides it without masks.
    const bool may_begin = labels.statistics().is_motion_decided() || !people || i == 15;
    if (!map_begin && may_begin) map_begin = i;
  }
  std::printf(
      "%zu frames, motion judged in %zu: %zu features kept, %zu removed because they move, "
      "%zu kept because they are still; a map should begin with frame %zu\n",
      sequence.size(), judged, kept, moving, kept_still, map_begin.value_or(sequence.size()));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: moving_or_still SEQUENCE [DEPTH_OFFSET_S]\n");
    return 2;
  }
  try {
    return run(argv[1], argc > 2 ? std::optional<double>(std::atof(argv[2])) : std::nullopt);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
