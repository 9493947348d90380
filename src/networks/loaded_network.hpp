// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The parts of a NetworkSegmenter: a network, its preprocessing and its decoder.

#ifndef DYNFILTER_SRC_NETWORKS_LOADED_NETWORK_HPP
#define DYNFILTER_SRC_NETWORKS_LOADED_NETWORK_HPP

#include <memory>
#include <string>
#include <vector>

#include "detections.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/networks/network_segmenter.hpp"
#include "input_placement.hpp"
#include "network.hpp"

namespace dynfilter::detail {

/// A kind of network: its preprocessing and its decoder.
class NetworkKind {
 public:
  virtual ~NetworkKind() = default;

  /// Brings a BGR image to the input's size.
  virtual PlacedImage place(const cv::Mat& image, const cv::Size& input) const = 0;

  /// Makes the input [1, 3, rows, columns].
  virtual cv::Mat tensor_of(const PlacedImage& placed) const = 0;

  /// Inspects the outputs for an empty image, once, and returns the number of classes; 0 = unknown.
  /// Throws std::runtime_error that says what the outputs lack.
  virtual int prepare(const std::vector<NamedTensor>& outputs) = 0;

  /// Returns the instances in the image, the highest score first. Throws as prepare does.
  virtual std::vector<Instance> decode(const std::vector<NamedTensor>& outputs,
                                       const InputPlacement& placement) const = 0;
};

struct LoadedNetwork {
  Network network;
  std::unique_ptr<NetworkKind> kind;
  std::vector<std::string> class_names;
};

/// The default thresholds of a kind of network.
struct UsualThresholds {
  float score, iou;
  int max_instances;
};

/// Throws std::invalid_argument for options out of range; the message begins with `component`.
void require_valid(const NetworkOptions& options, const char* component);

DetectionOptions detection_options(const NetworkOptions& options, const UsualThresholds& usual);

/// Runs the network on an empty image, so that the outputs' shapes are known before the first
/// frame.
std::vector<NamedTensor> outputs_of_trial(Network& network);

/// Assembles the parts. Throws std::runtime_error if the outputs do not fit the kind, and
/// std::invalid_argument for options that do not fit the number of classes.
std::unique_ptr<LoadedNetwork> assemble(Network network, const std::vector<NamedTensor>& trial,
                                        std::unique_ptr<NetworkKind> kind,
                                        const NetworkOptions& options, const char* component);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_LOADED_NETWORK_HPP
