// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Fits the curves of StaticWeights, and measures how well the present ones are calibrated.
//
//   weight_calibration [FIRST_SEED [LAST_SEED [FRAMES [DATA_FOLDER]]]]    11 13 40, no recordings
//
// Prints the curves that fit these scenes best, to be copied to static_weights.hpp, and the
// expected calibration errors of the present curves on the same scenes. The curves were fitted to
// the seeds 11 to 13. Of recorded sequences in DATA_FOLDER, the even frames serve the fit and the
// odd ones the errors. Rule depth is judged by what is on persons, rule depth_motion by what moves;
// the former on every 30th frame of a scene, the latter on the first FRAMES.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <orb_extractor.hpp>

#include <opencv2/imgproc.hpp>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/evaluation/reliability.hpp>
#include <dynfilter/motion/motion_judge.hpp>
#include <tools/degraded_masks.hpp>
#include <tools/frame_source.hpp>
#include "lab/scenes/scene_levels.hpp"

#include "arguments.hpp"

namespace {

using dynfilter::FeatureLabels;
using dynfilter::FeaturePlace;
using dynfilter::Reliability;
using dynfilter::Segmentation;
using dynfilter::StaticCurve;
using dynfilter::StaticEvidence;
using dynfilter::StaticWeights;
using dynfilter::WeightReliability;

/// Counts of the features whose certainty is nearest to one place of a curve.
struct Place {
  double count = 0, still = 0;
};

/// The places of every curve, and the isotonic curves through them.
class Fit {
 public:
  void add(StaticEvidence kind, double certainty, bool is_static) {
    if (kind >= StaticEvidence::custom) return;
    Place& place = places_[static_cast<std::size_t>(kind)]
                          [static_cast<std::size_t>(std::lround(10 * certainty))];
    place.count += 1;
    place.still += is_static ? 1 : 0;
  }

  void print() const {
    for (std::size_t k = 0; k < places_.size(); ++k) {
      if (!has_features(places_[k])) continue;
      std::printf("      {");
      const char* comma = "";
      for (const double value : falling(places_[k])) {
        std::printf("%s%.3f", comma, value);
        comma = ", ";
      }
      std::printf("},  // %zu:", k);
      for (const Place& place : places_[k]) std::printf(" %.0f", place.count);
      std::printf(" features\n");
    }
  }

 private:
  using Places = std::array<Place, 11>;

  /// Pools neighbours that rise. Places without features take the value before them.
  static StaticCurve falling(const Places& places) {
    std::vector<std::pair<Place, std::size_t>> pools;  // and the number of places in each
    for (const Place& place : places) {
      pools.emplace_back(place, 1);
      while (pools.size() > 1 && !falls(pools[pools.size() - 2].first, pools.back().first)) {
        auto& before = pools[pools.size() - 2];
        before.first.count += pools.back().first.count;
        before.first.still += pools.back().first.still;
        before.second += pools.back().second;
        pools.pop_back();
      }
    }
    StaticCurve curve{};
    auto value = curve.begin();
    for (const auto& [place, width] : pools) {
      for (std::size_t i = 0; i < width; ++i) *value++ = place.still / std::max(place.count, 1.0);
    }
    return curve;
  }

  static bool has_features(const Places& places) {
    return std::any_of(places.begin(), places.end(),
                       [](const Place& place) { return place.count > 0; });
  }

  static bool falls(const Place& before, const Place& after) {
    return after.count > 0 && before.count > 0 &&
           after.still / after.count <= before.still / before.count;
  }

