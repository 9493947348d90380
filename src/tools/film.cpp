// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "film.hpp"

#include <cstdio>
#include <map>
#include <string>

#include <opencv2/core/utility.hpp>
#include <opencv2/videoio.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "evaluation/image_lists.hpp"
#include "io/file_error.hpp"
#include "io/frame_names.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t camera_frames = 300;  // more let those wait longer who want to see

/// Returns why OpenCV cannot read a file, and what to do.
std::string unreadable(const fs::path& file) {
  if (detail::is_image_name(file)) return "is an image: name its folder";
  if (file.extension() == ".txt") return "is a list; want its folder";
  const std::string advice = detail::advice_for(file);
  return "OpenCV reads no film from it" +
         (advice.empty()
              ? ": name a film such as an .mp4, a camera's number, or a folder with images"
              : "; it is " + advice);
}

class Film final : public FrameSource {
 public:
  explicit Film(const SceneSpec& spec)
      : name_(spec.sequence), is_camera_(!fs::exists(spec.sequence)) {
    const std::string name = name_.string();
    // FFmpeg would show a text as a film of letters.
    const bool may_be_film = !detail::is_image_name(name) && name_.extension() != ".txt";
    const bool is_open = is_camera_ ? film_.open(std::stoi(name)) : may_be_film && film_.open(name);
    if (!is_open) {
      detail::throw_file_error(
          name_, is_camera_ ? "there is no such folder, film or camera" : unreadable(name_));
    }
    const double count = film_.get(cv::CAP_PROP_FRAME_COUNT), fps = film_.get(cv::CAP_PROP_FPS);
    facts_.frames = is_camera_ || !(count >= 1) ? camera_frames : static_cast<std::size_t>(count);
    if (fps > 0 && fps < 1e6) frame_s_ = 1 / fps;
    if (!spec.reading.camera_file.empty()) facts_.camera = read_camera(spec.reading.camera_file);
    facts_.has_depth = facts_.has_true_masks = false;
    if (!spec.is_for_masks) facts_.note = "no depth images, so masks act alone";
    if (!spec.masks.empty() && spec.reads_masks) {
      masks_.emplace(open_masks(spec.masks, times(), spec.keeps_missing));
      masks_folder_ = spec.masks;
      facts_.masks_name = spec.masks.string();
    }
    clock_.start();
    if (!Film::has(0)) detail::throw_file_error(name_, "OpenCV reads no frame of it");
  }

  bool has(std::size_t i) override {
    for (; next_ <= i && !(is_camera_ && i >= camera_frames) && film_.grab(); ++next_) {
      if (!is_camera_) continue;
      clock_.stop();
      time_s_ = clock_.getTimeSec();
      clock_.start();
    }
    if (next_ <= i && static_cast<double>(next_) < 0.9 * film_.get(cv::CAP_PROP_FRAME_COUNT)) {
      std::fprintf(stderr, "%s ends after %zu of %zu frames: is it cut off?\n", name_.c_str(),
                   next_, size());
    }
    return next_ == i + 1;
  }

  SourceFrame read(std::size_t i) override {
    FrameView frame;
    if (!has(i) || !film_.retrieve(frame.image)) {
      detail::throw_file_error(name_, "has no frame " + std::to_string(i));
    }
    frame.id = i;
    frame.timestamp_s = is_camera_ ? time_s_ : time_of(i);
    SourceFrame read{detail::time_text(frame.timestamp_s), frame, frame.timestamp_s, {}, {}, {}, 0};
    if (masks_) read.masks = masks_->of(frame);
    return read;
  }

  void add_inputs(Inputs& inputs) const override {
    inputs.add(name_);
    inputs.add_folder(masks_folder_);
  }

 private:
  double time_of(std::size_t i) const { return static_cast<double>(i) * frame_s_; }

  /// Returns the times of frames by what their masks are called: those times, or as YOLO counts.
  std::map<std::string, double> times() const {
    std::map<std::string, double> times;
    for (std::size_t i = 0; i < size(); ++i) {
      times[detail::time_text(time_of(i))] = time_of(i);
      times[detail::concatenate(name_.stem().string(), '_', i + 1)] = time_of(i);
    }
    return times;
  }

  fs::path name_;
  bool is_camera_;
  cv::VideoCapture film_;
  double frame_s_ = 1.0 / 30, time_s_ = 0;
  std::size_t next_ = 0;  // number of the frame to grab
  cv::TickMeter clock_;
};

}  // namespace

bool is_film(const fs::path& name) {
  const std::string text = name.string();
  const bool is_number =
      !text.empty() && text.size() < 4 && text.find_first_not_of("0123456789") == std::string::npos;
  return detail::exists(name) ? fs::is_regular_file(name) : is_number;
}

std::unique_ptr<FrameSource> open_film(const SceneSpec& spec) {
  return std::make_unique<Film>(spec);
}

}  // namespace dynfilter::tools
