// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_COMPENSATOR_HPP
#define DYNFILTER_COMPENSATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/edge_compensator.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Rule that finds the features that masks missed.
enum class CompensationRule {
  depth,  ///< DepthCompensator
  paper,  ///< EdgeCompensator: eq. (1)
  mask    ///< masks act alone
};

/// Options of Compensator.
struct CompensatorOptions {
  CompensationRule rule = CompensationRule::depth;  ///< rule to apply
  DepthCompensatorOptions depth;                    ///< for CompensationRule::depth
  EdgeCompensatorOptions paper;                     ///< for CompensationRule::paper
};

/// Stage after MaskCuller that removes the features that masks missed, by a rule chosen at run
/// time.
class Compensator {
 public:
  /// Takes the options. Throws std::invalid_argument for options that either rule's component
  /// refuses.
  explicit Compensator(const CompensatorOptions& options = {})
      : rule_(options.rule), by_depth_(options.depth), by_paper_(options.paper) {}

  /// Runs the stage with a temporary workspace.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Runs the stage, at the cost and with the errors of the rule's component.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    switch (rule_) {
      case CompensationRule::depth:
        by_depth_(input, labels, workspace);
        break;
      case CompensationRule::paper:
        by_paper_(input, labels, workspace);
        break;
      case CompensationRule::mask:
        break;
    }
  }

 private:
  CompensationRule rule_;
  DepthCompensator by_depth_;
  EdgeCompensator by_paper_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_COMPENSATOR_HPP
