// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The figures of a frame that InputChecks judges.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/segmenters/input_checks.hpp"

namespace dynfilter {
namespace {

/// Share of places where depth and mask agree, so that what surrounds the person is known.
constexpr double min_fit = 0.6;
constexpr double min_one_value = 0.05;  // share of places that have the commonest depth

/// Places at which each frame is looked at.
constexpr int grid_columns = 64, grid_rows = 48, grid_places = grid_columns * grid_rows;

cv::Point grid_pixel(int k, const cv::Size& size) {
  return {(2 * (k % grid_columns) + 1) * size.width / (2 * grid_columns),
          (2 * (k / grid_columns) + 1) * size.height / (2 * grid_rows)};
}

bool is_at_border(int k) {
  const int column = k % grid_columns, row = k / grid_columns;
  return column == 0 || row == 0 || column == grid_columns - 1 || row == grid_rows - 1;
}

}  // namespace

void InputChecks::look_at_image(const FrameView& frame, Figures& figures) {
  const cv::Mat& image = frame.image;
  figures.has_image = !image.empty();
  if (image.empty() || image.depth() != CV_8U) return;
  std::vector<double> greys;
  for (int k = 0; k < grid_places; ++k) {
    const cv::Point pixel = grid_pixel(k, image.size());
    const std::uint8_t* bytes = image.ptr<std::uint8_t>(pixel.y) + image.channels() * pixel.x;
    greys.push_back(image.channels() < 3 ? bytes[0] : (bytes[0] + bytes[1] + bytes[2]) / 3);
  }
  figures.repeats_image = greys == greys_;
  greys_ = greys;
  figures.brightest = detail::quantile_of(greys, 0.99);
  figures.grey_range = figures.brightest - detail::quantile_of(greys, 0.01);
}

void InputChecks::look_at_depth(const FrameView& frame, Figures& figures) {
  if (frame.depth.empty()) return;
  std::vector<double> now, depths;
  cv::Rect2d seen;  // of the grid
  for (int k = 0; k < grid_places; ++k) {
    now.push_back(frame.depth_m(grid_pixel(k, frame.depth.size())).value_or(0));
    if (now.back() == 0) continue;
    depths.push_back(now.back());
    seen |= cv::Rect2d(k % grid_columns, k / grid_columns, 1, 1);
  }
  figures.missing = 1 - static_cast<double>(depths.size()) / grid_places;
  if (depths.size() < 50) return;
  figures.left = seen.x / grid_columns;
  figures.right = 1 - seen.br().x / grid_columns;
  figures.top = seen.y / grid_rows;
  figures.bottom = 1 - seen.br().y / grid_rows;
  figures.repeats_depth = now == depths_;
  depths_ = now;
  std::sort(depths.begin(), depths.end());
  const auto at = [&](double share) {
    return depths[static_cast<std::size_t>(share * static_cast<double>(depths.size()))];
  };
  figures.near_m = at(0.05);
  figures.depth_m = at(0.5);
  figures.far_m = at(0.95);
  double commonest = 0;
  std::ptrdiff_t most = 0;
  std::vector<double> steps;
  for (auto first = depths.begin(), last = first; first != depths.end(); first = last) {
    last = std::upper_bound(first, depths.end(), *first);
    if (last != depths.end()) steps.push_back(*last - *first);
    if (last - first > most) commonest = *first;
    most = std::max(most, last - first);
  }
  if (steps.size() > 1) figures.step = detail::quantile_of(steps) / figures.depth_m;
  // A surface has depths near its commonest one, and what means "no depth" is beyond all others or
  // in place of 0.
  const auto around = std::upper_bound(depths.begin(), depths.end(), commonest * 1.03) -
                      std::lower_bound(depths.begin(), depths.end(), commonest * 0.97);
  const bool is_alone =
      around < most + most / 2 && static_cast<double>(most) > min_one_value * grid_places;
  const bool is_measured = steps.empty() || steps.size() > 15;  // not drawn with a few values
  const bool is_odd = commonest == depths.back() || figures.missing < 0.02;
  figures.one_value = is_alone && is_odd && is_measured ? commonest / frame.depth_scale() : 0;
}

bool InputChecks::is_dynamic(const Instance& instance) const {
  const std::vector<int>& dynamic = options_.dynamic_classes;
  return std::find(dynamic.begin(), dynamic.end(), instance.class_id) != dynamic.end();
}

bool InputChecks::is_on_people(const Segmentation& masks, cv::Point pixel) const {
  return std::any_of(masks.instances.begin(), masks.instances.end(), [&](const Instance& one) {
    return is_dynamic(one) && (one.mask.empty() ? one.box_contains(pixel) : one.covers(pixel));
  });
}

void InputChecks::look_at_masks(const FrameView& frame, const Segmentation& masks,
                                Figures& figures) {
  double covered = 0, at_border = 0;
  std::vector<double> now;
  for (int k = 0; k < grid_places; ++k) {
    now.push_back(is_on_people(masks, grid_pixel(k, size_)) ? 1 : 0);
    covered += now.back();
    at_border += is_at_border(k) ? now.back() : 0;
  }
  figures.repeats_masks = covered > 0 && now == covered_ && masks.timestamp_s == frame.timestamp_s;
  covered_ = now;
  figures.covered = covered / grid_places;
  figures.border = at_border / (2 * grid_columns + 2 * grid_rows - 4);
  const Instance* largest = nullptr;
  for (const Instance& one : masks.instances) {
    classes_.insert(one.class_id);
    has_dynamic_ = has_dynamic_ || is_dynamic(one);
    figures.age_s = std::abs(frame.timestamp_s - masks.timestamp_s);
    const bool is_larger = largest == nullptr || one.mask.total() > largest->mask.total();
    if (is_dynamic(one) && is_larger) largest = &one;
  }
  if (largest != nullptr && !frame.depth.empty()) look_at_person(frame, *largest, figures);
}

/// Measures how large the person is, and how far its depth is shifted against its mask: where depth
/// and mask agree best, first across, then down.
void InputChecks::look_at_person(const FrameView& frame, const Instance& person,
                                 Figures& figures) const {
  std::vector<double> depths;
  double count = 0;
  cv::Rect box;
  for (int k = 0; k < grid_places; ++k) {
    const cv::Point pixel = grid_pixel(k, size_);
    if (!person.covers(pixel)) continue;
    ++count;
    box |= cv::Rect(pixel, cv::Size(1, 1));
    if (const auto depth_m = frame.depth_m(pixel)) depths.push_back(*depth_m);
  }
  if (count < 0.02 * grid_places || depths.size() < 20) return;
  const double depth_m = detail::quantile_of(depths), half_m = std::max(0.25, 0.12 * depth_m);
  const double focal_px =
      camera_.fx > 0 ? camera_.fx : 0.85 * size_.width;  // as most RGB-D cameras
  figures.people_m = std::sqrt(count / grid_places * size_.area()) * depth_m / focal_px;
  const int step = std::max(1, size_.width / 160), reach = 10;
  double known = 0, alike = 0, apart = 0, nearer = 0;  // places around the person
  const auto fit = [&](int dx, int dy) {
    known = alike = apart = nearer = 0;
    for (int y = box.y - reach * step; y < box.br().y + reach * step; y += 2 * step) {
      for (int x = box.x - reach * step; x < box.br().x + reach * step; x += 2 * step) {
        const auto there_m = frame.depth_m({x + dx * step, y + dy * step});
        if (!there_m) continue;
        const bool is_near = std::abs(*there_m - depth_m) < half_m, is_on = person.covers({x, y});
        ++known;
        alike += is_near == is_on ? 1 : 0;
        if (is_near || is_on) continue;
        ++apart;
        nearer += *there_m < depth_m ? 1 : 0;
      }
    }
    return alike / std::max(1.0, known);
  };
  cv::Point best(0, 0);
  figures.fit = fit(0, 0);
  if (apart > 20 && figures.fit > min_fit) figures.nearer = nearer / apart;
  const auto look = [&](int dx, int dy) {
    const double now = fit(dx, dy);
    if (now > figures.fit) best = {dx, dy};
    figures.fit = std::max(now, figures.fit);
  };
  for (int dx = -reach; dx <= reach; ++dx) look(dx, 0);
  const int across = best.x;
  for (int dy = -reach; dy <= reach; ++dy) look(across, dy);
  figures.shift_x = 640.0 / size_.width * step * best.x;
  figures.shift_y = 640.0 / size_.width * step * best.y;
  figures.distance = std::hypot(figures.shift_x, figures.shift_y / 2);
}

}  // namespace dynfilter
