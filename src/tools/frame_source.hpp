// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/evaluation/sequence_camera.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "inputs.hpp"
#include "lab/scenes/synthetic_scene.hpp"
#include "recorded_masks.hpp"

namespace dynfilter::tools {

/// A frame with everything known about it.
struct SourceFrame {
  std::string stem;  ///< of its files
  FrameView frame;
  double depth_timestamp_s = 0;       ///< the depth image's stamp; the frame's time without one
  std::optional<Segmentation> masks;  ///< none if the sequence has no masks
  std::optional<Segmentation> true_masks;  ///< none if the truth is unknown
  /// What moves in the frame, one instance of class 0 for each connected object; none unless the
  /// truth is by motion.
  std::optional<Segmentation> moving_masks;
  double masks_ms = 0;  ///< time spent waiting for masks
};

/// Definition of what is dynamic: for the scores of features, and for the rule `perfect`.
enum class Truth : std::uint8_t {
  by_class,  ///< persons, whether they move or not: the true masks
  by_motion  ///< what moves in this frame, whatever it is: the moving masks
};

inline const char* name_of(Truth truth) { return truth == Truth::by_motion ? "motion" : "class"; }

/// Returns the masks of what is dynamic in the frame; none if they are unknown.
inline const std::optional<Segmentation>& dynamic_masks(const SourceFrame& frame, Truth truth) {
  return truth == Truth::by_motion ? frame.moving_masks : frame.true_masks;
}

/// What is known of a source before any frame is read.
struct SourceFacts {
  std::size_t frames = 0;
  SequenceCamera camera;
  bool has_depth = true;
  double depth_offset_s = 0;  ///< by which depth was paired; 0: as stamped
  bool has_true_masks = true;
  std::string masks_name;  ///< empty if there are none
  /// The rim's width: features this near to a true mask, but not on it, count as neither dynamic
  /// nor static.
  double rim_px = 3;
  std::optional<Trajectory> trajectory;  ///< the true one
  std::string note;                      ///< about tolerated flaws of the input; empty: none
};

/// A source of frames: a sequence on disk, or a scene that is rendered on demand.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  const SourceFacts& facts() const { return facts_; }
  std::size_t size() const { return facts_.frames; }

  /// Tells whether there is a frame i: a film's size is an estimate.
  virtual bool has(std::size_t i) { return i < size(); }

  /// Reads a frame. Throws std::runtime_error that names a missing or broken file.
  virtual SourceFrame read(std::size_t i) = 0;

  /// Throws what read(i) would throw for missing masks. Decodes nothing.
  virtual void require_masks(std::size_t) const {}

  /// Returns the different values of masks without a table, read so far.
  std::vector<int> mask_values() const { return masks_ ? masks_->values() : std::vector<int>(); }

  /// Returns the recorded sequence that the frames are of; null for another source.
  virtual const RgbdSequence* sequence() const { return nullptr; }

  /// Adds the files and folders that the frames are read from.
  virtual void add_inputs(Inputs&) const {}

 protected:
  SourceFacts facts_;
  std::filesystem::path masks_folder_;  // which may be a file; empty without masks
  std::optional<RecordedMasks> masks_;
};

/// Throws if a frame that is used, every `every`-th one, lacks its masks.
inline void require_masks(const FrameSource& source, std::size_t every) {
  for (std::size_t i = 0; i < source.size(); i += every) source.require_masks(i);
}

/// Makes good masks of a recording worse, so that rules have something to correct. The names:
/// - eroded_N: by N px; eroded: by 8.
/// - cut: the lowest fifth of each mask is gone.
/// - disc: a disc somewhere on each mask is gone, a quarter as large as the mask.
/// - poor: eroded, cut and disc, in this order.
/// - boxes: each mask fills its box.
/// - late_N: masks and boxes come from N frames before, or from the first frame; late: from 3.
/// - missing_N: every N-th frame shows nobody.
struct Degradation {
  std::string name;         ///< empty: masks stay as they are
  std::optional<int> size;  ///< N

  /// Parses a name. Throws std::invalid_argument for an unknown one.
  static Degradation parse(const std::string& text);
};

/// The names of a scene in results.
struct SceneName {
  std::string group;   ///< scenes that a table combines: the level, or the sequence alone
  std::string source;  ///< medium_5, or the name of the sequence's folder
  std::string name;    ///< the same or, where numbers of features are compared, medium_5_2000
};

/// The frames to use: those of a recorded sequence, or of a level with a seed.
struct SceneSpec {
  std::filesystem::path sequence;  ///< its folder; empty: use the level
  RgbdSequenceOptions reading;     ///< how to read the sequence
  std::filesystem::path masks;     ///< empty: the sequence's own
  bool reads_masks = true;         ///< false: masks come from elsewhere
  bool keeps_missing = false;      ///< whether frames may lack masks, which remove nothing
  bool is_for_masks = false;       ///< of images alone, of any sizes: nothing is known but masks
  std::string degraded;            ///< how the masks are degraded; empty: not at all
  std::string level;               ///< empty: use the sequence
  std::uint64_t level_seed = 1;
  std::optional<int> frames, width, height;  ///< replace the level's own
  std::optional<int> features;               ///< a frame; replaces the settings' number

  SceneName name() const;

  /// Returns the options of the level, with the numbers that are given.
  SyntheticSceneOptions level_options() const;

  /// Opens the scene, with what this truth needs. Of a sequence, reads everything but images:
  /// lists, camera, mask tables and the true trajectory. Throws std::runtime_error that names what
  /// cannot be read, or if there are no masks to degrade, or no moving masks for a truth by motion.
  std::unique_ptr<FrameSource> open(Truth truth) const;
};

}  // namespace dynfilter::tools
