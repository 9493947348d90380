// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_WORKSPACE_HPP
#define DYNFILTER_WORKSPACE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <memory>
#include <typeindex>
#include <typeinfo>
#include <utility>
#include <vector>

namespace dynfilter {

/// Scratch memory of a filter, kept by the caller between frames so that a frame allocates nothing
/// once one of at least that many features, instances and pixels was seen. It carries no
/// information from call to call. Use one for each thread.
///
/// A stage, a user's too, declares a struct of the vectors that it needs and asks for it by type:
///
///   struct Scratch { std::vector<float> depths_m; };
///   Scratch& scratch = workspace.get<Scratch>();
class Workspace {
 public:
  Workspace() = default;
  Workspace(Workspace&&) = default;
  Workspace& operator=(Workspace&&) = default;

  /// The scratch memory of that type. The first call makes it by its default constructor; later
  /// ones return the same object with whatever the last user left in it. It stays where it is as
  /// long as the workspace lives. Stages that ask for the same type share one object, so do not
  /// hold it across a call of another stage. Throws what the constructor throws. O(types in use).
  template <class Scratch>
  Scratch& get() {
    const std::type_index type(typeid(Scratch));
    for (const auto& [known_type, scratch] : scratch_) {
      if (known_type == type) return *static_cast<Scratch*>(scratch.get());
    }
    scratch_.emplace_back(type, std::make_shared<Scratch>());
    return *static_cast<Scratch*>(scratch_.back().second.get());
  }

 private:
  std::vector<std::pair<std::type_index, std::shared_ptr<void>>> scratch_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_WORKSPACE_HPP
