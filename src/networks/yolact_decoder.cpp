// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "yolact_decoder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <initializer_list>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "finite_scores.hpp"
#include "non_maximum_suppression.hpp"

namespace dynfilter::detail {
namespace {

// --- Binding -------------------------------------------------------------------------------------

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

const NamedTensor& need(const NamedTensor* output, const char* what) {
  if (output == nullptr) throw std::runtime_error(std::string("the ") + what + " are missing");
  return *output;
}

bool is_table(const cv::Mat& data) { return data.dims == 3 && data.size[0] == 1; }

int rows_of(const cv::Mat& table) { return table.size[table.dims - 2]; }
int columns_of(const cv::Mat& table) { return table.size[table.dims - 1]; }

/// Takes the priors out of the list. They have no batch dimension; if they have one after all,
/// their name identifies them.
const NamedTensor* take_priors(Outputs& unbound) {
  const NamedTensor* priors = take(unbound, "priors", {"prior", "anchor"}, [](const cv::Mat& data) {
    return data.dims == 2 && data.size[1] == 4;
  });
  if (priors != nullptr) return priors;
  const auto named = std::find_if(unbound.begin(), unbound.end(), [](const NamedTensor* output) {
    return is_table(output->data) && columns_of(output->data) == 4 &&
           is_named(*output, {"prior", "anchor"});
  });
  if (named == unbound.end()) return nullptr;
  priors = *named;
  unbound.erase(named);
  return priors;
}

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

// As published: the least confidence, and the candidates of each class that enter Fast NMS.
constexpr float min_confidence = 0.05F;
constexpr int max_per_class = 200;

/// Reads the probabilities of one row, the background's first, by softmax from logits.
void read_probabilities(const Table& confidences, int row, bool are_logits,
                        std::vector<float>& probabilities) {
  for (int c = 0; c < confidences.columns; ++c) {
    probabilities[static_cast<std::size_t>(c)] = confidences.at(row, c);
  }
  if (!are_logits) return;
  const float largest = *std::max_element(probabilities.begin(), probabilities.end());
  float sum = 0;
  for (float& value : probabilities) {
    value = std::exp(value - largest);
    sum += value;
  }
  for (float& value : probabilities) value /= sum;
}

/// Decodes a box from SSD's coding (W. Liu et al., ECCV 2016) with its variances 0.1 and 0.2, as
/// fractions of the input.
Box decoded_box(const Table& locations, const Table& priors, int row) {
  const float width = priors.at(row, 2) * std::exp(locations.at(row, 2) * 0.2F);
  const float height = priors.at(row, 3) * std::exp(locations.at(row, 3) * 0.2F);
  const float x = priors.at(row, 0) + locations.at(row, 0) * 0.1F * priors.at(row, 2) - width / 2;
  const float y = priors.at(row, 1) + locations.at(row, 1) * 0.1F * priors.at(row, 3) - height / 2;
  return {x, y, x + width, y + height};
}

std::vector<Candidate> candidates_of(const YolactOutputs& outputs, const Table& priors,
                                     const DetectionOptions& options) {
  std::vector<int> wanted;
  for (int c = 0; c < outputs.class_count(); ++c) {
    if (options.is_wanted(c)) wanted.push_back(c);
  }
  FiniteScores seen;
  const bool are_logits = !are_probabilities(outputs.confidences);
  std::vector<float> scores(static_cast<std::size_t>(outputs.confidences.columns));
  std::vector<Candidate> candidates;
  for (int row = 0; row < outputs.confidences.rows; ++row) {
    read_probabilities(outputs.confidences, row, are_logits, scores);
    if (!std::all_of(scores.begin(), scores.end(), [](float s) { return std::isfinite(s); })) {
      continue;
    }
    const float best = seen.probability(*std::max_element(scores.begin() + 1, scores.end()));
    if (!(best > min_confidence) || !(best > options.score_threshold)) continue;
    const Box box = decoded_box(outputs.locations, priors, row);
    if (!box.is_finite() || !box.has_area() || finite_row(outputs.coefficients, row).empty()) {
      continue;
    }
    for (const int class_id : wanted) {
      const float score = std::clamp(scores[static_cast<std::size_t>(class_id) + 1], 0.0F, 1.0F);
      if (score > options.score_threshold) candidates.push_back({class_id, score, row, box});
    }
  }
  seen.require_some(outputs.confidences.rows);
  return candidates;
}

Detection detection_of(const Candidate& candidate, const Table& coefficients,
                       const cv::Size& input) {
  Detection detection;
  detection.class_id = candidate.class_id;
  detection.score = candidate.score;
  const auto width = static_cast<float>(input.width);
  const auto height = static_cast<float>(input.height);
  detection.box = {candidate.box.x1 * width, candidate.box.y1 * height, candidate.box.x2 * width,
                   candidate.box.y2 * height};
  detection.coefficients = finite_row(coefficients, candidate.row);
  return detection;
}

}  // namespace

YolactOutputs bind_yolact(const std::vector<NamedTensor>& outputs) {
  Outputs unbound;
  for (const NamedTensor& output : outputs) unbound.push_back(&output);

  const NamedTensor* priors = take_priors(unbound);
  const NamedTensor& locations =
      need(take(unbound, "locations [1, N, 4]", {"loc", "bbox", "box"},
                [](const cv::Mat& data) { return is_table(data) && columns_of(data) == 4; }),
           "locations [1, N, 4]");
  const int rows = rows_of(locations.data);
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
  const NamedTensor& coefficients =
      need(take(unbound, "coefficients [1, N, P]", {"mask", "coef"}, fits_a_grid),
           "coefficients [1, N, P] with prototypes [1, h, w, P] or [1, P, h, w]");
  const NamedTensor& confidences = need(
      take(unbound, "confidences [1, N, C+1]", {"conf", "cls", "class", "score"},
           [&](const cv::Mat& data) { return is_table_of_rows(data) && columns_of(data) >= 2; }),
      "confidences [1, N, C+1]");
  const int count = columns_of(coefficients.data);
  const NamedTensor& prototypes =
      need(take(unbound, "prototypes", {"proto"},
                [&](const cv::Mat& data) { return is_grid_for(data, count); }),
           "prototypes");

  YolactOutputs bound;
  bound.locations = rows_first(locations.data);
  bound.confidences = rows_first(confidences.data);
  bound.coefficients = rows_first(coefficients.data);
  bound.prototypes = prototypes.data.size[3] == count ? prototypes_last(prototypes.data)
                                                      : prototypes_first(prototypes.data);
  if (priors != nullptr) {
    bound.priors = rows_first(priors->data);
    if (bound.priors.rows != rows) {
      throw std::runtime_error(
          concatenate("there are ", bound.priors.rows, " priors for ", rows, " locations"));
    }
  }
  return bound;
}

cv::Mat yolact_priors(int count, const cv::Size& input) {
  const std::array<cv::Size, levels> maps = feature_maps(input);
  int cells = 0;
  for (const cv::Size& map : maps) cells += map.area();
  const int wanted = 3 * cells;
  if (count != wanted) {
    throw std::runtime_error(concatenate("it has ", count, " priors; YOLACT has ", wanted,
                                         " for an input of ", size_name(input),
                                         "; export the priors as an output"));
  }
  cv::Mat priors(count, 4, CV_32F);
  int row = 0;
  for (std::size_t level = 0; level < maps.size(); ++level) {
    const cv::Size& map = maps[level];
    const double scale = scale_at(level, input.width);
    for (int cell = 0; cell < map.area(); ++cell) {
      for (const double ratio : aspect_ratios) {
        const auto side = static_cast<float>(scale * std::sqrt(ratio) / input.width);
        float* prior = priors.ptr<float>(row++);
        prior[0] = static_cast<float>((cell % map.width + 0.5) / map.width);
        prior[1] = static_cast<float>((cell / map.width + 0.5) / map.height);
        prior[2] = prior[3] = side;  // YOLACT was trained with squares, by a bug, and keeps them
      }
    }
  }
  return priors;
}

bool are_probabilities(const Table& confidences) {
  constexpr int sample = 64;
  const int step = std::max(confidences.rows / sample, 1);
  bool has_rows = false;
  for (int row = 0; row < confidences.rows; row += step) {
    float sum = 0;
    float smallest = 0;
    for (int c = 0; c < confidences.columns; ++c) {
      sum += confidences.at(row, c);
      smallest = std::min(smallest, confidences.at(row, c));
    }
    if (!std::isfinite(sum)) continue;
    if (smallest < 0 || std::abs(sum - 1) > 1e-2F) return false;
    has_rows = true;
  }
  return has_rows;
}

std::vector<Detection> decode_yolact(const YolactOutputs& outputs, const Table& priors,
                                     const cv::Size& input, const DetectionOptions& options) {
  const std::vector<Candidate> candidates =
      suppress_fast(candidates_of(outputs, priors, options), options.iou_threshold, max_per_class);
  std::vector<Detection> detections;
  for (const Candidate& candidate : candidates) {
    if (detections.size() == static_cast<std::size_t>(options.max_detections)) break;
    detections.push_back(detection_of(candidate, outputs.coefficients, input));
  }
  return detections;
}

}  // namespace dynfilter::detail
