// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "dynfilter/evaluation/rgbd_sequence.hpp"

namespace dynfilter::tools {

/// Returns the folder below which the results have the images' paths: a plain folder of images
/// itself, or else, as other images or things lie beside, the first one inside that holds them all.
std::filesystem::path image_folder_of(const RgbdSequence& sequence, bool of_depth);

constexpr const char* labels_format = "labels";

/// Returns the names of the mask images, by the index of their frames: "labels" are in one folder,
/// by known times or as the images, "colmap" adds .png to the image's whole name, "depth" keeps the
/// names of the depth images, the others put .png in place of the extension. Refuses equal names,
/// and labels that no table can hold.
std::vector<std::filesystem::path> mask_names(const RgbdSequence& sequence,
                                              const std::filesystem::path& image_folder,
                                              const std::string& format);

/// Prints the call that reads the masks. COLMAP uses an image without a mask whole, silently.
void print_colmap(const std::filesystem::path& images, std::size_t masks,
                  const std::filesystem::path& out);

}  // namespace dynfilter::tools
