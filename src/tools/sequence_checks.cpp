// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "sequence_checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <optional>

#include <opencv2/core.hpp>

#include "depth_offset_text.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "sequence_doubts.hpp"
#include "trajectory_note.hpp"

namespace dynfilter::tools {
namespace {

constexpr std::size_t looked_at = 20;       // frames that are decoded
constexpr std::size_t offset_frames = 150;  // frames that the depth's offset is measured with
constexpr double min_usual_m = 0.5, max_usual_m = 8;  // median depth in a room

std::string text(const char* format, double value) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

double median(std::vector<double> values) {
  return values.empty() ? 0 : detail::quantile_of(values);
}

/// Indices of at most `looked_at` frames, evenly spread from the first to the last.
std::vector<std::size_t> sampled_frames(const RgbdSequence& sequence) {
  const std::size_t count = std::min(looked_at, sequence.size());
  std::vector<std::size_t> frames;
  for (std::size_t k = 0; k < count; ++k) {
    frames.push_back(k * (sequence.size() - 1) / std::max<std::size_t>(1, count - 1));
  }
  return frames;
}

/// Counts the rows of a list, without comments and blank lines.
std::size_t rows_of(const std::filesystem::path& list) {
  std::ifstream stream(list);
  std::size_t rows = 0;
  for (std::string line; std::getline(stream, line);) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    rows += first != std::string::npos && line[first] != '#' ? 1 : 0;
  }
  return rows;
}

class Examination {
 public:
  explicit Examination(const RgbdSequence& sequence) : sequence_(sequence) {}

  std::vector<Finding> run() {
    check_times();
    check_images();
    check_camera();
    check_true_trajectory();
    check_masks();
    check_depth_offset();
    return findings_;
  }

 private:
  void add(Verdict verdict, const std::string& what, const std::string& mend = {}) {
    findings_.push_back({verdict, what, mend});
  }

  void add(const std::optional<Finding>& finding) {
    if (finding) findings_.push_back(*finding);
  }

  /// Adds a frame that cannot be read, once.
  void add_unreadable(const std::string& error) {
    const auto is_known = [&](const Finding& finding) { return finding.what == error; };
    if (std::any_of(findings_.begin(), findings_.end(), is_known)) return;
    add(Verdict::broken, error, "replace the file, or leave its row out of the lists");
  }

  void check_times() {
    std::vector<double> periods_s, differences_s;
    for (std::size_t i = 0; i < sequence_.size(); ++i) {
      const RgbdSequenceEntry& entry = sequence_.entry(i);
      if (i > 0) periods_s.push_back(entry.timestamp_s - sequence_.entry(i - 1).timestamp_s);
      const double difference_s = entry.depth_timestamp_s - entry.timestamp_s;
      differences_s.push_back(std::abs(difference_s - sequence_.depth_offset_s()));
    }
    const double period_s = median(periods_s);
    if (sequence_.size() == 1) {
      add(Verdict::odd, "1 frame", "one frame is no sequence; trajectories need more");
      return;
    }
    const std::string frames =
        detail::concatenate(sequence_.size(), " frames") + text(", %.1f a second", 1 / period_s);
    if (period_s > 10 || period_s < 0.001) {
      add(Verdict::odd, frames, "stamps are in seconds; are these?");
    } else {
      add(Verdict::fine, frames);
      add(other_frame_rate(sequence_, period_s));
    }
    add(repeated_images(sequence_));
    check_unpaired();
    const double largest_s = *std::max_element(periods_s.begin(), periods_s.end());
    if (largest_s > 5 * period_s) {
      add(Verdict::odd, text("a gap of %.2f s between two frames", largest_s),
          "expect tracking to fail there; masks that lag are not moved across it");
    }
    if (!sequence_.has_depth()) {
      add(Verdict::odd, "no depth images",
          "the rules paper and depth abstain; add depth.txt, or expect masks alone");
    } else if (median(differences_s) > period_s / 2) {
      add(Verdict::odd,
          text("stamps of colour and depth differ by %.3f s (median) from the depth offset in use",
               median(differences_s)),
          "`dynfilter sync SEQUENCE` says whether another pairing is nearer");
    }
  }

  /// Colour images that no depth image is near to are in no frame.
  void check_unpaired() {
    const std::filesystem::path& folder = sequence_.folder();
    if (!sequence_.has_depth() || std::filesystem::exists(folder / "associations.txt")) return;
    const std::size_t images = rows_of(folder / "rgb.txt");
    if (images <= sequence_.size()) return;
    add(Verdict::odd,
        detail::concatenate(images - sequence_.size(), " of ", images,
                            " colour images have no depth image within 0.02 s, and are left out"),
        "are the stamps of rgb.txt and depth.txt of one clock? `dynfilter sync SEQUENCE --write "
        "FILE` writes other pairs");
  }

