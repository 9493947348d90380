// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/feature_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/quantile.hpp"

namespace dynfilter {
namespace {

constexpr double min_step_px = 0.03;
constexpr double min_eigenvalue = 1e-4;
constexpr int levels_near = 1;         // halvings for a search near an expected place
constexpr double min_miss_px = 1;      // of expected places, for another search
constexpr std::size_t min_found = 10;  // features that tell by how much expected places miss

struct TrackerScratch {
  std::vector<std::size_t> indices;  // of the features that are tracked
  std::vector<cv::Point2f> points, found, back;
  std::vector<std::uint8_t> is_found, is_found_back;
  std::vector<float> textures, textures_back, misses_x, misses_y;
  std::vector<FeatureTrack> first;  // tracks of the first search
};

void require_pair(const ImagePyramid& from, const ImagePyramid& to) {
  if (!from.empty() && !to.empty() && from.size() == to.size()) return;
  detail::throw_misuse(
      "FeatureTracker",
      detail::concatenate(from.empty() || to.empty() ? "empty pyramids: " : "",
                          detail::size_name(from.size()), " and ", detail::size_name(to.size())),
      "the pyramids of two images of the same size");
}

void require_count(std::size_t places, std::size_t features) {
  if (places == features) return;
  detail::throw_misuse("FeatureTracker",
                       detail::concatenate(places, " places and ", features, " features"),
                       "one place for each feature");
}

/// Tracks scratch.points to scratch.found, from there on, and back to scratch.back.
void track_there_and_back(const std::vector<cv::Mat>& from, const std::vector<cv::Mat>& to,
                          const FeatureTrackerOptions& options, int levels,
                          TrackerScratch& scratch) {
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS,
                                  options.iterations, min_step_px);
  scratch.back.clear();  // at first, the shift that was expected the other way
  for (std::size_t k = 0; k < scratch.points.size(); ++k) {
    scratch.back.push_back(scratch.points[k] - scratch.found[k]);
  }
  const auto follow = [&](const auto& first, const auto& second,
                          const std::vector<cv::Point2f>& points, std::vector<cv::Point2f>& found,
                          std::vector<std::uint8_t>& is_found, std::vector<float>& textures) {
    cv::calcOpticalFlowPyrLK(
        first, second, points, found, is_found, textures, options.window_px, levels, criteria,
        cv::OPTFLOW_USE_INITIAL_FLOW | cv::OPTFLOW_LK_GET_MIN_EIGENVALS, min_eigenvalue);
  };
  follow(from, to, scratch.points, scratch.found, scratch.is_found, scratch.textures);
  for (std::size_t k = 0; k < scratch.points.size(); ++k) scratch.back[k] += scratch.found[k];
  follow(to, from, scratch.found, scratch.back, scratch.is_found_back, scratch.textures_back);
}

/// Returns by how much the expected places missed the features that were found, the median along
/// either axis; nothing where too few were found.
cv::Point2f median_miss(const std::vector<cv::Point2f>& expected,
                        const std::vector<FeatureTrack>& tracks, TrackerScratch& scratch) {
  for (std::vector<float>* misses : {&scratch.misses_x, &scratch.misses_y}) {
    misses->clear();
    misses->reserve(tracks.size());
  }
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (!tracks[i].is_found) continue;
    scratch.misses_x.push_back(tracks[i].position.x - expected[i].x);
    scratch.misses_y.push_back(tracks[i].position.y - expected[i].y);
  }
  if (scratch.misses_x.size() < min_found) return {};
  return {detail::quantile_of(scratch.misses_x), detail::quantile_of(scratch.misses_y)};
}

bool is_inside(cv::Point2f point, cv::Size size) {
  return point.x >= 0 && point.y >= 0 && point.x <= static_cast<float>(size.width - 1) &&
         point.y <= static_cast<float>(size.height - 1);
}

}  // namespace

std::vector<PointMotion> point_motions(FeaturesView features,
                                       const std::vector<FeatureTrack>& tracks) {
  require_count(tracks.size(), features.size());
  std::vector<PointMotion> motions;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (tracks[i].is_found) motions.push_back({tracks[i].position, features[i]});
  }
  return motions;
}

FeatureTracker::FeatureTracker(const FeatureTrackerOptions& options) : options_(options) {
  static constexpr detail::OptionCheck require("FeatureTracker");
  const auto is_window_side = [](int side_px) { return side_px >= 5 && side_px <= 99; };
  require(is_window_side(options.window_px.width), "window_px.width", options.window_px.width,
          "5 to 99");
  require(is_window_side(options.window_px.height), "window_px.height", options.window_px.height,
          "5 to 99");
  require(options.levels >= 0 && options.levels <= 8, "levels", options.levels, "0 to 8");
  require(options.iterations >= 1 && options.iterations <= 100, "iterations", options.iterations,
          "1 to 100");
  require(options.max_forward_backward_px > 0, "max_forward_backward_px",
          options.max_forward_backward_px, "a number above 0");
}

