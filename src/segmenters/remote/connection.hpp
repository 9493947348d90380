// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_REMOTE_CONNECTION_HPP
#define DYNFILTER_SRC_SEGMENTERS_REMOTE_CONNECTION_HPP

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

/// The connection could not be made, or is of no use any more. The message lacks the path.
class ConnectionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Time was up. A reply that is half received may be received further.
class TimeIsUp : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();
  int number() const { return number_; }

 private:
  int number_;
};

/// Whether a path fits into a socket's address.
bool is_socket_path(const std::string& path);

struct Message {
  Header header;
  std::vector<std::uint8_t> payload;
};

/// A connection to the process that listens on a Unix domain socket.
class Connection {
 public:
  /// Connects, and makes sure that the listener is of this process's user. Empty where nobody
  /// listens: no such file, or nobody behind it. Throws ConnectionError for what is no socket, may
  /// not be opened or is another user's, and TimeIsUp.
  static std::optional<Connection> to(const std::string& path, const Deadline& deadline);

  /// Whether the other side has closed it, and nothing that it sent is left to be read. Does not
  /// wait.
  bool is_over();

  /// Sends the bytes and then the pixels of the images, which must be continuous. False where the
  /// other side has closed the connection meanwhile; what it said before may still be received.
  /// Throws TimeIsUp, after which the connection is of no use, for part of the message may be sent.
  bool send(const std::vector<std::uint8_t>& head, const std::vector<cv::Mat>& images,
            const Deadline& deadline);

  /// The next message. After TimeIsUp another call goes on where this one stopped. Throws
  /// ProtocolError for a header that is no reply's, ConnectionError where the other side has closed
  /// the connection.
  Message receive(const Deadline& deadline);

 private:
  explicit Connection(Descriptor socket) : socket_(std::move(socket)) {}

  bool send_bytes(const std::uint8_t* bytes, std::size_t size, const Deadline& deadline);
  void receive_bytes(std::uint8_t* bytes, std::size_t size, std::size_t& received,
                     const Deadline& deadline);

  Descriptor socket_;
  // The message that is being received.
  std::uint8_t header_[header_bytes] = {};
  std::size_t header_received_ = 0;
  std::vector<std::uint8_t> payload_;
  std::size_t payload_received_ = 0;
};

}  // namespace dynfilter::detail::remote

#endif  // DYNFILTER_SRC_SEGMENTERS_REMOTE_CONNECTION_HPP
