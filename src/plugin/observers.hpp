// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <string>

#include <opencv2/core.hpp>

#include "dynfilter/diagnosis/input_checks.hpp"
#include "dynfilter/frame.hpp"
#include "plugin/host_input.hpp"
#include "plugin/plugin_settings.hpp"

namespace dynfilter::detail {

/// Records what the filter does: frames.csv, always complete up to the last frame, and an overlay
/// of every n-th frame with a known image. Lists these files in `.dynfilter-plugin.txt`. Replaces
/// the files that an earlier plugin listed there, and no others.
class Recorder {
 public:
  /// Makes the folder, removes an earlier recording and begins a new one. Throws
  /// std::runtime_error that names a folder that cannot be made, a file in the way, which no
  /// earlier plugin wrote, and what cannot be removed or written.
  Recorder(const std::filesystem::path& folder, int overlay_every);

  /// Records a frame. Throws std::runtime_error that names what cannot be written; the next frame
  /// may succeed.
  void record(const FrameView& frame, const FrameAnswer& answer);

 private:
  void write_overlay(const std::string& name, const cv::Mat& overlay);
  void add_table_row(const std::string& row) const;

  std::filesystem::path folder_;
  std::size_t overlay_every_;
  std::size_t frames_ = 0;
  std::set<std::string> overlays_;  // names of the overlays that were written
};

/// What sees an answer when the host has it: the recorder, the checks of the input, and the
/// messages to standard error, each of which comes once.
class Observers {
 public:
  /// Begins the recording, if there is one. Throws std::runtime_error that names the setting if
  /// that fails.
  explicit Observers(const PluginSettings& settings);

  /// Notes the values of masks without a table.
  void note_mask_values(const std::vector<int>& values) { checks_.note_mask_values(values); }

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
