// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The images of a sequence's folder, as its lists or its names have them.

#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace dynfilter::detail {

/// An image as a list names it.
struct ListedImage {
  double time_s = 0;
  std::string file;  ///< as written
  std::filesystem::path path;
  std::filesystem::path list;  ///< or the folder, for an image that no list names
  std::size_t line = 0;        ///< 0: no list
};

/// A frame and the place that lists it.
struct ListedFrame {
  ListedImage image;
  ListedImage depth;  ///< without a file, if it is not listed beside the image
};

/// The lists of a folder, before images are paired.
struct ImageLists {
  bool are_pairs = false;  ///< of associations.txt
  std::vector<ListedFrame> frames;
  std::vector<ListedFrame> depths;  ///< images of depth.txt, to be paired with those of the frames
};

/// Reads the lists of TUM, EuRoC's csv or KITTI's times, or takes the images of a plain folder by
/// their names. Throws std::runtime_error that names the file and the line.
ImageLists read_image_lists(const std::filesystem::path& folder);

}  // namespace dynfilter::detail
