// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What DynamicFilter and MotionFilter share: their options as keyword arguments, features, and
// workspaces for threads.

#ifndef DYNFILTER_SRC_PYTHON_FILTER_ARGUMENTS_HPP
#define DYNFILTER_SRC_PYTHON_FILTER_ARGUMENTS_HPP

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "arrays.hpp"
#include "bindings.hpp"
#include "dynfilter/dynamic_filter.hpp"

namespace dynfilter::python {

/// Workspaces of a filter that several threads use. A call takes one that is free, or a new one, so
/// that there are as many as calls have run at once.
class Workspaces {
 public:
  /// Workspace for the duration of a call.
  class Lease {
   public:
    explicit Lease(Workspaces& pool) : pool_(pool), workspace_(pool.take()) {}
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    ~Lease() { pool_.give_back(std::move(workspace_)); }

    Workspace& operator*() { return *workspace_; }

   private:
    Workspaces& pool_;
    std::unique_ptr<Workspace> workspace_;
  };

 private:
  std::unique_ptr<Workspace> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    // Room for those that are out: giving one back allocates nothing.
    free_.reserve(free_.size() + taken_ + 1);
    auto workspace = free_.empty() ? std::make_unique<Workspace>() : std::move(free_.back());
    if (!free_.empty()) free_.pop_back();
    ++taken_;
    return workspace;
  }

  void give_back(std::unique_ptr<Workspace> workspace) {
    const std::lock_guard<std::mutex> lock(mutex_);
    --taken_;
    free_.push_back(std::move(workspace));
  }

  std::mutex mutex_;
  std::size_t taken_ = 0;
  std::vector<std::unique_ptr<Workspace>> free_;
};

/// Features of a call: the caller's points, with depths if they are given.
class Features {
 public:
  /// Throws std::invalid_argument for arrays of another type or shape.
  Features(const py::object& points, const py::object& depths_m, const char* component);

  const FeaturesView& view() const { return view_; }

 private:
  py::array points_;             // kept while the view is in use
  std::vector<float> depths_m_;  // empty without depths
  FeaturesView view_;
};

/// Returns the segmentation of a call, none for None. Throws Python's TypeError for another
/// object, such as an array of masks.
SegmentationView segmentation_of(const py::object& argument, const char* component);

/// Makes the options of a filter from its keyword arguments.
DynamicFilterOptions filter_options(std::vector<int> dynamic_classes, double margin_px,
                                    const py::object& static_mask, CompensationRule rule,
                                    const DepthCompensatorOptions& depth,
                                    const EdgeCompensatorOptions& paper, std::size_t floor);

/// Returns a filter's text: its class and the options that say most.
std::string text_of(const py::handle& self, const DynamicFilterOptions& options);

/// Explanation of the keyword arguments, for docstrings.
extern const char* const filter_options_doc;

/// Explanation of the arguments of `apply`, for docstrings.
extern const char* const apply_doc;

}  // namespace dynfilter::python

#endif  // DYNFILTER_SRC_PYTHON_FILTER_ARGUMENTS_HPP
