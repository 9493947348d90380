// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "mask_images.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/host_masks.hpp"
#include "io/file_error.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;

/// Returns the beginning that two paths share.
fs::path common_path(const fs::path& a, const fs::path& b) {
  fs::path common;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end() && *i == *j; ++i, ++j) {
    common /= *i;
  }
  return common;
}

fs::path image_path(const RgbdSequence& sequence, std::size_t i) {
  return fs::absolute(sequence.entry(i).image_path).lexically_normal();
}

/// Returns the segmentation with the masks of dynamic objects corrected by depth, as the rule depth
/// judges pixels.
Segmentation refined(const FrameView& frame, const Segmentation& masks, const MaskCuller& culler) {
  const DepthCompensator rule;
  Segmentation refined = masks;
  for (std::size_t k = 0; k < masks.instances.size(); ++k) {
    if (!culler.is_dynamic(masks.instances[k].class_id)) continue;
    refined.instances[k] = rule.refined(frame, masks, k);
  }
  return refined;
}

}  // namespace

const std::vector<std::string>& mask_image_formats() {
  static const std::vector<std::string> formats = {"colmap", "static", "dynamic"};
  return formats;
}

MaskImages::MaskImages(const RgbdSequence& sequence, MaskImageOptions options)
    : options_(std::move(options)), culler_(options_.mask_culler) {
  if (options_.refines && !sequence.has_depth()) {
    detail::throw_file_error(sequence.folder(), "has no depth, which --refine needs");
  }
  find_image_folder(sequence);
  make_names(sequence);
  find_other_images(sequence);
}

void MaskImages::find_image_folder(const RgbdSequence& sequence) {
  image_folder_ = image_path(sequence, 0).parent_path();
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    image_folder_ = common_path(image_folder_, image_path(sequence, i).parent_path());
  }
}

void MaskImages::make_names(const RgbdSequence& sequence) {
  std::set<fs::path> used;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    fs::path name = image_path(sequence, i).lexically_relative(image_folder_);
    if (options_.format != "colmap") name.replace_extension();
    name += ".png";
    if (!used.insert(name).second) {
      detail::throw_file_error(
          sequence.entry(i).image_path,
          "the mask of another image would have the same name, " + name.string());
    }
    names_.push_back(std::move(name));
  }
}

void MaskImages::find_other_images(const RgbdSequence& sequence) {
  std::set<fs::path> images, extensions;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const fs::path image = image_path(sequence, i);
    images.insert(image);
    extensions.insert(image.extension());
  }
  // What cannot be read here is none of the reader's images either.
  constexpr auto options = fs::directory_options::skip_permission_denied;
  for (const auto& entry : fs::recursive_directory_iterator(image_folder_, options)) {
    const bool looks_like_one = extensions.count(entry.path().extension()) > 0;
    if (!looks_like_one || images.count(entry.path()) > 0) continue;
    images_without_frame_.push_back(entry.path().lexically_relative(image_folder_));
  }
  std::sort(images_without_frame_.begin(), images_without_frame_.end());
}

cv::Mat MaskImages::mask_of(const FrameView& frame, const Segmentation& masks) const {
  const Segmentation shown = options_.refines ? refined(frame, masks, culler_) : masks;
  return options_.format == "dynamic" ? mask_of_dynamic_pixels(shown, culler_)
                                      : mask_of_static_pixels(shown, culler_);
}

}  // namespace dynfilter::tools
