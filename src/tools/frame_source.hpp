// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_FRAME_SOURCE_HPP
#define DYNFILTER_SRC_TOOLS_FRAME_SOURCE_HPP

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "inputs.hpp"
#include "lab/scenes/synthetic_scene.hpp"

namespace dynfilter::tools {

/// A frame with everything known about it.
struct SourceFrame {
  std::string stem;  ///< of its files
  FrameView frame;
  double depth_timestamp_s = 0;       ///< the depth image's stamp; the frame's time without one
  std::optional<Segmentation> masks;  ///< none if the sequence has no masks
  std::optional<Segmentation> true_masks;  ///< none if the truth is unknown
  /// What moves in the frame, one instance of class 0 for each connected object; none unless
  /// FrameSource::pass_moving_masks was called.
  std::optional<Segmentation> moving_masks;
};

/// A source of frames: a sequence on disk, or a scene that is rendered on demand.
class FrameSource {
 public:
  static constexpr double exact_rim_px = 3;  ///< the rim of masks that are exact

  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  virtual std::size_t size() const = 0;
  virtual CameraParameters camera() const = 0;
  virtual bool has_depth() const = 0;
  virtual double depth_offset_s() const = 0;  ///< by which depth was paired; 0: as stamped
  virtual bool has_true_masks() const = 0;
  virtual std::string masks_name() const = 0;  ///< empty if there are none
  /// Returns the rim's width: features this near to a true mask, but not on it, count as neither
  /// dynamic nor static.
  virtual double rim_px() const { return exact_rim_px; }

  /// Makes read() pass the moving masks, and require_masks() check them. Throws std::runtime_error
  /// if the source has none.
  virtual void pass_moving_masks() = 0;

  /// Reads a frame. Throws std::runtime_error that names a missing or broken file.
  virtual SourceFrame read(std::size_t i) = 0;

  /// Throws what read(i) would throw for missing masks. Decodes nothing.
  virtual void require_masks(std::size_t i) const = 0;

  virtual std::optional<Trajectory> true_trajectory() const = 0;

  /// Returns the different values of masks without a table, read so far.
  virtual std::vector<int> mask_values() const { return {}; }

  /// Returns a line about tolerated flaws of the input; empty if there were none.
  virtual std::string note() const { return {}; }

  /// Adds the files and folders that the frames are read from.
  virtual void add_inputs(Inputs& inputs) const = 0;
};

/// Throws if a frame that is used, every `every`-th one, lacks its masks.
inline void require_masks(const FrameSource& source, std::size_t every) {
  for (std::size_t i = 0; i < source.size(); i += every) source.require_masks(i);
}

/// Returns options for masks that are named like the sequence's images.
inline MaskFolderOptions mask_options(const RgbdSequence& sequence) {
  MaskFolderOptions options;
  options.frame_times = sequence.times_by_stem();
  return options;
}

/// Adds the files and folders that a sequence is read from, masks excepted.
void add_sequence_inputs(const RgbdSequence& sequence, Inputs& inputs);

/// Names the ways to degrade good masks of a recording, so that rules have something to correct:
/// - eroded: by 8 px.
/// - cut: the lowest fifth of each mask is gone.
/// - disc: a disc somewhere on each mask is gone, a quarter as large as the mask.
/// - poor: all three, in this order.
/// - late: masks and boxes come from three frames before, or from the first frame.
std::vector<std::string> degradation_names();

/// The files of a recorded sequence.
struct SequenceSpec {
  std::filesystem::path sequence;        ///< its folder
  std::filesystem::path masks;           ///< empty: the sequence's own
  std::filesystem::path camera;          ///< empty: the sequence's own
  std::optional<double> depth_offset_s;  ///< empty: the camera file's
  bool reads_masks = true;               ///< false: masks come from elsewhere
  std::string degraded;                  ///< how the masks are degraded; empty: not at all
};

/// Opens a sequence in the layout of TUM or BONN. Reads everything but images: lists, camera, mask
/// tables and the true trajectory. Throws std::runtime_error that names what cannot be read, or if
/// there are no masks to degrade.
std::unique_ptr<FrameSource> open_sequence(const SequenceSpec& spec);

/// Renders a scene. Throws std::invalid_argument for options out of range.
std::unique_ptr<FrameSource> render_scene(const SyntheticSceneOptions& options);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_FRAME_SOURCE_HPP
