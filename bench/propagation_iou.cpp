// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Measures how well moved masks overlap rendered persons, by lag and level.
//
//   propagation_iou [FIRST_SEED [LAST_SEED [WINDOWS [--options]]]]    21 22 4 by default
//
// Takes WINDOWS stretches of frames from each scene and moves the exact masks of a stretch's first
// frame through it. Prints the intersection over union with the true masks 1, 3, 6 and 9 frames
// later, as a mean over persons: for masks left in place, moved, and moved after arriving 6 frames
// late. A person counts if it has 2000 visible pixels in the first frame and 500 in the later one.
// Then prints the same for boxes, and for the poor masks and boxes of a level, against those that
// the detector finds in the later frame. "by features": 1000 ORB features are tracked from each
// frame to the last one, as for the component motion, and move the masks; the propagator tracks no
// points. With --options, prints the effect of other option values.

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/features2d.hpp>

#include <dynfilter/motion/feature_tracker.hpp>
#include <dynfilter/segmenters/mask_propagator.hpp>
#include "lab/scenes/scene_levels.hpp"

#include "arguments.hpp"

namespace {

using dynfilter::Instance;
using dynfilter::Segmentation;

constexpr int lags[] = {1, 3, 6, 9};
constexpr int late = 6;
constexpr int before = 2;  // frames of a stretch before the one with masks

struct Stretch {
  std::vector<dynfilter::SyntheticFrame> frames;
  std::vector<std::vector<dynfilter::PointMotion>> motions;  // of features, into each frame
};

struct Level {
  std::string name;
  std::vector<Stretch> stretches;
};

/// Tracks the features of each frame to the frame before it.
std::vector<std::vector<dynfilter::PointMotion>> feature_motions(const Stretch& stretch) {
  const dynfilter::FeatureTracker tracker;
  const auto orb = cv::ORB::create(1000);
  dynfilter::Workspace workspace;
  std::vector<std::vector<dynfilter::PointMotion>> motions(1);
  dynfilter::ImagePyramid last, now;
  for (const dynfilter::SyntheticFrame& frame : stretch.frames) {
    std::swap(last, now);
    tracker.build(frame.frame.image, now);
    if (last.empty()) continue;
    std::vector<cv::KeyPoint> features;
    orb->detect(frame.frame.image, features);
    std::vector<dynfilter::FeatureTrack> tracks;
    tracker.track(now, last, features, nullptr, tracks, workspace);
    motions.push_back(point_motions(features, tracks));
  }
  return motions;
}

std::vector<Level> render(int first_seed, int last_seed, int windows) {
  std::vector<Level> levels;
  for (const char* name : {"cross", "together", "medium", "furniture", "leave"}) {
    Level level{name, {}};
    for (int seed = first_seed; seed <= last_seed; ++seed) {
      const dynfilter::SyntheticScene scene(
          dynfilter::scene_level(name, static_cast<std::uint64_t>(seed)));
      for (int i = 0; i < windows; ++i) {
        Stretch stretch;
        const int start = 10 + i * 270 / windows;
        for (int k = 0; k <= before + lags[3]; ++k) {
          stretch.frames.push_back(scene.render(start + k));
        }
        stretch.motions = feature_motions(stretch);
        level.stretches.push_back(std::move(stretch));
      }
    }
    std::fprintf(stderr, "rendered %s\n", name);
    levels.push_back(std::move(level));
  }
  return levels;
}

cv::Mat1b painted(const Instance& instance, const cv::Size& size) {
  cv::Mat1b image(size, std::uint8_t{0});
  if (instance.mask.empty()) return image;
  const cv::Rect place = cv::Rect(instance.mask_origin, instance.mask.size());
  image(place).setTo(255, instance.mask);
  return image;
}

double mask_iou(const Instance& a, const Instance& b, const cv::Size& size) {
  const cv::Mat1b first = painted(a, size), second = painted(b, size);
  const int either = cv::countNonZero(first | second);
  return either == 0 ? 1.0 : double{1} * cv::countNonZero(first & second) / either;
}

double box_iou(const Instance& a, const Instance& b, const cv::Size& size) {
  const cv::Rect image({}, size);
  const double both = (a.box & b.box & image).area();
  return both / ((a.box & image).area() + (b.box & image).area() - both);
}

const Instance* find(const Segmentation& segmentation, int track_id) {
  for (const Instance& instance : segmentation.instances) {
    if (instance.track_id == track_id) return &instance;
  }
  return nullptr;
}

/// Kind of masks, and the measure that compares two instances.
struct Question {
  Segmentation dynfilter::SyntheticFrame::*masks;
  double (*overlap)(const Instance&, const Instance&, const cv::Size&);
  bool without_masks = false;
  bool by_features = false;
};

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  double value() const { return count == 0 ? 0 : sum / count; }
};

using Means = std::map<int, Mean>;  // by lag

