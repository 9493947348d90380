// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "yolo_decoder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "finite_scores.hpp"
#include "non_maximum_suppression.hpp"

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

/// Outputs of three dimensions, and the one of four.
struct Sorted {
  std::vector<const NamedTensor*> tables;
  const NamedTensor* prototypes = nullptr;
};

Sorted sorted_by_rank(const std::vector<NamedTensor>& outputs) {
  Sorted sorted;
  for (const NamedTensor& output : outputs) {
    const bool is_batch_of_one = output.data.dims >= 3 && output.data.size[0] == 1;
    if (!is_batch_of_one) throw std::runtime_error("output " + output.name + " is no batch of one");
    if (output.data.dims == 3) sorted.tables.push_back(&output);
    if (output.data.dims == 4) {
      if (sorted.prototypes != nullptr)
        throw std::runtime_error("two outputs have four dimensions");
      sorted.prototypes = &output;
    }
    if (output.data.dims > 4)
      throw std::runtime_error("output " + output.name + " has too many dimensions");
  }
  if (sorted.prototypes == nullptr) {
    throw std::runtime_error(
        "there are no prototypes [1, P, rows, columns]: no segmentation network");
  }
  return sorted;
}

/// Views the output as a table with `rows` rows, transposed if necessary.
std::optional<Table> with_rows(const NamedTensor& output, int rows) {
  if (output.data.size[2] == rows) return columns_first(output.data);
  if (output.data.size[1] == rows) return rows_first(output.data);
  return {};
}

/// Finds the prototypes' dimension, the second or the last: their number must fit the columns of
/// the tables, and the grid must have the input's aspect ratio.
Prototypes view_prototypes(const NamedTensor& output, const cv::Size& input,
                           const std::function<bool(int)>& fits) {
  for (const Prototypes& prototypes :
       {prototypes_first(output.data), prototypes_last(output.data)}) {
    const bool has_shape_of_input = std::int64_t{prototypes.rows} * input.width ==
                                    std::int64_t{prototypes.columns} * input.height;
    if (has_shape_of_input && fits(prototypes.count)) return prototypes;
  }
  throw std::runtime_error("no dimension of " + output.name +
                           " can be the number of prototypes, given the other outputs");
}

YoloOutputs bind_single(const NamedTensor& output, const NamedTensor& prototypes,
                        const cv::Size& input) {
  YoloOutputs bound;
  bound.input = input;
  if (const std::optional<Table> table = with_rows(output, anchor_count(input))) {
    bound.head = YoloHead::decoded;
    bound.prototypes =
        view_prototypes(prototypes, input, [&](int count) { return 4 + count < table->columns; });
    const int classes = table->columns - 4 - bound.prototypes.count;
    bound.boxes = table->part(0, 4);
    bound.scores = table->part(4, classes);
    bound.coefficients = table->part(4 + classes, bound.prototypes.count);
    return bound;
  }
  const Table table = rows_first(output.data);
  bound.head = YoloHead::end_to_end;
  bound.prototypes =
      view_prototypes(prototypes, input, [&](int count) { return 6 + count == table.columns; });
  bound.boxes = table.part(0, 4);
  bound.scores = table.part(4, 2);
  bound.coefficients = table.part(6, bound.prototypes.count);
  return bound;
}

/// Takes the first table with this name or, if there is none, the first that fits.
Table take(std::vector<std::pair<const NamedTensor*, Table>>& tables,
           std::initializer_list<std::string_view> names, const std::function<bool(int)>& fits) {
  const auto found = [&](bool by_name) {
    return std::find_if(tables.begin(), tables.end(), [&](const auto& entry) {
      return fits(entry.second.columns) && (!by_name || is_named(*entry.first, names));
    });
  };
  auto place = found(true);
  if (place == tables.end()) place = found(false);
  if (place == tables.end()) throw std::runtime_error("boxes, classes or coefficients are missing");
  const Table table = place->second;
  tables.erase(place);
  return table;
}

YoloOutputs bind_raw(const std::vector<const NamedTensor*>& outputs, const NamedTensor& prototypes,
                     const cv::Size& input) {
  std::vector<std::pair<const NamedTensor*, Table>> tables;
  for (const NamedTensor* output : outputs) {
    const std::optional<Table> table = with_rows(*output, anchor_count(input));
    if (!table) {
      throw std::runtime_error("output " + output->name + " has no dimension of " +
                               std::to_string(anchor_count(input)) + ", the number of anchors");
    }
    tables.emplace_back(output, *table);
  }
  YoloOutputs bound;
  bound.head = YoloHead::raw;
  bound.input = input;
  bound.prototypes = view_prototypes(prototypes, input, [&](int count) {
    return std::any_of(tables.begin(), tables.end(),
                       [&](const auto& entry) { return entry.second.columns == count; });
  });
  const int count = bound.prototypes.count;
  // Boxes first: if classes or boxes have as many columns as there are prototypes, order tells
  // them apart, and coefficients come last.
  std::reverse(tables.begin(), tables.end());
  bound.coefficients = take(tables, {"coef", "mask"}, [&](int n) { return n == count; });
  std::reverse(tables.begin(), tables.end());
  const bool has_usual = std::any_of(tables.begin(), tables.end(), [](const auto& entry) {
    return entry.second.columns == 4 * usual_bins;
  });
  bound.boxes = take(tables, {"box", "dist", "reg"},
                     [&](int n) { return has_usual ? n == 4 * usual_bins : n % 4 == 0; });
  bound.scores = take(tables, {}, [](int) { return true; });
  return bound;
}

