// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/networks/network_segmenter.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/networks/yolact_segmenter.hpp"
#include "dynfilter/networks/yolo_segmenter.hpp"
#include "loaded_network.hpp"
#include "network_kinds.hpp"

namespace dynfilter {
namespace {

cv::Mat bgr_image(const FrameView& frame) {
  if (frame.image.empty() || frame.image.dims != 2 ||
      (frame.image.type() != CV_8UC1 && frame.image.type() != CV_8UC3)) {
    detail::throw_misuse("NetworkSegmenter",
                         frame.image.empty() ? "a frame without an image"
                                             : "an image of type " + detail::type_name(frame.image),
                         "8 bits, grey or BGR");
  }
  if (frame.image.type() == CV_8UC3) return frame.image;
  cv::Mat bgr;
  cv::cvtColor(frame.image, bgr, cv::COLOR_GRAY2BGR);
  return bgr;
}

/// Returns why the outputs do not fit a kind of network; empty if they do.
template <class Bind>
std::string objection(const Bind& bind) {
  try {
    bind();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

std::unique_ptr<detail::NetworkKind> kind_of(const detail::Network& network,
                                             const std::vector<detail::NamedTensor>& trial,
                                             const NetworkOptions& options) {
  const cv::Size input = network.input_size();
  const std::string not_yolact = objection([&] { detail::bind_yolact(trial); });
  if (not_yolact.empty()) return std::make_unique<detail::YolactKind>(input, options);
  const std::string not_yolo = objection([&] { detail::bind_yolo(trial, input); });
  if (not_yolo.empty()) return std::make_unique<detail::YoloKind>(input, options);
  network.fail("is no known kind of network by its outputs, " + detail::shapes_text(trial) +
               ". YOLACT: " + not_yolact + ". YOLO: " + not_yolo +
               "; run other networks in their own process, see examples/remote_masks");
}

/// Loads a network that must be of this kind.
template <class Kind>
std::unique_ptr<detail::LoadedNetwork> load(const std::filesystem::path& model,
                                            const NetworkOptions& options, const char* component) {
  detail::require_valid(options, component);
  detail::Network network(model, options.input_size);
  const std::vector<detail::NamedTensor> trial = detail::outputs_of_trial(network);
  auto kind = std::make_unique<Kind>(network.input_size(), options);
  return detail::assemble(std::move(network), trial, std::move(kind), options, component);
}

}  // namespace

NetworkSegmenter::NetworkSegmenter(std::unique_ptr<detail::LoadedNetwork> network)
    : network_(std::move(network)) {}
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
  const detail::NetworkKind& kind = *network_->kind;
  const detail::PlacedImage placed = kind.place(bgr_image(frame), network.input_size());
  const std::vector<detail::NamedTensor> outputs = network.forward(kind.tensor_of(placed));
  Segmentation result = empty_segmentation(frame);
  try {
    result.instances = kind.decode(outputs, placed.placement);
  } catch (const std::runtime_error& error) {
    network.fail(error.what());
  }
  return result;
}

YoloSegmenter::YoloSegmenter(const std::filesystem::path& model, const NetworkOptions& options)
    : NetworkSegmenter(load<detail::YoloKind>(model, options, "YoloSegmenter")) {}

YolactSegmenter::YolactSegmenter(const std::filesystem::path& model, const NetworkOptions& options)
    : NetworkSegmenter(load<detail::YolactKind>(model, options, "YolactSegmenter")) {}

std::unique_ptr<NetworkSegmenter> make_network_segmenter(const std::filesystem::path& model,
                                                         const NetworkOptions& options) {
  constexpr const char* name = "make_network_segmenter";
  detail::require_valid(options, name);
  detail::Network network(model, options.input_size);
  const std::vector<detail::NamedTensor> trial = detail::outputs_of_trial(network);
  std::unique_ptr<detail::NetworkKind> kind = kind_of(network, trial, options);
  return std::unique_ptr<NetworkSegmenter>(new NetworkSegmenter(
      detail::assemble(std::move(network), trial, std::move(kind), options, name)));
}

}  // namespace dynfilter
