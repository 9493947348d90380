// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "protocol.hpp"

namespace dynfilter::detail::remote {

using Clock = std::chrono::steady_clock;  // unaffected when somebody sets the time of day

inline Clock::duration duration_of(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// The end of the time for one call.
class Deadline {
 public:
  explicit Deadline(double seconds_from_now) : end_(Clock::now() + duration_of(seconds_from_now)) {}

  bool has_passed() const { return Clock::now() >= end_; }

  Clock::duration left() const { return std::max(end_ - Clock::now(), Clock::duration::zero()); }

 private:
  Clock::time_point end_;
};

/// Reports that time is up. A half-received reply may be received further.
class TimeIsUp : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Tells whether a path fits into a socket's address.
bool is_socket_path(const std::string& path);

/// Returns why nobody listens at a path, and what to do about it.
std::string why_nobody_listens(const std::string& path);

struct Message {
  Header header;
  std::vector<std::uint8_t> payload;
};

/// A connection to the process that listens on a Unix domain socket. Every function throws
/// ConnectionError if it fails or the other side has closed the connection, and TimeIsUp.
class Connection {
 public:
  /// Makes a socket, which is not connected.
  Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection();

  /// Connects, once, and checks that the listener runs as this process's user; false if no process
  /// listens: the file is missing, is no socket, or no process is behind it.
  bool connect(const std::string& path, const Deadline& deadline);

  /// Tells whether the other side has closed the connection and nothing it sent is left to read.
  /// Does not wait.
  bool is_closed() const;

  /// Sends the bytes and then the pixels of the image, which must be continuous. If the other side
  /// closes the connection meanwhile, receive() still gets what it sent before. After TimeIsUp the
  /// connection is useless, because a part of the message may have been sent.
  void send(const std::vector<std::uint8_t>& head, const cv::Mat& image, const Deadline& deadline);

  /// Receives the next message. After TimeIsUp, another call continues where this one stopped.
  /// Throws ProtocolError for a header that is no reply's.
  Message receive(const Deadline& deadline);

 private:
  template <class Transfer>
  bool move_bytes(std::size_t size, std::size_t& done, short events, const Deadline& deadline,
                  Transfer transfer);
  void receive_bytes(std::uint8_t* bytes, std::size_t size, std::size_t& received,
                     const Deadline& deadline);

  int socket_;
  // The message being received.
  Header header_ = {};
  std::size_t header_received_ = 0;
  std::vector<std::uint8_t> payload_;
  std::size_t payload_received_ = 0;
};

}  // namespace dynfilter::detail::remote
