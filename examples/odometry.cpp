// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tracks the camera through a recorded RGB-D sequence, with or without the features on persons.

#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <dynfilter/evaluation/rgbd_sequence.hpp>
#include <dynfilter/evaluation/trajectory_errors.hpp>
#include <dynfilter/segmenters/mask_folder_segmenter.hpp>

#include "lab/odometry/odometry.hpp"

namespace {

constexpr const char* usage =
    R"(odometry SEQUENCE [--masks DIR] [--rule none|mask|paper|depth] [--out FILE] [--seed N]

Tracks the camera through SEQUENCE, a folder in the layout of TUM RGB-D or BONN, and prints the
errors of the trajectory if SEQUENCE has a groundtruth.txt.

  --masks DIR   masks of persons; default: masks/ in SEQUENCE
  --rule RULE   removed features: none; mask, features on masks; paper, also features that masks
                missed, by the paper's rule; depth (default), also those, by the object's depth
  --out FILE    writes the trajectory, in the format of TUM RGB-D
  --seed N      seed of random samples, 0 by default

odometry data/tum_fr3_walking_halfsphere_50 --rule mask --out trajectory.txt
)";

struct Arguments {
  std::filesystem::path sequence;
  std::filesystem::path masks;
  std::string rule = "depth";
  std::filesystem::path out;
  std::uint64_t seed = 0;
  bool help = false;
};

std::uint64_t number_of(const std::string& text) {
  std::size_t used = 0;
  std::uint64_t number = 0;
  try {
    number = std::stoull(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size() || text[0] == '-') {
    throw std::invalid_argument("--seed " + text + " is no number");
  }
  return number;
}

Arguments parse(const std::vector<std::string>& words) {
  Arguments arguments;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    const auto value = [&]() -> const std::string& {
      if (i + 1 == words.size()) throw std::invalid_argument(word + " needs a value");
      return words[++i];
    };
    if (word == "--help" || word == "-h") {
      arguments.help = true;
    } else if (word == "--masks") {
      arguments.masks = value();
    } else if (word == "--rule") {
      arguments.rule = value();
    } else if (word == "--out") {
      arguments.out = value();
    } else if (word == "--seed") {
      arguments.seed = number_of(value());
    } else if (word[0] == '-' || !arguments.sequence.empty()) {
      throw std::invalid_argument("what is " + word + "? See --help");
    } else {
      arguments.sequence = word;
    }
  }
  if (!arguments.help && arguments.sequence.empty()) {
    throw std::invalid_argument("no sequence given. See --help");
  }
  return arguments;
}

dynfilter::DynamicFilter filter_of(const std::string& rule) {
  using dynfilter::CompensationRule;
  dynfilter::DynamicFilterOptions options;
  if (rule == "depth") {
    options.compensator.rule = CompensationRule::depth;
  } else if (rule == "paper") {
    options.compensator.rule = CompensationRule::paper;
  } else if (rule == "mask" || rule == "none") {
    options.compensator.rule = CompensationRule::mask;
  } else {
    throw std::invalid_argument("--rule " + rule + " is none of: none, mask, paper, depth");
  }
  return dynfilter::DynamicFilter(options);
}

std::optional<dynfilter::MaskFolderSegmenter> masks_of(const Arguments& arguments,
                                                       const dynfilter::RgbdSequence& sequence) {
  if (arguments.rule == "none") return {};
  if (!arguments.masks.empty()) return dynfilter::MaskFolderSegmenter(arguments.masks);
  if (!sequence.masks_folder()) {
    throw std::runtime_error(arguments.sequence.string() +
                             " has no masks/: give --masks DIR or --rule none");
  }
  return dynfilter::MaskFolderSegmenter(*sequence.masks_folder());
}

void print_errors(const dynfilter::Trajectory& estimate, const dynfilter::RgbdSequence& sequence) {
  if (!sequence.groundtruth_file()) return;
  const auto truth = dynfilter::read_trajectory(*sequence.groundtruth_file());
  const auto ate = dynfilter::absolute_trajectory_error(estimate, truth);
  const auto rpe = dynfilter::relative_pose_error(estimate, truth);
  std::printf("ATE rmse                  %10.4f m of %zu poses\n", ate.translation_m.rmse,
              ate.translation_m.count);
  std::printf("RPE rmse over 1 s         %10.4f m %8.4f deg\n", rpe.translation_m.rmse,
              rpe.rotation_deg.rmse);
}

void show_progress(std::size_t done, std::size_t total) {
  if (isatty(STDERR_FILENO) == 0) return;
  std::fprintf(stderr, "\rframe %zu/%zu%s", done, total, done == total ? "\n" : "");
}

int run(const Arguments& arguments) {
  const dynfilter::RgbdSequence sequence(arguments.sequence);
  auto masks = masks_of(arguments, sequence);
  odometry::OdometryOptions options;
  options.seed = arguments.seed;
  odometry::Odometry tracker(sequence.camera(), options, filter_of(arguments.rule));
  double tracking_s = 0;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const dynfilter::FrameView frame = sequence.read(i);
    std::optional<dynfilter::Segmentation> segmentation;
    if (masks) segmentation = masks->segment(frame);
    const auto start = std::chrono::steady_clock::now();
    tracker.track(frame, segmentation);
    tracking_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    show_progress(i + 1, sequence.size());
  }
  if (!arguments.out.empty()) dynfilter::write_trajectory(arguments.out, tracker.trajectory());
  std::printf("frames                    %10zu, %zu lost, %zu without a map\n", sequence.size(),
              tracker.lost_frames(), sequence.size() - tracker.trajectory().size());
  std::printf("keyframes                 %10zu\n", tracker.keyframes());
  std::printf("time a frame              %10.1f ms, images and masks not counted\n",
              1000 * tracking_s / static_cast<double>(sequence.size()));
  print_errors(tracker.trajectory(), sequence);
  return 0;
}

}  // namespace

int main(int count, char** words) {
  try {
    const Arguments arguments = parse({words + 1, words + count});
    if (!arguments.help) return run(arguments);
    std::fputs(usage, stdout);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "odometry: %s\n", error.what());
    return 1;
  }
}