void FeatureTracker::build(const cv::Mat& image, ImagePyramid& pyramid) const {
  const int type = image.type();
  const bool is_picture = !image.empty() && image.dims == 2;
  if (!is_picture || (type != CV_8UC1 && type != CV_8UC3 && type != CV_8UC4)) {
    detail::throw_misuse("FeatureTracker::build",
                         detail::concatenate("an image of type ", detail::type_name(image),
                                             " and size ", detail::size_name(image)),
                         "CV_8UC1, CV_8UC3 or CV_8UC4");
  }
  if (type == CV_8UC1) {
    image.copyTo(pyramid.grey_);
  } else {
    cv::cvtColor(image, pyramid.grey_, type == CV_8UC3 ? cv::COLOR_BGR2GRAY : cv::COLOR_BGRA2GRAY);
  }
  const cv::Size window = options_.window_px;
  if (image.cols < 2 * window.width || image.rows < 2 * window.height) {
    pyramid.levels_.clear();
    return;
  }
  try {
    cv::buildOpticalFlowPyramid(pyramid.grey_, pyramid.levels_, window, options_.levels);
  } catch (...) {
    pyramid.levels_.clear();  // OpenCV would write into levels of the right size without pixels
    throw;
  }
}

void FeatureTracker::track(const ImagePyramid& from, const ImagePyramid& to, FeaturesView features,
                           const std::vector<cv::Point2f>* expected,
                           std::vector<FeatureTrack>& tracks, Workspace& workspace) const {
  if (expected) require_count(expected->size(), features.size());
  tracks.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    tracks[i] = {expected ? (*expected)[i] : features[i], true};
  }
  if (!expected) {
    follow(from, to, features, options_.levels, tracks, workspace);
    return;
  }
  const int levels = std::min(options_.levels, levels_near);
  follow(from, to, features, levels, tracks, workspace);
  // Most were missed by about as much as the others.
  const cv::Point2f miss = median_miss(*expected, tracks, workspace.get<TrackerScratch>());
  if (cv::norm(miss) < min_miss_px) return;
  follow_others(
      from, to, features, levels,
      [&](std::size_t i) {
        const cv::Point2f place = (*expected)[i];
        return FeatureTrack{place + miss, is_inside(place, to.size())};
      },
      tracks, workspace);
}

void FeatureTracker::track_again(const ImagePyramid& from, const ImagePyramid& to,
                                 FeaturesView features, std::vector<FeatureTrack>& tracks,
                                 Workspace& workspace) const {
  require_count(tracks.size(), features.size());
  follow_others(
      from, to, features, options_.levels,
      [&](std::size_t i) {
        return FeatureTrack{features[i], true};
      },
      tracks, workspace);
}

/// Follows the features that were not found, from other places.
template <class Begin>
void FeatureTracker::follow_others(const ImagePyramid& from, const ImagePyramid& to,
                                   FeaturesView features, int levels, const Begin& begin,
                                   std::vector<FeatureTrack>& tracks, Workspace& workspace) const {
  std::vector<FeatureTrack>& first = workspace.get<TrackerScratch>().first;
  first.assign(tracks.begin(), tracks.end());
  for (std::size_t i = 0; i < features.size(); ++i) {
    tracks[i] = first[i].is_found ? FeatureTrack() : begin(i);
  }
  follow(from, to, features, levels, tracks, workspace);
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (first[i].is_found) tracks[i] = first[i];
  }
}

void FeatureTracker::refine(const ImagePyramid& from, const ImagePyramid& to, FeaturesView features,
                            std::vector<FeatureTrack>& tracks, Workspace& workspace) const {
  require_count(tracks.size(), features.size());
  follow(from, to, features, 0, tracks, workspace);
}

void FeatureTracker::follow(const ImagePyramid& from, const ImagePyramid& to, FeaturesView features,
                            int levels, std::vector<FeatureTrack>& tracks,
                            Workspace& workspace) const {
  require_pair(from, to);
  TrackerScratch& scratch = workspace.get<TrackerScratch>();
  scratch.indices.clear();
  scratch.points.clear();
  scratch.found.clear();
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (!tracks[i].is_found) continue;
    tracks[i].is_found = false;
    if (!is_inside(features[i], from.size()) || !is_inside(tracks[i].position, to.size())) continue;
    scratch.indices.push_back(i);
    scratch.points.push_back(features[i]);
    scratch.found.push_back(tracks[i].position);
  }
  if (scratch.points.empty()) return;
  track_there_and_back(from.levels_, to.levels_, options_, levels, scratch);
  for (std::size_t k = 0; k < scratch.indices.size(); ++k) {
    const double error = cv::norm(scratch.back[k] - scratch.points[k]);
    const bool is_found = scratch.is_found[k] != 0 && scratch.is_found_back[k] != 0 &&
                          error <= options_.max_forward_backward_px &&
                          is_inside(scratch.found[k], to.size());
    tracks[scratch.indices[k]] = {scratch.found[k], is_found, scratch.textures[k]};
  }
}

}  // namespace dynfilter
