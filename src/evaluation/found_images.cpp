// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <regex>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "evaluation/image_lists.hpp"
#include "io/frame_names.hpp"
#include "io/staged_folder.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;

enum class Kind { unknown, colour, depth, other };

/// Tells what an image, or the images of a folder, are by the words of the name.
Kind kind_of(const std::string& name) {
  static const std::regex other(
      "(^|[^a-z])(mask|label|segmentation|semantic|instance|confidence|panoptic|annotation|dispar|"
      "infra|thermal|thumb|(seg|conf|ir|normals|flow|disp)($|[^a-z]))");
  static const std::regex colour("(^|[^a-z])(rgb|colou?r)($|[^a-z])");
  const std::string words = lower_case(name);
  if (std::regex_search(words, other)) return Kind::other;
  if (words.find("depth") != std::string::npos) return Kind::depth;
  return std::regex_search(words, colour) ? Kind::colour : Kind::unknown;
}

/// Tells whether a file's header is that of 16 bits and one channel; none if that is not known.
std::optional<bool> is_deep(const fs::path& file) {
  const std::string extension = lower_case(file.extension().string());
  if (extension != ".png") {
    if (extension == ".tif" || extension == ".tiff" || extension == ".pgm") return {};
    return false;
  }
  std::array<char, 26> head = {};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  if (std::string_view(head.data() + 1, 3) != "PNG") return {};
  return head[24] == 16 && head[25] == 0;
}

void add_image(const fs::path& file, Kind kind, FoundImages& found) {
  const std::optional<bool> deep = kind == Kind::colour ? false : is_deep(file);
  if (kind == Kind::depth && !deep.value_or(true)) {
    ++found.shallow_depth;
  } else if (kind == Kind::depth) {
    found.depth.push_back(file);
  } else {
    (deep.value_or(false) ? found.deep : found.colour).push_back(file);
  }
}

void append(const std::vector<fs::path>& from, std::vector<fs::path>& to) {
  to.insert(to.end(), from.begin(), from.end());
}

/// Tells whether a folder has the images of the one beside it, smaller: images_2, images_4.
bool is_smaller_copy(const fs::path& folder) {
  const std::string name = folder.string();
  const std::size_t end = name.size() - std::min<std::size_t>(2, name.size());
  const std::string last = name.substr(end);
  return (last == "_2" || last == "_4" || last == "_8") && fs::is_directory(name.substr(0, end));
}

/// Tells whether a folder holds the results of an earlier `dynfilter run`, `ablate` or `masks`.
bool is_of_dynfilter(const fs::path& folder) {
  return fs::exists(folder / list_name("run")) || fs::exists(folder / list_name("masks"));
}

FoundImages images_in(const fs::path& folder, Kind above, std::set<fs::path>& seen) {
  FoundImages found;
  if (!seen.insert(fs::canonical(folder)).second) return found;  // a link to a folder around it
  std::vector<std::pair<fs::path, Kind>> folders;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    const char first = path.filename().native()[0];
    std::error_code broken;  // a link
    const bool is_folder = entry.is_directory(broken);
    Kind kind = kind_of((is_folder ? path.filename() : path.stem()).string());
    if (first == '.' || first == '@' || kind == Kind::other) continue;
    if (kind == Kind::unknown) kind = above;
    if (is_folder) {
      if (!is_of_dynfilter(path)) folders.emplace_back(path, kind);
    } else if (is_image_name(path.string()) && entry.is_regular_file(broken)) {
      add_image(path, kind, found);
    } else if (kind == Kind::depth && !advice_for(path).empty()) {
      found.other_depth = std::max(found.other_depth, path);
    }
  }
  for (auto* images : {&found.colour, &found.depth, &found.deep}) {
    std::sort(images->begin(), images->end(),
              [](const fs::path& a, const fs::path& b) { return is_before(a, b); });
  }
  std::sort(folders.begin(), folders.end(), [](const auto& a, const auto& b) {
    const bool a_is_link = fs::is_symlink(a.first), b_is_link = fs::is_symlink(b.first);
    return a_is_link == b_is_link ? is_before(a.first, b.first) : b_is_link;
  });
  const bool has_colour = !found.colour.empty();
  for (const auto& [inner, kind] : folders) {
    if (is_smaller_copy(inner)) continue;
    const FoundImages below = images_in(inner, kind, seen);
    if (!has_colour) append(below.colour, found.colour);
    append(below.depth, found.depth);
    append(below.deep, found.deep);
    found.shallow_depth += below.shallow_depth;
    if (found.other_depth.empty()) found.other_depth = below.other_depth;
  }
  return found;
}

}  // namespace

FoundImages find_images(const fs::path& folder) {
  std::set<fs::path> seen;
  return images_in(folder, Kind::unknown, seen);
}

std::string advice_for(const fs::path& file) {
  const std::string extension = lower_case(file.extension().string());
  const struct {
    const char *extensions, *advice;
  } table[] = {
      {".bag .db3 .mcap ",
       "a recording of ROS: write its images into folders color/ and depth/; of a RealSense's "
       "bag: python3 -c \"import open3d as o3d; "
       "o3d.t.io.RGBDVideoReader.create('FILE').save_frames('FOLDER')\""},
      {".svo .svo2 ",
       "a recording of a ZED camera: write its images and 16-bit depth by the program svo_export "
       "of its SDK"},
      {".mp4 .mov .avi .mkv .webm .m4v ", "a film: mkdir color; ffmpeg -i FILE color/%06d.png"},
      {".heic .heif ", "a phone's image: mogrify -format jpg *.heic"},
      {".dng .cr2 .nef .arw ", "a camera's raw image: write it as JPEG or PNG"},
      {".exr .npy .npz .h5 .hdf5 .depth ",
       "an array: write colour as PNG of 8 bits, and depth as PNG of 16 bits, millimetres, by "
       "cv2.imwrite"},
      {".zip .tar .gz .tgz .7z .rar .bz2 .xz ", "an archive: unpack it"},
  };
  for (const auto& [extensions, advice] : table) {
    if (!extension.empty() && std::string(extensions).find(extension + ' ') != std::string::npos) {
      return advice;
    }
  }
  return "";
}

}  // namespace dynfilter::detail
