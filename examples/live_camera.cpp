// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// live_camera NUMBER|FILM MODEL.onnx shows kept and removed features, or writes live_camera.mp4.

#include <cstdlib>
#include <iostream>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/networks/network_segmenter.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/highgui.hpp>
#include <opencv2/videoio.hpp>

int main(int argc, char** argv) try {
  const std::string name = argc == 3 ? argv[1] : "", usage = "live_camera NUMBER|FILM MODEL.onnx";
  cv::VideoCapture camera;
  const bool is_open = name.size() == 1 ? camera.open(std::stoi(name)) : camera.open(name);
  if (!is_open) throw std::runtime_error(usage + ": OpenCV opens no \"" + name + '"');
  dynfilter::NetworkSegmenter people(argv[2]);
  dynfilter::DynamicFilterOptions options;
  options.mask_culler.dynamic_classes = {people.class_id("person").value_or(0)};
  const dynfilter::DynamicFilter filter(options);
  const bool has_display = std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY");
  cv::VideoWriter film;
  dynfilter::FrameView frame;
  for (int key = -1; key < 0 && camera.read(frame.image); ++frame.id) {  // until a key is pressed
    std::vector<cv::KeyPoint> features;
    cv::ORB::create(1000)->detect(frame.image, features);
    const dynfilter::Segmentation masks = people.segment(frame);
    const auto labels = filter.apply(frame, masks, features);
    const cv::Mat picture = dynfilter::draw_overlay(frame.image, masks, features, labels);
    if (!has_display && frame.id == 0) film.open("live_camera.mp4", 0x7634706d, 15, picture.size());
    if (!has_display && !film.isOpened()) throw std::runtime_error("cannot write live_camera.mp4");
    has_display ? cv::imshow("dynfilter", picture) : film.write(picture);
    if (has_display) key = cv::waitKey(1);
  }
  if (frame.id == 0) throw std::runtime_error('"' + name + "\" gives no image");
} catch (const std::exception& error) {
  return std::cerr << error.what() << '\n', 1;
}
