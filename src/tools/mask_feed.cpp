// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "mask_feed.hpp"

#include <stdexcept>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/hand_over_names.hpp"
#include "number_options.hpp"
#include "progress_bar.hpp"

#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
#include "dynfilter/segmenters/remote_segmenter.hpp"
#endif
#ifdef DYNFILTER_HAS_NETWORKS
#include "dynfilter/networks/network_segmenter.hpp"
#endif

namespace dynfilter::tools {
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
namespace {

/// Waits for another process until the user interrupts the work, and throws Interrupted then.
class InterruptibleRemote final : public Segmenter {
 public:
  InterruptibleRemote(const std::filesystem::path& socket, const RemoteSegmenterOptions& options)
      : segmenter_(socket, options) {}

 private:
  Segmentation do_segment(const FrameView& frame) override {
    try {
      return segmenter_.segment(frame);
    } catch (const std::runtime_error&) {
      throw_if_interrupted();
      throw;
    }
  }

  RemoteSegmenter segmenter_;
};

}  // namespace
#endif

std::string SegmenterSpec::name() const {
  if (!remote.empty()) return "process at " + remote.string();
  return model.string();
}

std::unique_ptr<Segmenter> SegmenterSpec::make() const {
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  if (!remote.empty()) {
    RemoteSegmenterOptions options;
    options.timeout_s = remote_timeout_s;
    options.retry_interval_s = 0.1;  // either side may start first
    options.stop = [] { return interrupting_signal() != 0; };
    return std::make_unique<InterruptibleRemote>(remote, options);
  }
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  if (!model.empty()) {
    NetworkOptions options;
    options.device = device;
    return std::make_unique<NetworkSegmenter>(model, options);
  }
#endif
  throw std::runtime_error("this build lacks the chosen segmenter");
}

std::string segmenter_options() {
#if defined(DYNFILTER_HAS_REMOTE_SEGMENTER) && defined(DYNFILTER_HAS_NETWORKS)
  return "--remote SOCKET or --model FILE";
#elif defined(DYNFILTER_HAS_REMOTE_SEGMENTER)
  return "--remote SOCKET";
#else
  return "--model FILE";
#endif
}

void add_segmenter_options([[maybe_unused]] CLI::App& command,
                           [[maybe_unused]] SegmenterSpec& segmenter) {
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  CLI::Option* remote = command.add_option(
      "--remote", segmenter.remote,
      "use the masks of the process that listens at this socket, see examples/remote_masks");
  command
      .add_option("--remote-timeout", segmenter.remote_timeout_s,
                  "longest wait for the masks of a frame, seconds")
      ->needs(remote)
      ->check(real_number(0.001, 3600))
      ->capture_default_str();
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  CLI::Option* model =
      command.add_option("--model", segmenter.model, "use the masks of this network, an ONNX file");
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  model->excludes(remote);
#endif
  command
      .add_option("--device", segmenter.device,
                  "what OpenCV runs the network on: cpu, opencl, cuda or openvino")
      ->needs(model)
      ->capture_default_str();
#endif
}

void add_mask_feed_options(CLI::App& command, MaskFeedOptions& options) {
  add_segmenter_options(command, options.segmenter);
  command
      .add_option("--async", options.hand_over,
                  "make the masks in a thread while tracking goes on, with frames at the pace of\n"
                  "their times (jumps are skipped): wait for each frame's masks, limited_wait for\n"
                  "0.03 s at most, take the latest, or drop masks that are not ready")
      ->check(CLI::IsMember(detail::hand_over_names()));
}

MaskFeed::MaskFeed(const MaskFeedOptions& options, const FrameSource& source) {
  const SegmenterSpec& segmenter = options.segmenter;
  name_ = segmenter.is_unset() ? source.masks_name() : segmenter.name();
  if (!segmenter.is_unset()) segmenter_ = segmenter.make();
  if (options.hand_over.empty()) return;
  if (!segmenter_) {
    throw std::runtime_error("--async needs a segmenter: " + segmenter_options());
  }
  AsyncSegmenterOptions thread;
  thread.hand_over = detail::hand_over_of(options.hand_over);
  thread_ = std::make_unique<AsyncSegmenter>(std::move(segmenter_), thread);
  name_ += ", by a thread (" + options.hand_over + ")";
}

void MaskFeed::submit(const FrameView& frame) {
  if (!thread_) return;
  interruptible_sleep_until(pace_.due(frame.timestamp_s, FramePace::Clock::now()));
  thread_->submit(frame);
}

std::optional<Segmentation> MaskFeed::collect(const SourceFrame& frame) {
  if (!thread_ && !segmenter_) return frame.masks;
  try {
    if (thread_) return thread_->collect(frame.frame.id);
    return segmenter_->segment(frame.frame);
  } catch (const std::runtime_error& error) {
    if (!thread_) {
      throw std::runtime_error(std::string(error.what()) +
                               " (nothing was written; --async goes on without)");
    }
    if (++failures_ == 1) first_failure_ = error.what();
    return {};
  }
}

std::string MaskFeed::report() const {
  if (!thread_) return {};
  const AsyncSegmenterStatistics counts = thread_->statistics();
  std::string report =
      detail::concatenate("masks made in a thread: ", counts.segmented, " of ", counts.submitted,
                          " frames, ", detail::fixed_decimals(1e3 * counts.mean_inference_s(), 1),
                          " ms each, ", counts.failed, " failed");
  if (failures_ > 0) {
    report +=
        detail::concatenate("\nframes without masks, because the segmenter failed: ", failures_,
                            ", the first with: ", first_failure_);
  }
  if (pace_.cuts() > 0) {
    report += detail::concatenate("\njumps in time that were skipped (more than ",
                                  FramePace::max_gap_s, " s, or back): ", pace_.cuts());
  }
  return report;
}

}  // namespace dynfilter::tools
