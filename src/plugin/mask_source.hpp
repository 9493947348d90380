// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/segmenters/mask_carrier.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "plugin/host_input.hpp"
#include "plugin/plugin_settings.hpp"

namespace dynfilter::detail {

/// Makes or reads masks. A frame was submitted if it has the id of the one submitted last.
class MaskSource {
 public:
  virtual ~MaskSource() = default;

  /// Takes a frame with its image, before its features are known.
  virtual void submit(const FrameView& frame) = 0;

  /// Returns the frame's masks. Throws std::invalid_argument for a frame that was not submitted and
  /// had to be, and passes on what the segmenter throws. Asked again for a frame that failed, it
  /// fails again.
  virtual FrameMasks masks_for(const FrameView& frame) = 0;

  /// Returns the values of masks without a table.
  virtual std::vector<int> mask_values() const { return {}; }
};

/// The masks of a plugin, by its settings: from a folder, another process or a network; unchanged,
/// or moved to the frame; with motion, those of missed objects carried on.
class PluginMasks {
 public:
  /// Makes the source. Throws std::runtime_error that names the settings file and the key if that
  /// fails.
  explicit PluginMasks(const PluginSettings& settings);

  /// Returns the settings' classes, or the network's class of persons, unless they name classes.
  const std::vector<int>& dynamic_classes() const { return dynamic_classes_; }

  /// Returns the values of masks without a table, for the checks of the input.
  std::vector<int> mask_values() const { return source_->mask_values(); }

  /// Takes a frame's image, before its features are known. Throws std::system_error if a thread is
  /// needed and cannot be started.
  void submit(const FrameView& frame);

  /// Returns the masks for a frame, until the next call. A frame of the last time gets the same
  /// ones. Passes on the source's errors; a std::runtime_error gets the settings file and the key
  /// and, where it helps, the setting that continues without masks.
  const FrameMasks& masks_for(const FrameView& frame);

 private:
  FrameMasks find(const FrameView& frame);

  std::string origin_;  // the settings file and the masks' key, for errors
  std::string remedy_;  // the settings that help against missing masks, in brackets
  bool continues_without_masks_;
  std::vector<int> dynamic_classes_;
  std::unique_ptr<MaskSource> source_;
  std::optional<MaskPropagator> propagator_;
  std::optional<MaskCarrier> carrier_;
  std::optional<double> answered_s_;  // time of the frame of `masks_`
  FrameMasks masks_;
};

}  // namespace dynfilter::detail
