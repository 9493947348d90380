// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "recorded_masks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "evaluation/image_lists.hpp"
#include "io/file_error.hpp"
#include "io/frame_names.hpp"
#include "io/image_file.hpp"
#include "io/text_table.hpp"
#include "outlines.hpp"
#include "segmenters/mask_image.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;
using Times = std::map<std::string, double>;
using Colours = std::map<std::string, cv::Scalar>;  // BGR, by label

constexpr int box_margin_px = 20;  // as of masks without a table

/// Returns COCO's id of a class that moves; none for another class.
std::optional<int> known_class(const std::string& name) {
  static const std::map<std::string, int> ids = {
      {"person", 0}, {"people", 0},     {"pedestrian", 0}, {"human", 0}, {"bicycle", 1}, {"car", 2},
      {"bus", 5},    {"motorcycle", 3}, {"truck", 7},      {"cat", 15},  {"dog", 16}};
  const auto found = ids.find(detail::lower_case(name));
  return found == ids.end() ? std::nullopt : std::optional(found->second);
}

/// Returns COCO's id of a class of MOTS (1, 2) or Cityscapes (24 to 33); -1: no instances.
int class_of_thousand(std::size_t thousand) {
  const std::map<std::size_t, int> classes = {{1, 2},  {2, 0},  {24, 0}, {25, 0}, {26, 2},
                                              {27, 7}, {28, 5}, {31, 6}, {32, 3}, {33, 1}};
  const auto found = classes.find(thousand);
  return found == classes.end() ? -1 : found->second;
}

/// Tells whether values are ids of instances, 1000 for each class: beside them, 10000 means
/// "ignore", and values below 34 are Cityscapes' classes without instances.
bool are_thousands(const std::vector<int>& values) {
  const auto is_id = [](int v) { return v >= 1000 && v < 34000; };
  return std::any_of(values.begin(), values.end(), is_id) &&
         std::all_of(values.begin(), values.end(), [&](int v) { return is_id(v) || v < 34; });
}

/// Masks of other tools, of the frames that they know.
class OtherMasks final : public Segmenter {
 public:
  enum class Form { one_instance, thousands, colours };

  OtherMasks(fs::path path, const Times& times) : path_(std::move(path)), times_(times) {
    for (const auto& [stem, time_s] : times) {
      const bool is_number = stem.find_first_not_of("0123456789") == std::string::npos;
      const std::size_t zeros = std::min(stem.find_first_not_of('0'), stem.size() - 1);
      if (is_number) numbers_.emplace(stem.substr(zeros), time_s);
    }
  }

  /// Adds the objects of an image, if it is a frame's. COCO knows images by their numbers, too.
  void add(const std::string& image, std::vector<Outline> outlines) {
    const Times& names = times_.count(image) > 0 ? times_ : numbers_;
    const auto frame = names.find(image);
    if (frame == names.end()) return;
    for (const Outline& outline : outlines) classes_[outline.label];
    auto& all = frames_[detail::microseconds(frame->second)].outlines;
    std::move(outlines.begin(), outlines.end(), std::back_inserter(all));
  }

  /// Adds the files that are of frames.
  void add(const std::vector<fs::path>& files, Form form) {
    form_ = form;
    for (const fs::path& file : files) {
      const auto frame = frame_of(file);
      if (frame == times_.end()) continue;
      frames_[detail::microseconds(frame->second)].files.push_back(file);
    }
  }

  void set_colours(Colours colours) {
    for (const auto& [label, colour] : colours) classes_[label];
    colours_ = std::move(colours);
  }

  bool is_empty() const { return frames_.empty(); }
  bool has_mask(double time_s) const { return frames_.count(detail::microseconds(time_s)) > 0; }

  /// Returns the values of masks that are binary.
  std::vector<int> values() const {
    std::vector<fs::path> files;
    for (const auto& [time, frame] : frames_) {
      files.insert(files.end(), frame.files.begin(), frame.files.end());
    }
    return form_ == Form::one_instance ? detail::mask_values(files) : std::vector<int>();
  }

  /// Gives labels their ids: numbers as they are, names as COCO's; others follow COCO's 80, but for
  /// one alone, which is what the user wants to be rid of. Says which are not COCO's.
  std::string number_classes() {
    std::string note;
    int next = 80;
    for (auto& [label, id] : classes_) {
      const std::optional<double> number = detail::parse_number(label);
      const bool is_id = number && std::abs(*number) < 1e9;
      const std::optional<int> known = is_id ? static_cast<int>(*number) : known_class(label);
      id = known ? *known : classes_.size() == 1 ? 0 : next++;
      if (known || id == 0) continue;
      note += detail::concatenate(note.empty() ? "" : ", ", label, " is ", id);
    }
    return note.empty() ? "" : "classes of " + path_.string() + ", for --classes: " + note;
  }

