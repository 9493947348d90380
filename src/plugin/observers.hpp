// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <optional>
#include <set>
#include <string>

#include "dynfilter/diagnosis/input_checks.hpp"
#include "dynfilter/frame.hpp"
#include "plugin/frame_answer.hpp"
#include "plugin/plugin_settings.hpp"
#include "plugin/recorder.hpp"

namespace dynfilter::detail {

/// What sees an answer when the host has it: the recorder, the checks of the input, and the
/// messages to standard error, each of which comes once.
class Observers {
 public:
  /// Begins the recording, if there is one. Throws std::runtime_error that names the setting if
  /// that fails.
  explicit Observers(const PluginSettings& settings);

  /// Shows them a frame and its answer. Writes the first failure of each to standard error. Returns
  /// whether the frame is recorded, or need not be.
  bool see(const FrameView& frame, const FrameAnswer& answer) noexcept;

 private:
  template <class Action>
  bool attempt(const char* consequence, const Action& action) noexcept;
  void check(const FrameView& frame, const FrameAnswer& answer);
  void report(const FrameAnswer& answer);
  void say_once(const std::string& subject, const std::string& sentence);

  InputChecks checks_;
  std::optional<Recorder> recorder_;
  std::set<std::string> said_;  // subjects
};

}  // namespace dynfilter::detail
