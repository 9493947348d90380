// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Decodes arbitrary outputs of networks, and makes masks of what is found: either they are refused
// with a std::runtime_error, or all detections and instances are as promised.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynfilter/segmentation.hpp"
#include "fuzz/report.hpp"
#include "networks/input_placement.hpp"
#include "networks/mask_assembly.hpp"
#include "networks/semantic_decoder.hpp"
#include "networks/yolact_decoder.hpp"
#include "networks/yolo_decoder.hpp"
#include "support/byte_source.hpp"

namespace dynfilter::testing {
namespace {

using namespace dynfilter::detail;

float odd_number(ByteSource& source) {
  using Limits = std::numeric_limits<float>;
  const float odd[] = {Limits::quiet_NaN(),
                       Limits::infinity(),
                       -Limits::infinity(),
                       Limits::max(),
                       Limits::lowest(),
                       Limits::denorm_min(),
                       0.0F,
                       -0.0F,
                       1.0F,
                       1e9F,
                       -1e9F,
                       88.8F};
  return odd[source.between(0, 11)];
}

cv::Mat tensor(ByteSource& source, std::vector<int> shape, float largest, int odd_share) {
  if (source.chance(2)) shape[1 % shape.size()] += source.between(-1, 1);
  for (int& side : shape) side = std::max(side, 1);
  cv::Mat made(static_cast<int>(shape.size()), shape.data(), CV_32F);
  auto* const values = made.ptr<float>();
  for (std::size_t i = 0; i < made.total(); ++i) {
    values[i] = source.chance(odd_share) ? odd_number(source)
                                         : largest * static_cast<float>(source.byte()) / 255;
  }
  return made;
}

std::string check(const std::vector<Detection>& detections, const DetectionOptions& options) {
  if (detections.size() > static_cast<std::size_t>(options.max_detections)) return "too many";
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const Detection& one = detections[i];
    if (!(one.score > options.score_threshold && one.score <= 1)) return "a score out of range";
    if (i > 0 && one.score > detections[i - 1].score) return "the scores do not fall";
    if (!one.box.has_area()) return "a box without area";
    if (!options.wants(one.class_id)) return "an unwanted class";
    for (const float coefficient : one.coefficients) {
      if (!std::isfinite(coefficient)) return "a coefficient that is not finite";
    }
  }
  return {};
}

std::string check(std::vector<Instance> instances, const cv::Size& size) {
  const cv::Rect image({}, size);
  const Segmentation segmentation{0, 0, size, std::move(instances)};
  validate(segmentation, "a fuzzed network");
  for (const Instance& one : segmentation.instances) {
    const cv::Rect mask(one.mask_origin, one.mask.size());
    if (one.box.empty() || (one.box & image) != one.box) return "a box outside the image";
    if (mask.empty() || (mask & image) != mask) return "a mask outside the image";
    if (cv::countNonZero(one.mask) == 0) return "a mask without a pixel";
  }
  return {};
}

std::string decode(ByteSource& source) {
  const bool is_large = source.may_be_costly(16);
  const int cells = is_large ? 3 : 1;
  const cv::Size input(32 * source.between(1, cells), 32 * source.between(1, cells));
  const cv::Size size(source.between(1, 30 * cells), source.between(1, 25 * cells));
  const cv::Mat image(size, CV_8UC3, cv::Scalar::all(0));
  if (source.chance(30)) source.byte();  // keeps the corpus
  const int rows = source.between(1, 12), classes = source.between(1, 4),
            count = source.between(1, 3);
  const int odd = source.chance(40) ? 0 : source.between(0, 20);
  const std::vector<int> grid = {1, count, source.between(1, 9), source.between(1, 9)};
  DetectionOptions options;
  const bool wants_all = source.chance(70);
  if (!wants_all) options.classes = {1};
  options.score_threshold = static_cast<float>(source.between(0, 9)) / 10;
  options.iou_threshold = static_cast<float>(source.between(0, 10)) / 10;
  options.max_detections = source.between(1, 8);
  if (source.chance(10)) {
    const std::vector<int> shape = {1, classes, input.height / 8, input.width / 8};
    const Planes planes = bind_semantic({{"out", tensor(source, shape, 4, odd)}}, input);
    return check(decode_semantic(planes, stretch(image, input).placement,
                                 semantic_classes(planes.count), options),
                 size);
  }
  const auto side = static_cast<float>(2 * input.width);
  if (source.chance(50)) {
    const bool is_raw = source.chance(is_large ? 40 : 10);
    std::vector<NamedTensor> outputs = {{"proto", tensor(source, grid, 1, odd)}};
    if (is_raw) {
      const int places = input.area() / 64 + input.area() / 256 + input.area() / 1024;
      outputs.push_back({"boxes", tensor(source, {1, 64, places}, 4, 0)});
      outputs.push_back({"scores", tensor(source, {1, classes, places}, 4, odd)});
      outputs.push_back({"masks", tensor(source, {1, count, places}, 1, odd)});
    } else {
      cv::Mat table = tensor(source, {1, 4 + classes + count, rows}, 1, odd);
      auto* const values = table.ptr<float>();
      const std::size_t boxes = std::min<std::size_t>(table.total(), 4 * std::size_t(rows));
      for (std::size_t i = 0; i < boxes; ++i) values[i] *= side / 2;
      outputs.push_back({"output", table});
    }
    const YoloOutputs bound = bind_yolo(outputs, input);
    const auto detections = decode_yolo(bound, options);
    const std::string complaint = check(detections, options);
    if (!complaint.empty()) return complaint;
    return check(assemble_instances(detections, bound.prototypes,
                                    letterbox(image, input, {}).placement, MaskRule::crop_pixels),
                 size);
  }
  const std::vector<NamedTensor> outputs = {
      {"loc", tensor(source, {1, rows, 4}, 3, odd)},
      {"conf", tensor(source, {1, rows, classes + 1}, 3, odd)},
      {"mask", tensor(source, {1, rows, count}, 1, odd)},
      {"proto", tensor(source, grid, 1, odd)},
      {"priors", tensor(source, {rows, 4}, 1, odd)}};
  const YolactOutputs bound = bind_yolact(outputs);
  if (bound.priors.empty()) return {};  // the caller has to find others
  const auto detections = decode_yolact(bound, bound.priors, input, options);
  const std::string complaint = check(detections, options);
  if (!complaint.empty()) return complaint;
  return check(assemble_instances(detections, bound.prototypes, stretch(image, input).placement,
                                  MaskRule::crop_cells),
               size);
}

}  // namespace
}  // namespace dynfilter::testing

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  dynfilter::testing::ByteSource source(data, size);
  try {
    return dynfilter::testing::report(dynfilter::testing::decode(source));
  } catch (const std::runtime_error& error) {
    if (dynamic_cast<const cv::Exception*>(&error) != nullptr) throw;
    return 0;
  }
}
