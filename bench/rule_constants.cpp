// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Shows what each constant of the rule depth is worth: its default, and values around it, on
// rendered scenes and recordings. Prints dynamic features left / static ones removed, with depth +
// without / rim ones removed, a frame.
//
//   rule_constants [FIRST_SEED [LAST_SEED [EVERY_NTH_FRAME]]] [SEQUENCE]...    11 13 20 by default
//
// A SEQUENCE is a folder, or folder,degradation or folder,degradation,depth_offset_s, with "-" for
// masks as they are (see degraded_masks.hpp). All its frames are used.
//
// Seeds 11 to 13 are those by which the defaults were chosen.

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <orb_extractor.hpp>

#include <opencv2/imgproc.hpp>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/evaluation/feature_scores.hpp>
#include "lab/scenes/scene_levels.hpp"

#include "arguments.hpp"
#include "degraded_masks.hpp"
#include "frame_source.hpp"

namespace {

using Options = dynfilter::DepthCompensatorOptions;

struct Frame {
  dynfilter::FrameView view;
  dynfilter::Segmentation masks, true_masks;
  std::vector<cv::KeyPoint> keypoints;
};

struct Level {
  std::string name;
  double rim_px = 3;
  std::vector<Frame> frames;
};

struct Variant {
  std::string name;
  std::function<void(Options&)> change;
};

Frame make_frame(const dynfilter::FrameView& view, const dynfilter::Segmentation& masks,
                 const dynfilter::Segmentation& true_masks) {
  static const odometry::OrbExtractor extractor(1000);
  Frame frame{view, masks, true_masks, {}};
  cv::Mat grey = view.image, descriptors;
  if (grey.channels() == 3) cv::cvtColor(view.image, grey, cv::COLOR_BGR2GRAY);
  extractor.extract(grey, frame.keypoints, descriptors);
  frame.view.image.release();  // the rule does not use it
  return frame;
}

Level read_sequence(const std::string& text) {
  using namespace dynfilter;
  std::istringstream words(text);
  std::string folder, degradation = "-", offset_s;
  std::getline(words, folder, ',');
  std::getline(words, degradation, ',');
  std::getline(words, offset_s);
  std::optional<double> depth_offset_s;
  if (!offset_s.empty()) depth_offset_s = std::stod(offset_s);
  std::unique_ptr<tools::FrameSource> source = tools::open_sequence(folder, {}, {}, depth_offset_s);
  Level level{
      std::filesystem::path(folder).filename().string().substr(0, 12), source->rim_px(), {}};
  if (degradation != "-") {
    source = tools::degrade_masks(std::move(source), degradation);
    level = {degradation + (offset_s.empty() ? "" : " " + offset_s), source->rim_px(), {}};
  }
  for (std::size_t i = 0; i < source->size(); ++i) {
    const tools::SourceFrame read = source->read(i);
    if (!read.masks || !read.true_masks) {
      throw std::runtime_error(folder + ": frame " + read.stem + " has no true masks; want them, " +
                               "or a degradation of good masks");
    }
    level.frames.push_back(make_frame(read.frame, *read.masks, *read.true_masks));
  }
  std::fprintf(stderr, "read %s\n", text.c_str());
  return level;
}

std::vector<Level> render_levels(int first_seed, int last_seed, int step) {
  std::vector<Level> levels;
  for (const char* name :
       {"cross", "medium", "hard", "stale_3", "stale_6", "furniture", "two_in_one", "leave",
        "depth_late_33", "depth_late_16", "depth_early_33", "desk", "two_near", "hair"}) {
    Level level{name, 3, {}};
    for (int seed = first_seed; seed <= last_seed; ++seed) {
      const dynfilter::SyntheticScene scene(
          dynfilter::scene_level(name, static_cast<std::uint64_t>(seed)));
      for (int i = 7; i < scene.size(); i += step) {
        const dynfilter::SyntheticFrame rendered = scene.render(i);
        level.frames.push_back(
            make_frame(rendered.frame, rendered.poor_segmentation, rendered.true_segmentation));
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
      sum += dynfilter::score_features(frame.keypoints, labels, frame.true_masks, level.rim_px,
                                       frame.view);
    }
    const auto mean = [&](std::size_t count) {
      return static_cast<double>(count) / static_cast<double>(level.frames.size());
    };
    std::printf("  %5.1f /%5.1f +%5.1f /%5.1f", mean(sum.dynamic_left),
                mean(sum.static_removed_with_depth),
                mean(sum.static_removed - sum.static_removed_with_depth), mean(sum.rim_removed));
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
  add(all, "min_half_width_m", depth(&Depth::min_half_width_m), {.30, .35, .40, .50, .55, .60});
  add(all, "max_half_width_m", depth(&Depth::max_half_width_m), {.40, .50, .60, .80, 1.0});
  add(all, "min_share", depth(&Depth::min_share), {.02, .03, .08, .10, .20});
  add(all, "min_mask_share", depth(&Depth::min_mask_share), {.0, .01, .05, .10, .20});
  for (const std::size_t places : {400U, 800U, 3000U, 100000U}) {
    all.push_back({"max_places " + std::to_string(places),
                   [places](Options& options) { options.object_depth.max_places = places; }});
  }
  add(all, "min_box_share", depth(&Depth::min_box_share), {.05, .10, .30, .40});
  add(all, "min_nearness", rule(&Options::min_nearness), {.3, .4, .5, .6, .7, 1.0});
  add(all, "min_nearness_if_stale", rule(&Options::min_nearness_if_stale),
      {.2, .3, .35, .4, .5, .6});
  add(all, "reach_px", rule(&Options::reach_px), {4, 6, 8, 10, 16});
  add(all, "box_margin_px", rule(&Options::box_margin_px), {0, 3, 10, 20});
  add(all, "mask_margin_px", rule(&Options::mask_margin_px), {0, 2, 3, 6});
  add(all, "mask_gap.max_gap_px", [](Options& o) -> double& { return o.mask_gap.max_gap_px; },
      {1e-6, 4, 8, 24});
  add(all, "mask_gap.min_shift_px", [](Options& o) -> double& { return o.mask_gap.min_shift_px; },
      {0, 2, 3, 6, 1e6});
  add(all, "shadow_px", rule(&Options::shadow_px), {0, 6, 8, 10, 12});
  add(all, "min_nearness_in_shadow", rule(&Options::min_nearness_in_shadow),
      {.7, .9, 1.1, 1.2, 1.4});
  add(all, "max_beyond_range_m", rule(&Options::max_beyond_range_m), {0, .1, .2, .4});
  add(all, "max_step_m", rule(&Options::max_step_m), {.01, .02, .05, .1});
  add(all, "min_off_middle_m", rule(&Options::min_off_middle_m), {.05, .10, .20, .30, 10});
  add(all, "cell_px", rule(&Options::cell_px), {12, 16, 20, 28, 32});
  add(all, "motion_px_per_s", rule(&Options::motion_px_per_s), {0, 200, 300, 600, 800});
  add(all, "stale_age_s", rule(&Options::stale_age_s), {1e6});
  return all;
}

}  // namespace

int main(int count, char** words) {
  try {
    int numbers = 1;  // words before the sequences
    while (numbers < count && numbers < 4 && std::isdigit(*words[numbers]) != 0) ++numbers;
    const int first = argument(numbers, words, 1, 11);
    const int last = argument(numbers, words, 2, first + 2);
    std::vector<Level> levels = render_levels(first, last, argument(numbers, words, 3, 20));
    for (int i = numbers; i < count; ++i) levels.push_back(read_sequence(words[i]));
    std::printf("%-26s", "");
    for (const Level& level : levels) std::printf("  %26s", level.name.c_str());
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
