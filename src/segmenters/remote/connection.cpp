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

#include <cerrno>
#include <cstring>
#include <system_error>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail::remote {
namespace {

/// Memory allocated ahead of the bytes received: a mere announcement gets no more.
constexpr std::size_t receive_step_bytes = std::size_t{1} << 20U;

[[noreturn]] void fail(const char* what) {
  throw ConnectionError(concatenate(what, ": ", std::generic_category().message(errno)));
}

/// Sleeps until the socket is ready for `events` or closed.
void wait_for(int socket, short events, const Deadline& deadline) {
  using std::chrono::milliseconds;
  while (true) {
    const auto left = std::chrono::duration_cast<milliseconds>(deadline.left()) + milliseconds(1);
    pollfd entry{socket, events, 0};
    const int ready = poll(&entry, 1, static_cast<int>(left.count()));
    if (ready > 0) return;
    if (ready < 0 && errno != EINTR) fail("cannot wait");
    if (deadline.has_passed()) throw TimeIsUp("time is up");
  }
}

/// Limits the time of connect(), which waits while the listener's queue is full. poll() cannot wait
/// for that, so the socket blocks until it is connected.
void limit_connect(int socket, const Deadline& deadline) {
  using std::chrono::microseconds;
  const auto left =
      std::chrono::duration_cast<microseconds>(deadline.left()) + microseconds(1);  // 0: no limit
  timeval timeout{};
  timeout.tv_sec = static_cast<std::time_t>(left.count() / 1000000);
  timeout.tv_usec = static_cast<suseconds_t>(left.count() % 1000000);
  if (setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout) != 0) {
    fail("cannot set a socket's option");
  }
}

/// Refuses a listener of another user, whom the folder's permissions may have let in.
void require_same_user(int socket) {
  ucred other{};
  socklen_t size = sizeof other;
  if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &other, &size) != 0) {
    fail("cannot read the listening process's user");
  }
  if (other.uid != geteuid()) {
    throw ConnectionError(concatenate("the listening process belongs to user ", other.uid,
                                      "; want user ", geteuid(), ", this process's user"));
  }
}

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

Connection::Connection() : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  if (socket_ < 0) fail("cannot make a socket");
}

Connection::~Connection() { ::close(socket_); }

bool Connection::connect(const std::string& path, const Deadline& deadline) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  limit_connect(socket_, deadline);
  while (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    if (errno == ENOENT || errno == ECONNREFUSED) return false;
    if (errno != EINTR && errno != EAGAIN) fail("cannot connect");
    if (deadline.has_passed()) throw TimeIsUp("time is up: the other side accepts no connection");
    limit_connect(socket_, deadline);
  }
  require_same_user(socket_);
  const int flags = fcntl(socket_, F_GETFL);
  if (flags < 0 || fcntl(socket_, F_SETFL, flags | O_NONBLOCK) != 0) {
    fail("cannot set a socket's flags");
  }
  return true;
}

bool Connection::is_closed() const {
  std::uint8_t byte = 0;
  const ssize_t got = recv(socket_, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
  return got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
}

/// Calls `transfer` until `done` is `size`; false if the other side has closed the connection.
template <class Transfer>
bool Connection::move_bytes(std::size_t size, std::size_t& done, short events,
                            const Deadline& deadline, Transfer transfer) {
  while (done < size) {
    const ssize_t moved = transfer(done, size - done);
    if (moved > 0) {
      done += static_cast<std::size_t>(moved);
      // Also if bytes flow without a pause, so that nothing ever waits.
      if (done < size && deadline.has_passed()) throw TimeIsUp("time is up");
    } else if (moved == 0 || errno == EPIPE || errno == ECONNRESET) {
      return false;
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      wait_for(socket_, events, deadline);
    } else if (errno != EINTR) {
      fail("the connection fails");
    }
  }
  return true;
}

void Connection::send(const std::vector<std::uint8_t>& head, const cv::Mat& image,
                      const Deadline& deadline) {
  const auto send_all = [&](const std::uint8_t* bytes, std::size_t size) {
    std::size_t sent = 0;
    return move_bytes(size, sent, POLLOUT, deadline, [&](std::size_t done, std::size_t left) {
      // Prevents SIGPIPE, which would end a host that does not handle it.
      return ::send(socket_, bytes + done, left, MSG_NOSIGNAL);
    });
  };
  if (send_all(head.data(), head.size())) send_all(image.data, image.total() * image.elemSize());
}

Message Connection::receive(const Deadline& deadline) {
  receive_bytes(reinterpret_cast<std::uint8_t*>(&header_), sizeof header_, header_received_,
                deadline);
  require_reply(header_);
  while (payload_received_ < header_.payload_bytes) {
    payload_.resize(
        std::min<std::size_t>(header_.payload_bytes, payload_received_ + receive_step_bytes));
    receive_bytes(payload_.data(), payload_.size(), payload_received_, deadline);
  }
  header_received_ = payload_received_ = 0;
  return {header_, std::exchange(payload_, {})};
}

/// Receives the rest of `size` bytes; `received` counts those that have arrived.
void Connection::receive_bytes(std::uint8_t* bytes, std::size_t size, std::size_t& received,
                               const Deadline& deadline) {
  if (move_bytes(size, received, POLLIN, deadline, [&](std::size_t done, std::size_t left) {
        return recv(socket_, bytes + done, left, 0);
      })) {
    return;
  }
  throw ConnectionError(
      header_received_ == 0
          ? "the other side has closed the connection"
          : "the other side has closed the connection in the middle of a message");
}

}  // namespace dynfilter::detail::remote