  std::array<Places, dynfilter::static_curves> places_;
};

struct Errors {
  std::string name;
  WeightReliability reliability;
};

void print(const std::vector<Errors>& all) {
  const auto error = [](const Reliability& reliability) {
    return reliability.expected_calibration_error().value_or(0);
  };
  WeightReliability sum;
  std::printf("%-44s %8s %9s %10s\n", "", "ECE", "suspected", "features");
  const auto print_row = [&](const Errors& row) {
    std::printf("%-44s %8.4f %9.4f %10zu\n", row.name.c_str(), error(row.reliability.all),
                error(row.reliability.suspected), row.reliability.all.count());
  };
  for (const Errors& row : all) {
    print_row(row);
    sum += row.reliability;
  }
  print_row({"all", sum});
  std::printf("  predicted, observed and number:\n");
  for (const dynfilter::ReliabilityBin& bin : sum.all.bins) {
    std::printf("    %.3f %.3f %8zu\n", bin.predicted(), bin.observed(), bin.count);
  }
}

/// Everything that is measured of one rule.
struct Measures {
  Fit fit;
  std::vector<Errors> errors;  // a row for each scene
};

/// What a frame is used for.
struct Use {
  bool fit = true, errors = true;
};

/// A frame's features with their true places.
struct Features {
  std::vector<cv::KeyPoint> keypoints;
  Segmentation truth;
  double rim_px = 3;
};

void add(Measures& measures, const Features& features, const FeatureLabels& labels, Use use) {
  if (use.errors) {
    measures.errors.back().reliability +=
        dynfilter::score_weights(features.keypoints, labels, dynfilter::static_weights(labels),
                                 features.truth, features.rim_px);
  }
  for (std::size_t i = 0; use.fit && i < labels.size(); ++i) {
    const auto place = dynfilter::feature_place(dynfilter::nearest_pixel(features.keypoints[i].pt),
                                                features.truth, features.rim_px);
    if (place == FeaturePlace::on_rim) continue;
    measures.fit.add(StaticWeights::evidence(labels, i), StaticWeights::certainty(labels, i),
                     place == FeaturePlace::off);
  }
}

std::vector<cv::KeyPoint> extracted(const cv::Mat& image) {
  static const odometry::OrbExtractor extractor(1000);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat grey, descriptors;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  extractor.extract(grey, keypoints, descriptors);
  return keypoints;
}

using DepthRule = dynfilter::Pipeline<dynfilter::MaskCuller, dynfilter::DepthCompensator>;

void measure_depth(Measures& measures, std::uint64_t first_seed, std::uint64_t last_seed) {
  const DepthRule rule{dynfilter::MaskCuller(), dynfilter::DepthCompensator()};
  for (const char* level :
       {"static", "cross", "medium", "hard", "stale_3", "stale_6", "late_10hz", "furniture",
        "two_in_one", "leave", "depth_late_33", "desk", "two_near", "hair"}) {
    measures.errors.push_back({level, {}});
    for (std::uint64_t seed = first_seed; seed <= last_seed; ++seed) {
      const dynfilter::SyntheticScene scene(dynfilter::scene_level(level, seed));
      for (int i = 7; i < scene.size(); i += 30) {
        dynfilter::SyntheticFrame frame = scene.render(i);
        const Features features{extracted(frame.frame.image), std::move(frame.true_segmentation)};
        add(measures, features,
            rule.apply(frame.frame, frame.poor_segmentation, features.keypoints), {});
      }
    }
  }
}

/// Measures a recorded sequence, whose odd frames are not fitted.
void measure_recording(Measures& measures, const std::filesystem::path& folder,
                       const std::string& degraded) {
  namespace tools = dynfilter::tools;
  const DepthRule rule{dynfilter::MaskCuller(), dynfilter::DepthCompensator()};
  std::unique_ptr<tools::FrameSource> source = tools::open_sequence(folder);
  if (!degraded.empty()) source = tools::degrade_masks(std::move(source), degraded);
  measures.errors.push_back(
      {folder.filename().string() + (degraded.empty() ? "" : " ") + degraded, {}});
  for (std::size_t i = 0; i < source->size(); ++i) {
    const tools::SourceFrame frame = source->read(i);
    const Features features{extracted(frame.frame.image), *frame.true_masks, source->rim_px()};
    add(measures, features, rule.apply(frame.frame, frame.masks, features.keypoints),
        {i % 2 == 0, i % 2 == 1});
  }
}

void measure_motion(Measures& measures, std::uint64_t first_seed, std::uint64_t last_seed,
                    int frames) {
  const DepthRule rule{dynfilter::MaskCuller(), dynfilter::DepthCompensator()};
  for (const char* level : {"static", "medium", "sitting", "stop_and_go", "pushed", "carried",
                            "still_camera", "crowd"}) {
    measures.errors.push_back({level, {}});
    for (std::uint64_t seed = first_seed; seed <= last_seed; ++seed) {
      const dynfilter::SyntheticScene scene(dynfilter::scene_level(level, seed));
      const dynfilter::CameraParameters camera = scene.camera();
      dynfilter::MotionState state;
      const dynfilter::MotionJudge judge({camera.fx, camera.fy, camera.cx, camera.cy}, state);
      dynfilter::Workspace workspace;
      for (int i = 0; i < frames; ++i) {
        const dynfilter::SyntheticFrame frame = scene.render(i);
        Features features{extracted(frame.frame.image), {}};
        features.truth.image_size = frame.frame.image.size();
        features.truth.instances = {dynfilter::Instance::from_image_mask(frame.moving_mask)};
        FeatureLabels labels = rule.apply(frame.frame, frame.poor_segmentation, features.keypoints);
        judge({frame.frame, frame.poor_segmentation, features.keypoints}, labels, workspace);
        // Where motion abstains, the labels are those of rule depth.
        const bool is_judged =
            labels.statistics().motion.outcome == dynfilter::MotionOutcome::applied;
        add(measures, features, labels, {is_judged, true});
      }
    }
  }
}

void print(const char* rule, const Measures& measures) {
  std::printf("\nrule %s: the curves that fit best\n", rule);
  measures.fit.print();
  std::printf("\nrule %s: errors of the present curves\n", rule);
  print(measures.errors);
  std::fflush(stdout);
}

}  // namespace

int main(int count, char** words) {
  try {
    const int first = argument(count, words, 1, 11), last = argument(count, words, 2, first + 2);
    const int frames = argument(count, words, 3, 40);
    const auto first_seed = static_cast<std::uint64_t>(first);
    const auto last_seed = static_cast<std::uint64_t>(last);
    Measures depth, recorded, motion;
    measure_depth(depth, first_seed, last_seed);
    print("depth, rendered", depth);
    if (count > 4) {
      recorded.fit = depth.fit;
      const std::filesystem::path folder = words[4];
      for (const char* how : {"eroded", "cut", "disc", "poor", "late"}) {
        measure_recording(recorded, folder / "tum_fr3_walking_halfsphere_50", how);
      }
      for (const char* name : {"composite_person_in_step_48", "composite_person_depth_late_48"}) {
        measure_recording(recorded, folder / name, "");
      }
      print("depth, rendered and recorded", recorded);
    }
    measure_motion(motion, first_seed, last_seed, frames);
    print("depth_motion, rendered", motion);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "weight_calibration: %s\n", error.what());
    return 1;
  }
  return 0;
}
