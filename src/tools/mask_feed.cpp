// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "mask_feed.hpp"

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "interruption.hpp"
#include "io/hand_over_names.hpp"
#include "number_options.hpp"

namespace dynfilter::tools {
namespace {

using Clock = FramePace::Clock;

std::chrono::nanoseconds seconds(double seconds) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(seconds * 1e9));
}

/// Takes at least one period for each frame, to imitate a slower network.
class SlowedSegmenter final : public Segmenter {
 public:
  SlowedSegmenter(std::unique_ptr<Segmenter> segmenter, double rate_hz)
      : segmenter_(std::move(segmenter)), period_(seconds(1 / rate_hz)) {}

 private:
  Segmentation do_segment(const FrameView& frame) override {
    const Clock::time_point end = Clock::now() + period_;
    Segmentation result = segmenter_->segment(frame);
    interruptible_sleep_until(end);
    return result;
  }

  std::unique_ptr<Segmenter> segmenter_;
  std::chrono::nanoseconds period_;
};

}  // namespace

/// Passes the masks that were read with the frames to a thread, which hands them over.
class MaskFeed::SourceMasks final : public Segmenter {
 public:
  void remember(const SourceFrame& frame) {
    const std::lock_guard<std::mutex> lock(mutex_);
    masks_[frame.frame.id] = frame.masks.value();
  }

 private:
  Segmentation do_segment(const FrameView& frame) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto own = masks_.find(frame.id);
    Segmentation masks = std::move(own->second);
    masks_.erase(masks_.begin(), std::next(own));  // frames arrive in order or not at all
    return masks;
  }

  std::mutex mutex_;
  std::map<std::uint64_t, Segmentation> masks_;
};

void add_mask_feed_options(CLI::App& command, MaskFeedOptions& options) {
  add_segmenter_options(command, options.segmenter);
  CLI::Option* hand_over =
      command
          .add_option(
              "--async", options.hand_over,
              "make the masks in a thread while tracking goes on, with frames at the pace of\n"
              "their times (jumps are skipped): wait for each frame's masks, limited_wait for\n"
              "--max-wait at most, take the latest, or drop masks that are not ready")
          ->check(CLI::IsMember(detail::hand_over_names()));
  command
      .add_option("--max-wait", options.max_wait_s,
                  detail::concatenate("longest wait of --async limited_wait, seconds [",
                                      AsyncSegmenterOptions().max_wait_s, "]"))
      ->needs(hand_over)
      ->check(real_number(0, 3600));
  command
      .add_option_function<std::string>(
          "--most-wait",
          [](const std::string&) {
            throw CLI::ValidationError("--most-wait is called --max-wait now");
          })
      ->group("");  // hidden
  command
      .add_option("--hz", options.rate_hz,
                  "slow the masks down to this many frames a second [no limit]")
      ->needs(hand_over)
      ->check(real_number(0.001, 1000));
  command
      .add_option("--missing-masks", options.missing_masks,
                  "if the segmenter fails at a frame: error ends the run, keep goes on, and the\n"
                  "frame keeps its features; with --async every run goes on")
      ->check(CLI::IsMember({"error", "keep"}))
      ->excludes(hand_over)
      ->capture_default_str();
}

MaskFeed::MaskFeed(const MaskFeedOptions& options, const FrameSource& source)
    : options_(options), source_name_(source.masks_name()) {
  const bool by_thread = !options.hand_over.empty();
  if (!options.segmenter.is_unset()) segmenter_ = options.segmenter.make();
  if (options.missing_masks == "keep" && !segmenter_) {
    throw std::runtime_error("--missing-masks keep is for a segmenter, --model or --remote");
  }
  if (options.max_wait_s && options.hand_over != "limited_wait") {
    throw std::runtime_error("--max-wait is for --async limited_wait");
  }
  if (!by_thread) return;
  if (!segmenter_) {
    if (source_name_.empty()) {
      throw std::runtime_error("--async needs masks, but the sequence has none; name a segmenter");
    }
    auto masks = std::make_unique<SourceMasks>();
    source_masks_ = masks.get();
    segmenter_ = std::move(masks);
  }
  if (options.rate_hz > 0) {
    segmenter_ = std::make_unique<SlowedSegmenter>(std::move(segmenter_), options.rate_hz);
  }
  AsyncSegmenterOptions thread;
  thread.hand_over = detail::hand_over_of(options.hand_over);
  thread.max_wait_s = options.max_wait_s.value_or(thread.max_wait_s);
  thread_ = std::make_unique<AsyncSegmenter>(std::move(segmenter_), thread);
}

MaskFeed::~MaskFeed() = default;

std::string MaskFeed::name() const {
  std::string name = options_.segmenter.is_unset() ? source_name_ : options_.segmenter.name();
  if (!thread_) return name;
  name += ", by a thread (" + options_.hand_over;
  if (options_.rate_hz > 0) {
    char text[32];
    std::snprintf(text, sizeof text, ", %g Hz", options_.rate_hz);
    name += text;
  }
  return name + ")";
}

void MaskFeed::submit(const SourceFrame& frame) {
  if (!thread_) return;
  interruptible_sleep_until(pace_.due(frame.frame.timestamp_s, Clock::now()));
  if (source_masks_) source_masks_->remember(frame);
  thread_->submit(frame.frame);
}

std::optional<Segmentation> MaskFeed::collect(const SourceFrame& frame) {
  if (!thread_ && !segmenter_) return frame.masks;
  try {
    if (thread_) return thread_->collect(frame.frame.id);
    return segmenter_->segment(frame.frame);
  } catch (const std::runtime_error& error) {
    if (!thread_ && options_.missing_masks != "keep") {
      throw std::runtime_error(std::string(error.what()) +
                               " (nothing was written; --missing-masks keep goes on without)");
    }
    if (++failures_ == 1) first_failure_ = error.what();
    return {};
  }
}

std::string MaskFeed::report() const {
  std::string report;
  if (failures_ > 0) {
    report = "frames without masks, because the segmenter failed: " + std::to_string(failures_) +
             ", the first with: " + first_failure_;
  }
  if (!thread_) return report;
  if (!report.empty()) report += "\n";
  const AsyncSegmenterStatistics counts = thread_->statistics();
  char text[160];
  std::snprintf(text, sizeof text,
                "masks made in a thread: %llu of %llu frames, %.1f ms each, %llu failed",
                static_cast<unsigned long long>(counts.segmented),
                static_cast<unsigned long long>(counts.submitted), 1e3 * counts.mean_inference_s(),
                static_cast<unsigned long long>(counts.failed));
  report += text;
  if (pace_.cuts() == 0) return report;
  std::snprintf(text, sizeof text,
                "\njumps in time that were skipped (more than %g s, or back): %zu",
                FramePace::max_gap_s, pace_.cuts());
  return report + text;
}

}  // namespace dynfilter::tools
