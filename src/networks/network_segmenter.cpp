// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/networks/network_segmenter.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "class_names.hpp"
#include "dynfilter/detail/errors.hpp"
#include "network_kinds.hpp"

namespace dynfilter {
namespace {

constexpr const char* component = "NetworkSegmenter";

/// Throws std::invalid_argument for options out of range.
void require_valid(const NetworkOptions& options) {
  const std::optional<float>& score = options.score_threshold;
  if (score && !(*score >= 0 && *score <= 1)) {
    detail::throw_misuse(component, detail::concatenate("score_threshold = ", *score), "0 to 1");
  }
  const cv::Size size = options.input_size;
  if (size == cv::Size() || detail::is_sane_input(size)) return;
  detail::throw_misuse(component, "input_size " + detail::size_name(size),
                       detail::concatenate("0x0 for the model's own, or at most ",
                                           detail::max_input_pixels, " pixels"));
}

/// Throws std::invalid_argument for classes that are not among so many (0: unknown).
void require_classes(const NetworkOptions& options, int count) {
  for (const int class_id : options.classes) {
    if (class_id >= 0 && (count == 0 || class_id < count)) continue;
    detail::throw_misuse(component, detail::concatenate("class ", class_id, " in classes"),
                         count == 0 ? "ids from 0 on" : detail::concatenate("0 to ", count - 1));
  }
}

cv::Mat bgr_image(const FrameView& frame) {
  if (frame.image.empty() || frame.image.dims != 2 ||
      (frame.image.type() != CV_8UC1 && frame.image.type() != CV_8UC3)) {
    detail::throw_misuse(component,
                         frame.image.empty() ? "a frame without an image"
                                             : "an image of type " + detail::type_name(frame.image),
                         "8 bits, grey or BGR");
  }
  if (frame.image.type() == CV_8UC3) return frame.image;
  cv::Mat bgr;
  cv::cvtColor(frame.image, bgr, cv::COLOR_GRAY2BGR);
  return bgr;
}

/// Makes the kind if the outputs fit, else adds why they do not.
template <class Kind>
void try_kind(const char* name, std::unique_ptr<detail::NetworkKind>& kind, std::string& objections,
              const detail::Network& network, const std::vector<detail::NamedTensor>& trial,
              const NetworkOptions& options) {
  if (kind) return;
  try {
    kind = std::make_unique<Kind>(network, trial, options);
  } catch (const std::runtime_error& error) {
    objections += std::string(". ") + name + ": " + error.what();
  }
}

/// Runs the network on an empty image, and recognises its kind by the outputs.
std::unique_ptr<detail::NetworkKind> kind_of(detail::Network& network,
                                             const NetworkOptions& options) {
  const cv::Size size = network.input_size();
  const std::array<int, 4> shape = {1, 3, size.height, size.width};
  const std::vector<detail::NamedTensor> trial =
      network.forward(cv::Mat(4, shape.data(), CV_32F, cv::Scalar(0)));
  std::unique_ptr<detail::NetworkKind> kind;
  std::string objections;
  try_kind<detail::YolactKind>("YOLACT", kind, objections, network, trial, options);
  try_kind<detail::YoloKind>("YOLO", kind, objections, network, trial, options);
  try_kind<detail::SemanticKind>("Semantic", kind, objections, network, trial, options);
  if (kind) return kind;
  network.fail("is no known kind of network by its outputs, " + detail::shapes_text(trial) +
               objections + "; run other networks in their own process, see examples/remote_masks");
}

/// Returns the names of `count` classes; 0 means that the number is unknown.
std::vector<std::string> class_names(const detail::Network& network, int count) {
  std::vector<std::string> names = detail::parse_class_names(network.metadata("names"));
  if (!names.empty() && (count == 0 || names.size() == static_cast<std::size_t>(count))) {
    return names;
  }
  return count == 80 ? detail::coco_class_names() : std::vector<std::string>();
}

std::unique_ptr<detail::LoadedNetwork> load(const std::filesystem::path& model,
                                            const NetworkOptions& options) {
  require_valid(options);
  require_classes(options, 0);
  detail::Network network(model, options);
  std::unique_ptr<detail::NetworkKind> kind = kind_of(network, options);
  require_classes(options, kind->class_count());
  std::vector<std::string> names = class_names(network, kind->class_count());
  return std::make_unique<detail::LoadedNetwork>(
      detail::LoadedNetwork{std::move(network), std::move(kind), std::move(names)});
}

}  // namespace

NetworkSegmenter::NetworkSegmenter(const std::filesystem::path& model,
                                   const NetworkOptions& options)
    : network_(load(model, options)) {}
NetworkSegmenter::NetworkSegmenter(NetworkSegmenter&&) noexcept = default;
NetworkSegmenter& NetworkSegmenter::operator=(NetworkSegmenter&&) noexcept = default;
NetworkSegmenter::~NetworkSegmenter() = default;

const std::vector<std::string>& NetworkSegmenter::class_names() const {
  return network_->class_names;
}

std::optional<int> NetworkSegmenter::class_id(const std::string& name) const {
  const std::vector<std::string>& names = network_->class_names;
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return {};
  return static_cast<int>(found - names.begin());
}

cv::Size NetworkSegmenter::input_size() const { return network_->network.input_size(); }

Segmentation NetworkSegmenter::do_segment(const FrameView& frame) {
  detail::Network& network = network_->network;
  const detail::PlacedImage input = network_->kind->input_of(bgr_image(frame));
  const std::vector<detail::NamedTensor> outputs = network.forward(input.pixels);
  Segmentation result = empty_segmentation(frame);
  try {
    result.instances = network_->kind->decode(outputs, input.placement);
  } catch (const std::runtime_error& error) {
    network.fail(error.what());
  }
  return result;
}

}  // namespace dynfilter
