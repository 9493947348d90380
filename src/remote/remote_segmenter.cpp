// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/remote/remote_segmenter.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <regex>
#include <thread>

#include <zmq.hpp>

#include "io/file_error.hpp"
#include "reply.hpp"

namespace dynfilter {
namespace {

using namespace detail;
using namespace detail::remote;
using Clock = std::chrono::steady_clock;  // unaffected when somebody sets the time of day
using Parts = std::vector<zmq::message_t>;

Clock::duration seconds(double number) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(number));
}

/// Returns an address for ZeroMQ. A path becomes absolute, which survives chdir().
std::string endpoint_of(const std::string& address) {
  static const std::regex tcp("tcp://127\\.0\\.0\\.1:([1-9][0-9]{0,4})");  // others need encryption
  std::smatch match;
  if (std::regex_match(address, match, tcp) && std::stoi(match[1]) <= 65535) return address;
  const std::string path = address.substr(address.rfind("ipc://", 0) == 0 ? 6 : 0);
  const auto absolute = path.empty() ? path : std::filesystem::absolute(path).string();
  if (!path.empty() && path.find("://") == std::string::npos &&
      path.find('\0') == std::string::npos && absolute.size() < sizeof(sockaddr_un::sun_path)) {
    return "ipc://" + absolute;
  }
  throw_misuse("RemoteSegmenter", "the address '" + address + "'",
               "PATH or ipc://PATH, of 1 to 107 bytes when absolute, or tcp://127.0.0.1:PORT");
}

/// Refuses a listener of another user at a path, whom the folder's rights may have let in.
void require_same_user(int socket) {
  ucred other{0, static_cast<uid_t>(-1), 0};
  socklen_t size = sizeof other;
  getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &other, &size);
  if (other.uid == geteuid()) return;
  throw Failure(concatenate("the process belongs to user ", other.uid, "; want ", geteuid()),
                false);
}

/// A socket of ZeroMQ for one connection, in a context of its own. What listens after a loss may be
/// another process: ZeroMQ does not connect again by itself.
class Connection {
 public:
  explicit Connection(const std::string& endpoint) : has_user_(endpoint[0] == 'i') {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::maxmsgsize, std::int64_t{max_reply_bytes});
    socket_.set(zmq::sockopt::reconnect_ivl, -1);
    if (zmq_socket_monitor(socket_.handle(), "inproc://news", ZMQ_EVENT_ALL) != 0) {
      throw zmq::error_t();
    }
    news_.connect("inproc://news");
    socket_.connect(endpoint);
  }

  bool is_of_this_process() const { return process_ == getpid(); }

  bool is_usable() { return is_of_this_process() && read_news() != State::over; }

  /// Waits until it is connected; false if no process listens. Fails with these words at the
  /// deadline.
  bool connect(Clock::time_point deadline, const char* late) {
    while (read_news() == State::connecting) wait(deadline, late);
    return state_ == State::open;
  }

  void send(Parts parts) {
    for (zmq::message_t& part : parts) {
      const int flags = ZMQ_DONTWAIT | (&part == &parts.back() ? 0 : ZMQ_SNDMORE);
      while (zmq_msg_send(part.handle(), socket_.handle(), flags) < 0) {
        if (errno != EINTR) throw Failure("the connection is lost", false);
      }
    }
  }

  /// Waits for a message, or fails with these words at the deadline.
  Parts receive(Clock::time_point deadline, const std::string& late) {
    while (true) {
      const bool was_over = !is_usable();  // looked at first: what came before the end counts
      Parts parts = receive_from(socket_);
      if (!parts.empty()) return parts;
      if (was_over) {
        throw Failure("the other side has closed the connection, or sent more than 64 MiB", false);
      }
      wait(deadline, late);
    }
  }

 private:
  enum class State { connecting, open, over };

  /// Returns the parts of a message that is there, or nothing.
  static Parts receive_from(zmq::socket_t& socket) {
    Parts parts;
    do {
      zmq::message_t part;
      while (zmq_msg_recv(part.handle(), socket.handle(), ZMQ_DONTWAIT) < 0) {
        if (errno != EINTR) return parts;
      }
      parts.push_back(std::move(part));
    } while (parts.back().more());
    return parts;
  }

  /// Reads what ZeroMQ says of the connection: the numbers of an event and of a file, an address.
  State read_news() {
    for (Parts news = receive_from(news_); !news.empty(); news = receive_from(news_)) {
      std::uint16_t event = 0;
      std::int32_t file = 0;
      std::memcpy(&event, news[0].data(), sizeof event);
      std::memcpy(&file, news[0].data<char>() + sizeof event, sizeof file);
      if (event == ZMQ_EVENT_CONNECTED) {
        if (has_user_) require_same_user(file);
        state_ = State::open;
      } else if (event == ZMQ_EVENT_DISCONNECTED || event == ZMQ_EVENT_CLOSED) {
        state_ = State::over;
      }
    }
    return state_;
  }

  /// Sleeps until there is a message or news.
  void wait(Clock::time_point deadline, const std::string& late) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) throw Failure(late, true);
    zmq::pollitem_t items[] = {{socket_.handle(), 0, ZMQ_POLLIN, 0},
                               {news_.handle(), 0, ZMQ_POLLIN, 0}};
    if (zmq_poll(items, 2, left.count()) < 0 && errno != EINTR) throw zmq::error_t();
  }

  pid_t process_ = getpid();
  bool has_user_;  // a PORT has none
  State state_ = State::connecting;
  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::dealer};
  zmq::socket_t news_{context_, zmq::socket_type::pair};
};

