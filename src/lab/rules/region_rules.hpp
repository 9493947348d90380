// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rules of other systems that ask which regions of the image change, without masks.

#ifndef DYNFILTER_SRC_LAB_RULES_REGION_RULES_HPP
#define DYNFILTER_SRC_LAB_RULES_REGION_RULES_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "lab/rules/frames.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

/// DynaSLAM's multi-view geometry (B. Bescos et al., "DynaSLAM: Tracking, Mapping and Inpainting in
/// Dynamic Scenes", RA-L 2018). Points of earlier keyframes are projected into the frame. Where all
/// depths around are much nearer than the point should be, something has come before it: a seed.
/// Regions of equal depth grow from the seeds, and the features on them, dilated, are removed.
/// Its masks are rule dynaslam; the system removes what either finds.
///
/// Open in the source, or changed: when a frame is a keyframe; the seed is the pixel of the
/// projected point, and pixels without depth do not count in its window; regions grow first come,
/// first served. Poses are FrameMemory's, composed from frame to frame; where one is unknown, the
/// keyframes are forgotten. It needs no masks.
class DepthConsistency {
 public:
  static constexpr int baseline_frames = 1;

  struct Keyframe {
    std::vector<cv::Point3d> points;  ///< of its features, in its camera's frame, metres
    RelativePose from_now;            ///< the keyframe from the last frame seen
  };

  void operator()(const FramePair& pair, FeatureLabels& labels) {
    if (!pair.pose) {
      keyframes_.clear();
    } else {
      for (Keyframe& keyframe : keyframes_) keyframe.from_now = keyframe.from_now * *pair.pose;
      if (keyframes_.size() >= min_keyframes) {
        remove_on_mask(mask(pair, references(keyframes_)), pair.now, labels);
      }
    }
    remember(pair, labels);
  }

  /// Returns the dynamic pixels: CV_8UC1 of the depth image's size, 255 = dynamic.
  static cv::Mat mask(const FramePair& pair, const std::vector<const Keyframe*>& references) {
    const cv::Mat1f depth = metres(pair.now.frame);
    cv::Mat region(depth.size(), CV_8UC1, cv::Scalar::all(0));
    for (const Keyframe* reference : references) {
      for (const cv::Point3d& point : reference->points) {
        const cv::Point seed = seed_of(pair.camera, *reference, point, depth);
        if (seed.x >= 0) grow(depth, seed, region);
      }
    }
    cv::dilate(region, region, cv::getStructuringElement(cv::MORPH_ELLIPSE, {31, 31}));
    return region;
  }

