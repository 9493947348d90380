// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_REMOTE_SEGMENTER_HPP
#define DYNFILTER_SEGMENTERS_REMOTE_SEGMENTER_HPP

#include <filesystem>
#include <memory>

#include "dynfilter/segmenter.hpp"

namespace dynfilter {
namespace detail::remote {
class Channel;
}

/// Options of RemoteSegmenter.
struct RemoteSegmenterOptions {
  /// Longest duration of a call of segment(), seconds: connecting, sending and receiving together.
  /// Above 0, at most 3600.
  double timeout_s = 1.0;
  /// Pause before another attempt to connect while nobody listens, seconds, within `timeout_s`. 0 =
  /// the call fails at once, which suits a tracker; a program that can wait for its masks may use
  /// 0.1. Above 0, a frame whose connection is lost before its reply has come is sent once more, to
  /// the process that listens then.
  double retry_interval_s = 0;
};

/// Gets the instances of a frame from another process on this machine, which listens at a Unix
/// domain socket, may run any network in any language, and runs as the same user (SO_PEERCRED).
/// examples/remote_masks is one in Python, and its README.md defines the protocol. Linux only.
///
/// Either side may start first, die and come back. The server works on one frame at a time: the
/// call after a late reply waits for it and discards it; one that is 60 s late is lost. segment()
/// throws std::runtime_error that begins with the socket's path, if nobody listens, time is up, the
/// connection is lost, the server reports an error, or its reply violates the protocol; and
/// std::invalid_argument for an image of another type than CV_8UC1 or CV_8UC3, or above 16384 in a
/// side or 2^25 pixels. It is then still usable. For one thread, and one process of a fork().
class RemoteSegmenter final : public Segmenter {
 public:
  /// Takes the path and the options; connects later. Throws std::invalid_argument for options out
  /// of range and for a path that is empty or longer than a socket's may be (107 bytes).
  explicit RemoteSegmenter(const std::filesystem::path& socket_path,
                           const RemoteSegmenterOptions& options = {});
  /// Moves the connection; the source may only be destroyed or assigned to.
  RemoteSegmenter(RemoteSegmenter&&) noexcept;
  /// Moves the connection; the source may only be destroyed or assigned to.
  RemoteSegmenter& operator=(RemoteSegmenter&&) noexcept;
  /// Closes the connection, even during a request.
  ~RemoteSegmenter() override;

 private:
  Segmentation do_segment(const FrameView& frame) override;

  std::unique_ptr<detail::remote::Channel> channel_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_REMOTE_SEGMENTER_HPP