  void check_camera() {
    const CameraParameters& camera = sequence_.camera();
    const cv::Size size = image_size_.empty() ? camera.image_size : image_size_;
    if (size.empty()) return;  // nothing could be read, and the file does not say
    const std::string focal = text("camera: fx %.1f", camera.fx) + text(", fy %.1f", camera.fy);
    const double width = size.width, height = size.height;
    const bool is_central = std::abs(camera.cx - width / 2) < width / 5 &&
                            std::abs(camera.cy - height / 2) < height / 5;
    const bool is_usual = camera.fx > 0.3 * width && camera.fx < 4 * width &&
                          std::abs(camera.fx / camera.fy - 1) < 0.1;
    if (is_central && is_usual) {
      add(Verdict::fine, focal + detail::concatenate(", ", size.width, "x", size.height));
    } else {
      add(Verdict::odd,
          focal + text(", cx %.1f", camera.cx) + text(", cy %.1f", camera.cy) +
              detail::concatenate(" for ", size.width, "x", size.height),
          "the camera file may be of another camera or image size");
    }
  }

  void check_images() {
    std::vector<double> medians_m, missing;
    std::vector<std::string> errors;
    const std::vector<std::size_t> sampled = sampled_frames(sequence_);
    for (const std::size_t i : sampled) {
      FrameView frame;
      try {
        frame = sequence_.read(i);
      } catch (const std::exception& error) {
        errors.emplace_back(error.what());
        continue;
      }
      image_size_ = frame.image.size();
      if (frame.depth.empty()) continue;
      std::vector<double> depths_m;
      std::size_t pixels = 0;
      for (int y = 2; y < frame.depth.rows; y += 8) {
        for (int x = 2; x < frame.depth.cols; x += 8) {
          ++pixels;
          if (const auto depth_m = frame.depth_m({x, y})) depths_m.push_back(*depth_m);
        }
      }
      if (pixels > 0) {
        missing.push_back(1 - static_cast<double>(depths_m.size()) / static_cast<double>(pixels));
      }
      medians_m.push_back(median(depths_m));
    }
    if (errors.size() == sampled.size()) {
      add(Verdict::broken, errors.front() + "; so it is with every frame that was looked at",
          "is the camera file another camera's? If not, see how the images were exported");
    } else {
      for (const std::string& error : errors) add_unreadable(error);
    }
    if (errors.empty()) {
      add(Verdict::fine, detail::concatenate(sampled.size(), " of the frames were decoded"));
    }
    if (missing.empty()) return;
    const double usual_m = median(medians_m), share = median(missing);
    const std::string depth = text("median depth %.2f m", usual_m) +
                              text(", missing at %.0f %% of the pixels", 100 * share);
    const double factor = sequence_.camera().depth_units_per_metre;
    if (usual_m == 0) {
      add(Verdict::broken, "depth images hold no depth", "see how they were exported: 16 bits?");
    } else if (usual_m < min_usual_m || usual_m > max_usual_m) {
      add(usual_m < min_usual_m / 5 || usual_m > max_usual_m * 5 ? Verdict::broken : Verdict::odd,
          depth,
          text(
              "is that so? DepthMapFactor in the camera file is %g; TUM's is 5000, and 1000 is for "
              "millimetres",
              factor));
    } else if (share > 0.6) {
      add(Verdict::odd, depth, "rules that use depth will rarely find an object's range");
    } else {
      add(Verdict::fine, depth);
    }
  }

  void check_true_trajectory() {
    try {
      const auto file = sequence_.groundtruth_file();
      if (!file) {
        add(Verdict::fine, "no groundtruth.txt: there will be no ATE");
        return;
      }
      const TrajectoryFile truth = read_trajectory_file(*file);
      const double first_s = truth.trajectory.front().timestamp_s;
      const double last_s = truth.trajectory.back().timestamp_s;
      std::size_t covered = 0;
      for (std::size_t i = 0; i < sequence_.size(); ++i) {
        const double time_s = sequence_.entry(i).timestamp_s;
        covered += time_s >= first_s - 0.02 && time_s <= last_s + 0.02 ? 1 : 0;
      }
      const std::string what =
          detail::concatenate("groundtruth.txt: ", truth.trajectory.size(), " poses, for ", covered,
                              " of ", sequence_.size(), " frames");
      if (covered < sequence_.size() / 2) {
        add(Verdict::odd, what, "is it this sequence's? Its times should be those of the images");
      } else {
        add(Verdict::fine, what);
      }
      if (truth.flaws.any()) add(Verdict::odd, trajectory_note(*file, truth.flaws));
    } catch (const std::exception& error) {
      add(Verdict::broken, error.what(), "mend the file, or move it away: it is optional");
    }
  }

