// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Shows what each constant of the rule depth is worth: its default, and values around it, on
// rendered scenes. Prints dynamic features left / static ones removed / rim ones removed a frame.
//
//   rule_constants [FIRST_SEED [LAST_SEED [EVERY_NTH_FRAME]]]    11 13 20 by default
//
// Seeds 11 to 13 are those by which the defaults were chosen.

#include <algorithm>
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

using Options = dynfilter::DepthCompensatorOptions;

struct Frame {
  dynfilter::FrameView view;
  dynfilter::Segmentation masks, true_masks;
  std::vector<cv::KeyPoint> keypoints;
};

struct Level {
  std::string name;
  std::vector<Frame> frames;
};

struct Variant {
  std::string name;
  std::function<void(Options&)> change;
};

Frame render(const dynfilter::SyntheticScene& scene, int index,
             const odometry::OrbExtractor& extractor) {
  dynfilter::SyntheticFrame rendered = scene.render(index);
  Frame frame;
  cv::Mat grey, descriptors;
  cv::cvtColor(rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
  extractor.extract(grey, frame.keypoints, descriptors);
  rendered.frame.image.release();  // the rule does not use it
  frame.view = rendered.frame;
  frame.masks = rendered.poor_segmentation;
  frame.true_masks = rendered.true_segmentation;
  return frame;
}

std::vector<Level> render_levels(int first_seed, int last_seed, int step) {
  const odometry::OrbExtractor extractor(1000);
  std::vector<Level> levels;
  for (const char* name :
       {"cross", "medium", "hard", "stale_3", "stale_6", "furniture", "two_in_one", "leave"}) {
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

template <class Stage>
void print_row(const std::string& name, const std::vector<Level>& levels, const Stage& stage) {
  const dynfilter::Pipeline<dynfilter::MaskCuller, Stage> filter(dynfilter::MaskCuller{}, stage);
  std::printf("%-26s", name.c_str());
  dynfilter::FeatureLabels labels;
  dynfilter::Workspace workspace;
  for (const Level& level : levels) {
    dynfilter::FeatureScores sum;
    for (const Frame& frame : level.frames) {
      filter.apply(frame.view, frame.masks, frame.keypoints, labels, workspace);
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

template <class Member>
void add(std::vector<Variant>& variants, const char* name, Member member,
         std::initializer_list<double> values) {
  for (const double value : values) {
    char text[64];
    std::snprintf(text, sizeof text, "%s %g", name, value);
    variants.push_back({text, [member, value](Options& options) { member(options) = value; }});
  }
}

std::vector<Variant> variants() {
  std::vector<Variant> all;
  const auto depth = [](double dynfilter::ObjectDepthOptions::*member) {
    return [member](Options& options) -> double& { return options.object_depth.*member; };
  };
  const auto rule = [](double Options::*member) {
    return [member](Options& options) -> double& { return options.*member; };
  };
  using Depth = dynfilter::ObjectDepthOptions;
  add(all, "min_half_width_m", depth(&Depth::min_half_width_m), {.25, .30, .35, .45, .50, .60});
  add(all, "max_half_width_m", depth(&Depth::max_half_width_m), {.40, .50, .60, .80, 1.0});
  add(all, "min_share", depth(&Depth::min_share), {.02, .03, .08, .10, .20});
  add(all, "min_mask_share", depth(&Depth::min_mask_share), {.0, .01, .05, .10, .20});
  add(all, "min_box_share", depth(&Depth::min_box_share), {.05, .10, .30, .40});
  add(all, "min_nearness", rule(&Options::min_nearness), {.3, .4, .6, .7, .8, 1.0});
  add(all, "min_nearness_if_stale", rule(&Options::min_nearness_if_stale),
      {.2, .3, .35, .45, .5, .6});
  add(all, "reach_px", rule(&Options::reach_px), {4, 6, 8, 10, 16});
  add(all, "box_margin_px", rule(&Options::box_margin_px), {0, 3, 10, 20});
  add(all, "mask_margin_px", rule(&Options::mask_margin_px), {0, 2, 3, 6});
  add(all, "mask_gap.max_gap_px", [](Options& o) -> double& { return o.mask_gap.max_gap_px; },
      {1e-6, 4, 8, 24});
  add(all, "shadow_px", rule(&Options::shadow_px), {0, 4, 6, 12});
  add(all, "min_nearness_in_shadow", rule(&Options::min_nearness_in_shadow), {.7, .8, 1.1, 1.4});
  add(all, "max_beyond_range_m", rule(&Options::max_beyond_range_m), {0, .1, .2, .4});
  add(all, "max_step_m", rule(&Options::max_step_m), {.01, .02, .05, .1});
  add(all, "min_off_middle_m", rule(&Options::min_off_middle_m), {.05, .10, .20, .30, 10});
  add(all, "cell_px", rule(&Options::cell_px), {8, 12, 20, 24, 32});
  add(all, "motion_px_per_s", rule(&Options::motion_px_per_s), {0, 200, 300, 600, 800});
  add(all, "stale_age_s", rule(&Options::stale_age_s), {1e6});
  return all;
}

}  // namespace

int main(int count, char** words) {
  try {
    const int first = argument(count, words, 1, 11);
    const int last = argument(count, words, 2, first + 2);
    const std::vector<Level> levels = render_levels(first, last, argument(count, words, 3, 20));
    std::printf("%-26s", "");
    for (const Level& level : levels) std::printf("  %19s", level.name.c_str());
    std::printf("\n");
    print_row("masks only", levels,
              [](const dynfilter::FilterInput&, dynfilter::FeatureLabels&) {});
    print_row("paper", levels,
              dynfilter::EdgeCompensator(dynfilter::EdgeCompensatorOptions::paper()));
    print_row("defaults", levels, dynfilter::DepthCompensator());
    for (const Variant& variant : variants()) {
      Options options;
      variant.change(options);
      options.object_depth.max_half_width_m =
          std::max(options.object_depth.max_half_width_m, options.object_depth.min_half_width_m);
      print_row(variant.name, levels, dynfilter::DepthCompensator(options));
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "rule_constants: %s\n", error.what());
    return 1;
  }
  return 0;
}
