// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Image files for the compiled components. cv::imread and cv::imwrite do not tell a missing file, a
// truncated one and a full disk apart, and print messages.

#ifndef DYNFILTER_SRC_IO_IMAGE_FILE_HPP
#define DYNFILTER_SRC_IO_IMAGE_FILE_HPP

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <ios>
#include <system_error>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "io/file_error.hpp"
#include "io/file_writing.hpp"

namespace dynfilter::detail {

/// Tells whether a PNG file lacks its last chunk. libpng prints a line when it decodes such a file.
inline bool is_truncated_png(const std::vector<std::uint8_t>& bytes) {
  constexpr std::array<std::uint8_t, 8> signature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  constexpr std::array<std::uint8_t, 4> last_chunk = {'I', 'E', 'N', 'D'};
  if (bytes.size() < signature.size()) return false;
  if (!std::equal(signature.begin(), signature.end(), bytes.begin())) return false;
  return std::search(bytes.begin(), bytes.end(), last_chunk.begin(), last_chunk.end()) ==
         bytes.end();
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

/// Decodes an image file; flags as for cv::imread. Throws std::runtime_error that names it.
inline cv::Mat read_image(const std::filesystem::path& path, int flags) {
  std::error_code unreadable;
  const std::uintmax_t size = std::filesystem::file_size(path, unreadable);
  if (unreadable) throw_file_error(path, "cannot be read: " + unreadable.message());
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  std::ifstream stream(path, std::ios::binary);
  if (!stream.read(reinterpret_cast<char*>(bytes.data()),
                   static_cast<std::streamsize>(bytes.size()))) {
    throw_file_error(path, "cannot be read");
  }
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

#endif  // DYNFILTER_SRC_IO_IMAGE_FILE_HPP
