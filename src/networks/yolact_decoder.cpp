// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "yolact_decoder.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <functional>
#include <initializer_list>
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail {
namespace {

// --- Binding -------------------------------------------------------------------------------------

/// Tells whether the tensor's name contains one of these words, ignoring case.
bool is_named(const NamedTensor& tensor, std::initializer_list<std::string_view> words) {
  std::string name = tensor.name;
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return name.find(word) != std::string::npos; });
}

using Outputs = std::vector<const NamedTensor*>;

/// Takes the fitting output out of the list, by name if several fit. Null if none fits.
const NamedTensor* take(Outputs& outputs, const char* what,
                        std::initializer_list<std::string_view> names,
                        const std::function<bool(const cv::Mat&)>& fits) {
  Outputs fitting;
  for (const NamedTensor* output : outputs) {
    if (fits(output->data)) fitting.push_back(output);
  }
  if (fitting.size() > 1) {
    const auto is_other = [&](const NamedTensor* output) { return !is_named(*output, names); };
    fitting.erase(std::remove_if(fitting.begin(), fitting.end(), is_other), fitting.end());
    if (fitting.size() != 1) {
      throw std::runtime_error(std::string("it is unclear which output holds the ") + what +
                               ": give it a name such as " + std::string(*names.begin()));
    }
  }
  if (fitting.empty()) return nullptr;
  outputs.erase(std::find(outputs.begin(), outputs.end(), fitting[0]));
  return fitting[0];
}

/// Takes an output that must be there.
cv::Mat need(Outputs& outputs, const char* what, std::initializer_list<std::string_view> names,
             const std::function<bool(const cv::Mat&)>& fits) {
  const NamedTensor* const output = take(outputs, what, names, fits);
  if (output == nullptr) throw std::runtime_error(std::string("the ") + what + " are missing");
  return output->data;
}

bool is_table(const cv::Mat& data) { return data.dims == 3 && data.size[0] == 1; }

int rows_of(const cv::Mat& table) { return table.size[table.dims - 2]; }
int columns_of(const cv::Mat& table) { return table.size[table.dims - 1]; }

// --- Priors --------------------------------------------------------------------------------------

constexpr int levels = 5;  // P3 to P7
constexpr std::array<double, levels> scales = {24, 48, 96, 192, 384};
constexpr std::array<double, 3> aspect_ratios = {1, 0.5, 2};
constexpr double published_side = 550;

/// Returns rows and columns of the feature maps: P3 has an eighth of the input's, each further
/// level half of the last, rounded up.
std::array<cv::Size, levels> feature_maps(const cv::Size& input) {
  const auto halved = [](const cv::Size& size) {
    return cv::Size((size.width + 1) / 2, (size.height + 1) / 2);
  };
  std::array<cv::Size, levels> maps;
  cv::Size size = halved(halved(halved(input)));
  for (cv::Size& map : maps) {
    map = size;
    size = halved(size);
  }
  return maps;
}

/// Returns the scale of a level for an input side. The published networks for 400 and 700 scale
/// those for 550 in proportion, cut to whole pixels.
double scale_at(std::size_t level, int side) {
  return side == static_cast<int>(published_side)
             ? scales[level]
             : std::floor(scales[level] / published_side * side);
}

// --- Decoding ------------------------------------------------------------------------------------

constexpr float min_confidence = 0.05F;  // as published

/// Reads the probabilities of one row, the background's first, by softmax from logits.
std::vector<float> probabilities_of(const Table& confidences, int row, bool are_logits) {
  std::vector<float> probabilities = confidences.row(row);
  if (!are_logits) return probabilities;
  const float largest = *std::max_element(probabilities.begin(), probabilities.end());
  float sum = 0;
  for (float& value : probabilities) {
    value = std::exp(value - largest);
    sum += value;
  }
  for (float& value : probabilities) value /= sum;
  return probabilities;
}

/// Decodes a box from SSD's coding (W. Liu et al., ECCV 2016) with its variances 0.1 and 0.2, as
/// pixels of the input.
Box decoded_box(const float* location, const float* prior, const cv::Size& input) {
  const float width = prior[2] * std::exp(location[2] * 0.2F);
  const float height = prior[3] * std::exp(location[3] * 0.2F);
  const float x = prior[0] + location[0] * 0.1F * prior[2] - width / 2;
  const float y = prior[1] + location[1] * 0.1F * prior[3] - height / 2;
  const auto columns = static_cast<float>(input.width), rows = static_cast<float>(input.height);
  return {x * columns, y * rows, (x + width) * columns, (y + height) * rows};
}

}  // namespace

