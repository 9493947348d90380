// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The two things that a stage may offer beyond being callable.

#ifndef DYNFILTER_DETAIL_STAGE_TRAITS_HPP
#define DYNFILTER_DETAIL_STAGE_TRAITS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <type_traits>
#include <utility>

#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter::detail {

template <class Stage, class = void>
struct HasCheck : std::false_type {};
template <class Stage>
struct HasCheck<Stage, std::void_t<decltype(std::declval<const Stage&>().check(
                           std::declval<const FilterInput&>()))>> : std::true_type {};

template <class Stage>
void check_stage(const Stage& stage, const FilterInput& input) {
  if constexpr (HasCheck<Stage>::value) stage.check(input);
}

template <class Stage>
void run_stage(const Stage& stage, const FilterInput& input, FeatureLabels& labels,
               Workspace& workspace) {
  using WithWorkspace =
      std::is_invocable<const Stage&, const FilterInput&, FeatureLabels&, Workspace&>;
  using WithoutWorkspace = std::is_invocable<const Stage&, const FilterInput&, FeatureLabels&>;
  static_assert(WithWorkspace::value || WithoutWorkspace::value,
                "a stage is a callable void(const FilterInput&, FeatureLabels&) const");
  if constexpr (WithWorkspace::value) {
    stage(input, labels, workspace);
  } else {
    stage(input, labels);
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_STAGE_TRAITS_HPP