// --- Decoding ------------------------------------------------------------------------------------

/// Returns the mean of a distribution over 0, 1, 2, … given by logits (X. Li et al., "Generalized
/// Focal Loss", NeurIPS 2020); for a single bin, its value.
float expectation(const Table& logits, int row, int first, int bins) {
  if (bins == 1) return logits.at(row, first);
  float largest = logits.at(row, first);
  for (int k = 1; k < bins; ++k) largest = std::max(largest, logits.at(row, first + k));
  float sum = 0;
  float weighted = 0;
  for (int k = 0; k < bins; ++k) {
    const float weight = std::exp(logits.at(row, first + k) - largest);
    sum += weight;
    weighted += weight * static_cast<float>(k);
  }
  return weighted / sum;
}

Box raw_box(const YoloOutputs& outputs, int row) {
  const Anchor anchor = anchor_of(row, outputs.input);
  const int bins = outputs.boxes.columns / 4;
  const auto distance = [&](int side) {
    return expectation(outputs.boxes, row, side * bins, bins) * anchor.stride;
  };
  return {anchor.x - distance(0), anchor.y - distance(1), anchor.x + distance(2),
          anchor.y + distance(3)};
}

Box box_of(const YoloOutputs& outputs, int row) {
  const Table& table = outputs.boxes;
  switch (outputs.head) {
    case YoloHead::raw:
      return raw_box(outputs, row);
    case YoloHead::decoded: {
      const float x = table.at(row, 0), y = table.at(row, 1);
      const float width = table.at(row, 2), height = table.at(row, 3);
      return {x - width / 2, y - height / 2, x + width / 2, y + height / 2};
    }
    case YoloHead::end_to_end:
      break;
  }
  return {table.at(row, 0), table.at(row, 1), table.at(row, 2), table.at(row, 3)};
}

struct ClassScore {
  int class_id;
  float score;
};

/// Returns a row's best class and counts its scores; std::nullopt if all are NaN.
std::optional<ClassScore> best_class(const YoloOutputs& outputs, int row, FiniteScores& seen) {
  const Table& scores = outputs.scores;
  if (outputs.head == YoloHead::end_to_end) {
    const float score = seen.probability(scores.at(row, 0));
    const float class_id = scores.at(row, 1);
    if (!(score >= 0) || !(class_id >= 0 && class_id < 1e6F)) return {};
    return ClassScore{static_cast<int>(std::lround(class_id)), score};
  }
  std::optional<ClassScore> best;
  for (int c = 0; c < scores.columns; ++c) {
    const float value = scores.at(row, c);
    if (!std::isnan(value) && (!best || value > best->score)) best = ClassScore{c, value};
  }
  if (!best) return {};
  best->score =
      seen.probability(outputs.head == YoloHead::raw ? sigmoid(best->score) : best->score);
  return best;
}

}  // namespace

YoloOutputs bind_yolo(const std::vector<NamedTensor>& outputs, const cv::Size& input) {
  const Sorted sorted = sorted_by_rank(outputs);
  switch (sorted.tables.size()) {
    case 1:
      return bind_single(*sorted.tables[0], *sorted.prototypes, input);
    case 3:
      return bind_raw(sorted.tables, *sorted.prototypes, input);
    default:
      throw std::runtime_error(
          "besides the prototypes there must be one output, or boxes, classes and coefficients");
  }
}

std::vector<Detection> decode_yolo(const YoloOutputs& outputs, const DetectionOptions& options) {
  FiniteScores seen;
  std::vector<Candidate> candidates;
  for (int row = 0; row < outputs.scores.rows; ++row) {
    const std::optional<ClassScore> best = best_class(outputs, row, seen);
    if (!best || !(best->score > options.score_threshold) || !options.is_wanted(best->class_id)) {
      continue;
    }
    const Box box = box_of(outputs, row);
    if (!box.is_finite() || !box.has_area() || finite_row(outputs.coefficients, row).empty()) {
      continue;
    }
    candidates.push_back({best->class_id, best->score, row, box});
  }
  seen.require_some(outputs.scores.rows);

  if (outputs.head == YoloHead::end_to_end) {
    sort_by_score(candidates);
  } else {
    candidates = suppress_greedily(std::move(candidates), options.iou_threshold);
  }
  std::vector<Detection> detections;
  for (const Candidate& candidate : candidates) {
    if (detections.size() == static_cast<std::size_t>(options.max_detections)) break;
    detections.push_back({candidate.class_id, candidate.score, candidate.box,
                          finite_row(outputs.coefficients, candidate.row)});
  }
  return detections;
}

}  // namespace dynfilter::detail
