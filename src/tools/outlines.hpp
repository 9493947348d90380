// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Objects as labelling tools describe them: polygons, runs of pixels, or boxes.

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/instance.hpp"

namespace dynfilter::tools {

/// An object in an image of size `unit`; 1x1 for coordinates of 0 to 1.
struct Outline {
  std::string label;  ///< name of its class, or id as YOLO counts: a person is 0
  float score = 1;
  cv::Size2d unit;  ///< empty: the frame's
  cv::Rect2d box;   ///< the detector's; empty: not known
  std::vector<std::vector<cv::Point2d>> polygons;
  std::vector<std::uint32_t> runs;  ///< off, on, off …, column by column, of an image of run_size
  cv::Size run_size;
};

/// The objects of images, by the images' names. An image without any shows nobody.
using Outlines = std::map<std::string, std::vector<Outline>>;

/// Reads COCO's JSON: annotations, or results, whose images are names or numbers. Throws
/// std::runtime_error that names the file.
Outlines read_coco(const std::filesystem::path& file);

/// Reads YOLO's labels: class and polygon, or class, centre and size of a box, and maybe a score at
/// the end, of 0 to 1. Throws std::runtime_error that names file and line.
std::vector<Outline> read_yolo_labels(const std::filesystem::path& file);

/// Returns the instance of a frame of this size, with a box 20 px larger where the detector's is
/// not known. `room` is how many pixels masks may have, of which it takes those of this one: work
/// is bounded by the frame. Throws std::runtime_error that names the file.
Instance instance_of(const Outline& outline, cv::Size frame, double& room,
                     const std::filesystem::path& file);

}  // namespace dynfilter::tools
