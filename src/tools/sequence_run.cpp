// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "sequence_run.hpp"

#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "dynfilter/evaluation/feature_scores.hpp"

namespace dynfilter::tools {

namespace {

/// What the run was made with, for whoever finds its results later.
std::vector<std::pair<std::string, std::string>> resolved(const RunOptions& options) {
  std::string classes;
  for (const int id : options.mask_culler.dynamic_classes) {
    classes += (classes.empty() ? "" : ",") + std::to_string(id);
  }
  return {{"rule", options.rule},
          {"features", std::to_string(options.features)},
          {"classes", classes},
          {"margin", detail::concatenate(options.mask_culler.margin_px)},
          {"seed", std::to_string(options.seed)}};
}

EdgeCompensatorOptions edge_options(const RunOptions& options) {
  EdgeCompensatorOptions edge = EdgeCompensatorOptions::paper();
  edge.seed = options.seed;
  return edge;
}

}  // namespace

SequenceRun::SequenceRun(const RunOptions& options)
    : sequence_(options.sequence, {0.02, options.camera}),
      extractor_(options.features),
      filter_({MaskCuller(options.mask_culler), culler_time_},
              {detail::edge_stage(options.rule, edge_options(options)), compensator_time_}) {
  record_.sequence = options.sequence.string();
  record_.rule = options.rule;
  record_.options = resolved(options);
  const auto masks = options.masks.empty() ? sequence_.masks_folder() : options.masks;
  if (masks) {
    masks_.emplace(*masks);
    record_.masks = masks->string();
  }
  if (sequence_.true_masks_folder()) {
    true_masks_.emplace(*sequence_.true_masks_folder());
    record_.true_masks = sequence_.true_masks_folder()->string();
  }
  // Last, so that an error in the input leaves the results of an earlier run alone.
  pictures_.emplace(options.out, sequence_.size(), options.overlays, options.rule != "mask");
}

void SequenceRun::process(std::size_t i) {
  const FrameView frame = sequence_.read(i);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::Mat grey;
  cv::cvtColor(frame.image, grey, cv::COLOR_BGR2GRAY);
  extraction_time_.measure([&] { extractor_.extract(grey, keypoints, descriptors); });

  std::optional<Segmentation> masks;
  if (masks_) masks = masks_time_.measure([&] { return masks_->segment(frame); });
  filter_.apply(frame, masks, keypoints, labels_, workspace_);

  FrameRecord record;
  record.stem = sequence_.entry(i).stem;
  record.timestamp_s = frame.timestamp_s;
  record.statistics = labels_.statistics();
  const FeatureLabels by_mask = only_masked(labels_, masks.value_or(Segmentation()));
  if (true_masks_) {
    const Segmentation truth = true_masks_->segment(frame);
    record.scores = score_features(keypoints, labels_, truth);
    record.mask_only_scores = score_features(keypoints, by_mask, truth);
  }
  if (pictures_->wants(i)) {
    pictures_->add(record.stem, frame.image, masks.value_or(Segmentation()), keypoints, by_mask,
                   labels_);
  }
  record_.frames.push_back(std::move(record));
  keep_static_time_.measure([&] { return keep_static(labels_, keypoints, descriptors); });
}

RunRecord SequenceRun::finish() {
  pictures_->write_contact_sheet();
  const std::pair<std::string, const Times&> stages[] = {
      {"ORB extraction (" + extractor_.description() + ")", extraction_time_},
      {"masks from files", masks_time_},
      {"mask culler", culler_time_},
      {"edge compensator", compensator_time_},
      {"keep_static", keep_static_time_},
  };
  for (const auto& [name, times] : stages) {
    if (!times.empty()) record_.stages.emplace_back(name, times);
  }
  return std::move(record_);
}

}  // namespace dynfilter::tools