/// Makes the parts of a request: nothing, which ZeroMQ's REP wants, then the header and the image.
Parts request_of(std::uint64_t request, const FrameView& frame) {
  const cv::Mat& image = frame.image;
  Json header = {{"request", request}, {"frame_id", frame.id}, {"channels", image.channels()}};
  header.update(
      {{"timestamp_s", frame.timestamp_s}, {"height", image.rows}, {"width", image.cols}});
  Parts parts(1);
  parts.emplace_back(header.dump());
  parts.emplace_back(image.total() * image.elemSize());
  image.copyTo(cv::Mat(image.size(), image.type(), parts[2].data()));
  return parts;
}

}  // namespace

/// Sends frames and receives replies, over connections that come and go.
class RemoteSegmenter::Channel {
 public:
  Channel(const std::string& address, const RemoteSegmenterOptions& options)
      : address_(address), endpoint_(endpoint_of(address)), options_(options) {}
  ~Channel() { drop_connection(); }

  Segmentation segment(const FrameView& frame) {
    const cv::Size size = frame.image.size();
    try {
      const Parts reply = ask(frame, Clock::now() + seconds(options_.timeout_s));
      if (reply.size() != 3 || !reply[0].empty()) refuse(reply.size(), " parts; want 3");
      return {frame.id, frame.timestamp_s, size,
              read_reply(reply[1].to_string_view(), reply[2].to_string_view(), requests_, size)};
    } catch (const Failure& failure) {
      if (!failure.keeps_connection) drop_connection();
      throw_file_error(address_, concatenate("no masks of frame ", frame.id, " within ",
                                             options_.timeout_s, " s: ", failure.what()));
    } catch (const zmq::error_t& error) {
      drop_connection();
      throw_file_error(address_, concatenate("ZeroMQ has failed: ", error.what()));
    }
  }

 private:
  /// Sends the frame and receives the reply. If the connection is lost meanwhile, and the options
  /// allow for waiting, sends the frame once more, to whoever listens then: a frame that ends the
  /// other process ends the next one too.
  Parts ask(const FrameView& frame, Clock::time_point deadline) {
    for (bool is_second = false;; is_second = true) {
      prepare_connection(deadline);
      try {
        if (busy_with_) {  // ignores the reply to a frame of an earlier call
          connection_->receive(
              deadline, concatenate("the other side is still busy with frame ", *busy_with_));
        }
        connection_->send(request_of(++requests_, frame));
        busy_with_ = frame.id;
        Parts reply = connection_->receive(deadline, "time is up");
        busy_with_.reset();
        return reply;
      } catch (const Failure& failure) {
        if (failure.keeps_connection || is_second || options_.retry_interval_s == 0) throw;
        drop_connection();
      }
    }
  }

  void prepare_connection(Clock::time_point deadline) {
    // The other side may have left since the last call, and returned.
    if (connection_ && !connection_->is_usable()) drop_connection();
    if (!connection_) connection_ = std::make_unique<Connection>(endpoint_);
    const char* const nobody = "no process listens there; is the server started with this address?";
    const char* late = "time is up";
    while (!connection_->connect(deadline, late)) {
      late = nobody;
      const auto now = Clock::now();
      if (options_.retry_interval_s == 0 || now >= deadline) throw Failure(nobody, false);
      std::this_thread::sleep_until(std::min(deadline, now + seconds(options_.retry_interval_s)));
      connection_ = std::make_unique<Connection>(endpoint_);
    }
  }

  /// In a child of fork(), leaves the connection to the parent, which alone has ZeroMQ's threads.
  void drop_connection() {
    if (connection_ && !connection_->is_of_this_process()) static_cast<void>(connection_.release());
    connection_.reset();
    busy_with_.reset();
  }

  std::string address_;   // as it was given, for errors
  std::string endpoint_;  // for ZeroMQ
  RemoteSegmenterOptions options_;
  std::unique_ptr<Connection> connection_;
  std::optional<std::uint64_t> busy_with_;  // the frame sent but not answered
  std::uint64_t requests_ = 0;
};

RemoteSegmenter::RemoteSegmenter(const std::string& address,
                                 const RemoteSegmenterOptions& options) {
  constexpr OptionCheck require("RemoteSegmenter");
  require(options.timeout_s > 0 && options.timeout_s <= 3600, "timeout_s", options.timeout_s,
          "above 0, up to 3600");
  require(options.retry_interval_s >= 0 && options.retry_interval_s <= 3600, "retry_interval_s",
          options.retry_interval_s, "0 to 3600");
  channel_ = std::make_unique<Channel>(address, options);
}

RemoteSegmenter::RemoteSegmenter(RemoteSegmenter&&) noexcept = default;
RemoteSegmenter& RemoteSegmenter::operator=(RemoteSegmenter&&) noexcept = default;
RemoteSegmenter::~RemoteSegmenter() = default;

Segmentation RemoteSegmenter::do_segment(const FrameView& frame) {
  const cv::Mat& image = frame.image;
  if (image.dims != 2 || image.empty() || image.total() > 1U << 25U ||
      (image.type() != CV_8UC1 && image.type() != CV_8UC3)) {
    throw_misuse("RemoteSegmenter",
                 "an image of " + size_name(image) + " and type " + type_name(image),
                 "CV_8UC1 or CV_8UC3, of 1 to 33554432 pixels");
  }
  return channel_->segment(frame);
}

}  // namespace dynfilter
