// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "semantic_decoder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "mask_assembly.hpp"

namespace dynfilter::detail {
namespace {

/// Whether the only plane holds whole numbers above 1: the result of ArgMax.
bool are_class_ids(const Table& cells) {
  double largest = 0;
  cv::minMaxLoc(cells, nullptr, &largest);
  return cells.rows == 1 && largest > 1 && std::all_of(cells.begin(), cells.end(), [](float value) {
           return value >= 0 && value == std::floor(value);
         });
}

/// Returns the probability of each plane in each cell.
Table probabilities_of(const Planes& planes) {
  Table cells = planes.cells();
  if (!cv::checkRange(cells)) {
    throw std::runtime_error("its scores are not all finite numbers; its weights may be damaged");
  }
  if (are_class_ids(cells)) {
    throw std::runtime_error("its output holds class ids: export the scores, without ArgMax");
  }
  constexpr double tolerance = 1e-3;
  double low = 0, high = 0;
  cv::minMaxLoc(cells, &low, &high);
  if (low >= -tolerance && high <= 1 + tolerance) return cells;
  cv::Mat weights, sum;
  if (cells.rows == 1) {
    cv::exp(-cells, weights);
    return cv::Mat(1 / (1 + weights));
  }
  cv::reduce(cells, sum, 0, cv::REDUCE_MAX);
  cv::exp(cells - cv::repeat(sum, cells.rows, 1), weights);
  cv::reduce(weights, sum, 0, cv::REDUCE_SUM);
  return cv::Mat(weights / cv::repeat(sum, cells.rows, 1));
}

}  // namespace

Planes bind_semantic(const std::vector<NamedTensor>& outputs, const cv::Size& input) {
  std::vector<Planes> bound;  // DeepLab has an auxiliary output
  for (const NamedTensor& output : outputs) {
    cv::Mat tensor = output.data;
    if (tensor.dims == 3) {
      const std::array<int, 4> shape = {tensor.size[0], 1, tensor.size[1], tensor.size[2]};
      tensor = tensor.reshape(1, 4, shape.data());
    }
    const auto is_image = [&](const Planes& planes) {
      return std::min({planes.count, planes.rows - 1, planes.columns - 1}) > 0 &&
             planes.has_aspect_of(input);
    };
    const bool is_alone = tensor.dims == 4 && tensor.size[0] == 1;
    if (is_alone && is_image(count_first(tensor))) {
      bound.push_back(count_first(tensor));
    } else if (is_alone && is_image(count_last(tensor))) {
      bound.push_back(count_last(tensor));
    } else {
      throw std::runtime_error(output.name +
                               " is no image [1, C, rows, columns] or [1, rows, columns, C]");
    }
  }
  if (bound.empty()) throw std::runtime_error("there is no output");
  return bound[0];
}

SemanticClasses semantic_classes(int planes) {
  switch (planes) {
    case 1:
      return {{0, {0}}};
    case 2:
      return {{0, {1}}};
    case 12:  // CamVid; riders of bicycles are people
      return {{0, {9, 10}}, {2, {8}}};
    case 19:  // Cityscapes
      return {{0, {11, 12}}, {1, {18}}, {2, {13}}, {3, {17}}, {5, {15}}, {6, {16}}, {7, {14}}};
    case 21:  // Pascal VOC
      return {{0, {15}},  {1, {2}},   {2, {7}},   {3, {14}},  {4, {1}},
              {5, {6}},   {6, {19}},  {8, {4}},   {14, {3}},  {15, {8}},
              {16, {12}}, {17, {13}}, {18, {17}}, {19, {10}}, {56, {9}}};
    case 150:  // ADE20K
      return {{0, {12}}, {1, {127}}, {2, {20, 102}}, {3, {116}},        {4, {90}},
              {5, {80}}, {7, {83}},  {8, {76}},      {56, {19, 30, 75}}};
    default:
      SemanticClasses classes;
      for (int plane = 1; plane < planes; ++plane) classes[plane] = {plane};
      return classes;
  }
}

std::vector<Instance> decode_semantic(const Planes& planes, const InputPlacement& placement,
                                      const SemanticClasses& classes,
                                      const DetectionOptions& options) {
  constexpr int specks_an_image = 5000;  // parts of a smaller share of the image are noise
  constexpr int box_margin_px = 20;      // no detector gave a box; as for binary masks in files
  const Table probabilities = probabilities_of(planes);
  const cv::Rect image({}, placement.image);
  std::vector<Instance> parts;
  for (const auto& [class_id, members] : classes) {
    if (!options.wants(class_id)) continue;
    cv::Mat sum = cv::Mat::zeros(1, probabilities.cols, CV_32F);
    for (const int plane : members) sum += probabilities.row(plane);
    if (cv::countNonZero(sum > options.score_threshold) == 0) continue;
    const cv::Mat probability = in_image(sum.reshape(1, planes.rows), placement, image);
    for (Instance& part :
         instances_from_binary_mask(probability > options.score_threshold, box_margin_px,
                                    image.area() / specks_an_image + 1)) {
      const cv::Rect place(part.mask_origin, part.mask.size());
      const double mean = cv::mean(probability(place), part.mask)[0];
      part.score = static_cast<float>(std::clamp(mean, 0.0, 1.0));
      part.class_id = class_id;
      parts.push_back(std::move(part));
    }
  }
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Instance& a, const Instance& b) { return a.score > b.score; });
  return parts;
}

}  // namespace dynfilter::detail
