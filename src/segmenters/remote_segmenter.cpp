// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/remote_segmenter.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "io/file_error.hpp"
#include "remote_protocol.hpp"

namespace dynfilter {
namespace detail::remote {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;  // unaffected when somebody sets the time of day

/// Age at which a missing reply is lost. Until then the server, which may be loading its network,
/// gets no other frame.
constexpr std::chrono::seconds lost_after{60};

/// Memory allocated ahead of the bytes received: a mere announcement gets no more.
constexpr std::size_t receive_step_bytes = std::size_t{1} << 20U;

Clock::duration duration_of(double seconds) {
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

[[noreturn]] void fail(const char* what) {
  throw ConnectionError(concatenate(what, ": ", std::generic_category().message(errno)));
}

/// Tells whether a path fits into a socket's address.
bool is_socket_path(const std::string& path) {
  return !path.empty() && path.size() < sizeof(sockaddr_un::sun_path) &&
         path.find('\0') == std::string::npos;
}

/// Returns why nobody listens at a path, and what to do about it.
std::string why_nobody_listens(const std::string& path) {
  struct stat entry {};
  if (stat(path.c_str(), &entry) != 0) {
    return "there is no such socket; is the server started with this path?";
  }
  if (!S_ISSOCK(entry.st_mode)) return "is no socket";
  return "no process listens there; the server that made this socket has ended";
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

struct Message {
  Header header;
  std::vector<std::uint8_t> payload;
};

/// A connection to the process that listens on a Unix domain socket. Every function throws
/// ConnectionError if it fails or the other side has closed the connection, and TimeIsUp.
class Connection {
 public:
  /// Makes a socket, which is not connected.
  Connection() : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    if (socket_ < 0) fail("cannot make a socket");
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { ::close(socket_); }

  /// Connects, once, and checks that the listener runs as this process's user; false if no process
  /// listens: the file is missing, is no socket, or no process is behind it.
  bool connect(const std::string& path, const Deadline& deadline) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.data(), path.size());
    while (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      if (errno == ENOENT || errno == ECONNREFUSED) return false;
      if (errno != EINTR && errno != EAGAIN) fail("cannot connect");
      if (deadline.has_passed()) throw TimeIsUp("time is up: the other side accepts no connection");
      // The listener's queue is full, which poll() cannot wait for.
      std::this_thread::sleep_for(std::min<Clock::duration>(milliseconds(1), deadline.left()));
    }
    require_same_user(socket_);
    return true;
  }

  /// Tells whether the other side has closed the connection and nothing it sent is left to read.
  /// Does not wait.
  bool is_closed() const {
    std::uint8_t byte = 0;
    const ssize_t got = recv(socket_, &byte, 1, MSG_PEEK);
    return got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
  }

  /// Sends the bytes and then the pixels of the image, which must be continuous. If the other side
  /// closes the connection meanwhile, receive() still gets what it sent before. After TimeIsUp the
  /// connection is useless, because a part of the message may have been sent.
  void send(const std::vector<std::uint8_t>& head, const cv::Mat& image, const Deadline& deadline) {
    const auto send_all = [&](const std::uint8_t* bytes, std::size_t size) {
      std::size_t sent = 0;
      return move_bytes(size, sent, POLLOUT, deadline, [&](std::size_t done, std::size_t left) {
        // Prevents SIGPIPE, which would end a host that does not handle it.
        return ::send(socket_, bytes + done, left, MSG_NOSIGNAL);
      });
    };
    if (send_all(head.data(), head.size())) send_all(image.data, image.total() * image.elemSize());
  }

  /// Receives the next message. After TimeIsUp, another call continues where this one stopped.
  /// Throws ProtocolError for a header that is no reply's.
  Message receive(const Deadline& deadline) {
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

 private:
  /// Calls `transfer` until `done` is `size`; false if the other side has closed the connection.
  template <class Transfer>
  bool move_bytes(std::size_t size, std::size_t& done, short events, const Deadline& deadline,
                  Transfer transfer) {
    while (done < size) {
      const ssize_t moved = transfer(done, size - done);
      if (moved > 0) {
        done += static_cast<std::size_t>(moved);
        // Also if bytes flow without a pause, so that nothing ever waits.
        if (done < size && deadline.has_passed()) throw TimeIsUp("time is up");
      } else if (moved == 0 || errno == EPIPE || errno == ECONNRESET) {
        return false;
      } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
        wait_for(events, deadline);
      } else if (errno != EINTR) {
        fail("the connection fails");
      }
    }
    return true;
  }

  /// Receives the rest of `size` bytes; `received` counts those that have arrived.
  void receive_bytes(std::uint8_t* bytes, std::size_t size, std::size_t& received,
                     const Deadline& deadline) {
    const auto transfer = [&](std::size_t done, std::size_t left) {
      return recv(socket_, bytes + done, left, 0);
    };
    if (move_bytes(size, received, POLLIN, deadline, transfer)) return;
    const char* where = header_received_ == 0 ? "" : " in the middle of a message";
    throw ConnectionError(concatenate("the other side has closed the connection", where));
  }

  /// Sleeps until the socket is ready for `events` or closed.
  void wait_for(short events, const Deadline& deadline) const {
    while (true) {
      const auto left = std::chrono::duration_cast<milliseconds>(deadline.left()) + milliseconds(1);
      pollfd entry{socket_, events, 0};
      const int ready = poll(&entry, 1, static_cast<int>(left.count()));
      if (ready > 0) return;
      if (ready < 0 && errno != EINTR) fail("cannot wait");
      if (deadline.has_passed()) throw TimeIsUp("time is up");
    }
  }

  int socket_;
  // The message being received.
  Header header_ = {};
  std::size_t header_received_ = 0;
  std::vector<std::uint8_t> payload_;
  std::size_t payload_received_ = 0;
};

}  // namespace

/// Sends frames and receives replies, over connections that come and go.
class Channel {
 public:
  Channel(const std::filesystem::path& path, const RemoteSegmenterOptions& options)
      : path_(path.string()), options_(options) {
    const std::string absolute = std::filesystem::absolute(path).string();
    address_ = is_socket_path(absolute) ? absolute : path_;
  }

