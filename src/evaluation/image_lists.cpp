// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "evaluation/image_lists.hpp"

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"
#include "io/frame_names.hpp"
#include "io/text_table.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;

/// Returns the first of these names that the folder holds; empty without any.
fs::path first_in(const fs::path& folder, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (detail::exists(folder / name)) return folder / name;
  }
  return {};
}

/// Reads a list of times and files, two a row for pairs; the files lie in the folder. Refuses a
/// time that occurs twice, and times that are no seconds. The depth of a pair may come first, as
/// in ICL-NUIM's, and files may have the separators of Windows.
std::vector<ListedFrame> read_list(const fs::path& list, const fs::path& folder,
                                   bool of_pairs = false) {
  require_regular_file(list);
  TableReader table(list);
  const auto listed_image = [&](std::size_t column) {
    std::string file = table.text(column + 1);
    const bool may_be_windows = file.find('\\') != std::string::npos;
    std::error_code ignored;
    if (may_be_windows && !fs::exists(folder / file, ignored)) {
      std::replace(file.begin(), file.end(), '\\', '/');
    }
    return ListedImage{table.time(column), file, folder / file, list, table.line()};
  };
  const auto is_depth = [](const ListedImage& image) {
    return image.file.find("depth") != std::string::npos;
  };
  std::vector<ListedFrame> frames;
  std::map<std::int64_t, std::size_t> lines;  // by time
  std::vector<double> times;
  std::vector<std::string> cells;  // the times as they are written
  while (table.next()) {
    table.require_columns(of_pairs ? 4 : 2,
                          of_pairs
                              ? "4: time and file of the colour image, time and file of the depth"
                              : "2: time, file");
    ListedFrame& frame = frames.emplace_back();
    frame.image = listed_image(0);
    if (of_pairs) frame.depth = listed_image(2);
    if (is_depth(frame.image) && of_pairs && !is_depth(frame.depth)) {
      std::swap(frame.image, frame.depth);
    }
    times.push_back(frame.image.time_s);
    cells.push_back(table.text(0));
    const auto [found, is_new] = lines.emplace(microseconds(times.back()), table.line());
    if (is_new) continue;
    table.fail(
        concatenate("time ", time_text(times.back()), " is in line ", found->second, " already"));
  }
  if (are_too_far_apart(times)) throw_file_error(list, far_apart_text);
  if (are_numbers(cells)) {
    throw_file_error(list, "its times number the frames; want seconds, as 1.0 and 2.0");
  }
  if (frames.empty()) {
    throw_file_error(list, of_pairs ? "lists no pair of images" : "lists no image");
  }
  return frames;
}

/// Returns the times that all names spell; none if they number the images, or if two are equal.
std::optional<std::vector<double>> times_of(const std::vector<fs::path>& files) {
  std::vector<std::string> stems;
  std::vector<double> times;
  std::map<std::int64_t, std::size_t> used;
  bool are_small = true;  // whole numbers, such as every tenth
  for (const fs::path& file : files) {
    stems.push_back(file.stem().string());
    const std::optional<double> time_s = time_of_name(stems.back());
    if (!time_s || !used.emplace(microseconds(*time_s), times.size()).second) return {};
    are_small = are_small && *time_s < 1e8 && stems.back().find('.') == std::string::npos;
    times.push_back(*time_s);
  }
  const bool are_times = !are_small && !are_numbers(stems) && !are_too_far_apart(times);
  if (!are_times) return {};
  return times;
}

/// Returns the images of a sequence of KITTI's odometry, whose times are in a file of their own.
std::vector<ListedFrame> read_kitti(const fs::path& folder, const fs::path& images) {
  if (images.empty()) {
    throw_file_error(folder, "holds times.txt, but neither image_2 nor image_0");
  }
  std::vector<ListedFrame> frames = by_name(find_images(images).colour, images);
  require_regular_file(folder / "times.txt");
  TableReader table(folder / "times.txt");
  std::size_t i = 0;
  for (; table.next(); ++i) {
    if (i >= frames.size()) continue;
    frames[i].image.time_s = table.time(0);
    frames[i].image.has_time = true;
  }
  if (i != frames.size() || frames.empty()) {
    throw_file_error(table.path(), concatenate("has ", i, " times for the ", frames.size(),
                                               " images in ", images.string()));
  }
  return frames;
}

/// Returns what two names of images of one moment share: the whole name, or the digits of all, of
/// the first or of the last of its numbers.
std::string key_of(std::string stem, int way) {
  constexpr const char* digits = "0123456789";
  if (way == 0) return stem;
  const std::size_t last = stem.find_last_of(digits);
  if (last == std::string::npos) return "";
  const std::size_t before = stem.find_last_not_of(digits, last);  // npos + 1 is 0
  stem = stem.substr(way == 3 ? before + 1 : stem.find_first_of(digits));
  if (way > 1) stem.resize(std::min(stem.find_first_not_of(digits), stem.size()));
  const auto is_letter = [](char c) { return c < '0' || c > '9'; };
  stem.erase(std::remove_if(stem.begin(), stem.end(), is_letter), stem.end());
  return '.' + stem.erase(0, stem.find_first_not_of('0'));
}

/// Gives the frames the depth images of equal names or numbers, by the way that pairs the most.
/// Numbers that two images in colour share pair none. Returns how many it paired.
std::size_t pair_by_key(const std::vector<fs::path>& depths, const fs::path& folder,
                        std::vector<ListedFrame>& frames) {
  std::map<std::size_t, fs::path> best;  // by the frame
  for (int way = 0; way < 4; ++way) {
    std::map<std::string, std::size_t> keys;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      keys.emplace(key_of(frames[i].image.path.stem().string(), way), i);
    }
    if (keys.size() < frames.size()) continue;
    std::map<std::size_t, fs::path> pairs;
    for (const fs::path& depth : depths) {
      const auto frame = keys.find(key_of(depth.stem().string(), way));
      if (frame != keys.end()) pairs.emplace(frame->second, depth);
    }
    if (pairs.size() > best.size()) best = std::move(pairs);
  }
  for (const auto& [i, depth] : best) {
    const std::string file = depth.lexically_relative(folder).string();
    frames[i].depth = {frames[i].image.time_s, file, depth, folder, 0};
  }
  return best.size();
}

