// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "yolo_decoder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail {
namespace {

constexpr std::array<int, 3> strides = {8, 16, 32};  // of the feature maps P3, P4, P5
constexpr int usual_bins = 16;

int cells(const cv::Size& input, int stride) {
  return (input.width / stride) * (input.height / stride);
}

int anchor_count(const cv::Size& input) {
  int count = 0;
  for (const int stride : strides) count += cells(input, stride);
  return count;
}

/// The centre of an anchor's cell and the cell's side, in pixels of the input. Anchors come level
/// by level, row by row.
struct Anchor {
  float x, y, stride;
};

Anchor anchor_of(int row, const cv::Size& input) {
  for (const int stride : strides) {
    const int count = cells(input, stride);
    if (row < count) {
      const int columns = input.width / stride;
      const auto side = static_cast<float>(stride);
      return {(static_cast<float>(row % columns) + 0.5F) * side,
              (static_cast<float>(row / columns) + 0.5F) * side, side};
    }
    row -= count;
  }
  throw std::logic_error("an anchor beyond the last one");
}

// --- Binding -------------------------------------------------------------------------------------

/// Returns the output as a table with `rows` rows, transposed if necessary; empty if it has none.
Table with_rows(const cv::Mat& output, int rows) {
  if (output.size[2] == rows) return cv::Mat(rows_first(output).t());
  if (output.size[1] == rows) return rows_first(output);
  return {};
}

/// Finds the prototypes' dimension, the second or the last: their number must fit the columns of
/// the tables, and the grid must have the input's aspect ratio.
std::optional<Planes> find_prototypes(const NamedTensor& output, const cv::Size& input,
                                      const std::function<bool(int)>& fits) {
  for (const Planes& prototypes : {count_first(output.data), count_last(output.data)}) {
    if (prototypes.has_aspect_of(input) && fits(prototypes.count)) return prototypes;
  }
  return {};
}

std::runtime_error no_prototypes(const NamedTensor& output) {
  return std::runtime_error("no dimension of " + output.name +
                            " can be the number of prototypes, given the other outputs");
}

/// Returns the number of columns of coefficients, and their prototypes: none of a detector.
std::optional<Planes> prototypes_of(const NamedTensor* output, const cv::Size& input,
                                    const std::function<bool(int)>& fits) {
  if (output != nullptr) return find_prototypes(*output, input, fits);
  return fits(0) ? std::optional<Planes>(Planes{}) : std::nullopt;
}

/// Tells whether a detector's rows have objectness although cells have one anchor: YOLOv6's is 1.
/// Throws std::runtime_error for YOLOX, of whose 85 columns the fifth is no class either, and whose
/// raw sizes are logarithms.
bool is_yolo6(const NamedTensor& output, int rows) {
  const bool has_rows = output.data.size[1] == rows && output.data.size[2] > 5;
  if (!has_rows) return false;
  const Table table = rows_first(output.data);
  if (cv::countNonZero(table.col(4) != 1) == 0) return true;
  const bool is_yolox = table.cols == 85 || cv::countNonZero(table.colRange(2, 4) < 0) > 0;
  if (!is_yolox) return false;
  throw std::runtime_error(output.name +
                           " is YOLOX's, [1, N, 5+C], which wants images in BGR, from 0 to 255; "
                           "run it in its own process");
}

/// Binds one output: boxes, scores and, of a segmentation network, coefficients side by side.
YoloOutputs bind_single(const NamedTensor& output, const NamedTensor* prototypes,
                        const cv::Size& input) {
  constexpr int v5_anchors = 3;  // YOLOv5 has so many for each cell
  const int anchors = anchor_count(input);
  const bool is_v6 = prototypes == nullptr && is_yolo6(output, anchors);
  const struct {
    YoloHead head;
    int rows, box_columns;
  } forms[] = {{is_v6 ? YoloHead::with_objectness : YoloHead::decoded, anchors, is_v6 ? 5 : 4},
               {YoloHead::with_objectness, v5_anchors * anchors, 5},
               {YoloHead::end_to_end, output.data.size[1], 4}};
  for (const auto& [head, rows, box_columns] : forms) {
    const bool is_end_to_end = head == YoloHead::end_to_end;
    const Table table = is_end_to_end ? rows_first(output.data) : with_rows(output.data, rows);
    const int first = box_columns;
    const std::optional<Planes> found = prototypes_of(prototypes, input, [&](int count) {
      const int classes = table.cols - first - count;
      return is_end_to_end ? classes == 2 : classes > 0;
    });
    if (table.empty() || !found) continue;
    const int last = table.cols - found->count;
    return {head,
            input,
            table.colRange(0, first),
            table.colRange(first, last),
            table.colRange(last, table.cols),
            *found};
  }
  if (input.width % strides.back() != 0 || input.height % strides.back() != 0) {
    throw std::runtime_error("its input of " + size_name(input) +
                             " is no multiple of 32: export it with such an imgsz");
  }
  if (prototypes != nullptr) throw no_prototypes(*prototypes);
  throw std::runtime_error(concatenate("there are no prototypes [1, P, rows, columns], and ",
                                       output.name, " is no detector's: [1, 4+C, ", anchors,
                                       "], [1, ", v5_anchors * anchors, ", 5+C] or [1, K, 6]"));
}

/// Takes the first table that fits.
Table take(std::vector<Table>& tables, const std::function<bool(int columns)>& fits) {
  const auto place = std::find_if(tables.begin(), tables.end(),
                                  [&](const Table& table) { return fits(table.cols); });
  if (place == tables.end()) throw std::runtime_error("boxes, classes or coefficients are missing");
  Table table = *place;
  tables.erase(place);
  return table;
}

YoloOutputs bind_raw(const std::vector<const NamedTensor*>& outputs, const NamedTensor* prototypes,
                     const cv::Size& input) {
  std::vector<Table> tables;
  for (const NamedTensor* output : outputs) {
    tables.push_back(with_rows(output->data, anchor_count(input)));
    if (tables.back().empty()) {
      throw std::runtime_error(concatenate("output ", output->name, " has no dimension of ",
                                           anchor_count(input), ", the number of anchors"));
    }
  }
  const auto has_columns = [&](int count) {
    return std::any_of(tables.begin(), tables.end(),
                       [&](const Table& table) { return table.cols == count; });
  };
  std::optional<Planes> found(Planes{});
  if (prototypes != nullptr) found = find_prototypes(*prototypes, input, has_columns);
  if (!found) throw no_prototypes(*prototypes);
  YoloOutputs bound;
  bound.head = YoloHead::raw;
  bound.input = input;
  bound.prototypes = *found;
  // If classes or boxes have as many columns as there are prototypes, order tells them apart: boxes
  // come first and coefficients last.
  if (prototypes != nullptr) {
    std::reverse(tables.begin(), tables.end());
    bound.coefficients = take(tables, [&](int columns) { return columns == found->count; });
    std::reverse(tables.begin(), tables.end());
  }
  const bool has_usual = has_columns(4 * usual_bins);
  bound.boxes = take(tables, [&](int columns) {
    return has_usual ? columns == 4 * usual_bins : columns % 4 == 0;
  });
  bound.scores = take(tables, [](int) { return true; });
  return bound;
}

// --- Decoding ------------------------------------------------------------------------------------

/// Returns the mean of a distribution over 0, 1, 2, … given by logits (X. Li et al., "Generalized
/// Focal Loss", NeurIPS 2020); for a single bin, its value.
float expectation(const float* logits, int bins) {
  if (bins == 1) return logits[0];
  const float largest = *std::max_element(logits, logits + bins);
  float sum = 0;
  float weighted = 0;
  for (int k = 0; k < bins; ++k) {
    const float weight = std::exp(logits[k] - largest);
    sum += weight;
    weighted += weight * static_cast<float>(k);
  }
  return weighted / sum;
}

Box raw_box(const YoloOutputs& outputs, int row) {
  const Anchor anchor = anchor_of(row, outputs.input);
  const int bins = outputs.boxes.cols / 4;
  const auto distance = [&](int side) {
    return expectation(outputs.boxes[row] + side * bins, bins) * anchor.stride;
  };
  return {anchor.x - distance(0), anchor.y - distance(1), anchor.x + distance(2),
          anchor.y + distance(3)};
}

Box box_of(const YoloOutputs& outputs, int row) {
  if (outputs.head == YoloHead::raw) return raw_box(outputs, row);
  const float* box = outputs.boxes[row];
  if (outputs.head == YoloHead::end_to_end) return {box[0], box[1], box[2], box[3]};
  return {box[0] - box[2] / 2, box[1] - box[3] / 2, box[0] + box[2] / 2, box[1] + box[3] / 2};
}

struct ClassScore {
  int class_id;
  float score;
};

/// Returns a row's best class and counts its scores; std::nullopt if all are NaN.
std::optional<ClassScore> best_class(const YoloOutputs& outputs, int row, FiniteScores& seen) {
  const float* scores = outputs.scores[row];
  if (outputs.head == YoloHead::end_to_end) {
    const float class_id = scores[1];
    const bool is_filler = scores[0] < 0 || class_id < 0;  // rows beyond the last object
    const float score = seen.probability(is_filler ? 0 : scores[0]);
    if (is_filler || !(score >= 0) || !(class_id < 1e6F)) return {};
    return ClassScore{static_cast<int>(std::lround(class_id)), score};
  }
  std::optional<ClassScore> best;
  for (int c = 0; c < outputs.scores.cols; ++c) {
    if (!std::isnan(scores[c]) && (!best || scores[c] > best->score)) best = {c, scores[c]};
  }
  if (!best) return {};
  if (outputs.head == YoloHead::raw) best->score = sigmoid(best->score);
  if (outputs.head == YoloHead::with_objectness) best->score *= outputs.boxes(row, 4);
  best->score = seen.probability(best->score);
  return best;
}

}  // namespace

