// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_FEATURE_TRACKER_HPP
#define DYNFILTER_MOTION_FEATURE_TRACKER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/point_motion.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Place of a feature in another frame.
struct FeatureTrack {
  cv::Point2f position;   ///< raw pixels of the other frame; meaningless if not found
  bool is_found = false;  ///< whether the feature could be followed
  /// Texture of its window, 0 or more: the smaller eigenvalue of the matrix of gradients, as
  /// cv::calcOpticalFlowPyrLK gives it; 0 = unknown. The less texture, the noisier the track.
  float texture = 0;
};

/// Returns the motions of the features that were found in the last frame, for
/// MaskPropagator::propagate. `tracks` has one place in the last frame for each feature of this
/// one, as FeatureTracker::track leaves them. Throws std::invalid_argument for another number of
/// tracks. O(features).
std::vector<PointMotion> point_motions(FeaturesView features,
                                       const std::vector<FeatureTrack>& tracks);

/// Options of FeatureTracker.
struct FeatureTrackerOptions {
  /// Window that is compared, pixels; 5 to 99 wide and high. A small one reaches less over the
  /// edges of things that move differently, and is fast; a large one has less noise. OpenCV
  /// compares 8 pixels of a row at once, so that one of 11x11 takes half as long again as this one.
  cv::Size window_px = {8, 15};
  int levels = 3;      ///< halvings of the image; 0 to 8
  int iterations = 8;  ///< steps on each level, at most; 1 to 100
  /// Largest distance from a feature of where tracking it back ends, pixels; above 0.
  double max_forward_backward_px = 0.5;
};

/// Grey image of a frame with its reductions, to track features from and into. Building one costs
/// a conversion to grey and the pyramid; it serves any number of baselines.
class ImagePyramid {
 public:
  /// Whether there is no image.
  bool empty() const { return levels_.empty(); }
  /// Size of the image, pixels.
  cv::Size size() const { return grey_.size(); }
  /// The grey image, CV_8UC1.
  const cv::Mat1b& grey() const { return grey_; }

 private:
  friend class FeatureTracker;
  cv::Mat1b grey_;               // a copy: hosts reuse their buffers
  std::vector<cv::Mat> levels_;  // with derivatives
};

/// Finds where the features of one frame were in another by the pyramidal Lucas-Kanade method
/// (J.-Y. Bouguet, 2000). A track counts if tracking it back ends where it began (Z. Kalal, K.
/// Mikolajczyk, J. Matas, "Forward-backward error", 2010).
///
/// const and re-entrant. Apart from what OpenCV allocates inside, warm calls allocate nothing.
class FeatureTracker {
 public:
  /// Takes the options. Throws std::invalid_argument for options out of range.
  explicit FeatureTracker(const FeatureTrackerOptions& options = {});

  /// Builds the pyramid of an image of type CV_8UC1, CV_8UC3 (BGR) or CV_8UC4, reusing the memory
  /// of `pyramid`. An image smaller than two windows in either direction gives an empty pyramid.
  /// Throws std::invalid_argument for another type and for no image at all. O(pixels).
  void build(const cv::Mat& image, ImagePyramid& pyramid) const;

  /// Finds the features of frame `from` in frame `to`, one track for each. A feature outside the
  /// image has no track. With `expected`, which has one place for each feature, the search begins
  /// there, on the image and its half only: where texture repeats, smaller images lead from a good
  /// beginning to a wrong place. If the found features are a pixel or more away from their expected
  /// places, by the median, the others are searched for once more, from their expected places plus
  /// that median. A feature that is expected outside the image has no track. Both
  /// pyramids must be of this tracker. Throws std::invalid_argument for pyramids that are empty or
  /// of different sizes, and for another number of expected places. O(features).
  void track(const ImagePyramid& from, const ImagePyramid& to, FeaturesView features,
             const std::vector<cv::Point2f>* expected, std::vector<FeatureTrack>& tracks,
             Workspace& workspace) const;

  /// Searches once more for the features that track() did not find, from their places in `from` and
  /// on all images: for what does not move as expected. Throws like track. O(features).
  void track_again(const ImagePyramid& from, const ImagePyramid& to, FeaturesView features,
                   std::vector<FeatureTrack>& tracks, Workspace& workspace) const;

  /// Improves a host's tracks: matches of descriptors are as coarse as their pyramid and do not
  /// tell small motions. Searches on the full image only, around where a track that is found ends;
  /// drops those that fail the forward-backward check. Throws like track. O(features).
  void refine(const ImagePyramid& from, const ImagePyramid& to, FeaturesView features,
              std::vector<FeatureTrack>& tracks, Workspace& workspace) const;

 private:
  void follow(const ImagePyramid& from, const ImagePyramid& to, FeaturesView features, int levels,
              std::vector<FeatureTrack>& tracks, Workspace& workspace) const;
  template <class Begin>
  void follow_others(const ImagePyramid& from, const ImagePyramid& to, FeaturesView features,
                     int levels, const Begin& begin, std::vector<FeatureTrack>& tracks,
                     Workspace& workspace) const;

  FeatureTrackerOptions options_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_FEATURE_TRACKER_HPP
