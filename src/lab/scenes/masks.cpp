// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

#include <opencv2/imgproc.hpp>

#include "moment.hpp"
#include "noise.hpp"

namespace dynfilter::scene {
namespace {

constexpr int network_side = 138;  // the side of YOLACT's prototypes
// The smallest visible share of the image at which a person is found.
constexpr double min_share = 200.0 / (640 * 480);
constexpr double limbs_missing_s = 0.4;

using Regions = std::array<bool, limb_regions + 1>;  // by BodyRegion

struct MaskFaultShares {
  int min_limbs;           // the smallest number of missing limbs
  std::uint64_t choices;   // numbers from there on
  double torso_share = 0;  // shares of the periods without torso, and with an empty mask
  double empty_share = 0;
};

MaskFaultShares faults_of(MaskFaults faults) {
  if (faults == MaskFaults::few_limbs) return {1, 3};
  if (faults == MaskFaults::torso) return {3, 4, 0.75, 0.06};
  return {2, 4};
}

/// Returns the parts of a person that the mask misses now; all of them while the mask is empty.
Regions missing_regions(const SyntheticSceneOptions& options, int person, double elapsed_s) {
  const std::uint64_t key = make_key(options.seed, Stream::mask_limbs, person);
  const auto slot = static_cast<std::int64_t>(std::floor(elapsed_s / limbs_missing_s + unit(key)));
  const std::uint64_t now = make_key(key, slot);
  const MaskFaultShares faults = faults_of(options.mask_faults);
  const int count = faults.min_limbs + static_cast<int>(mixed_bits(now) % faults.choices);
  Regions missing{};
  if (unit(make_key(now, 101)) < faults.empty_share) {
    missing.fill(true);
    return missing;
  }
  missing[0] = unit(make_key(now, 100)) < faults.torso_share;
  std::array<int, limb_regions> order{};
  std::iota(order.begin(), order.end(), 1);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return make_key(now, a) < make_key(now, b); });
  for (int i = 0; i < count; ++i) {
    missing[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])] = true;
  }
  return missing;
}

/// Computes the share of each of the network's cells that the person covers, without missing limbs.
cv::Mat1f covered_cells(const cv::Mat1i& surface, int person, const std::vector<BodyPart>& body,
                        const Regions& missing) {
  cv::Mat1f covered(network_side, network_side, 0.0F);
  cv::Mat1f total(network_side, network_side, 0.0F);
  for (int y = 0; y < surface.rows; ++y) {
    for (int x = 0; x < surface.cols; ++x) {
      const int row = y * network_side / surface.rows;
      const int column = x * network_side / surface.cols;
      const int id = surface(y, x);
      total(row, column) += 1;
      if (!SurfaceId::is_part(id) || SurfaceId::person(id) != person) continue;
      const auto part = static_cast<std::size_t>(SurfaceId::part_index(id));
      if (!missing[static_cast<std::size_t>(body[part].region)]) covered(row, column) += 1;
    }
  }
  // A small image has fewer rows than the network, so a cell without a pixel copies its neighbour.
  for (int y = 0; y < network_side; ++y) {
    for (int x = 0; x < network_side; ++x) {
      if (total(y, x) > 0)
        covered(y, x) /= total(y, x);
      else
        covered(y, x) = y > 0 && total(y - 1, x) > 0 ? covered(y - 1, x)
                        : x > 0                      ? covered(y, x - 1)
                                                     : 0.0F;
    }
  }
  return covered;
}

/// Blurs with the weights 1 2 1 in both directions, divided by 16.
cv::Mat1f blurred(const cv::Mat1f& cells) {
  cv::Mat1f out(cells.size());
  for (int y = 0; y < cells.rows; ++y) {
    for (int x = 0; x < cells.cols; ++x) {
      float sum = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int row = std::clamp(y + dy, 0, cells.rows - 1);
          const int column = std::clamp(x + dx, 0, cells.cols - 1);
          sum += cells(row, column) * static_cast<float>((2 - dx * dx) * (2 - dy * dy));
        }
      }
      out(y, x) = sum / 16.0F;
    }
  }
  return out;
}

