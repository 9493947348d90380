// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The images of a sequence's folder, as its lists or its names have them.

#ifndef DYNFILTER_SRC_EVALUATION_IMAGE_LISTS_HPP
#define DYNFILTER_SRC_EVALUATION_IMAGE_LISTS_HPP

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

/// A frame and the place that lists it. depth.file is empty in a sequence of colour images only.
struct ListedFrame {
  ListedImage image, depth;
};

/// The lists of a folder, before images are paired.
struct ImageLists {
  bool has_associations = false;
  std::vector<ListedFrame> frames;  ///< of associations.txt, or of colour images only
  std::vector<ListedImage> images;  ///< of rgb.txt, to be paired
  std::vector<ListedImage> depths;  ///< of depth.txt
};

/// Reads the lists of TUM, EuRoC's csv or KITTI's times, or takes the images of a plain folder by
/// their names. Throws std::runtime_error that names the file and the line.
ImageLists read_image_lists(const std::filesystem::path& folder);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_EVALUATION_IMAGE_LISTS_HPP
