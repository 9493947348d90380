// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_FLOW_CHI_SQUARE_HPP
#define DYNFILTER_SRC_LAB_RULES_FLOW_CHI_SQUARE_HPP

#include <cstddef>
#include <optional>

#include <opencv2/core.hpp>

#include "lab/rules/frame_pair.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

/// Derome's test of moving points (M. Derome et al., "Moving Object Detection in Real-Time Using
/// Stereo from a Mobile Platform", Unmanned Systems 2015). Depth and the camera's motion predict
/// the flow of a static point. The residual flow r is compared with its covariance S, which is that
/// of depth, motion and flow carried through the prediction: the point moves if r' S^-1 r exceeds
/// the 99 % quantile.
///
/// Open in the source, or changed: it tests every pixel of a dense stereo pair's flow and joins the
/// moving ones to components; here every feature is tested alone. The
/// camera's motion is FrameMemory's. Features without depth or track stay, and all where the
/// camera's motion is unknown. It needs no masks. O(features).
class FlowChiSquare {
 public:
  static constexpr int baseline_frames = 1;

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      const auto value = statistic(pair, i);
      if (value && *value > max_statistic) remove(labels, i);
    }
  }

  /// Returns r' S^-1 r of a feature; none without track, depth or the camera's motion. O(1).
  std::optional<double> statistic(const FramePair& pair, std::size_t i) const {
    const auto flow = residual_flow(pair, i);
    if (!flow) return {};
    const cv::Matx22d inverse = covariance(pair, *point_now(pair, i)).inv();
    return flow->dot(inverse * *flow);
  }

 private:
  static constexpr double max_statistic = 9.21;  // 99 % of chi-square, two degrees of freedom
  // Standard deviations of what the prediction rests on; open in the description.
  static constexpr double translation_noise_m = 0.002;  // of the camera, along each axis
  static constexpr double rotation_noise_rad = 0.0005;  // and about each axis
  static constexpr double track_noise_px = 0.3;         // of a track, each way

  /// Returns the covariance of the residual flow of a point, pixels^2.
  static cv::Matx22d covariance(const FramePair& pair, const cv::Point3d& now) {
    const cv::Vec3d turned = pair.pose->rotation * cv::Vec3d(now);
    const cv::Vec3d then = turned + pair.pose->translation;
    const double z = then[2];
    const cv::Matx23d by_point(pair.camera.fx / z, 0, -pair.camera.fx * then[0] / (z * z),  //
                               0, pair.camera.fy / z, -pair.camera.fy * then[1] / (z * z));
    const cv::Vec2d by_depth = by_point * (turned * (1 / now.z));  // the point moves on its ray
    const cv::Matx33d cross(0, turned[2], -turned[1],              //
                            -turned[2], 0, turned[0],              //
                            turned[1], -turned[0], 0);
    const cv::Matx23d by_rotation = by_point * cross;
    const auto square = [](double value) { return value * value; };
    return square(depth_deviation_m(now.z)) * (by_depth * by_depth.t()) +
           square(translation_noise_m) * (by_point * by_point.t()) +
           square(rotation_noise_rad) * (by_rotation * by_rotation.t()) +
           square(track_noise_px) * cv::Matx22d::eye();
  }
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_FLOW_CHI_SQUARE_HPP
