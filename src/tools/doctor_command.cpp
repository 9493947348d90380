// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/core/utility.hpp>
#include <opencv2/core/version.hpp>

#include "commands.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/kernels/instruction_set.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/version.hpp"
#include "health_text.hpp"
#include "io/file_error.hpp"
#include "plugin/plugin_settings.hpp"
#include "trajectory_note.hpp"

namespace dynfilter::tools {
namespace {

constexpr std::size_t looked_at = 20;       // frames that are decoded
constexpr std::size_t offset_frames = 150;  // frames that the depth's offset is measured with
constexpr double min_usual_m = 0.5, max_usual_m = 8;  // median depth in a room

struct DoctorOptions {
  std::filesystem::path sequence, camera, settings;
};

enum class Verdict {
  fine,
  odd,    // usable, but look at it
  broken  // not usable before it is mended
};

/// Findings about one sequence or one settings file.
struct Findings {
  /// Adds what was found, once, and what to do about it.
  void add(Verdict verdict, const std::string& what, const std::string& mend = {}) {
    if (text.find(what) != std::string::npos) return;
    const char* const names[] = {"fine  ", "odd   ", "broken"};
    text += std::string(names[static_cast<int>(verdict)]) + "  " + what + '\n';
    if (!mend.empty()) text += "        -> " + mend + '\n';
    is_broken = is_broken || verdict == Verdict::broken;
  }

