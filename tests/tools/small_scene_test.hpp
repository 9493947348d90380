// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "tools/program.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {

/// Small scene on disk, made once for the tests of a file.
class SmallSceneTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    const Outcome synth = run("synth " + quoted(scene()) + " --frames 6 --width 320 --height 240");
    ASSERT_EQ(synth.exit_code, 0) << synth.printed;
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static fs::path scene() { return folder_->path() / "a scene"; }
  static fs::path out(const char* name) { return folder_->path() / name; }

 private:
  static inline std::unique_ptr<TemporaryFolder> folder_;
};

/// Scene on disk, made once for the tests of a fixture, which names the options of `synth`. Each
/// test has a copy of its own.
template <class Fixture>
class CopiedSceneTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_ = std::make_unique<TemporaryFolder>();
    const Outcome synth = run("synth " + quoted(made()) + " " + Fixture::synth_options);
    ASSERT_EQ(synth.exit_code, 0) << synth.printed;
  }
  static void TearDownTestSuite() { made_.reset(); }
  void SetUp() override { fs::copy(made(), scene(), fs::copy_options::recursive); }

  static fs::path made() { return *made_ / "scene"; }
  fs::path scene() const { return folder_ / "scene"; }

  TemporaryFolder folder_;

 private:
  static inline std::unique_ptr<TemporaryFolder> made_;
};

}  // namespace dynfilter::testing
