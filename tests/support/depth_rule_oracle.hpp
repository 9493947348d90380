// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Oracle of the rule `depth`: it says the rule anew, as plainly as possible, and computes each
// value where it needs it. It shares only depth_m, covers, nearest_pixel and clip_grown with the
// library. z is a depth, o.m an object's, h the half width.

#pragma once

#include <array>
#include <map>
#include <string>

#include "support/oracle.hpp"

namespace dynfilter::testing {

/// Verdict of the rule `depth` on one input.
struct DepthRuleOracle {
  OracleVerdict filter;                      // the expected one
  std::map<std::string, std::size_t> times;  // that each path was taken

  explicit DepthRuleOracle(const FilterCase& input) : filter(oracle_masks(input)) {
    const DepthCompensatorOptions& options = input.options.compensator.depth;
    const bool has_image = !input.frame.depth.empty();
    const cv::Size size = input.segmentation.image_size;
    const double scale = size.width / 640.0, h = options.half_width_m * (has_image ? 1 : 0.75);
    const std::optional<double> seen = input.segmentation.timestamp_s;
    const double age = seen ? std::abs(input.frame.timestamp_s - *seen) : 0;
    const bool stale = age > options.stale_age_s;
    const auto px = [&](double x) { return std::max(1, static_cast<int>(std::lround(x * scale))); };
    const auto depth_at = [&](cv::Point at) { return input.frame.depth_m(at).value_or(0); };
    std::vector<cv::Point> pixels;
    for (const cv::KeyPoint& point : input.keypoints) pixels.push_back(nearest_pixel(point.pt));
    const auto column = [&](std::size_t i) { return oracle_feature_depth(input, i).value_or(0); };

    struct Object {
      std::size_t k;
      const Instance* instance;
      cv::Rect box, masked, reach = {}, seeds = {};
      double m = 0, margin = 0;
      int shift = 0;
      bool follows_edges = false;
    };
    const auto is_near = [&](const Object& o, double z) { return z > 0 && std::abs(z - o.m) <= h; };

    // Seeds: the known depths in an area, or on a mask in it, every 16 px or at features, …
    std::size_t asked = 0;  // places, known or not
    const auto depths = [&](const cv::Rect& area, const Instance* mask) {
      std::vector<double> found;
      const auto ask = [&](cv::Point at, double z) {
        if (!area.contains(at) || (mask && !mask->covers(at))) return;
        if (z > 0) found.push_back(z);
        ++asked;
      };
      for (int y = area.y + px(16) / 2; has_image && y < area.br().y; y += px(16)) {
        for (int x = area.x + px(16) / 2; x < area.br().x; x += px(16)) {
          ask({x, y}, depth_at({x, y}));
        }
      }
      for (std::size_t i = 0; !has_image && i < pixels.size(); ++i) ask(pixels[i], column(i));
      std::sort(found.begin(), found.end());
      return found;
    };
    // … and the median of the nearest ones, two half widths wide, that are a share of all.
    const auto find_cluster = [&](const std::vector<double>& all, double share, double& median) {
      const auto within = [&](double lower, double upper) {
        return std::vector<double>(std::lower_bound(all.begin(), all.end(), lower),
                                   std::upper_bound(all.begin(), all.end(), upper));
      };
      for (const double nearest : all) {
        std::vector<double> some = within(nearest, nearest + 2 * h);
        const auto n = static_cast<double>(some.size()), of = static_cast<double>(all.size());
        if (of < 8 || n < 4 || n < share * of) continue;
        for (int round = 0; round < 3; ++round) {
          median = some[some.size() / 2];
          some = within(median - h, median + h);
        }
        return true;
      }
      return false;
    };

    // Gaps: how far the object's depth goes on beyond the ends of its mask, in rows.
    const auto gaps = [&](const Object& o, int way, int reach) {
      std::vector<int> found;
      for (int y = o.masked.y + px(8) / 2; y < o.masked.br().y; y += px(8)) {
        std::vector<int> row;
        for (int x = o.masked.x; x < o.masked.br().x; ++x) {
          if (o.instance->covers({x, y})) row.push_back(x);
        }
        if (row.empty()) continue;
        const int edge = way < 0 ? row.front() : row.back(), run = row.back() - row.front();
        const int border = way < 0 ? edge : size.width - 1 - edge;
        const auto is_own = [&](int n) { return is_near(o, depth_at({edge + way * n, y})); };
        int last = 0, next = 1;
        while (last >= -std::min(reach, run) && !is_own(last)) --last;
        if (last < -std::min(reach, run) || border == 0) continue;
        for (; last >= 0 && next <= std::min({reach, border, last + 3}); ++next) {
          const double z = depth_at({edge + way * next, y});
          const double step = z - depth_at({edge + way * last, y});
          if (is_own(next) && std::abs(step) <= 0.03) last = next;
        }
        if (last < 0 || next > last + 3) found.push_back(last);
      }
      std::sort(found.begin(), found.end());
      return found;
    };

    const auto measure = [&](Object& o, InstanceStatistics& found) {
      if (o.box.empty()) return false;
      std::vector<double> z = depths(o.masked, o.instance);
      found.sampled = z.size();
      if (!find_cluster(z, has_image ? 0.03 : 0.2, o.m)) {
        if (!has_image && z.empty() && asked >= 24) return ++times["not by box"], false;
        const cv::Rect box = detail::clip(o.box, size);
        o.seeds = {box.x + box.width / 4, box.y + box.height / 5, box.width / 2,
                   box.height * 3 / 5};
        z = depths(o.seeds, nullptr);
        found.sampled += z.size();
        if (!find_cluster(z, 0.2, o.m)) return false;
        ++times["by box"];
      }
      const double moved = 400 * age * scale;
      double growth = std::min({moved, 1.25 * o.box.width, 1.0 * size.width});
      const int reach = px(24) + static_cast<int>(growth);
      const std::vector<int> lefts = gaps(o, -1, reach), rights = gaps(o, 1, reach);
      if (lefts.size() >= 4 && rights.size() >= 4) {
        const double left = lefts[lefts.size() / 2], right = rights[rights.size() / 2];
        const double shift = (right - left) / 2, gap = (left + right) / 2;
        if (std::abs(shift) >= 4 * scale) o.shift = static_cast<int>(std::lround(shift));
        if (stale) {
          growth = std::min(growth, moved / 2 + 2 * std::abs(o.shift));
        } else {
          o.margin += std::clamp(gap + std::abs(shift) / 2, 0.0, 16 * scale);
          found.mask_gap_px = std::clamp(gap, 0.0, 16 * scale);
          found.depth_shift_px = o.shift;
          found.mask_gap_places = lefts.size() + rights.size();
          times["shifted"] += o.shift != 0 ? 1 : 0;
        }
      }
      o.follows_edges = !stale && o.seeds.empty() && found.mask_gap_px <= 3 * scale;
      o.reach = detail::clip_grown(o.box, std::lround(6 * scale + growth),
                                   std::lround(6 * scale + growth / 2), size);
      z = depths(o.reach, nullptr);
      const auto is_background = [&] {  // hardly anything around lies behind, as behind a wall
        const auto behind = z.end() - std::upper_bound(z.begin(), z.end(), o.m + h);
        return static_cast<double>(behind) < 0.05 * static_cast<double>(z.size());
      };
      if (!stale || !has_image || !is_background()) return true;
      o.seeds = o.reach;
      if (!find_cluster(z, 0.2, o.m) || is_background()) return ++times["gone"], false;
      return ++times["beside its mask"], true;
    };

    std::vector<Object> objects;
    for (std::size_t k = 0; k < filter.instances.size(); ++k) {
      InstanceStatistics& found = filter.instances[k];
      if (!found.dynamic && found.masked == 0) continue;
      const Instance& instance = input.segmentation.instances[k];
      const cv::Rect masked(instance.mask_origin, instance.mask.size());
      Object o = {k, &instance, instance.box, detail::clip(masked, size)};
      found.compensation = has_image || input.depths_m ? Compensation::too_few_samples
                                                       : Compensation::no_depth_image;
      o.margin = scale;
      asked = 0;
      if (!measure(o, found)) continue;
      found.compensation = has_image ? Compensation::applied : Compensation::applied_without_image;
      found.depth_range_m = {o.m - h, o.m + h};
      objects.push_back(o);
    }
    if (objects.empty()) return;

    // Flood: cells by row and column, with the steps to the objects (0) and the surroundings (1).
    struct Cell {
      double z = 0;
      std::array<double, 2> steps = {INFINITY, INFINITY};
      bool is_seed = false;
    };
    std::map<std::pair<int, int>, Cell> cells;
    double width = 16 * scale;
    cv::Rect area;
    for (const Object& o : objects) {
      const double quarter = std::min(o.box.width, o.box.height) / 4;
      width = std::min(width, std::max(6 * scale, quarter));
      area |= o.reach;
    }
    const int side = std::max(1, static_cast<int>(std::lround(width)));
    area = detail::clip_grown(area, side, side, size);
    const int rows = size.height / side + 1, columns = size.width / side + 1;
    for (int y = area.y / side; y * side + side / 2 < area.br().y; ++y) {
      for (int x = area.x / side; x * side + side / 2 < area.br().x; ++x) {
        const cv::Point at(x * side + side / 2, y * side + side / 2);
        const double z = depth_at(at);
        bool is_in_reach = false, is_seed = false;
        for (const Object& o : objects) {
          const bool is_on = o.seeds.empty() ? o.instance->covers(at - cv::Point(o.shift, 0))
                                             : o.seeds.contains(at);
          is_seed = is_seed || (is_on && is_near(o, z));
          is_in_reach = is_in_reach || o.reach.contains(at);
        }
        Cell& cell = cells[{y, x}];
        cell.z = z;
        cell.is_seed = is_seed || !is_in_reach;
        if (z > 0 && cell.is_seed) cell.steps[is_seed ? 0 : 1] = 0;
      }
    }
    for (int i = 0; i < 4 * rows * columns; ++i) {  // four sweeps: forth, back, forth, back
      const bool is_forth = i / (rows * columns) % 2 == 0;
      const int at = i % (rows * columns), way = is_forth ? -1 : 1;
      const int place = is_forth ? at : rows * columns - 1 - at;
      Cell& cell = cells[{place / columns, place % columns}];
      for (const auto& [dy, dx] : {std::pair(0, 1), {1, -1}, {1, 0}, {1, 1}}) {
        const Cell& from = cells[{place / columns + way * dy, place % columns + way * dx}];
        if (cell.z == 0 || cell.is_seed) continue;
        for (const int to : {0, 1}) {
          const double step = std::max(from.steps[to], std::abs(cell.z - from.z));
          cell.steps[to] = std::min(cell.steps[to], step);
        }
      }
    }

    // The inequality. Without an image no cell is known, and the depth alone decides.
    const auto owns = [&](const Object& o, cv::Point at, double z) {
      std::array<double, 2> least = {0.2, 0.2};
      for (int y = at.y / side - 1; y <= at.y / side + 1; ++y) {
        for (int x = at.x / side - 1; x <= at.x / side + 1; ++x) {
          const Cell& cell = cells[{y, x}];
          for (const int to : {0, 1}) {
            least[to] = std::min(least[to], std::max(cell.steps[to], std::abs(z - cell.z)));
          }
        }
      }
      const double to_object = least[0] + 0.25 * std::max(0.0, std::abs(z - o.m) - h);
      const bool is_joined = least[1] < 0.2;  // with the surroundings
      if (z == 0 || (is_joined && o.follows_edges)) return false;
      return is_joined ? to_object < least[1] : to_object <= 0.2;
    };
    const auto near_mask = [&](const Object& o, cv::Point pixel, double margin) {
      return !stale && oracle_on_mask(*o.instance, cv::Point2d(pixel), margin);
    };
    const auto place_of = [&](const Object& o, cv::Point pixel) {
      return cv::Point(std::clamp(pixel.x + (stale ? 0 : o.shift), 0, size.width - 1), pixel.y);
    };
    const auto depth_of = [&](const Object& o, std::size_t i) {
      return has_image ? depth_at(place_of(o, pixels[i])) : column(i);
    };
    const auto nearness = [&](const Object& o, cv::Point place) {
      double sum = 0;
      for (int way = 0; way < 9; ++way) {
        for (int n = 1; n <= px(12) && way != 4; ++n) {
          const cv::Point at = place + n * cv::Point(way % 3 - 1, way / 3 - 1);
          const bool is_masked = !stale && o.instance->covers(at - cv::Point(o.shift, 0));
          if (is_masked || owns(o, at, depth_at(at))) sum += scale / n;
          if (is_masked || depth_at(at) > 0) break;
        }
      }
      return sum;
    };
    const auto votes = [&](const Object& o, cv::Point pixel) {
      const double vote = std::pow(2, 32), reach = 60 * scale, doubt = 24 * scale;
      double own = 0, all = std::floor(vote / (doubt * doubt)), around = 0;
      for (std::size_t j = 0; j < pixels.size(); ++j) {
        const cv::Point2d apart = cv::Point2d(pixels[j]) - cv::Point2d(pixel);
        around += std::max(std::abs(apart.x), std::abs(apart.y)) <= std::round(reach) ? 1 : 0;
        const double squared = std::max(1.0, apart.ddot(apart)), z = depth_of(o, j);
        if (z == 0 || squared > reach * reach) continue;
        all += std::floor(vote / squared);
        own += is_near(o, z) ? std::floor(vote / squared) : 0;
      }
      return around > 4000 ? 0 : own / all;
    };
    const auto certainty = [&](const Object& o, cv::Point pixel, double z) -> double {
      if (owns(o, place_of(o, pixel), z)) return ++times[has_image ? "by depth" : "by column"], 1;
      const bool is_behind = z == 0 || z >= o.m + h;
      const double margin = is_behind || !has_image ? o.margin : scale;
      if (near_mask(o, pixel, margin)) return ++times["by margin"], 1;
      if (z > 0 && (!has_image || !is_behind)) return 0;
      const double sum = has_image ? nearness(o, place_of(o, pixel)) : votes(o, pixel);
      const bool is_in_shadow = sum >= 0.45 && near_mask(o, pixel, o.margin + 9 * scale);
      const double needed = !has_image || is_in_shadow ? 0.9 : 0.45;
      if (sum < needed) return sum / needed / 2;
      ++times[has_image ? "by nearness" : "by votes"];
      return has_image ? std::min(1.0, 0.5 + sum / 8) : std::max(0.5, sum);
    };

    // Labels.
    std::vector<std::pair<double, const Object*>> verdicts(pixels.size());
    double kept = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      FeatureLabel& label = filter.labels[i];
      auto& [best, owner] = verdicts[i];
      bool is_known = false;
      for (const Object& o : objects) {
        is_known = is_known || static_cast<int>(o.k) == label.instance;
        if ((label.removed && !stale) || best >= 0.5 || !o.reach.contains(pixels[i])) continue;
        const double c = certainty(o, pixels[i], depth_of(o, i));
        if (c > best) verdicts[i] = {c, &o};
      }
      if (label.removed && stale && is_known && best < 0.5) {
        label = {0, label.instance, Reason::restored, false};
        --filter.instances[static_cast<std::size_t>(label.instance)].masked;
        ++times["restored"];
      }
      kept += label.removed || best >= 0.5 ? 0 : 1;
    }
    const double all = static_cast<double>(pixels.size()), share = options.min_kept_share;
    const double wanted = std::max(share * all, std::min(300.0, all / 2));
    const bool is_cautious = share > 0 && kept < wanted;
    // How far the features that are not sure are from their object's depth; -1 for others.
    std::vector<double> doubts(pixels.size(), -1);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const auto [c, owner] = verdicts[i];
      if (!is_cautious || filter.labels[i].removed || c < 0.5) continue;
      const double m = depth_of(*owner, i);
      const double distance = m > 0 ? std::abs(m - owner->m) : HUGE_VAL;
      if (distance > 0.1 && !near_mask(*owner, pixels[i], 4 * scale)) doubts[i] = distance;
    }
    const auto missing = static_cast<std::ptrdiff_t>(std::ceil(std::max(wanted, all / 2)) - kept);
    const auto stays = [&](std::size_t i) {
      const auto farther = [&](double doubt) { return doubt > doubts[i]; };
      return doubts[i] >= 0 && std::count_if(doubts.begin(), doubts.end(), farther) < missing;
    };
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      FeatureLabel& label = filter.labels[i];
      const auto [c, owner] = verdicts[i];
      if (label.removed || owner == nullptr) continue;
      const Object& o = *owner;
      const float score = static_cast<float>(c) * o.instance->score;
      if (c >= 0.5 && !stays(i)) {
        label = {score, static_cast<int>(o.k), Reason::compensated, true};
        ++filter.instances[o.k].compensated;
      } else if (score > label.score) {
        label = {score, static_cast<int>(o.k), label.reason, false};
        times["spared"] += c >= 0.5 ? 1 : 0;
      }
    }
    for (const Object& o : objects) {
      if (is_cautious) filter.instances[o.k].compensation = Compensation::cautious;
    }
    times["cautious"] += is_cautious ? 1 : 0;
  }
};

}  // namespace dynfilter::testing
