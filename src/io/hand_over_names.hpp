// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "dynfilter/segmenters/async_segmenter.hpp"

namespace dynfilter::detail {

/// Returns the names of HandOver's values, in their order, for settings and options.
inline const std::vector<std::string>& hand_over_names() {
  static const std::vector<std::string> names = {"wait", "limited_wait", "latest", "drop"};
  return names;
}

/// Returns the value with this name, which must be one of hand_over_names().
inline HandOver hand_over_of(const std::string& name) {
  const auto& names = hand_over_names();
  return static_cast<HandOver>(std::find(names.begin(), names.end(), name) - names.begin());
}

}  // namespace dynfilter::detail
