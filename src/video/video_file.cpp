// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "video/video_file.hpp"

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>

#include "dynfilter/detail/quantile.hpp"
#include "io/file_error.hpp"
#include "io/staged_folder.hpp"

#ifdef DYNFILTER_HAS_VIDEO
#include <cmath>

#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#endif

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;

#ifdef DYNFILTER_HAS_VIDEO
constexpr const char* list_writer = "video";
constexpr std::size_t pictures_for_rate = 10;

bool is_mp4(const fs::path& file) { return file.extension() == ".mp4"; }

/// Opens a writer; it is closed if this OpenCV cannot write such videos.
cv::VideoWriter opened(const fs::path& file, double rate, cv::Size size) {
  if (is_mp4(file)) {
    return {file.string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), rate, size};
  }
  const int motion_jpeg = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
  cv::VideoWriter writer(file.string(), cv::CAP_OPENCV_MJPEG, motion_jpeg, rate, size);
  if (!writer.isOpened()) writer.open(file.string(), motion_jpeg, rate, size);
  return writer;
}

/// Counts the pictures of a video; 0 if it cannot be read.
std::size_t pictures_in(const fs::path& file) {
  cv::VideoCapture video(file.string());
  if (!video.isOpened() || !video.grab()) return 0;
  return static_cast<std::size_t>(std::max(0.0, std::round(video.get(cv::CAP_PROP_FRAME_COUNT))));
}

/// Writes a small video and reads it back.
void require_codec(const fs::path& file, const fs::path& trial) {
  constexpr int pictures = 2;
  const cv::Mat picture(64, 64, CV_8UC3, cv::Scalar(30, 60, 90));
  cv::VideoWriter writer = opened(trial, 30, picture.size());
  for (int i = 0; i < pictures && writer.isOpened(); ++i) writer.write(picture);
  writer.release();
  std::error_code ignored;
  const bool is_whole = pictures_in(trial) == pictures;
  fs::remove(trial, ignored);
  if (is_whole) return;
  throw_file_error(file, is_mp4(file) ? "this OpenCV writes no .mp4, which takes FFmpeg; name a "
                                        "file that ends in .avi, or install an OpenCV with FFmpeg"
                                      : "this OpenCV writes no .avi with Motion JPEG");
}

/// Refuses a file that no VideoFile wrote in this form.
void require_own(const fs::path& file) {
  if (!fs::exists(fs::symlink_status(file))) return;
  if (EarlierFiles(file.parent_path(), list_writer).holds(file.filename())) return;
  throw_file_error(file,
                   "exists, and no earlier dynfilter wrote it as a video; name another file, "
                   "or move it away");
}

/// Adds the video to the list in its folder, before it is moved there: whenever the process ends,
/// it is listed. Keeps the rows of other videos, and that of the video which it replaces.
void list_video(const fs::path& file, const fs::path& made) {
  const EarlierFiles earlier(file.parent_path(), list_writer);
  TableWriter list(file.parent_path() / manifest_name(list_writer));
  list.line(manifest_title(list_writer));
  for (const auto& [name, states] : earlier.files()) {
    if (name == file.filename() && !earlier.holds(name)) continue;
    list.line(
        manifest_row(name == file.filename() ? fingerprint_of_file(file) : states.back(), name));
  }
  list.line(manifest_row(fingerprint_of_file(made), file.filename()));
  list.close();
}
#endif

/// Returns the absolute path. Refuses another ending, and a folder that is not there.
fs::path checked(const fs::path& file) {
  const fs::path extension = file.extension();
  if (extension != ".mp4" && extension != ".avi") {
    throw_file_error(file, "want a name that ends in .mp4 or .avi");
  }
  if (file.filename().string().find_first_of("\r\n") != std::string::npos) {
    throw_file_error(file, "want a name without line breaks");  // the list has a line for each
  }
  const fs::path whole = fs::absolute(file).lexically_normal();
  std::error_code ignored;
  if (!fs::is_directory(whole.parent_path(), ignored)) {
    throw_file_error(file, "cannot be written: there is no such folder");
  }
  return whole;
}

}  // namespace

double rate_of(const std::vector<double>& times_s) {
  std::vector<double> gaps_s;
  for (std::size_t i = 1; i < times_s.size(); ++i) gaps_s.push_back(times_s[i] - times_s[i - 1]);
  if (gaps_s.empty()) return 30;
  const double gap_s = quantile_of(gaps_s);
  return gap_s > 0 ? std::clamp(1 / gap_s, 1.0, 120.0) : 30;
}

#ifdef DYNFILTER_HAS_VIDEO

struct VideoFile::Writer {
  explicit Writer(const fs::path& file)
      : area(file.parent_path(), list_writer + ("-" + file.filename().string())),
        made(area.new_files() / file.filename()) {
    require_codec(file, area.new_files() / ("trial" + file.extension().string()));
  }

  void open() {
    cv::Size even = first_pictures.front().size();  // MPEG-4 halves the resolution of colour
    even = {even.width + even.width % 2, even.height + even.height % 2};
    video = opened(made, rate_of(times_s), even);
    size = even;
    for (const cv::Mat& picture : first_pictures) write(picture);
    first_pictures.clear();
  }

  void write(const cv::Mat& picture) {
    cv::Mat scaled = picture;
    if (picture.size() != size) cv::resize(picture, scaled, size, 0, 0, cv::INTER_AREA);
    video.write(scaled);
    ++written;
  }

  StagingArea area;
  fs::path made;
  std::vector<cv::Mat> first_pictures;  // until the rate is known
  std::vector<double> times_s;          // theirs
  cv::VideoWriter video;
  cv::Size size;
  std::size_t written = 0;
};

VideoFile::VideoFile(const fs::path& file) : file_(checked(file)) {
  require_own(file_);
  writer_ = std::make_unique<Writer>(file_);
}

void VideoFile::add(const cv::Mat& picture, double timestamp_s) {
  if (!writer_) return;
  if (!writer_->size.empty()) {
    writer_->write(picture);
    return;
  }
  writer_->first_pictures.push_back(picture.clone());
  writer_->times_s.push_back(timestamp_s);
  if (writer_->first_pictures.size() == pictures_for_rate) writer_->open();
}

void VideoFile::finish() {
  const std::unique_ptr<Writer> writer = std::move(writer_);
  if (!writer || writer->times_s.empty()) return;
  if (writer->size.empty()) writer->open();
  writer->video.release();
  if (pictures_in(writer->made) != writer->written) {
    throw_file_error(file_, "cannot be written whole; is the disk full?");
  }
  require_own(file_);
  list_video(file_, writer->made);
  if (std::rename(writer->made.c_str(), file_.c_str()) != 0) {
    throw_file_error(file_, "cannot be written: " + errno_text());
  }
}

#else

struct VideoFile::Writer {};

VideoFile::VideoFile(const fs::path& file) : file_(checked(file)) {
  throw_file_error(file,
                   "cannot be written: this dynfilter was built without videos. Install OpenCV's "
                   "module videoio (libopencv-videoio-dev) and build dynfilter again, with "
                   "DYNFILTER_BUILD_VIDEO on");
}

void VideoFile::add(const cv::Mat&, double) {}
void VideoFile::finish() {}

#endif

VideoFile::~VideoFile() = default;

}  // namespace dynfilter::detail