 private:
  struct Frame {
    std::vector<Outline> outlines;
    std::vector<fs::path> files;
  };

  /// Returns the frame that a mask file is one of several of: that of the folder that it lies in,
  /// of its name, or the longest with which the name begins, before a sign.
  Times::const_iterator frame_of(const fs::path& file) const {
    std::string name = detail::frame_stem(file.filename());
    const fs::path folder = file.parent_path();
    auto found = folder == path_ ? times_.end() : times_.find(folder.filename().string());
    if (found == times_.end()) found = times_.find(name);
    for (std::size_t end;
         found == times_.end() && (end = name.find_last_of("_-. ")) != std::string::npos;) {
      name.resize(end);
      found = times_.find(name);
    }
    return found;
  }

  Segmentation do_segment(const FrameView& frame) override {
    Segmentation result = empty_segmentation(frame);
    const cv::Size size = result.image_size;
    const auto found = frames_.find(detail::microseconds(frame.timestamp_s));
    if (found == frames_.end()) {
      detail::throw_file_error(path_, "has no masks for " + detail::time_text(frame.timestamp_s));
    }
    const Frame& known = found->second;
    double room = std::max(64.0 * size.area(), std::exp2(24));  // as require_bounded_masks
    for (const Outline& outline : known.outlines) {
      result.instances.push_back(instance_of(outline, size, room, path_));
      result.instances.back().class_id = classes_.at(outline.label);
    }
    for (const fs::path& file : known.files) {
      try {
        add_file(file, size, known.files.size() == 1, result.instances);
      } catch (const std::invalid_argument& error) {  // its objects are no objects
        detail::throw_file_error(file, error.what());
      }
    }
    return result;
  }

  void add_file(const fs::path& file, cv::Size size, bool is_only,
                std::vector<Instance>& instances) const {
    const auto add = [&](const std::vector<Instance>& objects, int class_id) {
      for (Instance one : objects) {
        if (one.box.empty()) continue;
        one.box = detail::clip_grown(one.box, box_margin_px, box_margin_px, size);
        one.class_id = class_id;
        instances.push_back(std::move(one));
      }
    };
    const cv::Mat pixels =
        detail::fitted(form_ == Form::colours ? detail::read_image(file, cv::IMREAD_COLOR, size)
                                              : detail::read_mask(file, size),
                       size, file, "the frame", detail::if_letterboxed);
    if (form_ == Form::colours) {
      for (const auto& [label, colour] : colours_) {
        cv::Mat mask;
        cv::inRange(pixels, colour, colour, mask);
        add(instances_from_binary_mask(mask), classes_.at(label));
      }
    } else if (form_ == Form::thousands) {
      const std::vector<Instance> ids = instances_from_label_map(pixels);
      for (std::size_t k = 0; k < ids.size(); ++k) {
        const int class_id = class_of_thousand((k + 1) / 1000);
        if (class_id >= 0) add({ids[k]}, class_id);
      }
    } else {
      const cv::Mat mask = pixels != 0;
      add(is_only ? instances_from_binary_mask(mask)
                  : std::vector{Instance::from_image_mask(mask, 0, 1)},
          0);
    }
  }

  fs::path path_;
  Times times_, numbers_;  // by the names of images; by their numbers without zeros
  Form form_ = Form::one_instance;
  Colours colours_;
  std::map<std::string, int> classes_;    // by label
  std::map<std::int64_t, Frame> frames_;  // by time in microseconds
};

/// Reads CVAT's table of colours: label:red,green,blue and two more columns.
Colours read_colours(const fs::path& file) {
  detail::TableReader table(file, ":");
  Colours colours;
  while (table.next()) {
    table.require_columns(2, "label:red,green,blue::");
    std::vector<double> rgb;
    std::istringstream cells(table.text(1));
    for (std::string cell; std::getline(cells, cell, ',');) {
      rgb.push_back(detail::parse_number(cell).value_or(-1));
    }
    if (rgb.size() != 3) table.fail("got '" + table.text(1) + "'; want red,green,blue");
    if (table.text(0) != "background") colours[table.text(0)] = {rgb[2], rgb[1], rgb[0]};
  }
  return colours;
}

