// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_REMOTE_CONNECTION_HPP
#define DYNFILTER_SRC_SEGMENTERS_REMOTE_CONNECTION_HPP

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "deadline.hpp"
#include "protocol.hpp"

namespace dynfilter::detail::remote {

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int number() const { return number_; }

 private:
  int number_;
};

/// Reports a connection that could not be made or is useless now. The message lacks the path.
class ConnectionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reports that time is up. A half-received reply may be received further.
class TimeIsUp : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Tells whether a path fits into a socket's address.
bool is_socket_path(const std::string& path);

/// Returns why Connection::to found no listener, and what to do about it: the path does not exist,
/// is no socket, or is one that a process has left.
std::string why_nobody_listens(const std::string& path);

struct Message {
  Header header;
  std::vector<std::uint8_t> payload;
};

/// A connection to the process that listens on a Unix domain socket.
class Connection {
 public:
  /// Connects and checks that the listener runs as this process's user. std::nullopt if no process
  /// listens: the file is missing, is no socket, or no process is behind it. Throws ConnectionError
  /// if the path may not be opened or is another user's, and TimeIsUp.
  static std::optional<Connection> to(const std::string& path, const Deadline& deadline);

  /// Tells whether the other side has closed the connection and nothing it sent is left to read.
  /// Does not wait.
  bool is_closed();

  /// Sends the bytes and then the pixels of the image, which must be continuous. Returns false if
  /// the other side has closed the connection meanwhile; what it sent before may still be received.
  /// Throws TimeIsUp; the connection is useless then, because a part of the message may have been
  /// sent.
  bool send(const std::vector<std::uint8_t>& head, const cv::Mat& image, const Deadline& deadline);

  /// Receives the next message. After TimeIsUp, another call continues where this one stopped.
  /// Throws ProtocolError for a header that is no reply's, and ConnectionError if the other side
  /// has closed the connection.
  Message receive(const Deadline& deadline);

 private:
  explicit Connection(Descriptor socket) : socket_(std::move(socket)) {}

  bool send_bytes(const std::uint8_t* bytes, std::size_t size, const Deadline& deadline);
  void receive_bytes(std::uint8_t* bytes, std::size_t size, std::size_t& received,
                     const Deadline& deadline);

  Descriptor socket_;
  // The message being received.
  std::uint8_t header_[header_bytes] = {};
  std::size_t header_received_ = 0;
  std::vector<std::uint8_t> payload_;
  std::size_t payload_received_ = 0;
};

}  // namespace dynfilter::detail::remote

#endif  // DYNFILTER_SRC_SEGMENTERS_REMOTE_CONNECTION_HPP
