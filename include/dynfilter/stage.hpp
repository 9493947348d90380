// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Helper that calls a stage. Pipeline uses it; so does code that wraps a stage, to time it for
// example.

#pragma once

#include <type_traits>

#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {
/// Runs a stage: a callable void(const FilterInput&, FeatureLabels&) const that may take a
/// Workspace& as third argument.
template <class Stage>
void run_stage(const Stage& stage, const FilterInput& input, FeatureLabels& labels,
               Workspace& workspace) {
  using WithWorkspace =
      std::is_invocable<const Stage&, const FilterInput&, FeatureLabels&, Workspace&>;
  using WithoutWorkspace = std::is_invocable<const Stage&, const FilterInput&, FeatureLabels&>;
  static_assert(WithWorkspace::value || WithoutWorkspace::value,
                "a stage is a callable void(const FilterInput&, FeatureLabels&) const, perhaps "
                "with a Workspace& as third argument; wrap an object that changes in std::ref; "
                "of a filter, list the stages");
  if constexpr (WithWorkspace::value) {
    stage(input, labels, workspace);
  } else {
    stage(input, labels);
  }
}

}  // namespace dynfilter
