// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Shows what depths at features are worth where there is no depth image, as in stereo and mono
// hosts, on rendered scenes. Prints dynamic features left / static ones removed / rim ones removed
// a frame: for masks alone, for each rule with the depth image, and for each with a column of
// depths instead. Then it prints the results of other values of the constants.
//
//   feature_depths [FIRST_SEED [LAST_SEED [EVERY_NTH_FRAME]]]    11 13 20 by default
//
// Seeds 11 to 13 are those by which the defaults were chosen. The columns hold exact depths, or
// those of a stereo camera whose disparities are off by 0.5 px (standard deviation) at the products
// of focal length and baseline of KITTI (386 px m) and EuRoC (48 px m). Some are known at every
// third feature only, and some have 5 % wrong matches, whose disparity is random.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <orb_extractor.hpp>

#include <opencv2/imgproc.hpp>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/evaluation/feature_scores.hpp>
#include <dynfilter/evaluation/scene_levels.hpp>

#include "arguments.hpp"

namespace {

using dynfilter::DepthCompensator;
using dynfilter::DepthCompensatorOptions;
using dynfilter::EdgeCompensator;
using dynfilter::EdgeCompensatorOptions;

struct Frame {
  dynfilter::FrameView view;
  cv::Mat exact_depth_m;
  dynfilter::Segmentation masks, true_masks;
  std::vector<cv::KeyPoint> keypoints;
};

struct Level {
  std::string name;
  std::vector<Frame> frames;
};

/// Depths that a host knows.
struct Source {
  std::string name;
  std::size_t every = 1;      // the depth of every n-th feature is known
  double focal_baseline = 0;  // of the stereo camera, pixels times metres; 0: depths are exact
  double wrong_share = 0;     // of wrong matches
};

const Source exact{"1/1"}, third{"1/3", 3};
const std::vector<Source> sources = {exact,
                                     third,
                                     {"1/1, KITTI", 1, 386},
                                     {"1/1, EuRoC", 1, 48},
                                     {"1/1, EuRoC, 5 % wrong", 1, 48, 0.05},
                                     {"1/3, EuRoC, 5 % wrong", 3, 48, 0.05}};

Frame render(const dynfilter::SyntheticScene& scene, int index,
             const odometry::OrbExtractor& extractor) {
  dynfilter::SyntheticFrame rendered = scene.render(index);
  Frame frame;
  cv::Mat grey, descriptors;
  cv::cvtColor(rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
  extractor.extract(grey, frame.keypoints, descriptors);
  rendered.frame.image.release();  // the rules do not use it
  frame.view = rendered.frame;
  frame.exact_depth_m = rendered.exact_depth_m;
  frame.masks = rendered.poor_segmentation;
  frame.true_masks = rendered.true_segmentation;
  return frame;
}

std::vector<Level> render_levels(int first_seed, int last_seed, int step) {
  const odometry::OrbExtractor extractor(1000);
  std::vector<Level> levels;
  for (const char* name :
       {"medium", "hard", "cross", "stale_3", "two_in_one", "furniture", "desk"}) {
    Level level{name, {}};
    for (int seed = first_seed; seed <= last_seed; ++seed) {
      const dynfilter::SyntheticScene scene(
          dynfilter::scene_level(name, static_cast<std::uint64_t>(seed)));
      for (int i = 7; i < scene.size(); i += step) {
        level.frames.push_back(render(scene, i, extractor));
      }
    }
    std::fprintf(stderr, "rendered %s\n", name);
    levels.push_back(std::move(level));
  }
  return levels;
}

/// Returns the column of depths of a frame. The seed is that of its errors.
std::vector<float> depths_of(const Frame& frame, const Source& source, std::uint64_t seed) {
  constexpr double sigma_px = 0.5, max_wrong_px = 100;
  cv::RNG random(seed + 1);  // 0 would stand for another seed
  std::vector<float> depths_m(frame.keypoints.size(), 0.0F);
  for (std::size_t i = 0; i < depths_m.size(); i += source.every) {
    const cv::Point pixel = dynfilter::nearest_pixel(frame.keypoints[i].pt);
    depths_m[i] = frame.exact_depth_m.at<float>(pixel);
    if (source.focal_baseline == 0) continue;
    double disparity_px = source.focal_baseline / double{depths_m[i]} + random.gaussian(sigma_px);
    if (random.uniform(0.0, 1.0) < source.wrong_share) {
      disparity_px = random.uniform(0.0, max_wrong_px);
    }
    depths_m[i] = static_cast<float>(source.focal_baseline / std::max(disparity_px, 0.01));
  }
  return depths_m;
}

/// Prints a row of scores: with the depth image if `source` is null, else with its column.
template <class Stage>
void print_row(const std::string& name, const std::vector<Level>& levels, const Stage& stage,
               const Source* source = nullptr) {
  const dynfilter::Pipeline<dynfilter::MaskCuller, Stage> filter(dynfilter::MaskCuller{}, stage);
  std::printf("%-32s", name.c_str());
  dynfilter::FeatureLabels labels;
  dynfilter::Workspace workspace;
  for (const Level& level : levels) {
    dynfilter::FeatureScores sum;
    std::uint64_t seed = 0;
    for (const Frame& frame : level.frames) {
      if (source) {
        dynfilter::FrameView view = frame.view;
        view.depth.release();
        const std::vector<float> depths_m = depths_of(frame, *source, seed++);
        const auto features = dynfilter::FeaturesView(frame.keypoints).with_depths(depths_m);
        filter.apply(view, frame.masks, features, labels, workspace);
      } else {
        filter.apply(frame.view, frame.masks, frame.keypoints, labels, workspace);
      }
      sum += dynfilter::score_features(frame.keypoints, labels, frame.true_masks);
    }
    const auto mean = [&](std::size_t count) {
      return static_cast<double>(count) / static_cast<double>(level.frames.size());
    };
    std::printf("  %5.1f /%5.1f /%5.1f", mean(sum.dynamic_left), mean(sum.static_removed),
                mean(sum.rim_removed));
  }
  std::printf("\n");
  std::fflush(stdout);
}

void print_constants(const std::vector<Level>& levels) {
  const auto print = [&](const char* name, double DepthCompensatorOptions::*option,
                         std::initializer_list<double> values) {
    for (const double value : values) {
      DepthCompensatorOptions options;
      options.*option = value;
      char text[64];
      std::snprintf(text, sizeof text, "%s %g", name, value);
      print_row(text, levels, DepthCompensator(options), &third);
    }
  };
  print("1/3, feature_reach_px", &DepthCompensatorOptions::feature_reach_px, {0, 20, 40, 80, 120});
  print("1/3, min_feature_share", &DepthCompensatorOptions::min_feature_share,
        {.5, .7, .8, .85, .95, 1});
}

}  // namespace

int main(int count, char** words) {
  try {
    const int first = argument(count, words, 1, 11);
    const int last = argument(count, words, 2, first + 2);
    const std::vector<Level> levels = render_levels(first, last, argument(count, words, 3, 20));
    const EdgeCompensator paper(EdgeCompensatorOptions::paper());
    const DepthCompensator depth;
    std::printf("%-32s", "");
    for (const Level& level : levels) std::printf("  %19s", level.name.c_str());
    std::printf("\n");
    print_row("mask", levels, [](const dynfilter::FilterInput&, dynfilter::FeatureLabels&) {});
    print_row("paper, depth image", levels, paper);
    print_row("depth, depth image", levels, depth);
    for (const Source* source : {&exact, &third}) {
      print_row("paper, " + source->name, levels, paper, source);
    }
    for (const Source& source : sources) print_row("depth, " + source.name, levels, depth, &source);
    print_constants(levels);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "feature_depths: %s\n", error.what());
    return 1;
  }
  return 0;
}
