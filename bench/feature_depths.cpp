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
// of 0.11 m, as EuRoC's), or those of a stereo camera whose disparities are off by 0.5 px (standard
// deviation) at the products of focal length and baseline of KITTI (386 px m) and EuRoC (48 px m).
// Some are known at every third feature only, and some have 5 % wrong matches, whose disparity is
// random. For pairs it also prints the static features removed whose depth is unknown or right, and
// how many features are matched, and matched wrongly.

#include <algorithm>
#include <cmath>
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

constexpr double kitti_baseline_m = 0.54, euroc_baseline_m = 0.11;

struct Frame {
  std::vector<float> kitti_matches_m, euroc_matches_m;
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
  std::vector<float> Frame::*matches_m =
      nullptr;  // depths by matching; the others then do not count
};

const Source exact{"1/1"}, third{"1/3", 3};
const std::vector<Source> sources = {exact,
                                     third,
                                     {"1/1, KITTI", 1, 386},
                                     {"1/1, EuRoC", 1, 48},
                                     {"1/1, EuRoC, 5 % wrong", 1, 48, 0.05},
                                     {"1/3, EuRoC, 5 % wrong", 3, 48, 0.05},
                                     {"pair, KITTI", 1, 0, 0, &Frame::kitti_matches_m},
                                     {"pair, EuRoC", 1, 0, 0, &Frame::euroc_matches_m}};

/// Scenes of the left camera and of two right ones.
struct Pair {
  Pair(const std::string& level, int seed)
      : left(shifted(level, seed, 0)),
        kitti(shifted(level, seed, kitti_baseline_m)),
        euroc(shifted(level, seed, euroc_baseline_m)) {}

  static dynfilter::SyntheticSceneOptions shifted(const std::string& level, int seed,
                                                  double baseline_m) {
    dynfilter::SyntheticSceneOptions options =
        dynfilter::scene_level(level, static_cast<std::uint64_t>(seed));
    options.camera_shift_m = baseline_m;
    return options;
  }

  dynfilter::SyntheticScene left, kitti, euroc;
};

cv::Mat1b grey_of(const dynfilter::SyntheticFrame& rendered) {
  cv::Mat1b grey;
  cv::cvtColor(rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

/// Match of a feature in the right image.
struct Match {
  double disparity_px = 0;  // 0: none
  double difference = 0;    // of the patches around, grey levels a pixel
};

/// Returns the mean difference of the patches around two pixels, each relative to its centre. The
/// patches must lie in the images.
double patch_difference(const cv::Mat1b& left, const cv::Mat1b& right, cv::Point a, cv::Point b,
                        int radius) {
  double sum = 0;
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) {
      const cv::Point offset(x, y);
      sum += std::abs((left(a + offset) - left(a)) - (right(b + offset) - right(b)));
    }
  }
  return sum / ((2 * radius + 1) * (2 * radius + 1));
}

/// Shifts a match by at most 5 px to where the patches differ least, and to the vertex of the
/// parabola there. Returns no match if that is at the end of the search.
Match refined(const cv::Mat1b& left, const cv::Mat1b& right, cv::Point2f at, double right_x) {
  constexpr int radius = 5, reach = 5;
  const cv::Point a = dynfilter::nearest_pixel(at);
  const cv::Point b(cvRound(right_x), a.y);
  const cv::Rect inside(radius, radius, left.cols - 2 * radius, left.rows - 2 * radius);
  const cv::Point end(reach, 0);
  if (!inside.contains(a) || !inside.contains(b - end) || !inside.contains(b + end)) return {};
  std::vector<double> differences;
  for (int shift = -reach; shift <= reach; ++shift) {
    differences.push_back(patch_difference(left, right, a, b + cv::Point(shift, 0), radius));
  }
  const auto best = std::min_element(differences.begin(), differences.end());
  if (best == differences.begin() || best == differences.end() - 1) return {};
  const double before = *(best - 1), after = *(best + 1), bend = before + after - 2 * *best;
  const double vertex = bend > 0 ? 0.5 * (before - after) / bend : 0;
  return {a.x - (b.x - reach + static_cast<double>(best - differences.begin()) + vertex), *best};
}

