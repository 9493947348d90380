// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Alternatives to the filter, written from their descriptions with calls to OpenCV. No code of the
// named systems is here.

#include "filter_peers.hpp"

#include <benchmark/benchmark.h>

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "filter_check.hpp"
#include "filter_input.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "peers/naive_depth_lbp.hpp"

namespace dynfilter::benchmarks {
namespace {

const FilterInputData& usual_input() {
  static const FilterInputData input = make_filter_input({640, 480}, 1000, 3);
  return input;
}

/// Mask of the whole image with all persons: 0 = on a person, 1 = static.
cv::Mat static_mask_of(const FilterInputData& input) {
  cv::Mat mask(input.frame.depth.size(), CV_8UC1, cv::Scalar(1));
  for (const Instance& instance : input.segmentation.instances) {
    const cv::Rect place(instance.mask_origin, instance.mask.size());
    mask(place).setTo(cv::Scalar(0), instance.mask);
  }
  return mask;
}

/// DynaSLAM (B. Bescos et al., RA-L 2018): erodes the static mask by an ellipse of 31x31 and copies
/// the remaining keypoints one by one with their descriptors. The ellipse is made beforehand.
void dilation(benchmark::State& state) {
  const FilterInputData& input = usual_input();
  const cv::Mat is_static = static_mask_of(input);
  const cv::Mat ellipse = cv::getStructuringElement(cv::MORPH_ELLIPSE, {31, 31});
  cv::Mat eroded, descriptors;
  std::vector<cv::KeyPoint> keypoints;
  for (auto _ : state) {
    cv::erode(is_static, eroded, ellipse);
    keypoints.clear();
    descriptors = cv::Mat();
    for (std::size_t i = 0; i < input.keypoints.size(); ++i) {
      if (eroded.at<std::uint8_t>(nearest_pixel(input.keypoints[i].pt)) == 0) continue;
      keypoints.push_back(input.keypoints[i]);
      descriptors.push_back(input.descriptors.row(static_cast<int>(i)));
    }
    benchmark::DoNotOptimize(descriptors.data);
  }
  bool all_static = !keypoints.empty() && keypoints.size() < input.keypoints.size();
  for (const cv::KeyPoint& keypoint : keypoints) {
    all_static = all_static && is_static.at<std::uint8_t>(nearest_pixel(keypoint.pt)) != 0;
  }
  if (!all_static) state.SkipWithError("a keypoint on a person was kept, or none was removed");
}

/// Naive version of the paper's rule: codes of the whole image by cv::Mat::at, a new vector for
/// everything, full-frame masks, and kept features appended to new arrays.
class NaiveFilter {
 public:
  explicit NaiveFilter(const FilterInputData& input) : input_(input) {
    for (const Instance& instance : input.segmentation.instances) {
      cv::Mat mask = cv::Mat::zeros(input.frame.depth.size(), CV_8UC1);
      instance.mask.copyTo(mask(cv::Rect(instance.mask_origin, instance.mask.size())));
      masks_.push_back(mask);
    }
  }

  std::vector<cv::KeyPoint> filter(cv::Mat& descriptors) const {
    cv::Mat codes = cv::Mat::zeros(input_.frame.depth.size(), CV_8UC1);
    peers::naive_dense<std::uint16_t>(input_.frame.depth, {0, codes.rows}, codes);
    std::vector<int> owners(input_.keypoints.size(), -1);
    for (std::size_t i = 0; i < owners.size(); ++i) {
      for (std::size_t k = 0; k < masks_.size() && owners[i] < 0; ++k) {
        if (masks_[k].at<std::uint8_t>(pixel(i)) != 0) owners[i] = static_cast<int>(k);
      }
    }
    const std::vector<int> masked = owners;
    for (std::size_t k = 0; k < masks_.size(); ++k) compensate(k, codes, masked, owners);
    std::vector<cv::KeyPoint> kept;
    descriptors = cv::Mat();
    for (std::size_t i = 0; i < owners.size(); ++i) {
      if (owners[i] >= 0) continue;
      kept.push_back(input_.keypoints[i]);
      descriptors.push_back(input_.descriptors.row(static_cast<int>(i)));
    }
    return kept;
  }

 private:
  cv::Point pixel(std::size_t i) const { return nearest_pixel(input_.keypoints[i].pt); }

  double metres(std::size_t i) const {
    return input_.frame.depth.at<std::uint16_t>(pixel(i)) * input_.frame.metres_per_unit;
  }

  void compensate(std::size_t k, const cv::Mat& codes, const std::vector<int>& masked,
                  std::vector<int>& owners) const {
    const Instance& instance = input_.segmentation.instances[k];
    const FeatureSampler sampler;
    std::vector<SampleCandidate> sample;
    for (std::size_t i = 0; i < masked.size(); ++i) {
      if (masked[i] != static_cast<int>(k) || metres(i) == 0) continue;
      sample.push_back({pixel(i) - instance.box.tl(), i});
    }
    sampler.draw(input_.frame.id, k, sample);
    std::vector<double> depths, sampled_codes;
    for (const SampleCandidate& candidate : sample) {
      depths.push_back(metres(candidate.feature));
      sampled_codes.push_back(codes.at<std::uint8_t>(pixel(candidate.feature)));
    }
    const EdgeCompensatorOptions options = EdgeCompensatorOptions::paper();
    const ValueRange depth_range = RangeEstimator(options.depth).estimate(depths);
    const ValueRange code_range = RangeEstimator(options.code).estimate(sampled_codes);
    for (std::size_t i = 0; i < owners.size(); ++i) {
      if (owners[i] >= 0 || !instance.box.contains(pixel(i)) || metres(i) == 0) continue;
      const bool fits =
          depth_range.contains(metres(i)) && code_range.contains(codes.at<std::uint8_t>(pixel(i)));
      if (fits) owners[i] = static_cast<int>(k);
    }
  }

