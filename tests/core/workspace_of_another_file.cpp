// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/workspace.hpp"

#include <string>

namespace dynfilter {
namespace {

struct Numbers {
  std::string text;
};

}  // namespace

namespace testing {

const void* numbers_of_another_file(Workspace& workspace) { return &workspace.get<Numbers>(); }

}  // namespace testing
}  // namespace dynfilter
