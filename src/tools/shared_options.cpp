// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "shared_options.hpp"

#include <stdexcept>

#include "dynfilter/detail/errors.hpp"
#ifdef DYNFILTER_HAS_NETWORKS
#include "dynfilter/networks/network_segmenter.hpp"
#endif
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
#include "dynfilter/remote/remote_segmenter.hpp"
#endif

namespace dynfilter::tools {

std::string SegmenterSpec::name() const {
  if (!remote.empty()) return "process at " + remote;
  return model.string();
}

std::unique_ptr<Segmenter> SegmenterSpec::make() const {
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  if (!remote.empty()) {
    RemoteSegmenterOptions options;
    options.timeout_s = remote_timeout_s;
    options.retry_interval_s = 0.1;  // either side may start first
    return std::make_unique<RemoteSegmenter>(remote, options);
  }
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  if (!model.empty()) {
    NetworkOptions options;
    options.device = device;
    return std::make_unique<NetworkSegmenter>(model, options);
  }
#endif
  throw std::runtime_error("this dynfilter was built without " +
                           std::string(remote.empty() ? "networks" : "ZeroMQ (cppzmq-dev)"));
}

void add_segmenter_options(CLI::App& command, SegmenterSpec& segmenter) {
  CLI::Option* remote = command.add_option(
      "--remote", segmenter.remote,
      "use the masks of the process that listens at this address, see examples/remote_masks");
  command
      .add_option("--remote-timeout", segmenter.remote_timeout_s,
                  "longest wait for the masks of a frame, seconds")
      ->needs(remote)
      ->check(CLI::Range(0.001, 3600.0))
      ->capture_default_str();
#ifdef DYNFILTER_HAS_NETWORKS
  CLI::Option* model =
      command.add_option("--model", segmenter.model, "use the masks of this network, an ONNX file");
  model->excludes(remote);
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
