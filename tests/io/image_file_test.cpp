// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "io/image_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/expect_error.hpp"
#include "support/scene_images.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::detail {
namespace {

using Bytes = std::vector<std::uint8_t>;
using testing::expect_error;
using testing::TemporaryFolder;

Bytes jpeg(const std::vector<int>& flags) {
  Bytes bytes;
  cv::imencode(".jpg", testing::texture({61, 43}, 3), bytes, flags);
  return bytes;
}

/// JPEG images as cameras write them: plain, progressive, with restarts, with a preview inside,
/// with padding before markers.
std::vector<Bytes> jpegs() {
  Bytes with_preview = jpeg({});
  const Bytes preview = jpeg({cv::IMWRITE_JPEG_QUALITY, 20});
  const std::size_t length = preview.size() + 2;
  Bytes segment = {0xFF, 0xE1, static_cast<std::uint8_t>(length >> 8U),
                   static_cast<std::uint8_t>(length & 255U)};
  segment.insert(segment.end(), preview.begin(), preview.end());
  with_preview.insert(with_preview.begin() + 2, segment.begin(), segment.end());
  Bytes padded = jpeg({});
  padded.insert(padded.begin() + 2, 3, 0xFF);
  padded.insert(padded.end() - 2, 2, 0xFF);
  return {jpeg({}), jpeg({cv::IMWRITE_JPEG_PROGRESSIVE, 1}),
          jpeg({cv::IMWRITE_JPEG_RST_INTERVAL, 2}), with_preview, padded};
}

TEST(ImageFile, KnowsATruncatedJpegWhereverItWasCut) {
  for (const Bytes& whole : jpegs()) {
    EXPECT_FALSE(is_truncated_jpeg(whole));
    for (std::size_t size = 2; size + 1 < whole.size(); ++size) {
      EXPECT_TRUE(is_truncated_jpeg(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size))))
          << size << " of " << whole.size() << " bytes";
    }
    Bytes with_more = whole;
    with_more.insert(with_more.end(), 100, 0x55);
    EXPECT_FALSE(is_truncated_jpeg(with_more)) << "cameras write more behind the image";
  }
  EXPECT_FALSE(is_truncated_jpeg({}));
  EXPECT_FALSE(is_truncated_jpeg({0xFF, 0xFB, 0x90, 0x00})) << "music begins with FF, too";
  EXPECT_FALSE(is_truncated_jpeg({0x89, 'P', 'N', 'G'}));
}

TEST(ImageFile, RefusesATruncatedJpegByName) {
  const TemporaryFolder folder;
  for (const Bytes& whole : jpegs()) {
    const auto write = [&](std::size_t size) {
      std::ofstream(folder / "image.jpg", std::ios::binary)
          << std::string(whole.begin(), whole.begin() + std::ptrdiff_t(size));
    };
    write(whole.size());
    EXPECT_EQ(read_image(folder / "image.jpg", cv::IMREAD_GRAYSCALE).size(), cv::Size(61, 43));
    write(whole.size() / 3);
    expect_error<std::runtime_error>(
        [&] { read_image(folder / "image.jpg", cv::IMREAD_GRAYSCALE); },
        "image.jpg: cannot be decoded: truncated, or no image");
  }
}

}  // namespace
}  // namespace dynfilter::detail
