// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "local_mapping.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "bundle_adjustment.hpp"

namespace odometry {
namespace {

constexpr std::size_t max_fixed = 20;
constexpr std::size_t min_shared = 15;

/// The keyframes and points to adjust, by their ids in the map.
struct Selection {
  std::vector<KeyframeId> keyframes;  // the free ones first
  std::size_t free_keyframes = 0;
  std::vector<PointId> points;
};

Selection select(const LocalMap& map, KeyframeId keyframe, std::size_t neighbours) {
  Selection selection;
  const std::vector<PointId>& own_points = map.keyframe(keyframe).points;
  selection.keyframes = map.covisible(own_points, neighbours + 1, min_shared);
  std::vector<KeyframeId>& keyframes = selection.keyframes;
  if (std::find(keyframes.begin(), keyframes.end(), keyframe) == keyframes.end()) {
    keyframes.push_back(keyframe);
  }
  selection.points = map.points_of(keyframes);
  selection.free_keyframes = keyframes.size();
  for (const KeyframeId k : map.covisible(selection.points, max_fixed, 1)) {
    if (std::find(keyframes.begin(), keyframes.end(), k) == keyframes.end()) keyframes.push_back(k);
  }
  // The first keyframe defines the world's frame, so it stays fixed.
  const auto free_end = keyframes.begin() + static_cast<std::ptrdiff_t>(selection.free_keyframes);
  const auto oldest = std::min_element(keyframes.begin(), free_end);
  if (*oldest == 0 || keyframes.size() == selection.free_keyframes) {
    std::iter_swap(oldest, free_end - 1);
    --selection.free_keyframes;
  }
  return selection;
}

Bundle make_bundle(const LocalMap& map, const Selection& selection) {
  Bundle bundle;
  bundle.free_poses = selection.free_keyframes;
  std::vector<std::size_t> index(map.size(), selection.keyframes.size());
  for (std::size_t i = 0; i < selection.keyframes.size(); ++i) {
    index[selection.keyframes[i]] = i;
    bundle.poses.push_back(map.keyframe(selection.keyframes[i]).pose);
  }
  for (const PointId id : selection.points) {
    for (const auto& [keyframe, feature] : map.point(id).observations) {
      if (index[keyframe] == selection.keyframes.size()) continue;
      bundle.observations.push_back({index[keyframe], bundle.points.size(),
                                     map.keyframe(keyframe).features[feature].observation});
    }
    bundle.points.push_back(map.point(id).position);
  }
  return bundle;
}

/// Lists the outliers in make_bundle's order: the n-th observation here is the n-th there.
std::vector<std::pair<KeyframeId, std::size_t>> outliers_of(const LocalMap& map,
                                                            const Selection& selection,
                                                            const Bundle& bundle) {
  std::vector<bool> is_selected(map.size(), false);
  for (const KeyframeId k : selection.keyframes) is_selected[k] = true;
  std::vector<std::pair<KeyframeId, std::size_t>> outliers;
  std::size_t n = 0;
  for (const PointId id : selection.points) {
    for (const auto& observation : map.point(id).observations) {
      if (!is_selected[observation.first]) continue;
      if (!bundle.observations[n++].is_inlier) outliers.push_back(observation);
    }
  }
  return outliers;
}

}  // namespace

void adjust_around(LocalMap& map, const PinholeCamera& camera, KeyframeId keyframe,
                   std::size_t neighbours) {
  const Selection selection = select(map, keyframe, neighbours);
  Bundle bundle = make_bundle(map, selection);
  adjust_bundle(camera, bundle);
  const auto outliers = outliers_of(map, selection, bundle);
  for (std::size_t i = 0; i < selection.free_keyframes; ++i) {
    map.keyframe(selection.keyframes[i]).pose = bundle.poses[i];
  }
  for (std::size_t p = 0; p < selection.points.size(); ++p) {
    map.point(selection.points[p]).position = bundle.points[p];
  }
  for (const auto& [observer, feature] : outliers) {
    // An earlier removed observation may have removed the point, too.
    if (map.keyframe(observer).points[feature] != no_point)
      map.remove_observation(observer, feature);
  }
}

}  // namespace odometry
