// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/workspace.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {

/// Returns the address that a type named Numbers in another file's anonymous namespace gets.
const void* numbers_of_another_file(Workspace& workspace);

namespace {

struct Numbers {
  std::vector<int> values;
};
struct Names {
  std::vector<std::string> values;
};

TEST(Workspace, KeepsOneObjectOfEachType) {
  Workspace workspace;
  workspace.get<Numbers>().values = {1, 2};
  workspace.get<Names>().values = {"a"};
  EXPECT_EQ(workspace.get<Numbers>().values.size(), 2U);
  EXPECT_EQ(workspace.get<Names>().values.size(), 1U);
}

TEST(Workspace, ScratchKeepsItsAddress) {
  Workspace workspace;
  const Numbers* const numbers = &workspace.get<Numbers>();
  workspace.get<Names>();
  workspace.get<int>();
  workspace.get<double>();
  EXPECT_EQ(&workspace.get<Numbers>(), numbers);
  const Workspace moved = std::move(workspace);
  EXPECT_EQ(numbers->values.size(), 0U) << "it lives on in the workspace that it moved to";
}

// A stage's scratch may be in an anonymous namespace, and its name is no rare one.
TEST(Workspace, TellsTypesOfOneNameInTwoFilesApart) {
  Workspace workspace;
  const void* const others = numbers_of_another_file(workspace);
  EXPECT_NE(static_cast<const void*>(&workspace.get<Numbers>()), others);
  EXPECT_EQ(numbers_of_another_file(workspace), others);
}

TEST(Workspace, FailedScratchLeavesTheRest) {
  struct Throwing {
    Throwing() { throw std::runtime_error("no memory"); }
  };
  Workspace workspace;
  workspace.get<Numbers>().values = {1};
  EXPECT_THROW(workspace.get<Throwing>(), std::runtime_error);
  EXPECT_EQ(workspace.get<Numbers>().values.size(), 1U);
}

}  // namespace
}  // namespace dynfilter::testing
