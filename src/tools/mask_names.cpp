// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "mask_names.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <set>
#include <utility>

#include "io/file_error.hpp"
#include "io/frame_names.hpp"
#include "io/staged_folder.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;

/// Returns the path of a frame's image, or of its depth.
fs::path image_path(const RgbdSequence& sequence, std::size_t i, bool of_depth = false) {
  const RgbdSequenceEntry& entry = sequence.entry(i);
  return fs::absolute(of_depth ? entry.depth_path : entry.image_path).lexically_normal();
}

/// Counts the images of a folder and of those inside.
std::size_t images_below(const fs::path& folder) {
  const auto options = fs::directory_options::skip_permission_denied;
  std::size_t count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder, options)) {
    count += entry.is_regular_file() && detail::is_image_name(entry.path()) ? 1 : 0;
  }
  return count;
}

/// Quotes a path for a shell.
std::string shell_word(const fs::path& path) {
  std::string text;
  for (const char c : path.string()) text += c == '\'' ? "'\\''" : std::string(1, c);
  return "'" + text + "'";
}

/// Returns the name of a frame's label map: the image's or, if that is not the known time of the
/// frame, by which the plugin looks for it, the time.
std::string label_name(const RgbdSequenceEntry& entry) {
  const double named_s = detail::time_of_name(entry.stem).value_or(-1);
  const bool is_time =
      std::abs(named_s - entry.timestamp_s) < 1e-3 && !detail::are_numbers({entry.stem});
  return is_time || !entry.has_time ? entry.stem : detail::time_text(entry.timestamp_s);
}

}  // namespace

fs::path image_folder_of(const RgbdSequence& sequence, bool of_depth) {
  fs::path folder = image_path(sequence, 0, of_depth).parent_path();
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    while (!detail::is_within(image_path(sequence, i, of_depth), folder)) {
      folder = folder.parent_path();
    }
  }
  const fs::path base = fs::absolute(sequence.folder() / "").lexically_normal().parent_path();
  const auto has_any = [&](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(),
                       [&](const char* name) { return fs::exists(base / name); });
  };
  const fs::path inside = folder.lexically_relative(base);
  const bool is_outside = inside.empty() || *inside.begin() == "..";
  if (is_outside || has_any({"mav0", "cam0", "data.csv", "times.txt"})) return folder;
  const fs::path first = inside == "." ? base : base / *inside.begin();
  const bool is_plain = !has_any({"associations.txt", "rgb.txt", "depth"}) &&
                        images_below(base) == images_below(first);
  return is_plain ? base : first;
}

std::vector<fs::path> mask_names(const RgbdSequence& sequence, const fs::path& image_folder,
                                 const std::string& format) {
  std::vector<fs::path> names;
  std::set<fs::path> used;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const bool is_depth = format == "depth", is_labels = format == labels_format;
    fs::path name = is_labels ? fs::path(label_name(sequence.entry(i)))
                              : image_path(sequence, i, is_depth).lexically_relative(image_folder);
    if (format == "static" || format == "dynamic") name.replace_extension();
    if (!is_depth) name += ".png";
    if (is_labels && name.string().find_first_of(",\"") != std::string::npos) {
      detail::throw_file_error(
          sequence.entry(i).image_path,
          "has a comma or quote in its name, which instances.csv cannot hold; rename it");
    }
    if (!used.insert(name).second && !is_depth) {
      detail::throw_file_error(
          sequence.entry(i).image_path,
          "the mask of another image would have the same name, " + name.string());
    }
    names.push_back(std::move(name));
  }
  return names;
}

void print_colmap(const fs::path& images, std::size_t masks, const fs::path& out) {
  const std::size_t all = images_below(images);
  if (all > masks) {
    std::fprintf(stderr,
                 "%zu further images in %s are no frames of the sequence and have no mask, so that "
                 "COLMAP uses them whole: move them away, or name the others by "
                 "--image_list_path\n",
                 all - masks, images.c_str());
  }
  const fs::path folder = detail::canonical_folder(out);
  std::printf(
      "colmap feature_extractor --database_path %s --image_path %s --ImageReader.mask_path %s\n",
      shell_word(folder.string() + ".db").c_str(), shell_word(images).c_str(),
      shell_word(folder).c_str());
}

}  // namespace dynfilter::tools
