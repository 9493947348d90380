// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Oracle of the rule `depth`, as plain as possible: it computes each value where it needs it. It
// shares only depth_m, covers, nearest_pixel and clip_grown with the library.

#ifndef DYNFILTER_TESTS_SUPPORT_DEPTH_RULE_ORACLE_HPP
#define DYNFILTER_TESTS_SUPPORT_DEPTH_RULE_ORACLE_HPP

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "support/oracle.hpp"

namespace dynfilter::testing {

/// Labels that the masks alone give.
inline OracleVerdict oracle_masks(FilterCase input) {
  input.frame.depth = cv::Mat();
  input.depths_m.reset();
  return oracle_filter(input);
}

class DepthRuleOracle {
 public:
  OracleVerdict filter;                      // the expected one
  std::map<std::string, std::size_t> times;  // that each path was taken

  explicit DepthRuleOracle(const FilterCase& input) : filter(oracle_masks(input)), input_(input) {
    if (age_ > 1) age_ = 0;
    for (const cv::KeyPoint& keypoint : input.keypoints)
      pixels_.push_back(nearest_pixel(keypoint.pt));
    for (std::size_t k = 0; k < filter.instances.size(); ++k) {
      if (filter.instances[k].dynamic || filter.instances[k].masked > 0) add(k);
    }
    if (has_image_) flood();
    if (!objects_.empty()) judge();
  }

 private:
  struct Object {
    std::size_t k = 0;
    const Instance* instance = nullptr;
    double depth = 0, margin = 0;
    int shift = 0;
    cv::Rect reach, seeds;
  };
  struct Cell {
    double depth = 0, step = INFINITY;
    int owner = 0;
  };

  int px(double length) const {
    return std::max(1, static_cast<int>(std::lround(length * scale_)));
  }
  double depth_at(cv::Point at) const { return input_.frame.depth_m(at).value_or(0); }
  double column(std::size_t i) const { return oracle_feature_depth(input_, i).value_or(0); }
  bool is_near(const Object& o, double z) const { return z > 0 && std::abs(z - o.depth) <= half_; }
  bool near_mask(const Object& o, cv::Point pixel, double margin) const {
    return !stale_ && margin > 0 && oracle_on_mask(*o.instance, cv::Point2d(pixel), margin);
  }
  cv::Rect masked(const Object& o) const {
    return detail::clip({o.instance->mask_origin, o.instance->mask.size()}, size_);
  }

