// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "connection.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <system_error>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail::remote {
namespace {

/// Memory allocated ahead of the bytes received: a mere announcement gets no more.
constexpr std::size_t receive_step_bytes = std::size_t{1} << 20U;

[[noreturn]] void fail(const char* what, int error) {
  throw ConnectionError(concatenate(what, ": ", std::generic_category().message(error)));
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

/// Sleeps until the socket is ready for `events` or closed.
void wait_for(const Descriptor& socket, short events, const Deadline& deadline) {
  using std::chrono::nanoseconds;
  using std::chrono::seconds;
  while (true) {
    const auto left = deadline.left();
    const auto whole = std::chrono::duration_cast<seconds>(left);
    timespec timeout{};
    timeout.tv_sec = static_cast<std::time_t>(whole.count());
    timeout.tv_nsec = static_cast<long>(nanoseconds(left - whole).count());
    pollfd entry{socket.number(), events, 0};
    const int ready = ppoll(&entry, 1, &timeout, nullptr);
    if (ready > 0) return;
    if (ready < 0 && errno != EINTR) fail("cannot wait", errno);
    if (deadline.has_passed()) throw TimeIsUp("time is up");
  }
}

/// Limits the time of connect(), which waits while the listener's queue is full. poll() cannot wait
/// for that, so the socket blocks until it is connected.
void limit_connect(const Descriptor& socket, const Deadline& deadline) {
  using std::chrono::microseconds;
  // Zero would mean no limit.
  const auto left =
      std::max(std::chrono::duration_cast<microseconds>(deadline.left()), microseconds(1));
  timeval timeout{};
  timeout.tv_sec = static_cast<std::time_t>(left.count() / 1000000);
  timeout.tv_usec = static_cast<suseconds_t>(left.count() % 1000000);
  if (setsockopt(socket.number(), SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout) != 0) {
    fail("cannot set a socket's option", errno);
  }
}

/// Connects the socket; false if no process listens.
bool connect_to(const Descriptor& socket, const std::string& path, const Deadline& deadline) {
  const sockaddr_un address = address_of(path);
  while (true) {
    limit_connect(socket, deadline);
    if (connect(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) ==
        0) {
      return true;
    }
    switch (errno) {
      case ENOENT:
      case ECONNREFUSED:
        return false;
      case EINTR:
      case EAGAIN:
        if (!deadline.has_passed()) break;
        throw TimeIsUp("time is up: the other side accepts no connection");
      default:
        fail("cannot connect", errno);
    }
  }
}

void stop_waiting(const Descriptor& socket) {
  const int flags = fcntl(socket.number(), F_GETFL);
  if (flags < 0 || fcntl(socket.number(), F_SETFL, flags | O_NONBLOCK) != 0) {
    fail("cannot set a socket's flags", errno);
  }
}

/// Refuses a listener of another user, whom the folder's permissions may have let in.
void require_same_user(const Descriptor& socket) {
  ucred other{};
  socklen_t size = sizeof other;
  if (getsockopt(socket.number(), SOL_SOCKET, SO_PEERCRED, &other, &size) != 0) {
    fail("cannot read the listening process's user", errno);
  }
  if (other.uid != geteuid()) {
    throw ConnectionError(concatenate("the listening process belongs to user ", other.uid,
                                      "; want user ", geteuid(), ", this process's user"));
  }
}

/// Throws when time is up, even if bytes flow without a pause, so that nothing ever waits.
void require_time(std::size_t bytes_left, const Deadline& deadline) {
  if (bytes_left > 0 && deadline.has_passed()) throw TimeIsUp("time is up");
}

bool is_closed_error(int error) { return error == EPIPE || error == ECONNRESET; }

}  // namespace

bool is_socket_path(const std::string& path) {
  return !path.empty() && path.size() < sizeof(sockaddr_un::sun_path) &&
         path.find('\0') == std::string::npos;
}

std::string why_nobody_listens(const std::string& path) {
  struct stat entry {};
  if (stat(path.c_str(), &entry) != 0) {
    return "there is no such socket; is the server started with this path?";
  }
  if (!S_ISSOCK(entry.st_mode)) return "is no socket";
  return "no process listens there; the server that made this socket has ended";
}

std::optional<Connection> Connection::to(const std::string& path, const Deadline& deadline) {
  Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (socket.number() < 0) fail("cannot make a socket", errno);
  if (!connect_to(socket, path, deadline)) return std::nullopt;
  require_same_user(socket);
  stop_waiting(socket);
  return Connection(std::move(socket));
}

bool Connection::is_closed() {
  std::uint8_t byte = 0;
  const ssize_t got = recv(socket_.number(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
  return got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
}

bool Connection::send(const std::vector<std::uint8_t>& head, const cv::Mat& image,
                      const Deadline& deadline) {
  return send_bytes(head.data(), head.size(), deadline) &&
         send_bytes(image.data, image.total() * image.elemSize(), deadline);
}

bool Connection::send_bytes(const std::uint8_t* bytes, std::size_t size, const Deadline& deadline) {
  while (size > 0) {
    // Prevents SIGPIPE, which would end a host that does not handle it.
    const ssize_t sent = ::send(socket_.number(), bytes, size, MSG_NOSIGNAL);
    if (sent >= 0) {
      bytes += sent;
      size -= static_cast<std::size_t>(sent);
      require_time(size, deadline);
    } else if (is_closed_error(errno)) {
      return false;
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      wait_for(socket_, POLLOUT, deadline);
    } else if (errno != EINTR) {
      fail("cannot send", errno);
    }
  }
  return true;
}

Message Connection::receive(const Deadline& deadline) {
  receive_bytes(header_, header_bytes, header_received_, deadline);
  Message message;
  message.header = decode_header(header_);
  while (payload_received_ < message.header.payload_bytes) {
    payload_.resize(std::min<std::size_t>(message.header.payload_bytes,
                                          payload_received_ + receive_step_bytes));
    receive_bytes(payload_.data(), payload_.size(), payload_received_, deadline);
  }
  message.payload = std::exchange(payload_, {});
  header_received_ = payload_received_ = 0;
  return message;
}

/// Receives the rest of `size` bytes; `received` counts those that have arrived.
void Connection::receive_bytes(std::uint8_t* bytes, std::size_t size, std::size_t& received,
                               const Deadline& deadline) {
  while (received < size) {
    const ssize_t got = recv(socket_.number(), bytes + received, size - received, 0);
    if (got > 0) {
      received += static_cast<std::size_t>(got);
      require_time(size - received, deadline);
    } else if (got == 0 || is_closed_error(errno)) {
      throw ConnectionError(
          header_received_ == 0
              ? "the other side has closed the connection"
              : "the other side has closed the connection in the middle of a message");
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      wait_for(socket_, POLLIN, deadline);
    } else if (errno != EINTR) {
      fail("cannot receive", errno);
    }
  }
}

}  // namespace dynfilter::detail::remote
