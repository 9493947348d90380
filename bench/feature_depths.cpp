// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Shows what depths at features are worth where there is no depth image, as in stereo and mono
// hosts, on rendered scenes. Prints dynamic features left / static ones removed / rim ones removed
// a frame: for masks alone, for each rule with the depth image, and for each with a column of
// depths instead. Then it prints the results of other values of the constants.
//
//   feature_depths [FIRST_SEED [LAST_SEED [EVERY_NTH_FRAME]]]    11 13 20 by default
//
// Seeds 11 to 13 are those by which the defaults were chosen. The columns hold exact depths, those
// of features matched with the right image of a rendered pair (baselines of 0.54 m, as KITTI's, and
// of 0.11 m, as EuRoC's) by their descriptors, as hosts do, or by StereoDepths ("own"), or those of
// a stereo camera whose disparities are off by 0.5 px (standard deviation) at the products of focal
// length and baseline of KITTI (386 px m) and EuRoC (48 px m). Some are known at every third
// feature only, and some have 5 % wrong matches, whose disparity is random. "in view" and "in both"
// are what a perfect matcher knows: exact depths of all features that lie in the right image, or
// that are not hidden there either. "map points" are exact depths of every second static feature,
// as of a mono host whose map has nothing that moves. For pairs it also prints the static features
// removed whose depth is unknown or right, how many features are matched, and matched wrongly, and
// the time that StereoDepths takes. The levels "far" and "3m" are medium with people 5 and 3 m away
// before a wall twice as far. Levels with "_kitti" are seen by KITTI's camera, 1242x375 pixels and
// 721 px of focal length; the others by one of 640x480 pixels and 535 px.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <orb_extractor.hpp>

#include <opencv2/imgproc.hpp>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/evaluation/feature_scores.hpp>

#include "arguments.hpp"
#include "stereo_frames.hpp"