/// Measures a stretch whose masks arrive `arrival` frames late; negative: they stay in place.
void measure(const Stretch& stretch, const Question& question, int arrival,
             const dynfilter::MaskPropagatorOptions& options, Means& means) {
  const bool is_moved = arrival >= 0;
  dynfilter::MaskPropagator propagator(options);
  const dynfilter::SyntheticFrame& first = stretch.frames[before];
  Segmentation masks = first.*question.masks;
  for (Instance& instance : masks.instances) {
    if (question.without_masks) instance.mask.release();
  }
  for (int k = -before; k <= lags[3]; ++k) {
    const dynfilter::SyntheticFrame& frame = stretch.frames[static_cast<std::size_t>(before + k)];
    std::optional<Segmentation> moved = masks;
    if (is_moved) {
      std::optional<Segmentation> newest;
      if (k >= arrival) newest = masks;
      const auto place = static_cast<std::size_t>(before + k);
      moved = question.by_features
                  ? propagator.propagate(frame.frame, newest, stretch.motions[place])
                  : propagator.propagate(frame.frame, newest);
    }
    if (std::find(std::begin(lags), std::end(lags), k) == std::end(lags) || k < arrival) continue;
    for (const Instance& source : first.true_segmentation.instances) {
      const Instance* seen = find(frame.true_segmentation, *source.track_id);
      const bool counts = cv::countNonZero(source.mask) >= 2000 && seen != nullptr &&
                          cv::countNonZero(seen->mask) >= 500;
      if (!counts) continue;
      const Instance* want = find(frame.*question.masks, *source.track_id);
      if (want == nullptr || find(masks, *source.track_id) == nullptr) continue;
      const Instance* got = moved ? find(*moved, *source.track_id) : nullptr;
      means[k].add(got == nullptr ? 0 : question.overlap(*got, *want, masks.image_size));
    }
  }
}

void print_row(const std::string& name, const std::vector<Level>& levels, const Question& question,
               int arrival, const dynfilter::MaskPropagatorOptions& options = {}) {
  std::printf("%-30s", name.c_str());
  Means of_all;
  for (const Level& level : levels) {
    Means means;
    for (const Stretch& stretch : level.stretches) {
      measure(stretch, question, arrival, options, means);
    }
    std::printf(" |");
    for (const int lag : lags) {
      if (lag < arrival) {
        std::printf("     ");
        continue;
      }
      std::printf(" %.2f", means[lag].value());
      of_all[lag].add(means[lag].value());
    }
  }
  std::printf(" |");
  for (const int lag : lags) {
    if (lag < arrival) {
      std::printf("      ");
    } else {
      std::printf(" %.3f", of_all[lag].value());
    }
  }
  std::printf("\n");
  std::fflush(stdout);
}

void print_options(const std::vector<Level>& levels, const Question& question) {
  const auto row = [&](const char* name, auto dynfilter::MaskPropagatorOptions::*member,
                       std::initializer_list<double> values) {
    for (const double value : values) {
      dynfilter::MaskPropagatorOptions options;
      using Value = std::decay_t<decltype(options.*member)>;
      options.*member = static_cast<Value>(value);
      char text[64];
      std::snprintf(text, sizeof text, "%s %g", name, value);
      print_row(text, levels, question, 0, options);
    }
  };
  using Options = dynfilter::MaskPropagatorOptions;
  row("work_width_px", &Options::work_width_px, {160, 213, 427, 640});
  row("point_spacing_px", &Options::point_spacing_px, {5, 6, 12, 16});
  row("max_forward_backward_px", &Options::max_forward_backward_px, {0.4, 0.7, 1.0, 2.0, 3.0, 100});
  row("field_sigma_px", &Options::field_sigma_px, {7, 10, 20, 30, 1000});
  row("edge_px", &Options::edge_px, {0, 2, 3, 4, 6, 8, 10});
  row("min_points", &Options::min_points, {1, 5, 10, 20});
}

}  // namespace

int main(int count, char** words) {
  try {
    cv::setNumThreads(1);
    const bool with_options = count > 1 && std::strcmp(words[count - 1], "--options") == 0;
    if (with_options) --count;
    const int first = argument(count, words, 1, 21);
    const std::vector<Level> levels =
        render(first, argument(count, words, 2, first + 1), argument(count, words, 3, 4));
    std::printf("%-30s", "");
    for (const Level& level : levels) std::printf(" | %-19s", level.name.c_str());
    std::printf(" | mean\n%-30s", "frames");
    for (std::size_t i = 0; i < levels.size(); ++i) std::printf(" |    1    3    6    9");
    std::printf(" |     1     3     6     9\n");
    using Frame = dynfilter::SyntheticFrame;
    const Question exact{&Frame::true_segmentation, mask_iou};
    const Question exact_boxes{&Frame::true_segmentation, box_iou};
    const Question only_boxes{&Frame::true_segmentation, box_iou, true};
    const Question poor{&Frame::poor_segmentation, mask_iou};
    const Question poor_boxes{&Frame::poor_segmentation, box_iou};
    const std::pair<const char*, Question> questions[] = {{"exact masks", exact},
                                                          {"their boxes", exact_boxes},
                                                          {"boxes without masks", only_boxes},
                                                          {"poor masks", poor},
                                                          {"their boxes", poor_boxes}};
    for (auto [name, question] : questions) {
      print_row(std::string(name) + ", left", levels, question, -1);
      print_row(std::string(name) + ", moved", levels, question, 0);
      print_row(std::string(name) + ", late", levels, question, late);
      question.by_features = true;
      print_row(std::string(name) + ", by features", levels, question, 0);
    }
    if (with_options) print_options(levels, exact);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "propagation_iou: %s\n", error.what());
    return 1;
  }
  return 0;
}