/// Says how many images of what kind were found, and where the first is.
std::string count_text(const std::vector<fs::path>& files, const char* kind,
                       const fs::path& folder) {
  const fs::path place = files.front().parent_path(), inside = place.lexically_relative(folder);
  std::set<fs::path> places;
  for (const fs::path& file : files) places.insert(file.parent_path());
  return concatenate(files.size(), ' ', kind, files.size() == 1 ? " image" : " images", " of ",
                     places.size() > 1 ? concatenate(places.size(), " folders, first ") : "",
                     inside == "." ? place.string() : inside.string() + "/");
}

/// Adds depth that no list names, and says what was found.
void add_found_depth(const FoundImages& found, const fs::path& folder, ImageLists& lists) {
  std::vector<fs::path> images;
  for (const ListedFrame& frame : lists.frames) images.push_back(frame.image.path);
  lists.note = count_text(images, "colour", folder);
  if (!found.depth.empty()) {
    lists.note += ", " + count_text(found.depth, "depth", folder);
    const bool is_listed = lists.frames.front().image.line > 0;
    if ((is_listed || times_of(images)) && times_of(found.depth)) {
      lists.depths = by_name(found.depth, folder);
    } else if (pair_by_key(found.depth, folder, lists.frames) > 0) {
      lists.are_pairs = true;
    } else {
      lists.note +=
          ", which are not used: want the names or numbers of the images, of one sequence, or "
          "associations.txt with a line `time image time depth` for each pair";
    }
  }
  if (found.shallow_depth > 0) {
    lists.note += concatenate("; ", found.shallow_depth,
                              " images called depth have 8 bits, and are not used: want 16");
  }
  if (!lists.has_depth() && !found.other_depth.empty()) {
    lists.note += "; " + found.other_depth.lexically_relative(folder).string() + " is " +
                  advice_for(found.other_depth);
  }
}

/// Reads the lists of the images in colour, or else none.
ImageLists read_colour_lists(const fs::path& folder) {
  for (const char* name : {"associations.txt", "associate.txt", "association.txt"}) {
    if (detail::exists(folder / name))
      return {true, read_list(folder / name, folder, true), {}, {}};
  }
  ImageLists lists;
  const fs::path colour = first_in(folder, {"rgb.txt", "color.txt"});
  const fs::path depth = first_in(folder, {"depth.txt", "aligned_depth.txt"});
  if (!colour.empty()) {
    lists.frames = read_list(colour, folder);
    if (!depth.empty()) lists.depths = read_list(depth, folder);
    return lists;
  }
  for (const char* camera : {"mav0/cam0", "cam0", ""}) {
    const fs::path place = folder / camera;
    if (!detail::exists(place / "data.csv")) continue;
    lists.frames = read_list(place / "data.csv", place / "data");
    return lists;
  }
  const fs::path kitti = first_in(folder, {"image_2", "image_02", "image_0", "image_00"});
  if (detail::exists(folder / "times.txt")) {
    lists.frames = read_kitti(folder, kitti);
  } else if (!kitti.empty() && !detail::exists(folder / "image")) {
    lists.frames = by_name(find_images(kitti).colour, kitti);
  }
  return lists;
}

/// Says what a folder without images holds.
[[noreturn]] void throw_no_images(const fs::path& folder, const FoundImages& found) {
  std::string what =
      "holds no images in colour, and neither associations.txt nor rgb.txt, EuRoC's data.csv or "
      "KITTI's times.txt";
  if (!found.depth.empty()) what += ", but " + count_text(found.depth, "depth", folder);
  const auto options = fs::directory_options::skip_permission_denied;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, options, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const std::string advice = advice_for(entry->path());
    if (advice.empty()) continue;
    const std::string name = entry->path().lexically_relative(folder).string();
    throw_file_error(folder, what.append("; ").append(name).append(" is ").append(advice));
  }
  throw_file_error(folder, what +
                               ". Folders called masks, labels, confidence or the like are "
                               "left out: name the folder of the images itself");
}

}  // namespace

std::vector<ListedFrame> by_name(const std::vector<fs::path>& files, const fs::path& folder) {
  constexpr double frame_s = 1.0 / 30;
  const auto times = times_of(files);
  std::vector<ListedFrame> frames;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const double time_s = times ? (*times)[i] : static_cast<double>(i) * frame_s;
    const std::string file = files[i].lexically_relative(folder).string();
    frames.push_back({{time_s, file, files[i], folder, 0, times.has_value()}, {}});
  }
  return frames;
}

ImageLists read_image_lists(const fs::path& folder) {
  ImageLists lists = read_colour_lists(folder);
  if (lists.has_depth()) return lists;
  FoundImages found = find_images(folder);
  if (!lists.frames.empty()) {
    add_found_depth(found, folder, lists);
    return lists;
  }
  // Images of 16 bits are depth beside others, and else those of a thermal camera.
  if (found.colour.empty()) {
    found.colour.swap(found.deep);
  } else if (found.depth.empty()) {
    found.depth.swap(found.deep);
  }
  if (found.colour.empty()) throw_no_images(folder, found);
  lists.frames = by_name(found.colour, folder);
  add_found_depth(found, folder, lists);
  return lists;
}

}  // namespace dynfilter::detail