  /// Depths in an area, or on a mask in it, sorted; adds the places that were asked.
  std::vector<double> depths(const cv::Rect& area, const Instance* mask,
                             std::size_t& places) const {
    std::vector<double> found;
    const auto read = [&](cv::Point at, double depth) {
      if (mask != nullptr && !mask->covers(at)) return;
      ++places;
      if (depth > 0) found.push_back(depth);
    };
    const int step = px(16);
    for (int y = area.y + step / 2; has_image_ && y < area.br().y; y += step) {
      for (int x = area.x + step / 2; x < area.br().x; x += step) read({x, y}, depth_at({x, y}));
    }
    for (std::size_t i = 0; !has_image_ && i < pixels_.size(); ++i) {
      if (area.contains(pixels_[i])) read(pixels_[i], column(i));
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  /// Median of the nearest depths, two half widths wide, that are a share of all.
  bool find_cluster(const std::vector<double>& sorted, double share, double& median) const {
    const auto within = [&](double lower, double upper) {
      std::vector<double> some;
      for (const double z : sorted) {
        if (z >= lower && z <= upper) some.push_back(z);
      }
      return some;
    };
    for (const double nearest : sorted) {
      std::vector<double> some = within(nearest, nearest + 2 * half_);
      const auto count = static_cast<double>(some.size()), all = static_cast<double>(sorted.size());
      if (all < 8 || count < 4 || count < std::ceil(share * all)) continue;
      for (int round = 0; round < 3; ++round) {
        median = some[some.size() / 2];
        some = within(median - half_, median + half_);
      }
      return true;
    }
    return false;
  }

  bool is_background(const Object& o) const {
    std::size_t places = 0, behind = 0;
    const std::vector<double> all = depths(o.reach, nullptr, places);
    for (const double z : all) behind += z > o.depth + half_ ? 1 : 0;
    return static_cast<double>(behind) < 0.05 * static_cast<double>(all.size());
  }

  bool find_depth(Object& o, std::size_t& samples) {
    std::size_t places = 0;
    const std::vector<double> on_mask = depths(masked(o), o.instance, places);
    samples = on_mask.size();
    if (find_cluster(on_mask, has_image_ ? 0.03 : 0.2, o.depth)) return true;
    if (!has_image_ && samples == 0 && places >= 24) return ++times["not by box"], false;
    const cv::Rect box = detail::clip(o.instance->box, size_);
    o.seeds = {box.x + box.width / 4, box.y + box.height / 5, box.width / 2, box.height * 3 / 5};
    const std::vector<double> in_box = depths(o.seeds, nullptr, places);
    samples += in_box.size();
    return find_cluster(in_box, 0.2, o.depth);
  }

  /// How far the object reaches beyond the ends of its mask on one side, by rows.
  std::vector<int> gaps(const Object& o, int way, int reach) const {
    std::vector<int> found;
    const cv::Rect area = masked(o);
    for (int y = area.y + px(8) / 2; y < area.br().y; y += px(8)) {
      std::vector<int> columns;
      for (int x = area.x; x < area.br().x; ++x) {
        if (o.instance->covers({x, y})) columns.push_back(x);
      }
      if (columns.empty()) continue;
      const int edge = way < 0 ? columns.front() : columns.back(),
                run = std::min(reach, columns.back() - columns.front());
      const int border = way < 0 ? edge : size_.width - 1 - edge;
      const auto is_own = [&](int n) { return is_near(o, depth_at({edge + way * n, y})); };
      int last = 0, next = 1;
      while (last >= -run && !is_own(last)) --last;
      if (last < -run || border == 0) continue;
      for (; last >= 0 && next <= last + 3 && next <= std::min(reach, border); ++next) {
        if (is_own(next)) last = next;
      }
      if (last < 0 || next > last + 3) found.push_back(last);
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  bool measure(Object& o, InstanceStatistics& statistics) {
    o.margin = options_.mask_margin_px * scale_;
    if (o.instance->box.empty() || !find_depth(o, statistics.sampled)) return false;
    times["by box"] += o.seeds.empty() ? 0 : 1;
    const double moved = options_.motion_px_per_s * age_ * scale_;
    double growth = std::min({moved, 1.25 * o.instance->box.width, double{1} * size_.width});
    const int reach = px(24) + static_cast<int>(growth);
    const std::vector<int> lefts = gaps(o, -1, reach), rights = gaps(o, 1, reach);
    if (has_image_ && lefts.size() >= 4 && rights.size() >= 4) {
      const double left = lefts[lefts.size() / 2], right = rights[rights.size() / 2];
      const double shift = (right - left) / 2, gap = (left + right) / 2;
      if (std::abs(shift) >= 4 * scale_) o.shift = static_cast<int>(std::lround(shift));
      if (stale_) {
        growth = std::min(growth, moved / 2 + 2 * std::abs(o.shift));
      } else {
        o.margin += std::clamp(gap + std::abs(shift) / 2, 0.0, 16 * scale_);
        statistics.mask_gap_px = std::clamp(gap, 0.0, 16 * scale_);
        statistics.depth_shift_px = o.shift;
        statistics.mask_gap_places = lefts.size() + rights.size();
        times["shifted"] += o.shift != 0 ? 1 : 0;
      }
    }
    o.reach = detail::clip_grown(o.instance->box, std::lround(6 * scale_ + growth),
                                 std::lround(6 * scale_ + growth / 2), size_);
    if (!stale_ || !has_image_ || !is_background(o)) return true;
    o.seeds = o.reach;
    std::size_t places = 0;
    const bool is_beside =
        find_cluster(depths(o.reach, nullptr, places), 0.2, o.depth) && !is_background(o);
    ++times[is_beside ? "beside its mask" : "gone"];
    return is_beside;
  }

  void add(std::size_t k) {
    InstanceStatistics& statistics = filter.instances[k];
    Object o;
    o.k = k;
    o.instance = &input_.segmentation.instances[k];
    if (measure(o, statistics)) {
      statistics.compensation =
          has_image_ ? Compensation::applied : Compensation::applied_without_image;
      statistics.depth_range_m = {o.depth - half_, o.depth + half_};
      objects_.push_back(o);
    } else {
      statistics.compensation = has_image_ || input_.depths_m ? Compensation::too_few_samples
                                                              : Compensation::no_depth_image;
    }
  }

  void flood() {
    double width = 16 * scale_;
    cv::Rect area;
    for (const Object& o : objects_) {
      const double quarter = std::min(o.instance->box.width, o.instance->box.height) / 4;
      width = std::min(width, std::max(6 * scale_, quarter));
      area |= o.reach;
    }
    cell_ = std::max(1, static_cast<int>(std::lround(width)));
    area = detail::clip_grown(area, cell_, cell_, size_);
    for (int y = area.y / cell_; y * cell_ + cell_ / 2 < area.br().y; ++y) {
      for (int x = area.x / cell_; x * cell_ + cell_ / 2 < area.br().x; ++x) {
        const cv::Point middle(x * cell_ + cell_ / 2, y * cell_ + cell_ / 2);
        Cell& cell = cells_[{y, x}];
        cell.depth = depth_at(middle);
        if (cell.depth > 0) cell.owner = seed(middle, cell.depth);
        if (cell.owner != 0) cell.step = -1;
      }
    }
    for (int round = 0; round < 2; ++round) {
      for (auto at = cells_.begin(); at != cells_.end(); ++at) spread_to(at->first, -1);
      for (auto at = cells_.rbegin(); at != cells_.rend(); ++at) spread_to(at->first, 1);
    }
  }

  int seed(cv::Point at, double depth) const {
    bool is_in_reach = false;
    for (const Object& o : objects_) {
      const bool is_seed =
          o.seeds.empty() ? o.instance->covers(at - cv::Point(o.shift, 0)) : o.seeds.contains(at);
      if (is_seed && is_near(o, depth)) return 1;
      is_in_reach = is_in_reach || o.reach.contains(at);
    }
    return is_in_reach ? 0 : -1;
  }

  void spread_to(std::pair<int, int> place, int way) {
    const auto [y, x] = place;
    Cell& cell = cells_.at(place);
    for (const auto& [dy, dx] :
         {std::pair(0, 1), std::pair(1, -1), std::pair(1, 0), std::pair(1, 1)}) {
      const auto from = cells_.find({y + way * dy, x + way * dx});
      if (cell.depth == 0 || from == cells_.end() || from->second.owner == 0) continue;
      const double step = std::max(from->second.step, std::abs(cell.depth - from->second.depth));
      if (step > 0.2 || step > cell.step) continue;
      if (step == cell.step && from->second.owner <= cell.owner) continue;
      cell.step = step;
      cell.owner = from->second.owner;
    }
  }

  bool owns(const Object& o, cv::Point at, double depth) const {
    const double needed = 0.25 * (half_ - std::abs(depth - o.depth));
    double to_object = 0.2, to_surroundings = 0.2;
    for (int y = at.y / cell_ - 1; y <= at.y / cell_ + 1; ++y) {
      for (int x = at.x / cell_ - 1; x <= at.x / cell_ + 1; ++x) {
        const auto cell = cells_.find({y, x});
        if (cell == cells_.end() || cell->second.owner == 0) continue;
        double& least = cell->second.owner > 0 ? to_object : to_surroundings;
        least = std::min(least, std::max(cell->second.step, std::abs(depth - cell->second.depth)));
      }
    }
    return depth > 0 && needed >= -0.2 && to_object - to_surroundings <= needed;
  }

  cv::Point place_of(const Object& o, cv::Point pixel) const {
    return {std::clamp(pixel.x + (stale_ ? 0 : o.shift), 0, size_.width - 1), pixel.y};
  }

  double nearness(const Object& o, cv::Point place) const {
    double sum = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        for (int n = 1; n <= px(12) && (dx != 0 || dy != 0); ++n) {
          const cv::Point at = place + n * cv::Point(dx, dy);
          const bool is_masked = !stale_ && o.instance->covers(at - cv::Point(o.shift, 0));
          if (is_masked || owns(o, at, depth_at(at))) sum += scale_ / n;
          if (is_masked || depth_at(at) > 0) break;
        }
      }
    }
    return sum;
  }

  double certainty_by_image(const Object& o, cv::Point pixel) {
    const cv::Point place = place_of(o, pixel);
    const double depth = depth_at(place), near = nearness(o, place);
    const bool is_by_depth = owns(o, place, depth);
    ++times[is_by_depth ? "by depth" : "not by depth"];
    if (is_by_depth) return 1;
    if (near_mask(o, pixel, o.margin)) return ++times["by margin"], 1;
    if (depth > 0 && depth < o.depth + half_) return 0;
    const bool is_in_shadow = near >= 0.45 && near_mask(o, pixel, o.margin + 9 * scale_);
    const double needed = is_in_shadow ? 0.9 : 0.45;
    if (near < needed) return near / needed / 2;
    return ++times["by nearness"], std::min(1.0, 0.5 + near / 8);
  }

  double certainty_by_column(const Object& o, std::size_t i) {
    if (near_mask(o, pixels_[i], o.margin)) return ++times["by margin"], 1;
    if (column(i) > 0) return is_near(o, column(i)) ? ++times["by column"], 1 : 0;
    const double vote = std::pow(2, 32), reach = 60 * scale_, doubt = 24 * scale_;
    double own = 0, all = std::floor(vote / (doubt * doubt));
    for (std::size_t j = 0; j < pixels_.size(); ++j) {
      const cv::Point2d apart = cv::Point2d(pixels_[j]) - cv::Point2d(pixels_[i]);
      const double squared = std::max(1.0, apart.ddot(apart));
      const auto side = static_cast<double>(std::lround(reach));
      const bool is_in_square = std::max(std::abs(apart.x), std::abs(apart.y)) <= side;
      if (!(column(j) > 0) || !is_in_square || squared > reach * reach) continue;
      all += std::floor(vote / squared);
      own += is_near(o, column(j)) ? std::floor(vote / squared) : 0;
    }
    if (own / all < 0.9) return own / all / 0.9 / 2;
    return ++times["by votes"], std::max(0.5, own / all);
  }

  bool is_sure(const Object& o, std::size_t i) const {
    const double depth = has_image_ ? depth_at(place_of(o, pixels_[i])) : column(i);
    return (depth > 0 && std::abs(depth - o.depth) <= 0.1) || near_mask(o, pixels_[i], 4 * scale_);
  }

  void judge() {
    std::vector<double> certainties(pixels_.size(), 0.0);
    std::vector<const Object*> owners(pixels_.size(), nullptr);
    double kept = 0;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      FeatureLabel& label = filter.labels[i];
      bool is_known = false;
      for (const Object& o : objects_) {
        is_known = is_known || static_cast<int>(o.k) == label.instance;
        if ((label.removed && !stale_) || !o.reach.contains(pixels_[i])) continue;
        if (certainties[i] >= 0.5) continue;
        const double c = has_image_ ? certainty_by_image(o, pixels_[i]) : certainty_by_column(o, i);
        if (c > certainties[i]) owners[i] = &o;
        certainties[i] = std::max(certainties[i], c);
      }
      if (label.removed && stale_ && is_known && certainties[i] < 0.5) {
        label = {0, label.instance, Reason::restored, false};
        --filter.instances[static_cast<std::size_t>(label.instance)].masked;
        ++times["restored"];
      }
      kept += label.removed || certainties[i] >= 0.5 ? 0 : 1;
    }
    const double all = static_cast<double>(pixels_.size()), share = options_.min_kept_share;
    const bool is_cautious = share > 0 && kept < std::max(share * all, std::min(300.0, all / 2));
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      FeatureLabel& label = filter.labels[i];
      if (label.removed || owners[i] == nullptr) continue;
      const float score = static_cast<float>(certainties[i]) * owners[i]->instance->score;
      const int k = static_cast<int>(owners[i]->k);
      if (certainties[i] >= 0.5 && (!is_cautious || is_sure(*owners[i], i))) {
        label = {score, k, Reason::compensated, true};
        ++filter.instances[owners[i]->k].compensated;
      } else if (score > label.score) {
        label = {score, k, label.reason, false};
        times["spared"] += certainties[i] >= 0.5 ? 1 : 0;
      }
    }
    if (!is_cautious) return;
    for (const Object& o : objects_) filter.instances[o.k].compensation = Compensation::cautious;
    ++times["cautious"];
  }

  const FilterCase& input_;
  const DepthCompensatorOptions& options_ = input_.options.compensator.depth;
  const bool has_image_ = !input_.frame.depth.empty();
  const cv::Size size_ = input_.segmentation.image_size;
  const double scale_ = size_.width / 640.0;
  const double half_ = options_.half_width_m * (has_image_ ? 1 : 0.75);
  double age_ = std::abs(input_.frame.timestamp_s - input_.segmentation.timestamp_s);
  const bool stale_ = age_ <= 1 && age_ > options_.stale_age_s;
  std::vector<cv::Point> pixels_;
  std::vector<Object> objects_;
  int cell_ = 1;
  std::map<std::pair<int, int>, Cell> cells_;  // by row and column
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_DEPTH_RULE_ORACLE_HPP
