// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/mask_source.hpp"

#include <exception>
#include <iostream>
#include <stdexcept>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
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
  std::string remedy = " (" + settings.prefix + "missing_masks: \"keep\" continues without";
  if (!settings.mask_folder.empty()) {
    remedy += "; " + settings.prefix + "max_time_difference_s takes masks of other times";
  }
  return remedy + ")";
}

std::unique_ptr<Segmenter> make_segmenter(const PluginSettings& settings) {
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  if (!settings.remote.empty()) return std::make_unique<RemoteSegmenter>(settings.remote);
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  if (!settings.model.empty()) return make_network_segmenter(settings.model);
#endif
  return make_folder(settings, settings.missing_masks == "keep");
}

}  // namespace

MaskSource::MaskSource(const PluginSettings& settings)
    : origin_(settings.place_of(settings.source()) + ": "),
      remedy_(remedy_of(settings)),
      continues_without_masks_(settings.missing_masks == "keep"),
      hand_over_(settings.hand_over) {
  try {
    segmenter_ = make_segmenter(settings);
    folder_ = dynamic_cast<MaskFolderSegmenter*>(segmenter_.get());
    if (hand_over_) {
      AsyncSegmenterOptions options;
      options.hand_over = *hand_over_;
      // A folder is read for frames without an image, too, which the thread does not get.
      std::unique_ptr<Segmenter> for_thread = folder_ ? make_segmenter(settings) : nullptr;
      thread_ = std::make_unique<AsyncSegmenter>(
          for_thread ? std::move(for_thread) : std::move(segmenter_), options);
    } else if (folder_) {
      ahead_ = std::make_unique<ReadAhead>(*folder_);
    }
  } catch (const std::invalid_argument& error) {  // names an option
    throw std::runtime_error(settings.file + ": " + error.what());
  } catch (const std::runtime_error& error) {
    const bool helps = !continues_without_masks_ && would_do_without(settings);
    throw std::runtime_error(origin_ + error.what() + (helps ? remedy_ : ""));
  }
  if (settings.moves_masks) propagator_.emplace();
}

/// Tells whether the frame has no mask, and may have none.
bool MaskSource::lacks_mask(const FrameView& frame) const {
  return folder_ && continues_without_masks_ && !folder_->has_mask(frame.timestamp_s);
}

void MaskSource::submit(const FrameView& frame) {
  FrameView numbered = frame;
  numbered.id = ++frames_;
  if (thread_ && !lacks_mask(frame)) {
    // Nobody will filter an earlier frame. HandOver::wait would keep it for ever.
    if (is_uncollected_ && *hand_over_ == HandOver::wait) thread_->reset();
    thread_->submit(numbered);
    is_uncollected_ = true;
  }
  if (ahead_ && folder_->has_mask(frame.timestamp_s)) ahead_->submit(numbered);
  submitted_ = {numbered.id, frame.timestamp_s};
}

/// A host may filter a frame again after it has released the image.
bool MaskSource::is_submitted(const FrameView& frame) const {
  return submitted_ && (!frame.image.empty() || frame.timestamp_s == submitted_->timestamp_s);
}

std::uint64_t MaskSource::id_of(const FrameView& frame) {
  if (is_submitted(frame)) return submitted_->id;
  const bool is_known = unsubmitted_ && unsubmitted_->timestamp_s == frame.timestamp_s;
  if (!is_known) unsubmitted_ = {++frames_, frame.timestamp_s};
  return unsubmitted_->id;
}

std::optional<Segmentation> MaskSource::masks_for(FrameView frame) {
  frame.id = id_of(frame);
  if (propagator_ && propagated_id_ == frame.id) return propagated_;
  std::optional<Segmentation> masks = segment_or_continue(frame);
  if (!propagator_) return masks;
  propagated_ = propagator_->propagate(frame, masks);
  propagated_id_ = frame.id;
  return propagated_;
}

std::optional<Segmentation> MaskSource::segment_or_continue(const FrameView& frame) {
  try {
    return segment(frame);
  } catch (const std::runtime_error& error) {
    // A mask in a folder that cannot be read stays broken. Missing ones lead here only if they may
    // not be missing.
    const bool is_broken =
        folder_ && (continues_without_masks_ || folder_->has_mask(frame.timestamp_s));
    if (is_broken) throw std::runtime_error(origin_ + error.what());
    if (!continues_without_masks_) {
      throw std::runtime_error(origin_ + error.what() + remedy_);
    }
    if (++failures_ == 1) {
      std::cerr << "dynfilter: " << origin_ << error.what()
                << " (this frame, and others that fail, "
                << "go on without masks)" << std::endl;
    }
    return {};
  }
}

std::optional<Segmentation> MaskSource::segment(const FrameView& frame) {
  made_s_.reset();
  if (thread_ && (is_submitted(frame) || !folder_)) return collect(frame);
  if (lacks_mask(frame)) return {};
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

/// Takes the masks from the thread.
std::optional<Segmentation> MaskSource::collect(const FrameView& frame) {
  const bool takes_any = *hand_over_ == HandOver::latest;
  if (!takes_any && lacks_mask(frame)) return {};
  if (!takes_any && !is_submitted(frame)) {
    throw_misuse("Plugin::filter",
                 "a frame of time " + time_text(frame.timestamp_s) + " that was not submitted",
                 "submit(image, time) before filter(time, ...)");
  }
  is_uncollected_ = false;
  std::optional<Segmentation> masks = thread_->collect(frame.id);
  if (masks) made_s_ = thread_->statistics().last_inference_s;
  return masks;
}

}  // namespace dynfilter::detail
