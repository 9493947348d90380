// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_REMOTE_SEGMENTER_HPP
#define DYNFILTER_SEGMENTERS_REMOTE_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <filesystem>
#include <functional>
#include <memory>

#include "dynfilter/segmenter.hpp"

namespace dynfilter {
namespace detail {
class RemoteChannel;
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
  /// Ends a call early: once it returns true, the call fails. A waiting call asks at least ten
  /// times a second, in its own thread. Empty: no call ends early.
  std::function<bool()> stop;
};

/// Gets the instances of a frame from another process on this machine, which may run any network in
/// any language. The frame goes through a Unix domain socket, and the instances come back. The
/// other process is the server and listens; examples/remote_masks is one in Python, and its
/// README.md defines the protocol. Linux only; on other systems the library is built without it.
///
/// Either side may start first, die and come back; a call that fails leaves the segmenter usable.
/// No call takes longer than `timeout_s`. The server works on one frame at a time: if its reply is
/// late, the following call waits for it, discards it, and sends its own frame. So a network that
/// is slower than `timeout_s` never answers in time: allow it more time and run it beside tracking.
/// A reply that is 60 s late is lost. The server must run as the same user (SO_PEERCRED).
///
/// segment() throws std::runtime_error that begins with the socket's path, if nobody listens, time
/// is up, `stop` returns true, the connection is lost, the server reports an error, or its reply
/// violates the protocol (at most 1000 instances, masks inside the image, 64 MiB). It throws
/// std::invalid_argument for an image that is neither CV_8UC1 nor CV_8UC3, has a side above 16384
/// or more than 2^25 pixels. No signal (SIGPIPE) is raised, and none ends a call early.
///
/// One thread at a time may use a segmenter; between fork() and exec(), only one of the processes.
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

  std::unique_ptr<detail::RemoteChannel> channel_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_REMOTE_SEGMENTER_HPP
