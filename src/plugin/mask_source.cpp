// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/mask_source.hpp"

#include <cstdint>
#include <exception>
#include <stdexcept>
#include <utility>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/segmenter.hpp"
#include "dynfilter/segmenters/async_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
#include "dynfilter/remote/remote_segmenter.hpp"
#endif
#ifdef DYNFILTER_HAS_NETWORKS
#include "dynfilter/networks/network_segmenter.hpp"
#endif

namespace dynfilter::detail {
namespace {

/// A mask that is there and cannot be read. No setting helps.
class BrokenMask : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

FrameMasks segment_now(Segmenter& segmenter, const FrameView& frame) {
  cv::TickMeter stopwatch;
  stopwatch.start();
  FrameMasks masks;
  masks.segmentation = segmenter.segment(frame);
  stopwatch.stop();
  masks.made_s = stopwatch.getTimeSec();
  return masks;
}

void require_submitted(const FrameView& frame, const std::optional<std::uint64_t>& submitted) {
  if (submitted == frame.id) return;
  throw_misuse("Plugin::filter",
               "a frame of time " + time_text(frame.timestamp_s) + " that was not submitted",
               "submit(image, time) before filter(time, ...)");
}

/// Reads masks from a folder: that of a submitted frame in a thread, any other when it is asked
/// for.
class ReadAhead final : public MaskSource {
 public:
  ReadAhead(const std::string& folder, const MaskFolderOptions& options)
      : may_be_missing_(options.allow_missing),
        folder_(std::make_shared<MaskFolderSegmenter>(folder, options)) {}

  void submit(const FrameView& frame) override {
    ahead_.reset();
    if (!folder_->has_mask(frame.timestamp_s)) return;
    if (!thread_) {
      AsyncSegmenterOptions options;
      options.hand_over = HandOver::wait;
      thread_.emplace(std::make_unique<Reader>(folder_), options);
    }
    thread_->reset();  // nobody asks for an earlier frame any more
    FrameView ahead;   // without the image, which the thread would copy
    ahead.id = frame.id;
    ahead.timestamp_s = frame.timestamp_s;
    thread_->submit(ahead);
    ahead_ = ahead;
  }

  std::vector<int> mask_values() const override { return folder_->values(); }

  FrameMasks masks_for(const FrameView& frame) override {
    const bool has_mask = folder_->has_mask(frame.timestamp_s);
    if (!has_mask && may_be_missing_) return {};
    FrameMasks masks = collect(frame);
    if (masks.segmentation) return masks;
    try {
      return segment_now(*folder_, frame);
    } catch (const std::runtime_error& error) {
      if (has_mask) throw BrokenMask(error.what());
      throw;
    }
  }

 private:
  /// Lets the thread read the folder that this one asks, too.
  struct Reader final : Segmenter {
    explicit Reader(std::shared_ptr<MaskFolderSegmenter> from) : folder(std::move(from)) {}
    Segmentation do_segment(const FrameView& frame) override { return folder->segment(frame); }

    std::shared_ptr<MaskFolderSegmenter> folder;
  };

  /// Returns what the thread read, if it is for exactly this frame.
  FrameMasks collect(const FrameView& frame) {
    const std::optional<FrameView> ahead = std::exchange(ahead_, std::nullopt);
    FrameMasks masks;
    try {
      if (ahead) masks.segmentation = thread_->collect(ahead->id);
    } catch (const std::exception&) {  // it is read again, which tells why it fails
    }
    const cv::Size size = frame.image.empty() ? frame.depth.size() : frame.image.size();
    const bool is_own = masks.segmentation && ahead->timestamp_s == frame.timestamp_s &&
                        (size.empty() || size == masks.segmentation->image_size);
    if (!is_own) return {};
    masks.made_s = thread_->statistics().last_inference_s;
    return masks;
  }

  bool may_be_missing_;
  std::shared_ptr<MaskFolderSegmenter> folder_;
  std::optional<AsyncSegmenter> thread_;  // from the first frame on that it can read
  std::optional<FrameView> ahead_;        // the frame that it reads
};

/// Segments the submitted frame when its masks are asked for, in the calling thread.
class OnDemand final : public MaskSource {
 public:
  explicit OnDemand(std::unique_ptr<Segmenter> segmenter) : segmenter_(std::move(segmenter)) {}

  void submit(const FrameView& frame) override { submitted_ = frame.id; }

  FrameMasks masks_for(const FrameView& frame) override {
    require_submitted(frame, submitted_);
    return segment_now(*segmenter_, frame);
  }

 private:
  std::unique_ptr<Segmenter> segmenter_;
  std::optional<std::uint64_t> submitted_;
};

/// Segments submitted frames in a thread. With HandOver::latest, any frame gets the newest masks.
class InThread final : public MaskSource {
 public:
  InThread(std::unique_ptr<Segmenter> segmenter, const AsyncSegmenterOptions& options)
      : hand_over_(options.hand_over), thread_(std::move(segmenter), options) {}