  std::string text;
  bool is_broken = false;
};

std::string text(const char* format, double value) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

double median_or_0(std::vector<double> values) {
  return values.empty() ? 0 : detail::quantile_of(values);
}

/// Returns the indices of at most `looked_at` frames, evenly spread from the first to the last.
std::vector<std::size_t> sampled_frames(const RgbdSequence& sequence) {
  const std::size_t count = std::min(looked_at, sequence.size());
  std::vector<std::size_t> frames;
  for (std::size_t k = 0; k < count; ++k) {
    frames.push_back(k * (sequence.size() - 1) / std::max<std::size_t>(1, count - 1));
  }
  return frames;
}

void check_times(const RgbdSequence& sequence, Findings& found) {
  std::vector<double> periods_s;
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    periods_s.push_back(sequence.entry(i).timestamp_s - sequence.entry(i - 1).timestamp_s);
  }
  const double period_s = median_or_0(periods_s);  // 0 for a single frame
  const bool is_odd = period_s > 10 || period_s < 0.001;
  found.add(is_odd ? Verdict::odd : Verdict::fine,
            detail::concatenate(sequence.size(), " frames") + text(", %.1f a second", 1 / period_s),
            is_odd ? "a trajectory needs several frames, with stamps in seconds; are these?" : "");
  if (sequence.has_depth()) return;
  found.add(Verdict::odd, "no depth images",
            "the rules paper and depth abstain; add depth.txt, or expect masks alone");
}

void check_depth(const std::vector<double>& medians_m, const std::vector<double>& missing,
                 double units_per_metre, Findings& found) {
  const double usual_m = median_or_0(medians_m), share = median_or_0(missing);
  const std::string depth = text("median depth %.2f m", usual_m) +
                            text(", missing at %.0f %% of the pixels", 100 * share);
  if (usual_m == 0) {
    found.add(Verdict::broken, "depth images hold no depth",
              "see how they were exported: 16 bits?");
  } else if (usual_m < min_usual_m || usual_m > max_usual_m) {
    const bool is_broken = usual_m < min_usual_m / 5 || usual_m > max_usual_m * 5;
    found.add(is_broken ? Verdict::broken : Verdict::odd, depth,
              text("is that so? DepthMapFactor in the camera file is %g; TUM's is 5000, and 1000 "
                   "is for millimetres",
                   units_per_metre));
  } else if (share > 0.6) {
    found.add(Verdict::odd, depth, "rules that use depth will rarely find an object's range");
  } else {
    found.add(Verdict::fine, depth);
  }
}

/// Decodes some frames; returns the size of their images, empty if none can be read.
cv::Size check_images(const RgbdSequence& sequence, Findings& found) {
  std::vector<double> medians_m, missing;
  std::vector<std::string> errors;
  cv::Size size;
  const std::vector<std::size_t> sampled = sampled_frames(sequence);
  for (const std::size_t i : sampled) {
    try {
      const FrameView frame = sequence.read(i);
      size = frame.image.size();
      std::vector<double> depths_m;
      double pixels = 0;
      for (int y = 2; y < frame.depth.rows; y += 8) {
        for (int x = 2; x < frame.depth.cols; x += 8, ++pixels) {
          if (const auto depth_m = frame.depth_m({x, y})) depths_m.push_back(*depth_m);
        }
      }
      if (pixels == 0) continue;
      missing.push_back(1 - static_cast<double>(depths_m.size()) / pixels);
      medians_m.push_back(median_or_0(depths_m));
    } catch (const std::exception& error) {
      errors.emplace_back(error.what());
    }
  }
  if (errors.size() == sampled.size()) {
    found.add(Verdict::broken, errors.front() + "; so it is with every frame that was looked at",
              "is the camera file another camera's? If not, see how the images were exported");
    return size;
  }
  for (const std::string& error : errors) {
    found.add(Verdict::broken, error, "replace the file, or leave its row out of the lists");
  }
  if (errors.empty()) {
    found.add(Verdict::fine, detail::concatenate(sampled.size(), " of the frames were decoded"));
  }
  if (!missing.empty()) {
    check_depth(medians_m, missing, sequence.camera().depth_units_per_metre, found);
  }
  return size;
}

void check_camera(const CameraParameters& camera, cv::Size size, Findings& found) {
  if (size.empty()) size = camera.image_size;
  if (size.empty()) return;  // nothing could be read, and the file does not say
  const double width = size.width, height = size.height;
  const bool is_central =
      std::abs(camera.cx - width / 2) < width / 5 && std::abs(camera.cy - height / 2) < height / 5;
  const bool is_usual =
      camera.fx > 0.3 * width && camera.fx < 4 * width && std::abs(camera.fx / camera.fy - 1) < 0.1;
  const bool is_fine = is_central && is_usual;
  found.add(is_fine ? Verdict::fine : Verdict::odd,
            text("camera: fx %.1f", camera.fx) + text(", fy %.1f", camera.fy) +
                text(", cx %.1f", camera.cx) + text(", cy %.1f", camera.cy) +
                detail::concatenate(" for ", size.width, "x", size.height),
            is_fine ? "" : "the camera file may be of another camera or image size");
}

void check_true_trajectory(const RgbdSequence& sequence, Findings& found) {
  const auto file = sequence.groundtruth_file();
  if (!file) {
    found.add(Verdict::fine, "no groundtruth.txt: there will be no ATE");
    return;
  }
  const TrajectoryFile truth = read_trajectory_file(*file);
  std::size_t covered = 0;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const double time_s = sequence.entry(i).timestamp_s;
    covered += time_s >= truth.trajectory.front().timestamp_s - 0.02 &&
                       time_s <= truth.trajectory.back().timestamp_s + 0.02
                   ? 1
                   : 0;
  }
  const bool is_odd = covered < sequence.size() / 2;
  found.add(is_odd ? Verdict::odd : Verdict::fine,
            detail::concatenate("groundtruth.txt: ", truth.trajectory.size(), " poses, for ",
                                covered, " of ", sequence.size(), " frames"),
            is_odd ? "is it this sequence's? Its times should be those of the images" : "");
  if (truth.flaws.any()) found.add(Verdict::odd, trajectory_note(*file, truth.flaws));
}

