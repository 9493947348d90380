// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Helpers that call a stage. Pipeline uses them; so does code that wraps a stage, to time it for
// example.

#ifndef DYNFILTER_STAGE_HPP
#define DYNFILTER_STAGE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <functional>
#include <type_traits>
#include <utility>

#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {
namespace detail {

template <class Stage, class = void>
struct HasCheck : std::false_type {};
template <class Stage>
struct HasCheck<Stage, std::void_t<decltype(std::declval<const Stage&>().check(
                           std::declval<const FilterInput&>()))>> : std::true_type {};

}  // namespace detail

/// Calls stage.check(input) if the stage has a member check(const FilterInput&) const. Such a
/// member throws for input that the stage cannot work with.
template <class Stage>
void check_stage(const Stage& stage, const FilterInput& input) {
  if constexpr (detail::HasCheck<Stage>::value) stage.check(input);
}

/// Checks the stage that the wrapper refers to.
template <class Stage>
void check_stage(const std::reference_wrapper<Stage>& stage, const FilterInput& input) {
  check_stage(stage.get(), input);
}

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
                "with a Workspace& as third argument; wrap an object that changes in std::ref");
  if constexpr (WithWorkspace::value) {
    stage(input, labels, workspace);
  } else {
    stage(input, labels);
  }
}

}  // namespace dynfilter

#endif  // DYNFILTER_STAGE_HPP
