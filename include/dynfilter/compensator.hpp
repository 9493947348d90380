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

/// By which rule the features are found that masks missed.
enum class CompensationRule {
  depth,  ///< DepthCompensator
  paper,  ///< EdgeCompensator: eq. (1)
  mask    ///< masks act alone
};

struct CompensatorOptions {
  CompensationRule rule = CompensationRule::depth;
  DepthCompensatorOptions depth;
  EdgeCompensatorOptions paper;
};

/// The stage after MaskCuller, by a rule that is chosen at run time.
class Compensator {
 public:
  /// Throws std::invalid_argument for options that either rule's component refuses.
  explicit Compensator(const CompensatorOptions& options = {})
      : rule_(options.rule), by_depth_(options.depth), by_paper_(options.paper) {}

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Cost and errors are those of the rule's component.
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
