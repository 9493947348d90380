// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "truth.hpp"

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::tools {

std::vector<std::string> truth_names() { return {"class", "motion"}; }

std::string name_of(Truth truth) { return truth == Truth::by_motion ? "motion" : "class"; }

Truth truth_of_name(const std::string& name) {
  for (const Truth truth : {Truth::by_class, Truth::by_motion}) {
    if (name_of(truth) == name) return truth;
  }
  detail::throw_misuse("truth", "'" + name + "'", "class or motion");
}

const std::optional<Segmentation>& dynamic_masks(const SourceFrame& frame, Truth truth) {
  return truth == Truth::by_motion ? frame.moving_masks : frame.true_masks;
}

}  // namespace dynfilter::tools
