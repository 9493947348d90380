// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "detections.hpp"

#include <algorithm>
#include <cstddef>

#include "masks.hpp"
#include "noise.hpp"

namespace dynfilter::scene {
namespace {

/// Tells whether the detector misses the person; each person is missed at other times.
bool is_missed(const SyntheticSceneOptions& options, int person, int frame) {
  const std::uint64_t start = make_key(options.seed, Stream::missed, person);
  const auto period = static_cast<std::uint64_t>(missed_period_frames);
  const std::uint64_t place = (start % period + static_cast<std::uint64_t>(frame)) % period;
  return place < static_cast<std::uint64_t>(options.missed_frames);
}

/// Merges two instances into one, as a detector does that takes two persons for one.
Instance merged(const Instance& a, const Instance& b, cv::Size size) {
  cv::Mat1b mask(size, std::uint8_t{0});
  for (const Instance* instance : {&a, &b}) {
    if (instance->mask.empty()) continue;
    mask(cv::Rect(instance->mask_origin, instance->mask.size())).setTo(255, instance->mask);
  }
  Instance both =
      Instance::from_image_mask(mask, a.box | b.box, a.class_id, std::max(a.score, b.score));
  both.track_id = std::min(a.track_id, b.track_id);
  return both;
}

/// Merges instances whose boxes overlap until no two do. A merged one takes the place of the better
/// one.
void merge_overlapping(std::vector<Instance>& found, cv::Size size) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t j = i + 1; j < found.size(); ++j) {
      if ((found[i].box & found[j].box).empty()) continue;
      found[i] = merged(found[i], found[j], size);
      found.erase(found.begin() + static_cast<std::ptrdiff_t>(j));
      j = i;  // the box has grown: compare with all again
    }
  }
}

}  // namespace

std::vector<Instance> detections(const SyntheticSceneOptions& options, int frame,
                                 const cv::Mat1i& surface) {
  std::vector<Instance> found = true_instances(surface, options.persons);
  if (!options.perfect_masks) found = poor_instances(options, frame, surface, found);
  found.erase(std::remove_if(found.begin(), found.end(),
                             [&](const Instance& instance) {
                               return is_missed(options, *instance.track_id, frame);
                             }),
              found.end());
  if (options.overlapping_as_one) merge_overlapping(found, surface.size());
  return found;
}

}  // namespace dynfilter::scene