/// Scales the cells up to the image (bilinear) and cuts them at 0.5 and at the box.
cv::Mat1b cut_mask(const cv::Mat1f& cells, cv::Size size, const cv::Rect& box) {
  cv::Mat1b mask(size, std::uint8_t{0});
  const auto place = [](int pixel, int pixels, float* fraction) {
    const float at =
        (static_cast<float>(pixel) + 0.5F) * network_side / static_cast<float>(pixels) - 0.5F;
    const float inside = std::clamp(at, 0.0F, static_cast<float>(network_side) - 1.001F);
    *fraction = inside - std::floor(inside);
    return static_cast<int>(inside);
  };
  for (int y = box.y; y < box.br().y; ++y) {
    float down = 0;
    const int row = place(y, size.height, &down);
    for (int x = box.x; x < box.br().x; ++x) {
      float right = 0;
      const int column = place(x, size.width, &right);
      const float upper = cells(row, column) * (1 - right) + cells(row, column + 1) * right;
      const float lower = cells(row + 1, column) * (1 - right) + cells(row + 1, column + 1) * right;
      if (upper * (1 - down) + lower * down > 0.5F) mask(y, x) = 255;
    }
  }
  return mask;
}

/// Returns a detector's box: the true box with each side off by up to three pixels (at 640 pixels'
/// width).
cv::Rect jittered_box(const cv::Rect& box, cv::Size size, std::uint64_t key) {
  const double reach = 3.0 * size.width / 640.0;
  const auto off = [&](int side) {
    return static_cast<int>(std::lround(between(make_key(key, side), -reach, reach)));
  };
  const cv::Point top_left(box.x + off(1), box.y + off(2));
  const cv::Point bottom_right(box.br().x + off(3), box.br().y + off(4));
  const cv::Rect jittered = cv::Rect(top_left, bottom_right) & cv::Rect({0, 0}, size);
  return jittered.empty() ? box : jittered;
}

/// Returns what a network of low resolution that misses limbs finds, by falling score. It misses
/// persons who are hardly visible.
std::vector<Instance> poor_instances(const SyntheticSceneOptions& options, int frame,
                                     const cv::Mat1i& surface, const std::vector<Instance>& truth) {
  const cv::Size size = surface.size();
  const double elapsed_s = frame / frames_per_second;
  std::vector<Instance> found;
  for (const Instance& exact : truth) {
    if (cv::countNonZero(exact.mask) < min_share * size.area()) continue;
    const int person = *exact.track_id;
    const std::uint64_t key = make_key(options.seed, Stream::detection, person, frame);
    const cv::Rect box = jittered_box(exact.box, size, key);
    const auto missing = missing_regions(options, person, elapsed_s);
    const std::vector<BodyPart> body = body_at(options, person, elapsed_s);
    cv::Mat1f cells = blurred(blurred(covered_cells(surface, person, body, missing)));
    const std::uint64_t noise = make_key(options.seed, Stream::mask_noise, person, frame);
    add_noise(cells, 5, 0.20F, noise);
    add_noise(cells, 2, 0.10F, make_key(noise, 1));
    cells += between(make_key(noise, 2), -0.14, 0.06);
    Instance instance =
        Instance::from_image_mask(cut_mask(cells, size, box), box, exact.class_id,
                                  static_cast<float>(between(make_key(key, 5), 0.70, 0.95)));
    instance.track_id = person;
    found.push_back(instance);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Instance& a, const Instance& b) { return a.score > b.score; });
  return found;
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

std::vector<Instance> true_instances(const cv::Mat1i& surface, int persons) {
  std::vector<cv::Mat1b> masks(static_cast<std::size_t>(persons));
  for (cv::Mat1b& mask : masks) mask = cv::Mat1b::zeros(surface.size());
  for (int y = 0; y < surface.rows; ++y) {
    for (int x = 0; x < surface.cols; ++x) {
      const int id = surface(y, x);
      if (SurfaceId::is_part(id))
        masks[static_cast<std::size_t>(SurfaceId::person(id))](y, x) = 255;
    }
  }
  std::vector<Instance> instances;
  for (int person = 0; person < persons; ++person) {
    Instance instance = Instance::from_image_mask(masks[static_cast<std::size_t>(person)]);
    instance.track_id = person;
    if (!instance.box.empty()) instances.push_back(instance);
  }
  return instances;
}

std::vector<Instance> detections(const SyntheticSceneOptions& options, int frame,
                                 const cv::Mat1i& surface) {
  std::vector<Instance> found = true_instances(surface, options.persons);
  if (options.mask_faults != MaskFaults::none) {
    found = poor_instances(options, frame, surface, found);
  }
  if (options.overlapping_as_one) merge_overlapping(found, surface.size());
  return found;
}

}  // namespace dynfilter::scene
