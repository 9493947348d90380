// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "sequence_doubts.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/instance.hpp"

namespace dynfilter::tools {
namespace {

constexpr std::size_t usual_repetitions = 3;  // a camera may repeat an image now and then
constexpr double max_rate_error = 0.1;
constexpr std::size_t looked_at = 20;  // masks that are decoded
constexpr std::size_t min_boxes = 3;
constexpr std::size_t max_labels = 64;  // a mask with more values is a soft one

bool have_equal_bytes(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code error;
  if (std::filesystem::equivalent(a, b, error)) return true;
  const auto size = std::filesystem::file_size(a, error);
  if (error || size != std::filesystem::file_size(b, error) || error) return false;
  std::ifstream first(a, std::ios::binary), second(b, std::ios::binary);
  using Bytes = std::istreambuf_iterator<char>;
  return first && second && std::equal(Bytes(first), Bytes(), Bytes(second), Bytes());
}

/// Returns the values of a mask that are not 0, or one too many if it has more than `max_labels`.
std::set<int> labels_of(const cv::Mat& mask) {
  std::set<int> labels;
  for (int y = 0; y < mask.rows && labels.size() <= max_labels; ++y) {
    int last = 0;
    for (int x = 0; x < mask.cols; ++x) {
      const int label =
          mask.depth() == CV_8U ? mask.at<std::uint8_t>(y, x) : mask.at<std::uint16_t>(y, x);
      if (label != 0 && label != last) labels.insert(label);
      last = label;
    }
  }
  return labels;
}

/// Returns the row of instances.csv for a label of a mask, as a person with the smallest box.
std::string table_row(const std::filesystem::path& file, const cv::Mat& mask, int label) {
  const Instance instance = Instance::from_image_mask(mask == label);
  const cv::Rect& box = instance.box;
  return detail::concatenate(file.stem().string(), ",", label, ",0,1,", box.x, ",", box.y, ",",
                             box.width, ",", box.height);
}

}  // namespace

std::optional<Finding> repeated_images(const RgbdSequence& sequence) {
  std::size_t repeated = 0, run = 0, longest = 0, end = 0;
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    const bool is_repeated =
        have_equal_bytes(sequence.entry(i - 1).image_path, sequence.entry(i).image_path);
    run = is_repeated ? run + 1 : 0;
    repeated += is_repeated ? 1 : 0;
    if (run > longest) {
      longest = run;
      end = i;
    }
  }
  if (longest <= usual_repetitions && repeated <= sequence.size() / 4) return std::nullopt;
  const bool has_pairs = std::filesystem::exists(sequence.folder() / "associations.txt");
  return Finding{Verdict::odd,
                 detail::concatenate(repeated, " of ", sequence.size(),
                                     " colour images are those of the frame before; the longest "
                                     "standstill has ",
                                     longest + 1, " frames, ", sequence.entry(end - longest).stem,
                                     " to ", sequence.entry(end).stem),
                 detail::concatenate("delete all but the first row of each standstill from ",
                                     has_pairs ? "associations.txt" : "rgb.txt",
                                     ": depth goes on there, and colour does not")};
}

std::optional<Finding> other_frame_rate(const RgbdSequence& sequence, double period_s) {
  const double said_hz = sequence.camera().frames_per_second;
  if (said_hz <= 0 || period_s <= 0) return std::nullopt;
  const double rate_hz = 1 / period_s;
  if (std::abs(rate_hz / said_hz - 1) <= max_rate_error) return std::nullopt;
  const double rounded_hz = rate_hz < 1 ? rate_hz : std::round(rate_hz * 10) / 10;
  return Finding{Verdict::odd,
                 detail::concatenate("the camera file says ", said_hz,
                                     " frames a second, the time stamps say ", rounded_hz),
                 detail::concatenate("write `Camera.fps: ", rounded_hz,
                                     "` into the camera file: ORB-SLAM counts frames by it")};
}

std::optional<Finding> labels_without_table(const std::filesystem::path& masks) {
  if (std::filesystem::exists(masks / "instances.csv")) return std::nullopt;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(masks)) {
    if (entry.path().extension() == ".png") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  const std::size_t count = std::min(looked_at, files.size());
  for (std::size_t k = 0; k < count; ++k) {
    const auto& file = files[k * files.size() / count];
    const cv::Mat mask = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
    if (mask.type() != CV_8UC1 && mask.type() != CV_16UC1) continue;
    const std::set<int> labels = labels_of(mask);
    if (labels.size() > max_labels) {
      return Finding{
          Verdict::odd,
          detail::concatenate("masks/", file.filename().string(), " has more than ", max_labels,
                              " grey levels, and all but 0 count as on the object"),
          "threshold the masks: 0 = background, 255 = on the object"};
    }
    if (labels.size() < 2) continue;
    return Finding{
        Verdict::odd,
        detail::concatenate("masks/ has no instances.csv, but ", file.filename().string(), " has ",
                            labels.size(), " labels up to ", *labels.rbegin(),
                            ": all of them count as persons"),
        "write masks/instances.csv with a row for each label of each mask:\n"
        "           frame,instance,class_id,score,x,y,width,height\n"
        "           " +
            table_row(file, mask, *labels.begin())};
  }
  return std::nullopt;
}

bool has_box_as_corners(const Instance& instance) {
  cv::Rect object = cv::boundingRect(instance.mask);
  object.x += instance.mask_origin.x;
  object.y += instance.mask_origin.y;
  const cv::Rect& box = instance.box;
  const cv::Rect as_corners(box.x, box.y, box.width - box.x, box.height - box.y);
  const auto overlap = [&](const cv::Rect& other) {
    if (other.width <= 0 || other.height <= 0) return 0.0;
    const double common = (object & other).area();
    return common / (object.area() + other.area() - common);
  };
  return !object.empty() && overlap(as_corners) > overlap(box);
}

std::optional<Finding> boxes_as_corners(std::size_t corners, std::size_t boxes) {
  if (boxes < min_boxes || 2 * corners <= boxes) return std::nullopt;
  return Finding{Verdict::odd,
                 detail::concatenate(corners, " of ", boxes,
                                     " boxes fit their masks better as x1, y1, x2, y2"),
                 "write x, y, width, height into masks/instances.csv: upper left corner and size"};
}

}  // namespace dynfilter::tools