/// Matches each feature with the most similar one in its row of the right image, refines the match
/// and drops it if the patches differ by more than twice the median. Returns the depths; 0 without
/// a match.
std::vector<float> matched_depths(const cv::Mat1b& grey, const std::vector<cv::KeyPoint>& keypoints,
                                  const cv::Mat& descriptors,
                                  const dynfilter::SyntheticScene& right_scene, int index,
                                  const odometry::OrbExtractor& extractor) {
  constexpr double max_distance = 75;  // of 256 bits
  constexpr double min_depth_m = 0.5;
  const cv::Mat1b right_grey = grey_of(right_scene.render(index));
  std::vector<cv::KeyPoint> right;
  cv::Mat right_descriptors;
  extractor.extract(right_grey, right, right_descriptors);
  const double focal_baseline = right_scene.camera().fx * right_scene.options().camera_shift_m;
  std::vector<Match> matches(keypoints.size());
  std::vector<double> differences;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    double smallest = max_distance, right_x = -1;
    for (std::size_t j = 0; j < right.size(); ++j) {
      const double disparity_px = double{keypoints[i].pt.x} - double{right[j].pt.x};
      const double rows_px = std::abs(double{keypoints[i].pt.y} - double{right[j].pt.y});
      const bool may_match = std::abs(keypoints[i].octave - right[j].octave) <= 1 &&
                             rows_px <= 2 * odometry::octave_scale(keypoints[i].octave) &&
                             disparity_px > 1 && disparity_px < focal_baseline / min_depth_m;
      if (!may_match) continue;
      const double distance =
          cv::norm(descriptors.row(static_cast<int>(i)), right_descriptors.row(static_cast<int>(j)),
                   cv::NORM_HAMMING);
      if (distance >= smallest) continue;
      smallest = distance;
      right_x = double{right[j].pt.x};
    }
    if (right_x >= 0) matches[i] = refined(grey, right_grey, keypoints[i].pt, right_x);
    if (matches[i].disparity_px > 0) differences.push_back(matches[i].difference);
  }
  std::vector<float> depths_m(keypoints.size(), 0.0F);
  if (differences.empty()) return depths_m;
  const auto median = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), median, differences.end());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!(matches[i].disparity_px > 0) || matches[i].difference > 2 * *median) continue;
    depths_m[i] = static_cast<float>(focal_baseline / matches[i].disparity_px);
  }
  return depths_m;
}

Frame render(const Pair& scenes, int index, const odometry::OrbExtractor& extractor) {
  dynfilter::SyntheticFrame rendered = scenes.left.render(index);
  Frame frame;
  const cv::Mat1b grey = grey_of(rendered);
  cv::Mat descriptors;
  extractor.extract(grey, frame.keypoints, descriptors);
  const auto matched = [&](const dynfilter::SyntheticScene& right) {
    return matched_depths(grey, frame.keypoints, descriptors, right, index, extractor);
  };
  frame.kitti_matches_m = matched(scenes.kitti);
  frame.euroc_matches_m = matched(scenes.euroc);
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
      const Pair scenes(name, seed);
      for (int i = 7; i < scenes.left.size(); i += step) {
        level.frames.push_back(render(scenes, i, extractor));
      }
    }
    std::fprintf(stderr, "rendered %s\n", name);
    levels.push_back(std::move(level));
  }
  return levels;
}

/// Returns the column of depths of a frame. The seed is that of its errors.
std::vector<float> depths_of(const Frame& frame, const Source& source, std::uint64_t seed) {
  if (source.matches_m) return frame.*source.matches_m;
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
  std::printf("%-36s", name.c_str());
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
  std::printf("%-36s", (source.name + ", not wrong").c_str());
  for (const Level& level : levels) {
    double removed = 0;
    for (const Frame& frame : level.frames) {
      dynfilter::FrameView view = frame.view;
      view.depth.release();
      const std::vector<float>& depths_m = frame.*source.matches_m;
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
    if (!source.matches_m) continue;
    print_static_cost(levels, source);
    std::printf("%-36s", ("matched / wrongly: " + source.name).c_str());
    for (const Level& level : levels) {
      double all = 0, matched = 0, wrong = 0;
      for (const Frame& frame : level.frames) {
        const std::vector<float>& depths_m = frame.*source.matches_m;
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

void print_constants(const std::vector<Level>& levels) {
  const auto print = [&](const char* name, double DepthCompensatorOptions::*option,
                         std::initializer_list<double> values) {
    for (const double value : values) {
      DepthCompensatorOptions options;
      options.*option = value;
      char text[64];
      std::snprintf(text, sizeof text, "%s %g", name, value);
      print_row(std::string("1/3, ") + text, levels, DepthCompensator(options), &third);
      print_row(std::string("pair, EuRoC, ") + text, levels, DepthCompensator(options),
                &sources.back());
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
    std::printf("%-36s", "");
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
    print_constants(levels);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "feature_depths: %s\n", error.what());
    return 1;
  }
  return 0;
}
