// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_REMOTE_SEGMENTER_HPP
#define DYNFILTER_SEGMENTERS_REMOTE_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <filesystem>
#include <memory>

#include "dynfilter/segmenter.hpp"

namespace dynfilter {
namespace detail {
class RemoteChannel;
}

struct RemoteSegmenterOptions {
  /// The longest that a call of segment() waits for the other side: connecting, sending and
  /// receiving together. Above 0, at most 3600.
  double timeout_s = 1.0;
  /// While nobody listens: how long to wait before another attempt to connect, within `timeout_s`.
  /// 0 = the call fails at once, which suits a tracker; a program that can wait for its masks to
  /// start asks for 0.1 or so.
  double retry_interval_s = 0;
  /// Whether the other side gets the depth image too, where the frame has one.
  bool send_depth = false;
  /// A reply that has not come after this time is lost: the next call connects anew. Until then
  /// the other side, which may be loading its network, is sent no other frame. At least 0.
  double lost_after_s = 60;
};

/// Takes the instances of a frame from another process on this machine, in which any network in any
/// language may run: the frame goes through a Unix domain socket, the instances come back. The
/// other side listens; examples/remote_masks is one in Python, and its README.md states the
/// protocol, for others. Linux only: elsewhere the library is built without it.
///
/// Either side may start first, die and come back. The first call connects; one that finds the
/// earlier connection closed connects anew; one that fails leaves the segmenter fit for the next.
///
/// No call takes longer than `timeout_s`, apart from the time for copying what has arrived. The
/// other side works on one frame at a time and is not sent another before it has answered. Where
/// its reply is late, the following call waits for it, within its own `timeout_s`, leaves it, and
/// sends its own frame. So a network that is slower than `timeout_s` never answers in time: give it
/// more time and run it beside tracking.
///
/// Who may talk: the process that listens must be of the same user (SO_PEERCRED).
///
/// segment() throws std::runtime_error that starts with the path of the socket and says why, if
/// nobody listens, time is up, the connection is lost, the other side reports an error of its own,
/// or its reply is malformed, of another frame or image size, or beyond the limits of the protocol
/// (1000 instances, masks inside the image, 64 MiB). It throws std::invalid_argument for a frame
/// without an image, and for one that is neither CV_8UC1 nor CV_8UC3 or has a side above 16384 or
/// more than 2^25 pixels. Memory for a reply grows with what has arrived, not with what is
/// announced. No signal is raised (SIGPIPE) and none ends a call early.
///
/// One thread at a time may use a segmenter. Between fork() and exec() only one of the processes.
class RemoteSegmenter final : public Segmenter {
 public:
  /// Connects to nobody yet. Throws std::invalid_argument for options out of range and for a path
  /// that is empty or longer than a socket's may be (107 bytes).
  explicit RemoteSegmenter(const std::filesystem::path& socket_path,
                           const RemoteSegmenterOptions& options = {});
  RemoteSegmenter(RemoteSegmenter&&) noexcept;
  RemoteSegmenter& operator=(RemoteSegmenter&&) noexcept;
  /// Closes the connection, whatever was under way.
  ~RemoteSegmenter() override;

 private:
  Segmentation do_segment(const FrameView& frame) override;

  std::unique_ptr<detail::RemoteChannel> channel_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_REMOTE_SEGMENTER_HPP