namespace {

using dynfilter::DepthCompensator;
using dynfilter::DepthCompensatorOptions;
using dynfilter::EdgeCompensator;
using dynfilter::EdgeCompensatorOptions;
using stereo_frames::Frame;
using stereo_frames::Right;

struct Level {
  std::string name;
  std::vector<Frame> frames;
};

/// Features whose depth a host may know.
enum class Known : std::uint8_t {
  all,
  in_view,    // that lie in the right image
  in_both,    // that the right camera sees
  map_points  // every second one of the static ones
};

/// Depths that a host knows.
struct Source {
  std::string name;
  std::size_t every = 1;          // the depth of every n-th feature is known
  double focal_baseline = 0;      // of the stereo camera, pixels times metres; 0: depths are exact
  double wrong_share = 0;         // of wrong matches
  Right Frame::*right = nullptr;  // depths by matching; the others then do not count
  bool is_own = false;            // by StereoDepths, near the objects
  double rows_off_px = 0;         // by which rows of the right image are too low
  Known known = Known::all;       // other than all: exact depths
};

const Source exact{"1/1"}, third{"1/3", 3};
const Source map_points{"map points", 1, 0, 0, nullptr, false, 0, Known::map_points};
const Source kitti_view{"in view, KITTI", 1, 0, 0, &Frame::kitti, false, 0, Known::in_view};
const Source kitti_both{"in both, KITTI", 1, 0, 0, &Frame::kitti, false, 0, Known::in_both};
const Source euroc_both{"in both, EuRoC", 1, 0, 0, &Frame::euroc, false, 0, Known::in_both};
const Source kitti{"pair, KITTI", 1, 0, 0, &Frame::kitti};
const Source euroc{"pair, EuRoC", 1, 0, 0, &Frame::euroc};
const Source own_kitti{"pair, KITTI, own", 1, 0, 0, &Frame::kitti, true};
const Source own_euroc{"pair, EuRoC, own", 1, 0, 0, &Frame::euroc, true};
const Source half_off{"pair, EuRoC, own, .5 px low", 1, 0, 0, &Frame::euroc, true, 0.5};
const Source one_off{"pair, EuRoC, own, 1 px low", 1, 0, 0, &Frame::euroc, true, 1};
const std::vector<Source> sources = {exact,
                                     third,
                                     {"1/1, KITTI", 1, 386},
                                     {"1/1, EuRoC", 1, 48},
                                     {"1/1, EuRoC, 5 % wrong", 1, 48, 0.05},
                                     {"1/3, EuRoC, 5 % wrong", 3, 48, 0.05},
                                     map_points,
                                     kitti_view,
                                     kitti_both,
                                     euroc_both,
                                     kitti,
                                     euroc,
                                     own_kitti,
                                     own_euroc,
                                     half_off,
                                     one_off};

std::vector<Level> render_levels(int first_seed, int last_seed, int step) {
  const odometry::OrbExtractor extractor(1000);
  std::vector<Level> levels;
  for (const char* name : {"medium", "hard", "cross", "stale_3", "two_in_one", "furniture", "desk",
                           "far", "medium_kitti", "3m_kitti", "far_kitti"}) {
    Level level{name, {}};
    for (int seed = first_seed; seed <= last_seed; ++seed) {
      const stereo_frames::Pair scenes(name, seed);
      for (int i = 7; i < scenes.left.size(); i += step) {
        level.frames.push_back(render(scenes, i, extractor));
      }
    }
    std::fprintf(stderr, "rendered %s\n", name);
    levels.push_back(std::move(level));
  }
  return levels;
}

/// Returns the depths by a host's matching, or where they matter by StereoDepths and, where that
/// finds none, by the host's matching: what the plugin takes.
std::vector<float> pair_depths(const Frame& frame, const Source& source,
                               const dynfilter::StereoDepths& stereo) {
  const Right& right = frame.*source.right;
  std::vector<float> depths_m = right.matches_m;
  if (!source.is_own) return depths_m;
  static dynfilter::Workspace workspace;
  std::vector<cv::Rect> areas;
  const dynfilter::FilterInput input{frame.view, frame.masks, frame.keypoints};
  dynfilter::stereo_areas(input, dynfilter::MaskCuller(), {}, areas);
  dynfilter::StereoPair pair = right.pair;
  if (source.rows_off_px != 0) {
    const cv::Matx23d down(1, 0, 0, 0, 1, source.rows_off_px);
    pair.right = cv::Mat();
    cv::warpAffine(right.pair.right, pair.right, down, pair.left.size(), cv::INTER_LINEAR,
                   cv::BORDER_REPLICATE);
  }
  stereo.find(pair, frame.keypoints, areas, depths_m, workspace);
  for (std::size_t i = 0; i < depths_m.size(); ++i) {
    if (depths_m[i] == 0) depths_m[i] = right.matches_m[i];
  }
  return depths_m;
}

/// Whether a nearer surface hides a pixel of the left image from the right camera.
bool is_hidden(const cv::Mat1f& exact_depth_m, cv::Point pixel, double focal_baseline) {
  constexpr double min_step_px = 3, max_apart_px = 1;
  const double disparity_px = focal_baseline / double{exact_depth_m(pixel)};
  for (int x = pixel.x + 1; x < exact_depth_m.cols; ++x) {
    const double other_px = focal_baseline / double{exact_depth_m(pixel.y, x)};
    const double apart_px = (x - other_px) - (pixel.x - disparity_px);
    if (other_px > disparity_px + min_step_px && std::abs(apart_px) < max_apart_px) return true;
  }
  return false;
}

/// Whether a host knows the depth of a feature.
bool is_known(const Frame& frame, const Source& source, std::size_t feature) {
  const cv::Point pixel = dynfilter::nearest_pixel(frame.keypoints[feature].pt);
  if (source.known == Known::map_points) {
    return feature % 2 == 0 &&
           dynfilter::feature_place(pixel, frame.true_masks, 3) == dynfilter::FeaturePlace::off;
  }
  constexpr int patch_radius = 3;
  const double focal_baseline = (frame.*source.right).pair.focal_baseline;
  const double exact_m = double{frame.exact_depth_m.at<float>(pixel)};
  if (pixel.x - focal_baseline / exact_m < patch_radius) return false;
  return source.known == Known::in_view || !is_hidden(frame.exact_depth_m, pixel, focal_baseline);
}

/// Returns the exact depths of the features that a host knows.
std::vector<float> exact_depths(const Frame& frame, const Source& source) {
  std::vector<float> depths_m(frame.keypoints.size(), 0.0F);
  for (std::size_t i = 0; i < depths_m.size(); ++i) {
    if (!is_known(frame, source, i)) continue;
    const cv::Point pixel = dynfilter::nearest_pixel(frame.keypoints[i].pt);
    depths_m[i] = frame.exact_depth_m.at<float>(pixel);
  }
  return depths_m;
}

/// Returns the column of depths of a frame. The seed is that of its errors.
std::vector<float> depths_of(const Frame& frame, const Source& source, std::uint64_t seed,
                             const dynfilter::StereoDepths& stereo) {
  if (source.known != Known::all) return exact_depths(frame, source);
  if (source.right) return pair_depths(frame, source, stereo);
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
               const Source* source = nullptr,
               const dynfilter::StereoDepths& stereo = dynfilter::StereoDepths()) {
  const dynfilter::Pipeline<dynfilter::MaskCuller, Stage> filter(dynfilter::MaskCuller{}, stage);
  std::printf("%-48s", name.c_str());
  dynfilter::FeatureLabels labels;
  dynfilter::Workspace workspace;
  for (const Level& level : levels) {
    dynfilter::FeatureScores sum;
    std::uint64_t seed = 0;
    for (const Frame& frame : level.frames) {
      if (source) {
        dynfilter::FrameView view = frame.view;
        view.depth.release();
        const std::vector<float> depths_m = depths_of(frame, *source, seed++, stereo);
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

/// Whether a matched depth is off by more than a fifth.
bool is_wrong(const Frame& frame, std::size_t i, float depth_m) {
  const cv::Point pixel = dynfilter::nearest_pixel(frame.keypoints[i].pt);
  const float exact_m = frame.exact_depth_m.at<float>(pixel);
  return depth_m > 0 && std::abs(depth_m - exact_m) > 0.2F * exact_m;
}

/// Prints how many static features the rule depth removes whose depth is not wrong.
void print_static_cost(const std::vector<Level>& levels, const Source& source) {
  const dynfilter::Pipeline<dynfilter::MaskCuller, DepthCompensator> filter(dynfilter::MaskCuller{},
                                                                            DepthCompensator{});
  std::printf("%-48s", (source.name + ", not wrong").c_str());
  for (const Level& level : levels) {
    double removed = 0;
    for (const Frame& frame : level.frames) {
      dynfilter::FrameView view = frame.view;
      view.depth.release();
      const std::vector<float> depths_m = pair_depths(frame, source, dynfilter::StereoDepths());
      const auto features = dynfilter::FeaturesView(frame.keypoints).with_depths(depths_m);
      dynfilter::FeatureLabels labels = filter.apply(view, frame.masks, features);
      for (std::size_t i = 0; i < labels.size(); ++i) {
        if (is_wrong(frame, i, depths_m[i])) labels.restore(i);
      }
      const auto scores = dynfilter::score_features(features, labels, frame.true_masks);
      removed += static_cast<double>(scores.static_removed);
    }
    std::printf("        /%5.1f       ", removed / static_cast<double>(level.frames.size()));
  }
  std::printf("\n");
}

/// Prints the shares of features that are matched, and that are matched wrongly.
void print_known_share(const std::vector<Level>& levels) {
  for (const Source& source : sources) {
    if (!source.right || source.known != Known::all) continue;
    print_static_cost(levels, source);
    std::printf("%-48s", ("matched / wrongly: " + source.name).c_str());
    for (const Level& level : levels) {
      double all = 0, matched = 0, wrong = 0;
      for (const Frame& frame : level.frames) {
        const std::vector<float> depths_m = pair_depths(frame, source, dynfilter::StereoDepths());
        for (std::size_t i = 0; i < depths_m.size(); ++i) {
          all += 1;
          matched += depths_m[i] > 0 ? 1 : 0;
          wrong += is_wrong(frame, i, depths_m[i]) ? 1 : 0;
        }
      }
      std::printf("  %12.0f %% /%3.0f %%", 100 * matched / all, 100 * wrong / all);
    }
    std::printf("\n");
  }
}

/// Prints the processor time that StereoDepths takes.
void print_time(const std::vector<Level>& levels, const Source& source) {
  std::printf("%-48s", ("ms a frame: " + source.name).c_str());
  for (const Level& level : levels) {
    const std::clock_t begin = std::clock();
    for (const Frame& frame : level.frames) pair_depths(frame, source, dynfilter::StereoDepths());
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    std::printf("  %12.2f       ", 1000 * seconds / static_cast<double>(level.frames.size()));
  }
  std::printf("\n");
}

void print_stereo_constants(const std::vector<Level>& levels) {
  const auto print = [&](const char* name, double dynfilter::StereoDepthsOptions::*option,
                         std::initializer_list<double> values) {
    for (const double value : values) {
      dynfilter::StereoDepthsOptions options;
      options.*option = value;
      char text[64];
      std::snprintf(text, sizeof text, ", %s %g", name, value);
      for (const Source* source : {&own_kitti, &own_euroc}) {
        print_row(source->name + text, levels, DepthCompensator(), source,
                  dynfilter::StereoDepths(options));
      }
    }
  };
  using Options = dynfilter::StereoDepthsOptions;
  print("min_depth_m", &Options::min_depth_m, {0.6, 1, 1.5});
  print("max_difference", &Options::max_difference, {0.4, 0.5, 0.7, 1000});
  print("min_distinction", &Options::min_distinction, {1, 1.05, 1.3});
  print("background_reach_px", &Options::background_reach_px, {60, 100, 200});
  print("hider_reach_px", &Options::hider_reach_px, {15, 60});
  print("max_hidden_px", &Options::max_hidden_px, {0, 40, 80, 120});
  print("min_matched_share", &Options::min_matched_share, {0, 0.4, 0.6});
}

void print_constants(const std::vector<Level>& levels) {
  const auto print = [&](const char* name, double DepthCompensatorOptions::*option,
                         std::initializer_list<double> values) {
    for (const double value : values) {
      DepthCompensatorOptions options;
      options.*option = value;
      char text[64];
      std::snprintf(text, sizeof text, "%s %g", name, value);
      print_row(std::string("1/3, ") + text, levels, DepthCompensator(options), &third);
      print_row(std::string("pair, EuRoC, ") + text, levels, DepthCompensator(options), &euroc);
    }
  };
  print("feature_reach_px", &DepthCompensatorOptions::feature_reach_px, {0, 20, 40, 80, 120});
  print("feature_doubt_px", &DepthCompensatorOptions::feature_doubt_px, {12, 16, 32, 48, 1000});
  print("min_feature_share", &DepthCompensatorOptions::min_feature_share,
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
    std::printf("%-48s", "");
    for (const Level& level : levels) std::printf("  %19s", level.name.c_str());
    std::printf("\n");
    print_row("mask", levels, [](const dynfilter::FilterInput&, dynfilter::FeatureLabels&) {});
    print_row("paper, depth image", levels, paper);
    print_row("depth, depth image", levels, depth);
    for (const Source* source : {&exact, &third}) {
      print_row("paper, " + source->name, levels, paper, source);
    }
    for (const Source& source : sources) print_row("depth, " + source.name, levels, depth, &source);
    print_known_share(levels);
    for (const Source* source : {&own_kitti, &own_euroc}) print_time(levels, *source);
    print_stereo_constants(levels);
    print_constants(levels);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "feature_depths: %s\n", error.what());
    return 1;
  }
  return 0;
}
