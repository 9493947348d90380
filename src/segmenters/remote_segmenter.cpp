// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/remote_segmenter.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "io/file_error.hpp"
#include "remote/connection.hpp"
#include "remote/protocol.hpp"

namespace dynfilter {
namespace detail {

using remote::Clock;
using remote::Connection;
using remote::ConnectionError;
using remote::Deadline;
using remote::Message;
using remote::MessageType;
using remote::ProtocolError;
using remote::TimeIsUp;

/// Age at which a missing reply is lost, seconds. Until then the server, which may be loading its
/// network, gets no other frame.
constexpr double lost_after_s = 60;

/// Sends frames and receives replies, over connections that come and go.
class RemoteChannel {
 public:
  RemoteChannel(const std::filesystem::path& path, const RemoteSegmenterOptions& options)
      : path_(path.string()), options_(options) {
    const std::string absolute = std::filesystem::absolute(path).string();
    address_ = remote::is_socket_path(absolute) ? absolute : path_;
  }

  Segmentation exchange(const FrameView& frame) {
    const Deadline deadline(options_.timeout_s);
    try {
      const Message reply = ask(frame, deadline);
      if (reply.header.type == MessageType::error) {
        // The connection is still good: the other side failed in its work, not in the protocol.
        throw_file_error(path_, concatenate("the other side has failed at frame ", frame.id, ": ",
                                            remote::decode_error(reply.payload)));
      }
      return remote::decode_instances(reply.payload, frame.id, frame.timestamp_s,
                                      frame.image.size());
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
    if (in_flight_ && Clock::now() - in_flight_->sent_at >= remote::duration_of(lost_after_s)) {
      drop_connection();
    }
    if (in_flight_ && !skip_late_reply(deadline)) drop_connection();
    // The other side may have left since the last call, and returned.
    if (connection_ && connection_->is_closed()) drop_connection();
    if (!connection_) connect(deadline);
  }

  void connect(const Deadline& deadline) {
    const auto interval = remote::duration_of(options_.retry_interval_s);
    while (true) {
      auto connection = std::make_unique<Connection>();
      if (connection->connect(address_, deadline)) {
        connection_ = std::move(connection);
        return;
      }
      if (interval == Clock::duration::zero()) {
        throw ConnectionError(remote::why_nobody_listens(path_));
      }
      if (deadline.has_passed()) throw TimeIsUp(remote::why_nobody_listens(path_));
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
      connection_->send(remote::encode_frame_head(request, frame), image, deadline);
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
                            remote::decode_error(reply.payload));
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

}  // namespace detail

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
  channel_ = std::make_unique<detail::RemoteChannel>(socket_path, options);
}

RemoteSegmenter::RemoteSegmenter(RemoteSegmenter&&) noexcept = default;
RemoteSegmenter& RemoteSegmenter::operator=(RemoteSegmenter&&) noexcept = default;
RemoteSegmenter::~RemoteSegmenter() = default;

Segmentation RemoteSegmenter::do_segment(const FrameView& frame) {
  detail::remote::require_sendable(frame.image, "RemoteSegmenter");
  return channel_->exchange(frame);
}

}  // namespace dynfilter
