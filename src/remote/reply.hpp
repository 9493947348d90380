// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/instance.hpp"

/// What a reply of another process may say. examples/remote_masks/README.md states it for writers.
namespace dynfilter::detail::remote {

using Json = nlohmann::json;

constexpr std::size_t max_reply_bytes = std::size_t{64} << 20U;  // each part: memory of a reply
constexpr std::size_t max_header_bytes = std::size_t{1} << 20U;  // read, it takes 20 times as much
constexpr std::size_t max_instances = 1000;                      // time of the filter
constexpr std::size_t max_error_bytes = 4096;                    // length of a line in a log
constexpr int max_box_coordinate_px = 1 << 20;                   // their sums must fit into an int
constexpr int max_int = std::numeric_limits<int>::max();

/// Says why a frame has no masks.
struct Failure : std::runtime_error {
  Failure(const std::string& why, bool keeps) : std::runtime_error(why), keeps_connection(keeps) {}
  bool keeps_connection;
};

template <class... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  throw Failure(concatenate("malformed reply: ", parts...), false);
}

/// Reads a number within bounds; the conversion of another would be undefined.
inline double number_in(const Json& value, const std::string& name, double low, double high) {
  const double number = value.get<double>();
  if (!(number >= low && number <= high)) refuse(name, " ", number, "; want ", low, " to ", high);
  return number;
}

inline int whole_in(const Json& value, const std::string& name, int low = -max_int,
                    int high = max_int) {
  const double number = number_in(value, name, low, high);
  if (number != std::floor(number)) refuse(name, " ", number, "; want a whole number");
  return static_cast<int>(number);
}

inline cv::Rect rectangle_of(const Json& value, const std::string& name) {
  constexpr int most = max_box_coordinate_px;
  if (value.size() != 4) refuse(name, " of ", value.size(), " numbers; want x, y, width, height");
  return {whole_in(value.at(0), name, -most, most), whole_in(value.at(1), name, -most, most),
          whole_in(value.at(2), name, 0, most), whole_in(value.at(3), name, 0, most)};
}

/// Reads an instance, and takes its mask from the begin of `masks`.
inline Instance instance_of(const Json& row, const std::string& name, cv::Size image,
                            std::string_view& masks) {
  const auto has = [&](const char* key) { return row.find(key) != row.end(); };
  Instance instance;
  instance.class_id = whole_in(row.value("class_id", Json(0)), "class_id" + name);
  instance.score = static_cast<float>(number_in(row.value("score", Json(1)), "score" + name, 0, 1));
  if (has("track_id")) instance.track_id = whole_in(row["track_id"], "track_id" + name);
  if (has("mask")) {
    const cv::Rect place = rectangle_of(row["mask"], "mask" + name);
    if (place.empty() || clip(place, image) != place ||
        static_cast<std::size_t>(place.area()) > masks.size()) {
      refuse("mask", name, " of ", size_name(place.size()), " at ", place.x, ",", place.y,
             "; want it in the image of ", size_name(image), " and in ", masks.size(), " bytes");
    }
    instance.box = place;
    instance.mask_origin = place.tl();
    instance.mask.create(place.size(), CV_8UC1);
    std::memcpy(instance.mask.data, masks.data(), instance.mask.total());
    masks.remove_prefix(instance.mask.total());
  }
  if (has("box")) instance.box = rectangle_of(row["box"], "box" + name);
  return instance;
}

/// Returns the text on one line: control characters become blanks.
inline std::string line_of(std::string text) {
  text.resize(std::min(text.size(), max_error_bytes));
  const auto is_control = [](unsigned char code) { return code < 0x20 || code == 0x7f; };
  std::replace_if(text.begin(), text.end(), is_control, ' ');
  return text;
}

/// Reads the reply to a request with an image of this size: its header, JSON, and its masks, one
/// after the other. Throws Failure for an error that it reports, and for what it may not say.
inline std::vector<Instance> read_reply(std::string_view header, std::string_view masks,
                                        std::uint64_t request, cv::Size image) {
  if (header.size() > max_header_bytes) refuse("a header of ", header.size(), " bytes");
  try {
    const auto reply = Json::parse(header.begin(), header.end());
    if (reply.at("request") != request) refuse("to another request than ", request);
    if (reply.contains("error")) {
      throw Failure("the other side has failed: " + line_of(reply.at("error")), true);
    }
    const Json& rows = reply.at("instances");
    if (!rows.is_array() || rows.size() > max_instances) {
      refuse(rows.size(), " instances; want an array of at most ", max_instances);
    }
    std::vector<Instance> instances;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      instances.push_back(instance_of(rows[i], concatenate(" of instance ", i), image, masks));
    }
    if (!masks.empty()) refuse(masks.size(), " bytes after the last mask");
    return instances;
  } catch (const Json::exception& error) {  // no JSON, a missing name, or another type
    refuse(line_of(error.what()));
  }
}

}  // namespace dynfilter::detail::remote