  void check_masks() {
    try {
      const auto folder = sequence_.masks_folder();
      if (!folder) {
        add(Verdict::odd, "no masks/", "make masks, see `dynfilter masks --help`");
        return;
      }
      MaskFolderSegmenter masks(*folder);
      add(labels_without_table(*folder));
      std::size_t without = 0, instances = 0, persons = 0, corners = 0, looked = 0;
      std::vector<double> ages_s;
      for (std::size_t i = 0; i < sequence_.size(); ++i) {
        without += masks.has_mask(sequence_.entry(i).timestamp_s) ? 0 : 1;
      }
      for (const std::size_t i : sampled_frames(sequence_)) {
        FrameView frame;
        frame.timestamp_s = sequence_.entry(i).timestamp_s;
        if (!masks.has_mask(frame.timestamp_s)) continue;
        try {
          frame.image = sequence_.read(i).image;
        } catch (const std::exception&) {
          continue;  // check_images has said so
        }
        const Segmentation segmentation = masks.segment(frame);
        ++looked;
        for (const Instance& instance : segmentation.instances) {
          ++instances;
          persons += instance.class_id == 0 ? 1 : 0;
          corners += has_box_as_corners(instance) ? 1 : 0;
        }
        ages_s.push_back(frame.timestamp_s - segmentation.timestamp_s);
      }
      const std::string what =
          detail::concatenate("masks/: ", masks.size(), " files; ", instances, " instances in ",
                              looked, " frames looked at, ", persons, " of them persons");
      if (looked > 0 && instances == 0) {
        add(Verdict::odd, what, "nothing would be removed; what did the network look for?");
      } else if (looked > 0 && persons == 0) {
        add(Verdict::odd, what, "only class 0 (person) is dynamic unless --classes names others");
      } else if (looked > 0) {
        add(Verdict::fine, what);
      }
      add(boxes_as_corners(corners, instances));
      if (without > 0) {
        add(Verdict::broken,
            detail::concatenate(without, " of ", sequence_.size(), " frames have no mask"),
            "masks are named by their images' times, such as " + sequence_.entry(0).stem +
                ".png; `dynfilter masks` makes them, and `run` stops where one is missing");
      }
      if (median(ages_s) > 0.02) {
        add(Verdict::odd, text("masks are %.3f s older than their frames", median(ages_s)),
            "that costs features: `dynfilter run SEQUENCE --rule depth_moved` moves the masks");
      }
    } catch (const std::exception& error) {
      add(Verdict::broken, error.what(), "make the masks again, or move the folder away");
    }
  }

  void check_depth_offset() {
    if (!sequence_.has_depth()) return;
    DepthOffsetEstimator estimator;
    const std::size_t frames = std::min(sequence_.size(), offset_frames);
    for (std::size_t i = 0; i < frames; ++i) {
      try {
        estimator.add(sequence_.read(i), sequence_.entry(i).depth_timestamp_s);
      } catch (const std::exception& error) {
        if (!image_size_.empty()) add_unreadable(error.what());
        return;
      }
    }
    const DepthOffsetEstimate estimate = estimator.estimate();
    const bool is_odd = is_out_of_step(estimate);
    add(is_odd ? Verdict::odd : Verdict::fine, depth_offset_text(estimate),
        is_odd ? "pair the images anew: " +
                     pairing_advice(recommended_offset_s(estimate, sequence_.depth_offset_s()))
               : "");
  }

  const RgbdSequence& sequence_;
  cv::Size image_size_;  // of the last frame that could be read
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> examine_sequence(const std::filesystem::path& folder,
                                      const std::filesystem::path& camera) {
  std::optional<RgbdSequence> sequence;
  try {
    RgbdSequenceOptions options;
    options.camera_file = camera;
    sequence.emplace(folder, options);
  } catch (const std::exception& error) {
    const bool has_list = std::filesystem::exists(folder / "rgb.txt") ||
                          std::filesystem::exists(folder / "associations.txt");
    return {{Verdict::broken, error.what(),
             has_list ? ""
                      : "a sequence has rgb.txt and depth.txt (rows: time file), or "
                        "associations.txt (rows: time file time file), and camera.yaml"}};
  }
  return Examination(*sequence).run();
}

}  // namespace dynfilter::tools