  Segmentation exchange(const FrameView& frame) {
    const Deadline deadline(options_.timeout_s);
    try {
      const Message reply = ask(frame, deadline);
      if (reply.header.type == MessageType::error) {
        // The connection is still good: the other side failed in its work, not in the protocol.
        throw_file_error(path_, concatenate("the other side has failed at frame ", frame.id, ": ",
                                            decode_error(reply.payload)));
      }
      return decode_instances(reply.payload, frame.id, frame.timestamp_s, frame.image.size());
    } catch (const ConnectionError& error) {
      drop_connection();
      throw_file_error(path_, error.what());
    } catch (const TimeIsUp& error) {
      // Keeps the connection in a state in which the next call can continue.
      throw_file_error(path_, concatenate("no masks of frame ", frame.id, " within ",
                                          options_.timeout_s, " s: ", error.what()));
    }
  }

 private:
  /// The frame that the other side has received but not answered.
  struct InFlight {
    std::uint64_t request;
    std::uint64_t frame_id;
    Clock::time_point sent_at;
  };

  /// Sends the frame and receives the reply. If the connection is lost meanwhile, and the options
  /// allow for waiting, sends the frame once more, to whoever listens then: a frame that ends the
  /// other process ends the next one too.
  Message ask(const FrameView& frame, const Deadline& deadline) {
    std::string loss;
    while (true) {
      try {
        prepare_connection(deadline);
      } catch (const TimeIsUp& error) {
        throw loss.empty() ? error : TimeIsUp(concatenate(loss, ", and then ", error.what()));
      }
      try {
        send(frame, deadline);
        return receive_reply(deadline);
      } catch (const ProtocolError&) {
        throw;
      } catch (const ConnectionError& error) {
        if (options_.retry_interval_s == 0 || !loss.empty()) throw;
        loss = error.what();
        drop_connection();
      }
    }
  }

