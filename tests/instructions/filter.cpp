// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Functions whose instructions count.sh counts: one frame of the whole filter by each rule, on the
// benchmarks' input, and keep_static after the paper's rule.

#include <cstddef>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "counted.hpp"
#include "dynfilter/dynfilter.hpp"
#include "filter_input.hpp"

using dynfilter::DynamicFilter;
using dynfilter::FeatureLabels;
using dynfilter::Workspace;
using dynfilter::benchmarks::FilterInputData;

// Not static and not inlined, so that callgrind finds it by name.
extern "C" {

[[gnu::noinline]] void counted_filter(const DynamicFilter& filter, const FilterInputData& input,
                                      FeatureLabels& labels, Workspace& workspace) {
  filter.apply(input.frame, input.segmentation, input.keypoints, labels, workspace);
}

[[gnu::noinline]] void counted_keep_static(const FeatureLabels& labels,
                                           std::vector<cv::KeyPoint>& keypoints,
                                           cv::Mat& descriptors) {
  dynfilter::keep_static(labels, keypoints, descriptors);
}
}

int main(int argc, char** argv) {
  using namespace dynfilter;
  constexpr std::size_t features = 1000;
  const std::string rule =
      testing::argument_or_exit(argc, argv,
                                {{"masks", "counted_filter", features, 17800},
                                 {"paper", "counted_filter", features, 32900},
                                 {"default", "counted_filter", features, 80300},
                                 {"keep", "counted_keep_static", features, 5800}});
  DynamicFilterOptions options;
  if (rule == "masks") options.compensator.rule = CompensationRule::mask;
  if (rule == "paper" || rule == "keep") options.compensator.rule = CompensationRule::paper;
  const DynamicFilter filter(options);
  FilterInputData input = benchmarks::make_filter_input({640, 480}, features, 3);
  FeatureLabels labels;
  Workspace workspace;
  filter.apply(input.frame, input.segmentation, input.keypoints, labels,
               workspace);  // allocates memory
  if (rule != "keep") {
    counted_filter(filter, input, labels, workspace);
  } else {
    counted_keep_static(labels, input.keypoints, input.descriptors);
  }
}
