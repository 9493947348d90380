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
  return text.substr(0, 8) == "\x89PNG\r\n\x1A\n" && text.find("IEND") == std::string_view::npos;
}

/// Returns the number of so many bytes, the highest first.
inline std::uint32_t big_endian(const std::vector<std::uint8_t>& bytes, std::size_t at,
                                std::size_t count = 4) {
  std::uint32_t value = 0;
  for (std::size_t k = at; k < at + count; ++k) value = value << 8U | bytes[k];
  return value;
}

/// Tells whether a JPEG file ends before its marker "end of image". libjpeg decodes such a file and
/// makes up the rest. Previews inside it have such markers, too, so that its segments are followed.
/// Sets the size of the image, which its frame header tells.
inline bool is_truncated_jpeg(const std::vector<std::uint8_t>& bytes, cv::Size* size = nullptr) {
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
      const int kind = bytes[i + 1];
      const bool is_frame = kind == 0xC0 || (kind > 0xC0 && kind <= 0xCF && kind % 4 != 0);
      if (size != nullptr && is_frame && i + 8 < bytes.size()) {
        size->height = static_cast<int>(big_endian(bytes, i + 5, 2));
        size->width = static_cast<int>(big_endian(bytes, i + 7, 2));
      }
      i += 2 + big_endian(bytes, i + 2, 2);  // the segment's length
    } else {
      break;
    }
  }
  return true;
}

/// Returns the size that the header of a PNG or JPEG file tells; empty for other formats.
inline cv::Size size_in_header(const std::vector<std::uint8_t>& bytes) {
  cv::Size size;
  const bool is_png = bytes.size() > 24 && bytes[0] == 0x89 && bytes[1] == 'P';
  if (is_png)
    return {static_cast<int>(big_endian(bytes, 16)), static_cast<int>(big_endian(bytes, 20))};
  is_truncated_jpeg(bytes, &size);
  return size;
}

/// Refuses an image that would take much more memory than its frame, before it is decoded: a small
/// file may hold a large one. An empty frame size is unknown.
inline void require_bounded(cv::Size own, cv::Size frame, const std::filesystem::path& path) {
  constexpr std::int64_t max_scale = 4;         // larger masks or depth take 16 times the memory
  constexpr std::int64_t max_pixels = 1 << 28;  // more than cameras have; takes .8 GB in colour
  const std::int64_t width = own.width, height = own.height;
  if (!frame.empty() && (width > max_scale * frame.width || height > max_scale * frame.height)) {
    throw_file_error(
        path, size_name(own) + " pixels; want at most 4 times the frame's " + size_name(frame));
  }
  if (width * height <= max_pixels) return;
  throw_file_error(path, size_name(own) + " pixels; want at most 2^28");
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
/// names the file, also for an image that is too large for its frame.
inline cv::Mat decode_image(const std::filesystem::path& path,
                            const std::vector<std::uint8_t>& bytes, int flags,
                            cv::Size frame = {}) {
  const std::string other =
      in_place_of({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!other.empty()) throw_file_error(path, other);
  require_bounded(size_in_header(bytes), frame, path);
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

inline cv::Mat read_image(const std::filesystem::path& path, int flags, cv::Size frame = {}) {
  return decode_image(path, read_bytes(path), flags, frame);
}

/// Throws std::runtime_error that names the file if a mask or depth of a size has not the shape of
/// the image that it belongs to, to a pixel or half a percent, and says what it may be; `advice` is
/// for sizes of networks' inputs.
inline void require_shape(cv::Size given, cv::Size size, const std::filesystem::path& path,
                          const std::string& of, const char* advice) {
  const auto is_alike = [&](std::int64_t width, std::int64_t height) {
    // ScanNet's depth of 640x480 belongs to images of 1296x968, whose shape is .4 % another.
    const std::int64_t apart = std::abs(width * size.height - height * size.width);
    return apart <= std::max(size.width, size.height) || 200 * apart <= width * size.height;
  };
  if (is_alike(given.width, given.height)) return;
  std::string what = size_name(given) + " pixels, but " + of + " has " + size_name(size);
  if (is_alike(given.height, given.width)) {
    what += "; is one of them turned by 90 degrees?";
  } else if (given.width % 32 == 0 && given.height % 32 == 0) {
    what += advice;
  }
  throw_file_error(path, what);
}

/// Returns the pixels of a mask or of depth at the size of their image, by the nearest neighbour.
/// Throws what require_shape throws.
inline cv::Mat fitted(const cv::Mat& pixels, cv::Size size, const std::filesystem::path& path,
                      const std::string& of, const char* advice) {
  if (pixels.size() == size) return pixels;
  require_shape(pixels.size(), size, path, of, advice);
  cv::Mat resized;
  cv::resize(pixels, resized, size, 0, 0, cv::INTER_NEAREST);
  return resized;
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
