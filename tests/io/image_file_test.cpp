// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "io/image_file.hpp"

#include "support/scene_images.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using namespace detail;
namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

Bytes jpeg(const std::vector<int>& flags) {
  Bytes bytes;
  cv::imencode(".jpg", texture({61, 43}, 3), bytes, flags);
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
    expect_failure([&] { read_image(folder / "image.jpg", cv::IMREAD_GRAYSCALE); },
                   "image.jpg: cannot be decoded: truncated, or no image");
  }
}

/// A small file that holds a large image must be known before it is decoded.
TEST(ImageFile, RefusesALargeImageByItsHeader) {
  for (const char* name : {"image.png", "image.jpg"}) {
    const TemporaryFolder folder;
    Bytes bytes;
    cv::imencode(fs::path(name).extension().string(), cv::Mat1b(24, 6000, 7), bytes);
    EXPECT_EQ(size_in_header(bytes), cv::Size(6000, 24));
    folder.write(name, std::string(bytes.begin(), bytes.end()));
    const auto read = [&](cv::Size frame) { return read_image(folder / name, 0, frame).size(); };
    EXPECT_EQ(read({}), cv::Size(6000, 24));
    EXPECT_EQ(read({1500, 6}), cv::Size(6000, 24));
    expect_failure(
        [&] {
          read({1499, 6});
        },
        std::string(name) + ": 6000x24 pixels; want at most 4 times");
  }
  const TemporaryFolder folder;
  Bytes bytes;
  cv::imencode(".png", cv::Mat1b(1, 1, 7), bytes);
  bytes[17] = bytes[21] = 1;  // 65537 pixels wide and high
  folder.write("image.png", std::string(bytes.begin(), bytes.end()));
  expect_failure([&] { read_image(folder / "image.png", 0); },
                 "65537x65537 pixels; want at most 2^28");
}

// --- Images of another size ----------------------------------------------------------------------

cv::Mat fit(cv::Size own, cv::Size size) {
  return fitted(cv::Mat(own, CV_8UC1, cv::Scalar(7)), size, "mask.png", "the frame",
                "; use retina_masks=True");
}

TEST(Fitted, ResizesTheSameShape) {
  const cv::Mat small = (cv::Mat_<unsigned char>(2, 2) << 1, 2, 3, 4);
  const cv::Mat large = fitted(small, {6, 4}, "mask.png", "the frame", "");
  EXPECT_EQ(large.size(), cv::Size(6, 4));
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) EXPECT_EQ(large.at<unsigned char>(y, x), 1 + y / 2 * 2 + x / 3);
  }
  for (const auto& [own, size] : {std::pair(cv::Size(256, 192), cv::Size(1920, 1440)),
                                  {{640, 427}, {1280, 853}},
                                  {{620, 188}, {1241, 376}},
                                  {{1280, 960}, {640, 480}}}) {
    EXPECT_EQ(fit(own, size).size(), size);
    EXPECT_EQ(cv::countNonZero(fit(own, size) != 7), 0);
  }
}

TEST(Fitted, NamesWhatHasAnotherShape) {
  const auto refuses = [](cv::Size own, cv::Size size, const std::string& part) {
    expect_failure([&] { fit(own, size); }, part);
  };
  refuses({640, 384}, {640, 360},
          "mask.png: 640x384 pixels, but the frame has 640x360; use retina");
  refuses({640, 640}, {640, 480}, "retina_masks=True");
  refuses({448, 640}, {640, 427}, "retina_masks=True");
  refuses({192, 256}, {1920, 1440}, "turned by 90 degrees?");
  refuses({480, 640}, {640, 480}, "turned by 90 degrees?");
  refuses({639, 470}, {640, 480}, "639x470 pixels, but the frame has 640x480");
}

}  // namespace
}  // namespace dynfilter::testing