  /// Provides a connection with nothing in flight.
  void prepare_connection(const Deadline& deadline) {
    if (in_flight_ && Clock::now() - in_flight_->sent_at >= lost_after) {
      drop_connection();
    }
    if (in_flight_ && !skip_late_reply(deadline)) drop_connection();
    // The other side may have left since the last call, and returned.
    if (connection_ && connection_->is_closed()) drop_connection();
    if (!connection_) connect(deadline);
  }

  void connect(const Deadline& deadline) {
    const auto interval = duration_of(options_.retry_interval_s);
    while (true) {
      auto connection = std::make_unique<Connection>();
      if (connection->connect(address_, deadline)) {
        connection_ = std::move(connection);
        return;
      }
      if (interval == Clock::duration::zero()) {
        throw ConnectionError(why_nobody_listens(path_));
      }
      if (deadline.has_passed()) throw TimeIsUp(why_nobody_listens(path_));
      std::this_thread::sleep_for(std::min(interval, deadline.left()));
    }
  }

  /// Receives and ignores the reply to a frame of an earlier call. Returns whether the connection
  /// is still good.
  bool skip_late_reply(const Deadline& deadline) {
    try {
      receive_reply(deadline);
      return true;
    } catch (const TimeIsUp&) {
      throw TimeIsUp(concatenate("the other side is still busy with frame ", in_flight_->frame_id));
    } catch (const ConnectionError&) {
      return false;
    }
  }

  void drop_connection() {
    connection_.reset();
    in_flight_.reset();
  }

  void send(const FrameView& frame, const Deadline& deadline) {
    const std::uint64_t request = ++requests_;
    const cv::Mat image = frame.image.isContinuous() ? frame.image : frame.image.clone();
    try {
      connection_->send(encode_frame_head(request, frame), image, deadline);
    } catch (const TimeIsUp&) {
      drop_connection();  // the message is incomplete
      throw TimeIsUp("the other side does not take the image");
    }
    in_flight_ = InFlight{request, frame.id, Clock::now()};
  }

  /// Receives the reply to the frame in flight, and clears that.
  Message receive_reply(const Deadline& deadline) {
    Message reply = connection_->receive(deadline);
    if (reply.header.type == MessageType::error && reply.header.request == 0) {
      throw ConnectionError("the other side refuses the connection: " +
                            decode_error(reply.payload));
    }
    if (reply.header.request != in_flight_->request) {
      throw ProtocolError(concatenate("malformed reply: to request ", reply.header.request,
                                      "; want request ", in_flight_->request));
    }
    in_flight_.reset();
    return reply;
  }

  std::string path_;     // as it was given, for errors
  std::string address_;  // the same place after chdir(), where the system takes so long a path
  RemoteSegmenterOptions options_;
  std::unique_ptr<Connection> connection_;
  std::optional<InFlight> in_flight_;  // on this connection
  std::uint64_t requests_ = 0;
};

}  // namespace detail::remote

RemoteSegmenter::RemoteSegmenter(const std::filesystem::path& socket_path,
                                 const RemoteSegmenterOptions& options) {
  constexpr detail::OptionCheck require("RemoteSegmenter");
  if (!detail::remote::is_socket_path(socket_path.string())) {
    detail::throw_misuse("RemoteSegmenter", "the path '" + socket_path.string() + "'",
                         "the path of a socket, of 1 to 107 bytes");
  }
  require(options.timeout_s > 0 && options.timeout_s <= 3600, "timeout_s", options.timeout_s,
          "above 0, up to 3600");
  require(options.retry_interval_s >= 0 && options.retry_interval_s <= 3600, "retry_interval_s",
          options.retry_interval_s, "0 to 3600");
  channel_ = std::make_unique<detail::remote::Channel>(socket_path, options);
}

RemoteSegmenter::RemoteSegmenter(RemoteSegmenter&&) noexcept = default;
RemoteSegmenter& RemoteSegmenter::operator=(RemoteSegmenter&&) noexcept = default;
RemoteSegmenter::~RemoteSegmenter() = default;

Segmentation RemoteSegmenter::do_segment(const FrameView& frame) {
  detail::remote::require_sendable(frame.image, "RemoteSegmenter");
  return channel_->exchange(frame);
}

}  // namespace dynfilter