YoloOutputs bind_yolo(const std::vector<NamedTensor>& outputs, const cv::Size& input) {
  std::vector<const NamedTensor*> tables;
  const NamedTensor* prototypes = nullptr;
  for (const NamedTensor& output : outputs) {
    const int dimensions = output.data.dims;
    if (dimensions < 3 || output.data.size[0] != 1) {
      throw std::runtime_error("output " + output.name + " is no batch of one");
    }
    if (dimensions == 3) tables.push_back(&output);
    if (dimensions > 4 || (dimensions == 4 && prototypes != nullptr)) {
      throw std::runtime_error("output " + output.name + " has too many dimensions");
    }
    if (dimensions == 4) prototypes = &output;
  }
  if (tables.size() == 1) return bind_single(*tables[0], prototypes, input);
  if (tables.size() == (prototypes != nullptr ? 3U : 2U))
    return bind_raw(tables, prototypes, input);
  throw std::runtime_error(
      prototypes == nullptr
          ? "there are no prototypes [1, P, rows, columns], and neither one output nor boxes and "
            "classes"
          : "besides the prototypes there must be one output, or boxes, classes and coefficients");
}

std::vector<Detection> decode_yolo(const YoloOutputs& outputs, const DetectionOptions& options) {
  FiniteScores seen;
  std::vector<Detection> found;
  for (int row = 0; row < outputs.scores.rows; ++row) {
    const std::optional<ClassScore> best = best_class(outputs, row, seen);
    if (!best || !(best->score > options.score_threshold) || !options.wants(best->class_id)) {
      continue;
    }
    const Box box = box_of(outputs, row);
    std::vector<float> coefficients;
    if (outputs.prototypes.count > 0) coefficients = finite_row(outputs.coefficients, row);
    const bool is_whole = outputs.prototypes.count == 0 || !coefficients.empty();
    if (!box.has_area() || !is_whole) continue;
    found.push_back({best->class_id, best->score, box, coefficients});
  }
  seen.require_some(outputs.scores.rows);
  return best_detections(std::move(found), options, outputs.head != YoloHead::end_to_end);
}

}  // namespace dynfilter::detail
