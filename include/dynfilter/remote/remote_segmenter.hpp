// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <memory>
#include <string>

#include "dynfilter/segmenter.hpp"

namespace dynfilter {

/// Options of RemoteSegmenter.
struct RemoteSegmenterOptions {
  /// Longest duration of a call of segment(), seconds. Above 0, at most 3600.
  double timeout_s = 1.0;
  /// Pause before another attempt to connect while nobody listens, seconds. 0 = the call fails at
  /// once, which suits a tracker; a program that can wait for its masks may use 0.1. Above 0, a
  /// frame whose connection is lost before its reply has come is sent once more.
  double retry_interval_s = 0;
};

/// Gets the instances of a frame by ZeroMQ from another process on this machine, which may run any
/// network in any language: examples/remote_masks has one in Python, and the messages. Either side
/// may start first, die and come back. The server works on one frame at a time: the call after a
/// late reply waits for it and discards it. segment() throws std::runtime_error that begins with
/// the address, if nobody listens, time is up, the connection is lost, the server reports an error,
/// or its reply is malformed; and std::invalid_argument for an image that is no CV_8UC1 or CV_8UC3
/// or has more than 2^25 pixels. It is then still usable. For one thread; a child of fork() may go
/// on.
class RemoteSegmenter final : public Segmenter {
 public:
  /// Takes PATH, "ipc://PATH" or "tcp://127.0.0.1:PORT"; connects later. A server at a path must
  /// run as this process's user; at a port any user's may. Throws std::invalid_argument for options
  /// out of range, another address, or a path above 107 bytes when it is absolute.
  explicit RemoteSegmenter(const std::string& address, const RemoteSegmenterOptions& options = {});
  /// Moves the connection; the source may only be destroyed or assigned to.
  RemoteSegmenter(RemoteSegmenter&&) noexcept;
  RemoteSegmenter& operator=(RemoteSegmenter&&) noexcept;  ///< As the constructor.
  /// Closes the connection at once, even during a request.
  ~RemoteSegmenter() override;

 private:
  Segmentation do_segment(const FrameView& frame) override;

  class Channel;
  std::unique_ptr<Channel> channel_;
};

}  // namespace dynfilter
