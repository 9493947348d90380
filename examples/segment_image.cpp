// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Prints the instances that a network finds in an image: segment_image MODEL.onnx IMAGE

#include <cstddef>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>

#include <dynfilter/networks/network_segmenter.hpp>
#include <opencv2/imgcodecs.hpp>

namespace {

void print_instances(const std::string& model, const std::string& image) {
  dynfilter::NetworkOptions options;
  options.score_threshold = 0.3F;
  dynfilter::NetworkSegmenter network(model, options);

  dynfilter::FrameView frame;
  frame.image = cv::imread(image);
  if (frame.image.empty()) throw std::runtime_error(image + ": cannot be read as an image");
  const dynfilter::Segmentation found = network.segment(frame);

  std::cout << found.instances.size() << " instances\n";
  for (const dynfilter::Instance& instance : found.instances) {
    const auto id = static_cast<std::size_t>(instance.class_id);
    const bool has_name = id < network.class_names().size();
    std::cout << instance.score << "  "
              << (has_name ? network.class_names()[id] : std::to_string(instance.class_id)) << "  "
              << instance.box << '\n';
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: segment_image MODEL.onnx IMAGE\n";
    return 2;
  }
  try {
    print_instances(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
