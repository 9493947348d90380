// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/mask_source.hpp"

#include <exception>
#include <iostream>
#include <stdexcept>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
#include "dynfilter/segmenters/remote_segmenter.hpp"
#endif
#ifdef DYNFILTER_HAS_NETWORKS
#include "dynfilter/networks/network_segmenter.hpp"
#endif

namespace dynfilter::detail {
namespace {

std::shared_ptr<MaskFolderSegmenter> make_folder(const PluginSettings& settings,
                                                 bool allow_missing) {
  MaskFolderOptions options = settings.mask_folder_options;
  options.allow_missing = allow_missing;
  return std::make_shared<MaskFolderSegmenter>(settings.mask_folder, options);
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

/// Makes the segmenter of settings without a folder.
std::unique_ptr<Segmenter> make_segmenter([[maybe_unused]] const PluginSettings& settings) {
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  if (!settings.remote.empty()) return std::make_unique<RemoteSegmenter>(settings.remote);
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  if (!settings.model.empty()) {
    NetworkOptions options;
    options.device = settings.device;
    return std::make_unique<NetworkSegmenter>(settings.model, options);
  }
#endif
  throw std::logic_error("dynfilter: the settings have no source of masks");
}

/// Lets a thread read a folder that this one asks, too. Reading changes nothing in the folder.
class FolderReader final : public Segmenter {
 public:
  explicit FolderReader(std::shared_ptr<MaskFolderSegmenter> folder) : folder_(std::move(folder)) {}

 private:
  Segmentation do_segment(const FrameView& frame) override { return folder_->segment(frame); }

  std::shared_ptr<MaskFolderSegmenter> folder_;
};

}  // namespace

MaskSource::MaskSource(const PluginSettings& settings)
    : origin_(settings.place_of(settings.source()) + ": "),
      remedy_(remedy_of(settings)),
      continues_without_masks_(settings.missing_masks == "keep"),
      hand_over_(settings.hand_over) {
  try {
    if (!settings.mask_folder.empty()) {
      folder_ = make_folder(settings, continues_without_masks_);
    } else {
      segmenter_ = make_segmenter(settings);
      if (hand_over_) start_thread();
    }
  } catch (const std::invalid_argument& error) {  // names an option of the segmenter's
    throw std::runtime_error(origin_ + without_component(error.what()));
  } catch (const std::runtime_error& error) {
    const bool helps = !continues_without_masks_ && would_do_without(settings);
    throw std::runtime_error(origin_ + error.what() + (helps ? remedy_ : ""));
  }
  if (settings.moves_masks) propagator_.emplace();
}

void MaskSource::start_thread() {
  AsyncSegmenterOptions options;
  options.hand_over = hand_over_.value_or(HandOver::wait);
  if (folder_) {
    thread_ = std::make_unique<AsyncSegmenter>(std::make_unique<FolderReader>(folder_), options);
  } else {
    thread_ = std::make_unique<AsyncSegmenter>(std::move(segmenter_), options);
  }
}

void MaskSource::submit(const FrameView& frame) {
  submitted_ = ++frames_;
  submitted_s_ = frame.timestamp_s;
  answered_.reset();
  if (folder_ ? !folder_->has_mask(frame.timestamp_s) : !thread_) return;
  if (!thread_) start_thread();
  // Nobody will filter an earlier frame. HandOver::wait would keep it for ever.
  if (is_uncollected_ && hand_over_.value_or(HandOver::wait) == HandOver::wait) thread_->reset();
  FrameView numbered = folder_ ? FrameView() : frame;  // the thread copies images
  numbered.id = frames_;
  numbered.timestamp_s = frame.timestamp_s;
  thread_->submit(numbered);
  is_uncollected_ = true;
}

const std::optional<Segmentation>& MaskSource::masks_for(FrameView frame) {
  if (answered_ && answered_->timestamp_s == frame.timestamp_s) return answered_->masks;
  answered_.reset();
  // A host may filter a frame again after it has released the image.
  const bool is_submitted =
      submitted_s_ && (!frame.image.empty() || frame.timestamp_s == *submitted_s_);
  frame.id = is_submitted ? submitted_ : ++frames_;
  std::optional<Segmentation> masks = segment_or_continue(frame, is_submitted);
  if (propagator_) masks = propagator_->propagate(frame, masks);
  answered_ = {frame.timestamp_s, std::move(masks)};
  return answered_->masks;
}

std::optional<Segmentation> MaskSource::segment_or_continue(const FrameView& frame,
                                                            bool is_submitted) {
  made_s_.reset();
  try {
    return segment(frame, is_submitted);
  } catch (const std::runtime_error& error) {
    // A mask in a folder that cannot be read stays broken. Missing ones lead here only if they may
    // not be missing.
    const bool is_broken =
        folder_ && (continues_without_masks_ || folder_->has_mask(frame.timestamp_s));
    if (is_broken || !continues_without_masks_) {
      throw std::runtime_error(origin_ + error.what() + (is_broken ? "" : remedy_));
    }
    if (++failures_ == 1) {
      std::cerr << "dynfilter: " << origin_ << error.what()
                << " (this frame, and others that fail, go on without masks)" << std::endl;
    }
    return {};
  }
}

std::optional<Segmentation> MaskSource::segment(const FrameView& frame, bool is_submitted) {
  const bool takes_any = hand_over_ == HandOver::latest;
  const bool lacks_mask = folder_ && !folder_->has_mask(frame.timestamp_s);
  if (lacks_mask && continues_without_masks_ && !(takes_any && is_submitted)) return {};
  if (!folder_ && !is_submitted && !takes_any) {
    throw_misuse("Plugin::filter",
                 "a frame of time " + time_text(frame.timestamp_s) + " that was not submitted",
                 "submit(image, time) before filter(time, ...)");
  }
  if (thread_ && (is_submitted || !folder_) && !(lacks_mask && !takes_any)) {
    is_uncollected_ = false;
    std::optional<Segmentation> masks = thread_->collect(frame.id);
    if (masks) made_s_ = thread_->statistics().last_inference_s;
    const cv::Size size = frame.image.empty() ? frame.depth.size() : frame.image.size();
    const bool is_own = masks && masks->timestamp_s == frame.timestamp_s &&
                        (size.empty() || size == masks->image_size);
    if (hand_over_ || is_own) return masks;
  }
  cv::TickMeter stopwatch;
  stopwatch.start();
  std::optional<Segmentation> masks =
      folder_ ? folder_->segment(frame) : segmenter_->segment(frame);
  stopwatch.stop();
  made_s_ = stopwatch.getTimeSec();
  return masks;
}

}  // namespace dynfilter::detail