  /// Returns the keyframes with the largest weighted distance and turn, the oldest first of equals.
  static std::vector<const Keyframe*> references(const std::vector<Keyframe>& keyframes) {
    struct Scored {
      const Keyframe* keyframe;
      double distance, turn, score;
    };
    std::vector<Scored> all;
    double max_distance = 0, max_turn = 0;
    for (const Keyframe& keyframe : keyframes) {
      const RelativePose& pose = keyframe.from_now;
      const double cosine = (cv::trace(pose.rotation) - 1) / 2;
      all.push_back(
          {&keyframe, cv::norm(pose.translation), std::acos(std::clamp(cosine, -1.0, 1.0)), 0});
      max_distance = std::max(max_distance, all.back().distance);
      max_turn = std::max(max_turn, all.back().turn);
    }
    for (Scored& one : all) {
      if (max_distance > 0) one.score += distance_weight * one.distance / max_distance;
      if (max_turn > 0) one.score += turn_weight * one.turn / max_turn;
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Scored& a, const Scored& b) { return a.score > b.score; });
    all.resize(std::min(all.size(), max_references));
    std::vector<const Keyframe*> chosen;
    for (const Scored& one : all) chosen.push_back(one.keyframe);
    return chosen;
  }

 private:
  static constexpr int frames_per_keyframe = 2;     // open in the source
  static constexpr std::size_t max_keyframes = 20;  // the last ones are remembered
  static constexpr std::size_t min_keyframes = 5;   // the test begins with so many
  static constexpr std::size_t max_references = 5;  // keyframes that a frame is compared with
  // Weights of the distance and of the turn in the choice of the references; the farthest win.
  static constexpr double distance_weight = 0.7, turn_weight = 0.3;
  static constexpr double max_reference_depth_m = 6;  // farther keyframe points do not count,
  static constexpr double max_projected_depth_m = 7;  // nor those that are farther now,
  static constexpr double max_parallax_deg = 30;      // nor those seen from other directions
  static constexpr int reach_px = 20;       // of the window around the projected point: 41x41
  static constexpr double min_gap_m = 0.6;  // of depth; 0.4 in the paper, 0.6 in its program
  static constexpr double max_variance_m2 = 0.001;  // of the depths in a seed's window
  static constexpr double growth_m = 0.20;  // a region takes pixels this near to its mean depth

  /// Returns the depths in metres, 0 = none.
  static cv::Mat1f metres(const FrameView& frame) {
    cv::Mat1f depth(frame.depth.size(), 0.0F);
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        depth(y, x) = static_cast<float>(frame.depth_m({x, y}).value_or(0));
      }
    }
    return depth;
  }

  /// Returns the pixel that a keyframe's point makes a seed; (-1, -1) if none.
  static cv::Point seed_of(const PinholeCamera& camera, const Keyframe& reference,
                           const cv::Point3d& point, const cv::Mat1f& depth) {
    const cv::Point none(-1, -1);
    const cv::Matx33d turn = reference.from_now.rotation.t();
    const cv::Vec3d centre = reference.from_now.translation;  // of the camera now
    const cv::Vec3d from_now = cv::Vec3d(point) - centre;
    const double cosine =
        from_now.dot(cv::Vec3d(point)) / (cv::norm(from_now) * cv::norm(cv::Vec3d(point)));
    if (cosine < std::cos(max_parallax_deg * CV_PI / 180)) return none;
    const cv::Vec3d now = turn * from_now;
    if (!(now[2] > 0) || now[2] >= max_projected_depth_m) return none;
    const cv::Point2d raw = camera.raw(*camera.project({now[0], now[1], now[2]}));
    const int border = reach_px + 1;
    const cv::Rect2d inside(border, border, depth.cols - 2 * border, depth.rows - 2 * border);
    if (!inside.contains(raw)) return none;
    const cv::Point pixel = nearest_pixel(cv::Point2f(raw));
    if (depth(pixel) <= 0) return none;
    double gap_m = std::numeric_limits<double>::infinity(), sum = 0, squares = 0;
    int count = 0;
    for (int y = pixel.y - reach_px; y <= pixel.y + reach_px; ++y) {
      for (int x = pixel.x - reach_px; x <= pixel.x + reach_px; ++x) {
        if (y < 0 || x < 0 || y >= depth.rows || x >= depth.cols) continue;
        const double z = double{depth(y, x)};
        if (z <= 0) continue;
        if (z < now[2]) gap_m = std::min(gap_m, now[2] - z);
        sum += z;
        squares += z * z;
        ++count;
      }
    }
    const double mean = sum / count;
    const bool is_flat = squares / count - mean * mean < max_variance_m2;
    return std::isfinite(gap_m) && gap_m > min_gap_m && is_flat ? pixel : none;
  }

  /// Adds the region of a seed: 4-neighbours, as long as they are near to its mean depth so far.
  static void grow(const cv::Mat1f& depth, cv::Point seed, cv::Mat& region) {
    if (region.at<std::uint8_t>(seed) != 0) return;
    std::vector<cv::Point> queue{seed};
    region.at<std::uint8_t>(seed) = 255;
    double sum = double{depth(seed)};
    const cv::Rect image({0, 0}, depth.size());
    for (std::size_t first = 0; first < queue.size(); ++first) {
      for (const cv::Point step : {cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const cv::Point pixel = queue[first] + step;
        if (!image.contains(pixel) || depth(pixel) <= 0) continue;
        const double mean = sum / static_cast<double>(queue.size());
        if (region.at<std::uint8_t>(pixel) != 0 ||
            std::abs(double{depth(pixel)} - mean) >= growth_m) {
          continue;
        }
        region.at<std::uint8_t>(pixel) = 255;
        sum += double{depth(pixel)};
        queue.push_back(pixel);
      }
    }
  }

  /// Makes the frame a keyframe if it is time, with the features that are left.
  void remember(const FramePair& pair, const FeatureLabels& labels) {
    if (!keyframes_.empty() && ++frames_since_ < frames_per_keyframe) return;
    frames_since_ = 0;
    Keyframe keyframe;
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      if (labels.is_removed(i)) continue;
      const auto point = point_now(pair, i);
      if (point && point->z < max_reference_depth_m) keyframe.points.push_back(*point);
    }
    keyframes_.push_back(std::move(keyframe));
    if (keyframes_.size() > max_keyframes) keyframes_.erase(keyframes_.begin());
  }

  std::vector<Keyframe> keyframes_;  // the oldest first
  int frames_since_ = 0;             // since the newest
};

/// SMR's removal of regions (J. Cheng et al., "Improving Visual Localization Accuracy in Dynamic
/// Environments Based on Dynamic Region Removal", IEEE T-ASE 2020). The image is divided into
/// regions. A region's evidence is how similar it is to the last frame, and how different from it
/// once the camera's motion is compensated; a Bayes filter turns it into a probability, and the
/// features of regions that probably move are removed.
///
/// Open in the source: everything but this outline; all constants are ours. The difference is the
/// mean absolute one, of the earlier image compensated by depth and FrameMemory's pose, or of the
/// earlier image itself (similarity) if that is smaller. A region without depth, and all where the
/// camera's motion is unknown, gain no evidence, and beliefs fade to the prior, one half.
class RegionBayes {
 public:
  static constexpr int baseline_frames = 1;

