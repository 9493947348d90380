// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "commands.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/diagnosis/depth_offset_estimator.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "frame_source.hpp"
#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "progress_bar.hpp"
#include "shared_options.hpp"

namespace dynfilter::tools {
namespace {

struct SyncOptions {
  std::filesystem::path sequence, camera;
  std::optional<double> depth_offset_s;
  std::filesystem::path write;  // empty: none
};

DepthOffsetEstimate estimate_offset(const RgbdSequence& sequence) {
  DepthOffsetEstimator estimator;
  ProgressBar progress("comparing edges", sequence.size());
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    estimator.add(sequence.read(i), sequence.entry(i).depth_timestamp_s);
    progress.advance();
  }
  return estimator.estimate();
}

const char* reason_of(DepthOffsetVerdict verdict) {
  switch (verdict) {
    case DepthOffsetVerdict::too_few_frames:
      return "too few successive frames have edges of depth";
    case DepthOffsetVerdict::nothing_moves:
      return "too little moves: every offset fits as well";
    case DepthOffsetVerdict::out_of_reach:
      return "the best of the offsets tried is the first or the last";
    case DepthOffsetVerdict::uncertain:
      return "the measurements scatter too much";
    case DepthOffsetVerdict::measured:
      break;
  }
  return "";
}

/// Says in a line how late depth is, or why that is not known.
std::string depth_offset_text(const DepthOffsetEstimate& estimate) {
  if (!estimate.offset) {
    return std::string("depth offset unknown: ") + reason_of(estimate.verdict);
  }
  const DepthOffset& offset = *estimate.offset;
  const bool is_early = offset.frames_late < 0, is_in_step = std::abs(offset.frames_late) <= 0.25;
  using detail::fixed_decimals;
  const std::string late =
      fixed_decimals(is_in_step ? offset.frames_late : std::abs(offset.frames_late), 2) +
      " frames (+-" + fixed_decimals(offset.sigma_frames, 2) + ")";
  if (is_in_step) return "depth is in step: late by " + late;
  return std::string("depth is ") + (is_early ? "early" : "late") + " by " + late +
         "; its stamps belong with images " + fixed_decimals(std::abs(offset.seconds), 3) +
         (offset.seconds < 0 ? " s later" : " s earlier");
}

/// Returns a file's path as ORB-SLAM's loader wants it: relative, because it is appended to the
/// sequence's folder. Refuses blanks, which divide a row there.
std::string listed(const std::filesystem::path& file, const std::filesystem::path& folder) {
  auto path = std::filesystem::absolute(file).lexically_normal();
  path = path.lexically_relative(folder.lexically_normal());
  if (path.empty() || *path.begin() == "..") path = std::filesystem::relative(file, folder);
  if (path.native().find_first_of(" \t") == std::string::npos) return path.string();
  detail::throw_file_error(file, "has a blank in its path, where SLAM programs divide a row");
}

std::string associations_text(const RgbdSequence& sequence) {
  const std::filesystem::path folder = std::filesystem::absolute(sequence.folder());
  std::string text;  // without a comment, which ORB-SLAM's loader takes for a frame
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const RgbdSequenceEntry& entry = sequence.entry(i);
    text += detail::time_text(entry.timestamp_s) + ' ' + listed(entry.image_path, folder) + ' ' +
            detail::time_text(entry.depth_timestamp_s) + ' ' + listed(entry.depth_path, folder) +
            '\n';
  }
  return text;
}

void sync(const SyncOptions& options) {
  const RgbdSequenceOptions given{0.02, options.camera, options.depth_offset_s};
  const RgbdSequence sequence(options.sequence, given);
  if (!sequence.has_depth()) {
    detail::throw_file_error(options.sequence, "has no depth images to compare with");
  }
  if (std::filesystem::exists(std::filesystem::symlink_status(options.write))) {
    detail::throw_file_error(options.write, "exists; name another file");
  }
  const DepthOffsetEstimate estimate = estimate_offset(sequence);
  // Out of step by more than half a frame, another pairing is better.
  const bool is_late = estimate.offset && std::abs(estimate.offset->frames_late) > 0.5;
  const double offset_s =
      is_late ? std::round(estimate.offset->seconds * 1000) / 1000 : sequence.depth_offset_s();
  std::printf("%zu frames compared, paired with a depth offset of %g s\n", estimate.frames,
              sequence.depth_offset_s());
  std::printf("%s\n", depth_offset_text(estimate).c_str());
  if (is_late) {
    std::printf(
        "recommended: --depth-offset %g for dynfilter run, ablate and masks; for a SLAM program "
        "`dynfilter sync SEQUENCE --write FILE`, and FILE in place of its associations\n",
        offset_s);
  } else if (estimate.offset) {
    std::printf("recommended: keep the pairs as they are; no other pairing is nearer\n");
  } else {
    std::printf("recommended: keep the pairs as they are, or record something that moves\n");
  }
  if (!options.write.empty()) {
    RgbdSequenceOptions better = given;
    better.depth_offset_s = offset_s;
    const RgbdSequence paired(options.sequence, better);
    detail::write_file(options.write, associations_text(paired));
    std::printf("%zu pairs with a depth offset of %g s written to %s\n", paired.size(), offset_s,
                options.write.c_str());
  }
}

}  // namespace

void add_sync_command(CLI::App& program) {
  const auto options = std::make_shared<SyncOptions>();
  CLI::App* command = program.add_subcommand(
      "sync",
      "Measure from edges by how much the depth of a sequence lags its colour, and say what to do\n"
      "about it.\n"
      "Something must move: the camera, or what it sees.");
  command->add_option("SEQUENCE", options->sequence, "folder of the sequence")->required();
  command->add_option("--camera", options->camera,
                      "camera file, or tum1, tum2, tum3 or bonn [SEQUENCE/camera.yaml]");
  add_depth_offset_option(*command, options->depth_offset_s);
  command->add_option("--write", options->write,
                      "write the recommended pairs to this new file, in the form of "
                      "associations.txt");
  command->footer(
      "examples:\n"
      "  dynfilter sync rgbd_dataset_freiburg3_walking_xyz --camera tum3\n"
      "  dynfilter sync rgbd_dataset_freiburg3_walking_xyz --camera tum3 --write in_step.txt");
  command->callback([options] { sync(*options); });
}

}  // namespace dynfilter::tools
