// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/mask_source.hpp"

#include <exception>
#include <stdexcept>
#include <utility>

#include "plugin/stopwatch.hpp"
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
#include "dynfilter/segmenters/remote_segmenter.hpp"
#endif
#ifdef DYNFILTER_HAS_NETWORKS
#include "dynfilter/networks/network_segmenter.hpp"
#endif

namespace dynfilter::detail {
namespace {

/// Makes the segmenter of a folder; `allow_missing` as in its options.
std::unique_ptr<Segmenter> make_folder(const PluginSettings& settings, bool allow_missing) {
  MaskFolderOptions options = settings.mask_folder_options;
  options.allow_missing = allow_missing;
  return std::make_unique<MaskFolderSegmenter>(settings.mask_folder, options);
}

/// Tells whether the folder could be used if masks might be missing.
bool would_do_without(const PluginSettings& settings) {
  if (settings.mask_folder.empty()) return false;
  try {
    return make_folder(settings, true) != nullptr;
  } catch (const std::runtime_error&) {
    return false;
  }
}

/// Names the settings that help where a mask is missing.
std::string remedy_of(const PluginSettings& settings) {
  std::string remedy = " (" + settings.missing_masks_key + ": \"keep\" continues without";
  if (!settings.mask_folder.empty()) {
    remedy += "; " + settings.max_time_difference_key + " takes masks of other times";
  }
  return remedy + ")";
}

std::unique_ptr<Segmenter> make_segmenter(const PluginSettings& settings) {
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  if (!settings.remote.empty()) {
    RemoteSegmenterOptions options;
    options.timeout_s = settings.remote_timeout_s;
    return std::make_unique<RemoteSegmenter>(settings.remote, options);
  }
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  if (!settings.model.empty()) return make_network_segmenter(settings.model);
#endif
  return make_folder(settings, settings.missing_masks == "keep");
}

}  // namespace

MaskSource::MaskSource(const PluginSettings& settings)
    : origin_(settings.file + ": " + settings.source_key + ": "),
      remedy_(remedy_of(settings)),
      continues_without_masks_(settings.missing_masks == "keep") {
  try {
    segmenter_ = make_segmenter(settings);
    if (settings.hand_over) {
      AsyncSegmenterOptions options;
      options.hand_over = *settings.hand_over;
      options.max_wait_s = settings.max_wait_s;
      thread_ = std::make_unique<AsyncSegmenter>(std::move(segmenter_), options);
    } else {
      folder_ = dynamic_cast<MaskFolderSegmenter*>(segmenter_.get());
      if (folder_ && settings.reads_ahead) ahead_ = std::make_unique<ReadAhead>(*folder_);
    }
  } catch (const std::invalid_argument& error) {  // names an option
    throw std::runtime_error(settings.file + ": " + error.what());
  } catch (const std::runtime_error& error) {
    const bool helps = !continues_without_masks_ && would_do_without(settings);
    throw std::runtime_error(origin_ + error.what() + (helps ? remedy_ : ""));
  }
  if (settings.moves_masks) propagator_.emplace();
}

void MaskSource::submit(const FrameView& frame) {
  FrameView numbered = frame;
  numbered.id = frame_id_ + 1;
  if (ahead_ && folder_->has_mask(frame.timestamp_s)) ahead_->submit(numbered);
  number(frame);
}

/// Gives the frame its number, and hands it to the segmenter's thread if there is one.
void MaskSource::number(const FrameView& frame) {
  FrameView numbered = frame;
  numbered.id = frame_id_ + 1;
  if (thread_) thread_->submit(numbered);
  ++frame_id_;
  submitted_s_ = frame.timestamp_s;
}

std::optional<Segmentation> MaskSource::masks_for(
    FrameView frame, const std::optional<std::vector<PointMotion>>& motions) {
  // A host may filter a frame again after it has released the image.
  const bool was_submitted = !frame.image.empty() || frame.timestamp_s == submitted_s_;
  if (!was_submitted) number(frame);
  frame.id = frame_id_;
  if (propagator_ && propagated_id_ == frame.id) return propagated_;
  std::optional<Segmentation> masks = segment_or_continue(frame);
  if (!propagator_) return masks;
  propagated_ = motions ? propagator_->propagate(frame, masks, *motions)
                        : propagator_->propagate(frame, masks);
  propagated_id_ = frame.id;
  return propagated_;
}

std::optional<Segmentation> MaskSource::segment_or_continue(const FrameView& frame) {
  try {
    return segment(frame);
  } catch (const std::runtime_error& error) {
    // A broken mask in a folder stays broken; a missing one may be skipped.
    const bool is_passable = !folder_ || !folder_->has_mask(frame.timestamp_s);
    if (!is_passable) throw std::runtime_error(origin_ + error.what());
    if (!continues_without_masks_) {
      throw std::runtime_error(origin_ + error.what() + remedy_);
    }
    ++failures_;
    return {};
  }
}

std::optional<Segmentation> MaskSource::segment(const FrameView& frame) {
  made_s_.reset();
  if (thread_) {
    std::optional<Segmentation> masks = thread_->collect(frame.id);
    if (masks) made_s_ = thread_->statistics().last_inference_s;
    return masks;
  }
  if (folder_ && continues_without_masks_ && !folder_->has_mask(frame.timestamp_s)) return {};
  if (ahead_) {
    Segmentation masks = ahead_->collect(frame);
    made_s_ = ahead_->read_s();
    return masks;
  }
  const Stopwatch stopwatch;
  Segmentation masks = segmenter_->segment(frame);
  made_s_ = stopwatch.elapsed_s();
  return masks;
}

}  // namespace dynfilter::detail
