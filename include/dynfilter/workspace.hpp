// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <memory>
#include <utility>
#include <vector>

namespace dynfilter {

/// Scratch memory of a filter. The caller keeps it between frames: after the largest frame so far
/// (in features, instances and pixels), later frames allocate nothing. It carries no information
/// from call to call. Use one per thread.
///
/// A stage, including your own, declares a struct of the vectors that it needs and asks for it by
/// type:
///
///     struct Scratch { std::vector<float> depths_m; };
///     Scratch& scratch = workspace.get<Scratch>();
class Workspace {
 public:
  /// Makes an empty workspace.
  Workspace() = default;
  /// @{
  /// Moves the memory; references from get stay valid.
  Workspace(Workspace&&) = default;
  Workspace& operator=(Workspace&&) = default;
  /// @}

  /// Returns the scratch memory of a type. The first call default-constructs it; later calls return
  /// the same object. Its contents are leftovers of the last call: clear them, do not read them.
  /// Its address does not change while the workspace lives. Stages that ask for the same type share
  /// one object, so do not hold it across a call of another stage. Throws what the constructor
  /// throws. O(types in use).
  template <class Scratch>
  Scratch& get() {
    const void* const type = &type_mark<Scratch>;
    for (const auto& [known_type, scratch] : scratch_) {
      if (known_type == type) return *static_cast<Scratch*>(scratch.get());
    }
    scratch_.emplace_back(type, std::make_shared<Scratch>());
    return *static_cast<Scratch*>(scratch_.back().second.get());
  }

 private:
  // Its address tells types apart. std::type_index does not always: clang gives types of one name
  // in the anonymous namespaces of two files equal ones. It is not const, so that nobody merges it.
  template <class Scratch>
  inline static char type_mark = 0;

  std::vector<std::pair<const void*, std::shared_ptr<void>>> scratch_;
};

}  // namespace dynfilter
