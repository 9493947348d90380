// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "outlines.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "io/file_error.hpp"
#include "io/frame_names.hpp"
#include "io/image_file.hpp"
#include "io/text_table.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Returns the lengths of COCO's compressed runs: numbers of 5 bits a letter, from the fourth on as
/// differences to the last but one. Throws std::invalid_argument for other text.
std::vector<std::uint32_t> decompressed(const std::string& text) {
  std::vector<std::uint32_t> runs;
  for (std::size_t i = 0; i < text.size();) {
    std::int64_t value = 0;
    int bits = 0x20;
    for (int shift = 0; (bits & 0x20) != 0; shift += 5) {
      bits = i < text.size() ? text[i++] - '0' : -1;
      if (bits < 0 || bits > 63 || shift > 30) throw std::invalid_argument("counts: no RLE");
      value += std::int64_t{bits & 0x1F} << shift;
      if ((bits & 0x30) == 0x10) value -= std::int64_t{1} << (shift + 5);  // a negative number
    }
    if (runs.size() > 2) value += runs[runs.size() - 2];
    if (value < 0 || value > 1 << 28) throw std::invalid_argument("counts: a run out of range");
    runs.push_back(static_cast<std::uint32_t>(value));
  }
  return runs;
}

/// Adds the shape that COCO's "segmentation" has: an object of runs, or a list of polygons.
void add_shape(const json& shape, Outline& outline) {
  if (shape.is_object()) {
    const json& counts = shape.at("counts");
    outline.run_size = {shape.at("size").at(1).get<int>(), shape.at("size").at(0).get<int>()};
    outline.runs = counts.is_string() ? decompressed(counts.get_ref<const std::string&>())
                                      : counts.get<std::vector<std::uint32_t>>();
    return;
  }
  for (const json& flat : shape) {
    std::vector<cv::Point2d>& polygon = outline.polygons.emplace_back();
    for (std::size_t i = 1; i < flat.size(); i += 2) {
      polygon.emplace_back(flat.at(i - 1).get<double>(), flat.at(i).get<double>());
    }
  }
}

/// Returns how YOLO counts a class of COCO's, whose ids run from 1 to 90 with gaps.
std::string yolo_class(std::int64_t id) {
  const int gaps[] = {12, 26, 29, 30, 45, 66, 68, 69, 71, 83};
  return std::to_string(
      std::max<std::int64_t>(0, id - 1 - (std::lower_bound(gaps, gaps + 10, id) - gaps)));
}

/// Returns an image's name without folder and extension; times have a point, too.
std::string stem_of(const json& name) {
  const fs::path file = fs::path(name.get<std::string>()).filename();
  return (detail::is_image_name(file.string()) ? file.stem() : file).string();
}

Outlines outlines_of(const json& root) {
  Outlines outlines;
  std::map<json, std::pair<std::string, cv::Size2d>> images;  // by id
  std::map<json, std::string> names;                          // of categories, by id
  if (root.is_object()) {
    for (const json& image : root.at("images")) {
      const std::string stem = stem_of(image.at("file_name"));
      images[image.at("id")] = {stem, {image.value("width", 0.0), image.value("height", 0.0)}};
      outlines[stem];
    }
    for (const json& category : root.value("categories", json::array())) {
      names[category.at("id")] = category.at("name").get<std::string>();
    }
  }
  for (const json& one : root.is_object() ? root.at("annotations") : root) {
    Outline outline;
    const json &image = one.at("image_id"), &category = one.at("category_id");
    const auto name = names.find(category);
    const auto listed = images.find(image);
    outline.label = name != names.end() ? name->second : yolo_class(category.get<std::int64_t>());
    outline.score = std::clamp(one.value("score", 1.0F), 0.0F, 1.0F);
    if (one.contains("segmentation")) add_shape(one["segmentation"], outline);
    const auto box = one.value("bbox", std::vector<double>());
    if (box.size() == 4) outline.box = {box[0], box[1], box[2], box[3]};
    std::string stem = image.is_string() ? stem_of(image) : image.dump();
    if (listed != images.end()) std::tie(stem, outline.unit) = listed->second;
    outlines[stem].push_back(std::move(outline));
  }
  return outlines;
}

/// Returns the mask of runs, which go down the columns.
cv::Mat unrolled(const Outline& outline, cv::Size frame, const fs::path& file) {
  const cv::Size size = outline.run_size;
  detail::require_bounded(size, frame, file);
  const auto total = std::accumulate(outline.runs.begin(), outline.runs.end(), std::uint64_t{0});
  if (size.empty() || total != static_cast<std::uint64_t>(size.area())) {
    detail::throw_file_error(file, detail::concatenate("runs of ", total, " pixels in an image of ",
                                                       detail::size_name(size),
                                                       "; want as many; size is height, width"));
  }
  cv::Mat columns(size.width, size.height, CV_8UC1);
  std::uint8_t* pixel = columns.data;
  std::uint8_t value = 0;
  for (const std::uint32_t run : outline.runs) {
    pixel = std::fill_n(pixel, run, value);
    value = static_cast<std::uint8_t>(255 - value);
  }
  return detail::fitted(columns.t(), frame, file, "the frame", "");
}

}  // namespace