void check_masks(const RgbdSequence& sequence, cv::Size size, Findings& found) {
  const auto folder = sequence.masks_folder();
  if (!folder) {
    found.add(Verdict::odd, "no masks/", "make masks, see `dynfilter masks --help`");
    return;
  }
  MaskFolderSegmenter masks(*folder);
  std::size_t without = 0, instances = 0, persons = 0, looked = 0;
  std::vector<double> ages_s;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    without += masks.has_mask(sequence.entry(i).timestamp_s) ? 0 : 1;
  }
  for (const std::size_t i : sampled_frames(sequence)) {
    FrameView frame;
    frame.timestamp_s = sequence.entry(i).timestamp_s;
    if (size.empty() || !masks.has_mask(frame.timestamp_s)) continue;
    frame.image = cv::Mat(size, CV_8UC3);  // masks need no more than its size
    const Segmentation segmentation = masks.segment(frame);
    ++looked;
    for (const Instance& instance : segmentation.instances) {
      ++instances;
      persons += instance.class_id == 0 ? 1 : 0;
    }
    ages_s.push_back(frame.timestamp_s - segmentation.timestamp_s);
  }
  if (looked > 0) {
    const char* const doubt = instances == 0 ? "nothing would be removed; what was looked for?"
                              : persons == 0
                                  ? "only class 0 (person) is dynamic unless --classes names others"
                                  : "";
    found.add(*doubt == '\0' ? Verdict::fine : Verdict::odd,
              detail::concatenate("masks/: ", masks.size(), " files; ", instances, " instances in ",
                                  looked, " frames looked at, ", persons, " of them persons"),
              doubt);
  }
  if (without > 0) {
    found.add(Verdict::broken,
              detail::concatenate(without, " of ", sequence.size(), " frames have no mask"),
              "masks are named by their images' times, such as " + sequence.entry(0).stem +
                  ".png; `dynfilter masks` makes them, and `run` stops where one is missing");
  }
  if (median_or_0(ages_s) > 0.02) {
    found.add(Verdict::odd, text("masks are %.3f s older than their frames", median_or_0(ages_s)),
              "that costs features: `dynfilter run SEQUENCE --rule depth_moved` moves the masks");
  }
}

void check_depth_offset(const RgbdSequence& sequence, Findings& found) {
  if (!sequence.has_depth()) return;
  DepthOffsetEstimator estimator;
  for (std::size_t i = 0; i < std::min(sequence.size(), offset_frames); ++i) {
    estimator.add(sequence.read(i), sequence.entry(i).depth_timestamp_s);
  }
  const DepthOffsetEstimate estimate = estimator.estimate();
  const bool is_odd = is_out_of_step(estimate);
  found.add(is_odd ? Verdict::odd : Verdict::fine, depth_offset_text(estimate),
            is_odd ? "pair the images anew: " +
                         pairing_advice(recommended_offset_s(estimate, sequence.depth_offset_s()))
                   : "");
}

/// Runs a check. An exception is its last finding.
template <class Check>
void run_check(Findings& found, const std::string& mend, const Check& check) {
  try {
    check();
  } catch (const std::exception& error) {
    found.add(Verdict::broken, error.what(), mend);
  }
}

Findings examine_sequence(const DoctorOptions& options) {
  const std::filesystem::path& folder = options.sequence;
  Findings found;
  const bool has_list = std::filesystem::exists(folder / "rgb.txt") ||
                        std::filesystem::exists(folder / "associations.txt");
  const char* const layout =
      "a sequence has rgb.txt and depth.txt (rows: time file), or associations.txt (rows: time "
      "file time file), and camera.yaml";
  run_check(found, has_list ? "" : layout, [&] {
    RgbdSequenceOptions sequence_options;
    sequence_options.camera_file = options.camera;
    const RgbdSequence sequence(folder, sequence_options);
    check_times(sequence, found);
    const cv::Size size = check_images(sequence, found);
    check_camera(sequence.camera(), size, found);
    run_check(found, "mend the file, or move it away: it is optional",
              [&] { check_true_trajectory(sequence, found); });
    run_check(found, "make the masks again, or move the folder away",
              [&] { check_masks(sequence, size, found); });
    run_check(found, "replace the file, or leave its row out of the lists",
              [&] { check_depth_offset(sequence, found); });
  });
  return found;
}