std::vector<fs::path> files_of(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  const auto options = fs::directory_options::skip_permission_denied;
  for (const auto& entry : fs::recursive_directory_iterator(folder, options)) {
    std::error_code broken;  // a link
    const bool is_hidden = entry.path().filename().native()[0] == '.';
    const bool has = detail::lower_case(entry.path().extension().string()) == extension;
    if (has && !is_hidden && entry.is_regular_file(broken)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Tells whether each PNG file lies directly in the folder and is named by its frame.
bool is_plain(const fs::path& folder, const std::vector<fs::path>& files, const Times& times) {
  return std::all_of(files.begin(), files.end(), [&](const fs::path& file) {
    const std::string stem = detail::frame_stem(file.filename());
    return file.parent_path() == folder && (times.count(stem) > 0 || detail::time_of_name(stem));
  });
}

int bits_of(const fs::path& png) {
  const std::vector<std::uint8_t> bytes = detail::read_bytes(png);
  return bytes.size() > detail::PngHeader::end ? bytes[detail::PngHeader::bit_depth] : 0;
}

void add_coco(const fs::path& file, OtherMasks& masks) {
  for (auto& [image, outlines] : read_coco(file)) masks.add(image, std::move(outlines));
}

/// Adds what the path holds in the form of another tool; nothing if it holds MaskFolderSegmenter's.
void add_others(const fs::path& path, const Times& times, OtherMasks& masks) {
  const auto refuse_if_empty = [&](const fs::path& first) {
    if (!masks.is_empty()) return;
    detail::throw_file_error(first, "is of no frame of the sequence; frames are called as " +
                                        (times.empty() ? "none" : times.begin()->first));
  };
  if (detail::type_of(path) == fs::file_type::regular) {
    const std::string advice = detail::advice_for(path);
    if (!advice.empty()) {
      detail::throw_file_error(path, "want a folder of masks, or COCO's .json; it is " + advice);
    }
    add_coco(path, masks);
    return refuse_if_empty(path);
  }
  const bool is_folder = detail::type_of(path) == fs::file_type::directory;
  if (!is_folder || detail::exists(path / "instances.csv")) return;
  for (const fs::path& table : {path / "labelmap.txt", path.parent_path() / "labelmap.txt"}) {
    if (!detail::exists(table)) continue;
    masks.set_colours(read_colours(table));
    const fs::path classes = path / "SegmentationClass";
    return masks.add(files_of(detail::exists(classes) ? classes : path, ".png"),
                     OtherMasks::Form::colours);
  }
  const std::vector<fs::path> files = files_of(path, ".png"), labels = files_of(path, ".txt"),
                              coco = files_of(path, ".json");
  for (const fs::path& file : labels) {
    if (times.count(file.stem()) > 0) masks.add(file.stem(), read_yolo_labels(file));
  }
  if (files.empty() && labels.empty() && coco.size() == 1) add_coco(coco[0], masks);
  if (files.empty() && labels.empty() && coco.size() > 1) {
    detail::throw_file_error(path,
                             detail::concatenate("holds ", coco.size(),
                                                 " .json files; want COCO's, one for all "
                                                 "images, as labelme2coco makes of labelme's"));
  }
  if (files.empty() && labels.size() + coco.size() > 0) {
    return refuse_if_empty(labels.empty() ? coco[0] : labels[0]);
  }
  if (masks.is_empty() && !is_plain(path, files, times)) {
    masks.add(files, OtherMasks::Form::one_instance);
  }
}

}  // namespace

RecordedMasks open_masks(const fs::path& given, const Times& times, bool may_be_missing) {
  const fs::path path = (given / "").parent_path();  // without a slash at the end
  auto others = std::make_unique<OtherMasks>(path, times);
  add_others(path, times, *others);
  if (others->is_empty()) {
    MaskFolderOptions options;
    options.frame_times = times;
    options.allow_missing = may_be_missing;
    auto folder = std::make_unique<MaskFolderSegmenter>(path, options);
    const std::vector<fs::path> files = files_of(path, ".png");
    const bool is_deep = !files.empty() && bits_of(files.front()) == 16;
    if (!is_deep || !are_thousands(folder->values())) {
      const MaskFolderSegmenter* const own = folder.get();
      return {std::move(folder), [own](double time_s) { return own->has_mask(time_s); },
              [own] { return own->values(); }, "", may_be_missing};
    }
    others->add(files, OtherMasks::Form::thousands);
  }
  const std::string note = others->number_classes();
  const OtherMasks* const own = others.get();
  return {std::move(others), [own](double time_s) { return own->has_mask(time_s); },
          [own] { return own->values(); }, note, may_be_missing};
}

}  // namespace dynfilter::tools
