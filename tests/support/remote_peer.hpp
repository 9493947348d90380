// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <mutex>

#include "support/remote_messages.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

/// Plain blocking socket calls for the peer.
class PeerSocket {
 public:
  explicit PeerSocket(int descriptor) : descriptor_(descriptor) {}
  PeerSocket(PeerSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  PeerSocket& operator=(PeerSocket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  ~PeerSocket() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

  /// Listens at the path, after removing any file there.
  static PeerSocket listening(const std::filesystem::path& path, int queue = 4) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    ::unlink(path.c_str());
    PeerSocket socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (::bind(socket.descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(socket.descriptor_, queue) != 0) {
      throw std::runtime_error("cannot listen at " + path.string());
    }
    return socket;
  }

  int descriptor() const { return descriptor_; }
  bool is_open() const { return descriptor_ >= 0; }
  PeerSocket accepted() const { return PeerSocket(::accept(descriptor_, nullptr, nullptr)); }
  void wake() const { ::shutdown(descriptor_, SHUT_RDWR); }

  /// Returns false if the library's side has closed the connection.
  bool send(const Bytes& bytes) const {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t now =
          ::send(descriptor_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (now <= 0) return false;
      sent += static_cast<std::size_t>(now);
    }
    return true;
  }

  std::optional<Bytes> receive(std::size_t size) const {
    Bytes bytes(size);
    for (std::size_t got = 0; got < size;) {
      const ssize_t now = ::recv(descriptor_, bytes.data() + got, size - got, 0);
      if (now <= 0) return std::nullopt;
      got += static_cast<std::size_t>(now);
    }
    return bytes;
  }

 private:
  int descriptor_;
};

/// Frame as the peer receives it.
struct ReceivedFrame {
  std::uint64_t request = 0;
  std::uint64_t id = 0;
  double timestamp_s = 0;
  cv::Mat image;
};

inline std::optional<ReceivedFrame> receive_frame(const PeerSocket& socket) {
  const std::optional<Bytes> header = socket.receive(24);
  if (!header) return std::nullopt;
  const std::optional<Bytes> payload = socket.receive(number_at<std::uint32_t>(*header, 8));
  if (!payload) return std::nullopt;
  ReceivedFrame frame;
  frame.request = number_at<std::uint64_t>(*header, 16);
  frame.id = number_at<std::uint64_t>(*payload, 0);
  frame.timestamp_s = number_at<double>(*payload, 8);
  const cv::Size size(number_at<int>(*payload, 16), number_at<int>(*payload, 20));
  frame.image.create(size, CV_8UC((*payload)[24]));
  const std::size_t pixels = frame.image.total() * frame.image.elemSize();
  const bool is_plain = std::all_of(payload->begin() + 25, payload->begin() + 40,
                                    [](std::uint8_t reserved) { return reserved == 0; });
  if (payload->size() != 40 + pixels || !is_plain) throw std::runtime_error("another frame");
  std::memcpy(frame.image.data, payload->data() + 40, pixels);
  return frame;
}

/// Peer in a thread: accepts one connection after the other and answers frames by `answer`, which
/// returns false to hang up. It listens once constructed; its destructor closes all sockets but
/// leaves the socket's file.
class RemotePeer {
 public:
  using Answer = std::function<bool(const PeerSocket&, const ReceivedFrame&)>;

  RemotePeer(const std::filesystem::path& path, Answer answer)
      : listener_(PeerSocket::listening(path)),
        answer_(std::move(answer)),
        thread_([this] { run(); }) {}
  ~RemotePeer() {
    {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
      listener_.wake();
      if (connection_) connection_->wake();
    }
    thread_.join();
  }

  /// Number of connections accepted so far.
  int connections() const { return connections_; }

 private:
  void run() {
    while (take_connection()) {
      while (const auto frame = receive_frame(*connection_)) {
        if (!answer_(*connection_, *frame)) break;
      }
      const std::lock_guard lock(mutex_);
      connection_.reset();
    }
  }

  bool take_connection() {
    PeerSocket socket = listener_.accepted();
    const std::lock_guard lock(mutex_);
    if (is_over_ || !socket.is_open()) return false;
    connection_.emplace(std::move(socket));
    ++connections_;
    return true;
  }

  PeerSocket listener_;
  Answer answer_;
  std::mutex mutex_;
  bool is_over_ = false;
  std::atomic<int> connections_{0};
  std::optional<PeerSocket> connection_;
  std::thread thread_;
};

}  // namespace dynfilter::testing
