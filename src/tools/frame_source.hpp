// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_FRAME_SOURCE_HPP
#define DYNFILTER_SRC_TOOLS_FRAME_SOURCE_HPP

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/evaluation/synthetic_scene.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"
#include "inputs.hpp"

namespace dynfilter::tools {

/// A frame with all that is known about it.
struct SourceFrame {
  std::string stem;  ///< of its files
  FrameView frame;
  std::optional<Segmentation> masks;       ///< none where the sequence has no masks
  std::optional<Segmentation> true_masks;  ///< none where the truth is not known
};

/// Where frames come from: a sequence on disk, or a scene that is rendered as it is asked for.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  virtual std::size_t size() const = 0;
  virtual CameraParameters camera() const = 0;
  virtual bool has_depth() const = 0;
  virtual bool has_true_masks() const = 0;
  virtual std::string masks_name() const = 0;  ///< empty where there are none
  /// Features that close to a true mask, and not on it, are neither dynamic nor static.
  virtual double rim_px() const { return 3; }

  /// Throws std::runtime_error that names the file that is missing or broken.
  virtual SourceFrame read(std::size_t i) = 0;

  /// Throws what read(i) would throw where its masks are missing. Decodes nothing.
  virtual void require_masks(std::size_t i) const = 0;

  virtual std::optional<Trajectory> true_trajectory() const = 0;

  /// A line about flaws of the input that were passed over; empty where there were none.
  virtual std::string note() const { return {}; }

  /// Adds the files and folders that the frames are read from.
  virtual void add_inputs(Inputs& inputs) const = 0;
};

/// Throws where one of every so many frames misses its masks.
inline void require_masks(const FrameSource& source, std::size_t every) {
  for (std::size_t i = 0; i < source.size(); i += every) source.require_masks(i);
}

/// Adds the files and folders that frames without masks are read from.
void add_sequence_inputs(const RgbdSequence& sequence, Inputs& inputs);

/// A sequence in the layout of TUM or BONN. Empty paths stand for what lies in its folder. Reads
/// all but the images: lists, camera, tables of masks and the true trajectory. Throws
/// std::runtime_error that names what cannot be read.
std::unique_ptr<FrameSource> open_sequence(const std::filesystem::path& folder,
                                           const std::filesystem::path& masks = {},
                                           const std::filesystem::path& camera = {});

/// Throws std::invalid_argument for options out of range.
std::unique_ptr<FrameSource> render_scene(const SyntheticSceneOptions& options);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_FRAME_SOURCE_HPP