void check_settings(const std::string& file, const std::string& prefix, Findings& found) {
  const detail::PluginSettings settings = detail::read_plugin_settings(file, prefix);
  if (!settings.enabled) {
    found.add(Verdict::odd, "the filter is switched off, and nothing else is read",
              "remove " + prefix + ".enabled, or set it to 1");
    return;
  }
  const DynamicFilter filter(settings.filter);  // refuses values out of range
  found.add(Verdict::fine, "every key of " + prefix + " is known, with its value");
  if (!settings.remote.empty()) {
    found.add(Verdict::fine, "masks come from the process at " + settings.remote);
  } else if (!settings.model.empty()) {
    detail::require_regular_file(settings.model);
    found.add(Verdict::fine, "masks come from the network " + settings.model);
  } else {
    const bool keeps = settings.missing_masks == "keep";
    MaskFolderOptions options = settings.mask_folder_options;
    options.allow_missing = keeps;
    const MaskFolderSegmenter masks(settings.mask_folder, options);
    found.add(Verdict::fine,
              detail::concatenate(masks.size(), " masks in ", settings.mask_folder,
                                  keeps ? "; in a frame without one, masks remove nothing"
                                        : "; a frame without one is an error"));
  }
}

/// Examines the plugin's settings as the plugin reads them, and those of a fisheye pair's right
/// camera, if there are any. Asks no other process.
Findings examine_settings(const std::filesystem::path& file) {
  Findings found;
  run_check(found, "", [&] {
    check_settings(file.string(), "dynfilter", found);
    bool has_right = false;
    std::ifstream lines(file);
    for (std::string line; std::getline(lines, line);) {
      has_right = has_right || line.rfind("dynfilter_right.", 0) == 0;
    }
    if (has_right) check_settings(file.string(), "dynfilter_right", found);
  });
  return found;
}

void print_build() {
  std::printf("dynfilter %s, OpenCV %s (compiled with %s), %d processors\n",
              DYNFILTER_VERSION_STRING, cv::getVersionString().c_str(), CV_VERSION,
              cv::getNumberOfCPUs());
  std::printf("dense D-LBP uses: %s\n", detail::best_instruction_set_name());
#if defined(DYNFILTER_HAS_NETWORKS)
  std::printf("networks: built in\n");
#else
  std::printf("networks: left out (they need OpenCV's module dnn and DYNFILTER_BUILD_NETWORKS)\n");
#endif
}

/// Prints the findings about a path, and adds it to the unusable ones if it is broken.
void report(const std::filesystem::path& path, const Findings& found, std::string& unusable) {
  std::printf("\n%s\n%s", path.c_str(), found.text.c_str());
  if (found.is_broken) unusable += (unusable.empty() ? "" : " and ") + path.string();
}

void doctor(const DoctorOptions& options) {
  print_build();
  std::string unusable;
  if (!options.sequence.empty()) report(options.sequence, examine_sequence(options), unusable);
  const std::filesystem::path& settings = options.settings;
  if (!settings.empty()) report(settings, examine_settings(settings), unusable);
  std::fflush(stdout);  // before the error that refers to it
  if (!unusable.empty()) throw std::runtime_error(unusable + " cannot be used as it is, see above");
}

}  // namespace

void add_doctor_command(CLI::App& program) {
  const auto options = std::make_shared<DoctorOptions>();
  CLI::App* command = program.add_subcommand(
      "doctor",
      "Say what this program can do here, and what is odd about a sequence, or about the settings "
      "of\nthe plugin for ORB-SLAM. Changes nothing.");
  CLI::Option* sequence =
      command->add_option("SEQUENCE", options->sequence, "folder of the sequence to examine");
  command
      ->add_option("--camera", options->camera,
                   "camera file, or tum1, tum2, tum3 or bonn [SEQUENCE/camera.yaml]")
      ->needs(sequence);
  command->add_option(
      "--settings", options->settings,
      "the host's settings file, whose keys dynfilter.* the plugin reads; relative\n"
      "paths in it start at the folder in which this runs, as in the host");
  command->footer(
      "examples:\n"
      "  dynfilter doctor\n"
      "  dynfilter doctor rgbd_dataset_freiburg3_walking_xyz\n"
      "  dynfilter doctor --settings TUM3.yaml");
  command->callback([options] { doctor(*options); });
}

}  // namespace dynfilter::tools