  void operator()(const FramePair& pair, FeatureLabels& labels) {
    const auto cells = [](int pixels) { return (pixels + cell_px - 1) / cell_px; };
    const cv::Size size(cells(pair.image.cols), cells(pair.image.rows));
    if (pair.then == nullptr || log_odds_.size() != size) log_odds_ = cv::Mat1d(size, 0.0);
    if (pair.then == nullptr) return;
    for (int row = 0; row < size.height; ++row) {
      for (int column = 0; column < size.width; ++column) {
        const auto seen = difference(pair, row, column);
        const double evidence = seen ? log_likelihood_ratio(*seen) : 0;
        double& belief = log_odds_(row, column);
        belief = std::clamp(forgetting_factor * belief + evidence, -limit, limit);
      }
    }
    const cv::Rect image({0, 0}, pair.image.size());
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      const cv::Point pixel = pair.now.features.pixel(i);
      if (image.contains(pixel) && log_odds_(pixel.y / cell_px, pixel.x / cell_px) > 0) {
        remove(labels, i);
      }
    }
  }

  /// Returns the log-odds that each region moves, beyond the prior.
  const cv::Mat1d& log_odds() const { return log_odds_; }

 private:
  static constexpr int cell_px = 20;     // side of a region
  static constexpr int step_px = 4;      // every such pixel of a region is compared, each way
  static constexpr int min_samples = 5;  // pixels that a region needs
  // Difference of a static and of a moving region, grey levels: mean and standard deviation.
  // Chosen on rendered scenes of seed 11 and on frames composed of two recordings.
  static constexpr double static_mean = 4, static_deviation = 6;
  static constexpr double moving_mean = 25, moving_deviation = 12;
  static constexpr double forgetting_factor = 0.7;  // what is left of log-odds a frame later
  static constexpr double limit = 3;                // log-odds stay within minus and plus this

  /// Returns the brightness between pixels; none at the edge and beyond it.
  static std::optional<float> grey_at(const cv::Mat1b& image, cv::Point2f at) {
    if (!(at.x >= 0 && at.y >= 0 && at.x + 1 < static_cast<float>(image.cols) &&
          at.y + 1 < static_cast<float>(image.rows))) {
      return {};
    }
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y);
    const float right = at.x - static_cast<float>(x), down = at.y - static_cast<float>(y);
    const auto along = [&](int row) {
      return static_cast<float>(image(row, x)) * (1 - right) +
             static_cast<float>(image(row, x + 1)) * right;
    };
    return along(y) * (1 - down) + along(y + 1) * down;
  }

  /// Returns how much a region differs from the earlier image, grey levels: with compensation or
  /// without, whichever is less. None with too few pixels that can be compensated.
  static std::optional<double> difference(const FramePair& pair, int row, int column) {
    if (!pair.pose) return {};
    const int left = column * cell_px, top = row * cell_px;
    const int right = std::min(left + cell_px, pair.image.cols);
    const int bottom = std::min(top + cell_px, pair.image.rows);
    const cv::Mat1b then = pair.then->frame.image;
    double plain = 0, compensated = 0;
    int samples = 0;
    for (int y = top; y < bottom; y += step_px) {
      for (int x = left; x < right; x += step_px) {
        const auto depth_m = pair.now.frame.depth_m({x, y});
        if (!depth_m) continue;
        const cv::Point2f at(static_cast<float>(x), static_cast<float>(y));
        const cv::Point3d point = pair.camera.point(pair.camera.ideal(at), *depth_m);
        const auto place = pair.camera.project(*pair.pose * point);
        if (!place) continue;
        const auto now = grey_at(pair.image, at);
        const auto moved = grey_at(then, cv::Point2f(pair.camera.raw(*place)));
        if (!now || !moved) continue;
        compensated += double{std::abs(*now - *moved)};
        plain += std::abs(pair.image(y, x) - then(y, x));
        ++samples;
      }
    }
    if (samples < min_samples) return {};
    return std::min(plain, compensated) / samples;
  }

  static double log_likelihood_ratio(double difference) {
    const auto log_normal = [difference](double mean, double deviation) {
      const double scaled = (difference - mean) / deviation;
      return -0.5 * scaled * scaled - std::log(deviation);
    };
    // Below the static mean, and above the moving one, a region is not less so.
    const double is_static = difference < static_mean ? -std::log(static_deviation)
                                                      : log_normal(static_mean, static_deviation);
    const double is_moving = difference > moving_mean ? -std::log(moving_deviation)
                                                      : log_normal(moving_mean, moving_deviation);
    return is_moving - is_static;
  }

  cv::Mat1d log_odds_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_REGION_RULES_HPP
