// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "loaded_network.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "class_names.hpp"
#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail {
namespace {

/// Returns the names of `count` classes; 0 means that the number is unknown.
std::vector<std::string> class_names(const Network& network, int count) {
  const auto written = network.metadata().find("names");
  if (written != network.metadata().end()) {
    const std::vector<std::string> names = parse_class_names(written->second);
    const bool fits = count == 0 || names.size() == static_cast<std::size_t>(count);
    if (!names.empty() && fits) return names;
  }
  return count == 80 ? coco_class_names() : std::vector<std::string>();
}

}  // namespace

void require_valid(const NetworkOptions& options, const char* component) {
  const std::optional<float>& score = options.score_threshold;
  if (score && !(*score >= 0 && *score <= 1)) {
    throw_misuse(component, concatenate("score_threshold = ", *score), "0 to 1");
  }
  const cv::Size size = options.input_size;
  const bool is_open = size == cv::Size();
  const bool is_sane =
      size.width > 0 && size.height > 0 && size.width <= 1 << 14 && size.height <= 1 << 14;
  if (!is_open && !is_sane) {
    throw_misuse(component, "input_size " + size_name(size),
                 "0x0 for the model's own, or 1x1 to 16384x16384");
  }
  for (const int class_id : options.classes) {
    if (class_id < 0) {
      throw_misuse(component, concatenate("class ", class_id, " in classes"), "ids from 0 on");
    }
  }
}

DetectionOptions detection_options(const NetworkOptions& options, const UsualThresholds& usual) {
  DetectionOptions result;
  result.is_wanted = [classes = options.classes](int class_id) {
    return classes.empty() || std::find(classes.begin(), classes.end(), class_id) != classes.end();
  };
  result.score_threshold = options.score_threshold.value_or(usual.score);
  result.iou_threshold = usual.iou;
  result.max_detections = usual.max_instances;
  return result;
}

std::vector<NamedTensor> outputs_of_trial(Network& network) {
  const std::array<int, 4> shape = {1, 3, network.input_size().height, network.input_size().width};
  return network.forward(cv::Mat(4, shape.data(), CV_32F, cv::Scalar(0)));
}

std::unique_ptr<LoadedNetwork> assemble(Network network, const std::vector<NamedTensor>& trial,
                                        std::unique_ptr<NetworkKind> kind,
                                        const NetworkOptions& options, const char* component) {
  int count = 0;
  try {
    count = kind->prepare(trial);
  } catch (const std::runtime_error& error) {
    network.fail(std::string(error.what()) + "; its outputs are " + shapes_text(trial));
  }
  for (const int class_id : options.classes) {
    if (count > 0 && class_id >= count) {
      throw_misuse(component, concatenate("class ", class_id, " in classes"),
                   concatenate("0 to ", count - 1, ", the classes of ", network.path().string()));
    }
  }
  std::vector<std::string> names = class_names(network, count);
  return std::make_unique<LoadedNetwork>(
      LoadedNetwork{std::move(network), std::move(kind), std::move(names)});
}

}  // namespace dynfilter::detail
