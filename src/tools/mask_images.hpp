// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Mask images for systems that read one beside each image.

#ifndef DYNFILTER_SRC_TOOLS_MASK_IMAGES_HPP
#define DYNFILTER_SRC_TOOLS_MASK_IMAGES_HPP

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter::tools {

/// Options of MaskImages.
struct MaskImageOptions {
  /// One of mask_image_formats(): "colmap" and "static" have 255 on static pixels and 0 on dynamic
  /// ones, "dynamic" is the inverse. "colmap" adds .png to the image's whole name, the others put
  /// it in place of the extension.
  std::string format = "colmap";
  bool refines = false;  ///< let the rule depth correct the masks first
  MaskCullerOptions mask_culler;
};

/// Returns the formats' names.
const std::vector<std::string>& mask_image_formats();

/// Names and makes the mask images of a sequence: CV_8UC1, 0 or 255, of the image's size.
class MaskImages {
 public:
  /// Throws std::runtime_error that names the sequence: for two images whose masks would have one
  /// name, and for options.refines without depth. O(n log n) of the images.
  MaskImages(const RgbdSequence& sequence, MaskImageOptions options);

  /// Returns the deepest folder that holds all images; the masks have the images' paths below it.
  const std::filesystem::path& image_folder() const { return image_folder_; }

  /// Returns the names of the masks, by the index of their frames.
  const std::vector<std::filesystem::path>& names() const { return names_; }

  /// Returns the files below the images' folder that look like images and are no frames, sorted,
  /// with their paths below it. They have no mask.
  const std::vector<std::filesystem::path>& images_without_frame() const {
    return images_without_frame_;
  }

  /// Makes the mask of a frame. Throws std::invalid_argument for malformed input.
  cv::Mat mask_of(const FrameView& frame, const Segmentation& masks) const;

 private:
  void find_image_folder(const RgbdSequence& sequence);
  void make_names(const RgbdSequence& sequence);
  void find_other_images(const RgbdSequence& sequence);

  MaskImageOptions options_;
  MaskCuller culler_;
  std::filesystem::path image_folder_;
  std::vector<std::filesystem::path> names_;
  std::vector<std::filesystem::path> images_without_frame_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_MASK_IMAGES_HPP