  const FilterInputData& input_;
  std::vector<cv::Mat> masks_;
};

void naive_filter(benchmark::State& state) {
  const FilterInputData& input = usual_input();
  const NaiveFilter naive(input);
  DynamicFilterOptions options;
  options.compensator.rule = CompensationRule::paper;
  const FeatureLabels labels =
      DynamicFilter(options).apply(input.frame, input.segmentation, input.keypoints);
  cv::Mat descriptors;
  if (naive.filter(descriptors).size() != labels.statistics().kept()) {
    state.SkipWithError("it keeps other features than the filter");
    return;
  }
  for (auto _ : state) benchmark::DoNotOptimize(naive.filter(descriptors).data());
}

/// Two neighbouring frames of a rendered scene with three persons, for methods that need texture.
struct Scene {
  Scene() {
    SyntheticSceneOptions options = scene_level("medium", 1);
    options.persons = 3;
    const SyntheticScene scene(options);
    frame = scene.render(40);
    cv::cvtColor(frame.frame.image, grey, cv::COLOR_BGR2GRAY);
    cv::cvtColor(scene.render(41).frame.image, next_grey, cv::COLOR_BGR2GRAY);
    cv::ORB::create(1000)->detect(grey, keypoints);
  }

  static const Scene& instance() {
    static const Scene scene;
    return scene;
  }

  SyntheticFrame frame;
  cv::Mat grey, next_grey;
  std::vector<cv::KeyPoint> keypoints;
};

/// Moving consistency check of DS-SLAM (C. Yu et al., IROS 2018): corners, their optical flow to
/// the next frame, and the fundamental matrix, which identifies outliers.
void lk_fundamental(benchmark::State& state) {
  const Scene& scene = Scene::instance();
  std::size_t tracked = 0;
  cv::Mat fundamental;
  for (auto _ : state) {
    std::vector<cv::Point2f> corners, moved, from, to;
    std::vector<std::uint8_t> found;
    cv::goodFeaturesToTrack(scene.grey, corners, 1000, 0.01, 8);
    cv::calcOpticalFlowPyrLK(scene.grey, scene.next_grey, corners, moved, found, cv::noArray(),
                             {22, 22}, 5);
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i] == 0) continue;
      from.push_back(corners[i]);
      to.push_back(moved[i]);
    }
    fundamental = cv::findFundamentalMat(from, to, cv::FM_RANSAC, 0.1, 0.99);
    tracked = from.size();
  }
  if (tracked < 100 || fundamental.rows != 3) state.SkipWithError("nothing was tracked");
}

void orb_extraction(benchmark::State& state) {
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(1000);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  for (auto _ : state) {
    orb->detectAndCompute(Scene::instance().grey, cv::noArray(), keypoints, descriptors);
    benchmark::DoNotOptimize(descriptors.data);
  }
  if (keypoints.size() < 900) state.SkipWithError("too few keypoints");
}

/// Filter on the frame whose ORB extraction is timed; many of its features are on persons.
void filter_scene(benchmark::State& state, CompensationRule rule) {
  const Scene& scene = Scene::instance();
  DynamicFilterOptions options;
  options.compensator.rule = rule;
  const DynamicFilter filter(options);
  const SyntheticFrame& frame = scene.frame;
  FeatureLabels labels;
  Workspace workspace;
  const auto apply = [&] {
    filter.apply(frame.frame, frame.poor_segmentation, scene.keypoints, labels, workspace);
  };
  apply();
  const FilterInputData input = {frame.frame, frame.poor_segmentation, scene.keypoints, {}};
  const std::string complaint = check_labels(input, options, labels);
  if (!complaint.empty()) state.SkipWithError(complaint.c_str());
  for (auto _ : state) {
    apply();
    benchmark::DoNotOptimize(labels);
    benchmark::ClobberMemory();
  }
  state.counters["masked"] = static_cast<double>(labels.statistics().masked);
  state.counters["compensated"] = static_cast<double>(labels.statistics().compensated);
}

}  // namespace

void register_filter_peers() {
  const auto add = [](const char* name, auto function) {
    benchmark::RegisterBenchmark(name, function)->Unit(benchmark::kMicrosecond);
  };
  add("peer/dilation/640x480/1000/3", dilation);
  add("peer/naive_filter/640x480/1000/3", naive_filter);
  add("peer/lk_fundamental/scene", lk_fundamental);
  add("peer/orb_extraction/scene", orb_extraction);
  const auto add_scene = [&](const char* name, CompensationRule rule) {
    add(name, [rule](benchmark::State& state) { filter_scene(state, rule); });
  };
  add_scene("filter/paper/scene", CompensationRule::paper);
  add_scene("filter/depth/scene", CompensationRule::depth);
}

}  // namespace dynfilter::benchmarks