YolactOutputs bind_yolact(const std::vector<NamedTensor>& outputs) {
  Outputs unbound;
  for (const NamedTensor& output : outputs) unbound.push_back(&output);

  const NamedTensor* priors = take(unbound, "priors", {"prior", "anchor"}, [](const cv::Mat& data) {
    return data.dims == 2 && data.size[1] == 4;
  });
  const cv::Mat locations =
      need(unbound, "locations [1, N, 4]", {"loc", "bbox", "box"},
           [](const cv::Mat& data) { return is_table(data) && columns_of(data) == 4; });
  const int rows = rows_of(locations);
  const auto is_table_of_rows = [&](const cv::Mat& data) {
    return is_table(data) && rows_of(data) == rows;
  };
  // The prototypes identify the coefficients: the only table with one column for each prototype.
  const auto is_grid_for = [&](const cv::Mat& grid, int count) {
    return grid.dims == 4 && grid.size[0] == 1 && (grid.size[1] == count || grid.size[3] == count);
  };
  const auto fits_a_grid = [&](const cv::Mat& data) {
    return is_table_of_rows(data) &&
           std::any_of(outputs.begin(), outputs.end(), [&](const NamedTensor& output) {
             return is_grid_for(output.data, columns_of(data));
           });
  };
  const cv::Mat coefficients =
      need(unbound, "coefficients [1, N, P] with prototypes [1, h, w, P] or [1, P, h, w]",
           {"mask", "coef"}, fits_a_grid);
  const cv::Mat confidences =
      need(unbound, "confidences [1, N, C+1]", {"conf", "cls", "class", "score"},
           [&](const cv::Mat& data) { return is_table_of_rows(data) && columns_of(data) >= 2; });
  const int count = columns_of(coefficients);
  const cv::Mat prototypes = need(unbound, "prototypes", {"proto"},
                                  [&](const cv::Mat& data) { return is_grid_for(data, count); });

  YolactOutputs bound;
  bound.locations = rows_first(locations);
  bound.confidences = rows_first(confidences);
  bound.coefficients = rows_first(coefficients);
  bound.prototypes = prototypes.size[3] == count ? count_last(prototypes) : count_first(prototypes);
  if (priors == nullptr) return bound;
  bound.priors = rows_first(priors->data);
  if (bound.priors.rows != rows) {
    throw std::runtime_error(
        concatenate("there are ", bound.priors.rows, " priors for ", rows, " locations"));
  }
  return bound;
}

cv::Mat yolact_priors(int count, const cv::Size& input) {
  const std::array<cv::Size, levels> maps = feature_maps(input);
  int cells = 0;
  for (const cv::Size& map : maps) cells += map.area();
  const bool is_plus = count == 9 * cells;  // YOLACT++ has three scales a level
  if (count != 3 * cells && !is_plus) {
    throw std::runtime_error(concatenate("it has ", count, " priors; YOLACT has ", 3 * cells,
                                         ", YOLACT++ ", 9 * cells, " for an input of ",
                                         size_name(input), "; export the priors as an output"));
  }
  cv::Mat priors(count, 4, CV_32F);
  int row = 0;
  for (std::size_t level = 0; level < maps.size(); ++level) {
    const cv::Size& map = maps[level];
    const double scale = scale_at(level, input.width);
    for (int i = 0; i < count / cells * map.area(); ++i) {
      const int cell = i / (count / cells), kind = i % (count / cells);
      const double ratio = aspect_ratios[static_cast<std::size_t>(kind % 3)];
      const double side = scale * std::exp2(kind / 3 / 3.0) * std::sqrt(ratio) / input.width;
      float* prior = priors.ptr<float>(row++);
      prior[0] = static_cast<float>((cell % map.width + 0.5) / map.width);
      prior[1] = static_cast<float>((cell / map.width + 0.5) / map.height);
      prior[2] = static_cast<float>(side);
      // YOLACT was trained with squares, by a bug, and keeps them; YOLACT++ was not.
      prior[3] = static_cast<float>(is_plus ? side / ratio : side);
    }
  }
  return priors;
}

bool are_probabilities(const Table& confidences) {
  constexpr int sample = 64;
  const int step = std::max(confidences.rows / sample, 1);
  bool has_rows = false;
  for (int row = 0; row < confidences.rows; row += step) {
    const std::vector<float> numbers = finite_row(confidences, row);
    if (numbers.empty()) continue;
    const float sum = std::accumulate(numbers.begin(), numbers.end(), 0.0F);
    const float smallest = *std::min_element(numbers.begin(), numbers.end());
    if (smallest < 0 || std::abs(sum - 1) > 1e-2F) return false;
    has_rows = true;
  }
  return has_rows;
}

std::vector<Detection> decode_yolact(const YolactOutputs& outputs, const Table& priors,
                                     const cv::Size& input, const DetectionOptions& options) {
  FiniteScores seen;
  const bool are_logits = !are_probabilities(outputs.confidences);
  std::vector<Detection> found;
  for (int row = 0; row < outputs.confidences.rows; ++row) {
    const std::vector<float> scores = probabilities_of(outputs.confidences, row, are_logits);
    if (!cv::checkRange(scores)) continue;
    const float best = seen.probability(*std::max_element(scores.begin() + 1, scores.end()));
    if (!(best > min_confidence) || !(best > options.score_threshold)) continue;
    const Box box = decoded_box(outputs.locations[row], priors[row], input);
    const std::vector<float> coefficients = finite_row(outputs.coefficients, row);
    if (!box.has_area() || coefficients.empty()) continue;
    for (int class_id = 0; class_id < outputs.class_count(); ++class_id) {
      const float score = std::clamp(scores[static_cast<std::size_t>(class_id) + 1], 0.0F, 1.0F);
      if (options.wants(class_id) && score > options.score_threshold) {
        found.push_back({class_id, score, box, coefficients});
      }
    }
  }
  seen.require_some(outputs.confidences.rows);
  return best_detections(std::move(found), options);
}

}  // namespace dynfilter::detail