  void submit(const FrameView& frame) override {
    // Nobody asks for an earlier frame any more, which HandOver::wait would keep for ever. If time
    // went back, the newest masks are those of a frame that is to come.
    if (hand_over_ == HandOver::wait || frame.timestamp_s < submitted_s_) thread_.reset();
    thread_.submit(frame);
    submitted_ = frame.id;
    submitted_s_ = frame.timestamp_s;
    failed_.reset();
  }

  FrameMasks masks_for(const FrameView& frame) override {
    const bool takes_any = hand_over_ == HandOver::latest;
    if (!takes_any) require_submitted(frame, submitted_);
    FrameMasks masks;
    try {
      masks.segmentation = thread_.collect(frame.id);
    } catch (...) {
      failed_ = frame.id;
      failure_ = std::current_exception();
      throw;
    }
    // The thread throws a failure once.
    const bool is_known = masks.segmentation && !takes_any;
    if (failed_ == frame.id && !is_known) std::rethrow_exception(failure_);
    if (masks.segmentation) masks.made_s = thread_.statistics().last_inference_s;
    return masks;
  }

 private:
  HandOver hand_over_;
  AsyncSegmenter thread_;
  std::optional<std::uint64_t> submitted_, failed_;  // frames
  double submitted_s_ = 0;
  std::exception_ptr failure_;  // of the frame that failed
};

/// Makes the segmenter of settings without a folder, and takes the network's class of persons.
std::unique_ptr<Segmenter> make_segmenter([[maybe_unused]] const PluginSettings& settings,
                                          [[maybe_unused]] std::vector<int>& dynamic_classes) {
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  if (!settings.remote.empty()) {
    RemoteSegmenterOptions options;
    if (settings.hand_over) options.timeout_s = 10;  // A longer one holds the host at its end.
    return std::make_unique<RemoteSegmenter>(settings.remote, options);
  }
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  if (!settings.model.empty()) {
    NetworkOptions options;
    options.device = settings.device;
    auto network = std::make_unique<NetworkSegmenter>(settings.model, options);
    const std::optional<int> person = network->class_id("person");
    if (person && !settings.names_classes) dynamic_classes = {*person};
    return network;
  }
#endif
  throw std::logic_error("dynfilter: the settings have no source of masks");
}

std::unique_ptr<MaskSource> make_source(const PluginSettings& settings, bool may_be_missing,
                                        std::vector<int>& dynamic_classes) {
  if (!settings.mask_folder.empty()) {
    MaskFolderOptions options = settings.mask_folder_options;
    options.allow_missing = may_be_missing;
    return std::make_unique<ReadAhead>(settings.mask_folder, options);
  }
  std::unique_ptr<Segmenter> segmenter = make_segmenter(settings, dynamic_classes);
  if (!settings.hand_over) return std::make_unique<OnDemand>(std::move(segmenter));
  AsyncSegmenterOptions options;
  options.hand_over = *settings.hand_over;
  return std::make_unique<InThread>(std::move(segmenter), options);
}

/// Tells whether the folder could be used if masks might be missing.
bool would_do_without(const PluginSettings& settings) {
  if (settings.mask_folder.empty()) return false;
  try {
    std::vector<int> unused;
    return make_source(settings, true, unused) != nullptr;
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

}  // namespace

PluginMasks::PluginMasks(const PluginSettings& settings)
    : origin_(settings.place_of(settings.source()) + ": "),
      remedy_(remedy_of(settings)),
      continues_without_masks_(settings.missing_masks == "keep"),
      dynamic_classes_(settings.filter.mask_culler.dynamic_classes) {
  try {
    source_ = make_source(settings, continues_without_masks_, dynamic_classes_);
  } catch (const std::invalid_argument& error) {  // names an option of the segmenter's
    throw std::runtime_error(origin_ + without_component(error.what()));
  } catch (const std::runtime_error& error) {
    const bool helps = !continues_without_masks_ && would_do_without(settings);
    throw std::runtime_error(origin_ + error.what() + (helps ? remedy_ : ""));
  }
  if (settings.moves_masks) propagator_.emplace();
  if (settings.motion_camera) carrier_.emplace(dynamic_classes_);
}

void PluginMasks::submit(const FrameView& frame) {
  if (answered_s_ == frame.timestamp_s) answered_s_.reset();  // a new image of that time
  source_->submit(frame);
}

const FrameMasks& PluginMasks::masks_for(const FrameView& frame) {
  if (answered_s_ == frame.timestamp_s) return masks_;
  answered_s_.reset();
  masks_ = find(frame);
  if (propagator_) masks_.segmentation = propagator_->propagate(frame, masks_.segmentation);
  if (carrier_ && masks_.segmentation) {
    masks_.segmentation = carrier_->carry(frame, *std::move(masks_.segmentation));
  }
  answered_s_ = frame.timestamp_s;
  return masks_;
}

FrameMasks PluginMasks::find(const FrameView& frame) {
  try {
    return source_->masks_for(frame);
  } catch (const BrokenMask& error) {
    throw std::runtime_error(origin_ + error.what());
  } catch (const std::runtime_error& error) {
    if (!continues_without_masks_) throw std::runtime_error(origin_ + error.what() + remedy_);
    FrameMasks none;
    none.failure = origin_ + error.what();
    return none;
  }
}

}  // namespace dynfilter::detail
