// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Image files for the compiled components. cv::imread and cv::imwrite do not tell a missing file, a
// truncated one and a full disk apart, and print messages.

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <ios>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "io/file_error.hpp"
#include "io/file_writing.hpp"

namespace dynfilter::detail {

/// Tells whether a PNG file lacks its last chunk. libpng prints a line when it decodes such a file.
inline bool is_truncated_png(const std::vector<std::uint8_t>& bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return text.substr(0, 8) == "\x89PNG\r\n\x1A\n" && text.find("IEND") == text.npos;
}

/// Tells whether a JPEG file ends before its marker "end of image". libjpeg decodes such a file and
/// makes up the rest. Previews inside it have such markers, too, so that its segments are followed.
inline bool is_truncated_jpeg(const std::vector<std::uint8_t>& bytes) {
  const auto is_marker = [&](std::size_t i) {  // neither a stuffed byte nor a restart
    const bool is_restart = bytes[i + 1] >= 0xD0 && bytes[i + 1] <= 0xD7;
    return bytes[i] == 0xFF && bytes[i + 1] != 0 && bytes[i + 1] != 0xFF && !is_restart;
  };
  if (bytes.size() < 2 || bytes[0] != 0xFF || bytes[1] != 0xD8) return false;
  for (std::size_t i = 2; i + 1 < bytes.size();) {
    if (!is_marker(i)) {
      ++i;  // coded pixels, or padding
    } else if (bytes[i + 1] == 0xD9) {
      return false;
    } else if (i + 3 < bytes.size()) {
      i += 2 + (std::size_t{bytes[i + 2]} << 8U | bytes[i + 3]);  // the segment's length
    } else {
      break;
    }
  }
  return true;
}

/// Reads a whole file. Throws std::runtime_error that names it.
inline std::vector<std::uint8_t> read_bytes(const std::filesystem::path& path) {
  std::error_code unreadable;
  const std::uintmax_t size = std::filesystem::file_size(path, unreadable);
  if (unreadable) throw_file_error(path, "cannot be read: " + unreadable.message());
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  std::ifstream stream(path, std::ios::binary);
  if (!stream.read(reinterpret_cast<char*>(bytes.data()),
                   static_cast<std::streamsize>(bytes.size()))) {
    throw_file_error(path, "cannot be read");
  }
  return bytes;
}

/// Decodes the bytes of an image file; flags as for cv::imread. Throws std::runtime_error that
/// names the file.
inline cv::Mat decode_image(const std::filesystem::path& path,
                            const std::vector<std::uint8_t>& bytes, int flags) {
  cv::Mat image;
  try {
    const bool is_truncated = is_truncated_png(bytes) || is_truncated_jpeg(bytes);
    if (!bytes.empty() && !is_truncated) image = cv::imdecode(bytes, flags);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) throw_file_error(path, "cannot be decoded: truncated, or no image");
  return image;
}

inline cv::Mat read_image(const std::filesystem::path& path, int flags) {
  return decode_image(path, read_bytes(path), flags);
}

/// Returns the pixels of a mask or of depth at the size of the image that they belong to: those of
/// the same shape, to a pixel, by the nearest neighbour. Throws std::runtime_error that names the
/// file for another shape, and says what it may be; `advice` is for sizes of networks' inputs.
inline cv::Mat fitted(const cv::Mat& pixels, cv::Size size, const std::filesystem::path& path,
                      const std::string& of, const char* advice) {
  if (pixels.size() == size) return pixels;
  const auto is_alike = [&](std::int64_t width, std::int64_t height) {
    return std::abs(width * size.height - height * size.width) <= std::max(size.width, size.height);
  };
  if (is_alike(pixels.cols, pixels.rows)) {
    cv::Mat resized;
    cv::resize(pixels, resized, size, 0, 0, cv::INTER_NEAREST);
    return resized;
  }
  std::string what = size_name(pixels.size()) + " pixels, but " + of + " has " + size_name(size);
  if (is_alike(pixels.rows, pixels.cols)) {
    what += "; is one of them turned by 90 degrees?";
  } else if (pixels.cols % 32 == 0 && pixels.rows % 32 == 0) {
    what += advice;
  }
  throw_file_error(path, what);
}

/// Writes an image in the format of the file's extension, .png or .jpg, which must support its
/// type. Throws std::runtime_error that names the file.
inline void write_image(const std::filesystem::path& path, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(path.extension().string(), image, bytes)) {
    throw_file_error(path, "cannot be encoded");
  }
  write_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace dynfilter::detail