Outlines read_coco(const fs::path& file) {
  const auto is_shallow = [](int depth, json::parse_event_t, const json&) {
    if (depth > 100) throw std::invalid_argument("it nests too deeply");
    return true;
  };
  detail::require_regular_file(file);
  try {
    std::ifstream stream(file, std::ios::binary);
    return outlines_of(json::parse(stream, is_shallow));
  } catch (const json::exception& error) {
    const bool is_text = dynamic_cast<const json::parse_error*>(&error) != nullptr;
    detail::throw_file_error(file, std::string("holds no masks in COCO's form: ") + error.what() +
                                       (is_text ? ": a comma too many, or cut off?" : ""));
  } catch (const std::invalid_argument& error) {
    detail::throw_file_error(file, error.what());
  }
}

std::vector<Outline> read_yolo_labels(const fs::path& file) {
  detail::require_regular_file(file);
  detail::TableReader table(file, " ");
  std::vector<Outline> outlines;
  while (table.next()) {
    table.require_columns(5, "class and polygon, or class, centre and size of a box");
    Outline& outline = outlines.emplace_back();
    outline.label = std::to_string(table.integer(0, "class", 0));
    outline.unit = {1, 1};
    std::vector<double> n;
    for (std::size_t i = 1; i < table.columns(); ++i) {
      n.push_back(table.number(i, "coordinate"));
      if (std::abs(n.back() - 0.5) <= 1) continue;
      table.fail("coordinate: got " + table.text(i) + "; want 0 to 1, shares of the image");
    }
    if (n.size() % 2 != 0) {
      outline.score = static_cast<float>(std::clamp(n.back(), 0.0, 1.0));
      n.pop_back();
    }
    if (n.size() == 4) {
      outline.box = {n[0] - n[2] / 2, n[1] - n[3] / 2, n[2], n[3]};
      continue;
    }
    outline.polygons.emplace_back();
    for (std::size_t i = 1; i < n.size(); i += 2) {
      outline.polygons[0].emplace_back(n[i - 1], n[i]);
    }
  }
  return outlines;
}

Instance instance_of(const Outline& outline, cv::Size frame, double& room, const fs::path& file) {
  const cv::Rect whole({0, 0}, frame);
  const cv::Size2d unit = outline.unit.area() > 0 ? outline.unit : cv::Size2d(frame);
  if (unit.area() > 1) detail::require_shape(unit, frame, file, "the frame", "");
  const auto pixels = [&](const cv::Point2d& at, double shift) {
    const auto scaled = [&](double x, double size, int of) {
      return static_cast<int>(std::lround(std::clamp(x / size * of - shift, -1e5, 1e5)));
    };
    return cv::Point(scaled(at.x, unit.width, frame.width),
                     scaled(at.y, unit.height, frame.height));
  };
  cv::Rect extent = outline.runs.empty() ? cv::Rect() : whole;
  std::vector<std::vector<cv::Point>> polygons;
  for (const auto& polygon : outline.polygons) {
    if (polygon.size() < 3) continue;
    std::vector<cv::Point>& points = polygons.emplace_back();
    for (const cv::Point2d& at : polygon) points.push_back(pixels(at, 0.5));  // centres of pixels
    extent |= cv::boundingRect(points);
  }
  extent &= whole;
  room -= std::max(double{1} * extent.area(),
                   double{1} * outline.run_size.width * outline.run_size.height);
  if (room < 0) {
    detail::throw_file_error(file,
                             "its objects have more than 64 times the pixels of an image of " +
                                 detail::size_name(frame));
  }
  Instance instance;
  if (!outline.runs.empty()) {
    instance = Instance::from_image_mask(unrolled(outline, frame, file), 0, 1);
  } else if (!extent.empty()) {
    cv::Mat mask(extent.size(), CV_8UC1, cv::Scalar(0));
    for (const auto& points : polygons) {  // one by one: their union
      cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{points}, 255, cv::LINE_8, 0,
                   -extent.tl());
    }
    instance = Instance::from_box_mask(mask, extent, 0, 1);
  }
  if (!outline.box.empty()) {
    instance.box |= cv::Rect(pixels(outline.box.tl(), 0), pixels(outline.box.br(), 0)) & whole;
  } else if (!instance.box.empty()) {
    instance.box = detail::clip_grown(instance.box, 20, 20, frame);
  }
  instance.score = outline.score;
  instance.image_size = frame;
  return instance;
}

}  // namespace dynfilter::tools
