// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Mask images of other tools: palettes, equal channels, transparency.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dynfilter/detail/errors.hpp"
#include "io/file_error.hpp"
#include "io/image_file.hpp"

namespace dynfilter::detail {

/// Advice about masks of the sizes of networks' inputs.
constexpr const char* if_letterboxed =
    "; is it a network's input with borders (letterboxed)? Ultralytics' retina_masks=True gives "
    "masks of the image's size";

/// Parts of a PNG file whose first chunk, as always, is its header.
struct PngHeader {
  static constexpr std::size_t chunk = 8, bit_depth = 24, colour_type = 25, checksum = 29, end = 33;
  static constexpr std::uint8_t palette = 3, grey = 0;
};

/// Returns the checksum of a PNG's chunk, CRC-32 of its type and data.
inline std::uint32_t checksum(const std::uint8_t* begin, const std::uint8_t* end) {
  std::uint32_t sum = 0xFFFFFFFFU;
  for (; begin != end; ++begin) {
    sum ^= *begin;
    for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1U) ^ ((sum & 1U) != 0 ? 0xEDB88320U : 0);
  }
  return ~sum;
}

/// Returns a PNG file with a palette as one of grey pixels, which are the indices: OpenCV would
/// look up their colours.
inline std::vector<std::uint8_t> without_palette(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> grey(bytes.begin(), bytes.begin() + PngHeader::end);
  grey[PngHeader::colour_type] = PngHeader::grey;
  const std::uint32_t sum = checksum(&grey[PngHeader::chunk + 4], &grey[PngHeader::checksum]);
  for (std::size_t k = 0; k < 4; ++k) {
    grey[PngHeader::checksum + k] = static_cast<std::uint8_t>(sum >> (24 - 8 * k));
  }
  for (std::size_t i = PngHeader::end; i + 12 <= bytes.size();) {
    const std::size_t length = std::size_t{12} + big_endian(bytes, i);
    if (length > bytes.size() - i) break;
    const std::string type(bytes.begin() + static_cast<std::ptrdiff_t>(i + 4),
                           bytes.begin() + static_cast<std::ptrdiff_t>(i + 8));
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(i);
    if (type == "IDAT" || type == "IEND") {
      grey.insert(grey.end(), begin, begin + static_cast<std::ptrdiff_t>(length));
    }
    i += length;
  }
  return grey;
}

/// Returns the one channel of a mask with several: of three that are equal, 0 where it is
/// transparent, or the opacity if the colour is one for all pixels. Throws std::runtime_error that
/// names the file for other colours.
inline cv::Mat one_channel(const cv::Mat& pixels, const std::filesystem::path& file) {
  if (pixels.channels() == 1) return pixels;
  std::vector<cv::Mat> channels;
  cv::split(pixels, channels);
  const cv::Mat& mask = channels[0];
  for (std::size_t k = 1; k < 3 && k < channels.size(); ++k) {
    if (cv::countNonZero(mask != channels[k]) == 0) continue;
    throw_file_error(file, "a mask in colours; want one channel, equal channels or a palette");
  }
  if (channels.size() < 4) return mask;
  const cv::Mat& opacity = channels[3];
  const auto is_uniform = [](const cv::Mat& channel) {
    double low = 0, high = 0;
    cv::minMaxLoc(channel, &low, &high);
    return low == high;
  };
  if (is_uniform(mask) && !is_uniform(opacity)) return opacity;
  channels[0].setTo(0, opacity == 0);
  return mask;
}

/// Reads the mask of a frame of this size, empty if it is unknown: CV_8UC1 or CV_16UC1, of a
/// palette the indices. Throws std::runtime_error that names the file, also for one that is neither
/// PNG nor JPEG.
inline cv::Mat read_mask(const std::filesystem::path& file, cv::Size frame) {
  const std::vector<std::uint8_t> bytes = read_bytes(file);
  if (size_in_header(bytes).empty()) {
    decode_image(file, bytes, cv::IMREAD_UNCHANGED);  // may know what else it is
    throw_file_error(file, "cannot be decoded: truncated, or no PNG");
  }
  const bool is_png = bytes.size() > PngHeader::end && bytes[0] == 0x89 && bytes[1] == 'P';
  const bool has_palette = is_png && bytes[PngHeader::colour_type] == PngHeader::palette;
  if (!has_palette || is_truncated_png(bytes)) {
    cv::Mat mask = one_channel(decode_image(file, bytes, cv::IMREAD_UNCHANGED, frame), file);
    if (mask.depth() == CV_8U || mask.depth() == CV_16U) return mask;
    throw_file_error(file, "a mask of type " + type_name(mask) + "; want 8 or 16 bits");
  }
  cv::Mat indices = decode_image(file, without_palette(bytes), cv::IMREAD_UNCHANGED, frame);
  const int bits = bytes[PngHeader::bit_depth];
  if (bits < 8) indices /= 255 / ((1 << bits) - 1);  // the decoder scales them to 0 … 255
  return indices;
}

/// Returns the different non-zero values of at most 30 of the masks, in rising order. Ignores files
/// that cannot be read: who uses the mask says what is wrong.
inline std::vector<int> mask_values(const std::vector<std::filesystem::path>& files) {
  constexpr std::size_t max_masks = 30;
  std::vector<bool> is_there(65536);
  for (std::size_t i = 0; i < files.size(); i += files.size() / max_masks + 1) {
    cv::Mat1w wide;
    try {
      read_mask(files[i], {}).convertTo(wide, CV_16U);
    } catch (const std::runtime_error&) {
      continue;
    }
    for (const std::uint16_t value : wide) is_there[value] = true;
  }
  std::vector<int> values;
  for (std::size_t value = 1; value < is_there.size(); ++value) {
    if (is_there[value]) values.push_back(static_cast<int>(value));
  }
  return values;
}

}  // namespace dynfilter::detail
