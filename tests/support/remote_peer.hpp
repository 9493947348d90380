// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <nlohmann/json.hpp>
#include <zmq.hpp>

#include "dynfilter/segmenter.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

/// Parts of a reply: a header and masks. Without parts, the peer dies instead, and another starts.
using Reply = std::vector<std::string>;

/// Makes a reply as examples/remote_masks/README.md says.
inline Reply reply(std::uint64_t request, const std::vector<Instance>& instances) {
  nlohmann::json rows = nlohmann::json::array();
  std::string masks;
  for (const Instance& one : instances) {
    nlohmann::json row = {{"class_id", one.class_id}, {"score", one.score}};
    row["box"] = {one.box.x, one.box.y, one.box.width, one.box.height};
    if (!one.mask.empty()) {
      row["mask"] = {one.mask_origin.x, one.mask_origin.y, one.mask.cols, one.mask.rows};
      masks.append(one.mask.begin<char>(), one.mask.end<char>());
    }
    rows.push_back(row);
  }
  return {nlohmann::json({{"request", request}, {"instances", rows}}).dump(), masks};
}

/// Process that serves masks, played by a thread. It listens once constructed.
class RemotePeer {
 public:
  using Answer = std::function<Reply(const FrameView& frame, std::uint64_t request)>;

  RemotePeer(const std::string& address, Answer answer)
      : endpoint_(address[0] == '/' ? "ipc://" + address : address), answer_(std::move(answer)) {
    server_.emplace(endpoint_);
    endpoint_ = server_->socket.get(zmq::sockopt::last_endpoint);
    thread_ = std::thread([this] {
      while (!is_over_) {
        // The connections end before the next server listens.
        if (!answer_one(server_->socket)) server_.emplace(endpoint_);
      }
    });
  }
  ~RemotePeer() {
    is_over_ = true;
    thread_.join();
  }

  /// Returns its address, also if it was given as tcp://127.0.0.1:*.
  const std::string& address() const { return endpoint_; }

 private:
  struct Server {
    explicit Server(const std::string& endpoint) {
      socket.set(zmq::sockopt::linger, 0);
      socket.set(zmq::sockopt::rcvtimeo, 10);
      socket.bind(endpoint);
    }
    zmq::context_t context;
    zmq::socket_t socket{context, zmq::socket_type::rep};
  };

  /// Returns false if it dies.
  bool answer_one(zmq::socket_t& socket) {
    zmq::message_t header, pixels;
    if (!socket.recv(header) || !socket.recv(pixels)) return true;
    const auto json = nlohmann::json::parse(header.to_string());
    FrameView frame;
    frame.id = json.at("frame_id");
    frame.timestamp_s = json.at("timestamp_s");
    frame.image = cv::Mat(json.at("height"), json.at("width"),
                          json.at("channels") == 1 ? CV_8UC1 : CV_8UC3, pixels.data());
    EXPECT_EQ(pixels.size(), frame.image.total() * frame.image.elemSize());
    const Reply parts = answer_(frame, json.at("request"));
    for (const std::string& part : parts) {
      const bool is_last = &part == &parts.back();
      socket.send(zmq::buffer(part), is_last ? zmq::send_flags::none : zmq::send_flags::sndmore);
    }
    return !parts.empty();
  }

  std::string endpoint_;
  Answer answer_;
  std::optional<Server> server_;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

/// Answers with the masks of a segmenter.
inline RemotePeer::Answer answer_by(Segmenter& segmenter) {
  return [&](const FrameView& frame, std::uint64_t request) {
    return reply(request, segmenter.segment(frame).instances);
  };
}

}  // namespace dynfilter::testing
