// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "segmenter_spec.hpp"

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "interruption.hpp"
#include "number_options.hpp"

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
  InterruptibleRemote(const std::filesystem::path& socket, RemoteSegmenterOptions options)
      : segmenter_(socket, interruptible(std::move(options))) {}

 private:
  static RemoteSegmenterOptions interruptible(RemoteSegmenterOptions options) {
    options.stop = [] { return interrupting_signal() != 0; };
    return options;
  }

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
    return std::make_unique<InterruptibleRemote>(remote, std::move(options));
  }
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  if (!model.empty()) return make_network_segmenter(model);
#endif
  throw std::runtime_error("this build lacks the chosen segmenter");
}

std::string segmenter_options() {
  std::vector<std::string> names;
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  names.emplace_back("--remote SOCKET");
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  names.emplace_back("--model FILE");
#endif
  return CLI::detail::join(names, " or ");
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
#else
  (void)model;
#endif
#endif
}

}  // namespace dynfilter::tools
