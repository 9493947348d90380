// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "segmenter_options.hpp"

#include <stdexcept>

#include "dynfilter/detail/errors.hpp"
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

Segmentation masks_of(Segmenter& segmenter, FrameView frame, std::size_t i, std::size_t frames) {
  frame.depth.release();  // without a camera file, its unit is not known
  try {
    return segmenter.segment(frame);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(detail::concatenate(error.what(), " (nothing was written; ", i, " of ",
                                                 frames, " frames had masks)"));
  }
}

}  // namespace dynfilter::tools
