// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/map_start.hpp"

#include <algorithm>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/feature_floor.hpp"

namespace dynfilter::detail {
namespace {

std::size_t rounded_up_to_hundreds(std::size_t count) { return (count + 99) / 100 * 100; }

}  // namespace

std::string MapStart::add(const FrameStatistics& statistics) {
  if (wanted_ == 0) return {};
  if (statistics.kept() >= wanted_) {
    wanted_ = 0;  // the host has begun
    return {};
  }
  max_kept_ = std::max(max_kept_, statistics.kept());
  suggested_ = std::max(suggested_, suggested_features(statistics, wanted_));
  if (++waiting_ != patience) return {};
  return concatenate("dynfilter: the host cannot begin a map, because none of ", patience,
                     " frames kept the ", wanted_, " features that it needs (the best kept ",
                     max_kept_, "): set ORBextractor.nFeatures in ", file_, " to at least ",
                     rounded_up_to_hundreds(suggested_));
}

}  // namespace dynfilter::detail
